//! Scenes at the edge of the format that must run to their end with finite numbers.

use agglo_tests::{record, scene, with};
use serde_json::{Value, json};

/// Runs to the end in both models; positions and velocities at the end.
fn survives(what: &str, value: &Value) -> Vec<agglo_core::state::State> {
    ["paper", "consistent"]
        .map(|model| {
            let value = with(value, &[("/model", json!(model))]);
            let (steps, outcome) = record(&scene(&value));
            assert_eq!(outcome.ending, agglo_core::Ending::Finished, "{what}, {model}");
            for step in &steps {
                let state = &step.state;
                let columns = state.position.axes().into_iter().chain(state.velocity.axes());
                for column in columns.chain(state.temperature.as_deref()) {
                    assert!(column.iter().all(|x| x.is_finite()), "{what}, {model}, {} s", step.time);
                }
                if let Some(sample) = &step.sample {
                    assert!(sample.ledger.balance().is_finite(), "{what}, {model}: {:?}", sample.ledger);
                    assert!(sample.momentum.residual <= 1e-13, "{what}, {model}: {}", sample.momentum.residual);
                }
            }
            steps[steps.len() - 1].state.clone()
        })
        .into()
}

fn particle(x: f64, v: f64, radius: f64, mass: f64) -> Value {
    json!({ "position": [x, 0.0, 0.0], "velocity": [v, 0.0, 0.0], "radius": radius, "mass": mass, "temperature": 300.0 })
}

/// Everything that a scene can name, for some particles.
fn everything(list: &[Value]) -> Value {
    json!({
        "duration": 0.5, "particles": { "list": list },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 },
            "weight": "mass-product", "cutoff": "inflection"
        },
        "binding": { "strength": 1.75, "exponent": 1.0, "range": 1.65 },
        "contact": {
            "restitution": { "e0": 0.5, "v_star": 10.0, "theta_star": 3000.0 },
            "friction": { "static": 0.2, "dynamic": 0.1 }, "duration": { "seconds": 1e-5 }
        },
        "thermal": {
            "heat_capacity": 1000.0, "radiation": { "emissivity": 0.5, "surroundings": 300.0 },
            "convection": { "coefficient": 5.0, "ambient": 280.0 },
            "reaction": { "energy_per_area": 1e6, "force_scale": 1000.0 }
        }
    })
}

#[test]
fn one_particle_flies_straight() {
    // At the origin, where (52) would divide zero by zero, and somewhere else.
    for x in [0.0, 1.0] {
        for v in [0.0, 2.0] {
            for state in survives("one particle", &everything(&[particle(x, v, 0.05, 1.0)])) {
                // 50 to 500 additions of v dt.
                assert!((state.position.x[0] - (x + 0.5 * v)).abs() <= 1e-13 && state.velocity.x[0] == v);
            }
        }
    }
    let bare = json!({ "duration": 1.0, "particles": { "list": [{ "position": [0.0, 0.0, 0.0], "radius": 1.0, "mass": 1.0 }] } });
    survives("one particle and nothing else", &bare);
}

#[test]
fn two_particles_meet() {
    for state in
        survives("two particles", &everything(&[particle(0.0, 1.0, 0.05, 1.0), particle(0.3, -1.0, 0.05, 1.0)]))
    {
        // The same bodies mirrored: they stay each other's image.
        assert!((state.position.x[0] + state.position.x[1] - 0.3).abs() <= 1e-12);
    }
}

#[test]
fn effects_of_strength_zero_do_nothing() {
    let list = [particle(0.0, 1.0, 0.05, 1.0), particle(0.3, -1.0, 0.05, 1.0)];
    let without = json!({
        "duration": 0.5, "particles": { "list": list }, "contact": { "restitution": 0.5, "duration": { "seconds": 1e-5 } },
        "thermal": { "heat_capacity": 1000.0 }
    });
    let zero = with(
        &without,
        &[
            (
                "/near_field",
                json!({
                    "attraction": { "strength": 0.0, "exponent": 1.0 }, "repulsion": { "strength": 0.0, "exponent": 2.0 }
                }),
            ),
            ("/binding", json!({ "strength": 0.0, "exponent": 1.0, "range": 1.65 })),
            ("/thermal/reaction", json!({ "energy_per_area": 0.0, "force_scale": 1000.0 })),
            ("/thermal/convection", json!({ "coefficient": 0.0, "ambient": 280.0 })),
            ("/thermal/radiation", json!({ "emissivity": 0.0, "surroundings": 280.0 })),
            ("/contact/friction", json!({ "static": 0.0, "dynamic": 0.0 })),
        ],
    );
    let (without, zero) = (survives("without", &without), survives("zero", &zero));
    for (a, b) in without.iter().zip(&zero) {
        assert_eq!(a.temperature.as_deref(), Some(&[300.0, 300.0][..]));
        assert_eq!(a.temperature, b.temperature);
        // `consistent` may choose other steps where it estimates a local error (of zero), and sees the impact elsewhere.
        assert_eq!(a.velocity.x.iter().map(|v| v.signum()).collect::<Vec<_>>(), [-1.0, 1.0]);
        for (a, b) in a.velocity.x.iter().zip(&b.velocity.x) {
            assert!((a - b).abs() <= 1e-14, "{a} {b}");
        }
    }
}

#[test]
fn particles_out_of_each_others_reach_do_not_notice() {
    let far = [particle(0.0, 1.0, 0.05, 1.0), particle(1e9, -1.0, 0.05, 1.0), particle(-1e12, 0.0, 0.05, 1.0)];
    for state in survives("a million kilometres apart", &everything(&far)) {
        assert_eq!(state.velocity.x, [1.0, -1.0, 0.0]);
    }
    // Without a cut-off they do, a little, and lists must cope with such extents.
    let many: Vec<Value> = (0..300)
        .map(|k| particle(10_f64.powf(f64::from(k) / 300.0 * 14.0) + 0.2 * f64::from(k), 0.0, 0.05, 1.0))
        .collect();
    survives(
        "a cloud over fourteen decades",
        &with(&everything(&many), &[("/near_field/cutoff", json!(0.3)), ("/duration", json!(0.05))]),
    );
}

#[test]
fn radii_and_masses_may_differ_by_many_decades() {
    let list = [particle(0.0, 0.0, 1.0, 1e6), particle(1.1, -0.5, 1e-4, 1e-12), particle(-2.0, 0.3, 0.1, 1.0)];
    let value = with(
        &everything(&list),
        &[
            (
                "/near_field",
                json!({
                    "attraction": { "strength": 1e-5, "exponent": 1.0 }, "repulsion": { "strength": 1e-6, "exponent": 2.0 },
                    "weight": "mass-product", "cutoff": 1.5
                }),
            ),
            ("/binding/strength", json!(1e-6)),
            ("/duration", json!(0.05)),
        ],
    );
    survives("a grain, a pebble and a boulder", &value);
}
