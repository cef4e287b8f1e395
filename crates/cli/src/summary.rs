//! What a run amounted to, as JSON for programs and as a few lines for people.

use std::time::Duration;

use agglo_core::scene::{ModelKind, Scene};
use agglo_core::{Outcome, Simulation};
use serde::{Serialize, Serializer};

use crate::numbers::{counted, short};
use crate::size;

/// The object that `agglo run --summary` writes. What the scene does not have is null.
#[derive(Debug, Serialize)]
pub struct Summary {
    name: Option<String>,
    model: ModelKind,
    seed: u64,
    particles: usize,
    #[serde(serialize_with = "number")]
    time: f64,
    steps: u64,
    iterations: u64,
    rejected_steps: u64,
    impacts: u64,
    pair_evaluations: u64,
    wall_seconds: f64,
    #[serde(serialize_with = "number")]
    kinetic_energy: f64,
    #[serde(serialize_with = "number")]
    kinetic_energy_per_mass: f64,
    #[serde(serialize_with = "optional")]
    mean_temperature: Option<f64>,
    #[serde(serialize_with = "optional")]
    max_temperature: Option<f64>,
    clusters: Option<u32>,
    largest_cluster: Option<u32>,
    #[serde(serialize_with = "number")]
    energy_residual: f64,
    #[serde(serialize_with = "number")]
    momentum_residual: f64,
    #[serde(serialize_with = "number")]
    max_overlap: f64,
    log_bytes: Option<u64>,
}

/// A number that reads back to the same one; JSON has none for the others, which are strings.
fn number<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match *value {
        value if value.is_finite() => serializer.serialize_f64(value),
        value if value.is_nan() => serializer.serialize_str("NaN"),
        value if value > 0.0 => serializer.serialize_str("Infinity"),
        _ => serializer.serialize_str("-Infinity"),
    }
}

fn optional<S: Serializer>(value: &Option<f64>, serializer: S) -> Result<S::Ok, S::Error> {
    match value {
        Some(value) => number(value, serializer),
        None => serializer.serialize_none(),
    }
}

impl Summary {
    /// What a run amounted to.
    #[must_use]
    pub fn new(scene: &Scene, simulation: &Simulation, outcome: &Outcome, wall: Duration, log: Option<u64>) -> Self {
        let particles = simulation.particles();
        let temperature = simulation.state().temperature.as_deref();
        let ledger = &outcome.sample.ledger;
        let clusters = outcome.sample.clusters.as_ref();
        Self {
            name: scene.name.clone(),
            model: scene.model,
            seed: scene.seed,
            particles: particles.len(),
            time: outcome.time,
            steps: outcome.counters.steps,
            iterations: outcome.counters.iterations,
            rejected_steps: outcome.counters.rejected_steps,
            impacts: outcome.counters.impacts,
            pair_evaluations: outcome.counters.pair_evaluations,
            wall_seconds: wall.as_secs_f64(),
            kinetic_energy: ledger.kinetic,
            kinetic_energy_per_mass: ledger.kinetic / particles.mass.iter().sum::<f64>(),
            mean_temperature: temperature.map(|t| t.iter().sum::<f64>() / t.len() as f64),
            max_temperature: temperature.map(|t| t.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
            clusters: clusters.map(|c| c.count),
            largest_cluster: clusters.map(|c| c.largest),
            energy_residual: ledger.residual,
            momentum_residual: outcome.sample.momentum.residual,
            max_overlap: outcome.counters.max_overlap,
            log_bytes: log,
        }
    }

    /// The JSON object, with a line end.
    #[must_use]
    pub fn json(&self) -> String {
        // Serialising numbers, strings and options into memory cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// A few lines for people; `log` is the log's name.
    #[must_use]
    pub fn text(&self, log: Option<&str>) -> String {
        let mut lines = vec![format!(
            "t = {} s: {}, {}, {} rejected, {}, in {:.2} s",
            short(self.time),
            counted(self.steps, "step"),
            counted(self.iterations, "iteration"),
            self.rejected_steps,
            counted(self.impacts, "impact"),
            self.wall_seconds
        )];
        let mut state =
            format!("kinetic energy {} J ({} J/kg)", short(self.kinetic_energy), short(self.kinetic_energy_per_mass));
        if let (Some(mean), Some(max)) = (self.mean_temperature, self.max_temperature) {
            state += &format!(", temperature {} K in the mean, {} K at most", short(mean), short(max));
        }
        if let (Some(clusters), Some(largest)) = (self.clusters, self.largest_cluster) {
            state += &format!(", {} (largest: {largest})", counted(clusters.into(), "cluster"));
        }
        lines.push(state);
        lines.push(format!(
            "energy unexplained {} J, momentum unexplained {} of the whole, deepest overlap {} m",
            short(self.energy_residual),
            short(self.momentum_residual),
            short(self.max_overlap)
        ));
        if let (Some(log), Some(bytes)) = (log, self.log_bytes) {
            lines.push(format!("log: {log}, {}", size::human(bytes)));
        }
        lines.join("\n")
    }
}
