//! Attempts that are given up, and when a run is.

use crate::diagnostics::{RejectedAttempt, RejectionCause};
use crate::error::RunError;
use crate::simulation::Simulation;
use crate::step_control::{Attempt, MAX_ATTEMPTS};

impl Simulation {
    /// The scene's smallest step, or the smallest that still moves the time where that is more [s].
    pub(super) fn smallest_step(&self) -> f64 {
        self.control.min.max(f64::EPSILON * self.time)
    }

    /// Notes a rejected attempt, and gives the next step or gives up.
    pub(super) fn reject(&mut self, cause: RejectionCause, attempt: &Attempt, retry_dt: f64) -> Result<f64, RunError> {
        let (dt, sweeps) = (attempt.dt, &self.stagger.sweeps);
        let blamed = match cause {
            RejectionCause::LocalError => attempt.local_error,
            RejectionCause::Travel => attempt.travel,
            RejectionCause::NotConverged | RejectionCause::NotFinite => None,
        };
        let violation = blamed.map_or(sweeps.violation, |worst| worst.size);
        self.diagnostics.rejected.push(RejectedAttempt {
            dt,
            cause,
            iterations: sweeps.iterations() as u64,
            violation,
            particle: blamed.map_or(sweeps.worst, |worst| worst.particle),
        });
        let attempts = self.diagnostics.rejected.len() as u64;
        let too_small = retry_dt < self.smallest_step();
        if !self.control.fixed && !too_small && attempts < MAX_ATTEMPTS {
            return Ok(retry_dt);
        }
        let particles = blamed.map_or_else(|| self.stagger.most_moved(), |worst| worst.particles());
        let advice = self.advice(cause);
        let time = self.time;
        Err(if too_small && !self.control.fixed {
            RunError::StepTooSmall {
                time,
                dt: retry_dt,
                min: self.smallest_step(),
                cause,
                particles,
                violation,
                advice,
            }
        } else {
            RunError::TooManyRejections { time, dt, attempts, cause, particles, violation, advice }
        })
    }

    pub(super) fn advice(&self, cause: RejectionCause) -> String {
        let fixed = if self.control.fixed { "a smaller solver.step.fixed or an adaptive step, " } else { "" };
        let rest = match cause {
            RejectionCause::NotConverged => "a larger solver.tolerance or solver.max_iterations, or weaker forces",
            RejectionCause::LocalError => {
                "a contact section or a repulsion that keeps particles apart, a larger solver.tolerance.position, or a \
                 smaller solver.step.min"
            }
            RejectionCause::NotFinite => {
                "particles farther apart at the start, a contact section, or a repulsion that keeps them apart"
            }
            RejectionCause::Travel => "a smaller solver.step.initial and solver.step.min",
        };
        format!("try {fixed}{rest}")
    }
}
