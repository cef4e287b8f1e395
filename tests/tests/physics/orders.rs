//! Orders across located events, what does not depend on the step, and how much shifts and boosts may change.

use agglo_core::state::State;
use agglo_tests::{record, scene, with};
use serde_json::{Value, json};

/// Bodies on their way through each other's cut-off: a crossing of two, some dozen of ten, nothing near a singularity.
fn crossing(bodies: usize) -> Value {
    let particles: Vec<Value> = (0..bodies)
        .map(|k| {
            let at = |p: usize, q: usize| 0.9 * ((k / p) % q) as f64 + 0.05 * ((7 * k + 3 * p) % 5) as f64;
            let v = |p: usize| 0.12 * ((5 * k + p) % 7) as f64 - 0.36;
            json!({
                "position": [at(1, 5), at(5, 2), 0.1 * ((3 * k) % 4) as f64], "velocity": [v(1), v(4), v(2)],
                "radius": 0.05, "mass": 1.0 + 0.1 * (k % 3) as f64
            })
        })
        .collect();
    json!({
        "duration": 1.0, "particles": { "list": particles },
        "near_field": { "repulsion": { "strength": 0.3, "exponent": 1.0 }, "cutoff": 1.1 },
        "solver": { "tolerance": { "position": 1e-13 } }
    })
}

/// An attracted pair that bounces a few times, off-centre, and is still bouncing at the end.
fn bouncing() -> Value {
    json!({
        "duration": 1.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "velocity": [0.0, 0.1, 0.0], "radius": 0.05, "mass": 1.0 },
            { "position": [0.2, 0.03, 0.0], "velocity": [0.0, -0.2, 0.1], "radius": 0.05, "mass": 2.0 }
        ] },
        "near_field": { "attraction": { "strength": 0.5, "exponent": 1.0 } },
        "contact": { "restitution": 0.9, "rest_speed": 0.0 },
        "solver": { "tolerance": { "position": 1e-13 } }
    })
}

fn end(value: &Value) -> State {
    let simulation = &mut agglo_tests::start(&scene(value));
    simulation.run(&mut ()).unwrap();
    simulation.state().clone()
}

fn with_steps(value: &Value, integrator: &str, steps: f64) -> State {
    let dt = value["duration"].as_f64().unwrap() / steps;
    let tolerance = json!(if integrator.starts_with("gauss") { 1e-13 } else { 1e-10 });
    end(&with(
        value,
        &[
            ("/solver/integrator", json!(integrator)),
            ("/solver/step/fixed", json!(dt)),
            ("/solver/tolerance/position", tolerance),
        ],
    ))
}

/// Largest distance between two states' positions [m].
fn distance(a: &State, b: &State) -> f64 {
    (0..a.position.len()).map(|i| (a.position.get(i) - b.position.get(i)).norm()).fold(0.0, f64::max)
}

/// Slope of the errors over the step, both logarithmic. Where in a step an event falls is chance: each error is the root mean
/// square of those of so many `neighbours`, each with one step more.
fn slope(value: &Value, integrator: &str, reference: &State, (from, to): (f64, f64), neighbours: u32) -> f64 {
    let count = 16;
    let points: Vec<(f64, f64)> = (0..count)
        .map(|k| {
            let steps = (from * (to / from).powf(f64::from(k) / f64::from(count - 1))).round();
            let error = |more: u32| distance(&with_steps(value, integrator, steps + f64::from(more)), reference);
            let square = (0..neighbours).map(|more| error(more).powi(2)).sum::<f64>() / f64::from(neighbours);
            (-steps.ln(), 0.5 * square.ln())
        })
        .collect();
    let mean = |f: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    mean(&|p| (p.0 - x) * (p.1 - y)) / mean(&|p| (p.0 - x).powi(2))
}

#[test]
fn located_crossings_keep_each_schemes_order() {
    // Implicit steps that end at a jump may have no solution (`a_jump_in_the_force_stops_newton_as_the_paper_says`): two bodies
    // meet one rarely.
    let value = crossing(10);
    let reference = with_steps(&value, "gauss-radau", 64.0);
    for (integrator, bodies, expected, from, to) in [
        ("backward-euler", 2, 1.0, 500.0, 8000.0),
        ("trapezoidal", 2, 2.0, 64.0, 2048.0),
        ("velocity-verlet", 2, 2.0, 64.0, 2048.0),
        ("velocity-verlet", 10, 2.0, 64.0, 2048.0),
        // Its errors are at round-off with ten steps.
        ("gauss-legendre", 2, 8.0, 3.0, 8.0),
    ] {
        let (value, within) = (crossing(bodies), 0.1);
        let reference = with_steps(&value, "gauss-radau", 64.0);
        let shown = slope(&value, integrator, &reference, (from, to), 1);
        println!("{integrator}: {shown}");
        assert!((shown - expected).abs() <= within, "{integrator}: order {shown}");
    }
    let difference = distance(&with_steps(&value, "gauss-legendre", 128.0), &reference);
    // Two schemes of high order that restart at the same crossings: some dozen of them, each known to round-off.
    assert!(difference <= 1e-12, "{difference:e}");
}

#[test]
fn located_impacts_keep_second_order() {
    let value = bouncing();
    let (_, outcome) = record(&scene(&with(&value, &[("/solver/step/fixed", json!(1e-3))])));
    assert!(outcome.counters.impacts >= 2, "{:?}", outcome.counters);
    let reference = with_steps(&value, "velocity-verlet", 400_000.0);
    for integrator in ["trapezoidal", "velocity-verlet"] {
        let shown = slope(&value, integrator, &reference, (200.0, 6000.0), 8);
        println!("{integrator}: {shown}");
        assert!(shown >= 1.9, "{integrator}: order {shown}");
    }
}

/// Steps of collocation end at impacts: an order far above that of the other schemes.
#[test]
fn located_impacts_keep_the_order_of_collocation() {
    let value = with(&bouncing(), &[("/contact/resolution", json!("located"))]);
    let reference = with_steps(&value, "gauss-radau", 100.0);
    let shown = slope(&value, "gauss-legendre", &reference, (24.0, 72.0), 8);
    println!("gauss-legendre: {shown}");
    // Measured: 7.07, steadily over these steps, not the 8 of smooth motion; finer ones end in round-off. An impact at a wrong instant
    // or with a wrong velocity would leave 1.
    assert!(shown >= 6.5, "order {shown}");
    // The other schemes converge to the same, and so does this one with tolerances.
    let verlet = distance(&with_steps(&value, "velocity-verlet", 100_000.0), &reference);
    assert!(verlet <= 1e-9, "{verlet:e}");
    for (integrator, tolerance) in [("gauss-legendre", 1e-9), ("gauss-radau", 1e-9)] {
        let found = end(&with(
            &value,
            &[("/solver/integrator", json!(integrator)), ("/solver/tolerance/position", json!(tolerance))],
        ));
        let error = distance(&found, &reference);
        println!("{integrator}: {error:e} m at a tolerance of {tolerance:e} diameters");
        // A tenth of a metre is the diameter; impacts magnify what was wrong before them.
        assert!(error <= 10.0 * 0.1 * tolerance, "{integrator}: {error:e}");
    }
}

/// Impacts on walls and with friction, reactions and radiation: by schemes of high order what others converge to.
#[test]
fn collocation_knows_all_that_impacts_do() {
    let value = json!({
        "duration": 1.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.06], "velocity": [0.6, 0.1, -0.2], "radius": 0.05, "mass": 1.0, "temperature": 350.0 },
            { "position": [0.2, 0.03, 0.1], "velocity": [-0.3, -0.2, 0.1], "radius": 0.05, "mass": 2.0, "temperature": 500.0 }
        ] },
        "near_field": { "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.05, "exponent": 2.0 } },
        "contact": {
            "restitution": { "e0": 0.9, "v_star": 10.0, "theta_star": 3000.0 }, "resolution": "located",
            "friction": { "static": 0.3, "dynamic": 0.2 }, "duration": { "seconds": 1e-4 }
        },
        "thermal": {
            "heat_capacity": 1.0, "radiation": { "emissivity": 0.5, "surroundings": 300.0 },
            "reaction": { "energy_per_area": 1e3, "force_scale": 100.0 }
        },
        "external": { "gravity": [0.0, 0.0, -2.0] },
        "domain": { "walls": [{ "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0] }] }
    });
    let impacts = |integrator: &str, steps: f64| {
        let dt = 1.0 / steps;
        let changes = [
            ("/solver/integrator", json!(integrator)),
            ("/solver/step/fixed", json!(dt)),
            ("/solver/tolerance/position", json!(1e-13)),
        ];
        let mut simulation = agglo_tests::start(&scene(&with(&value, &changes)));
        let outcome = simulation.run(&mut ()).unwrap();
        (simulation.state().clone(), outcome)
    };
    let (reference, outcome) = impacts("gauss-radau", 100.0);
    let ledger = &outcome.sample.ledger;
    assert!(outcome.counters.impacts >= 4, "{:?}", outcome.counters);
    assert!(ledger.totals.reaction_heat > 0.0 && ledger.totals.friction_loss > 0.0 && ledger.totals.radiated != 0.0);
    // Round-off of energies of a joule, a few events.
    assert!(ledger.residual.abs() <= 1e-13, "{:e}", ledger.residual);
    let (fine, with_verlet) = impacts("velocity-verlet", 100_000.0);
    assert_eq!(with_verlet.counters.impacts, outcome.counters.impacts);
    let theta = |state: &State| state.temperature.clone().unwrap();
    let warmer = theta(&fine).iter().zip(theta(&reference)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    println!("verlet: {:e} m, {warmer:e} K", distance(&fine, &reference));
    assert!(distance(&fine, &reference) <= 1e-8 && warmer <= 1e-6, "{warmer:e}");
}

/// What fields press to rest has no place in a scheme of high order: it says so, and when.
#[test]
fn collocation_refuses_resting_contacts_by_name() {
    for (e, after) in [(0.0, 0.5), (0.5, 1.0)] {
        let value = with(
            &bouncing(),
            &[
                ("/contact/resolution", json!("located")),
                ("/contact/restitution", json!(e)),
                ("/solver/integrator", json!("gauss-legendre")),
                ("/duration", json!(10.0)),
            ],
        );
        let error = agglo_tests::start(&scene(&value)).run(&mut ()).unwrap_err();
        let agglo_core::RunError::Resting { time, .. } = error else { panic!("{error}") };
        assert!(time > 0.1 && time < 4.0 * after, "{error}");
        assert!(error.to_string().contains("velocity-verlet"), "{error}");
    }
}

/// A free pair: its impact and the heat of it are where and what they are, whatever the step.
#[test]
fn the_heat_of_an_impact_does_not_depend_on_the_step() {
    let heat = |step: Value| {
        let particle = |x: f64, v: f64| json!({ "position": [x, 0.0, 0.0], "velocity": [v, 0.2, 0.0], "radius": 0.05, "mass": 1.0, "temperature": 350.0 });
        let value = json!({
            "duration": 0.5, "particles": { "list": [particle(0.0, 1.0), particle(0.41, -0.7)] },
            "contact": {
                "restitution": { "e0": 0.7, "v_star": 10.0, "theta_star": 3000.0 },
                "friction": { "static": 0.3, "dynamic": 0.2 }, "duration": { "seconds": 1e-4 }
            },
            "thermal": { "heat_capacity": 1000.0, "reaction": { "energy_per_area": 1e6, "force_scale": 1e6 } },
            "solver": { "step": step }
        });
        let (_, outcome) = record(&scene(&value));
        assert_eq!(outcome.counters.impacts, 1);
        outcome.sample.ledger.totals.reaction_heat
    };
    let expected = heat(json!({ "fixed": 1e-5 }));
    assert!(expected > 0.0);
    for step in [
        json!({ "fixed": 1e-1 }),
        json!({ "fixed": 1e-2 }),
        json!({ "fixed": 3.3e-3 }),
        json!({ "fixed": 1e-4 }),
        json!({}),
    ] {
        let found = heat(step.clone());
        assert!((found / expected - 1.0).abs() <= 1e-9, "{step}: {found} J, not {expected} J");
    }
}

/// Shifted or set in motion as a whole, a smooth scene comes out as before within a hundred round-offs of what went in.
#[test]
fn shifts_and_boosts_change_round_off_only() {
    let mut value = crossing(10);
    value["near_field"] = json!({ "repulsion": { "strength": 0.3, "exponent": 1.0 } });
    let duration = value["duration"].as_f64().unwrap();
    for integrator in ["velocity-verlet", "trapezoidal", "gauss-legendre", "gauss-radau"] {
        let steps = if integrator.starts_with("gauss") { 20.0 } else { 200.0 };
        let still = with_steps(&value, integrator, steps);
        for (shift, boost) in [([0.3, -1.7, 12.1], [0.0; 3]), ([0.0; 3], [0.7, -3.1, 11.3]), ([1e3; 3], [1.1; 3])] {
            let mut moved = value.clone();
            for particle in moved["particles"]["list"].as_array_mut().unwrap() {
                for axis in 0..3 {
                    particle["position"][axis] = json!(particle["position"][axis].as_f64().unwrap() + shift[axis]);
                    particle["velocity"][axis] = json!(particle["velocity"][axis].as_f64().unwrap() + boost[axis]);
                }
            }
            let mut moved = with_steps(&moved, integrator, steps);
            for i in 0..moved.position.len() {
                let back = [0, 1, 2].map(|axis| -shift[axis] - boost[axis] * duration);
                moved.position.add(i, back.into());
            }
            let size = 5.0 + shift.iter().chain(&boost).fold(0.0_f64, |most, x| most.max(x.abs()));
            let change = distance(&still, &moved);
            println!("{integrator} {shift:?} {boost:?}: {change:e}");
            assert!(change <= 100.0 * f64::EPSILON * size, "{integrator}, {shift:?}, {boost:?}: {change:e}");
        }
    }
}
