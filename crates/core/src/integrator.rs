//! Time integrators, as the weights that new and old acceleration get in positions and velocities.
//!
//! r' = r + dt v + dt^2 (p_new a' + p_old a),  v' = v + dt (q_new a' + q_old a),  a' the acceleration at r'.
//! Backward Euler is the paper's (49)-(50); trapezoidal and Verlet are of second order. Collocation schemes use
//! accelerations in between, too: see [`crate::collocation`].

use crate::collocation::Family;
use crate::scene::IntegratorKind;

/// Weights of one integrator [-].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Integrator {
    /// Weight p_new of the acceleration at the step's end in the position.
    pub position_new: f64,
    /// Weight p_old of the acceleration at the step's start in the position.
    pub position_old: f64,
    /// Weight q_new of the acceleration at the step's end in the velocity.
    pub velocity_new: f64,
    /// Weight q_old of the acceleration at the step's start in the velocity.
    pub velocity_old: f64,
    /// Order of accuracy on smooth motion.
    pub order: u32,
    /// Points of a collocation scheme, which has no weights of its own: those above are of a constant acceleration.
    pub collocation: Option<Family>,
}

impl Integrator {
    /// The weights of an integrator.
    #[must_use]
    pub fn of(kind: IntegratorKind) -> Self {
        let (position_new, position_old, velocity_new, velocity_old, order) = match kind {
            IntegratorKind::BackwardEuler => (1.0, 0.0, 1.0, 0.0, 1),
            IntegratorKind::Trapezoidal => (0.25, 0.25, 0.5, 0.5, 2),
            IntegratorKind::VelocityVerlet => (0.0, 0.5, 0.5, 0.5, 2),
            IntegratorKind::GaussLegendre => return Self::collocation(Family::Gauss(4)),
            IntegratorKind::GaussRadau => return Self::collocation(Family::Radau(8)),
        };
        Self { position_new, position_old, velocity_new, velocity_old, order, collocation: None }
    }

    fn collocation(family: Family) -> Self {
        Self {
            position_new: 0.0,
            position_old: 0.5,
            velocity_new: 0.0,
            velocity_old: 1.0,
            order: family.order(),
            collocation: Some(family),
        }
    }

    /// Whether r' needs no acceleration at r'.
    #[must_use]
    pub fn is_explicit(&self) -> bool {
        self.position_new == 0.0
    }

    /// Weight of an acceleration that is the same at both ends, in the position.
    #[must_use]
    pub fn position_sum(&self) -> f64 {
        self.position_new + self.position_old
    }
}
