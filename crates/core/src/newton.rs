//! Newton's method for the fixed point x = G(x) of a step, matrix-free: GMRES with directional differences of G.
//!
//! (I - G'(x)) d = G(x) - x is solved in the space that G'(x) spans from the right-hand side (Knoll & Keyes 2004, Saad &
//! Schultz 1986); G'(x) u is (G(x + e u) - G(x))/e, one evaluation of all forces. What the paper's Remark 3 says of Newton's
//! method holds for it: where G jumps, as forces at a cut-off do, the difference is no derivative.

use crate::assembly::Model;
use crate::stagger::{Stagger, Start};
use crate::state::Columns;

/// Largest dimension of the space searched in one iteration. A step's map contracts in all but the stiffest directions,
/// of which there are few; where that many do not do, a shorter step will.
const DIMENSION: usize = 40;
/// The linear system is solved to this share of the residual, times how far the residual has fallen: with that the
/// convergence is quadratic until directional differences end it (Eisenstat & Walker 1996).
const FORCING: f64 = 0.05;

/// Displacement for directional differences, over the mean diameter [-]: between the round-off of forces and their curvature.
pub const SMALL: f64 = 1e-7;

impl Stagger {
    /// Replaces the last iterate r^K = G(r^(K-1)) by Newton's.
    pub(crate) fn correct(&mut self, model: &mut Model, start: &Start<'_>, dt: f64) {
        if !model.has_forces() {
            return;
        }
        let n = self.position.len();
        let weight = dt * dt * model.integrator.position_new;
        let before = self.previous_position.clone();
        let forces = flat(&self.field_force);
        let mut d: Vec<f64> = flat(&self.position).iter().zip(flat(&before)).map(|(g, x)| g - x).collect();
        let errors = &self.sweeps.position;
        let fallen = errors[errors.len() - 1] / errors[0];
        let small = SMALL * model.mean_diameter;
        let mut map = |u: &[f64], out: &mut [f64]| {
            let e = small / u.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for (axis, column) in self.previous_position.axes_mut().into_iter().enumerate() {
                for i in 0..n {
                    column[i] = before.axes()[axis][i] + e * u[axis * n + i];
                }
            }
            self.pairs_evaluated += model.forces(&self.previous_position, &mut self.field_force);
            self.evaluations += 1;
            for (axis, column) in self.field_force.axes().into_iter().enumerate() {
                for i in 0..n {
                    out[axis * n + i] = weight * (column[i] - forces[axis * n + i]) / (e * start.particles.mass[i]);
                }
            }
        };
        correct(&mut map, &mut d, fallen);
        for (axis, column) in self.position.axes_mut().into_iter().enumerate() {
            for i in 0..n {
                column[i] = before.axes()[axis][i] + d[axis * n + i];
            }
        }
    }
}

fn flat(columns: &Columns) -> Vec<f64> {
    columns.axes().concat()
}

/// The correction of one iteration. `map(u, out)` must set out to G'(x) u, `residual` is G(x) - x, which is turned into
/// d; `fallen` is the residual over the first one. Gives the number of evaluations.
pub fn correct(map: &mut dyn FnMut(&[f64], &mut [f64]), residual: &mut [f64], fallen: f64) -> usize {
    let size = norm(residual);
    if size == 0.0 || !size.is_finite() {
        return 0;
    }
    let mut basis = vec![residual.iter().map(|x| x / size).collect::<Vec<f64>>()];
    // Columns of the Hessenberg matrix, turned upper triangular by Givens rotations as they come.
    let (mut columns, mut rotations, mut right) = (Vec::<Vec<f64>>::new(), Vec::new(), vec![size]);
    let enough = FORCING * fallen.min(1.0) * size;
    while columns.len() < DIMENSION.min(residual.len()) && right[columns.len()].abs() > enough {
        let k = columns.len();
        let mut next = vec![0.0; residual.len()];
        map(&basis[k], &mut next);
        for (next, u) in next.iter_mut().zip(&basis[k]) {
            *next = u - *next;
        }
        let mut column = orthogonalize(&mut next, &basis);
        let length = norm(&next);
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b): (f64, f64) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let hypotenuse = (column[k] * column[k] + length * length).sqrt();
        if hypotenuse == 0.0 || !hypotenuse.is_finite() {
            break;
        }
        let (c, s) = (column[k] / hypotenuse, length / hypotenuse);
        column[k] = hypotenuse;
        rotations.push((c, s));
        right.push(-s * right[k]);
        right[k] *= c;
        column.push(0.0);
        columns.push(column);
        if length > 0.0 {
            next.iter_mut().for_each(|x| *x /= length);
        }
        basis.push(next);
    }
    combine(&columns, &right, &basis, residual);
    columns.len()
}

/// Takes the basis out of a vector, and gives its components, with room for what is left (modified Gram-Schmidt).
fn orthogonalize(vector: &mut [f64], basis: &[Vec<f64>]) -> Vec<f64> {
    let component = |u: &Vec<f64>| {
        let component = dot(vector, u);
        vector.iter_mut().zip(u).for_each(|(x, u)| *x -= component * u);
        component
    };
    basis.iter().map(component).collect()
}

/// Solves the triangular system and adds the basis up.
fn combine(columns: &[Vec<f64>], right: &[f64], basis: &[Vec<f64>], out: &mut [f64]) {
    let m = columns.len();
    let mut weights = vec![0.0; m];
    for k in (0..m).rev() {
        let known: f64 = (k + 1..m).map(|l| columns[l][k] * weights[l]).sum();
        weights[k] = (right[k] - known) / columns[k][k];
    }
    out.fill(0.0);
    for (weight, u) in weights.iter().zip(basis) {
        out.iter_mut().zip(u).for_each(|(x, u)| *x += weight * u);
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::correct;

    /// A linear map's fixed point is found in one correction, contracting or not.
    #[test]
    fn a_linear_system_is_solved() {
        let n = 12;
        let entry = |i: usize, j: usize| if i == j { -3.0 - i as f64 } else { 0.3 / (1.0 + i as f64 + 2.0 * j as f64) };
        let apply = |u: &[f64], out: &mut [f64]| {
            for (i, out) in out.iter_mut().enumerate() {
                *out = (0..n).map(|j| entry(i, j) * u[j]).sum();
            }
        };
        let solution: Vec<f64> = (0..n).map(|i| 1.0 - 0.2 * i as f64).collect();
        let mut image = vec![0.0; n];
        apply(&solution, &mut image);
        let mut d: Vec<f64> = solution.iter().zip(&image).map(|(x, g)| x - g).collect();
        // Solved until the residual is 5 % of 1e-12 of what it was.
        let evaluations = correct(&mut |u, out| apply(u, out), &mut d, 1e-12);
        assert!(evaluations <= n, "{evaluations}");
        for (d, x) in d.iter().zip(&solution) {
            assert!((d - x).abs() <= 1e-11, "{d} for {x}");
        }
    }
}
