//! Reaction heat (39): each particle of an impact gets kappa min(|I_n|/I*, 1) pi b^2, b the smaller radius.
//!
//! kappa energy per area [J/m^2], I_n mean contact force [N], I* force scale [N]. The heat is the ledger's reaction heat.

use crate::scene;

/// Heat set free by impacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReactionHeat {
    energy_per_area: f64,
    force_scale: f64,
}

impl ReactionHeat {
    /// From a scene's section; `None` where it names no reaction.
    #[must_use]
    pub fn new(thermal: &scene::Thermal) -> Option<Self> {
        let reaction = thermal.reaction?;
        Some(Self { energy_per_area: reaction.energy_per_area, force_scale: reaction.force_scale })
    }

    /// Heat for each particle at a mean contact force [N] and smaller radius [m], in joules.
    #[must_use]
    pub fn at(&self, mean_force: f64, radius: f64) -> f64 {
        self.energy_per_area * (mean_force.abs() / self.force_scale).min(1.0) * std::f64::consts::PI * radius * radius
    }

    /// As [`ReactionHeat::at`] without the limit: of many impacts, each below the force scale, whose forces add up to this.
    #[must_use]
    pub fn linear(&self, force: f64, radius: f64) -> f64 {
        self.energy_per_area * (force.abs() / self.force_scale) * std::f64::consts::PI * radius * radius
    }
}
