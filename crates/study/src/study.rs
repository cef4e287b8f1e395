//! The study: series of cases from coarse to fine, in turn, within a budget of time.

use std::time::Instant;

use agglo_core::Scene;
use agglo_core::SetupError;
use agglo_core::characteristics::{suggest_step, survey};
use agglo_core::placement::place;
use serde::Serialize;

use crate::fit::{Fit, fits};
use crate::measure::{Measurement, measure};
use crate::plan::{Case, Control, Plan};
use crate::reference::{ReferenceError, References};
use crate::seeds::{Ensemble, ensemble};

/// Errors below this multiple of the reference's uncertainty tell nothing more; a series ends there.
const NOISE: f64 = 3.0;
/// Round-off of positions after a few steps [mean diameters].
const ROUND_OFF: f64 = 2e-14;

/// Watches a study.
pub trait Watcher {
    /// Sees how far it is: cases done and planned, and what comes next. False stops the study.
    fn next(&mut self, done: usize, planned: usize, what: &str) -> bool;
}

/// A case that was not measured, and why.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Skipped {
    /// Scheme.
    pub scheme: String,
    /// Fixed step [s].
    pub step: Option<f64>,
    /// Tolerance [mean diameters].
    pub tolerance: Option<f64>,
    /// Why.
    pub reason: String,
}

/// What a study found.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// The scene's name.
    pub scene: String,
    /// Number of particles.
    pub particles: usize,
    /// The scene's duration [s].
    pub duration: f64,
    /// Time at which errors were taken [s]: the duration, or before two references part.
    pub until: f64,
    /// Whether that is the whole duration.
    pub whole: bool,
    /// Whether errors end there because a contact comes to rest, which the reference does not solve.
    pub rests: bool,
    /// Difference of the two references there [mean diameters].
    pub uncertainty: f64,
    /// Positions of the reference at that time [m].
    pub reference_positions: Vec<[f64; 3]>,
    /// Force evaluations of the reference.
    pub reference_evaluations: u64,
    /// Measurements, series by series.
    pub measurements: Vec<Measurement>,
    /// Cases that were planned and not measured.
    pub skipped: Vec<Skipped>,
    /// Orders of schemes with fixed steps.
    pub fits: Vec<Fit>,
    /// Statistics over seeds at the scene's end, where references part before it and the plan asks for them.
    pub ensembles: Vec<Ensemble>,
    /// Whether it was stopped before its end.
    pub stopped: bool,
}

/// A study that could not be made.
#[derive(Debug)]
pub enum Failed {
    /// The scene cannot be set up.
    Setup(SetupError),
    /// There is no reference.
    Reference(ReferenceError),
    /// It was stopped before anything was measured.
    Stopped,
}

/// Studies a scene.
///
/// # Errors
/// A scene that cannot be set up or has no reference.
pub fn study(scene: &Scene, plan: &Plan, watcher: &mut dyn Watcher) -> Result<Study, Failed> {
    let (particles, state) = place(scene).map_err(Failed::Setup)?;
    let step = suggest_step(scene, &particles, &state, &survey(scene, &particles)).seconds;
    if !watcher.next(0, 0, "reference") {
        return Err(Failed::Stopped);
    }
    let references = References::new(scene).map_err(|error| match error {
        ReferenceError::Setup(error) => Failed::Setup(error),
        error => Failed::Reference(error),
    })?;
    let started = Instant::now();
    let series = plan.series(references.until, step);
    let mut work = Work::new(scene, plan, &references, watcher, started, series.iter().map(Vec::len).sum());
    work.run(series);
    let Work { mut measurements, skipped, stopped, .. } = work;
    measurements.sort_by_key(|(series, _)| *series);
    let measurements: Vec<Measurement> = measurements.into_iter().map(|(_, measurement)| measurement).collect();
    let uncertainty = references.uncertainty.position;
    let mut study = Study {
        scene: scene.name.clone().unwrap_or_default(),
        particles: particles.len(),
        duration: scene.duration,
        until: references.until,
        whole: references.whole,
        rests: references.rests,
        uncertainty,
        reference_positions: references.positions(),
        reference_evaluations: references.evaluations,
        fits: fits(&measurements, uncertainty, references.until),
        measurements,
        skipped,
        ensembles: Vec::new(),
        stopped,
    };
    if !references.whole && plan.seeds > 0 && !stopped {
        study.statistics(scene, plan, started, watcher);
    }
    Ok(study)
}

impl Study {
    /// Statistics over seeds of the finest case of every scheme that the budget allows.
    fn statistics(&mut self, scene: &Scene, plan: &Plan, started: Instant, watcher: &mut dyn Watcher) {
        for (k, &scheme) in plan.schemes.iter().enumerate() {
            let longer = plan.seeds as f64 * scene.duration / self.until;
            let left = plan.budget - started.elapsed().as_secs_f64();
            let finest = (self.measurements.iter())
                .filter(|m| {
                    m.scheme == scheme.name() && m.wall_seconds * longer < left / (plan.schemes.len() - k) as f64
                })
                .min_by(|a, b| a.errors.position.total_cmp(&b.errors.position));
            let Some(finest) = finest else { continue };
            let control = match (finest.step, finest.tolerance) {
                (Some(step), _) => Control::Step(step),
                (None, tolerance) => Control::Tolerance(tolerance.unwrap_or(1e-6)),
            };
            let name = scheme.name();
            if !watcher.next(k, plan.schemes.len(), &format!("{} seeds, {name}", plan.seeds)) {
                self.stopped = true;
                return;
            }
            match ensemble(&Case { scheme, control }, scene, plan.seeds) {
                Ok(ensemble) => self.ensembles.push(ensemble),
                Err(reason) => {
                    let (step, tolerance) = (finest.step, finest.tolerance);
                    self.skipped.push(Skipped { scheme: name, step, tolerance, reason });
                }
            }
        }
    }
}

/// Work in progress.
struct Work<'a> {
    scene: &'a Scene,
    plan: &'a Plan,
    references: &'a References,
    watcher: &'a mut dyn Watcher,
    started: Instant,
    planned: usize,
    done: usize,
    /// With the number of their series.
    measurements: Vec<(usize, Measurement)>,
    skipped: Vec<Skipped>,
    stopped: bool,
}

impl<'a> Work<'a> {
    fn new(
        scene: &'a Scene,
        plan: &'a Plan,
        references: &'a References,
        watcher: &'a mut dyn Watcher,
        started: Instant,
        planned: usize,
    ) -> Self {
        Self {
            scene,
            plan,
            references,
            watcher,
            started,
            planned,
            done: 0,
            measurements: Vec::new(),
            skipped: Vec::new(),
            stopped: false,
        }
    }

    /// Always the case next that takes the least time: what the budget cuts off is the dearest of each series.
    fn run(&mut self, series: Vec<Vec<Case>>) {
        let mut open: Vec<(usize, std::collections::VecDeque<Case>)> =
            series.into_iter().map(Into::into).enumerate().collect();
        loop {
            open.retain(|(_, cases)| !cases.is_empty());
            let cost = |(number, cases): &(usize, std::collections::VecDeque<Case>)| {
                cases.front().map_or(f64::INFINITY, |case| self.expected(*number, case))
            };
            let costs: Vec<f64> = open.iter().map(cost).collect();
            let Some(next) = (0..open.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])) else { return };
            let (number, cases) = &mut open[next];
            let (number, Some(case)) = (*number, cases.pop_front()) else { return };
            if !self.case(number, &case) {
                self.planned -= cases.len();
                cases.clear();
            }
            if self.stopped {
                return;
            }
        }
    }

    /// Time that a case will take, by the one before it in its series [s]; zero for the first.
    fn expected(&self, series: usize, case: &Case) -> f64 {
        let last = self.measurements.iter().rev().find(|(number, _)| *number == series);
        last.map_or(0.0, |(_, last)| {
            // So many steps more; a tolerance ten times tighter takes about twice as many.
            let longer = match (last.step, case.control) {
                (Some(before), Control::Step(now)) => before / now,
                _ => 2.0,
            };
            let once = longer * last.wall_seconds;
            if once > 1.0 { once } else { once * self.plan.repeats as f64 }
        })
    }

    /// Measures a case; false where its series ends with it.
    fn case(&mut self, series: usize, case: &Case) -> bool {
        let (step, tolerance) = match case.control {
            Control::Step(dt) => (Some(dt), None),
            Control::Tolerance(tolerance) => (None, Some(tolerance)),
        };
        let what = match case.control {
            Control::Step(dt) => format!("{}, step {dt:.2e} s", case.scheme.name()),
            Control::Tolerance(tolerance) => format!("{}, tolerance {tolerance:.0e}", case.scheme.name()),
        };
        if !self.watcher.next(self.done, self.planned, &what) {
            self.stopped = true;
            return false;
        }
        self.done += 1;
        let skip = |reason: String| Skipped { scheme: case.scheme.name(), step, tolerance, reason };
        let left = self.plan.budget - self.started.elapsed().as_secs_f64();
        let expected = self.expected(series, case);
        if expected > left || left <= 0.0 {
            let reason = format!("the budget of {} s is spent; it would take some {expected:.1e} s", self.plan.budget);
            self.skipped.push(skip(reason));
            return false;
        }
        match measure(case, self.scene, self.references.until, &self.references.end, self.plan.repeats) {
            Ok(measurement) => {
                let error = measurement.errors.position;
                self.measurements.push((series, measurement));
                error > NOISE * self.references.uncertainty.position.max(ROUND_OFF)
            }
            Err(reason) => {
                // A step too long to be solved; a shorter one may do.
                self.skipped.push(skip(reason));
                true
            }
        }
    }
}
