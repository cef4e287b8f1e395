//! Time, taken so that a busy machine spoils it least.

use std::time::Instant;

use agglo_core::observer::ObserverError;
use agglo_core::{Flow, Observer, Scene, Simulation, StepReport};

use super::Row;
use crate::Failure;

/// Seconds that all threads of this process have been computing; wall time where the system does not say.
pub fn cpu_seconds() -> f64 {
    let of_tasks = || -> Option<f64> {
        let tasks = std::fs::read_dir("/proc/self/task").ok()?;
        let mut sum = 0.0;
        for task in tasks {
            let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
            sum += text.split_whitespace().next()?.parse::<f64>().ok()?;
        }
        Some(sum * 1e-9)
    };
    of_tasks().unwrap_or_else(|| {
        static START: std::sync::OnceLock<Instant> = std::sync::OnceLock::new();
        START.get_or_init(Instant::now).elapsed().as_secs_f64()
    })
}

/// Most memory that this process has held [bytes], where the system says.
pub fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<f64>().ok()? * 1024.0)
}

/// A row of the median and the spread of values.
pub fn row(what: impl Into<String>, mut values: Vec<f64>, unit: &'static str, limit: Option<(String, f64)>) -> Row {
    values.sort_by(f64::total_cmp);
    let at = |k: usize| values.get(k).copied().unwrap_or(f64::NAN);
    let last = values.len().saturating_sub(1);
    Row { what: what.into(), value: at(values.len() / 2), spread: (at(0), at(last)), unit, limit }
}

/// The median of some values.
pub fn median(values: &[f64]) -> f64 {
    row("", values.to_vec(), "", None).value
}

/// On one thread, or several.
pub fn threads<T: Send>(number: usize, work: impl FnOnce() -> T + Send) -> Result<T, Failure> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(number).build()?.install(work))
}

/// Sees a run and wants nothing of it but its first energy.
#[derive(Debug, Default)]
pub struct Unrecorded {
    /// Near-field energy at the start [J].
    pub first_energy: Option<f64>,
}

impl Observer for Unrecorded {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        if let (None, Some(sample)) = (self.first_energy, report.sample) {
            self.first_energy = Some(sample.ledger.near_field);
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

/// What a run without recording came to.
#[derive(Clone, Copy, Debug)]
pub struct Solved {
    /// Computing time of all threads [s].
    pub cpu: f64,
    /// Wall time [s].
    pub wall: f64,
    /// Steps.
    pub steps: u64,
    /// Near-field energy at the start [J].
    pub first_energy: f64,
}

/// Solves a scene without recording it; setting it up is not counted.
pub fn solve(scene: &Scene) -> Result<Solved, Failure> {
    let mut simulation = Simulation::new(scene)?;
    let mut observer = Unrecorded::default();
    let (cpu, wall) = (cpu_seconds(), Instant::now());
    let outcome = simulation.run(&mut observer)?;
    Ok(Solved {
        cpu: cpu_seconds() - cpu,
        wall: wall.elapsed().as_secs_f64(),
        steps: outcome.counters.steps,
        first_energy: observer.first_energy.unwrap_or(f64::NAN),
    })
}
