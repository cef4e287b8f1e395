//! Weights of a collocation scheme for r'' = a(r): what the accelerations at its points do to positions and velocities.
//!
//! With L_k the Lagrange polynomials on the points c_j of [0, 1]:
//! A_jk = int_0^c_j (c_j - s) L_k(s) ds, so that r(c_j) = r + c_j dt v + dt^2 sum_k A_jk a_k, and the same with c_j = 1
//! for the end; w_k = int_0^1 L_k ds for the velocity. Everhart (1985), Rein & Spiegel (2015) for the Radau points.

use super::nodes::{Family, gauss_quadrature};
use crate::math::Sum;

/// Points and weights of a scheme; s is the number of points. All without unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Tableau {
    /// Points c_j, ascending, length s.
    pub nodes: Vec<f64>,
    /// A_jk, s rows of s weights: positions at the points.
    pub position: Vec<Vec<f64>>,
    /// Weights of the position at the end, length s.
    pub end_position: Vec<f64>,
    /// Weights of the velocity at the end, length s.
    pub end_velocity: Vec<f64>,
    /// Coefficients of the interpolating polynomial: b_p = sum_k coefficient[p][k] a_k is that of x^p, s rows of s.
    pub coefficients: Vec<Vec<f64>>,
    /// Weights of what the interpolating polynomial misses at the worst: the highest divided difference of the s + 1
    /// points of [`Tableau::known`], times the size of a monic polynomial between them.
    pub defect: Vec<f64>,
    /// Order of the scheme on smooth motion.
    pub order: u32,
}

impl Tableau {
    /// The scheme on a family's points.
    #[must_use]
    pub fn new(family: Family) -> Self {
        let nodes = family.nodes();
        let s = nodes.len();
        // Exact for (c - s) L_k(s), of degree s.
        let quadrature = gauss_quadrature(s / 2 + 1);
        let position_weights = |c: f64| -> Vec<f64> {
            let value = |k: usize, x: f64, w: f64| w * c * (c - c * x) * lagrange(&nodes, k, c * x);
            (0..s).map(|k| quadrature.iter().map(|&(x, w)| value(k, x, w)).sum()).collect()
        };
        let velocity_weight = |k: usize| quadrature.iter().map(|&(x, w)| w * lagrange(&nodes, k, x)).sum();
        Self {
            position: nodes.iter().map(|&c| position_weights(c)).collect(),
            end_position: scaled(position_weights(1.0), 0.5),
            end_velocity: scaled((0..s).map(velocity_weight).collect(), 1.0),
            coefficients: coefficients(&nodes),
            defect: defect(&known(&nodes)),
            order: family.order(),
            nodes,
        }
    }

    /// Number of points s.
    #[must_use]
    pub fn points(&self) -> usize {
        self.nodes.len()
    }

    /// Points at which a finished step knows accelerations: its own, and the end; length s + 1.
    #[must_use]
    pub fn known(&self) -> Vec<f64> {
        known(&self.nodes)
    }

    /// Whether the first point is the start of the step, whose acceleration is given.
    #[must_use]
    pub fn has_start(&self) -> bool {
        self.nodes[0] == 0.0
    }

    /// Weights that turn the accelerations at the known points of one step into those at from + scale c_j, in units of
    /// that step: s rows.
    #[must_use]
    pub fn prediction(&self, from: f64, scale: f64) -> Vec<Vec<f64>> {
        let known = self.known();
        let row = |c: &f64| (0..known.len()).map(|k| lagrange(&known, k, from + scale * c)).collect();
        self.nodes.iter().map(row).collect()
    }
}

/// Weights whose sum is exactly what a constant acceleration wants: their roundings, alike in every step, would add up.
fn scaled(mut weights: Vec<f64>, sum: f64) -> Vec<f64> {
    let factor = sum / weights.iter().copied().collect::<Sum>().value();
    weights.iter_mut().for_each(|weight| *weight *= factor);
    weights
}

fn known(nodes: &[f64]) -> Vec<f64> {
    nodes.iter().copied().chain([1.0]).collect()
}

/// Lagrange polynomial L_k on the nodes, at x.
fn lagrange(nodes: &[f64], k: usize, x: f64) -> f64 {
    nodes.iter().enumerate().filter(|&(l, _)| l != k).map(|(_, c)| (x - c) / (nodes[k] - c)).product()
}

/// Coefficients of x^p in L_k: row p, column k.
fn coefficients(nodes: &[f64]) -> Vec<Vec<f64>> {
    let s = nodes.len();
    let mut rows = vec![vec![0.0; s]; s];
    for k in 0..s {
        let mut polynomial = vec![0.0; s];
        polynomial[0] = 1.0;
        for (l, c) in nodes.iter().enumerate().filter(|&(l, _)| l != k) {
            for p in (0..s).rev() {
                let lower = if p > 0 { polynomial[p - 1] } else { 0.0 };
                polynomial[p] = (lower - c * polynomial[p]) / (nodes[k] - nodes[l]);
            }
        }
        for (row, coefficient) in rows.iter_mut().zip(polynomial) {
            row[k] = coefficient;
        }
    }
    rows
}

/// Weights of the highest divided difference on the points, times the size of their monic polynomial between them, which
/// is about that of the Chebyshev polynomial, 2^(1 - 2 m) for m points.
fn defect(points: &[f64]) -> Vec<f64> {
    let m = points.len();
    let size = libm::ldexp(2.0, -2 * (m as i32 - 1));
    let weight = |k: usize| {
        let differences = points.iter().enumerate().filter(|&(l, _)| l != k).map(|(_, c)| points[k] - c);
        size / differences.product::<f64>()
    };
    (0..m).map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::{Family, Tableau};

    /// The weights integrate a = x^p exactly: twice at every point up to degree s - 1, at the end up to the order.
    #[test]
    fn monomials_are_integrated_exactly() {
        for family in [Family::Radau(8), Family::Gauss(4), Family::Radau(5), Family::Gauss(1)] {
            let tableau = Tableau::new(family);
            let s = tableau.points() as i32;
            let apply = |weights: &[f64], p: i32| -> f64 {
                weights.iter().zip(&tableau.nodes).map(|(w, c)| w * c.powi(p)).sum()
            };
            // Sums of eight terms below 1, the weights themselves sums of products with some ten roundings each; those of
            // the end are scaled for a constant.
            let close = |a: f64, b: f64, within: f64| assert!((a - b).abs() <= within, "{family:?}: {a} for {b}");
            for p in 0..s {
                let x = f64::from(p);
                for (row, c) in tableau.position.iter().zip(&tableau.nodes) {
                    close(apply(row, p), c.powi(p + 2) / ((x + 1.0) * (x + 2.0)), 2e-15);
                }
            }
            for p in 0..tableau.order as i32 {
                let x = f64::from(p);
                close(apply(&tableau.end_velocity, p), 1.0 / (x + 1.0), if p == 0 { 3e-16 } else { 2e-15 });
                if p < tableau.order as i32 - 1 {
                    close(
                        apply(&tableau.end_position, p),
                        1.0 / ((x + 1.0) * (x + 2.0)),
                        if p == 0 { 3e-16 } else { 2e-15 },
                    );
                }
            }
            // And no further, or the order is understated.
            let beyond = tableau.order as i32;
            let missed = apply(&tableau.end_velocity, beyond) - 1.0 / (f64::from(beyond) + 1.0);
            assert!(missed.abs() > 1e-11, "{family:?}: {missed}");
        }
    }

    /// Polynomials of full degree are continued and taken apart.
    #[test]
    fn prediction_and_coefficients_reproduce_polynomials() {
        let tableau = Tableau::new(Family::Radau(8));
        let polynomial = |x: f64| 1.0 - 2.0 * x + 0.5 * x.powi(3) - 0.1 * x.powi(7);
        let values: Vec<f64> = tableau.known().iter().map(|&c| polynomial(c)).collect();
        for (row, c) in tableau.prediction(1.0, 0.7).iter().zip(&tableau.nodes) {
            let predicted: f64 = row.iter().zip(&values).map(|(w, a)| w * a).sum();
            // Extrapolation to 1.7 amplifies the rounding of values by some 1e4.
            assert!((predicted - polynomial(1.0 + 0.7 * c)).abs() <= 1e-10);
        }
        for (p, expected) in [1.0, -2.0, 0.0, 0.5, 0.0, 0.0, 0.0, -0.1].into_iter().enumerate() {
            let found: f64 = tableau.coefficients[p].iter().zip(&values).map(|(w, a)| w * a).sum();
            assert!((found - expected).abs() <= 1e-9, "x^{p}: {found} for {expected}");
        }
    }
}
