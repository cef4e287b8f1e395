//! Positions and velocities of one particle at any time within a step.

use super::tableau::Tableau;
use nalgebra::Vector3;

/// A particle's way through a step of a collocation scheme, x = 0 its start and x = 1 its end: a polynomial in x. Its
/// error is of order dt^(s + 2) for s points within the step and of the scheme's order at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    dt: f64,
    /// Coefficients of x^0, x^1, .. of the position, s + 2 of them [m].
    coefficients: Vec<Vector3<f64>>,
}

impl Path {
    /// From position [m], velocity [m/s] and the accelerations at the points [m/s^2].
    pub(super) fn new(
        tableau: &Tableau,
        position: Vector3<f64>,
        velocity: Vector3<f64>,
        dt: f64,
        accelerations: impl Iterator<Item = [f64; 3]> + Clone,
    ) -> Self {
        let coefficient = |p: usize, row: &Vec<f64>| {
            let b: Vector3<f64> = row.iter().zip(accelerations.clone()).map(|(w, a)| Vector3::from(a) * *w).sum();
            b * (dt * dt / ((p + 1) * (p + 2)) as f64)
        };
        let higher = tableau.coefficients.iter().enumerate().map(|(p, row)| coefficient(p, row));
        Self { dt, coefficients: [position, velocity * dt].into_iter().chain(higher).collect() }
    }

    /// Position at x [m].
    #[must_use]
    pub fn position(&self, x: f64) -> Vector3<f64> {
        self.coefficients.iter().rev().fold(Vector3::zeros(), |sum, c| sum * x + c)
    }

    /// Bound on how far it gets from its start until x [m].
    #[must_use]
    pub fn reach(&self, x: f64) -> f64 {
        let sizes = self.coefficients.iter().skip(1).rev();
        sizes.fold(0.0, |sum, c| (sum + c.norm()) * x)
    }

    /// Velocity at x [m/s].
    #[must_use]
    pub fn velocity(&self, x: f64) -> Vector3<f64> {
        let terms = self.coefficients.iter().enumerate().skip(1).rev();
        terms.fold(Vector3::zeros(), |sum, (p, c)| sum * x + c * p as f64) / self.dt
    }

    /// Coefficients of x^0, x^1, .. of the position [m].
    #[must_use]
    pub fn coefficients(&self) -> &[Vector3<f64>] {
        &self.coefficients
    }
}
