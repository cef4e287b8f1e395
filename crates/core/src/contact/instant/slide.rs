//! Friction of several contacts at once, (33): the least kinetic energy over the discs that their impulses allow.

use super::{Booked, Few, Instant, Joint, MAX_FRICTION_SWEEPS, Moment, RUBBED, VELOCITY_ROUND_OFF};
use nalgebra::Vector3;
use smallvec::smallvec;

impl Instant {
    /// Friction of held contacts over a time [s].
    pub(super) fn rub_held(&mut self, moment: &Moment<'_>, time: f64, booked: &mut Booked) {
        if moment.law.friction.is_none() {
            return;
        }
        let held: Few<usize> = (0..self.joints.len()).filter(|&k| self.joints[k].force > 0.0).collect();
        for &k in &held {
            self.joints[k].impulse = self.joints[k].force * time;
        }
        let energy = self.kinetic();
        self.rub(&held, moment, booked);
        booked.resting_loss += energy - self.kinetic();
    }

    /// Friction (33) at the impulses of these contacts; says which slip.
    pub(super) fn rub(&mut self, members: &[usize], moment: &Moment<'_>, booked: &mut Booked) -> Few<bool> {
        let mut slips: Few<bool> = smallvec![false; members.len()];
        for &k in members {
            self.joints[k].tangential = Vector3::zeros();
        }
        let Some(friction) = moment.law.friction else { return slips };
        let fastest = members.iter().map(|&k| self.sliding(k).norm()).fold(0.0, f64::max);
        // Sliding below the round-off of velocities cannot be taken out.
        let still = (RUBBED * fastest).max(VELOCITY_ROUND_OFF * self.speed());
        if fastest <= still {
            return slips;
        }
        let mut decided = false;
        for _ in 0..MAX_FRICTION_SWEEPS {
            let mut worst: f64 = 0.0;
            for (row, &k) in members.iter().enumerate() {
                let limit =
                    if slips[row] { friction.dynamic } else { friction.static_ } * self.joints[k].impulse.max(0.0);
                worst = worst.max(self.rub_one(k, limit, booked) / self.joints[k].effective_mass);
            }
            let settled = worst <= still || members.len() == 1;
            if settled && decided {
                return slips;
            }
            if settled {
                // Those at the static bound slide, with the dynamic coefficient.
                for (row, &k) in members.iter().enumerate() {
                    let limit = friction.static_ * self.joints[k].impulse.max(0.0);
                    slips[row] =
                        self.sliding(k).norm() > still && self.joints[k].tangential.norm() >= limit * (1.0 - RUBBED);
                }
                decided = true;
                if !slips.contains(&true) {
                    return slips;
                }
            }
        }
        self.fell_back = true;
        slips
    }

    /// Least kinetic energy over the disc of one contact; returns the size of the change [N s].
    pub(super) fn rub_one(&mut self, k: usize, limit: f64, booked: &mut Booked) -> f64 {
        let Joint { tangential: given, effective_mass, .. } = self.joints[k];
        let stick = given - self.sliding(k) * effective_mass;
        let size = stick.norm();
        let wanted = if size > limit { stick * (limit / size) } else { stick };
        let change = wanted - given;
        self.joints[k].tangential = wanted;
        self.give(k, change, booked);
        change.norm()
    }
}
