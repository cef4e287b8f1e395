//! The runs' curves on common times, and how far they are from one another.

use super::plan::{Binding, KAPPAS, Results};
use crate::run::{INTERVAL, Run};
use crate::statistics::{Estimate, deviation, range, resample, root_mean_square};

/// Duration of the runs [s].
pub const DURATION: f64 = 5.0;

/// What a figure shows over time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Kinetic energy per unit mass [J/kg].
    Kinetic,
    /// Mean temperature [K].
    Temperature,
}

/// Curves of the runs of Table I or II at the times of [`times`].
#[derive(Clone, Debug)]
pub struct Curves {
    /// By kappa, then by seed.
    pub by_kappa: Vec<Vec<Vec<f64>>>,
}

/// Times of all curves: a point every [`INTERVAL`].
#[must_use]
pub fn times() -> Vec<f64> {
    (0..=(DURATION / INTERVAL).round() as usize).map(|k| k as f64 * INTERVAL).collect()
}

impl Curves {
    /// Of the four cases with or without binding.
    #[must_use]
    pub fn new(quantity: Quantity, binding: Binding, results: &Results) -> Self {
        let grid = times();
        let curve = |run: &Run| {
            let values = match quantity {
                Quantity::Kinetic => &run.kinetic,
                Quantity::Temperature => &run.temperature,
            };
            resample(&run.times, values, &grid)
        };
        let by_kappa = KAPPAS.iter().map(|&kappa| results.table(binding, kappa).iter().map(curve).collect()).collect();
        Self { by_kappa }
    }

    /// The first seed's curves, by kappa.
    #[must_use]
    pub fn first(&self) -> Vec<Vec<f64>> {
        self.by_kappa.iter().filter_map(|seeds| seeds.first().cloned()).collect()
    }

    /// Mean over seeds, by kappa.
    #[must_use]
    pub fn means(&self) -> Vec<Vec<f64>> {
        self.by_kappa.iter().map(|seeds| pointwise(seeds, |values| Estimate::of(values).mean)).collect()
    }

    /// Smallest and largest value over seeds, by kappa.
    #[must_use]
    pub fn bands(&self) -> Vec<Vec<(f64, f64)>> {
        self.by_kappa.iter().map(|seeds| pointwise(seeds, range)).collect()
    }

    /// Smallest and largest value over all runs.
    #[must_use]
    pub fn band(&self) -> Vec<(f64, f64)> {
        pointwise(&self.by_kappa.concat(), range)
    }

    /// Smallest and largest value at any time.
    #[must_use]
    pub fn range(&self) -> (f64, f64) {
        range(&self.by_kappa.concat().concat())
    }

    /// Each curve less the mean over kappa of its seed: what the reaction energy changes for the same start.
    #[must_use]
    pub fn deviations(&self) -> Self {
        let mut deviations = self.clone();
        for seed in 0..self.seeds() {
            let mean = pointwise(&self.of_seed(seed), |values| Estimate::of(values).mean);
            for curves in &mut deviations.by_kappa {
                curves[seed].iter_mut().zip(&mean).for_each(|(value, mean)| *value -= mean);
            }
        }
        deviations
    }

    /// For every seed: the root mean square over time of the standard deviation over kappa.
    #[must_use]
    pub fn spreads(&self) -> Vec<f64> {
        (0..self.seeds()).map(|seed| root_mean_square(&pointwise(&self.of_seed(seed), deviation))).collect()
    }

    fn seeds(&self) -> usize {
        self.by_kappa.iter().map(Vec::len).min().unwrap_or(0)
    }

    fn of_seed(&self, seed: usize) -> Vec<Vec<f64>> {
        self.by_kappa.iter().map(|seeds| seeds[seed].clone()).collect()
    }
}

/// Something of the values that several curves have at each time.
fn pointwise<T>(curves: &[Vec<f64>], of: impl Fn(&[f64]) -> T) -> Vec<T> {
    let points = curves.iter().map(Vec::len).min().unwrap_or(0);
    (0..points).map(|k| of(&curves.iter().map(|curve| curve[k]).collect::<Vec<_>>())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two values of kappa, two seeds, two times.
    fn curves() -> Curves {
        Curves { by_kappa: vec![vec![vec![1.0, 2.0], vec![10.0, 10.0]], vec![vec![1.0, 4.0], vec![10.0, 10.0]]] }
    }

    #[test]
    fn spread_is_taken_for_the_same_seed_only() {
        // Seed 1: deviations 0 and sqrt(2) (of 2 and 4), rms 1. Seed 2: none, however far it is from seed 1.
        let spreads = curves().spreads();
        assert!((spreads[0] - 1.0).abs() < 1e-15 && spreads[1] == 0.0, "{spreads:?}");
        assert_eq!(curves().deviations().by_kappa, [[vec![0.0, -1.0], vec![0.0; 2]], [vec![0.0, 1.0], vec![0.0; 2]]]);
    }

    #[test]
    fn means_and_bands_are_over_seeds() {
        assert_eq!(curves().means(), [[5.5, 6.0], [5.5, 7.0]]);
        assert_eq!(curves().bands()[1], [(1.0, 10.0), (4.0, 10.0)]);
        assert_eq!(curves().band(), [(1.0, 10.0), (2.0, 10.0)]);
        assert_eq!(curves().range(), (1.0, 10.0));
        assert_eq!(curves().first(), [[1.0, 2.0], [1.0, 4.0]]);
    }
}
