//! One case measured: time, work, and errors against the reference.

use std::time::Instant;

use agglo_core::impact::{Impact, Partner};
use agglo_core::observer::{ObserverError, Sample};
use agglo_core::state::State;
use agglo_core::{Flow, Observer, Outcome, RunError, Scene, Simulation, StepReport};
use serde::Serialize;

use crate::plan::Case;

/// What a run leaves behind: its end state, impacts, energies.
#[derive(Clone, Debug, Default)]
pub(crate) struct Watch {
    pub(crate) state: State,
    pub(crate) mean_diameter: f64,
    pub(crate) impacts: Vec<(u32, Partner, f64)>,
    pub(crate) sample: Sample,
    pub(crate) initial_kinetic: f64,
}

impl Observer for Watch {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        let entry = |impact: &Impact| (impact.particle, impact.partner, impact.time);
        self.impacts.extend(report.impacts.iter().map(entry));
        if report.step == 0
            && let Some(sample) = report.sample
        {
            self.initial_kinetic = sample.ledger.kinetic;
        }
        Ok(Flow::Continue)
    }
    fn wants_samples(&self) -> bool {
        false
    }
    fn wants_checkpoints(&self) -> bool {
        false
    }
}

/// Runs a simulation until a time, and keeps what it is there.
pub(crate) fn run(simulation: &mut Simulation, until: f64, watch: &mut Watch) -> Result<Outcome, RunError> {
    simulation.set_duration(until);
    let outcome = simulation.run(watch)?;
    watch.state = simulation.state().clone();
    watch.mean_diameter = simulation.particles().mean_diameter();
    watch.sample = outcome.sample.clone();
    Ok(outcome)
}

/// Differences from the reference at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Root mean square of the positions' errors over the mean diameter [-].
    pub position: f64,
    /// Root mean square of the velocities' errors over that of the velocities [-].
    pub velocity: f64,
    /// Root mean square of the temperatures' errors [K]; `None` without temperatures.
    pub temperature: Option<f64>,
    /// Root mean square of the errors of impact times, over those impacts that both have, in order, for each pair [s];
    /// `None` without any.
    pub impact_time: Option<f64>,
    /// Share of the impacts that both have, of all that either has [-]; `None` without any.
    pub impacts_found: Option<f64>,
}

impl Errors {
    pub(crate) fn between(found: &Watch, truth: &Watch) -> Self {
        let n = truth.state.position.len();
        let mean = |f: &dyn Fn(usize) -> f64| ((0..n).map(f).sum::<f64>() / n as f64).sqrt();
        let (a, b) = (&found.state, &truth.state);
        let apart = mean(&|i| (a.position.get(i) - b.position.get(i)).norm_squared());
        let faster = mean(&|i| (a.velocity.get(i) - b.velocity.get(i)).norm_squared());
        let speed = mean(&|i| b.velocity.get(i).norm_squared());
        let (impact_time, impacts_found) = impacts(&found.impacts, &truth.impacts);
        Self {
            position: apart / truth.mean_diameter,
            velocity: if faster == 0.0 { 0.0 } else { faster / speed },
            temperature: a
                .temperature
                .as_ref()
                .zip(b.temperature.as_ref())
                .map(|(a, b)| mean(&|i| (a[i] - b[i]).powi(2))),
            impact_time,
            impacts_found,
        }
    }
}

/// Impacts of each pair in their order: error of the times [s], share found.
fn impacts(found: &[(u32, Partner, f64)], truth: &[(u32, Partner, f64)]) -> (Option<f64>, Option<f64>) {
    let key = |&(i, partner, _): &(u32, Partner, f64)| match partner {
        Partner::Particle(j) => (0, i.min(j), i.max(j)),
        Partner::Wall(w) => (1, i, w),
    };
    let sorted = |impacts: &[(u32, Partner, f64)]| {
        let mut list: Vec<_> = impacts.iter().map(|impact| (key(impact), impact.2)).collect();
        list.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        list
    };
    let (found, truth) = (sorted(found), sorted(truth));
    if found.is_empty() && truth.is_empty() {
        return (None, None);
    }
    let (mut matched, mut square) = (0_usize, 0.0);
    for pair in truth.chunk_by(|a, b| a.0 == b.0) {
        let first = found.partition_point(|impact| impact.0 < pair[0].0);
        for (a, b) in found[first..].iter().take_while(|impact| impact.0 == pair[0].0).zip(pair) {
            matched += 1;
            square += (a.1 - b.1).powi(2);
        }
    }
    let either = found.len() + truth.len() - matched;
    let time = (matched > 0).then(|| (square / matched as f64).sqrt());
    (time, Some(matched as f64 / either as f64))
}

/// One case measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measurement {
    /// Scheme.
    pub scheme: String,
    /// Fixed step [s].
    pub step: Option<f64>,
    /// Tolerance [mean diameters].
    pub tolerance: Option<f64>,
    /// Wall time, median of the repeats [s].
    pub wall_seconds: f64,
    /// Evaluations of all forces, rejected attempts included.
    pub force_evaluations: u64,
    /// Accepted steps.
    pub steps: u64,
    /// Sweeps (Newton's iterations with `+newton`) of accepted steps.
    pub sweeps: u64,
    /// Rejected attempts.
    pub rejected: u64,
    /// Errors at the end.
    pub errors: Errors,
    /// Energy residual at the end over the initial kinetic energy or, where that is more, the near field's [-].
    pub energy_residual: f64,
    /// Position error over the tolerance [-]: achieved against requested.
    pub achieved: Option<f64>,
}

/// Measures a case against the reference.
///
/// # Errors
/// A run that fails.
pub(crate) fn measure(
    case: &Case,
    scene: &Scene,
    until: f64,
    truth: &Watch,
    repeats: usize,
) -> Result<Measurement, String> {
    let scene = case.scene(scene, until);
    let mut walls = Vec::with_capacity(repeats);
    let mut last = None;
    for _ in 0..repeats.max(1) {
        let mut simulation = Simulation::new(&scene).map_err(|error| error.to_string())?;
        let mut watch = Watch::default();
        let started = Instant::now();
        let outcome = run(&mut simulation, until, &mut watch).map_err(|error| error.to_string())?;
        walls.push(started.elapsed().as_secs_f64());
        let evaluations = simulation.force_evaluations();
        last = Some((outcome, watch, evaluations));
        // A long run's time is known well enough at once.
        if walls[0] > 1.0 {
            break;
        }
    }
    walls.sort_by(f64::total_cmp);
    let (outcome, watch, force_evaluations) = last.ok_or("nothing was run")?;
    let errors = Errors::between(&watch, truth);
    let ledger = &watch.sample.ledger;
    let size = watch.initial_kinetic.max(ledger.near_field.abs()).max(ledger.kinetic);
    let (step, tolerance) = match case.control {
        crate::plan::Control::Step(dt) => (Some(dt), None),
        crate::plan::Control::Tolerance(tolerance) => (None, Some(tolerance)),
    };
    Ok(Measurement {
        scheme: case.scheme.name(),
        step,
        tolerance,
        wall_seconds: walls[walls.len() / 2],
        force_evaluations,
        steps: outcome.counters.steps,
        sweeps: outcome.counters.iterations,
        rejected: outcome.counters.rejected_steps,
        errors,
        energy_residual: if ledger.residual == 0.0 { 0.0 } else { (ledger.residual / size).abs() },
        achieved: tolerance.map(|tolerance| errors.position / tolerance),
    })
}
