//! Forces that keep pressed contacts closed between instants, and what takes their drift out.

use super::{Booked, DRIFT, Few, HOP, Instant, Joint, Moment};
use nalgebra::Vector3;

impl Instant {
    /// Forces that keep contacts closed for the rest of the step, and the first half of their friction.
    pub(super) fn hold(&mut self, moment: &Moment<'_>, booked: &mut Booked) {
        let pressing: Few<f64> = (0..self.joints.len()).map(|k| self.pressing(k)).collect();
        let most = pressing.iter().copied().fold(0.0, f64::max);
        for joint in &mut self.joints {
            joint.force = 0.0;
        }
        if most <= 0.0 || moment.left <= 0.0 {
            return;
        }
        let resting: Few<usize> =
            (0..self.joints.len()).filter(|&k| -2.0 * self.approach(k) <= HOP * most * moment.dt).collect();
        self.find_forces(&resting);
        for &k in &resting {
            let Joint { i, j, normal, force, .. } = self.joints[k];
            let (bodies, push) = (&mut self.bodies, normal * force);
            let inverse_mass = bodies[i].inverse_mass;
            bodies[i].a -= push * inverse_mass;
            if let Some(j) = j {
                let inverse_mass = bodies[j].inverse_mass;
                bodies[j].a += push * inverse_mass;
            }
        }
        booked.resting += resting.iter().filter(|&&k| self.joints[k].force > 0.0).count() as u64;
        self.rub_held(moment, 0.5 * moment.left, booked);
    }

    /// The end of what held contacts closed for a time [s], with forces [N] along normals at its begin, one for each
    /// contact: the mean of both ends counts, as for the fields; then the second half of friction.
    pub fn end(&mut self, moment: &Moment<'_>, time: f64, holds: &[(f64, Vector3<f64>)], booked: &mut Booked) {
        self.fell_back = false;
        let held: Few<usize> = (0..self.joints.len()).filter(|&k| self.joints[k].held).collect();
        self.find_forces(&held);
        for &k in &held {
            let (force, normal) = holds[k];
            let change = normal * force - self.joints[k].normal * self.joints[k].force;
            self.give(k, change * (0.5 * time), booked);
        }
        self.rub_held(moment, 0.5 * time, booked);
        booked.fallbacks += u64::from(self.fell_back);
    }

    /// Forces that take the approach acceleration of these contacts to zero, or above where they need not push.
    pub(super) fn find_forces(&mut self, members: &[usize]) {
        let pressing: Few<f64> = members.iter().map(|&k| self.pressing(k)).collect();
        self.push(members, |row| pressing[row]);
        for &k in members {
            self.joints[k].force = self.joints[k].impulse;
        }
    }

    /// The least moves (by mass) that take the gaps of these contacts to zero; NaN: of no concern. (body, metres) each.
    pub fn close(&mut self, gaps: &[f64]) -> Vec<(usize, Vector3<f64>)> {
        let members: Vec<usize> = (0..gaps.len()).filter(|&k| gaps[k].is_finite()).collect();
        if !members.iter().any(|&k| gaps[k].abs() > DRIFT * self.joints[k].radius) {
            return Vec::new();
        }
        self.push_free(&members, |row| -gaps[members[row]], |_| true);
        let mut moves = vec![Vector3::zeros(); self.bodies.len()];
        for &k in &members {
            let Joint { i, j, normal, impulse, .. } = self.joints[k];
            moves[i] -= normal * (impulse * self.bodies[i].inverse_mass);
            if let Some(j) = j {
                moves[j] += normal * (impulse * self.bodies[j].inverse_mass);
            }
        }
        moves.into_iter().enumerate().collect()
    }
}
