//! Impulses (or forces) of several contacts at once: the least that do what is demanded, by a full matrix or by sweeps.

use super::{Booked, FULL, Instant, Joint, MAX_SWEEPS, SWEPT};
use nalgebra::Vector3;

impl Instant {
    /// Impulses (or forces) of some contacts such that W P >= demand, the least that do, none negative.
    pub(super) fn push(&mut self, members: &[usize], demand: impl Fn(usize) -> f64) {
        self.push_free(members, demand, |_| false);
    }

    pub(super) fn push_free(&mut self, members: &[usize], demand: impl Fn(usize) -> f64, free: impl Fn(usize) -> bool) {
        if members.len() > FULL {
            return self.sweep(members, demand, free);
        }
        let mut problem = std::mem::take(&mut self.problem);
        problem.start(members.len());
        for (row, &k) in members.iter().enumerate() {
            problem.demand[row] = demand(row);
            problem.free[row] = free(row);
            for (column, &l) in members[..=row].iter().enumerate() {
                let coupling = self.coupling(k, l);
                if coupling != 0.0 {
                    problem.couple(row, column, coupling);
                }
            }
        }
        self.fell_back |= !problem.solve();
        for (row, &k) in members.iter().enumerate() {
            self.joints[k].impulse = problem.solution[row];
        }
        self.problem = problem;
    }

    /// W_kl = n_k.n_l over the masses of shared particles, with its sign [1/kg].
    pub(super) fn coupling(&self, k: usize, l: usize) -> f64 {
        let (a, b) = (&self.joints[k], &self.joints[l]);
        let cosine = a.normal.dot(&b.normal);
        if k == l {
            return 1.0 / a.effective_mass;
        }
        let weight = |row: usize| self.bodies[row].inverse_mass * cosine;
        let mut sum = 0.0;
        if a.i == b.i {
            sum += weight(a.i);
        }
        if b.j == Some(a.i) {
            sum -= weight(a.i);
        }
        if let Some(j) = a.j {
            if b.j == Some(j) {
                sum += weight(j);
            }
            if b.i == j {
                sum -= weight(j);
            }
        }
        sum
    }

    /// The same by sweeps over the contacts, for large problems.
    pub(super) fn sweep(&mut self, members: &[usize], demand: impl Fn(usize) -> f64, free: impl Fn(usize) -> bool) {
        let mut given = vec![Vector3::zeros(); self.bodies.len()];
        let scale = (0..members.len()).map(|row| demand(row).abs()).fold(0.0, f64::max);
        for &k in members {
            self.joints[k].impulse = 0.0;
        }
        for _ in 0..MAX_SWEEPS {
            let mut worst: f64 = 0.0;
            for (row, &k) in members.iter().enumerate() {
                let Joint { i, j, normal, effective_mass, impulse, .. } = self.joints[k];
                let done: Vector3<f64> = j.map_or(Vector3::zeros(), |j| given[j]) - given[i];
                let wanted = impulse + effective_mass * (demand(row) - done.dot(&normal));
                let wanted = if free(row) { wanted } else { wanted.max(0.0) };
                let change = wanted - impulse;
                worst = worst.max(change.abs() / effective_mass);
                self.joints[k].impulse = wanted;
                given[i] -= normal * (change * self.bodies[i].inverse_mass);
                if let Some(j) = j {
                    given[j] += normal * (change * self.bodies[j].inverse_mass);
                }
            }
            if worst <= SWEPT * scale {
                return;
            }
        }
        self.fell_back = true;
    }

    /// Gives the bodies the impulses of these contacts.
    pub(super) fn kick(&mut self, members: &[usize], booked: &mut Booked) {
        for &k in members {
            let push = -self.joints[k].normal * self.joints[k].impulse;
            self.give(k, push, booked);
        }
    }

    /// Gives impulse p to i and -p to its partner.
    pub(super) fn give(&mut self, k: usize, p: Vector3<f64>, booked: &mut Booked) {
        let Joint { i, j, .. } = self.joints[k];
        let bodies = &mut self.bodies;
        let inverse_mass = bodies[i].inverse_mass;
        bodies[i].v += p * inverse_mass;
        match j {
            Some(j) => {
                let inverse_mass = bodies[j].inverse_mass;
                bodies[j].v -= p * inverse_mass;
            }
            None => booked.wall_impulse += p,
        }
    }
}
