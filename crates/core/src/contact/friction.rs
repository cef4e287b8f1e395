//! Stick-slip friction, (31)-(33), as vectors.
//!
//! The impulse that would stop all sliding, J = m_eff [(v_j - v_i)_t + (E_j/m_j - E_i/m_i)_t dt] on i [N s], is kept
//! where |J| <= mu_s P, else it becomes mu_d P J/|J|; P the normal impulse. Defined for zero sliding; never adds kinetic
//! energy; what it takes is the friction loss of the ledger. Spheres do not spin, so angular momentum is not conserved.

use crate::scene;
use nalgebra::Vector3;

/// Coefficients of friction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// mu_s [-].
    pub static_: f64,
    /// mu_d <= mu_s [-].
    pub dynamic: f64,
}

impl Friction {
    /// From a scene's section.
    #[must_use]
    pub fn new(friction: scene::Friction) -> Self {
        Self { static_: friction.static_, dynamic: friction.dynamic }
    }

    /// Tangential impulse on i, and whether it slips, from the impulse that would make it stick and the normal impulse
    /// [N s].
    #[must_use]
    pub fn impulse(&self, stick: Vector3<f64>, normal_impulse: f64) -> (Vector3<f64>, bool) {
        let size = stick.norm();
        if size > self.static_ * normal_impulse {
            (stick * (self.dynamic * normal_impulse / size), true)
        } else {
            (stick, false)
        }
    }
}

/// The part of a vector across a unit normal.
#[must_use]
pub fn tangential(v: Vector3<f64>, normal: Vector3<f64>) -> Vector3<f64> {
    v - normal * v.dot(&normal)
}
