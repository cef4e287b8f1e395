//! Gravity and a uniform electric field: F_i = m_i g + q_i E, potential -F_i.r_i.

use crate::math::Sum;
use crate::scene;
use crate::state::{Columns, Particles};
use nalgebra::Vector3;

/// Constant forces from outside the cloud.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalField {
    /// Force on every particle, length n [N].
    force: Columns,
}

impl ExternalField {
    /// From a scene's section; `None` where it names nothing.
    #[must_use]
    pub fn new(external: Option<&scene::External>, particles: &Particles) -> Option<Self> {
        let external = external?;
        if external.gravity.is_none() && external.electric_field.is_none() {
            return None;
        }
        let gravity = Vector3::from(external.gravity.unwrap_or_default());
        let electric = Vector3::from(external.electric_field.unwrap_or_default());
        let mut force = Columns::zeros(particles.len());
        for i in 0..particles.len() {
            let charge = particles.charge.as_ref().map_or(0.0, |charge| charge[i]);
            force.set(i, particles.mass[i] * gravity + charge * electric);
        }
        Some(Self { force })
    }

    /// Adds the forces to `force`, length n [N].
    pub fn add_forces(&self, force: &mut Columns) {
        for (sum, term) in force.axes_mut().into_iter().zip(self.force.axes()) {
            for (sum, term) in sum.iter_mut().zip(term) {
                *sum += term;
            }
        }
    }

    /// Potential energy at positions r, length n [J].
    #[must_use]
    pub fn energy(&self, r: &Columns) -> f64 {
        (0..r.len()).map(|i| -self.force.get(i).dot(&r.get(i))).collect::<Sum>().value()
    }

    /// Force on particle i along an axis [N].
    #[must_use]
    pub fn component(&self, i: usize, axis: usize) -> f64 {
        self.force.axes()[axis][i]
    }

    /// Sum of all forces [N].
    #[must_use]
    pub fn total(&self) -> Vector3<f64> {
        let [x, y, z] = self.force.axes().map(|axis| axis.iter().copied().collect::<Sum>().value());
        Vector3::new(x, y, z)
    }
}
