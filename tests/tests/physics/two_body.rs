//! Two bodies in the near field: turning points, period, orders of the integrators, damping.

use agglo_tests::{order, run, scene, with};
use nalgebra::Vector3;
use serde_json::{Value, json};
use std::f64::consts::PI;

/// A pair at rest a distance s apart, m = 1.5 and 0.5 kg, attraction (0.5, 1), repulsion (0.25, 2): d_e = 0.5 m.
fn released(s: f64) -> Value {
    json!({
        "duration": 1.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": 0.05, "mass": 1.5 },
            { "position": [0.6 * s, 0.0, -0.8 * s], "radius": 0.05, "mass": 0.5 }
        ] },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 }
        },
        "solver": { "step": { "fixed": 1e-3 }, "tolerance": { "position": 1e-10 } }
    })
}

const REDUCED_MASS: f64 = 0.375;

fn potential(s: f64) -> f64 {
    0.5 * s.ln() + 0.25 / s
}

/// The other distance with the same potential, by bisection.
fn other_turning_point(s: f64) -> f64 {
    // The potential falls to its minimum at 0.5 and rises beyond it.
    let (mut low, mut high) = if s < 0.5 { (0.5, 1e3) } else { (1e-6, 0.5) };
    let rises = s < 0.5;
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if (potential(middle) > potential(s)) == rises { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

/// Period of the vibration between two turning points, 2 int ds/sqrt(2 (E - V)/mu), by Chebyshev-Gauss quadrature: the
/// integrand is smooth in phi, s = middle + half cos phi, so 400 points are far beyond round-off.
fn period(a: f64, b: f64) -> f64 {
    let (middle, half, energy) = (0.5 * (a + b), 0.5 * (b - a).abs(), potential(a));
    let n = 400;
    let sum: f64 = (0..n)
        .map(|k| {
            let phi = PI * (f64::from(k) + 0.5) / f64::from(n);
            let s = middle + half * phi.cos();
            half * phi.sin() / (2.0 * (energy - potential(s)) / REDUCED_MASS).sqrt()
        })
        .sum();
    2.0 * PI / f64::from(n) * sum
}

/// Times and distances at which the distance of a run's pair turns, from cubic interpolation between steps.
fn turning_points(value: &Value) -> Vec<(f64, f64)> {
    let mut last: Option<(f64, f64, f64)> = None;
    let mut found = Vec::new();
    run(&scene(value), |report| {
        let d = report.state.position.get(1) - report.state.position.get(0);
        let w = report.state.velocity.get(1) - report.state.velocity.get(0);
        let (t, s, rate) = (report.time, d.norm(), d.dot(&w) / d.norm());
        if let Some((t0, s0, rate0)) = last
            && rate0 * rate < 0.0
        {
            // Where the Hermite cubic's slope vanishes: bisection in x = (t - t0)/h.
            let h = t - t0;
            let slope = |x: f64| {
                (6.0 * x * x - 6.0 * x) * (s0 - s) / h
                    + (3.0 * x * x - 4.0 * x + 1.0) * rate0
                    + (3.0 * x * x - 2.0 * x) * rate
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..60 {
                let x = 0.5 * (low + high);
                if slope(x) * rate0 > 0.0 { low = x } else { high = x }
            }
            let x = 0.5 * (low + high);
            let at = (1.0 + 2.0 * x) * (1.0 - x) * (1.0 - x) * s0
                + x * (1.0 - x) * (1.0 - x) * h * rate0
                + x * x * (3.0 - 2.0 * x) * s
                + x * x * (x - 1.0) * h * rate;
            found.push((t0 + x * h, at));
        }
        last = Some((t, s, rate));
    });
    found
}

#[test]
fn turning_points_and_period_follow_from_the_energy() {
    for (from, integrator) in
        [(0.3, "velocity-verlet"), (0.8, "velocity-verlet"), (0.42, "trapezoidal"), (0.2, "trapezoidal")]
    {
        let other = other_turning_point(from);
        let period = period(from, other);
        let run = |dt: f64| {
            let value = with(
                &released(from),
                &[
                    ("/duration", json!(2.2 * period)),
                    ("/solver/integrator", json!(integrator)),
                    ("/solver/step/fixed", json!(dt)),
                ],
            );
            let turns = turning_points(&value);
            assert!(turns.len() >= 4, "{from}: {turns:?}");
            ((turns[0].1 - other) / other, (turns[1].1 - from) / from, (turns[3].0 - 2.0 * period) / period)
        };
        // From 0.2 m, 0.4 d_e, the stiffness at the start is 50 N/m: omega dt = 0.006 at the finer step, and the errors
        // of both schemes are (omega dt)^2/24 and /12 times factors of a few: 1e-5. Halving must give a quarter of them.
        let (coarse, fine) = (run(1e-3), run(5e-4));
        for (what, coarse, fine) in
            [("far turn", coarse.0, fine.0), ("return", coarse.1, fine.1), ("period", coarse.2, fine.2)]
        {
            assert!(fine.abs() <= 1e-5, "{integrator} from {from} m: {what} is off by {fine:e}");
            // Below 1e-10 the interpolation and the iteration's tolerance show, not the order.
            let shown = order(coarse.abs(), fine.abs(), 2.0);
            assert!(fine.abs() < 1e-10 || (shown - 2.0).abs() < 0.1, "{integrator} from {from} m: {what} {shown}");
        }
    }
}

/// Fourth-order Runge-Kutta for the two bodies in three dimensions, with steps so small that its error is round-off.
fn reference(value: &Value, duration: f64) -> [Vector3<f64>; 4] {
    let vector = |k: usize, key: &str| {
        let v = &value["particles"]["list"][k][key];
        Vector3::from_fn(|a, _| v[a].as_f64().unwrap_or(0.0))
    };
    let mut y = [vector(0, "position"), vector(1, "position"), vector(0, "velocity"), vector(1, "velocity")];
    let rate = |y: &[Vector3<f64>; 4]| {
        let d = y[1] - y[0];
        let s = d.norm();
        let force = d * ((0.5 / s - 0.25 / (s * s)) / s);
        [y[2], y[3], force / 1.5, -force / 0.5]
    };
    let n = 20_000;
    let h = duration / f64::from(n);
    let moved = |y: &[Vector3<f64>; 4], k: &[Vector3<f64>; 4], h: f64| std::array::from_fn(|i| y[i] + k[i] * h);
    for _ in 0..n {
        let k1 = rate(&y);
        let k2 = rate(&moved(&y, &k1, 0.5 * h));
        let k3 = rate(&moved(&y, &k2, 0.5 * h));
        let k4 = rate(&moved(&y, &k3, h));
        y = std::array::from_fn(|i| y[i] + (k1[i] + (k2[i] + k3[i]) * 2.0 + k4[i]) * (h / 6.0));
    }
    y
}

#[test]
fn halving_the_step_shows_each_integrators_order() {
    let value = with(
        &released(0.7),
        &[
            ("/duration", json!(2.0)),
            ("/particles/list/0/velocity", json!([0.1, 0.2, 0.0])),
            ("/particles/list/1/velocity", json!([-0.2, 0.3, 0.4])),
        ],
    );
    let truth = reference(&value, 2.0);
    for (integrator, expected) in [("backward-euler", 1.0), ("trapezoidal", 2.0), ("velocity-verlet", 2.0)] {
        let error = |dt: f64| {
            let value = with(&value, &[("/solver/integrator", json!(integrator)), ("/solver/step/fixed", json!(dt))]);
            let simulation = &mut agglo_tests::start(&scene(&value));
            simulation.run(&mut ()).unwrap();
            let state = simulation.state();
            (0..2)
                .map(|i| (state.position.get(i) - truth[i]).norm() + (state.velocity.get(i) - truth[2 + i]).norm())
                .sum::<f64>()
        };
        // Steps of a hundredth of the vibration's period and less: the next term of the error is below a tenth.
        let errors = [1.0 / 64.0, 1.0 / 128.0, 1.0 / 256.0].map(error);
        for pair in errors.windows(2) {
            let shown = order(pair[0], pair[1], 2.0);
            assert!((shown - expected).abs() <= 0.1, "{integrator}: order {shown}, errors {errors:?}");
        }
    }
}

/// `paper` is backward Euler: order one towards the same limit.
#[test]
fn the_papers_scheme_has_order_one() {
    let value = with(
        &released(0.7),
        &[("/duration", json!(2.0)), ("/model", json!("paper")), ("/solver/tolerance/position", json!(1e-13))],
    );
    let truth = reference(&value, 2.0);
    let error = |dt: f64| {
        let simulation = &mut agglo_tests::start(&scene(&with(&value, &[("/solver/step/fixed", json!(dt))])));
        simulation.run(&mut ()).unwrap();
        (simulation.state().position.get(0) - truth[0]).norm()
    };
    let errors = [1.0 / 256.0, 1.0 / 512.0, 1.0 / 1024.0].map(error);
    for pair in errors.windows(2) {
        let shown = order(pair[0], pair[1], 2.0);
        assert!((shown - 1.0).abs() <= 0.1, "order {shown}, errors {errors:?}");
    }
}

/// Symmetric schemes keep the energy bounded: no drift over ten thousand periods.
#[test]
fn ten_thousand_periods_keep_energy_and_period() {
    let (from, to) = (0.4, other_turning_point(0.4));
    let period = period(from, to);
    for (integrator, periods) in [("velocity-verlet", 1e4), ("trapezoidal", 1e4)] {
        let dt = period / 64.0;
        let value = with(
            &released(from),
            &[
                ("/duration", json!(periods * period)),
                ("/solver/integrator", json!(integrator)),
                ("/solver/step/fixed", json!(dt)),
                // A period's worth of steps between samples is not commensurable with the vibration.
                ("/record/every_steps", json!(61)),
            ],
        );
        let (mut early, mut late, mut turns, mut before) = (0.0_f64, 0.0_f64, 0_u64, 0.0);
        run(&scene(&value), |report| {
            let d = report.state.position.get(1) - report.state.position.get(0);
            let rate = d.dot(&(report.state.velocity.get(1) - report.state.velocity.get(0)));
            turns += u64::from(before > 0.0 && rate <= 0.0);
            before = rate;
            if let Some(sample) = report.sample {
                let residual = sample.ledger.residual.abs();
                let half = if report.time < 0.01 * periods * period { &mut early } else { &mut late };
                *half = half.max(residual);
            }
        });
        // The error vibrates with (omega dt)^2 of the energy above the minimum; a hundredth of the run sees its largest
        // values, so the rest may exceed them by what sampling misses, not by a drift, which would be a factor 100.
        let depth = potential(from) - potential(0.5);
        assert!(early > 1e-6 * depth && late <= 1.5 * early, "{integrator}: {early:e} then {late:e} J of {depth} J");
        // The numerical period differs by (omega dt)^2/24 = 4e-4 (Verlet) or /12 with factors from the anharmonicity.
        let shown = turns as f64 / periods;
        assert!((shown - 1.0).abs() <= 5e-3, "{integrator}: {shown} turns per period");
    }
}

/// Two of the paper's particles with binding, displaced by 2 % from their bonded equilibrium (model.md 6.5).
fn vibration_kept(integrator: &str, dt: f64) -> f64 {
    let radius = 0.25 / 100_f64.cbrt();
    let mass = 2000.0 * 4.0 / 3.0 * PI * radius.powi(3);
    // (0.5 + 1.75)/s = 0.25/s^2
    let rest = 0.25 / 2.25;
    let value = json!({
        "duration": 2.0,
        "particles": { "list": [
            { "position": [0.0, 0.0, 0.0], "radius": radius, "mass": mass },
            { "position": [1.02 * rest, 0.0, 0.0], "radius": radius, "mass": mass }
        ] },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 },
            "weight": "mass-product", "cutoff": "inflection"
        },
        "binding": { "strength": 1.75, "exponent": 1.0, "range": 1.65 },
        "solver": { "integrator": integrator, "step": { "fixed": dt }, "tolerance": { "position": 1e-10 } }
    });
    let bottom = {
        let at_rest = with(&value, &[("/particles/list/1/position/0", json!(rest))]);
        let mut lowest = 0.0;
        run(&scene(&with(&at_rest, &[("/duration", json!(1e-6))])), |report| {
            lowest = report.sample.map_or(lowest, |sample| sample.ledger.near_field + sample.ledger.binding);
        });
        lowest
    };
    let mut above = Vec::new();
    run(&scene(&value), |report| {
        if let Some(sample) = report.sample {
            above.push(sample.ledger.kinetic + sample.ledger.near_field + sample.ledger.binding - bottom);
        }
    });
    above[above.len() - 1] / above[0]
}

#[test]
fn backward_euler_damps_a_bound_pair_and_the_trapezoidal_rule_does_not() {
    // Backward Euler multiplies the amplitude of a linear vibration by (1 + omega^2 dt^2)^(-1/2) in every step. An
    // amplitude of 2 % shifts the mean stiffness by its square times a few: 1 % in the logarithm of what is kept.
    let mass = 2000.0 * 4.0 / 3.0 * PI * (0.25 / 100_f64.cbrt()).powi(3);
    let d = 0.25 / 2.25;
    let stiffness = mass * mass * (2.0 * 0.25 / (d * d * d) - 2.25 / (d * d));
    let square = stiffness / (0.5 * mass);
    for (dt, quoted) in [(1e-2, 9e-5), (1e-3, 0.385), (1e-4, 0.909)] {
        let kept = vibration_kept("backward-euler", dt);
        let linear = (1.0 + square * dt * dt).powf(-2.0 / dt);
        assert!((kept.ln() / linear.ln() - 1.0).abs() <= 0.02, "{dt}: kept {kept}, linear {linear}");
        // The figures of model.md, to the digits they are given with.
        assert!((kept / quoted - 1.0).abs() <= 0.06, "{dt}: kept {kept}, quoted {quoted}");
    }
    // The energy error of the trapezoidal rule is periodic, (omega dt)^2 times the anharmonic part: 1 - 6e-6, 1e-8, 1e-10.
    for (dt, allowed) in [(1e-2, 2e-5), (1e-3, 1e-7), (1e-4, 1e-9)] {
        let kept = vibration_kept("trapezoidal", dt);
        assert!((kept - 1.0).abs() <= allowed, "{dt}: {:e}", kept - 1.0);
    }
}

/// Released at 0.2 d_e with beta2 = 12: four million times the energy of the well; the adaptive step must resolve it.
#[test]
fn a_violent_release_keeps_its_energy() {
    let value = with(
        &released(0.2),
        &[
            (
                "/near_field",
                json!({
                    "attraction": { "strength": 1.0, "exponent": 6.0 }, "repulsion": { "strength": 1.0, "exponent": 12.0 }
                }),
            ),
            ("/duration", json!(1e-3)),
            ("/solver", json!({ "step": { "initial": 1e-6, "max": 1e-2, "min": 1e-12 } })),
        ],
    );
    let mut speed = 0.0;
    let mut distance: f64 = 0.0;
    run(&scene(&value), |report| {
        distance = (report.state.position.get(1) - report.state.position.get(0)).norm();
        speed = (report.state.velocity.get(1) - report.state.velocity.get(0)).norm();
    });
    let potential = |s: f64| s.powi(-11) / 11.0 - s.powi(-5) / 5.0;
    let expected = (2.0 * (potential(0.2) - potential(distance)) / REDUCED_MASS).sqrt();
    assert!(distance > 1.0, "{distance}");
    // Some hundred steps, each with a local error of 1e-6 diameters = 1e-7 m over the 0.03 m in which the energy is
    // released: 1e-5 each at the worst, and they do not all have the same sign.
    assert!((speed / expected - 1.0).abs() <= 1e-4, "{speed} m/s, from energy {expected} m/s");
}
