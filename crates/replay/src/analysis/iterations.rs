//! Statistics of iterations, rejected attempts and step sizes.

use std::collections::BTreeMap;

use agglo_core::diagnostics::{RejectionCause, StepDiagnostics};

/// Least, mean and greatest of some numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// How many.
    pub count: u64,
    /// Least; infinite of none.
    pub min: f64,
    /// Greatest; minus infinity of none.
    pub max: f64,
    sum: f64,
}

impl Default for Spread {
    fn default() -> Self {
        Self { count: 0, min: f64::INFINITY, max: f64::NEG_INFINITY, sum: 0.0 }
    }
}

impl Spread {
    /// Takes a number.
    pub(super) fn add(&mut self, value: f64) {
        self.count += 1;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        self.sum += value;
    }

    /// Mean; NaN of none.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.sum / self.count as f64
    }
}

/// How the steps of a run went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Iterations {
    /// Steps.
    pub steps: u64,
    /// Iterations of accepted attempts.
    pub total: u64,
    /// Most iterations of a step.
    pub max: u64,
    /// Steps by their number of iterations.
    pub histogram: BTreeMap<u64, u64>,
    /// Rejected attempts by cause: not converged, not finite, local error, travel.
    pub rejected: [u64; 4],
    /// Iterations of rejected attempts.
    pub wasted: u64,
    /// Step sizes [s].
    pub step_size: Spread,
    /// Contraction eps_K / eps_(K-1) of the last iteration, of steps with two or more [-].
    pub contraction: Spread,
    /// Pair distances evaluated.
    pub pairs_evaluated: u64,
}

/// Names of the causes of rejected attempts, in the order of [`Iterations::rejected`].
pub const CAUSES: [&str; 4] = ["not_converged", "not_finite", "local_error", "travel"];

impl Iterations {
    /// Mean number of iterations of a step; NaN without steps.
    #[must_use]
    pub fn mean(&self) -> f64 {
        self.total as f64 / self.steps as f64
    }

    /// Rejected attempts of all causes.
    #[must_use]
    pub fn rejected_total(&self) -> u64 {
        self.rejected.iter().sum()
    }

    /// Takes a step, and gives the contraction as its errors have it (NaN with a single iteration).
    pub(super) fn add(&mut self, step: &StepDiagnostics) -> f64 {
        let iterations = step.iterations();
        self.steps += 1;
        self.total += iterations;
        self.max = self.max.max(iterations);
        *self.histogram.entry(iterations).or_insert(0) += 1;
        for attempt in &step.rejected {
            self.rejected[cause(attempt.cause)] += 1;
            // A file may claim any number.
            self.wasted = self.wasted.saturating_add(attempt.iterations);
        }
        self.step_size.add(step.dt);
        self.pairs_evaluated = self.pairs_evaluated.saturating_add(step.pairs_evaluated);
        let contraction = match step.position_errors.as_slice() {
            [.., before, last] if *before > 0.0 => last / before,
            _ => f64::NAN,
        };
        if !contraction.is_nan() {
            self.contraction.add(contraction);
        }
        contraction
    }
}

fn cause(cause: RejectionCause) -> usize {
    match cause {
        RejectionCause::NotConverged => 0,
        RejectionCause::NotFinite => 1,
        RejectionCause::LocalError => 2,
        RejectionCause::Travel => 3,
    }
}
