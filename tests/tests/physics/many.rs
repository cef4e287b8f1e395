//! Many impacts: the bouncing ball, break shot, cradle, dense gas; what they conserve and what they never gain.

use agglo_tests::{Random, record, run, scene, shipped, with};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Heights of the peaks of the lowest point of a ball on the plane z = 0, and its states at the end.
fn peaks(value: &Value) -> (Vec<f64>, f64, f64) {
    let (mut peaks, mut rising, mut last) = (Vec::new(), false, (0.0, 0.0));
    run(&scene(value), |report| {
        let (z, v) = (report.state.position.z[0] - report.particles.radius[0], report.state.velocity.z[0]);
        if rising && v <= 0.0 {
            peaks.push(z);
        }
        rising = v > 0.0;
        last = (z, v);
    });
    (peaks, last.0, last.1)
}

#[test]
fn a_ball_bounces_to_e_squared_of_its_height() {
    let (h, e, speed) = (1.0, 0.8_f64, (2.0_f64 * 9.81).sqrt());
    for dt in [1e-3, 1e-4] {
        let (found, ..) = peaks(&with(&shipped("bouncing-ball"), &[("/solver/step/fixed", json!(dt))]));
        assert!(found.len() >= 8, "{found:?}");
        for (k, peak) in found.iter().take(8).enumerate() {
            let expected = h * e.powi(2 * (k as i32 + 1));
            // An impact is seen up to a step late, v dt below the floor; the ball leaves from there with e times a speed
            // that is too high by g dt: a loss of at most (1 - e^2) v dt in height, v = 4.43 m/s at the first. What
            // earlier impacts lost falls with e^2, their v with e: in all less than 2 v dt.
            let allowed = 2.0 * speed * dt;
            assert!((peak - expected).abs() <= allowed, "dt {dt}: peak {k} at {peak} m, not {expected} +- {allowed}");
        }
    }
}

#[test]
fn a_ball_comes_to_rest_on_the_floor_after_infinitely_many_impacts() {
    let dt = 1e-3;
    let value = with(&shipped("bouncing-ball"), &[("/solver/step/fixed", json!(dt))]);
    let (steps, outcome) = record(&scene(&value));
    // The Zeno time: sqrt(2 h/g) (1 + e)/(1 - e). Impacts up to a step late, and a rest speed below which they end.
    let zeno = (2.0_f64 / 9.81).sqrt() * 9.0;
    let last = steps.iter().rev().find(|step| !step.impacts.is_empty()).unwrap().time;
    assert!((last - zeno).abs() <= 0.1, "the last impact was at {last} s, the sum of the series is {zeno} s");
    let end = &steps[steps.len() - 1];
    // At rest: no speed but what gravity adds in one step.
    assert!(end.state.velocity.z[0].abs() <= 9.81 * dt, "{}", end.state.velocity.z[0]);
    // What rests does not sink.
    let z = end.state.position.z[0] - 0.05;
    let early = steps.iter().find(|step| step.time > last + 0.1).unwrap().state.position.z[0] - 0.05;
    assert!((z - early).abs() <= 1e-9, "a resting ball sank from {early} m to {z} m in {} s", 5.0 - last - 0.1);
    // On the floor, not in it: an impact is seen at most v dt late.
    assert!(z.abs() <= 4.43 * dt, "the ball rests {z} m above the floor");
    // Its energy is all accounted for: kinetic and potential at the end, and what impacts took.
    let size = outcome.sample.ledger.totals.impact_loss;
    assert!(outcome.sample.ledger.residual.abs() <= 1e-9 * size, "{:?}", outcome.sample.ledger);
}

/// Balls of radius 0.05 m and mass 1 kg on given places; the first moves along x.
fn balls(places: &[[f64; 3]], speed: f64, e: f64) -> Value {
    let list: Vec<Value> = places
        .iter()
        .enumerate()
        .map(|(k, place)| {
            let velocity = [if k == 0 { speed } else { 0.0 }, 0.0, 0.0];
            json!({ "position": place, "velocity": velocity, "radius": 0.05, "mass": 1.0 })
        })
        .collect();
    json!({
        "duration": 0.5, "particles": { "list": list }, "contact": { "restitution": e, "rest_speed": 0.0 },
        "solver": { "step": { "fixed": 1e-4 } }
    })
}

/// Runs, checks that kinetic energy never grows and momentum stays, and gives the velocities at the end.
fn never_gains(what: &str, value: &Value) -> Vec<Vector3<f64>> {
    let (mut last, mut start) = (f64::INFINITY, 0.0);
    let mut velocities = Vec::new();
    run(&scene(value), |report| {
        let kinetic = report.sample.unwrap().ledger.kinetic;
        if report.step == 0 {
            start = kinetic;
        }
        // An impact with e = 1 rounds in its impulse and in two velocities.
        assert!(kinetic <= last + 1e-14 * start, "{what}: {last} grew to {kinetic} at {} s", report.time);
        assert!(report.sample.unwrap().momentum.residual <= 1e-13, "{what}");
        last = kinetic;
        velocities = (0..report.particles.len()).map(|i| report.state.velocity.get(i)).collect();
    });
    velocities
}

#[test]
fn a_cradle_hands_its_speed_on_and_gains_nothing() {
    for gap in [0.0, 1e-6, 1e-3] {
        for e in [1.0, 0.9, 0.5, 0.0] {
            // Touching up to a rounding that places them apart.
            let places: Vec<[f64; 3]> = (0..5)
                .map(|k| [f64::from(k) * (0.1 + gap + 1e-15) - if k == 0 { 0.05 } else { 0.0 }, 0.0, 0.0])
                .collect();
            let what = format!("cradle of five, gaps {gap} m, e = {e}");
            let v = never_gains(&what, &balls(&places, 1.0, e));
            if e == 1.0 {
                // In a row numbered along the blow, one pair after the other is the right answer.
                for (k, v) in v.iter().enumerate() {
                    let expected = if k == 4 { 1.0 } else { 0.0 };
                    assert!((v.x - expected).abs() <= 1e-12, "{what}: ball {k} at {} m/s", v.x);
                }
            }
        }
    }
}

#[test]
fn break_shots_gain_nothing() {
    let (s, c) = (30_f64.to_radians().sin(), 30_f64.to_radians().cos());
    let touch = 0.1 + 1e-12;
    for e in [1.0, 0.7, 0.0] {
        let two = [[-0.03 - c * touch, 0.0, 0.0], [0.0, s * touch, 0.0], [0.0, -s * touch, 0.0]];
        never_gains(&format!("break shot at two, e = {e}"), &balls(&two, 1.0, e));
        // The full rack: rows of one to five.
        let mut rack = vec![[-0.15, 0.002, 0.0]];
        for row in 0..5 {
            for k in 0..=row {
                rack.push([f64::from(row) * c * touch, (f64::from(k) - 0.5 * f64::from(row)) * touch, 0.0]);
            }
        }
        never_gains(&format!("full rack, e = {e}"), &balls(&rack, 2.0, e));
    }
}

/// The example that Newton's law solved at once gains energy from: (1, 0, 0.1) m/s in a row.
#[test]
fn three_in_a_row_with_mixed_speeds_gain_nothing() {
    for e in [1.0, 0.9, 0.5, 0.05] {
        let mut value = balls(&[[0.0; 3], [0.1 + 1e-12, 0.0, 0.0], [0.2 + 2e-12, 0.0, 0.0]], 1.0, e);
        value["particles"]["list"][2]["velocity"] = json!([0.1, 0.0, 0.0]);
        never_gains(&format!("three in a row, e = {e}"), &value);
    }
}

/// A dense cloud of unequal spheres in open space.
fn dense(e: f64, friction: bool) -> Value {
    let mut random = Random(11);
    let list: Vec<Value> = (0..216)
        .map(|k: u32| {
            let site = [k % 6, (k / 6) % 6, k / 36].map(f64::from);
            let radius = random.between(0.3, 0.44);
            // Towards the middle, so that they keep meeting for a while, and at random.
            let velocity: Vec<f64> = site.iter().map(|x| 2.0 * (2.5 - x) + random.between(-3.0, 3.0)).collect();
            let jitter = random.vector(-0.05, 0.05);
            let position: Vec<f64> = (0..3).map(|a| site[a] + jitter[a]).collect();
            json!({ "position": position, "velocity": velocity, "radius": radius, "density": 1.0 })
        })
        .collect();
    let mut value = json!({
        "duration": 1.0, "particles": { "list": list }, "contact": { "restitution": e, "rest_speed": 0.0 },
        "solver": { "step": { "initial": 1e-4, "max": 1e-2 } }
    });
    if friction {
        value["contact"]["friction"] = json!({ "static": 0.4, "dynamic": 0.3 });
    }
    value
}

#[test]
fn a_dense_elastic_cloud_conserves_energy_momentum_and_angular_momentum() {
    let (steps, outcome) = record(&scene(&dense(1.0, false)));
    assert!(outcome.counters.impacts > 1000, "{:?}", outcome.counters);
    let first = steps[0].sample.as_ref().unwrap();
    // Each impact rounds velocities of a few m/s a few times; a few thousand of them at random signs stay below
    // 100 * 1e-16 of the sum of sizes.
    for sample in steps.iter().filter_map(|step| step.sample.as_ref()) {
        let energy = (sample.ledger.kinetic - first.ledger.kinetic).abs() / first.ledger.kinetic;
        assert!(energy <= 1e-13, "kinetic energy off by {energy:e}");
        assert!(sample.momentum.residual <= 1e-13, "{:e}", sample.momentum.residual);
        let size = first.ledger.kinetic; // about sum of m v * (r of 3 m) / (v of 5 m/s)
        let angular = Vector3::from(sample.momentum.angular) - Vector3::from(first.momentum.angular);
        assert!(angular.norm() <= 1e-13 * size, "angular momentum off by {:e} of {size}", angular.norm());
    }
    assert_eq!(outcome.sample.ledger.totals.friction_loss, 0.0);
}

#[test]
fn a_dense_inelastic_cloud_only_loses_energy_and_conserves_momentum() {
    for (e, friction) in [(0.9, false), (0.5, true), (0.0, true), (1.0, true)] {
        let what = format!("e = {e}, friction {friction}");
        let mut last = f64::INFINITY;
        let mut losses = (0.0, 0.0);
        let outcome = run(&scene(&dense(e, friction)), |report| {
            let sample = report.sample.unwrap();
            // Round-off of a sum over 216 particles and of the impacts of one step.
            assert!(sample.ledger.kinetic <= last * (1.0 + 1e-14), "{what}: grew to {}", sample.ledger.kinetic);
            assert!(sample.momentum.residual <= 1e-13, "{what}: {:e}", sample.momentum.residual);
            let totals = sample.ledger.totals;
            let now = (totals.impact_loss + totals.resting_loss, totals.friction_loss);
            assert!(now.0 >= losses.0 - 1e-12 && now.1 >= losses.1 - 1e-12, "{what}: losses only grow");
            losses = now;
            last = sample.ledger.kinetic;
        });
        let ledger = outcome.sample.ledger;
        // Round-off of every impact, of which plastic ones without a rest speed take a million and a half.
        assert!(ledger.residual.abs() <= 1e-11 * losses.0.max(losses.1), "{what}: {ledger:?}");
        assert_eq!(losses.1 > 0.0, friction, "{what}");
    }
}

/// Haff's law of the shipped gas: T = T0/(1 + t/tau)^2, 1/tau = (1 - e^2) omega0/6 with Enskog's rate of impacts.
#[test]
fn the_free_cooling_gas_cools_by_haffs_law() {
    let value = shipped("free-cooling-gas");
    let n = 1000.0;
    let side = value["particles"]["random_cube"]["side"].as_f64().unwrap();
    let (e, nu) = (0.9_f64, n / side.powi(3));
    let fraction = std::f64::consts::PI / 6.0 * nu;
    let contact = (1.0 - 0.5 * fraction) / (1.0 - fraction).powi(3);
    let mut start = None;
    let mut seen = 0;
    run(&scene(&value), |report| {
        let Some(sample) = report.sample else { return };
        let temperature = 2.0 / 3.0 * sample.ledger.kinetic / n;
        let t0 = *start.get_or_insert(temperature);
        let omega = 4.0 * std::f64::consts::PI.sqrt() * nu * contact * f64::sqrt(t0);
        let tau = 6.0 / ((1.0 - e * e) * omega);
        let expected = t0 / (1.0 + report.time / tau).powi(2);
        // Enskog's rate holds for a Maxwellian gas of infinitely many spheres. Impacts scatter by 1/sqrt(20 000), the
        // uniform velocities of the start become Maxwellian within the first impacts.
        assert!((temperature / expected - 1.0).abs() <= 0.05, "{} s: {temperature}, Haff {expected}", report.time);
        seen += 1;
    });
    assert!(seen > 200, "{seen}");
}
