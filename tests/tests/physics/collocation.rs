//! Collocation schemes and Newton's method: orders, symmetry, conservation, what a tolerance means, where which converges.

use agglo_core::Simulation;
use agglo_core::state::State;
use agglo_tests::{order, record, scene, with};
use serde_json::{Value, json};

/// Two bodies far from the singularity of the repulsion, and ten near a lattice: smooth within a unit of time, so that
/// steps exist between the asymptotic range and round-off even for order 15.
fn smooth(bodies: usize) -> Value {
    let particles: Vec<Value> = (0..bodies)
        .map(|k| {
            let at = |p: usize, q: usize| 0.9 * ((k / p) % q) as f64 + 0.05 * ((7 * k + 3 * p) % 5) as f64;
            let v = |p: usize| 0.04 * ((5 * k + p) % 7) as f64 - 0.12;
            json!({
                "position": [at(1, 5), at(5, 2), 0.1 * ((3 * k) % 4) as f64], "velocity": [v(1), v(4), v(2)],
                "radius": 0.05, "mass": 1.0 + 0.1 * (k % 3) as f64
            })
        })
        .collect();
    json!({
        "duration": 2.0, "particles": { "list": particles },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 }
        },
        "solver": { "tolerance": { "position": 1e-13 } }
    })
}

fn end(value: &Value) -> State {
    let simulation = &mut agglo_tests::start(&scene(value));
    simulation.run(&mut ()).unwrap();
    simulation.state().clone()
}

/// Largest distance between two states' positions [mean diameters].
fn distance(a: &State, b: &State) -> f64 {
    let apart = |i: usize| (a.position.get(i) - b.position.get(i)).norm();
    (0..a.position.len()).map(apart).fold(0.0, f64::max) / 0.1
}

/// Ten bodies that repel each other: nothing in their motion is fast, whatever the step.
fn spreading(duration: f64) -> Value {
    let mut value = smooth(10);
    value["near_field"] = json!({ "repulsion": { "strength": 0.5, "exponent": 1.0 } });
    value["duration"] = json!(duration);
    value
}

/// Orders from runs with fixed steps. Of order 15 only a lower bound can be had: between errors that still oscillate with the
/// step and round-off there is no room for more (that its quadrature has order 15 and no more is a test of its weights).
#[test]
fn fixed_steps_show_each_schemes_order() {
    let order_of = |value: &Value, integrator: &str, steps: [f64; 2]| {
        let duration = value["duration"].as_f64().unwrap();
        let run = |integrator: &str, steps: f64| {
            let dt = json!(duration / steps);
            // Second-order schemes iterate on positions as they are rounded.
            let tolerance = json!(if integrator.starts_with("gauss") { 1e-13 } else { 1e-10 });
            end(&with(
                value,
                &[
                    ("/solver/integrator", json!(integrator)),
                    ("/solver/step/fixed", dt),
                    ("/solver/tolerance/position", tolerance),
                ],
            ))
        };
        let reference = run("gauss-radau", 64.0);
        let errors = steps.map(|steps| distance(&run(integrator, steps), &reference));
        // Positions of some metres are rounded to a few 1e-15 diameters of 0.1 m; the reference adds as much.
        assert!(errors[1] > 4e-14, "{integrator}: {errors:?} is round-off");
        order(errors[0], errors[1], steps[1] / steps[0])
    };
    for (name, value, fine, finest) in
        [("two", smooth(2), [24.0, 28.0], [5.0, 7.0]), ("ten", spreading(2.0), [16.0, 20.0], [3.0, 4.0])]
    {
        for (integrator, expected, steps, within) in [
            ("backward-euler", 1.0, [2048.0, 4096.0], 0.1),
            ("trapezoidal", 2.0, [256.0, 512.0], 0.1),
            ("velocity-verlet", 2.0, [256.0, 512.0], 0.1),
            // Local orders fall from 8.5 to 8.1 as the step does, and then into round-off.
            ("gauss-legendre", 8.0, fine, 0.2),
        ] {
            let shown = order_of(&value, integrator, steps);
            assert!((shown - expected).abs() <= within, "{integrator}, {name} bodies: order {shown}");
        }
        let shown = order_of(&value, "gauss-radau", finest);
        assert!(shown >= 13.0, "{name} bodies: order {shown}");
    }
}

/// A symmetric scheme with a fixed step and a converged iteration goes back the way it came, whatever its error.
#[test]
fn the_symmetric_scheme_returns() {
    let value =
        with(&smooth(10), &[("/solver/integrator", json!("gauss-legendre")), ("/solver/step/fixed", json!(0.25))]);
    let there = end(&value);
    let mut back = value.clone();
    for k in 0..10 {
        back["particles"]["list"][k]["position"] = json!(<[f64; 3]>::from(there.position.get(k)));
        back["particles"]["list"][k]["velocity"] = json!(<[f64; 3]>::from(-there.velocity.get(k)));
    }
    let back = end(&back);
    let start = agglo_tests::start(&scene(&value)).state().clone();
    // The error of the way there is some 1e-5 diameters; round-off of eight steps and the iteration's 1e-15 are left.
    assert!(distance(&back, &start) <= 1e-12, "{:e}", distance(&back, &start));
}

#[test]
fn energy_stays_bounded_over_a_thousand_periods() {
    // Vibration about the equilibrium, period about 3; six steps in each.
    let value = json!({
        "duration": 3000.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 },
            { "position": [0.6, 0.0, 0.0], "velocity": [0.0, 0.2, 0.0], "radius": 0.05, "mass": 1.0 }
        ] },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 }
        },
        "solver": { "integrator": "gauss-legendre", "step": { "fixed": 0.5 }, "tolerance": { "position": 1e-12 } }
    });
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    agglo_tests::run(&scene(&value), |report| {
        if let Some(sample) = report.sample {
            let which = if report.time < 30.0 { &mut early } else { &mut late };
            *which = which.max(sample.ledger.residual.abs());
        }
    });
    // The energy error of a symplectic scheme vibrates; ten periods of incommensurable steps see most of it. A drift would
    // be a factor 100.
    assert!(early > 1e-10 && late <= 2.0 * early, "{early:e}, then {late:e}");
}

/// What `tolerance` means: the error of the positions at the end, after some ten to forty steps, is of its size.
#[test]
fn the_error_at_the_end_is_near_the_tolerance() {
    let value = with(&smooth(10), &[("/solver/step/max", json!(10.0))]);
    let run = |integrator: &str, tolerance: f64| {
        end(&with(
            &value,
            &[("/solver/integrator", json!(integrator)), ("/solver/tolerance/position", json!(tolerance))],
        ))
    };
    let reference = run("gauss-radau", 1e-14);
    for integrator in ["gauss-legendre", "gauss-radau"] {
        for tolerance in [1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            let shown = distance(&run(integrator, tolerance), &reference) / tolerance;
            // The estimate is of one step and on the safe side; steps add up, and neighbours amplify.
            assert!((1e-3..=10.0).contains(&shown), "{integrator} at {tolerance:e}: {shown:e} of it");
        }
    }
}

#[test]
fn momentum_and_energy_are_kept() {
    for integrator in ["gauss-legendre", "gauss-radau"] {
        let value = with(
            &smooth(10),
            &[
                ("/solver/integrator", json!(integrator)),
                ("/solver/tolerance/position", json!(1e-12)),
                ("/solver/step/max", json!(10.0)),
            ],
        );
        let (_, outcome) = record(&scene(&value));
        let ledger = outcome.sample.ledger;
        let size = ledger.kinetic + ledger.near_field.abs();
        // Local errors of 1e-13 m on forces of about 1 N, some fifty of them; momentum is exact but for rounding.
        assert!(ledger.residual.abs() <= 1e-11 * size, "{integrator}: {:e} J of {size} J", ledger.residual);
        assert!(outcome.sample.momentum.residual <= 1e-14, "{integrator}: {:e}", outcome.sample.momentum.residual);
    }
}

/// A bound pair with omega^2 = 400/s^2, slightly displaced.
fn stiff(integrator: &str, dt: f64) -> Value {
    json!({
        "duration": 20.0 * dt,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 },
            { "position": [0.5, 0.0, 0.0], "velocity": [0.002, 0.0, 0.0], "radius": 0.05, "mass": 1.0 }
        ] },
        "near_field": {
            "attraction": { "strength": 50.0, "exponent": 1.0 }, "repulsion": { "strength": 25.0, "exponent": 2.0 }
        },
        "solver": { "integrator": integrator, "step": { "fixed": dt }, "tolerance": { "position": 1e-9 } }
    })
}

/// The staggered iteration of an implicit scheme contracts by w (omega dt)^2, w the weight of the new acceleration: it
/// diverges where that exceeds one. Newton's method does not mind.
#[test]
fn newton_converges_where_the_staggered_iteration_diverges() {
    for (integrator, weight) in [("backward-euler", 1.0), ("trapezoidal", 0.25)] {
        for square in [0.25_f64, 0.81, 4.0, 100.0] {
            let dt = (square / weight / 400.0).sqrt();
            let value = stiff(integrator, dt);
            let staggered = agglo_tests::start(&scene(&value)).run(&mut ());
            let newton = with(&value, &[("/solver/method", json!("newton"))]);
            let (steps, _) = record(&scene(&newton));
            assert_eq!(staggered.is_ok(), square < 1.0, "{integrator} at {square}: {staggered:?}");
            let most = steps.iter().flat_map(|step| &step.diagnostics).map(|d| d.iterations()).max().unwrap();
            assert!(most <= 8, "{integrator} at {square}: {most} iterations");
            if square < 1.0 {
                // Both solve to 1e-11 diameters in every one of twenty steps, and errors add up.
                assert!(distance(&end(&value), &end(&newton)) <= 1e-8, "{integrator} at {square}");
            }
        }
    }
}

#[test]
fn newton_converges_quadratically_where_forces_are_smooth() {
    // A step near the limit of the staggered iteration, from a prediction five diameters off.
    let value = with(
        &spreading(0.7),
        &[(
            "/solver",
            json!({
                "integrator": "backward-euler", "method": "newton", "step": { "fixed": 0.7 }, "tolerance": { "position": 1e-10 }
            }),
        )],
    );
    let (steps, _) = record(&scene(&value));
    let errors = &steps[1].diagnostics.as_ref().unwrap().position_errors;
    assert!(errors.len() >= 3, "{errors:?}");
    for pair in errors.windows(2).filter(|pair| pair[0] < 0.3 && pair[1] > 1e-11) {
        // In diameters, where forces bend within some: e' <= c e^2 with c of about one.
        assert!(pair[1] <= 3.0 * pair[0] * pair[0], "{errors:?}");
    }
}

/// Remark 3 of the paper: a method that linearises wants smooth forces. At a cut-off that jumps, the step's equation may
/// have no solution at all, and no iteration finds one.
#[test]
fn a_jump_in_the_force_stops_newton_as_the_paper_says() {
    // A pair just outside a cut-off whose jump pulls it in, less than it drifts out: with the force it ends outside,
    // without it inside.
    let value = json!({
        "duration": 0.1,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 },
            { "position": [1.001, 0.0, 0.0], "velocity": [-0.02, 0.0, 0.0], "radius": 0.05, "mass": 1.0 }
        ] },
        "near_field": { "repulsion": { "strength": 1.0, "exponent": 1.0 }, "cutoff": 1.0 },
        "solver": { "integrator": "backward-euler", "step": { "fixed": 0.1 }, "tolerance": { "position": 1e-9 } }
    });
    for method in ["staggered", "newton"] {
        let value = with(&value, &[("/solver/method", json!(method))]);
        let failure = Simulation::new(&scene(&value)).unwrap().run(&mut ()).unwrap_err();
        assert!(failure.to_string().contains("did not converge"), "{method}: {failure}");
    }
}
