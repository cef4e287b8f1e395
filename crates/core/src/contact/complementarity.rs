//! Linear complementarity, 0 <= x ⊥ W x - q >= 0, for the symmetric, positive semidefinite W of contacts.
//!
//! W = G M^-1 G^T couples contacts through the particles they share [1/kg]; x are impulses or forces, q the approach that
//! they have to undo. Solved by block principal pivoting (Júdice and Pires 1994): a guess at the contacts that push, a
//! Cholesky factorisation for these, exchange of all that have the wrong sign, one at a time where that does not help. Where
//! redundant contacts leave x open, proximal terms choose nearly the least norm, and repeating them removes their error.
//! Contacts may also be `free`: W x = q there, whatever the sign of x.

/// Proximal term over the largest diagonal element of W [-]; trades the conditioning of redundant contacts against the
/// number of repetitions.
const PROXIMAL: f64 = 1e-10;
/// Repetitions: each takes the error by the proximal term down by that term over W's smallest eigenvalue.
const REPETITIONS: usize = 3;
/// Exchanges of all wrong contacts at once that may fail to reduce their number before one is exchanged at a time.
const PATIENCE: usize = 3;
/// Signs within round-off count as right [-].
const ROUND_OFF: f64 = 1e-13;

/// A problem with its solution. Buffers are kept from one problem to the next.
#[derive(Clone, Debug, Default)]
pub struct Complementarity {
    size: usize,
    /// W, row by row, size x size.
    matrix: Vec<f64>,
    /// q, length `size`.
    pub demand: Vec<f64>,
    /// Whether x may have any sign, length `size`.
    pub free: Vec<bool>,
    /// x, length `size`.
    pub solution: Vec<f64>,
    pushes: Vec<bool>,
    factor: Vec<f64>,
    members: Vec<usize>,
    centre: Vec<f64>,
}

impl Complementarity {
    /// A problem of a size, with W, q and x zero and no contact free.
    pub fn start(&mut self, size: usize) {
        self.size = size;
        self.matrix.clear();
        self.matrix.resize(size * size, 0.0);
        for column in [&mut self.demand, &mut self.solution, &mut self.centre] {
            column.clear();
            column.resize(size, 0.0);
        }
        self.free.clear();
        self.free.resize(size, false);
    }

    /// Sets an element of W and its mirror image.
    pub fn couple(&mut self, k: usize, l: usize, value: f64) {
        self.matrix[k * self.size + l] = value;
        self.matrix[l * self.size + k] = value;
    }

    /// (W x)_k.
    #[must_use]
    pub fn response(&self, k: usize) -> f64 {
        let row = &self.matrix[k * self.size..(k + 1) * self.size];
        row.iter().zip(&self.solution).map(|(w, x)| w * x).sum()
    }

    /// Finds x. Returns whether all signs came out right; where not, x is still feasible (never negative unless free).
    pub fn solve(&mut self) -> bool {
        if self.size == 1 {
            let x = self.demand[0] / self.matrix[0];
            self.solution[0] = if self.free[0] { x } else { x.max(0.0) };
            return true;
        }
        let largest = (0..self.size).map(|k| self.matrix[k * self.size + k]).fold(0.0, f64::max);
        let proximal = PROXIMAL * largest;
        self.pushes.clear();
        self.pushes.extend((0..self.size).map(|k| self.free[k] || self.demand[k] > 0.0));
        let mut right = true;
        for _ in 0..REPETITIONS {
            self.centre.copy_from_slice(&self.solution);
            right = self.pivot(proximal);
        }
        for (x, free) in self.solution.iter_mut().zip(&self.free) {
            if !free {
                *x = x.max(0.0);
            }
        }
        right
    }

    /// Block principal pivoting on W + proximal I, with q + proximal times the last x.
    fn pivot(&mut self, proximal: f64) -> bool {
        let scale = self.demand.iter().fold(0.0_f64, |most, q| most.max(q.abs()));
        let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
        // Each exchange of one contact visits another of finitely many sets.
        for _ in 0..20 + 4 * self.size {
            self.solve_members(proximal);
            let forces = self.solution.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            let wrong: Vec<usize> = (0..self.size)
                .filter(|&k| {
                    !self.free[k]
                        && if self.pushes[k] {
                            self.solution[k] < -ROUND_OFF * forces
                        } else {
                            self.response(k) - self.demand[k] - proximal * self.centre[k] < -ROUND_OFF * scale
                        }
                })
                .collect();
            let Some(&last) = wrong.last() else { return true };
            if wrong.len() < fewest {
                (fewest, patience) = (wrong.len(), PATIENCE);
            } else if patience > 0 {
                patience -= 1;
            } else {
                self.pushes[last] = !self.pushes[last];
                continue;
            }
            for k in wrong {
                self.pushes[k] = !self.pushes[k];
            }
        }
        false
    }

    /// (W + proximal I) x = q + proximal x_0 for the contacts that push, x = 0 for the others; by Cholesky's method.
    fn solve_members(&mut self, proximal: f64) {
        self.members.clear();
        self.members.extend((0..self.size).filter(|&k| self.pushes[k]));
        let m = self.members.len();
        self.factor.clear();
        self.factor.resize(m * (m + 1), 0.0);
        let (factor, rhs) = self.factor.split_at_mut(m * m);
        for (a, &k) in self.members.iter().enumerate() {
            rhs[a] = self.demand[k] + proximal * self.centre[k];
            for b in 0..=a {
                let mut sum = self.matrix[k * self.size + self.members[b]] + if a == b { proximal } else { 0.0 };
                let (row_a, row_b) = (a * m, b * m);
                for c in 0..b {
                    sum -= factor[row_a + c] * factor[row_b + c];
                }
                factor[row_a + b] = if a == b { sum.max(f64::MIN_POSITIVE).sqrt() } else { sum / factor[row_b + b] };
            }
        }
        for a in 0..m {
            let known: f64 = (0..a).map(|c| factor[a * m + c] * rhs[c]).sum();
            rhs[a] = (rhs[a] - known) / factor[a * m + a];
        }
        for a in (0..m).rev() {
            let known: f64 = (a + 1..m).map(|c| factor[c * m + a] * rhs[c]).sum();
            rhs[a] = (rhs[a] - known) / factor[a * m + a];
        }
        self.solution.fill(0.0);
        for (a, &k) in self.members.iter().enumerate() {
            self.solution[k] = rhs[a];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Complementarity;
    use rand::{Rng, SeedableRng};

    /// W = A A^T of contacts between few bodies: semidefinite where there are more contacts than motions.
    fn random(size: usize, motions: usize, rng: &mut rand_chacha::ChaCha8Rng) -> Complementarity {
        let mut uniform = || 2.0 * ((rng.next_u64() >> 11) as f64 / (1_u64 << 53) as f64) - 1.0;
        let a: Vec<Vec<f64>> = (0..size).map(|_| (0..motions).map(|_| uniform()).collect()).collect();
        let velocity: Vec<f64> = (0..motions).map(|_| uniform()).collect();
        let mut problem = Complementarity::default();
        problem.start(size);
        for k in 0..size {
            for l in 0..=k {
                problem.couple(k, l, a[k].iter().zip(&a[l]).map(|(x, y)| x * y).sum());
            }
            // Approach speeds of one motion: the problem has a solution.
            problem.demand[k] = a[k].iter().zip(&velocity).map(|(x, y)| x * y).sum();
        }
        problem
    }

    #[test]
    fn solutions_are_feasible_and_complementary() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for size in 1..40 {
            for motions in [1, 3, size, 2 * size] {
                let mut problem = random(size, motions, &mut rng);
                assert!(problem.solve(), "{size} contacts, {motions} motions");
                let scale = problem.solution.iter().fold(1.0_f64, |most, x| most.max(*x));
                for k in 0..size {
                    let rest = problem.response(k) - problem.demand[k];
                    // Sums of up to 80 products of numbers up to the largest impulse.
                    assert!(rest >= -1e-11 * scale, "{size}, {motions}: separates at {rest}");
                    assert!((problem.solution[k] * rest).abs() <= 1e-11 * scale * scale, "{size}, {motions}");
                    assert!(problem.solution[k] >= 0.0);
                }
            }
        }
    }

    /// Three identical contacts share their load evenly: the least norm.
    #[test]
    fn redundant_contacts_share_evenly() {
        let mut problem = Complementarity::default();
        problem.start(3);
        for k in 0..3 {
            for l in 0..=k {
                problem.couple(k, l, 2.0);
            }
            problem.demand[k] = 3.0;
        }
        assert!(problem.solve());
        for x in &problem.solution {
            assert!((x - 0.5).abs() <= 1e-9, "{x}");
        }
        assert!((problem.response(0) - 3.0).abs() <= 1e-14);
    }

    #[test]
    fn free_contacts_may_pull() {
        let mut problem = Complementarity::default();
        problem.start(2);
        problem.couple(0, 0, 2.0);
        problem.couple(1, 1, 2.0);
        problem.couple(1, 0, -1.0);
        problem.demand.copy_from_slice(&[-1.0, -1.0]);
        problem.free[0] = true;
        assert!(problem.solve());
        assert!((problem.solution[0] + 0.5).abs() <= 1e-14 && problem.solution[1] == 0.0, "{:?}", problem.solution);
    }
}
