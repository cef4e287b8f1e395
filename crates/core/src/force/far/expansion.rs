//! Cartesian expansions of sums of radial functions f(|r_i - r_j|).
//!
//! Sources y = a + v about a centre a have moments M_k = sum w (-v)^k / k!; the potential at x = b + u about another centre
//! is sum L_n u^n / n! with L_n = sum_k M_k d_(n+k), d the derivatives of f at R = b - a. For powers of the distance the
//! derivatives follow from those of lower degree (Duan and Krasny, J. Comput. Chem. 22, 184, 2001), for any real exponent.
//! Multi-indices are sorted by degree, so that all of degree p - |n| or less come first.

use crate::force::near_field::Term;
use crate::lanes::ln;
use crate::simd::{Lanes, Simd};

/// Multi-indices up to a degree, and where their sums and differences are.
#[derive(Clone, Debug, Default)]
pub(super) struct Degrees {
    /// Highest degree p.
    pub(super) order: usize,
    /// How many there are of degree m or less.
    up_to: Vec<usize>,
    /// Degree of each.
    degree: Vec<usize>,
    /// Of each but the first: an axis that is in it, the number without one of that axis, and 1 over its power.
    step: Vec<(usize, usize, f64)>,
    /// Numbers of k - e and of k - 2e for the three axes e; `NONE` where there is none.
    lower: Vec<[[u16; 3]; 2]>,
    /// k!.
    factorial: Vec<f64>,
    /// Numbers of n + k for all k that fit, n after n.
    sums: Vec<u16>,
    /// Where those of n begin.
    sums_of: Vec<usize>,
}

const NONE: u16 = u16::MAX;

impl Degrees {
    /// All up to a degree.
    pub(super) fn new(order: usize) -> Self {
        let mut indices: Vec<[usize; 3]> = Vec::new();
        let mut up_to = Vec::new();
        for degree in 0..=order {
            for x in (0..=degree).rev() {
                for y in (0..=degree - x).rev() {
                    indices.push([x, y, degree - x - y]);
                }
            }
            up_to.push(indices.len());
        }
        let side = order + 1;
        let mut number = vec![NONE; side * side * side];
        for (k, [x, y, z]) in indices.iter().enumerate() {
            number[(x * side + y) * side + z] = k as u16;
        }
        let find = |[x, y, z]: [usize; 3]| number[(x * side + y) * side + z];
        let less = |mut k: [usize; 3], axis: usize, by: usize| {
            if k[axis] < by {
                return NONE;
            }
            k[axis] -= by;
            find(k)
        };
        let mut degrees = Self { order, up_to, ..Self::default() };
        for &k in &indices {
            let axis = k.iter().position(|&power| power > 0).unwrap_or(0);
            degrees.degree.push(k.iter().sum());
            degrees.step.push((axis, usize::from(less(k, axis, 1)), 1.0 / k[axis] as f64));
            degrees.lower.push([1, 2].map(|by| [0, 1, 2].map(|axis| less(k, axis, by))));
            degrees.factorial.push(k.iter().map(|&power| (1..=power).map(|f| f as f64).product::<f64>()).product());
        }
        for (n, degree) in indices.iter().zip(&degrees.degree) {
            degrees.sums_of.push(degrees.sums.len());
            for k in &indices[..degrees.up_to[order - degree]] {
                degrees.sums.push(find([n[0] + k[0], n[1] + k[1], n[2] + k[2]]));
            }
        }
        degrees
    }

    /// How many there are.
    pub(super) fn count(&self) -> usize {
        self.degree.len()
    }

    /// Time that a meeting of two cells takes, in pairs of particles that take as long in 32 bits (measured, AVX-512).
    pub(super) fn cost(&self) -> f64 {
        0.09 * self.sums.len() as f64 + 0.7 * self.count() as f64
    }

    /// Numbers of n + k for all k that fit.
    #[inline(always)]
    fn sums(&self, n: usize) -> &[u16] {
        &self.sums[self.sums_of[n]..self.sums_of[n] + self.up_to[self.order - self.degree[n]]]
    }

    /// u^k / k! of all k.
    #[inline(always)]
    pub(super) fn powers<S: Simd>(&self, simd: S, u: [S::F; 3], powers: &mut [S::F]) {
        powers[0] = simd.splat(1.0);
        for k in 1..powers.len().min(self.step.len()) {
            let (axis, lower, share) = self.step[k];
            powers[k] = powers[lower] * (u[axis] * simd.splat(share));
        }
    }

    /// The same of one vector.
    pub(super) fn powers_of(&self, u: [f64; 3], powers: &mut [f64]) {
        powers[0] = 1.0;
        for (k, &(axis, lower, share)) in self.step.iter().enumerate().skip(1) {
            powers[k] = powers[lower] * (u[axis] * share);
        }
    }

    /// Adds moments about one centre to those about another, `powers` those of the other less the one.
    pub(super) fn shift_moments(&self, moments: &[f64], powers: &[f64], to: &mut [f64]) {
        for (n, moment) in moments.iter().enumerate() {
            for (power, &sum) in powers.iter().zip(self.sums(n)) {
                to[usize::from(sum)] += moment * power;
            }
        }
    }

    /// A local expansion about another centre, `powers` those of the new less the old.
    pub(super) fn shift_local(&self, local: &[f64], powers: &[f64], to: &mut [f64]) {
        for (n, to) in to.iter_mut().enumerate() {
            let terms = powers.iter().zip(self.sums(n));
            *to += terms.map(|(power, &sum)| power * local[usize::from(sum)]).sum::<f64>();
        }
    }

    /// Derivatives at R of the potentials of some terms, shifts left out; `work` as long as they.
    #[inline(always)]
    pub(super) fn derivatives<S: Simd>(
        &self,
        simd: S,
        terms: &[Term],
        r: [S::F; 3],
        work: &mut [S::F],
        derivatives: &mut [S::F],
    ) {
        let count = self.count().min(work.len()).min(derivatives.len());
        let (work, derivatives) = (&mut work[..count], &mut derivatives[..count]);
        let square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        let inverse_square = simd.splat(1.0) / square;
        let inverse = inverse_square.sqrt();
        let along = [r[0] * inverse_square, r[1] * inverse_square, r[2] * inverse_square];
        for (t, term) in terms.iter().enumerate() {
            self.taylor(simd, term, square, inverse, inverse_square, along, work);
            for k in 0..count {
                let own = work[k] * simd.splat(self.factorial[k]);
                derivatives[k] = if t == 0 { own } else { derivatives[k] + own };
            }
        }
    }

    /// Taylor coefficients of a term's potential.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "what terms have in common is computed once")]
    fn taylor<S: Simd>(
        &self,
        simd: S,
        term: &Term,
        square: S::F,
        inverse: S::F,
        inverse_square: S::F,
        along: [S::F; 3],
        b: &mut [S::F],
    ) {
        let (power, strength) = (&term.power, simd.splat(term.strength));
        let logarithm = if power.potential_needs_logarithm() { ln(simd, square) } else { inverse };
        let of_power = power.lanes(simd, logarithm, inverse);
        b[0] = strength * power.potential_lanes(simd, square, logarithm, inverse, of_power);
        // The slope times s; what the recurrence starts from is the same for logarithms.
        let start = strength * (square * inverse * of_power);
        let nu = term.power.exponent - 1.0;
        for k in 1..b.len() {
            let degree = self.degree[k] as f64;
            let [one, two] = self.lower[k];
            let mut sum = simd.splat(0.0);
            if self.degree[k] == 1 {
                for axis in 0..3 {
                    if one[axis] != NONE {
                        sum = start * along[axis];
                    }
                }
                b[k] = sum;
                continue;
            }
            for axis in 0..3 {
                if one[axis] != NONE {
                    sum = sum + along[axis] * b[usize::from(one[axis])];
                }
            }
            let mut second = simd.splat(0.0);
            for axis in 0..3 {
                if two[axis] != NONE {
                    second = second + if self.degree[k] == 2 { start } else { b[usize::from(two[axis])] };
                }
            }
            let share = if self.degree[k] == 2 { 0.5 } else { -(degree - 2.0 + nu) / degree };
            b[k] =
                simd.splat(-(2.0 * degree - 2.0 + nu) / degree) * sum + simd.splat(share) * (inverse_square * second);
        }
    }

    /// Adds what moments with these derivatives make of a local expansion.
    #[inline(always)]
    pub(super) fn add_local<S: Simd>(&self, simd: S, moments: &[S::F], derivatives: &[S::F], local: &mut [S::F]) {
        for n in 0..local.len() {
            let sums = self.sums(n);
            let moments = &moments[..sums.len()];
            // Two sums, because one alone would wait for itself.
            let (mut even, mut odd) = (local[n], simd.splat(0.0));
            let mut k = 0;
            while k + 2 <= sums.len() {
                even = even + moments[k] * derivatives[usize::from(sums[k])];
                odd = odd + moments[k + 1] * derivatives[usize::from(sums[k + 1])];
                k += 2;
            }
            if k < sums.len() {
                even = even + moments[k] * derivatives[usize::from(sums[k])];
            }
            local[n] = even + odd;
        }
    }

    /// Potential of a local expansion.
    #[inline(always)]
    pub(super) fn potential<S: Simd>(&self, simd: S, local: &[f64], powers: &[S::F]) -> S::F {
        let mut sum = simd.splat(0.0);
        for n in 0..local.len().min(powers.len()) {
            sum = sum + simd.splat(local[n]) * powers[n];
        }
        sum
    }

    /// Gradient of a local expansion.
    #[inline(always)]
    pub(super) fn gradient<S: Simd>(&self, simd: S, local: &[f64], powers: &[S::F]) -> [S::F; 3] {
        let zero = simd.splat(0.0);
        let mut gradient = [zero; 3];
        for k in 1..local.len() {
            for axis in 0..3 {
                let lower = self.lower[k][0][axis];
                if lower != NONE {
                    gradient[axis] = gradient[axis] + simd.splat(local[k]) * powers[usize::from(lower)];
                }
            }
        }
        gradient
    }
}
