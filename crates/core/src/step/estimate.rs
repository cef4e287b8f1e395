//! What an attempt at a step looks like to the step control: its local error, and how far it moves particles.

use crate::collocation::Collocation;
use crate::convergence::Verdict;
use crate::events::Events;
use crate::local_error::LocalErrors;
use crate::scene::ModelKind;
use crate::simd::vectorized;
use crate::simulation::Simulation;
use crate::step_control::{Attempt, TRAVEL_SHARE, Worst};
use nalgebra::Vector3;

/// Largest kick of an unresolved acceleration, over the fastest speed of the cloud [-]. A fall into a singularity exceeds
/// any such bound sooner or later; a smaller one also shortens steps where a pair merely crosses a cut-off.
const KICK: f64 = 0.02;

impl Simulation {
    /// What the step control needs to know about an attempt.
    pub(super) fn attempt(&self, dt: f64, verdict: Verdict) -> Attempt {
        let consistent = self.model.kind == ModelKind::Consistent && verdict == Verdict::Converged;
        Attempt {
            dt,
            verdict,
            local_error: consistent.then(|| self.local_error(dt)),
            travel: (consistent && self.model.contact.as_ref().is_some_and(|law| !law.located)).then(|| self.travel()),
        }
    }

    /// Largest difference between r' and the third-order r + dt v + dt^2 (a/3 + a'/6), in mean diameters, over
    /// the largest allowed [-]. A kick that turns the motion of the whole cloud around counts as too large at any tolerance:
    /// near a singular attraction that difference is small although nothing is resolved.
    pub(super) fn local_error(&self, dt: f64) -> Worst {
        let (error, kick) = match &self.stagger.collocation {
            Some(collocation) => self.collocation_error(collocation, dt),
            None => self.local_errors(dt),
        };
        if kick.size > KICK && error.size <= 1.0 { Worst { size: 8.0, ..kick } } else { error }
    }

    fn local_errors(&self, dt: f64) -> (Worst, Worst) {
        let integrator = &self.model.integrator;
        vectorized(LocalErrors {
            before: &self.acceleration,
            force: &self.stagger.field_force,
            jump: self.events.as_ref().and_then(Events::jumps),
            mass: &self.particles.mass,
            velocity: &self.state.velocity,
            dt,
            scale: dt * dt / (self.model.mean_diameter * self.local_bound),
            weights: (integrator.position_new - 1.0 / 6.0, integrator.position_old - 1.0 / 3.0),
            unresolved: 0.5,
        })
    }

    fn collocation_error(&self, collocation: &Collocation, dt: f64) -> (Worst, Worst) {
        let error = collocation.local_error(dt);
        let error = Worst { size: error.size / (self.model.mean_diameter * self.local_bound), ..error };
        let n = self.acceleration.len();
        let fastest = (0..n).map(|i| self.state.velocity.get(i).norm()).fold(0.0, f64::max);
        let kick = Worst::of((0..n).map(|i| {
            let (before, after) = (self.acceleration.get(i), self.stagger.field_force.get(i) / self.particles.mass[i]);
            let (change, size) = collocation.defect(i);
            let own = (self.state.velocity.get(i) + (before + after) * (0.5 * dt)).norm();
            if change > 0.1 * size { dt * change / fastest.max(own).max(0.5 * dt * size) } else { 0.0 }
        }));
        (error, kick)
    }

    /// Bound on how far any two (or one and a wall) came nearer, over what contacts allow in a step [-].
    pub(super) fn travel(&self) -> Worst {
        let (from, to) = (&self.state.position, &self.stagger.position);
        let n = from.len();
        let moved = |i: usize| to.get(i) - from.get(i);
        let mean = (0..n).map(moved).sum::<Vector3<f64>>() / n as f64;
        let allowed = TRAVEL_SHARE * self.model.smallest_diameter;
        let walls = !self.model.domain.walls.is_empty();
        Worst::of((0..n).map(|i| {
            let between = if n > 1 { 2.0 * (moved(i) - mean).norm() } else { 0.0 };
            let to_walls = if walls { moved(i).norm() } else { 0.0 };
            between.max(to_walls) / allowed
        }))
    }
}
