//! Hard cases, one test each, in the default scheme of `consistent`: located impacts, velocity Verlet.

use agglo_tests::{Step, record, run, scene, with};
use nalgebra::Vector3;
use serde_json::{Value, json};

const G: f64 = 9.81;

fn ball(position: [f64; 3], velocity: [f64; 3]) -> Value {
    json!({ "position": position, "velocity": velocity, "radius": 0.05, "mass": 1.0 })
}

fn balls(list: &[Value], duration: f64, dt: f64, e: Value) -> Value {
    json!({
        "duration": duration, "particles": { "list": list }, "contact": { "restitution": e },
        "solver": { "step": { "fixed": dt } }
    })
}

fn velocities(steps: &[Step]) -> Vec<Vector3<f64>> {
    let v = &steps[steps.len() - 1].state.velocity;
    (0..v.len()).map(|i| v.get(i)).collect()
}

/// Many diameters in a step, head-on and grazing at 0.999 of the sum of radii: hit, once, at the right time, the right way.
#[test]
fn no_speed_and_no_angle_tunnels() {
    for offset in [0.0, 0.5, 0.999] {
        for speed in [1.0, 1e2, 1e5] {
            let b = offset * 0.1;
            let dt = 10.0 / speed;
            let list = [ball([-1.0, 0.0, 0.0], [speed, 0.0, 0.0]), ball([0.7, b, 0.0], [0.0; 3])];
            for order in [[0, 1], [1, 0]] {
                let list = order.map(|k| list[k].clone());
                let (steps, outcome) = record(&scene(&balls(&list, dt, dt, json!(0.8))));
                let what = format!("{offset} {speed}");
                assert_eq!((outcome.counters.impacts, outcome.counters.steps), (1, 1), "{what}");
                let impact = &steps[1].impacts[0];
                let run_up = 1.7 - f64::sqrt(0.01 - b * b);
                // The root of a quadratic; grazing, its condition number is 1/sqrt(1 - 0.999^2) = 22.
                assert!((impact.time * speed - run_up).abs() <= 1e-13, "{what}: {} {run_up}", impact.time * speed);
                let n = Vector3::new(f64::sqrt(1.0 - offset * offset), offset, 0.0);
                let lost = n * (0.5 * 1.8 * speed * n.x);
                let v = velocities(&steps);
                let (first, second) = (v[order[0]], v[order[1]]);
                assert!((first - (Vector3::x() * speed - lost)).norm() <= 1e-12 * speed, "{what}: {first}");
                assert!((second - lost).norm() <= 1e-12 * speed, "{what}: {second}");
            }
        }
    }
}

/// The striker meets two balls at the same instant: -0.2 v, and 0.693 v = 2 sqrt(3)/5 v for the others.
#[test]
fn break_shot() {
    let (s, c) = (0.5, f64::sqrt(0.75));
    let touch = 0.1;
    let list = [
        ball([-0.03 - c * touch, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ball([0.0, s * touch, 0.0], [0.0; 3]),
        ball([0.0, -s * touch, 0.0], [0.0; 3]),
    ];
    let (steps, _) =
        record(&scene(&with(&balls(&list, 0.1, 1e-2, json!(1.0)), &[("/contact/rest_speed", json!(0.0))])));
    let v = velocities(&steps);
    assert!((v[0] - Vector3::new(-0.2, 0.0, 0.0)).norm() <= 1e-13, "{}", v[0]);
    for ball in &v[1..] {
        assert!((ball.norm() - 2.0 * 3_f64.sqrt() / 5.0).abs() <= 1e-13, "{ball}");
    }
    let energy: f64 = v.iter().map(|v| v.norm_squared()).sum();
    assert!((energy - 1.0).abs() <= 1e-15, "{energy:e}");
}

/// (0, 0, 0, 0, v) for balls that touch or nearly do, however they are numbered.
#[test]
fn cradle_of_five() {
    for gap in [0.0, 1e-12, 1e-6, 1e-3] {
        for order in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]] {
            let place = |k: usize| {
                let x = k as f64 * (0.1 + gap) - if k == 0 { 0.05 } else { 0.0 };
                ball([x, 0.0, 0.0], [if k == 0 { 1.0 } else { 0.0 }, 0.0, 0.0])
            };
            let list: Vec<Value> = order.iter().map(|&k| place(k)).collect();
            let (steps, _) = record(&scene(&balls(&list, 0.2, 1e-2, json!(1.0))));
            for (v, k) in velocities(&steps).iter().zip(order) {
                let expected = if k == 4 { 1.0 } else { 0.0 };
                assert!((v.x - expected).abs() <= 1e-12, "gap {gap}, {order:?}: ball {k} at {} m/s", v.x);
            }
        }
    }
}

/// Three equal balls in a row: below e = 7 - 4 sqrt(3) = 0.0718 infinitely many impacts in finite time, after which they
/// move as one; above it a few, after which they part.
#[test]
fn inelastic_collapse_of_three() {
    for (e, together) in [(0.02, true), (0.06, true), (0.09, false), (0.3, false)] {
        let list =
            [ball([0.0; 3], [1.0, 0.0, 0.0]), ball([0.13, 0.0, 0.0], [0.0; 3]), ball([0.25, 0.0, 0.0], [0.0; 3])];
        let (steps, outcome) = record(&scene(&balls(&list, 2.0, 0.1, json!(e))));
        let v = velocities(&steps);
        let spread = v[2].x - v[0].x;
        assert!((v.iter().map(|v| v.x).sum::<f64>() - 1.0).abs() <= 1e-14, "{v:?}");
        if together {
            assert!(spread.abs() <= 1e-12, "e = {e}: {v:?}");
            assert!(outcome.counters.impacts >= 10, "{:?}", outcome.counters);
        } else {
            assert!(spread > 1e-4 && outcome.counters.impacts < 20, "e = {e}: {v:?}, {:?}", outcome.counters);
        }
        assert!(outcome.sample.ledger.residual.abs() <= 1e-14, "{:?}", outcome.sample.ledger);
    }
}

/// Peak k at h e^{2k}, the impacts at their times, rest after sqrt(2h/g) (1 + e)/(1 - e).
#[test]
fn a_ball_bounces_to_rest() {
    for dt in [1e-2, 1e-3] {
        let (h, e) = (1.0, 0.8_f64);
        let mut value = balls(&[ball([0.0, 0.0, 0.05 + h], [0.0; 3])], 5.0, dt, json!(e));
        value["domain"] = json!({ "walls": [{ "point": [0, 0, 0], "normal": [0, 0, 1] }] });
        value["external"] = json!({ "gravity": [0.0, 0.0, -G] });
        let (steps, outcome) = record(&scene(&value));
        let impacts: Vec<_> = steps.iter().flat_map(|step| step.impacts.iter().copied()).collect();
        let fall = f64::sqrt(2.0 * h / G);
        let mut time = fall;
        for (k, impact) in impacts.iter().enumerate().take(12) {
            // Parabolas are exact; what is left is the round-off of 500 to 5000 steps of gravity.
            assert!((impact.time - time).abs() <= 1e-11, "{dt}: impact {k} at {}, not {time}", impact.time);
            let speed = f64::sqrt(2.0 * G * h) * e.powi(k as i32);
            assert!((impact.gap_rate_before + speed).abs() <= 1e-10 * speed, "{dt}: {impact:?}");
            time += 2.0 * fall * e.powi(k as i32 + 1);
        }
        let zeno = fall * (1.0 + e) / (1.0 - e);
        let last = impacts[impacts.len() - 1].time;
        // The bounce that would end within a step is the last; all that follow would take 1/(1 - e) as long.
        assert!(last < zeno && zeno - last <= dt / (1.0 - e), "{dt}: at rest at {last} s, the series ends at {zeno} s");
        let end = &steps[steps.len() - 1].state;
        assert!((end.position.z[0] - 0.05).abs() <= 1e-15, "{dt}: rests {} m off", end.position.z[0] - 0.05);
        assert!(end.velocity.z[0].abs() <= 1e-15, "{dt}: {}", end.velocity.z[0]);
        let ledger = outcome.sample.ledger;
        assert!(ledger.residual.abs() <= 1e-12 * G * h, "{dt}: {ledger:?}");
    }
}

/// e = 1 - u/v*: impacts grow exponentially with time, no Zeno point; at rest below a speed, and said so.
#[test]
fn bounces_that_slow_down_for_ever_come_to_rest_below_the_rest_speed() {
    let law = json!({ "e0": 1.0, "v_star": 10.0 });
    let mut value = balls(&[ball([0.0, 0.0, 0.3], [0.0; 3])], 60.0, 1e-2, law);
    value["domain"] = json!({ "walls": [{ "point": [0, 0, 0], "normal": [0, 0, 1] }] });
    value["external"] = json!({ "gravity": [0.0, 0.0, -G] });
    value["contact"]["rest_speed"] = json!(0.04);
    let mut speeds: Vec<f64> = Vec::new();
    let mut told = false;
    let outcome = run(&scene(&value), |report| {
        speeds.extend(report.impacts.iter().map(|impact| -impact.gap_rate_before));
        told |= report.notices.iter().any(|notice| notice.message.contains("resting"));
    });
    assert!(speeds.windows(2).all(|pair| pair[1] < pair[0]), "amplitudes decay");
    for pair in speeds.windows(2) {
        let e = 1.0 - pair[0] / 10.0;
        assert!((pair[1] / (e * pair[0]) - 1.0).abs() <= 1e-9, "{pair:?}");
    }
    assert!(speeds.len() > 100 && speeds[speeds.len() - 1] <= 0.04 && told, "{}", speeds.len());
    assert!(outcome.sample.ledger.kinetic <= 1e-25, "{:?}", outcome.sample.ledger);
}

/// An attracted pair bounces to rest on its contact: no creep, no reheating over 1e5 steps.
#[test]
fn an_attracted_pair_comes_to_rest_and_stays() {
    let mut value = balls(&[ball([0.0; 3], [0.0; 3]), ball([0.13, 0.0, 0.0], [0.0; 3])], 100.0, 1e-3, json!(0.5));
    value["near_field"] = json!({ "attraction": { "strength": 0.2, "exponent": 1.0 } });
    for particle in value["particles"]["list"].as_array_mut().unwrap() {
        particle["temperature"] = json!(300.0);
    }
    value["thermal"] = json!({ "heat_capacity": 1000.0, "reaction": { "energy_per_area": 1e6, "force_scale": 1e3 } });
    value["contact"]["duration"] = json!({ "seconds": 1e-3 });
    let mut heats = Vec::new();
    let outcome = run(&scene(&value), |report| {
        if report.step % 1000 == 0 {
            let sample = report.sample.unwrap();
            heats.push(sample.ledger.totals.reaction_heat);
            if report.time > 5.0 {
                let r = &report.state.position;
                let gap = (r.x[1] - r.x[0]) - 0.1;
                assert!(gap.abs() <= 1e-14, "{} s: gap {gap:e}", report.time);
                assert!(sample.ledger.kinetic <= 1e-28, "{} s: {:e}", report.time, sample.ledger.kinetic);
            }
        }
    });
    assert_eq!(outcome.counters.steps, 100_000);
    assert_eq!(heats[5], heats[heats.len() - 1], "reheated");
    assert!(heats[5] > 0.0);
}

/// A pair in contact on orbit with sliding friction: m_eff v_t' = -mu_d lambda, lambda = F - m_eff v_t^2/(2b).
#[test]
fn friction_brakes_a_touching_pair_on_orbit() {
    let (mu, force, m_eff, s) = (0.2, 3.0, 0.5, 0.1);
    let v0 = 0.5;
    let list = [ball([0.0; 3], [0.0, -0.5 * v0, 0.0]), ball([s, 0.0, 0.0], [0.0, 0.5 * v0, 0.0])];
    let end = 0.1;
    // Runge-Kutta of fourth order on one number, with steps that make its own error negligible.
    let rate = |v: f64| -mu * (force - m_eff * v * v / s) / m_eff;
    let (mut v, h) = (v0, 1e-5);
    for _ in 0..10_000 {
        let k1 = rate(v);
        let k2 = rate(v + 0.5 * h * k1);
        let k3 = rate(v + 0.5 * h * k2);
        let k4 = rate(v + h * k3);
        v += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    let mut errors = Vec::new();
    for dt in [1e-3, 5e-4] {
        let mut value = balls(&list, end, dt, json!(0.5));
        value["contact"]["friction"] = json!({ "static": mu, "dynamic": mu });
        value["near_field"] = json!({ "attraction": { "strength": force, "exponent": 0.0 } });
        let (steps, _) = record(&scene(&value));
        let (r, u) = (&steps[steps.len() - 1].state.position, velocities(&steps));
        let d = r.get(1) - r.get(0);
        assert!((d.norm() - s).abs() <= 1e-14, "{dt}: gap {:e}", d.norm() - s);
        let w = u[1] - u[0];
        assert!(w.dot(&d.normalize()).abs() <= 1e-3, "{dt}: parts at {}", w.dot(&d.normalize()));
        errors.push((w.norm() - v).abs() / v);
    }
    assert!(errors[0] <= 1e-4, "{errors:?}");
    // Half of the friction at each end of a step: second order.
    assert!(errors[1] <= 0.3 * errors[0], "{errors:?}");
}

/// Many crossings of the cut-off and of the activation distance: the residual falls with the square of the step.
#[test]
fn crossings_leave_the_energy_at_second_order() {
    let residual = |dt: f64| {
        let value = json!({
            "seed": 3, "duration": 0.5,
            "particles": { "random_cube": {
                "count": 30, "side": 1.0, "radius_ratio": 0.1, "density": 2000.0, "velocity_spread": [1.0, 1.0, 1.0] } },
            "near_field": {
                "attraction": { "strength": 5.0, "exponent": 1.0 }, "repulsion": { "strength": 0.8, "exponent": 2.0 },
                "weight": "none", "cutoff": 0.5
            },
            "binding": { "strength": 0.4, "exponent": 1.0, "range": 3.0, "weight": "none" },
            "solver": { "step": { "fixed": dt } }
        });
        let outcome = run(&scene(&value), |_| ());
        let ledger = outcome.sample.ledger;
        ledger.residual.abs() / ledger.kinetic
    };
    let errors = [4e-3, 1e-3, 2.5e-4].map(residual);
    let order = (errors[0] / errors[2]).ln() / 16_f64.ln();
    assert!(order >= 1.8, "order {order}: {errors:?}");
    assert!(errors[2] <= 1e-5, "{errors:?}");
}

/// The same numbers in other orders, in a mirror: velocities and impacts come out the same.
#[test]
fn an_impact_does_not_know_its_numbers() {
    let places = [[0.0, 0.0, 0.0], [0.3, 0.02, 0.01], [0.52, -0.01, 0.03], [0.8, 0.03, -0.02]];
    let speeds = [[3.0, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1], [-2.0, 0.0, 0.0]];
    let end = |order: [usize; 4], mirror: f64| {
        let list: Vec<Value> = order
            .iter()
            .map(|&k| {
                let (r, v) = (places[k], speeds[k]);
                ball([mirror * r[0], r[1], r[2]], [mirror * v[0], v[1], v[2]])
            })
            .collect();
        let (steps, outcome) = record(&scene(&balls(&list, 1.0, 0.25, json!(0.9))));
        assert!(outcome.counters.impacts >= 2, "{:?}", outcome.counters);
        let v = velocities(&steps);
        let mut result = vec![[0_u64; 3]; 4];
        for (row, &k) in order.iter().enumerate() {
            result[k] = [(mirror * v[row].x).to_bits(), v[row].y.to_bits(), v[row].z.to_bits()];
        }
        result
    };
    let expected = end([0, 1, 2, 3], 1.0);
    for order in [[3, 2, 1, 0], [1, 0, 3, 2], [2, 3, 0, 1]] {
        assert_eq!(end(order, 1.0), expected, "{order:?}");
    }
    assert_eq!(end([0, 1, 2, 3], -1.0), expected);
}
