//! The energy ledger: what must balance, and the residual that nothing explains.

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
    /// |P - P_0 - outside impulse| over the sum of m |v| [-].
    pub residual: f64,
}
