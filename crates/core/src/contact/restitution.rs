//! Restitution (35): e = max(e0 (1 - u/v*), e_min) max(1 - theta/theta*, 0).
//!
//! u approach speed [m/s], theta mean temperature of the two [K]; v*, theta* may be absent. Valid for every u and theta:
//! beyond theta* impacts are plastic, and nothing divides by e.

use crate::scene;

/// e_min where the scene does not give one [-].
pub const E_MIN: f64 = 0.01;

/// Coefficient of restitution as a function of approach speed and temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Restitution {
    e0: f64,
    e_min: f64,
    v_star: Option<f64>,
    theta_star: Option<f64>,
}

impl Restitution {
    /// From a scene's number or law.
    #[must_use]
    pub fn new(restitution: scene::Restitution) -> Self {
        match restitution {
            scene::Restitution::Constant(e) => Self { e0: e, e_min: e, v_star: None, theta_star: None },
            scene::Restitution::Law(law) => Self {
                e0: law.e0,
                e_min: law.e_min.unwrap_or(E_MIN.min(law.e0)),
                v_star: law.v_star,
                theta_star: law.theta_star,
            },
        }
    }

    /// e at approach speed u [m/s] and temperature theta [K].
    #[must_use]
    pub fn at(&self, u: f64, theta: Option<f64>) -> f64 {
        let cold = match self.v_star {
            Some(v_star) => (self.e0 * (1.0 - u / v_star)).max(self.e_min),
            None => self.e0,
        };
        match (self.theta_star, theta) {
            (Some(theta_star), Some(theta)) => cold * (1.0 - theta / theta_star).max(0.0),
            _ => cold,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Restitution;
    use crate::scene::{self, RestitutionLaw};

    #[test]
    fn equation_35() {
        let law = RestitutionLaw { e0: 0.5, e_min: None, v_star: Some(10.0), theta_star: Some(3000.0) };
        let e = Restitution::new(scene::Restitution::Law(law));
        assert_eq!(e.at(0.0, None), 0.5);
        assert_eq!(e.at(5.0, Some(1500.0)), 0.125);
        assert_eq!(e.at(9.99, Some(0.0)), 0.01);
        assert_eq!(e.at(1.0, Some(3000.0)), 0.0);
        assert_eq!(e.at(1.0, Some(1e9)), 0.0);
    }
}
