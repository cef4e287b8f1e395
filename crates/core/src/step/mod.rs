//! One step of the solver, as the paper's loop (55) has it: attempts, until one is accepted.

mod contacts;
mod estimate;
mod finish;
mod refuse;

use crate::convergence::Verdict;
use crate::diagnostics::{Level, Notice, StepDiagnostics};
use crate::error::RunError;
use crate::events::Events;
use crate::events::paths::Launch;
use crate::events::restarts::{BEYOND, first_crossing, first_impact};
use crate::force::Field;
use crate::scene::ModelKind;
use crate::simulation::{OnceNotice, Simulation};
use crate::stagger::Start;
use crate::step_control::{Attempt, Decision};

/// Solutions of one step that look for the crossing at which it ends.
const MOST_CUTS: u32 = 8;
/// Lengths that differ by no more than this share are the same [-].
const SAME_LENGTH: f64 = 1e-10;
/// The same where velocities jump, which cost an error of first order in the difference [-].
const SAME_IMPACT: f64 = 1e-14;

impl Simulation {
    /// One accepted step from t to t + dt, dt at most what is left of the run.
    pub(crate) fn step(&mut self) -> Result<(), RunError> {
        let left = self.duration - self.time;
        let mut dt = self.next_dt.min(left).min(self.longest_flight());
        self.begin_step();
        if self.counters.steps == 0 {
            self.strike()?;
        }
        // Solutions of this attempt that ended at a jump of a force.
        let mut cuts = 0;
        loop {
            self.lift_resting(dt);
            let (particles, state, acceleration) = (&self.particles, &self.state, &self.acceleration);
            let start = Start { particles, state, acceleration, time: self.time };
            let verdict = self.stagger.solve(&mut self.model, &start, dt, self.events.as_mut());
            if let Some(shorter) = self.restart(dt, verdict, cuts) {
                (dt, cuts) = (shorter, cuts + 1);
                continue;
            }
            let attempt = self.attempt(dt, verdict);
            match self.control.decide(&self.stagger.sweeps, &attempt) {
                Decision::Accept { next_dt } => {
                    // The last step is clipped; what would have followed is kept for a run that goes on.
                    let clipped = left < self.next_dt && dt == left;
                    if cuts > 0 {
                        self.next_dt = self.after_cut(dt, next_dt);
                    } else if !clipped {
                        let whole = if self.control.fixed { self.control.initial } else { next_dt };
                        self.next_dt = whole.max(self.smallest_step());
                    }
                    return self.accept(&attempt, cuts > 0);
                }
                Decision::Reject { cause, retry_dt } => (dt, cuts) = (self.reject(cause, &attempt, retry_dt)?, 0),
            }
        }
    }

    /// Collocation: the length of the step that ends where a force or a velocity first jumps, if that is another than dt [s].
    fn restart(&mut self, dt: f64, verdict: Verdict, cuts: u32) -> Option<f64> {
        let collocation = self.stagger.collocation.as_ref()?;
        let jumps = self.model.field.as_ref().is_some_and(Field::jumps);
        let located = self.model.contact.as_ref().is_some_and(|law| law.located);
        if !(jumps || located) || verdict == Verdict::NotFinite || cuts == MOST_CUTS {
            return None;
        }
        let (particles, state, acceleration) = (&self.particles, &self.state, &self.acceleration);
        let start = Start { particles, state, acceleration, time: self.time };
        let (position, velocity, domain) = (&state.position, &state.velocity, &self.model.domain);
        let launch = Launch { particles, domain, position, velocity, acceleration, dt };
        let paths = collocation.paths(&start, dt);
        let crossing = self.model.field.as_mut().filter(|_| jumps).and_then(|field| {
            field.neighbors.prepare(position, &domain.periodic, || BEYOND * launch.travel());
            first_crossing(field, &launch, &paths)
        });
        let impact = located.then(|| first_impact(&launch, &paths)).flatten();
        let (at, same) = match (crossing, impact) {
            (Some(crossing), impact) if impact.is_none_or(|impact| crossing < impact) => (crossing, SAME_LENGTH),
            (_, impact) => (impact?, SAME_IMPACT),
        };
        // Beyond a whole step nothing matters yet.
        let ends_there = (at - 1.0).abs() <= same || (at > 1.0 && cuts == 0);
        // Cuts may be shorter than the smallest step, as long as they move the time.
        (!ends_there).then(|| (at * dt).max(f64::EPSILON * self.time))
    }

    /// The step after one that a jump cut to dt: what was planned, or the rest of a fixed one [s].
    fn after_cut(&self, dt: f64, proposed: f64) -> f64 {
        if self.control.fixed {
            let rest = self.next_dt - dt;
            return if rest > f64::EPSILON * self.time { rest } else { self.control.initial };
        }
        let planned = if self.diagnostics.rejected.is_empty() { self.next_dt } else { 0.0 };
        proposed.max(planned).max(self.smallest_step())
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

    /// Takes the last iterate as the new state, then exchange, impacts, books.
    fn accept(&mut self, attempt: &Attempt, cut: bool) -> Result<(), RunError> {
        let dt = attempt.dt;
        self.advance_time(dt);
        self.move_particles(dt);
        if let Some(collocation) = &mut self.stagger.collocation {
            if cut {
                collocation.break_off();
            }
            let jumps = self.model.field.as_ref().is_some_and(Field::jumps);
            self.diagnostics.crossings = jumps.then_some(u64::from(cut));
        }
        self.exchange_heat(dt);
        match (self.model.kind, &self.model.contact) {
            (ModelKind::Paper, _) => self.report_latched(),
            (ModelKind::Consistent, Some(law)) if !law.located => self.resolve_impacts(dt),
            (ModelKind::Consistent, _) if self.stagger.collocation.is_some() => self.strike()?,
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

    /// Says something the first time it happens in a run.
    pub(crate) fn notice_once(&mut self, which: OnceNotice, level: Level, message: String) {
        let bit = 1 << which as u64;
        if self.notices_given & bit == 0 {
            self.notices_given |= bit;
            self.notices.push(Notice { level, message });
        }
    }
}
