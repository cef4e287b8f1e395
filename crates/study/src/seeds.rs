//! What remains to be said of chaotic scenes after the references part: statistics over seeds.

use agglo_core::{Scene, Simulation};
use serde::Serialize;

use crate::measure::{Watch, run};
use crate::plan::Case;

/// A mean over seeds and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Mean {
    /// Mean.
    pub mean: f64,
    /// Standard error of the mean.
    pub error: f64,
}

impl Mean {
    fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let square: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        Self { mean, error: (square / (n * (n - 1.0).max(1.0))).sqrt() }
    }
}

/// Statistics of one case at the scene's end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ensemble {
    /// Scheme.
    pub scheme: String,
    /// Fixed step [s].
    pub step: Option<f64>,
    /// Tolerance [mean diameters].
    pub tolerance: Option<f64>,
    /// Seeds that ran to the end.
    pub seeds: u64,
    /// Kinetic energy [J].
    pub kinetic: Mean,
    /// Energy residual over the initial kinetic energy, root mean square as a mean of absolute values [-].
    pub residual: Mean,
    /// Impacts.
    pub impacts: Mean,
    /// Mean temperature [K]; `None` without temperatures.
    pub temperature: Option<Mean>,
    /// Clusters; `None` where the scene does not count them.
    pub clusters: Option<Mean>,
}

/// Runs a case for seeds 1, 2, .. to the scene's end.
///
/// # Errors
/// A run that fails, with its seed.
pub(crate) fn ensemble(case: &Case, scene: &Scene, seeds: u64) -> Result<Ensemble, String> {
    let mut columns: [Vec<f64>; 5] = Default::default();
    for seed in 1..=seeds {
        let mut scene = case.scene(scene, scene.duration);
        scene.seed = seed;
        let failed = |error: &dyn std::fmt::Display| format!("seed {seed}: {error}");
        let mut simulation = Simulation::new(&scene).map_err(|error| failed(&error))?;
        let mut watch = Watch::default();
        let outcome = run(&mut simulation, scene.duration, &mut watch).map_err(|error| failed(&error))?;
        let sample = &watch.sample;
        columns[0].push(sample.ledger.kinetic);
        columns[1].push((sample.ledger.residual / watch.initial_kinetic).abs());
        columns[2].push(outcome.counters.impacts as f64);
        if let Some(theta) = &watch.state.temperature {
            columns[3].push(theta.iter().sum::<f64>() / theta.len() as f64);
        }
        if let Some(clusters) = &sample.clusters {
            columns[4].push(f64::from(clusters.count));
        }
    }
    let some = |values: &[f64]| (!values.is_empty()).then(|| Mean::of(values));
    let (step, tolerance) = match case.control {
        crate::plan::Control::Step(dt) => (Some(dt), None),
        crate::plan::Control::Tolerance(tolerance) => (None, Some(tolerance)),
    };
    Ok(Ensemble {
        scheme: case.scheme.name(),
        step,
        tolerance,
        seeds,
        kinetic: Mean::of(&columns[0]),
        residual: Mean::of(&columns[1]),
        impacts: Mean::of(&columns[2]),
        temperature: some(&columns[3]),
        clusters: some(&columns[4]),
    })
}

#[cfg(test)]
mod tests {
    use super::Mean;

    #[test]
    fn the_standard_error_is_that_of_the_mean() {
        // Variance of 1, 2, 3, 4 is 5/3.
        let mean = Mean::of(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!(mean.mean, 2.5);
        assert!((mean.error - (5.0_f64 / 12.0).sqrt()).abs() < 1e-15);
    }
}
