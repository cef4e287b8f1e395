//! One instant at which contacts act: impacts in rounds, then rest, then the forces that keep resting contacts closed.
//!
//! Rounds: (a) one complementarity problem over the touching contacts that approach, 0 <= P ⊥ u_sep - e u >= 0, u the
//! approach before; kinetic energy changes by -1/2 sum P (1 - e) u <= 0. (b) friction with P held: the least kinetic energy
//! over the discs |P_t| <= mu_s P, and again with mu_d for those at the bound. Rounds repeat while a contact approaches.
//! Rest: one such problem with e = 0 over all contacts. Hold: forces lambda >= 0 ⊥ approach acceleration <= 0.
//!
//! A contact that the fields press together passes to rest where the rest of its bounces, sum u e^k, would be over within
//! the step: its further impulses are booked as heat at once.

mod hold;
mod problem;
mod report;
mod slide;

use super::complementarity::Complementarity;
use super::friction::tangential;
use super::{ContactLaw, Touch};
use crate::impact::Impact;
use nalgebra::Vector3;
use smallvec::{SmallVec, smallvec};

/// Nearly all instants are of one contact, and need no memory.
type Few<T> = SmallVec<[T; 2]>;

/// Rounds before what still approaches is taken as resting. A cradle of n spheres needs about n.
const MAX_ROUNDS: u64 = 200;
/// Largest problem that is solved with a full matrix; beyond it sweeps over the contacts (Gauss and Seidel) cost less.
const FULL: usize = 160;
/// Sweeps, and the share of the fastest approach at which they end [-].
const MAX_SWEEPS: usize = 2_000;
const SWEPT: f64 = 1e-10;
/// Sweeps of friction, and the share of the largest sliding at which they end [-].
const MAX_FRICTION_SWEEPS: usize = 500;
const RUBBED: f64 = 1e-13;
/// Approaches are round-off below this share of the fastest one, this one of the fastest body, and where they close no gap
/// beyond this share of the radius in a step [-].
const ROUND_OFF: f64 = 1e-12;
const VELOCITY_ROUND_OFF: f64 = 1e-14;
const LENGTH_ROUND_OFF: f64 = 4e-16;
/// Drift of held contacts below this share of the radius is round-off [-].
const DRIFT: f64 = 1e-14;
/// Contacts at rest in a cluster hop as their neighbours move; their landings are below this share of the approach at which
/// bounces of a contact that arrives are cut, and are no impacts: they have no heat in the limit of small steps [-].
const HOP_SPEED: f64 = 0.2;
/// A contact that would hop for less than this share of the step stays closed [-].
const HOP: f64 = 1e-3;

/// A particle that takes part.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Its number.
    pub particle: usize,
    /// 1/m [1/kg].
    pub inverse_mass: f64,
    /// Velocity [m/s]; changed.
    pub v: Vector3<f64>,
    /// Acceleration by the fields [m/s^2]; holding forces are added.
    pub a: Vector3<f64>,
    /// Temperature [K]; changed by reaction heat. Without meaning where there are none.
    pub theta: f64,
    /// Capacity m C [J/K].
    pub capacity: f64,
    /// Impacts of this particle in the step so far are so many that it takes no more part in bounces.
    pub worn: bool,
}

/// A contact that takes part.
#[derive(Clone, Copy, Debug)]
pub struct Joint {
    /// Who touches.
    pub touch: Touch,
    /// Row of particle i in the bodies.
    pub i: usize,
    /// Row of particle j; `None` for a wall.
    pub j: Option<usize>,
    /// From i to its partner [-].
    pub normal: Vector3<f64>,
    /// Distance of the centres [m]; infinite for a wall.
    pub distance: f64,
    /// m_eff [kg].
    pub effective_mass: f64,
    /// The smaller radius [m].
    pub radius: f64,
    /// Point of contact [m].
    pub position: Vector3<f64>,
    /// Whether it was at rest before.
    pub held: bool,
    /// Whether it carried an impulse of a bounce in this instant.
    bounced: bool,
    /// Holding force [N].
    pub force: f64,
    /// Impulse of the last problem [N s].
    impulse: f64,
    tangential: Vector3<f64>,
}

impl Joint {
    /// A contact with its geometry.
    #[must_use]
    pub fn new(touch: Touch, (i, j): (usize, Option<usize>), normal: Vector3<f64>, distance: f64) -> Self {
        Self {
            touch,
            i,
            j,
            normal,
            distance,
            effective_mass: 0.0,
            radius: 0.0,
            position: Vector3::zeros(),
            held: false,
            bounced: false,
            force: 0.0,
            impulse: 0.0,
            tangential: Vector3::zeros(),
        }
    }
}

/// What an instant amounted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Booked {
    /// Contacts that approached.
    pub contacts: u64,
    /// Contacts held closed afterwards.
    pub resting: u64,
    /// Rounds of impacts.
    pub rounds: u64,
    /// Largest approach left to contacts that touch [m/s].
    pub residual: f64,
    /// Instants that ended otherwise than by their rule.
    pub fallbacks: u64,
    /// Kinetic energy taken by contacts at rest, sliding included [J].
    pub resting_loss: f64,
    /// Momentum given to the cloud by walls [N s].
    pub wall_impulse: Vector3<f64>,
}

/// When an instant is, and under which laws.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    /// The contact laws.
    pub law: &'a ContactLaw,
    /// Whether there are temperatures.
    pub thermal: bool,
    /// Time of the run [s].
    pub time: f64,
    /// The whole step, by which rest is judged [s].
    pub dt: f64,
    /// What is left of the step [s].
    pub left: f64,
    /// Whether the step begins: contacts that touch then have been resting.
    pub first: bool,
}

/// Bodies and contacts of one instant, connected with each other.
#[derive(Clone, Debug, Default)]
pub struct Instant {
    /// Who takes part.
    pub bodies: Vec<Body>,
    /// What touches, in the order of (i, partner).
    pub joints: Vec<Joint>,
    problem: Complementarity,
    active: Vec<usize>,
    /// Whether some limit was reached before the rule was met.
    fell_back: bool,
}

impl Instant {
    /// Rounds of impacts, rest, hold. Velocities, accelerations and temperatures of the bodies change.
    pub fn solve(&mut self, moment: &Moment<'_>, impacts: &mut Vec<Impact>, booked: &mut Booked) {
        let fastest = (0..self.joints.len()).map(|k| self.approach(k)).fold(0.0, f64::max);
        let speed = self.speed();
        let length = self.joints.iter().map(|joint| joint.radius).fold(0.0, f64::max);
        let still = (ROUND_OFF * fastest).max(VELOCITY_ROUND_OFF * speed).max(LENGTH_ROUND_OFF * length / moment.dt);
        booked.contacts += (0..self.joints.len()).filter(|&k| self.approach(k) > still).count() as u64;
        self.fell_back = self.bodies.iter().any(|body| body.worn);
        let mut rounds = 0;
        while rounds < MAX_ROUNDS && self.round(moment, still, impacts, booked) {
            rounds += 1;
        }
        self.fell_back |= rounds == MAX_ROUNDS;
        booked.rounds += rounds;
        self.rest(moment, still, impacts, booked);
        booked.residual = (0..self.joints.len()).map(|k| self.approach(k)).fold(booked.residual, f64::max);
        self.hold(moment, booked);
        booked.fallbacks += u64::from(self.fell_back);
    }

    /// The fastest body's [m/s].
    fn speed(&self) -> f64 {
        self.bodies.iter().map(|body| body.v.norm()).fold(0.0, f64::max)
    }

    /// u of contact k: the speed at which its gap closes [m/s].
    #[must_use]
    pub fn approach(&self, k: usize) -> f64 {
        self.relative(k).dot(&self.joints[k].normal)
    }

    /// v_i - v_j of contact k [m/s].
    fn relative(&self, k: usize) -> Vector3<f64> {
        let joint = &self.joints[k];
        let j = joint.j.map_or(Vector3::zeros(), |j| self.bodies[j].v);
        self.bodies[joint.i].v - j
    }

    fn sliding(&self, k: usize) -> Vector3<f64> {
        tangential(self.relative(k), self.joints[k].normal)
    }

    /// Rate of u: what the fields add, less what turning about each other takes [m/s^2].
    fn pressing(&self, k: usize) -> f64 {
        let joint = &self.joints[k];
        let j = joint.j.map_or(Vector3::zeros(), |j| self.bodies[j].a);
        (self.bodies[joint.i].a - j).dot(&joint.normal) - self.sliding(k).norm_squared() / joint.distance
    }

    fn theta(&self, k: usize) -> f64 {
        let joint = &self.joints[k];
        let i = self.bodies[joint.i].theta;
        joint.j.map_or(i, |j| 0.5 * (i + self.bodies[j].theta))
    }

    fn restitution(&self, k: usize, u: f64, moment: &Moment<'_>) -> f64 {
        moment.law.restitution.at(u, moment.thermal.then(|| self.theta(k)))
    }

    /// Whether contact k, approaching at u, bounces no more.
    fn passes_to_rest(&self, k: usize, u: f64, e: f64, moment: &Moment<'_>) -> bool {
        let joint = &self.joints[k];
        if self.bodies[joint.i].worn || joint.j.is_some_and(|j| self.bodies[j].worn) {
            return true;
        }
        let pressing = self.pressing(k);
        if pressing <= 0.0 || e >= 1.0 {
            return false;
        }
        let all_bounces_end = u <= self.cut(k, e, moment);
        let next_bounce_ends = 2.0 * e * u <= pressing * moment.dt;
        all_bounces_end || (next_bounce_ends && u <= moment.law.rest_speed)
    }

    /// Approach at which all further bounces, of duration 2 e u/(d (1 - e)) in all, end within the step [m/s]; d the pressing
    /// acceleration.
    fn cut(&self, k: usize, e: f64, moment: &Moment<'_>) -> f64 {
        self.pressing(k).max(0.0) * moment.dt * (1.0 - e) / (2.0 * e).max(f64::MIN_POSITIVE)
    }

    /// One round; `false` if nothing bounces any more.
    fn round(&mut self, moment: &Moment<'_>, still: f64, impacts: &mut Vec<Impact>, booked: &mut Booked) -> bool {
        let mut active = std::mem::take(&mut self.active);
        active.clear();
        let mut demands: Few<(f64, f64)> = Few::new();
        for k in 0..self.joints.len() {
            let u = self.approach(k);
            if u > still {
                let e = self.restitution(k, u, moment);
                if !self.passes_to_rest(k, u, e, moment) {
                    active.push(k);
                    demands.push((u, e));
                }
            }
        }
        if !active.is_empty() {
            self.push(&active, |row| (1.0 + demands[row].1) * demands[row].0);
            self.kick(&active, booked);
            let after: Few<f64> = active.iter().map(|&k| -self.approach(k)).collect();
            let slides: Few<Vector3<f64>> = active.iter().map(|&k| self.sliding(k)).collect();
            let slips = self.rub(&active, moment, booked);
            for (row, &k) in active.iter().enumerate() {
                if self.joints[k].impulse <= 0.0 {
                    continue;
                }
                self.joints[k].bounced = true;
                let (u, e) = demands[row];
                let heat = self.react(k, moment, |reaction, force, radius| reaction.at(force, radius));
                let slip = moment.law.friction.map(|_| slips[row]);
                impacts.push(self.report(k, moment, (u, after[row], e), slides[row], slip, heat));
            }
        }
        let any = !active.is_empty();
        self.active = active;
        any
    }

    /// Takes out what still approaches, and short hops of contacts that have been at rest.
    fn rest(&mut self, moment: &Moment<'_>, still: f64, impacts: &mut Vec<Impact>, booked: &mut Booked) {
        let all: Few<usize> = (0..self.joints.len()).collect();
        let before: Few<f64> = all.iter().map(|&k| self.approach(k)).collect();
        let hops = self.hops(&before, moment);
        if !before.iter().zip(&hops).any(|(&u, &hops)| u > still || hops) {
            return;
        }
        let energy = self.kinetic();
        let restitutions: Few<f64> = all.iter().map(|&k| self.restitution(k, before[k].max(0.0), moment)).collect();
        let cuts: Few<f64> = all.iter().map(|&k| self.cut(k, restitutions[k], moment)).collect();
        self.push_free(&all, |row| before[row], |row| hops[row]);
        self.kick(&all, booked);
        let after: Few<f64> = all.iter().map(|&k| -self.approach(k)).collect();
        let slides: Few<Vector3<f64>> = all.iter().map(|&k| self.sliding(k)).collect();
        let slips = self.rub(&all, moment, booked);
        let mut reported = 0.0;
        for &k in &all {
            let (u, e) = (before[k], restitutions[k]);
            let joint = self.joints[k];
            // Contacts that were at rest stay so; of those that arrive the rest of their bounces is booked.
            if moment.first || joint.held || joint.impulse <= 0.0 || u <= still || u <= HOP_SPEED * cuts[k] {
                continue;
            }
            let all_bounces = joint.effective_mass * (1.0 + e) * u / (1.0 - e).max(f64::EPSILON);
            let heat =
                self.react_with(k, moment, all_bounces, |reaction, force, radius| reaction.linear(force, radius));
            let slip = moment.law.friction.map(|_| slips[k]);
            let impact = self.report(k, moment, (u, after[k], 0.0), slides[k], slip, heat);
            reported += impact.normal_loss() + impact.friction_loss();
            impacts.push(impact);
        }
        booked.resting_loss += energy - self.kinetic() - reported;
    }

    /// Which contacts that were at rest part so slowly that what presses them together brings them back within the step.
    fn hops(&mut self, approach: &[f64], moment: &Moment<'_>) -> Few<bool> {
        let may = |joint: &Joint, u: f64| {
            u < 0.0 && -u <= moment.law.rest_speed && !joint.bounced && (moment.first || joint.held)
        };
        if !self.joints.iter().zip(approach).any(|(joint, &u)| may(joint, u)) {
            return smallvec![false; self.joints.len()];
        }
        let all: Few<usize> = (0..self.joints.len()).collect();
        self.find_forces(&all);
        let hop = |(joint, &u): (&Joint, &f64)| {
            may(joint, u) && -2.0 * u * joint.effective_mass <= joint.force * moment.dt && joint.force > 0.0
        };
        self.joints.iter().zip(approach).map(hop).collect()
    }

    fn kinetic(&self) -> f64 {
        self.bodies.iter().map(|body| 0.5 * body.v.norm_squared() / body.inverse_mass).sum()
    }
}
