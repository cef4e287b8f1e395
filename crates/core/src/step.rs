//! One step of the solver, as the paper's loop (55) has it: attempts, until one is accepted.

use crate::collocation::Collocation;
use crate::contact::resolve::{Bodies, Resolution, lift, resolve};
use crate::contact::search::{TOUCHING, visit_close};
use crate::convergence::Verdict;
use crate::diagnostics::{Level, Notice, RejectedAttempt, RejectionCause, StepDiagnostics};
use crate::error::RunError;
use crate::events::Events;
use crate::impact::Partner;
use crate::local_error::LocalErrors;
use crate::scene::ModelKind;
use crate::simd::vectorized;
use crate::simulation::{OnceNotice, Simulation};
use crate::stagger::Start;
use crate::state::Columns;
use crate::step_control::{Attempt, Decision, MAX_ATTEMPTS, TRAVEL_SHARE, Worst};
use nalgebra::Vector3;

/// Largest kick of an unresolved acceleration, over the fastest speed of the cloud [-]. A fall into a singularity exceeds
/// any such bound sooner or later; a smaller one also shortens steps where a pair merely crosses a cut-off.
const KICK: f64 = 0.02;

impl Simulation {
    /// One accepted step from t to t + dt, dt at most what is left of the run.
    pub(crate) fn step(&mut self) -> Result<(), RunError> {
        let left = self.duration - self.time;
        let mut dt = self.next_dt.min(left).min(self.longest_flight());
        self.begin_step();
        loop {
            self.lift_resting(dt);
            let (particles, state, acceleration) = (&self.particles, &self.state, &self.acceleration);
            let start = Start { particles, state, acceleration, time: self.time };
            let verdict = self.stagger.solve(&mut self.model, &start, dt, self.events.as_mut());
            let attempt = self.attempt(dt, verdict);
            match self.control.decide(&self.stagger.sweeps, &attempt) {
                Decision::Accept { next_dt } => {
                    // The last step is clipped; what would have followed is kept for a run that goes on.
                    let clipped = left < self.next_dt && dt == left;
                    self.next_dt = if clipped { self.next_dt } else { next_dt.max(self.smallest_step()) };
                    return self.accept(&attempt);
                }
                Decision::Reject { cause, retry_dt } => dt = self.reject(cause, &attempt, retry_dt)?,
            }
        }
    }

    fn begin_step(&mut self) {
        self.impacts.clear();
        self.notices.clear();
        self.diagnostics = StepDiagnostics::default();
        self.stagger.pairs_evaluated = 0;
        self.previous_velocity.copy_from(&self.state.velocity);
        self.previous_totals = self.totals;
    }

    /// The step in which the fastest particle gets as far as located impacts are looked ahead [s].
    fn longest_flight(&self) -> f64 {
        let Some(flight) = self.model.flight.filter(|_| !self.control.fixed) else { return f64::INFINITY };
        let dt = self.next_dt;
        let speed = |i: usize| {
            let a = if self.acceleration.is_empty() { 0.0 } else { self.acceleration.get(i).norm() };
            self.state.velocity.get(i).norm() + 0.5 * dt * a
        };
        let fastest = (0..self.particles.len()).map(speed).fold(0.0, f64::max);
        (flight / fastest).max(self.smallest_step())
    }

    /// Impacts at step ends: keeps pressed contacts from sinking in a step of dt, whatever an earlier attempt did.
    fn lift_resting(&mut self, dt: f64) {
        let (Some(law), Some(search)) = (&self.model.contact, &mut self.model.search) else { return };
        if self.model.kind == ModelKind::Paper || law.located || self.acceleration.is_empty() {
            return;
        }
        if !self.diagnostics.rejected.is_empty() {
            self.state.velocity.copy_from(&self.previous_velocity);
            self.totals = self.previous_totals;
        }
        if !self.touches_known {
            search.touching(&self.state.position, &self.particles, &self.model.domain, &mut self.touches);
            self.touches_known = true;
        }
        if self.touches.is_empty() {
            return;
        }
        let weight = self.model.integrator.position_sum();
        let mut bodies = Bodies {
            particles: &self.particles,
            domain: &self.model.domain,
            position: &self.state.position,
            velocity: &mut self.state.velocity,
            temperature: None,
            acceleration: &self.acceleration,
            dt,
            heat_capacity: f64::INFINITY,
        };
        let lifted = lift(law, &self.touches, weight, self.time, &mut bodies);
        self.book_resting(&lifted);
    }

    /// What the step control needs to know about an attempt.
    fn attempt(&self, dt: f64, verdict: Verdict) -> Attempt {
        let consistent = self.model.kind == ModelKind::Consistent && verdict == Verdict::Converged;
        Attempt {
            dt,
            verdict,
            local_error: consistent.then(|| self.local_error(dt)),
            travel: (consistent && self.model.contact.as_ref().is_some_and(|law| !law.located)).then(|| self.travel()),
        }
    }

    /// Largest difference between r' and the third-order r + dt v + dt^2 (a/3 + a'/6), in mean diameters, over the
    /// position tolerance [-]. A kick that turns the motion of the whole cloud around counts as too large at any tolerance:
    /// near a singular attraction that difference is small although nothing is resolved.
    fn local_error(&self, dt: f64) -> Worst {
        let (error, kick) = match &self.stagger.collocation {
            Some(collocation) => self.collocation_error(collocation, dt),
            None => self.local_errors(dt),
        };
        if kick.size > KICK && error.size <= 1.0 { Worst { size: 8.0, ..kick } } else { error }
    }

    fn local_errors(&self, dt: f64) -> (Worst, Worst) {
        let integrator = &self.model.integrator;
        vectorized(LocalErrors {
            before: &self.acceleration,
            force: &self.stagger.field_force,
            jump: self.events.as_ref().and_then(Events::jumps),
            mass: &self.particles.mass,
            velocity: &self.state.velocity,
            dt,
            scale: dt * dt / (self.model.mean_diameter * self.tolerance),
            weights: (integrator.position_new - 1.0 / 6.0, integrator.position_old - 1.0 / 3.0),
            unresolved: 0.5,
        })
    }

    fn collocation_error(&self, collocation: &Collocation, dt: f64) -> (Worst, Worst) {
        let error = collocation.local_error(dt);
        let error = Worst { size: error.size / (self.model.mean_diameter * self.tolerance), ..error };
        let n = self.acceleration.len();
        let fastest = (0..n).map(|i| self.state.velocity.get(i).norm()).fold(0.0, f64::max);
        let kick = Worst::of((0..n).map(|i| {
            let (before, after) = (self.acceleration.get(i), self.stagger.field_force.get(i) / self.particles.mass[i]);
            let (change, size) = collocation.defect(i);
            let own = (self.state.velocity.get(i) + (before + after) * (0.5 * dt)).norm();
            if change > 0.1 * size { dt * change / fastest.max(own).max(0.5 * dt * size) } else { 0.0 }
        }));
        (error, kick)
    }

    /// Bound on how far any two (or one and a wall) came nearer, over what contacts allow in a step [-].
    fn travel(&self) -> Worst {
        let (from, to) = (&self.state.position, &self.stagger.position);
        let n = from.len();
        let moved = |i: usize| to.get(i) - from.get(i);
        let mean = (0..n).map(moved).sum::<Vector3<f64>>() / n as f64;
        let allowed = TRAVEL_SHARE * self.model.smallest_diameter;
        let walls = !self.model.domain.walls.is_empty();
        Worst::of((0..n).map(|i| {
            let between = if n > 1 { 2.0 * (moved(i) - mean).norm() } else { 0.0 };
            let to_walls = if walls { moved(i).norm() } else { 0.0 };
            between.max(to_walls) / allowed
        }))
    }

    /// Takes the last iterate as the new state, then exchange, impacts, books.
    fn accept(&mut self, attempt: &Attempt) -> Result<(), RunError> {
        let dt = attempt.dt;
        self.advance_time(dt);
        self.move_particles(dt);
        self.exchange_heat(dt);
        match (self.model.kind, &self.model.contact) {
            (ModelKind::Paper, _) => self.report_latched(),
            (ModelKind::Consistent, Some(law)) if !law.located => self.resolve_impacts(dt),
            (ModelKind::Consistent, _) => self.report_events(),
        }
        self.book_outside_impulse(dt);
        self.look_around();
        self.fill_diagnostics(attempt);
        self.check_finite()
    }

    /// t + dt, with what rounding takes kept for the next step (Kahan).
    fn advance_time(&mut self, dt: f64) {
        let step = dt + self.time_rest;
        let next = self.time + step;
        self.time_rest = step - (next - self.time);
        self.time = next;
    }

    /// r' and v' of the accepted iterate; a' for the next step; wraps into the periodic box.
    fn move_particles(&mut self, dt: f64) {
        match &mut self.stagger.collocation {
            Some(collocation) => collocation.commit(&mut self.state.velocity, &mut self.acceleration),
            None => self.accelerate(dt),
        }
        std::mem::swap(&mut self.state.position, &mut self.stagger.position);
        let (external, totals) = (&self.model.external, &mut self.totals);
        self.model.domain.wrap(&mut self.state.position, |i, axis, shift| {
            if let Some(external) = external {
                totals.periodic_work -= external.component(i, axis) * shift;
            }
        });
    }

    /// v' and a' by the integrator's weights.
    fn accelerate(&mut self, dt: f64) {
        let integrator = &self.model.integrator;
        let (new, old) = (dt * integrator.velocity_new, dt * integrator.velocity_old);
        let mass = &self.particles.mass;
        let (field, contacts) = (self.stagger.field_force.axes(), self.stagger.contact_force.axes());
        let axes = self.state.velocity.axes_mut().into_iter().zip(self.acceleration.axes_mut());
        for (axis, (v, a)) in axes.enumerate() {
            for (i, force) in field[axis].iter().enumerate() {
                let next = force / mass[i];
                v[i] += new * next + old * a[i];
                a[i] = next;
            }
            for (i, force) in contacts[axis].iter().enumerate() {
                v[i] += dt * (force / mass[i]);
            }
        }
        if let Some(events) = &self.events {
            for &(i, _, kick) in &events.shifts {
                self.state.velocity.add(i, kick);
            }
        }
    }

    /// Stage I of `paper`'s contacts and stage II of both models, with their heat booked.
    fn exchange_heat(&mut self, dt: f64) {
        let (Some(theta), Some(capacity)) = (&mut self.state.temperature, self.model.heat_capacity) else { return };
        for ((theta, heat), mass) in theta.iter_mut().zip(&self.stagger.heat).zip(&self.particles.mass) {
            *theta += heat / (mass * capacity);
        }
        // Those that had impacts are already past a part of the step.
        let mut warmed: Vec<(usize, f64, f64)> = self.events.iter().flat_map(Events::warmed).collect();
        warmed.sort_unstable_by_key(|&(i, ..)| i);
        let exchange = self.model.exchange.as_ref();
        for (i, latest, since) in &mut warmed {
            if let Some(exchange) = exchange {
                let rest = exchange.advance_one(*i, dt - *since, latest);
                self.totals.convected += rest.convected;
                self.totals.radiated += rest.radiated;
            }
        }
        if let Some(exchange) = exchange {
            let had_impacts = |i: usize| warmed.binary_search_by_key(&i, |&(k, ..)| k).is_ok();
            let exchanged = if warmed.is_empty() {
                exchange.advance_and_book(dt, theta)
            } else {
                exchange.advance_others(dt, theta, had_impacts)
            };
            let before = self.events.as_ref().map(|events| events.exchanged).unwrap_or_default();
            self.totals.convected += exchanged.convected + before.convected;
            self.totals.radiated += exchanged.radiated + before.radiated;
        }
        for (i, latest, _) in warmed {
            theta[i] = latest;
        }
    }

    /// Located events have happened during the step.
    fn report_events(&mut self) {
        let Some(events) = &mut self.events else { return };
        std::mem::swap(&mut self.impacts, &mut events.reports);
        let booked = events.booked;
        let contact_step = events.contact_step();
        self.diagnostics.contacts = booked.contacts;
        self.diagnostics.resting = booked.resting;
        self.diagnostics.rounds = booked.rounds;
        self.totals.resting_loss += booked.resting_loss;
        for k in 0..3 {
            self.totals.outside_impulse[k] += booked.wall_impulse[k];
        }
        if booked.resting > 0 {
            let message = "first resting contact: the rest of its bounces would have been over within the step";
            self.notice_once(OnceNotice::Resting, Level::Info, message.to_owned());
        }
        if contact_step {
            let message = "first contact step: particles with hundreds of impacts in one step take the rest of it at rest \
                           on each other";
            self.notice_once(OnceNotice::ContactStep, Level::Info, message.to_owned());
        }
        self.book_impacts();
    }

    /// `paper`: contacts acted during the step.
    fn report_latched(&mut self) {
        let Some(law) = &self.model.contact else { return };
        self.diagnostics.contacts = self.stagger.latched.len() as u64;
        self.diagnostics.rounds = u64::from(!self.stagger.latched.is_empty());
        self.stagger.latched.report(
            self.time,
            &self.particles,
            &self.state.position,
            (&self.previous_velocity, &self.state.velocity),
            law.friction.is_some(),
            &mut self.impacts,
        );
        self.book_impacts();
        for impact in &self.impacts {
            if let Partner::Wall(_) = impact.partner {
                for k in 0..3 {
                    self.totals.outside_impulse[k] +=
                        impact.tangential_impulse[k] - impact.normal_impulse * impact.normal[k];
                }
            }
        }
    }

    /// `consistent`: impacts happen now.
    fn resolve_impacts(&mut self, dt: f64) {
        let (Some(law), Some(search)) = (&self.model.contact, &mut self.model.search) else { return };
        search.touching(&self.state.position, &self.particles, &self.model.domain, &mut self.touches);
        if self.touches.is_empty() {
            return;
        }
        self.touches_known = true;
        let mut bodies = Bodies {
            particles: &self.particles,
            domain: &self.model.domain,
            position: &self.state.position,
            velocity: &mut self.state.velocity,
            temperature: self.state.temperature.as_mut(),
            acceleration: &self.acceleration,
            dt,
            heat_capacity: self.model.heat_capacity.unwrap_or(f64::INFINITY),
        };
        let resolution = resolve(law, &self.touches, self.time, &mut bodies, &mut self.impacts);
        if let Some(collocation) = &mut self.stagger.collocation {
            for impact in &self.impacts {
                collocation.forget(impact.particle as usize, &self.acceleration);
                if let Partner::Particle(j) = impact.partner {
                    collocation.forget(j as usize, &self.acceleration);
                }
            }
        }
        self.diagnostics.contacts = resolution.contacts;
        self.diagnostics.resting = resolution.resting;
        self.diagnostics.rounds = resolution.rounds;
        let speed = law.rest_speed;
        self.book_resting(&resolution);
        if resolution.resting > 0 {
            self.notice_once(
                OnceNotice::Resting,
                Level::Info,
                format!(
                    "first resting contact: it approached slower than contact.rest_speed = {speed} m/s or than twice what \
                     the fields added in the step"
                ),
            );
        }
        self.book_impacts();
    }

    fn book_resting(&mut self, resolution: &Resolution) {
        self.totals.resting_loss += resolution.resting_loss;
        for k in 0..3 {
            self.totals.outside_impulse[k] += resolution.wall_impulse[k];
        }
    }

    fn book_impacts(&mut self) {
        for impact in &self.impacts {
            self.totals.impact_loss += impact.normal_loss();
            self.totals.friction_loss += impact.friction_loss();
            let hit = if matches!(impact.partner, Partner::Particle(_)) { 2.0 } else { 1.0 };
            self.totals.reaction_heat += hit * impact.heat;
        }
    }

    fn book_outside_impulse(&mut self, dt: f64) {
        if let Some(external) = &self.model.external {
            let impulse = external.total() * dt;
            for k in 0..3 {
                self.totals.outside_impulse[k] += impulse[k];
            }
        }
    }

    /// Bonds and the deepest overlap at the step's end.
    fn look_around(&mut self) {
        let contact = self.model.contact.is_some();
        if let (Some(range), Some(search)) = (self.model.bond_range, &mut self.model.search) {
            let pairs = search.close(&self.state.position, &self.particles, &self.model.domain, range);
            self.diagnostics.bonds = Some(pairs.len() as u64);
        }
        if !contact {
            return;
        }
        let mut deepest = self.counters.max_overlap;
        let radius = &self.particles.radius;
        visit_close(&self.state.position, radius, &self.model.domain.periodic, 1.0, |pair| {
            let touch = radius[pair.i as usize] + radius[pair.j as usize];
            // Touching within round-off is no overlap.
            if pair.square < touch * touch * (1.0 - TOUCHING) {
                deepest = deepest.max(touch - pair.square.sqrt());
            }
        });
        for wall in &self.model.domain.walls {
            for (i, radius) in self.particles.radius.iter().enumerate() {
                deepest = deepest.max(radius - wall.distance(&self.state.position.get(i)));
            }
        }
        self.counters.max_overlap = deepest;
    }

    fn fill_diagnostics(&mut self, attempt: &Attempt) {
        let sweeps = &self.stagger.sweeps;
        let diagnostics = &mut self.diagnostics;
        diagnostics.dt = attempt.dt;
        diagnostics.position_errors.clone_from(&sweeps.position);
        diagnostics.temperature_errors.clone_from(&sweeps.temperature);
        diagnostics.violation = sweeps.violation;
        diagnostics.scaling = self.control.scaling;
        diagnostics.contraction = match sweeps.position.as_slice() {
            [.., before, last] if *before > 0.0 => last / before,
            _ => f64::NAN,
        };
        diagnostics.local_error = attempt.local_error.map(|error| error.size * self.tolerance);
        diagnostics.pairs_evaluated = self.stagger.pairs_evaluated;
        self.counters.steps += 1;
        self.counters.iterations += diagnostics.iterations();
        self.counters.rejected_steps += diagnostics.rejected.len() as u64;
        self.counters.impacts += self.impacts.len() as u64;
        self.counters.pair_evaluations += diagnostics.pairs_evaluated;
        if self.control.fixed && attempt.travel.is_some_and(|travel| travel.size > 1.0) {
            self.notice_once(
                OnceNotice::Travel,
                Level::Warning,
                format!(
                    "with solver.step.fixed particles move more than {TRAVEL_SHARE} of a diameter in a step at t = {} s: \
                     impacts are seen late or missed; a smaller or adaptive step sees them",
                    self.time
                ),
            );
        }
    }

    /// The scene's smallest step, or the smallest that still moves the time where that is more [s].
    fn smallest_step(&self) -> f64 {
        self.control.min.max(f64::EPSILON * self.time)
    }

    /// Notes a rejected attempt, and gives the next step or gives up.
    fn reject(&mut self, cause: RejectionCause, attempt: &Attempt, retry_dt: f64) -> Result<f64, RunError> {
        let (dt, sweeps) = (attempt.dt, &self.stagger.sweeps);
        let blamed = match cause {
            RejectionCause::LocalError => attempt.local_error,
            RejectionCause::Travel => attempt.travel,
            RejectionCause::NotConverged | RejectionCause::NotFinite => None,
        };
        let violation = blamed.map_or(sweeps.violation, |worst| worst.size);
        self.diagnostics.rejected.push(RejectedAttempt {
            dt,
            cause,
            iterations: sweeps.iterations() as u64,
            violation,
            particle: blamed.map_or(sweeps.worst, |worst| worst.particle),
        });
        let attempts = self.diagnostics.rejected.len() as u64;
        let too_small = retry_dt < self.smallest_step();
        if !self.control.fixed && !too_small && attempts < MAX_ATTEMPTS {
            return Ok(retry_dt);
        }
        let particles = blamed.map_or_else(|| self.stagger.most_moved(), |worst| worst.particles());
        let advice = self.advice(cause);
        let time = self.time;
        Err(if too_small && !self.control.fixed {
            RunError::StepTooSmall {
                time,
                dt: retry_dt,
                min: self.smallest_step(),
                cause,
                particles,
                violation,
                advice,
            }
        } else {
            RunError::TooManyRejections { time, dt, attempts, cause, particles, violation, advice }
        })
    }

    fn advice(&self, cause: RejectionCause) -> String {
        let fixed = if self.control.fixed { "a smaller solver.step.fixed or an adaptive step, " } else { "" };
        let rest = match cause {
            RejectionCause::NotConverged => "a larger solver.tolerance or solver.max_iterations, or weaker forces",
            RejectionCause::LocalError => {
                "a contact section or a repulsion that keeps particles apart, a larger solver.tolerance.position, or a \
                 smaller solver.step.min"
            }
            RejectionCause::NotFinite => {
                "particles farther apart at the start, a contact section, or a repulsion that keeps them apart"
            }
            RejectionCause::Travel => "a smaller solver.step.initial and solver.step.min",
        };
        format!("try {fixed}{rest}")
    }

    /// Notes how much momentum there is; where that is no number, says whose.
    fn check_finite(&mut self) -> Result<(), RunError> {
        let momentum = self.momentum_size();
        self.counters.largest_momentum = self.counters.largest_momentum.max(momentum);
        let bad = |columns: &Columns| {
            if columns.is_finite() {
                return None;
            }
            (0..columns.len())
                .find_map(|i| columns.get(i).iter().copied().find(|x| !x.is_finite()).map(|value| (i as u32, value)))
        };
        let temperature = self.state.temperature.as_ref().and_then(|theta| {
            let i = theta.iter().position(|theta| !theta.is_finite())?;
            Some((i as u32, theta[i]))
        });
        let found = [("velocity", bad(&self.state.velocity)), ("position", bad(&self.state.position))]
            .into_iter()
            .chain([("temperature", temperature)])
            .find_map(|(quantity, found)| found.map(|(particle, value)| (quantity, particle, value)));
        match found {
            None => Ok(()),
            Some((quantity, particle, value)) => Err(RunError::NotFinite {
                time: self.time,
                particle,
                quantity,
                value,
                advice: self.advice(RejectionCause::NotFinite),
            }),
        }
    }

    /// Says something the first time it happens in a run.
    pub(crate) fn notice_once(&mut self, which: OnceNotice, level: Level, message: String) {
        let bit = 1 << which as u64;
        if self.notices_given & bit == 0 {
            self.notices_given |= bit;
            self.notices.push(Notice { level, message });
        }
    }
}
