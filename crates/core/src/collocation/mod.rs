//! Collocation: one step of r'' = a(r) by its accelerations at several points in time, solved by the staggered iteration.
//!
//! r^K(c_j) = r + c_j dt v + dt^2 sum_k A_jk a(r^(K-1)(c_k)), equation (50) at several points of a step instead of one. The
//! points are visited in order, and each uses the accelerations found before it in the same sweep. Then
//! r' = r + dt v + dt^2 sum_k w_k a_k, and v' likewise. With eight Gauss-Radau points the order is 15 (Everhart 1985; Rein
//! & Spiegel 2015), with four Gauss points it is 8, and the scheme is symmetric and symplectic (Hairer, Lubich & Wanner 2006). The accelerations of a step are a polynomial in time: it predicts the next step's, gives the
//! local error, and positions at any time within the step ([`Path`]).

mod dense;
mod nodes;
mod rows;
mod tableau;
#[cfg(test)]
mod tests;

pub use dense::Path;
pub use nodes::Family;
pub use tableau::Tableau;

use crate::assembly::Model;
use crate::convergence::{Convergence, Verdict};
use crate::newton::{self, SMALL};
use crate::scene::SolutionMethod;
use crate::stagger::Start;
use crate::state::Columns;
use crate::step_control::Worst;
use nalgebra::Vector3;
use rows::Rows;

/// Rows before those of the accelerations: velocities, and what positions are rounded by.
const BEFORE: usize = 2;
/// Steps that grow by more than this are predicted as if the acceleration stayed: extrapolation would be noise.
const FARTHEST: f64 = 2.5;
/// Round-off of the largest coordinate, below which an iteration stands still [-].
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;

/// A step of a collocation scheme, and what the next one is predicted from.
#[derive(Clone, Debug)]
pub struct Collocation {
    tableau: Tableau,
    /// v, position rest, accelerations at the points, and at the end.
    rows: Rows,
    /// The same of the last step, or of the last attempt at this one.
    last: Rows,
    /// Length of the step in `last` [s]; 0: there is none.
    last_dt: f64,
    /// Where this step starts in `last`: 1 its end, 0 its start.
    last_from: f64,
    /// Length of the attempt in `rows` [s]; 0: there is none that converged.
    attempt_dt: f64,
    /// What positions are rounded by [m], and would be after the attempt.
    position_rest: (Columns, Columns),
    /// What velocities are rounded by [m/s].
    velocity_rest: Columns,
    displacement: Vec<f64>,
    point: Columns,
    weights: Vec<f64>,
    /// Largest sum over k of |A_jk| [-].
    reach: f64,
}

/// All that a collocation scheme carries from step to step, beside the state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Carried {
    /// Length of the last step [s]; 0 where there is none to predict from.
    pub dt: f64,
    /// Accelerations at the points of the last step, and at its end [m/s^2].
    pub accelerations: Vec<Columns>,
    /// What the positions are rounded by [m].
    pub position_rest: Columns,
    /// What the velocities are rounded by [m/s].
    pub velocity_rest: Columns,
}

impl Collocation {
    /// The scheme on a family's points, for n particles.
    #[must_use]
    pub fn new(family: Family, n: usize) -> Self {
        let tableau = Tableau::new(family);
        let rows = BEFORE + tableau.known().len();
        let absolute = |row: &Vec<f64>| row.iter().map(|w| w.abs()).sum();
        Self {
            reach: tableau.position.iter().map(absolute).fold(0.0, f64::max),
            rows: Rows::zeros(rows, n),
            last: Rows::zeros(rows, n),
            last_dt: 0.0,
            last_from: 1.0,
            attempt_dt: 0.0,
            position_rest: (Columns::zeros(n), Columns::zeros(n)),
            velocity_rest: Columns::zeros(n),
            displacement: Rows::zeros(1, n).row(0).to_vec(),
            point: Columns::zeros(n),
            weights: Vec::with_capacity(rows),
            tableau,
        }
    }

    /// Solves a step of `dt` from `start`: positions at its end go to `position` [m], forces there to `force` [N].
    /// Another call before [`Collocation::commit`] solves the same step again with another length, quickly where the
    /// first converged. Gives the verdict, and the force evaluations and unordered pairs that it took.
    pub fn solve(
        &mut self,
        model: &mut Model,
        start: &Start<'_>,
        dt: f64,
        sweeps: &mut Convergence,
        (position, force): (&mut Columns, &mut Columns),
    ) -> (Verdict, u64, u64) {
        sweeps.restart();
        self.predict(start, dt);
        let mut spent = (0, 0);
        let newton = model.method == SolutionMethod::Newton;
        let scale = dt * dt * self.reach / model.mean_diameter;
        let round_off = ROUND_OFF * largest(&start.state.position) / model.mean_diameter;
        let temperatures = start.state.temperature.is_some();
        let verdict = loop {
            let before = if newton { self.unknowns().to_vec() } else { Vec::new() };
            let change = self.sweep(model, start, dt, force, &mut spent);
            match sweeps.note_change(scale * change.0.sqrt(), round_off, change.1, temperatures) {
                Verdict::Continue if newton => {
                    let fallen = sweeps.position[sweeps.iterations() - 1] / sweeps.position[0];
                    self.correct(&before, model, start, dt, force, fallen, &mut spent);
                }
                Verdict::Continue => {}
                verdict => break verdict,
            }
        };
        self.place(start, dt, None);
        position.copy_from(&self.point);
        if verdict == Verdict::Converged {
            self.attempt_dt = dt;
            spent = (spent.0 + 1, spent.1 + model.forces(position, force));
            self.accelerate(self.tableau.points(), force, &start.particles.mass, &mut (0.0, 0));
        }
        (verdict, spent.0, spent.1)
    }

    /// One sweep over the points: forces there from the accelerations so far. Gives the largest squared change of an
    /// acceleration, and whose it is; adds evaluations and pairs to `spent`.
    fn sweep(
        &mut self,
        model: &mut Model,
        start: &Start<'_>,
        dt: f64,
        force: &mut Columns,
        spent: &mut (u64, u64),
    ) -> (f64, u32) {
        let mut change = (0.0, 0);
        for j in self.first()..self.tableau.points() {
            self.place(start, dt, Some(j));
            *spent = (spent.0 + 1, spent.1 + model.forces(&self.point, force));
            self.accelerate(j, force, &start.particles.mass, &mut change);
        }
        change
    }

    /// Newton's correction of the accelerations at the points, from `before` the last sweep.
    #[allow(clippy::too_many_arguments)] // the state of one solution, used here only
    fn correct(
        &mut self,
        before: &[f64],
        model: &mut Model,
        start: &Start<'_>,
        dt: f64,
        force: &mut Columns,
        fallen: f64,
        spent: &mut (u64, u64),
    ) {
        let after = self.unknowns().to_vec();
        let mut d: Vec<f64> = after.iter().zip(before).map(|(after, before)| after - before).collect();
        // Displacements of a 10^-7th of a diameter: between the round-off of forces and their curvature.
        let small = SMALL * model.mean_diameter / (dt * dt * self.reach);
        let mut map = |u: &[f64], out: &mut [f64]| {
            let e = small / u.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
            for ((x, before), u) in self.unknowns_mut().iter_mut().zip(before).zip(u) {
                *x = before + e * u;
            }
            self.sweep(model, start, dt, force, spent);
            for ((out, x), after) in out.iter_mut().zip(self.unknowns()).zip(&after) {
                *out = (x - after) / e;
            }
        };
        newton::correct(&mut map, &mut d, fallen);
        for ((x, before), d) in self.unknowns_mut().iter_mut().zip(before).zip(&d) {
            *x = before + d;
        }
    }

    /// The first point whose acceleration is not given.
    fn first(&self) -> usize {
        usize::from(self.tableau.has_start())
    }

    /// Accelerations at the points that a step is solved for.
    fn unknowns(&self) -> &[f64] {
        self.rows.rows(BEFORE + self.first(), BEFORE + self.tableau.points())
    }

    fn unknowns_mut(&mut self) -> &mut [f64] {
        self.rows.rows_mut(BEFORE + usize::from(self.tableau.has_start()), BEFORE + self.tableau.points())
    }

    /// Accelerations at the points, from the polynomial of the last step or attempt.
    fn predict(&mut self, start: &Start<'_>, dt: f64) {
        if self.attempt_dt > 0.0 {
            std::mem::swap(&mut self.rows, &mut self.last);
            (self.last_dt, self.last_from, self.attempt_dt) = (self.attempt_dt, 0.0, 0.0);
        }
        let (s, known) = (self.tableau.points(), self.last.len() - BEFORE);
        self.rows.set(0, &start.state.velocity);
        self.rows.set(1, &self.position_rest.0);
        let first = self.first();
        let scale = dt / self.last_dt;
        if self.last_dt > 0.0 && scale + self.last_from <= FARTHEST {
            let weights = self.tableau.prediction(self.last_from, scale);
            for j in first..s {
                self.last.combine(BEFORE, &weights[j][..known], self.rows.row_mut(BEFORE + j));
            }
        } else {
            for j in first..s {
                self.rows.set(BEFORE + j, start.acceleration);
            }
        }
        if first == 1 {
            self.rows.set(BEFORE, start.acceleration);
        }
    }

    /// Sets `point` to the positions at point j, or at the end.
    fn place(&mut self, start: &Start<'_>, dt: f64, point: Option<usize>) {
        let (c, weights) = match point {
            Some(j) => (self.tableau.nodes[j], &self.tableau.position[j]),
            None => (1.0, &self.tableau.end_position),
        };
        self.weights.clear();
        self.weights.extend([c * dt, 1.0]);
        self.weights.extend(weights.iter().map(|w| dt * dt * w));
        self.rows.combine(0, &self.weights, &mut self.displacement);
        let n = self.point.len();
        let r = start.state.position.axes();
        for (axis, next) in self.point.axes_mut().into_iter().enumerate() {
            let moved = &self.displacement[axis * n..(axis + 1) * n];
            for ((next, r), moved) in next.iter_mut().zip(r[axis]).zip(moved) {
                *next = r + moved;
            }
        }
        if point.is_none() {
            let rest = self.position_rest.1.axes_mut().into_iter().zip(self.point.axes());
            for (axis, (rest, next)) in rest.enumerate() {
                let moved = &self.displacement[axis * n..(axis + 1) * n];
                for i in 0..n {
                    rest[i] = moved[i] - (next[i] - r[axis][i]);
                }
            }
        }
    }

    /// Takes forces as accelerations at point j; notes the largest squared change, and whose it is.
    fn accelerate(&mut self, j: usize, force: &Columns, mass: &[f64], change: &mut (f64, u32)) {
        let [x, y, z] = self.rows.axes_mut(BEFORE + j);
        for (i, mass) in mass.iter().enumerate() {
            let next = [force.x[i] / mass, force.y[i] / mass, force.z[i] / mass];
            let moved = [next[0] - x[i], next[1] - y[i], next[2] - z[i]];
            let square = moved[0] * moved[0] + moved[1] * moved[1] + moved[2] * moved[2];
            // A NaN is kept.
            if square > change.0 || square.is_nan() {
                *change = (square, i as u32);
            }
            [x[i], y[i], z[i]] = next;
        }
    }

    /// Where all particles were during the attempt that is not committed yet.
    #[must_use]
    pub fn paths(&self, start: &Start<'_>, dt: f64) -> Vec<Path> {
        (0..self.point.len()).map(|i| self.path(start, dt, i)).collect()
    }

    /// Forgets the last step, of whose polynomial nothing goes on: a force has just jumped.
    pub fn break_off(&mut self) {
        self.last_dt = 0.0;
    }

    /// Accepts the attempt: velocities and accelerations become those of its end, and the next step starts there.
    pub fn commit(&mut self, velocity: &mut Columns, acceleration: &mut Columns) {
        let (dt, s, n) = (self.attempt_dt, self.tableau.points(), velocity.len());
        self.weights.clear();
        self.weights.extend(self.tableau.end_velocity.iter().map(|w| dt * w));
        self.rows.combine(BEFORE, &self.weights, &mut self.displacement);
        let rests = self.velocity_rest.axes_mut().into_iter();
        for (axis, (v, rest)) in velocity.axes_mut().into_iter().zip(rests).enumerate() {
            let gained = &self.displacement[axis * n..(axis + 1) * n];
            for i in 0..n {
                let gained = gained[i] + rest[i];
                let next = v[i] + gained;
                rest[i] = gained - (next - v[i]);
                v[i] = next;
            }
        }
        for (a, end) in acceleration.axes_mut().into_iter().zip(self.rows.axes(BEFORE + s)) {
            a.copy_from_slice(end);
        }
        std::mem::swap(&mut self.position_rest.0, &mut self.position_rest.1);
        std::mem::swap(&mut self.rows, &mut self.last);
        (self.last_dt, self.last_from, self.attempt_dt) = (dt, 1.0, 0.0);
    }

    /// What the polynomial of the attempt misses of particle i's acceleration, by its highest divided difference, and the
    /// largest acceleration [m/s^2].
    #[must_use]
    pub fn defect(&self, i: usize) -> (f64, f64) {
        let (mut missed, mut size) = (Vector3::zeros(), 0.0_f64);
        for (k, weight) in self.tableau.defect.iter().enumerate() {
            let a = Vector3::from(self.rows.axes(BEFORE + k).map(|axis| axis[i]));
            missed += a * *weight;
            size = size.max(a.norm_squared());
        }
        (missed.norm(), size.sqrt())
    }

    /// Estimated local error of the positions after the attempt [m], largest over the particles. What is missed of the
    /// acceleration says how fast its series falls, R = missed/|a|; the error of a scheme of order p on m points then goes
    /// like dt^2 |a| R^((p - 1)/(m - 1)), of order dt^(p + 1). Where a force jumps R is about one, and so is the estimate
    /// over dt^2 |a|.
    #[must_use]
    pub fn local_error(&self, dt: f64) -> Worst {
        let known = self.rows.len() - BEFORE;
        let exponent = f64::from(self.tableau.order - 1) / (known - 1) as f64;
        Worst::of((0..self.point.len()).map(|i| match self.defect(i) {
            (_, 0.0) => 0.0,
            (missed, size) => dt * dt * size * libm::pow(missed / size, exponent),
        }))
    }

    /// Forgets the polynomial of a particle whose velocity has just jumped: its next accelerations are predicted to be
    /// what they are now.
    pub fn forget(&mut self, i: usize, acceleration: &Columns) {
        let a = acceleration.get(i);
        for k in BEFORE..self.last.len() {
            for (axis, column) in self.last.axes_mut(k).into_iter().enumerate() {
                column[i] = a[axis];
            }
        }
    }

    /// Where particle i was during the attempt that is not committed yet, as polynomials in time.
    #[must_use]
    pub fn path(&self, start: &Start<'_>, dt: f64, i: usize) -> Path {
        let accelerations = (0..self.tableau.points()).map(|k| self.rows.axes(BEFORE + k).map(|axis| axis[i]));
        Path::new(&self.tableau, start.state.position.get(i), start.state.velocity.get(i), dt, accelerations)
    }

    /// What a checkpoint holds; only between steps.
    #[must_use]
    pub fn carried(&self) -> Carried {
        Carried {
            dt: self.last_dt,
            accelerations: (BEFORE..self.last.len()).map(|k| self.last.columns(k)).collect(),
            position_rest: self.position_rest.0.clone(),
            velocity_rest: self.velocity_rest.clone(),
        }
    }

    /// Goes on from a checkpoint; false where it is of another scheme or number of particles.
    #[must_use]
    pub fn restore(&mut self, carried: &Carried) -> bool {
        let n = self.point.len();
        let fits = carried.accelerations.len() == self.last.len() - BEFORE
            && carried
                .accelerations
                .iter()
                .chain([&carried.position_rest, &carried.velocity_rest])
                .all(|c| c.len() == n);
        if fits {
            for (k, a) in carried.accelerations.iter().enumerate() {
                self.last.set(BEFORE + k, a);
            }
            (self.last_dt, self.last_from, self.attempt_dt) = (carried.dt, 1.0, 0.0);
            self.position_rest.0.copy_from(&carried.position_rest);
            self.velocity_rest.copy_from(&carried.velocity_rest);
        }
        fits
    }
}

/// Largest coordinate [m].
fn largest(r: &Columns) -> f64 {
    r.axes().into_iter().flatten().fold(0.0, |most, x| most.max(x.abs()))
}
