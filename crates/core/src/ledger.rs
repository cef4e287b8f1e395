//! The energy ledger: what must balance, and the residual that nothing explains.

use crate::assembly::Model;
use crate::clusters;
use crate::math::Sum;
use crate::observer::Sample;
use crate::simulation::Simulation;
use crate::state::{Particles, State};
use nalgebra::Vector3;

/// Energies at one instant [J]. Effects that the scene does not have stay zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Kinetic energy, sum of m v.v/2; recomputable from states.
    pub kinetic: f64,
    /// Near-field potential, zero at the cut-off; recomputable.
    pub near_field: f64,
    /// Binding potential, zero at activation; recomputable.
    pub binding: f64,
    /// Potential of gravity and electric field in the recorded (wrapped) positions; recomputable.
    pub external: f64,
    /// Thermal energy, sum of m C theta; recomputable.
    pub thermal: f64,
    /// What accumulates.
    pub totals: Totals,
    /// Energy that nothing explains, the numerical error: change of all of the above against the start.
    pub residual: f64,
}

/// What accumulates from the start of a run. Energies [J], momenta [N s].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Reaction heat released into particles; recomputable from impacts.
    pub reaction_heat: f64,
    /// Heat lost by convection; recorded only (recomputable where radiation is absent).
    pub convected: f64,
    /// Heat lost by radiation; recorded only (recomputable where convection is absent).
    pub radiated: f64,
    /// Kinetic energy lost to normal impulses; recomputable from impacts.
    pub impact_loss: f64,
    /// Kinetic energy lost to friction in impacts; recomputable from impacts.
    pub friction_loss: f64,
    /// Kinetic energy lost in contacts taken as resting, sliding included; recorded only.
    pub resting_loss: f64,
    /// Work done along periodic directions: jumps of the external potential where a particle is wrapped; recorded only.
    pub periodic_work: f64,
    /// Momentum given to the cloud by external forces and walls, which total momentum must equal.
    pub outside_impulse: [f64; 3],
}

/// Momentum of the cloud at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Momentum {
    /// Sum of m v [kg m/s].
    pub linear: [f64; 3],
    /// Sum of r x m v about the origin [kg m^2/s].
    pub angular: [f64; 3],
    /// |P - P_0 - outside impulse| over the largest sum of m |v| so far (or the outside impulse, where that is more) [-].
    pub residual: f64,
}

impl Simulation {
    /// Energies, momentum and clusters of the current state.
    pub(crate) fn sample(&mut self) -> Sample {
        let range = self.model.cluster_range;
        let clusters = range.zip(self.model.search.as_mut()).map(|(range, search)| {
            let pairs = search.close(&self.state.position, &self.particles, &self.model.domain, range);
            clusters::components(self.particles.len(), pairs)
        });
        Sample { ledger: self.ledger(), momentum: self.momentum(), clusters }
    }

    fn ledger(&self) -> Ledger {
        let held = held(&self.model, &self.particles, &self.state);
        let mut ledger = Ledger { totals: self.totals, ..held };
        ledger.residual = ledger.balance() - self.initial_energy;
        ledger
    }

    fn momentum(&self) -> Momentum {
        let (linear, mut angular) = momentum(&self.particles, &self.state);
        let moved = self.origin.cross(&Vector3::from(linear));
        angular.iter_mut().zip(moved.iter()).for_each(|(angular, moved)| *angular += moved);
        let outside = Vector3::from(self.totals.outside_impulse);
        let unexplained = Vector3::from(linear) - Vector3::from(self.initial_momentum.linear) - outside;
        let size = self.counters.largest_momentum.max(outside.norm());
        let residual = if unexplained.norm() > 0.0 { unexplained.norm() / size } else { 0.0 };
        Momentum { linear, angular, residual }
    }

    /// Sum of m |v| [kg m/s].
    pub(crate) fn momentum_size(&self) -> f64 {
        let v = &self.state.velocity;
        self.particles.mass.iter().enumerate().map(|(i, mass)| mass * v.get(i).norm()).sum()
    }
}

impl Ledger {
    /// What the run must conserve: energy held, plus what was lost, minus what was given [J].
    #[must_use]
    pub fn balance(&self) -> f64 {
        let totals = &self.totals;
        let held = [self.kinetic, self.near_field, self.binding, self.external, self.thermal];
        let lost = [
            totals.impact_loss,
            totals.friction_loss,
            totals.resting_loss,
            totals.convected,
            totals.radiated,
            -totals.reaction_heat,
            -totals.periodic_work,
        ];
        held.into_iter().chain(lost).collect::<Sum>().value()
    }
}

/// Sum of m v.v/2 [J].
#[must_use]
pub fn kinetic_energy(particles: &Particles, state: &State) -> f64 {
    let energy = |(i, mass): (usize, &f64)| 0.5 * mass * state.velocity.get(i).norm_squared();
    particles.mass.iter().enumerate().map(energy).collect::<Sum>().value()
}

/// Energies that a state holds [J]; what accumulates, and the residual, are zero.
#[must_use]
pub fn held(model: &Model, particles: &Particles, state: &State) -> Ledger {
    let r = &state.position;
    let (near_field, binding) = model.field.as_ref().map_or((0.0, 0.0), |field| field.energies(r));
    Ledger { near_field, binding, ..held_by_particles(model, particles, state) }
}

/// Energies that the particles of a state hold each for itself: kinetic, external, thermal [J]; all else is zero.
#[must_use]
pub fn held_by_particles(model: &Model, particles: &Particles, state: &State) -> Ledger {
    let mass = &particles.mass;
    let thermal: Sum = match (&state.temperature, model.heat_capacity) {
        (Some(theta), Some(capacity)) => (0..mass.len()).map(|i| mass[i] * capacity * theta[i]).collect(),
        _ => Sum::default(),
    };
    Ledger {
        kinetic: kinetic_energy(particles, state),
        external: model.external.as_ref().map_or(0.0, |external| external.energy(&state.position)),
        thermal: thermal.value(),
        ..Ledger::default()
    }
}

/// Sum of m v [kg m/s], and of r x m v about the origin [kg m^2/s].
#[must_use]
pub fn momentum(particles: &Particles, state: &State) -> ([f64; 3], [f64; 3]) {
    let (mut linear, mut angular) = ([Sum::default(); 3], [Sum::default(); 3]);
    for (i, &mass) in particles.mass.iter().enumerate() {
        let momentum = mass * state.velocity.get(i);
        let moment = state.position.get(i).cross(&momentum);
        for k in 0..3 {
            linear[k].add(momentum[k]);
            angular[k].add(moment[k]);
        }
    }
    (linear.map(Sum::value), angular.map(Sum::value))
}
