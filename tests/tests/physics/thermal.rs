//! Temperatures: cooling against closed forms, reaction heat, never at or below zero.

use agglo_core::scene::Scene;
use agglo_core::thermal::exchange::{STEFAN_BOLTZMANN, STEFAN_BOLTZMANN_PAPER};
use agglo_tests::{order, record, run, scene, with};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Two resting spheres far apart, of unequal size: 1 mm and 2 mm of iron.
fn spheres(model: &str, thermal: Value) -> Value {
    json!({
        "model": model, "duration": 8.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": 1e-3, "density": 7800.0, "temperature": 1500.0 },
            { "position": [1.0, 0.0, 0.0], "radius": 2e-3, "density": 7800.0, "temperature": 120.0 }
        ] },
        "thermal": thermal, "solver": { "step": { "fixed": 0.05 } }
    })
}

/// Surface over heat capacity of a sphere of radius b of that iron, a_s/(m C) = 3/(b rho C) [m^2 K/J].
fn surface_over_capacity(b: f64) -> f64 {
    3.0 / (b * 7800.0 * 500.0)
}

fn temperatures(scene: &Scene) -> Vec<f64> {
    let mut last = Vec::new();
    run(scene, |report| last = report.state.temperature.clone().unwrap());
    last
}

/// theta' = -rate(theta), by fourth-order Runge-Kutta with steps so small that only round-off is left.
fn reference(rate: impl Fn(f64) -> f64, theta: f64, time: f64) -> f64 {
    let n = 40_000;
    let h = time / f64::from(n);
    (0..n).fold(theta, |x, _| {
        let k1 = -rate(x);
        let k2 = -rate(x + 0.5 * h * k1);
        let k3 = -rate(x + 0.5 * h * k2);
        let k4 = -rate(x + h * k3);
        x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    })
}

/// The three kinds of exchange: scene, and the true temperatures after 8 s.
fn exchanges(sigma: f64) -> Vec<(&'static str, Value, [f64; 2])> {
    let radiation = json!({ "emissivity": 0.8, "surroundings": 300.0 });
    let convection = json!({ "coefficient": 150.0, "ambient": 250.0 });
    let truth = |h: f64, emissivity: f64| {
        [(1e-3, 1500.0), (2e-3, 120.0)].map(|(b, theta): (f64, f64)| {
            let a = surface_over_capacity(b);
            let rate = |x: f64| a * (h * (x - 250.0) + sigma * emissivity * (x.powi(4) - 300_f64.powi(4)));
            reference(rate, theta, 8.0)
        })
    };
    vec![
        ("convection", json!({ "heat_capacity": 500.0, "convection": convection }), truth(150.0, 0.0)),
        ("radiation", json!({ "heat_capacity": 500.0, "radiation": radiation }), truth(0.0, 0.8)),
        (
            "both",
            json!({ "heat_capacity": 500.0, "convection": convection, "radiation": radiation }),
            truth(150.0, 0.8),
        ),
    ]
}

#[test]
fn consistent_cooling_is_exact_for_any_step() {
    for (name, thermal, truth) in exchanges(STEFAN_BOLTZMANN) {
        for dt in [0.01, 0.5, 8.0] {
            let value = with(&spheres("consistent", thermal.clone()), &[("/solver/step/fixed", json!(dt))]);
            let theta = temperatures(&scene(&value));
            // Closed forms are good to round-off, at most 800 times; where both act, substeps are held to 1e-10 each, and
            // 8 s take some hundreds of them, or one or more per step.
            let allowed = if name == "both" { 1e-7 } else { 1e-12 };
            for (theta, truth) in theta.iter().zip(truth) {
                assert!((theta / truth - 1.0).abs() <= allowed, "{name}, dt {dt}: {theta} K, not {truth} K");
            }
        }
    }
}

#[test]
fn convection_alone_is_an_exponential() {
    let thermal = json!({ "heat_capacity": 500.0, "convection": { "coefficient": 150.0, "ambient": 250.0 } });
    let mut seen = 0;
    run(&scene(&spheres("consistent", thermal)), |report| {
        let theta = report.state.temperature.as_ref().unwrap();
        let expected = 250.0 + 1250.0 * (-150.0 * surface_over_capacity(1e-3) * report.time).exp();
        // One rounding or two per step, 160 steps.
        assert!((theta[0] / expected - 1.0).abs() <= 1e-13, "{} s: {} K, not {expected} K", report.time, theta[0]);
        seen += 1;
    });
    assert_eq!(seen, 161);
}

#[test]
fn the_papers_cooling_has_order_one() {
    for (name, thermal, truth) in exchanges(STEFAN_BOLTZMANN_PAPER) {
        let errors = [0.05, 0.025, 0.0125].map(|dt| {
            let changes = [("/solver/step/fixed", json!(dt)), ("/solver/tolerance/temperature", json!(1e-12))];
            let theta = temperatures(&scene(&with(&spheres("paper", thermal.clone()), &changes)));
            [theta[0] - truth[0], theta[1] - truth[1]]
        });
        for particle in 0..2 {
            for k in 0..2 {
                let shown = order(errors[k][particle].abs(), errors[k + 1][particle].abs(), 2.0);
                // The next term is the step over the time constant, 0.05 s of seconds, smaller.
                assert!((shown - 1.0).abs() <= 0.1, "{name}, particle {particle}: order {shown} of {errors:?}");
            }
        }
    }
}

#[test]
fn what_the_books_say_of_convection_and_radiation_adds_up() {
    for (model, sigma) in [("consistent", STEFAN_BOLTZMANN), ("paper", STEFAN_BOLTZMANN_PAPER)] {
        for (name, thermal, _) in exchanges(sigma) {
            let outcome = run(&scene(&spheres(model, thermal)), |_| {});
            let ledger = outcome.sample.ledger;
            let start: f64 = [(1e-3_f64, 1500.0), (2e-3, 120.0)]
                .map(|(b, t)| 7800.0 * 4.0 / 3.0 * PI * b.powi(3) * 500.0 * t)
                .iter()
                .sum();
            let lost = ledger.totals.convected + ledger.totals.radiated;
            // Round-off of 160 steps.
            assert!((start - ledger.thermal - lost).abs() <= 1e-13 * start, "{model} {name}: {ledger:?}");
            assert!(ledger.residual.abs() <= 1e-13 * start, "{model} {name}: {ledger:?}");
            assert_eq!(ledger.totals.convected != 0.0, name != "radiation", "{model} {name}: {ledger:?}");
            assert_eq!(ledger.totals.radiated != 0.0, name != "convection", "{model} {name}: {ledger:?}");
        }
    }
}

/// A sphere of a micrometre at 3000 K cools at 2300/s at first: a step of 10 ms must not overshoot.
#[test]
fn a_tiny_hot_sphere_cools_monotonically_and_stays_above_zero() {
    for model in ["paper", "consistent"] {
        for (convection, surroundings) in [(0.0, 300.0), (0.0, 0.0), (2000.0, 300.0), (2000.0, 0.0)] {
            let value = json!({
                "model": model, "duration": 5.0,
                "particles": { "list": [
                    { "position": [0.0, 0.0, 0.0], "radius": 1e-6, "density": 2000.0, "temperature": 3000.0 }
                ] },
                "thermal": {
                    "heat_capacity": 1000.0, "radiation": { "emissivity": 1.0, "surroundings": surroundings },
                    "convection": { "coefficient": convection, "ambient": 1e-3 }
                },
                "solver": { "step": { "fixed": 1e-2 } }
            });
            let mut last = 3000.0;
            run(&scene(&value), |report| {
                let theta = report.state.temperature.as_ref().unwrap()[0];
                assert!(theta > 0.0 && theta <= last, "{model} {convection} {surroundings}: {last} K then {theta} K");
                last = theta;
            });
            // 5 s are 46 time constants at 300 K, 1/(4 sigma a theta_s^3) = 0.11 s: the equilibrium is reached; cooling into
            // a void gives theta^-3 = 3000^-3 + 3 sigma a t.
            if convection == 0.0 {
                let a = 3.0 / (1e-6 * 2000.0 * 1000.0);
                let sigma = if model == "paper" { STEFAN_BOLTZMANN_PAPER } else { STEFAN_BOLTZMANN };
                let expected = if surroundings > 0.0 {
                    surroundings
                } else {
                    (3000_f64.powi(-3) + 3.0 * sigma * a * 5.0).powf(-1.0 / 3.0)
                };
                // `paper` takes steps of 10 ms of order one; from the void's law that is percents.
                let allowed = if surroundings > 0.0 {
                    1e-9
                } else if model == "paper" {
                    0.05
                } else {
                    1e-10
                };
                assert!((last / expected - 1.0).abs() <= allowed, "{model} {surroundings}: {last} K, not {expected} K");
            }
        }
    }
}

/// Heats of one impact, and the temperatures before and after it.
struct Reacted {
    heat: f64,
    impulse: f64,
    rise: Vec<f64>,
}

const DT: f64 = 1e-9;
const MASS: [f64; 2] = [2.0, 0.5];

/// Two spheres of 0.1 and 0.03 m, or the first and a wall, meet at u; kappa = 3e5 J/m^2, C = 700 J/(kg K).
fn react(model: &str, wall: bool, u: f64, force_scale: f64, duration: f64, changes: &[(&str, Value)]) -> Reacted {
    let gap = 1e-11;
    let mut list = vec![json!({
        "position": [0.0, 0.0, 0.0], "velocity": [u, 0.0, 0.0], "radius": 0.1, "mass": MASS[0], "temperature": 300.0
    })];
    let mut value = json!({
        "model": model, "duration": DT, "particles": {},
        "contact": { "restitution": 0.5, "duration": { "seconds": duration } },
        "thermal": { "heat_capacity": 700.0, "reaction": { "energy_per_area": 3e5, "force_scale": force_scale } },
        "solver": { "step": { "fixed": DT } }
    });
    if wall {
        value["domain"] = json!({ "walls": [{ "point": [0.1 + gap, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0] }] });
    } else {
        list.push(json!({ "position": [0.13 + gap, 0.0, 0.0], "radius": 0.03, "mass": MASS[1], "temperature": 400.0 }));
    }
    value["particles"] = json!({ "list": list });
    let (steps, outcome) = record(&scene(&with(&value, changes)));
    assert_eq!(outcome.counters.impacts, 1);
    let impact = steps[1].impacts[0];
    let (before, after) = (steps[0].state.temperature.as_ref().unwrap(), steps[1].state.temperature.as_ref().unwrap());
    let rise: Vec<f64> = after.iter().zip(before).map(|(after, before)| after - before).collect();
    let heat = outcome.sample.ledger.totals.reaction_heat;
    let each = if wall { heat } else { 0.5 * heat };
    assert!((each - impact.heat).abs() <= 1e-15 * each, "the books say {heat} J, the impact {} J each", impact.heat);
    assert!(outcome.sample.ledger.residual.abs() <= 1e-13 * outcome.sample.ledger.thermal, "{:?}", outcome.sample);
    Reacted { heat: impact.heat, impulse: impact.normal_impulse, rise }
}

#[test]
fn reaction_heat_is_that_of_39() {
    for model in ["paper", "consistent"] {
        for wall in [false, true] {
            // An impact in `paper` lasts at most the step.
            let duration = if model == "paper" { 0.5 * DT } else { 1e-5 };
            for (u, share) in [(0.5, 0.2), (2.0, 0.999), (2.0, 1.001), (3.0, 50.0)] {
                let m_eff = if wall { MASS[0] } else { MASS[0] * MASS[1] / (MASS[0] + MASS[1]) };
                let force = m_eff * 1.5 * u / duration;
                let reacted = react(model, wall, u, force / share, duration, &[]);
                let what = format!("{model}, wall {wall}, {u} m/s");
                assert!((reacted.impulse / (m_eff * 1.5 * u) - 1.0).abs() <= 1e-14, "{what}: {}", reacted.impulse);
                // The smaller radius of the two; a wall has none.
                let b: f64 = if wall { 0.1 } else { 0.03 };
                let expected = 3e5 * share.min(1.0) * PI * b * b;
                // A handful of roundings.
                assert!((reacted.heat / expected - 1.0).abs() <= 1e-14, "{what}: {} J, not {expected}", reacted.heat);
                for (rise, mass) in reacted.rise.iter().zip(MASS) {
                    let expected = expected / (mass * 700.0);
                    // The rise is a difference of temperatures of some hundred kelvin.
                    assert!((rise - expected).abs() <= 1e-12, "{what}: {rise} K, not {expected} K");
                }
            }
        }
    }
}

/// Restitution is taken before the heat in `consistent`, with the heat of the last iterate in `paper`; both end at theta*.
#[test]
fn impacts_beyond_theta_star_are_plastic_and_still_react() {
    let law = json!({ "e0": 0.5, "theta_star": 3000.0 });
    for model in ["paper", "consistent"] {
        for theta in [3000.0, 1e5] {
            let changes = [
                ("/contact/restitution", law.clone()),
                ("/particles/list/0/temperature", json!(theta)),
                ("/particles/list/1/temperature", json!(theta)),
            ];
            let reacted = react(model, false, 1.0, 1.0, if model == "paper" { DT } else { 1e-5 }, &changes);
            let plastic = MASS[0] * MASS[1] / (MASS[0] + MASS[1]);
            assert!((reacted.impulse / plastic - 1.0).abs() <= 1e-14, "{model} {theta} K: {}", reacted.impulse);
            assert!(reacted.heat > 0.0 && reacted.rise.iter().all(|rise| *rise > 0.0));
        }
    }
}

/// Approaches that are taken as resting release no heat, however often they are renewed (`consistent`).
#[test]
fn resting_contacts_are_not_heated_again_and_again() {
    let value = json!({
        "duration": 0.5,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.05001], "radius": 0.05, "mass": 1.0, "temperature": 300.0 }
        ] },
        "contact": { "restitution": 0.5, "duration": { "seconds": 1e-5 } },
        "thermal": { "heat_capacity": 1000.0, "reaction": { "energy_per_area": 1e6, "force_scale": 1.0 } },
        "external": { "gravity": [0.0, 0.0, -9.81] },
        "domain": { "walls": [{ "point": [0.0, 0.0, 0.0], "normal": [0.0, 0.0, 1.0] }] },
        "solver": { "step": { "fixed": 1e-3 } }
    });
    let (steps, outcome) = record(&scene(&value));
    // Dropped from 10 um it arrives at 14 mm/s at most: a few impacts, then rest.
    assert!(outcome.counters.impacts <= 3, "{:?}", outcome.counters);
    let resting: u64 = steps.iter().filter_map(|step| step.diagnostics.as_ref()).map(|d| d.resting).sum();
    assert!(resting > 400, "{resting}");
}
