//! The impacts of a step in the order of time, on the particles' parabolas.
//!
//! A queue holds, for every candidate pair, when its gap closes. At the earliest, all that touches there is solved as one
//! instant; only the paths that it bends are looked at anew. Particles with very many impacts in one step take the rest of
//! it at rest on each other: a contact step of first order, which is reported.

use super::candidates::Candidates;
use super::paths::{Closing, Launch, Paths};
use crate::contact::instant::{Body, Booked, Instant, Joint, Moment};
use crate::contact::search::TOUCHING;
use crate::contact::{ContactLaw, Touch};
use crate::impact::{Impact, Partner};
use crate::thermal::exchange::{Exchange, Exchanged};
use nalgebra::Vector3;
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Impacts of one particle in one step from which on it bounces no more: a contact step. Bounces of a pair take tens,
/// three balls that a fourth drives into each other a few hundred.
const WORN: u32 = 400;
/// Impacts from which on a particle is left alone until the step's end.
const IGNORED: u32 = 2 * WORN;

/// Temperatures at the step's start, and what changes them.
#[derive(Clone, Copy, Debug)]
pub struct Warmth<'a> {
    /// Temperatures, length n [K].
    pub thetas: Option<&'a [f64]>,
    /// Heat capacity C [J/(kg K)].
    pub capacity: f64,
    /// Exchange with the surroundings.
    pub exchange: Option<&'a Exchange>,
}

/// Where results go.
#[derive(Debug)]
pub struct Outcome<'a> {
    /// Impacts in the order of time.
    pub reports: &'a mut Vec<Impact>,
    /// Contacts, rounds, losses.
    pub booked: &'a mut Booked,
    /// Heat given off by particles with impacts, up to their last.
    pub exchanged: &'a mut Exchanged,
}

/// What holds a contact closed.
#[derive(Clone, Copy, Debug, Default)]
struct Hold {
    /// Force [N]; 0: not held.
    force: f64,
    /// From when on, in the step [s].
    since: f64,
    /// From i to its partner [-].
    normal: Vector3<f64>,
}

/// When a gap closes (the bits of a time, which sort like it), particle i, its partner (walls after particles), the
/// candidate, and its stamp.
type Prediction = (u64, u32, u64, u32, u32);

/// The impacts of one step. Buffers are kept from one step to the next.
#[derive(Clone, Debug, Default)]
pub struct Impacts {
    candidates: Candidates,
    queue: BinaryHeap<Reverse<Prediction>>,
    /// Number of the last prediction of every candidate; older ones in the queue are void.
    stamps: Vec<u32>,
    /// What holds every candidate.
    holds: Vec<Hold>,
    /// Whether every candidate is part of the instant.
    joined: Vec<bool>,
    instant: Instant,
    /// Candidate of every joint of the instant.
    members: Vec<usize>,
    /// Row of a particle in the instant's bodies, length n; beyond it: none.
    rows: Vec<u32>,
    /// Temperatures of those that had impacts, and when: (particle, K, s).
    pub warmed: Vec<(usize, f64, f64)>,
    warm_row: Vec<u32>,
    /// What takes held contacts back to touching at the step's end: (particle, metres).
    pub drift: Vec<(usize, Vector3<f64>)>,
    /// Whether some particle was in a contact step.
    pub worn: bool,
}

impl Impacts {
    /// Finds and solves all impacts of the step, bending paths.
    pub fn pass(
        &mut self,
        law: &ContactLaw,
        time: f64,
        launch: &Launch<'_>,
        (warmth, ranks): (&Warmth<'_>, &[u32]),
        paths: &mut Paths,
        outcome: &mut Outcome<'_>,
    ) {
        let n = launch.particles.len();
        self.start(n, warmth.thetas.is_some());
        self.candidates.find(launch);
        self.grow();
        let mut step = Step { law, time, launch, warmth, ranks, paths, outcome };
        self.begin(&mut step, true);
        while let Some(Reverse((bits, _, _, candidate, stamp))) = self.queue.pop() {
            if self.stamps[candidate as usize] == stamp {
                self.act(&mut step, f64::from_bits(bits), candidate as usize, false);
            }
        }
        self.end(&mut step);
    }

    /// Solves what touches when a launch begins, for schemes that fly on by themselves. Gives a contact that would have to be
    /// held closed from then on: particle and partner.
    pub fn strike(
        &mut self,
        law: &ContactLaw,
        time: f64,
        launch: &Launch<'_>,
        (warmth, ranks): (&Warmth<'_>, &[u32]),
        paths: &mut Paths,
        outcome: &mut Outcome<'_>,
    ) -> Option<(usize, Partner)> {
        self.start(launch.particles.len(), warmth.thetas.is_some());
        self.candidates.find(launch);
        self.grow();
        let mut step = Step { law, time, launch, warmth, ranks, paths, outcome };
        self.begin(&mut step, false);
        let held = self.holds.iter().position(|hold| hold.force > 0.0)?;
        let touch = self.candidates.touches[held];
        Some((touch.i, touch.partner))
    }

    /// Forgets who was warmed.
    pub fn cool(&mut self) {
        for (i, ..) in self.warmed.drain(..) {
            self.warm_row[i] = u32::MAX;
        }
    }

    fn start(&mut self, n: usize, thermal: bool) {
        self.queue.clear();
        self.stamps.clear();
        self.holds.clear();
        self.joined.clear();
        self.drift.clear();
        self.worn = false;
        self.rows.resize(n, u32::MAX);
        if thermal {
            self.warm_row.resize(n, u32::MAX);
            for &(i, ..) in &self.warmed {
                self.warm_row[i] = u32::MAX;
            }
        }
        self.warmed.clear();
    }

    /// Room for all candidates.
    fn grow(&mut self) {
        let candidates = self.candidates.touches.len();
        self.stamps.resize(candidates, 0);
        self.holds.resize(candidates, Hold::default());
        self.joined.resize(candidates, false);
    }

    /// Contacts that touch when the step begins, which have been at rest where it is the `first` instant; then predictions for
    /// all others.
    fn begin(&mut self, step: &mut Step<'_, '_>, first: bool) {
        let mut touching = Vec::new();
        for k in 0..self.candidates.touches.len() {
            if self.predict(step, k, 0.0, false) {
                touching.push(k);
            }
        }
        for k in touching {
            // A stamp tells that it was solved together with an earlier one.
            if self.stamps[k] == 1 {
                self.act(step, 0.0, k, first);
            }
        }
    }

    /// Puts the time at which a candidate's gap closes after `from` into the queue; `true` if it is closed and not solved.
    fn predict(&mut self, step: &Step<'_, '_>, k: usize, from: f64, solved: bool) -> bool {
        let touch = self.candidates.touches[k];
        self.stamps[k] += 1;
        let ignored = |i: usize| step.paths.impacts(i) >= IGNORED;
        if ignored(touch.i) || touch.j().is_some_and(ignored) {
            return false;
        }
        let shift = &self.candidates.shifts[k];
        match step.paths.closing(step.launch, touch, shift, from, (step.touching_gap(touch), solved)) {
            Closing::Closed => return true,
            Closing::Never => {}
            Closing::At(tau) => {
                let partner = match touch.partner {
                    Partner::Particle(j) => u64::from(j),
                    Partner::Wall(w) => (1 << 32) + u64::from(w),
                };
                self.queue.push(Reverse((tau.to_bits(), touch.i as u32, partner, k as u32, self.stamps[k])));
            }
        }
        false
    }

    /// Solves the instant tau at which a candidate's gap is closed, with all that touches there.
    fn act(&mut self, step: &mut Step<'_, '_>, tau: f64, seed: usize, first: bool) {
        self.gather(step, tau, seed);
        self.release(step, tau);
        let moment = step.moment(tau, first);
        let reports = step.outcome.reports.len();
        let counted = u32::from(!first);
        self.instant.solve(&moment, step.outcome.reports, step.outcome.booked);
        self.settle(step, tau, counted + (step.outcome.reports.len() - reports) as u32);
        self.scatter();
    }

    /// Lets go of the instant's bodies and contacts.
    fn scatter(&mut self) {
        for body in &self.instant.bodies {
            self.rows[body.particle] = u32::MAX;
        }
        for &k in &self.members {
            self.joined[k] = false;
        }
    }

    /// Collects the bodies and contacts connected with a candidate at tau: what touches, and what is held.
    fn gather(&mut self, step: &Step<'_, '_>, tau: f64, seed: usize) {
        self.members.clear();
        self.instant.bodies.clear();
        self.instant.joints.clear();
        self.join(step, tau, seed);
        let mut row = 0;
        while row < self.instant.bodies.len() {
            let i = self.instant.bodies[row].particle;
            let mut next = self.candidates.first(i);
            while let Some(k) = next {
                next = self.candidates.after(i, k);
                let held = self.holds[k].force > 0.0;
                if !self.joined[k] && (held || step.touches(&self.candidates, k, tau)) {
                    self.join(step, tau, k);
                }
            }
            row += 1;
        }
        // An order that depends neither on how they were found nor on numbers.
        let touches = &self.candidates.touches;
        let key = |k: usize| {
            let (i, j) = (step.ranks[touches[k].i], touches[k].j().map_or(u32::MAX, |j| step.ranks[j]));
            (i.min(j), i.max(j), touches[k].partner_number())
        };
        self.members.sort_unstable_by_key(|&k| key(k));
        for m in 0..self.members.len() {
            let k = self.members[m];
            let mut joint = step.joint(&self.candidates, k, &self.rows, tau);
            joint.held = self.holds[k].force > 0.0;
            self.instant.joints.push(joint);
        }
    }

    fn join(&mut self, step: &Step<'_, '_>, tau: f64, k: usize) {
        self.members.push(k);
        self.joined[k] = true;
        let touch = self.candidates.touches[k];
        for i in [Some(touch.i), touch.j()].into_iter().flatten() {
            if self.rows[i] == u32::MAX {
                self.rows[i] = self.instant.bodies.len() as u32;
                let body = step.body(i, tau, self.warm_row.get(i).and_then(|&row| self.warmed.get(row as usize)));
                self.instant.bodies.push(body);
            }
        }
    }

    /// Ends what is held among the instant's contacts; walls are booked.
    fn release(&mut self, step: &mut Step<'_, '_>, tau: f64) {
        for &k in &self.members {
            let hold = std::mem::take(&mut self.holds[k]);
            if hold.force > 0.0 && self.candidates.touches[k].j().is_none() {
                step.outcome.booked.wall_impulse -= hold.normal * (hold.force * (tau - hold.since));
            }
        }
    }

    /// Bends the paths of the instant's bodies, keeps what is held, and looks anew at who meets whom.
    fn settle(&mut self, step: &mut Step<'_, '_>, tau: f64, counted: u32) {
        for (joint, &candidate) in self.instant.joints.iter().zip(&self.members) {
            if joint.force > 0.0 {
                self.holds[candidate] = Hold { force: joint.force, since: tau, normal: joint.normal };
            }
        }
        for row in 0..self.instant.bodies.len() {
            let body = self.instant.bodies[row];
            let i = body.particle;
            step.paths.bend(step.launch, i, tau, body.v, body.a);
            if counted > 0 {
                step.paths.count(i);
            }
            self.worn |= body.worn;
            self.warm(step, &body, tau);
            let reach = step.reach(i, tau);
            if self.candidates.widen(step.launch, i, reach) {
                self.grow();
            }
        }
        for row in 0..self.instant.bodies.len() {
            let i = self.instant.bodies[row].particle;
            let mut next = self.candidates.first(i);
            while let Some(k) = next {
                next = self.candidates.after(i, k);
                let touch = self.candidates.touches[k];
                // A pair of two bodies is looked at once, in the turn of its first.
                if touch.i != i && self.rows[touch.i] != u32::MAX {
                    continue;
                }
                if self.holds[k].force > 0.0 {
                    self.stamps[k] += 1;
                } else {
                    self.predict(step, k, tau, true);
                }
            }
        }
    }

    fn warm(&mut self, step: &mut Step<'_, '_>, body: &Body, tau: f64) {
        let Some(thetas) = step.warmth.thetas else { return };
        let i = body.particle;
        let entry = match self.warm_row[i] {
            u32::MAX => {
                self.warm_row[i] = self.warmed.len() as u32;
                self.warmed.push((i, thetas[i], 0.0));
                self.warmed.len() - 1
            }
            row => row as usize,
        };
        if let Some(exchange) = step.warmth.exchange {
            let (_, mut theta, since) = self.warmed[entry];
            let exchanged = exchange.advance_one(i, tau - since, &mut theta);
            step.outcome.exchanged.convected += exchanged.convected;
            step.outcome.exchanged.radiated += exchanged.radiated;
        }
        self.warmed[entry] = (i, body.theta, tau);
    }

    /// The second half of held contacts' friction, and what brings them back to touching.
    fn end(&mut self, step: &mut Step<'_, '_>) {
        let dt = step.launch.dt;
        for seed in 0..self.holds.len() {
            let Hold { force, since, .. } = self.holds[seed];
            if force <= 0.0 {
                continue;
            }
            self.gather(step, dt, seed);
            let moment = step.moment(dt, false);
            let holds: Vec<_> = self.members.iter().map(|&k| (self.holds[k].force, self.holds[k].normal)).collect();
            self.instant.end(&moment, dt - since, &holds, step.outcome.booked);
            self.close(step);
            for body in &self.instant.bodies {
                step.paths.bend(step.launch, body.particle, dt, body.v, body.a);
            }
            self.release(step, dt);
            self.scatter();
        }
    }

    /// Held contacts drift by the third power of the step; the least move (by mass) that closes them again.
    fn close(&mut self, step: &Step<'_, '_>) {
        let dt = step.launch.dt;
        let gap = |(joint, &k): (&Joint, &usize)| if joint.held { step.gap(&self.candidates, k, dt) } else { f64::NAN };
        let gaps: Vec<f64> = self.instant.joints.iter().zip(&self.members).map(gap).collect();
        for (body, shift) in self.instant.close(&gaps) {
            self.drift.push((self.instant.bodies[body].particle, shift));
        }
    }
}

/// One step, as its impacts see it.
struct Step<'a, 'b> {
    law: &'a ContactLaw,
    time: f64,
    launch: &'a Launch<'a>,
    warmth: &'a Warmth<'a>,
    /// Places of the particles in an order that does not depend on their numbers.
    ranks: &'a [u32],
    paths: &'a mut Paths,
    outcome: &'a mut Outcome<'b>,
}

impl<'a> Step<'a, '_> {
    fn moment(&self, tau: f64, first: bool) -> Moment<'a> {
        Moment {
            law: self.law,
            thermal: self.warmth.thetas.is_some(),
            time: self.time + tau,
            dt: self.launch.dt,
            left: self.launch.dt - tau,
            first,
        }
    }

    /// Gap that counts as closed [m].
    fn touching_gap(&self, touch: Touch) -> f64 {
        2.0 * TOUCHING * touch.smaller_radius(self.launch.particles)
    }

    fn gap(&self, candidates: &Candidates, k: usize, tau: f64) -> f64 {
        let (touch, radius) = (candidates.touches[k], &self.launch.particles.radius);
        let sum = radius[touch.i] + touch.j().map_or(0.0, |j| radius[j]);
        match touch.partner {
            Partner::Particle(_) => self.paths.separation(self.launch, touch, &candidates.shifts[k], tau).norm() - sum,
            Partner::Wall(w) => {
                self.launch.domain.walls[w as usize].distance(&self.paths.piece(self.launch, touch.i).position(tau))
                    - sum
            }
        }
    }

    fn touches(&self, candidates: &Candidates, k: usize, tau: f64) -> bool {
        let (touch, radius) = (candidates.touches[k], &self.launch.particles.radius);
        let gap = self.touching_gap(touch);
        match touch.j() {
            None => self.gap(candidates, k, tau) <= gap,
            Some(j) => {
                let reach = radius[touch.i] + radius[j] + gap;
                let d = self.paths.separation(self.launch, touch, &candidates.shifts[k], tau);
                d.norm_squared() <= reach * reach
            }
        }
    }

    fn body(&self, i: usize, tau: f64, warmed: Option<&(usize, f64, f64)>) -> Body {
        let piece = self.paths.piece(self.launch, i);
        let mass = self.launch.particles.mass[i];
        let theta = self.warmth.thetas.map_or(0.0, |thetas| {
            let (mut theta, since) = warmed.map_or((thetas[i], 0.0), |&(_, theta, since)| (theta, since));
            if let Some(exchange) = self.warmth.exchange {
                exchange.advance_one(i, tau - since, &mut theta);
            }
            theta
        });
        Body {
            particle: i,
            inverse_mass: 1.0 / mass,
            v: piece.velocity(tau),
            // Without what holds: that is found anew.
            a: self.launch.acceleration(i),
            theta,
            capacity: mass * self.warmth.capacity,
            worn: self.paths.impacts(i) >= WORN,
        }
    }

    fn joint(&self, candidates: &Candidates, k: usize, rows: &[u32], tau: f64) -> Joint {
        let (particles, touch) = (self.launch.particles, candidates.touches[k]);
        let d = self.paths.separation(self.launch, touch, &candidates.shifts[k], tau);
        let at = self.paths.piece(self.launch, touch.i).position(tau);
        let (normal, distance) = match touch.partner {
            Partner::Particle(_) => {
                let s = d.norm();
                (if s > 0.0 { d / s } else { Vector3::x() }, s)
            }
            Partner::Wall(w) => (-self.launch.domain.walls[w as usize].normal, f64::INFINITY),
        };
        let mut joint =
            Joint::new(touch, (rows[touch.i] as usize, touch.j().map(|j| rows[j] as usize)), normal, distance);
        joint.effective_mass = touch.effective_mass(particles);
        joint.radius = touch.smaller_radius(particles);
        joint.position = at + normal * particles.radius[touch.i];
        joint
    }

    /// How far particle i can get from its start by the step's end [m].
    fn reach(&self, i: usize, tau: f64) -> f64 {
        let piece = self.paths.piece(self.launch, i);
        let left = self.launch.dt - tau;
        let gone = (piece.r - self.launch.position.get(i)).norm();
        gone + (piece.v.norm() + 0.5 * left * piece.a.norm()) * left
    }
}
