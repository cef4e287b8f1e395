//! The end of an accepted step: what is booked, looked at and said of it.

use crate::contact::search::{TOUCHING, visit_close};
use crate::diagnostics::{Level, RejectionCause};
use crate::error::RunError;
use crate::simulation::{OnceNotice, Simulation};
use crate::state::Columns;
use crate::step_control::{Attempt, TRAVEL_SHARE};

impl Simulation {
    pub(super) fn book_outside_impulse(&mut self, dt: f64) {
        if let Some(external) = &self.model.external {
            let impulse = external.total() * dt;
            for k in 0..3 {
                self.totals.outside_impulse[k] += impulse[k];
            }
        }
    }

    /// Bonds and the deepest overlap at the step's end.
    pub(super) fn look_around(&mut self) {
        let contact = self.model.contact.is_some();
        if let (Some(range), Some(search)) = (self.model.bond_range, &mut self.model.search) {
            let pairs = search.close(&self.state.position, &self.particles, &self.model.domain, range);
            self.diagnostics.bonds = Some(pairs.len() as u64);
        }
        if !contact {
            return;
        }
        let mut deepest = self.counters.max_overlap;
        let radius = &self.particles.radius;
        visit_close(&self.state.position, radius, &self.model.domain.periodic, 1.0, |pair| {
            let touch = radius[pair.i as usize] + radius[pair.j as usize];
            // Touching within round-off is no overlap.
            if pair.square < touch * touch * (1.0 - TOUCHING) {
                deepest = deepest.max(touch - pair.square.sqrt());
            }
        });
        for wall in &self.model.domain.walls {
            for (i, radius) in self.particles.radius.iter().enumerate() {
                deepest = deepest.max(radius - wall.distance(&self.state.position.get(i)));
            }
        }
        self.counters.max_overlap = deepest;
    }

    pub(super) fn fill_diagnostics(&mut self, attempt: &Attempt) {
        let sweeps = &self.stagger.sweeps;
        let diagnostics = &mut self.diagnostics;
        diagnostics.dt = attempt.dt;
        diagnostics.position_errors.clone_from(&sweeps.position);
        diagnostics.temperature_errors.clone_from(&sweeps.temperature);
        diagnostics.violation = sweeps.violation;
        diagnostics.scaling = self.control.scaling;
        diagnostics.contraction = match sweeps.position.as_slice() {
            [.., before, last] if *before > 0.0 => last / before,
            _ => f64::NAN,
        };
        diagnostics.local_error = attempt.local_error.map(|error| error.size * self.local_bound);
        diagnostics.pairs_evaluated = self.stagger.pairs_evaluated;
        self.counters.steps += 1;
        self.counters.iterations += diagnostics.iterations();
        self.counters.rejected_steps += diagnostics.rejected.len() as u64;
        self.counters.impacts += self.impacts.len() as u64;
        self.counters.pair_evaluations += diagnostics.pairs_evaluated;
        if self.control.fixed && attempt.travel.is_some_and(|travel| travel.size > 1.0) {
            self.notice_once(
                OnceNotice::Travel,
                Level::Warning,
                format!(
                    "with solver.step.fixed particles move more than {TRAVEL_SHARE} of a diameter in a step at t = {} s: \
                     impacts are seen late or missed; a smaller or adaptive step sees them",
                    self.time
                ),
            );
        }
    }

    /// Notes how much momentum there is; where that is no number, says whose.
    pub(super) fn check_finite(&mut self) -> Result<(), RunError> {
        let momentum = self.momentum_size();
        self.counters.largest_momentum = self.counters.largest_momentum.max(momentum);
        let bad = |columns: &Columns| {
            if columns.is_finite() {
                return None;
            }
            (0..columns.len())
                .find_map(|i| columns.get(i).iter().copied().find(|x| !x.is_finite()).map(|value| (i as u32, value)))
        };
        let temperature = self.state.temperature.as_ref().and_then(|theta| {
            let i = theta.iter().position(|theta| !theta.is_finite())?;
            Some((i as u32, theta[i]))
        });
        let found = [("velocity", bad(&self.state.velocity)), ("position", bad(&self.state.position))]
            .into_iter()
            .chain([("temperature", temperature)])
            .find_map(|(quantity, found)| found.map(|(particle, value)| (quantity, particle, value)));
        match found {
            None => Ok(()),
            Some((quantity, particle, value)) => Err(RunError::NotFinite {
                time: self.time,
                particle,
                quantity,
                value,
                advice: self.advice(RejectionCause::NotFinite),
            }),
        }
    }
}
