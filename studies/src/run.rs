//! Runs of one scene: what a study keeps of them.

use agglo_core::checkpoint::Counters;
use agglo_core::observer::{Clusters, ObserverError};
use agglo_core::scene::{Record, Scene};
use agglo_core::{Flow, Observer, Simulation, StepReport};
use rayon::prelude::*;

use crate::Failure;
use crate::progress::Progress;

/// Spacing of the kept curves [s].
pub const INTERVAL: f64 = 0.02;

/// A scene to run, and what to call it in messages.
#[derive(Clone, Debug)]
pub struct Case {
    /// A few words that tell it from others.
    pub label: String,
    /// The scene.
    pub scene: Scene,
}

/// What is kept of a run.
#[derive(Clone, Debug, Default)]
pub struct Run {
    /// Steps, iterations, rejected attempts, impacts.
    pub counters: Counters,
    /// Iterations spent in rejected attempts.
    pub rejected_iterations: u64,
    /// Times of the curves below: the start, the first step end after every [`INTERVAL`], the end [s].
    pub times: Vec<f64>,
    /// Kinetic energy over total mass [J/kg].
    pub kinetic: Vec<f64>,
    /// Mean temperature [K].
    pub temperature: Vec<f64>,
    /// Highest temperature of any particle at any of these times [K].
    pub hottest: f64,
    /// Clusters at the end, where they are counted.
    pub clusters: Option<Clusters>,
    /// Energy lost in impacts, friction included, over total mass, at the end [J/kg].
    pub lost: f64,
    /// Numerical error of the energy over total mass, at the end [J/kg].
    pub residual: f64,
    /// Kinetic energy of the cloud's mean motion over total mass, at the end [J/kg].
    pub drift: f64,
}

impl Run {
    /// Kinetic energy over total mass at the end [J/kg].
    #[must_use]
    pub fn final_kinetic(&self) -> f64 {
        self.kinetic.last().copied().unwrap_or(f64::NAN)
    }

    /// Mean temperature at the end [K].
    #[must_use]
    pub fn final_temperature(&self) -> f64 {
        self.temperature.last().copied().unwrap_or(f64::NAN)
    }

    /// Iterations of accepted and rejected attempts.
    #[must_use]
    pub fn all_iterations(&self) -> u64 {
        self.counters.iterations + self.rejected_iterations
    }
}

impl Observer for Run {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        if let Some(diagnostics) = report.diagnostics {
            self.rejected_iterations += diagnostics.rejected.iter().map(|attempt| attempt.iterations).sum::<u64>();
        }
        if let Some(sample) = report.sample {
            let mass: f64 = report.particles.mass.iter().sum();
            self.times.push(report.time);
            self.kinetic.push(sample.ledger.kinetic / mass);
            if let Some(theta) = &report.state.temperature {
                self.temperature.push(theta.iter().sum::<f64>() / theta.len() as f64);
                self.hottest = theta.iter().copied().fold(self.hottest, f64::max);
            }
            let totals = &sample.ledger.totals;
            self.lost = (totals.impact_loss + totals.friction_loss + totals.resting_loss) / mass;
            self.residual = sample.ledger.residual / mass;
            self.drift = 0.5 * sample.momentum.linear.iter().map(|p| (p / mass).powi(2)).sum::<f64>();
        }
        Ok(Flow::Continue)
    }

    fn wants_checkpoints(&self) -> bool {
        false
    }
}

/// Runs every case, side by side on the threads there are; the runs are in the order of the cases.
///
/// # Errors
/// The first failure, in the order of the cases.
pub fn run_all(cases: &[Case], progress: &Progress) -> Result<Vec<Run>, Failure> {
    // Bridged, the cases are begun in their order, so that long ones at the front do not end last.
    let mut runs: Vec<(usize, Result<Run, Failure>)> =
        cases.iter().enumerate().par_bridge().map(|(k, case)| (k, run(case, progress))).collect();
    runs.sort_by_key(|(k, _)| *k);
    runs.into_iter().map(|(_, run)| run).collect()
}

fn run(case: &Case, progress: &Progress) -> Result<Run, Failure> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", case.label);
    let mut scene = case.scene.clone();
    scene.record = Record { interval: Some(INTERVAL), ..Record::default() };
    let mut run = Run::default();
    let mut simulation = Simulation::new(&scene).map_err(|error| failed(&error))?;
    let outcome = simulation.run(&mut run).map_err(|error| failed(&error))?;
    run.counters = outcome.counters;
    run.clusters = outcome.sample.clusters;
    progress.done();
    Ok(run)
}
