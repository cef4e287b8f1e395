//! Single impacts against their closed forms, in both models: normal, friction, restitution, walls, losses.

use agglo_core::impact::{Impact, Partner};
use agglo_tests::{Step, record, scene};
use nalgebra::Vector3;
use serde_json::{Value, json};

/// Step of these runs [s]: so short that the normal turns by less than 1e-7 before the impact is seen.
const DT: f64 = 1e-9;
const NORMAL: [f64; 3] = [0.48, -0.6, 0.64];
const ACROSS: [f64; 3] = [0.8, 0.64, 0.0];

/// Particle 0 about to hit particle 1 or a wall with approach speed u and sliding speed w; both ride on a drift.
fn about_to_hit(model: &str, masses: (f64, Option<f64>), u: f64, w: f64, contact: Value) -> Value {
    let (n, t) = (Vector3::from(NORMAL), Vector3::from(ACROSS) / Vector3::from(ACROSS).norm());
    assert!(n.dot(&t).abs() < 1e-15);
    let (b_i, b_j) = (0.1, 0.03);
    // A gap of half the distance that counts as touching.
    let gap = 0.5e-9 * 2.0 * b_j;
    let origin = Vector3::new(0.2, 0.1, -0.3);
    let drift = if masses.1.is_some() { Vector3::new(0.3, -0.7, 0.2) } else { Vector3::zeros() };
    let v_i = drift + n * u + t * w;
    let mut list = vec![json!({
        "position": origin.as_slice(), "velocity": v_i.as_slice(), "radius": b_i, "mass": masses.0, "temperature": 300.0
    })];
    let mut value = json!({
        "model": model, "duration": DT, "particles": {}, "contact": contact, "solver": { "step": { "fixed": DT } }
    });
    if model == "paper" {
        // Impacts last a part of the step, which does not matter where there is no field.
        value["contact"]["duration"] = json!({ "step_fraction": 1e-3 });
    } else {
        value["contact"]["rest_speed"] = json!(1e-6);
    }
    match masses.1 {
        Some(m_j) => {
            let position = origin + n * (b_i + b_j + gap);
            list.push(json!({
                "position": position.as_slice(), "velocity": drift.as_slice(), "radius": b_j, "mass": m_j,
                "temperature": 500.0
            }));
        }
        None => {
            let point = origin + n * (b_i + gap);
            value["domain"] = json!({ "walls": [{ "point": point.as_slice(), "normal": (n * -3.0).as_slice() }] });
        }
    }
    value["particles"] = json!({ "list": list });
    value
}

/// The one impact of a run, and the steps before and after it.
fn impact_of(value: &Value) -> (Impact, Step, Step) {
    let (mut steps, outcome) = record(&scene(value));
    assert_eq!(outcome.counters.impacts, 1, "{value}");
    let after = steps.pop().unwrap();
    let before = steps.pop().unwrap();
    (after.impacts[0], before, after)
}

/// What an impact must do.
struct Expected {
    m_eff: f64,
    e: f64,
    /// Sliding speed after [m/s].
    slide: f64,
}

/// Velocities, impulses, losses of an impact against Newton's law and (33), to round-off.
fn check(what: &str, value: &Value, u: f64, w: f64, expected: &Expected) -> Impact {
    let (impact, before, after) = impact_of(value);
    let n = Vector3::from(impact.normal);
    // The pair moved for DT at a few m/s over a distance of 0.1 m.
    assert!((n - Vector3::from(NORMAL)).norm() <= 1e-7, "{what}: normal {n}");
    let relative = |step: &Step| {
        let v = &step.state.velocity;
        if v.len() > 1 { v.get(0) - v.get(1) } else { v.get(0) }
    };
    let (v, v_after) = (relative(&before), relative(&after));
    let speed = v.norm() + 1.0;
    // Round-off of a few operations on velocities of this size; against a mass a million times smaller, the impulse is
    // divided by it, which is exact to a rounding of the result.
    let near = |name: &str, a: f64, b: f64| assert!((a - b).abs() <= 1e-14 * speed, "{what}: {name} {a}, not {b}");
    near("approach", v.dot(&n), -impact.gap_rate_before);
    near("separation", -v_after.dot(&n), expected.e * v.dot(&n));
    near("gap rate after", impact.gap_rate_after, expected.e * v.dot(&n));
    near("restitution", impact.restitution, expected.e);
    let across = |v: Vector3<f64>| v - n * v.dot(&n);
    // Sliding depends on the normal, known to 1e-7, and on the threshold's side, which is kept by the masses' choice.
    assert!((across(v_after).norm() - expected.slide).abs() <= 1e-7 * (u + w), "{what}: slides {}", across(v_after));
    assert!((Vector3::from(impact.tangential_before) - across(v)).norm() <= 1e-14 * speed, "{what}");
    assert!((Vector3::from(impact.tangential_after) - across(v_after)).norm() <= 1e-14 * speed, "{what}");
    // Friction never turns the sliding round.
    assert!(across(v).dot(&across(v_after)) >= -1e-14 * speed * speed, "{what}");
    let normal_impulse = expected.m_eff * (1.0 + expected.e) * v.dot(&n);
    near("normal impulse", impact.normal_impulse / expected.m_eff, normal_impulse / expected.m_eff);
    let sample = after.sample.as_ref().unwrap();
    let totals = sample.ledger.totals;
    let (impact_loss, friction_loss) = (
        0.5 * expected.m_eff * (1.0 - expected.e * expected.e) * v.dot(&n).powi(2),
        0.5 * expected.m_eff * (across(v).norm_squared() - across(v_after).norm_squared()),
    );
    let energy = expected.m_eff * speed * speed;
    assert!((totals.impact_loss - impact_loss).abs() <= 1e-14 * energy, "{what}: {} {impact_loss}", totals.impact_loss);
    assert!((totals.friction_loss - friction_loss).abs() <= 1e-14 * energy, "{what}: {}", totals.friction_loss);
    // The balance subtracts kinetic energies, the drift's included.
    assert!(sample.ledger.residual.abs() <= 1e-14 * sample.ledger.kinetic.max(energy), "{what}: {:?}", sample.ledger);
    // The share of the momentum there was before: what is left may be next to nothing.
    let sizes =
        |step: &Step| (0..step.state.velocity.len()).map(|i| step.state.velocity.get(i).norm()).fold(0.0, f64::max);
    let unexplained = sample.momentum.residual * sizes(&after) / sizes(&before);
    assert!(unexplained <= 1e-15, "{what}: {unexplained}");
    impact
}

const MODELS: [&str; 2] = ["paper", "consistent"];
const MASSES: [(f64, Option<f64>); 6] =
    [(1.0, Some(1.0)), (1.0, Some(1e6)), (1e6, Some(1.0)), (3.0, Some(0.2)), (1.0, None), (1e-9, None)];

fn effective((m_i, m_j): (f64, Option<f64>)) -> f64 {
    m_j.map_or(m_i, |m_j| m_i * m_j / (m_i + m_j))
}

#[test]
fn frictionless_impacts_obey_newtons_law() {
    for model in MODELS {
        for masses in MASSES {
            for e in [0.0, 0.3, 0.8, 1.0] {
                for (u, w) in [(1.0, 0.0), (2.0, 1.5), (0.1, 4.0)] {
                    let what = format!("{model}, masses {masses:?}, e = {e}, ({u}, {w}) m/s");
                    let value = about_to_hit(model, masses, u, w, json!({ "restitution": e }));
                    let impact = check(&what, &value, u, w, &Expected { m_eff: effective(masses), e, slide: w });
                    assert_eq!((impact.slip, impact.tangential_impulse), (None, [0.0; 3]), "{what}");
                    let partner = if masses.1.is_some() { Partner::Particle(1) } else { Partner::Wall(0) };
                    assert_eq!((impact.particle, impact.partner, impact.heat), (0, partner, 0.0), "{what}");
                }
            }
        }
    }
}

#[test]
fn a_contact_sticks_up_to_the_static_limit_and_slips_beyond() {
    let (mu_s, mu_d) = (0.3, 0.2);
    for model in MODELS {
        for masses in MASSES {
            for e in [0.0, 0.5, 1.0] {
                let u = 2.0;
                let limit = mu_s * (1.0 + e) * u;
                for (w, sticks) in
                    [(0.0, true), (0.5 * limit, true), (0.999 * limit, true), (1.001 * limit, false), (5.0, false)]
                {
                    let what = format!("{model}, masses {masses:?}, e = {e}, sliding at {w} m/s");
                    let contact = json!({ "restitution": e, "friction": { "static": mu_s, "dynamic": mu_d } });
                    let value = about_to_hit(model, masses, u, w, contact);
                    let slide = if sticks { 0.0 } else { w - mu_d * (1.0 + e) * u };
                    let impact = check(&what, &value, u, w, &Expected { m_eff: effective(masses), e, slide });
                    assert_eq!(impact.slip, Some(!sticks), "{what}");
                    if !sticks {
                        // Coulomb: the size of the impulse does not depend on how fast it slides.
                        let size = Vector3::from(impact.tangential_impulse).norm();
                        assert!((size / (mu_d * impact.normal_impulse) - 1.0).abs() <= 1e-14, "{what}: {size}");
                    }
                }
            }
        }
    }
}

#[test]
fn restitution_falls_with_speed_and_temperature() {
    let law = json!({ "e0": 0.8, "e_min": 0.05, "v_star": 10.0, "theta_star": 3000.0 });
    for model in MODELS {
        for (masses, theta) in [((1.0, Some(2.0)), 400.0), ((1.0, None), 300.0)] {
            for u in [0.5, 4.0, 9.9, 25.0] {
                for scale in [1.0, 5.0, 7.5, 20.0] {
                    let mut value = about_to_hit(model, masses, u, 0.0, json!({ "restitution": law }));
                    value["thermal"] = json!({ "heat_capacity": 1000.0 });
                    for particle in value["particles"]["list"].as_array_mut().unwrap() {
                        particle["temperature"] = json!(scale * particle["temperature"].as_f64().unwrap());
                    }
                    // The mean of the two, the particle's own against a wall; plastic from theta* on, and no division by e.
                    let hot = (1.0 - scale * theta / 3000.0_f64).max(0.0);
                    let e = (0.8 * (1.0 - u / 10.0)).max(0.05) * hot;
                    let what = format!("{model}, {masses:?}, {u} m/s, {} K", scale * theta);
                    let (impact, ..) = impact_of(&value);
                    // The approach seen differs from u by the square of the normal's turn and by round-off.
                    assert!((impact.restitution - e).abs() <= 1e-13, "{what}: {} {e}", impact.restitution);
                    assert!((impact.gap_rate_after - e * u).abs() <= 1e-13 * (u + 1.0), "{what}: {impact:?}");
                }
            }
        }
    }
}

/// The paper forgets the second half of "touching and approaching": without it a separating pair is pulled back.
#[test]
fn separating_pairs_are_left_alone() {
    for model in MODELS {
        for masses in [(1.0, Some(2.0)), (1.0, None)] {
            for u in [-1.0, -1e-3] {
                let contact = json!({ "restitution": 0.5, "friction": { "static": 0.3, "dynamic": 0.2 } });
                let (steps, outcome) = record(&scene(&about_to_hit(model, masses, u, 3.0, contact)));
                assert_eq!(outcome.counters.impacts, 0, "{model} {masses:?}");
                assert_eq!(steps[0].state.velocity, steps[1].state.velocity);
            }
        }
    }
}

/// A repelling cloud under `paper`, with impacts that last the whole step: where the field makes (28) negative nothing
/// is reported, no friction, no heat; every impact that is reported pushes.
#[test]
fn every_impact_of_a_repelling_cloud_pushes() {
    for e in [0.0, 0.5] {
        let value = json!({
            "model": "paper", "seed": 5, "duration": 0.5,
            "particles": { "random_cube": {
                "count": 100, "side": 1.0, "radius_ratio": 0.45, "density": 200.0, "velocity_spread": [3.0, 3.0, 3.0]
            } },
            "near_field": { "repulsion": { "strength": 0.05, "exponent": 3.0 }, "cutoff": 0.5 },
            "contact": { "restitution": e, "duration": { "step_fraction": 1.0 },
                         "friction": { "static": 0.3, "dynamic": 0.2 } }
        });
        let (steps, outcome) = record(&scene(&value));
        assert!(outcome.counters.impacts > 100, "{:?}", outcome.counters);
        let mut clamped = 0;
        for step in &steps[1..] {
            for impact in &step.impacts {
                assert!(impact.normal_impulse > 0.0 && impact.gap_rate_before < 0.0, "{impact:?}");
                // Coulomb's bound with the impulse reported.
                let across = Vector3::from(impact.tangential_impulse).norm();
                assert!(across <= 0.3 * impact.normal_impulse * (1.0 + 1e-14), "{impact:?}");
            }
            clamped += step.diagnostics.as_ref().unwrap().contacts - step.impacts.len() as u64;
        }
        // After a plastic impact the pair parts at round-off speed, still overlapping: the repulsion outweighs its approach.
        assert!(clamped > 0 || e > 0.0, "{:?}", outcome.counters);
    }
}
