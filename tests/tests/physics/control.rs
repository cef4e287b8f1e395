//! Step size: named failures, bounded rejections, the end of a run, equation (54) recomputed.

use agglo_core::RunError;
use agglo_core::diagnostics::{Level, RejectionCause};
use agglo_tests::{record, run, scene, shipped, try_run, with};
use serde_json::{Value, json};

/// Two particles that fall into each other's singularity: attraction only, no contact.
fn collapse(model: &str, solver: Value) -> Value {
    json!({
        "model": model, "duration": 10.0,
        "particles": { "list": [
            { "position": [-0.4, 0.1, 0.0], "radius": 0.05, "mass": 1.0 },
            { "position": [5.0, 5.0, 5.0], "radius": 0.05, "mass": 1.0 },
            { "position": [0.4, 0.1, 0.0], "radius": 0.05, "mass": 2.0 }
        ] },
        "near_field": { "attraction": { "strength": 1.0, "exponent": 3.0 } },
        "solver": solver
    })
}

#[test]
fn a_step_below_the_minimum_says_when_how_small_and_who() {
    for model in ["paper", "consistent"] {
        let mut reached = 0.0;
        let value = collapse(model, json!({ "step": { "initial": 1e-3, "min": 1e-7 } }));
        let error = try_run(&scene(&value), |report| {
            reached = report.time;
            assert!(report.state.position.axes().into_iter().flatten().all(|x| x.is_finite()));
        })
        .expect_err(model);
        let RunError::StepTooSmall { time, dt, min, ref particles, ref advice, .. } = error else {
            panic!("{model}: {error:?}")
        };
        assert_eq!((time, min), (reached, 1e-7), "{model}");
        assert!(dt < min && dt > 0.0, "{model}: {dt}");
        assert_eq!(particles.len(), 2, "{model}");
        assert!(particles.contains(&0) && particles.contains(&2), "{model}: {particles:?}");
        let text = error.to_string();
        for part in ["1e-7", &format!("t = {time}"), "particles", "0", "2", advice] {
            assert!(text.contains(part), "{model}: {part} is missing in: {text}");
        }
    }
}

#[test]
fn rejections_are_bounded_and_told() {
    // With one iteration Phi says nothing, so every rejection takes a tenth off the step. The first iteration moves the
    // falling pair by dt^3 times its jerk, 1e-11 m and more even after sixty rejections: never 1e-18 of anything.
    let solver = json!({
        "step": { "initial": 0.1, "max": 0.1, "min": 1e-100 }, "tolerance": { "position": 1e-18 }, "max_iterations": 1
    });
    for model in ["paper", "consistent"] {
        let changes =
            [("/solver/integrator", json!("backward-euler")), ("/particles/list/0/velocity", json!([1.0, 0.0, 0.0]))];
        let error = try_run(&scene(&with(&collapse(model, solver.clone()), &changes)), |_| {}).expect_err(model);
        let RunError::TooManyRejections { attempts, cause, time, dt, ref particles, .. } = error else {
            panic!("{model}: {error:?}")
        };
        assert_eq!((cause, time), (RejectionCause::NotConverged, 0.0), "{model}");
        assert!((2..=100).contains(&attempts) && dt > 1e-5, "{model}: {attempts}, {dt}");
        assert!(particles.contains(&0), "{model}: {particles:?}");
        let text = error.to_string();
        assert!(text.contains(&attempts.to_string()) && text.contains("did not converge"), "{text}");
    }
}

/// A fall into a singularity cannot be completed. Whatever the minimum step, it must not end as a success with an
/// energy from nowhere: either an error, or what is left unexplained stays small.
#[test]
fn a_collapse_never_passes_as_a_result() {
    for (model, steps) in [
        // With smaller minima `paper` circles the singularity in ever smaller steps, a million of them in no time.
        ("paper", vec![json!({})]),
        ("consistent", vec![json!({}), json!({ "min": 1e-14 }), json!({ "min": 1e-100 })]),
    ] {
        for step in steps {
            let value = collapse(model, json!({ "step": step }));
            let mut watch = Until { left: 1_000_000, last: -1.0 };
            match agglo_tests::start(&scene(&value)).run(&mut watch) {
                Err(error) => assert!(error.to_string().contains("particle"), "{model}, {step}: {error}"),
                Ok(outcome) => {
                    assert_eq!(
                        outcome.ending,
                        agglo_core::Ending::Finished,
                        "{model}, {step}: stuck at {} s",
                        outcome.time
                    );
                    let ledger = outcome.sample.ledger;
                    // Falling from 0.8 m gains at most the well's energy at contact, 1/(2 * 0.1^2) = 50 J.
                    assert!(ledger.residual.abs() <= 50.0, "{model}, {step}: finished with {ledger:?}");
                }
            }
        }
    }
}

/// Stops a run that stands still or takes too many steps, so that the test ends.
struct Until {
    left: u64,
    last: f64,
}

impl agglo_core::Observer for Until {
    fn step(
        &mut self,
        report: &agglo_core::StepReport<'_>,
    ) -> Result<agglo_core::Flow, agglo_core::observer::ObserverError> {
        self.left -= 1;
        let moves = report.time > self.last;
        self.last = report.time;
        Ok(if moves && self.left > 0 { agglo_core::Flow::Continue } else { agglo_core::Flow::Stop })
    }
}

#[test]
fn a_fixed_step_that_does_not_converge_is_a_named_error() {
    for model in ["paper", "consistent"] {
        let changes = [("/solver/integrator", json!("backward-euler"))];
        let value = with(&collapse(model, json!({ "step": { "fixed": 0.3 } })), &changes);
        let error = try_run(&scene(&value), |_| {}).expect_err(model);
        let RunError::TooManyRejections { time, dt, attempts, cause, ref advice, .. } = error else {
            panic!("{model}: {error:?}")
        };
        assert_eq!((dt, attempts), (0.3, 1), "{model}");
        assert!(time < 10.0, "{model}");
        assert!(matches!(cause, RejectionCause::NotConverged | RejectionCause::NotFinite), "{model}: {cause:?}");
        assert!(advice.contains("solver.step.fixed"), "{model}: {advice}");
    }
}

/// Two particles whose paths meet in one point at a step's end: 1/0 in the near field.
#[test]
fn coincidence_never_passes_as_a_result() {
    for model in ["paper", "consistent"] {
        for (near_field, e) in [
            (json!({ "attraction": { "strength": 1e-9, "exponent": 2.0 } }), None),
            (json!({ "repulsion": { "strength": 1e-9, "exponent": 7.0 } }), None),
            (json!({ "repulsion": { "strength": 0.0, "exponent": 7.0 } }), Some(0.5)),
        ] {
            let mut value = json!({
                "model": model, "duration": 1.0,
                "particles": { "list": [
                    { "position": [-0.5, 0.0, 0.0], "velocity": [2.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 },
                    { "position": [0.5, 0.0, 0.0], "velocity": [-2.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 }
                ] },
                "near_field": near_field, "solver": { "step": { "fixed": 0.25 } }
            });
            if let Some(e) = e {
                value["contact"] = json!({ "restitution": e });
            }
            let finished = try_run(&scene(&value), |report| {
                for column in report.state.position.axes().into_iter().chain(report.state.velocity.axes()) {
                    assert!(column.iter().all(|x| x.is_finite()), "{model}: {:?}", report.state);
                }
            });
            if let Err(error) = finished {
                let named = match &error {
                    RunError::NotFinite { time, quantity, .. } => *time <= 1.0 && !quantity.is_empty(),
                    RunError::TooManyRejections { cause, .. } => {
                        *cause == RejectionCause::NotFinite || *cause == RejectionCause::NotConverged
                    }
                    _ => false,
                };
                assert!(named, "{model}: {error}");
            }
        }
    }
}

#[test]
fn runs_end_at_their_duration() {
    let falling = |duration: f64, step: Value| {
        json!({
            "duration": duration,
            "particles": { "list": [{ "position": [0.0, 0.0, 0.0], "radius": 0.05, "mass": 1.0 }] },
            "external": { "gravity": [0.0, 0.0, -9.81] }, "solver": { "step": step }
        })
    };
    // Clipped: the last step ends on the duration to the last bit.
    for duration in [1.0, 0.7, 1e-5, 12.3456789, 0.1 + 0.2] {
        for step in [json!({ "initial": 3e-4, "max": 7e-3 }), json!({ "fixed": 0.013 })] {
            let outcome = run(&scene(&falling(duration, step.clone())), |report| assert!(report.time <= duration));
            assert_eq!(outcome.time, duration, "{step}");
        }
    }
    // The 1e-6 rule: five seconds of milliseconds are 5000 steps, no crumb of round-off more.
    let outcome = run(&scene(&falling(5.0, json!({ "fixed": 1e-3 }))), |_| {});
    assert_eq!(outcome.counters.steps, 5000);
    assert!((outcome.time - 5.0).abs() < 1e-9, "{}", outcome.time);
    // Just more than a millionth of a step left is a step, just less is none.
    for (left, steps) in [(2e-6, 11), (0.5e-6, 10)] {
        let outcome = run(&scene(&falling(10.0 + left, json!({ "fixed": 1.0 }))), |_| {});
        assert_eq!(outcome.counters.steps, steps, "{left} s left");
    }
}

/// Impacts at step ends: a fixed step in which particles move through each other is taken, as asked, but not without a word; an adaptive one is
/// refused and shortened, and the diagnostics say why.
#[test]
fn steps_too_long_for_contacts_are_told_or_shortened() {
    let step = |value: &Value| with(value, &[("/contact/resolution", json!("step"))]);
    let value = step(&with(&shipped("head-on-impact"), &[("/solver/step/fixed", json!(0.2))]));
    let mut warnings = 0;
    run(&scene(&value), |report| {
        warnings += report.notices.iter().filter(|notice| notice.level == Level::Warning).count();
    });
    assert_eq!(warnings, 1);
    let mut value = step(&shipped("head-on-impact"));
    value["solver"] = json!({ "step": { "initial": 0.2, "max": 0.2 } });
    let (steps, outcome) = record(&scene(&value));
    assert_eq!(outcome.counters.impacts, 1);
    let rejected = &steps[1].diagnostics.as_ref().unwrap().rejected;
    assert!(
        !rejected.is_empty() && rejected.iter().all(|attempt| attempt.cause == RejectionCause::Travel),
        "{rejected:?}"
    );
    assert!(rejected.windows(2).all(|pair| pair[1].dt < pair[0].dt));
    for pair in steps.windows(2) {
        let approach = |step: &agglo_tests::Step| step.state.position.x[1] - step.state.position.x[0];
        // A twentieth of the diameter of 0.1 m, from the start of a step to its end.
        assert!((approach(&pair[1]) - approach(&pair[0])).abs() <= 0.05 * 0.1 * (1.0 + 1e-12));
    }
}

/// The local error that `consistent` bounds: recorded, within the tolerance, and what a too long first step fails by.
#[test]
fn local_errors_are_bounded_and_recorded() {
    let mut value = shipped("two-body-oscillator");
    value["solver"] = json!({
        "integrator": "velocity-verlet", "step": { "initial": 1.0, "max": 1.0 }, "tolerance": { "position": 1e-5 }
    });
    let (steps, _) = record(&scene(&value));
    let rejected = &steps[1].diagnostics.as_ref().unwrap().rejected;
    assert!(rejected.iter().any(|attempt| attempt.cause == RejectionCause::LocalError), "{rejected:?}");
    for step in &steps[1..] {
        let error = step.diagnostics.as_ref().unwrap().local_error.unwrap();
        assert!((0.0..=1e-5).contains(&error), "{} s: {error}", step.time);
    }
}

#[test]
fn steps_add_up_to_the_time_and_stay_within_their_limits() {
    for name in ["paper-binding-1e6", "charged-cloud"] {
        let value = with(&shipped(name), &[("/duration", json!(0.5))]);
        let max = value["solver"]["step"]["max"].as_f64().unwrap();
        let (steps, outcome) = record(&scene(&value));
        for pair in steps.windows(2) {
            let diagnostics = pair[1].diagnostics.as_ref().unwrap();
            // What rounding takes from one time is added to a later one: at most an ulp here.
            let ahead = pair[1].time - (pair[0].time + diagnostics.dt);
            assert!(ahead.abs() <= f64::EPSILON * pair[1].time, "{name}: {ahead}");
            assert!(diagnostics.dt > 0.0 && diagnostics.dt <= max, "{name}: {}", diagnostics.dt);
            assert_eq!(diagnostics.iterations() as usize, diagnostics.position_errors.len());
            assert!(diagnostics.violation <= 1.0, "{name}: an accepted step violates by {}", diagnostics.violation);
        }
        let iterations: u64 = steps.iter().filter_map(|step| step.diagnostics.as_ref()).map(|d| d.iterations()).sum();
        let rejected: usize = steps.iter().filter_map(|step| step.diagnostics.as_ref()).map(|d| d.rejected.len()).sum();
        assert_eq!((iterations, rejected as u64), (outcome.counters.iterations, outcome.counters.rejected_steps));
    }
}

/// Phi_K = min over both fields of (TOL/err_1)^(1/(p K_d)) / (err_K/err_1)^(1/(p K)), p = 2, from the errors recorded;
/// one where K = 1, and a field whose first or last error is zero counts as one (rules 2(b)).
#[test]
fn the_step_scaling_follows_from_the_recorded_errors() {
    let (steps, _) = record(&scene(&shipped("paper-binding-2e6")));
    let (tolerance, most) = (1e-6_f64, 100.0);
    let mut scaled = 0;
    for pair in steps[1..].windows(2) {
        let [now, next] = [&pair[0], &pair[1]].map(|step| step.diagnostics.as_ref().unwrap());
        let k = now.position_errors.len() as f64;
        let field = |errors: &[f64]| match (errors.first(), errors.last()) {
            (Some(&first), Some(&last)) if first > 1e-14 && last > 1e-14 => {
                (tolerance / first).powf(1.0 / (2.0 * most)) / (last / first).powf(1.0 / (2.0 * k))
            }
            _ => 1.0,
        };
        let phi = if k == 1.0 { 1.0 } else { field(&now.position_errors).min(field(&now.temperature_errors)) };
        // powf here and libm's pow there: a rounding or two each.
        assert!((now.scaling - phi).abs() <= 1e-14, "{} s: {} recorded, {phi} from errors", pair[0].time, now.scaling);
        // The next step is what Phi says, within dt_lim; the very last one is clipped.
        let expected = (now.scaling * now.dt).min(1e-2);
        let last = pair[1].time == 5.0;
        assert!(next.rejected.is_empty() && (next.dt == expected || last && next.dt < expected), "{}", pair[1].time);
        // Z_K of (53).
        let z = now.position_errors[now.position_errors.len() - 1]
            .max(now.temperature_errors[now.temperature_errors.len() - 1]);
        assert!((now.violation - z / tolerance).abs() <= 1e-15 * now.violation, "{} s", pair[0].time);
        scaled += u64::from(k > 1.0);
    }
    assert!(scaled > 100, "only {scaled} steps of more than one iteration");
}

/// (52) and the contraction: recomputed from a run whose iterates are known, a linear attraction to a fixed centre.
#[test]
fn the_contraction_goes_like_the_square_of_the_step() {
    // Stiffness 2 N/m and reduced mass 0.5 kg at d_e: an iteration multiplies the error by (omega dt)^2 = 4 dt^2.
    let contraction = |dt: f64| {
        let value = with(
            &shipped("two-body-oscillator"),
            &[
                (
                    "/solver",
                    json!({ "integrator": "backward-euler", "step": { "fixed": dt }, "tolerance": { "position": 1e-9 } }),
                ),
                ("/duration", json!(10.0 * dt)),
            ],
        );
        let (steps, _) = record(&scene(&value));
        steps[5].diagnostics.as_ref().unwrap().contraction
    };
    for dt in [0.02, 0.04, 0.08] {
        let found = contraction(dt);
        // The vibration of 2 % changes the stiffness by a few per cent of it.
        assert!((found / (4.0 * dt * dt) - 1.0).abs() <= 0.15, "dt {dt}: {found}, not {}", 4.0 * dt * dt);
    }
}
