//! Time steps, integrator and recording.

use crate::assembly::locates;
use crate::scene::{Crossings, IntegratorKind, ModelKind, Problem, Scene, SolutionMethod};

/// Longest simulated time that a log can stamp, in nanoseconds of a signed 64-bit clock [s].
const LONGEST_LOG: f64 = 9.2e9;

pub(super) fn check(scene: &Scene, problems: &mut Vec<Problem>) {
    let solver = &scene.solver;
    if solver.method == SolutionMethod::Newton && scene.model == ModelKind::Paper {
        problems.push(
            Problem::new("/solver/method", "the model `paper` is solved by its staggered iteration alone")
                .hint("leave \"method\" out, or choose the model \"consistent\""),
        );
    }
    if scene.model == ModelKind::Paper && solver.integrator.is_some_and(|i| i != IntegratorKind::BackwardEuler) {
        problems.push(
            Problem::new("/solver/integrator", "the model `paper` is integrated by backward-euler alone")
                .hint("leave \"integrator\" out, or choose the model \"consistent\""),
        );
    }
    if solver.crossings == Some(Crossings::Located) && !locates(scene) {
        problems.push(
            Problem::new("/solver/crossings", "neither the model `paper` nor collocation schemes locate crossings")
                .hint("leave \"crossings\" out, or choose another integrator"),
        );
    }
    check_step(scene, problems);
    let record = &scene.record;
    if record.every_steps.is_some() && record.interval.is_some() {
        problems.push(
            Problem::new("/record/interval", "every_steps and interval exclude each other").hint("keep one of them"),
        );
    }
    let log_time = scene.duration * record.time_scale;
    if log_time > LONGEST_LOG {
        let message = format!(
            "the log would end at {log_time:e} s of log time (duration times record.time_scale); its clock ends at \
             {LONGEST_LOG:e} s"
        );
        let pointer = if record.time_scale > 1.0 { "/record/time_scale" } else { "/duration" };
        problems.push(Problem::new(pointer, message).hint("lower the duration or record.time_scale"));
    }
}

fn check_step(scene: &Scene, problems: &mut Vec<Problem>) {
    let step = &scene.solver.step;
    let others = [("initial", step.initial), ("max", step.max), ("min", step.min)];
    if step.fixed.is_some() {
        for (name, _) in others.iter().filter(|(_, value)| value.is_some()) {
            let message = format!("a fixed step has no {name}");
            problems.push(
                Problem::new(format!("/solver/step/{name}"), message).hint(format!("keep \"fixed\" or \"{name}\"")),
            );
        }
    }
    let (initial, max, min) = step.limits();
    if initial > max {
        let message = format!("the first step, {initial:e} s, must be at most the largest, {max:e} s");
        problems.push(Problem::new(
            if step.initial.is_some() { "/solver/step/initial" } else { "/solver/step/max" },
            message,
        ));
    }
    if min > initial.min(max) {
        let message = format!("the smallest step, {min:e} s, must be at most the first, {initial:e} s");
        problems.push(Problem::new("/solver/step/min", message));
    }
    // Beyond this many steps, adding one to the time changes nothing.
    const MOST_STEPS: f64 = 4_503_599_627_370_496.0;
    if scene.duration / max > MOST_STEPS {
        let message = format!("steps of {max:e} s vanish beside a duration of {:e} s", scene.duration);
        let pointer = match (step.fixed, step.max) {
            (Some(_), _) => "/solver/step/fixed",
            (_, Some(_)) => "/solver/step/max",
            _ => "/duration",
        };
        problems.push(Problem::new(pointer, message).hint("shorten the duration, or take larger steps"));
    }
}
