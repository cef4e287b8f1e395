//! Contacts of an accepted step: impacts located within it, latched over it, or resolved at its end.

use crate::contact::resolve::{Bodies, Resolution, lift, resolve};
use crate::diagnostics::Level;
use crate::error::RunError;
use crate::events::Laws;
use crate::events::paths::Launch;
use crate::force::Field;
use crate::impact::Partner;
use crate::scene::ModelKind;
use crate::simulation::{OnceNotice, Simulation};

impl Simulation {
    /// Impacts at step ends: keeps pressed contacts from sinking in a step of dt, whatever an earlier attempt did.
    pub(super) fn lift_resting(&mut self, dt: f64) {
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

    /// Collocation with located impacts: what touches now is solved now, and the next step starts afresh.
    pub(super) fn strike(&mut self) -> Result<(), RunError> {
        let (Some(collocation), Some(law), Some(events)) =
            (&mut self.stagger.collocation, self.model.contact.as_ref().filter(|law| law.located), &mut self.events)
        else {
            return Ok(());
        };
        let laws = Laws {
            contact: None,
            field: None,
            integrator: &self.model.integrator,
            exchange: self.model.exchange.as_ref(),
            warmth: self.state.temperature.as_deref().zip(self.model.heat_capacity),
            time: self.time,
        };
        // The time in which all further bounces must be over for a contact to be at rest.
        let dt = self.control.min.max(f64::EPSILON * self.time);
        let (position, velocity) = (&self.state.position, &self.state.velocity);
        let (particles, domain, acceleration) = (&self.particles, &self.model.domain, &self.acceleration);
        let launch = Launch { particles, domain, position, velocity, acceleration, dt };
        let bounced = events.strike(law, &laws, &launch).map_err(|(i, partner)| RunError::Resting {
            time: self.time,
            particle: i as u32,
            partner,
        })?;
        if !bounced.is_empty() {
            collocation.break_off();
        }
        for (i, v, theta) in bounced {
            self.state.velocity.set(i, v);
            if let (Some(column), Some(theta)) = (&mut self.state.temperature, theta) {
                column[i] = theta;
            }
        }
        self.report_impacts();
        Ok(())
    }

    /// Located events have happened during the step.
    pub(super) fn report_events(&mut self) {
        let Some(events) = &self.events else { return };
        let jumps = self.model.field.as_ref().is_some_and(Field::jumps);
        self.diagnostics.crossings = jumps.then(|| events.crossings());
        self.report_impacts();
    }

    /// Located impacts, and their books.
    fn report_impacts(&mut self) {
        let Some(events) = &mut self.events else { return };
        let known = self.impacts.len();
        self.impacts.append(&mut events.reports);
        let booked = events.booked;
        let contact_step = events.contact_step();
        self.diagnostics.contacts = booked.contacts;
        self.diagnostics.resting = booked.resting;
        self.diagnostics.rounds = booked.rounds;
        if self.model.contact.as_ref().is_some_and(|law| law.located) {
            self.diagnostics.impact_residual = Some(booked.residual);
            self.diagnostics.fallbacks = Some(booked.fallbacks);
        }
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
        self.book_impacts(known);
    }

    /// `paper`: contacts acted during the step.
    pub(super) fn report_latched(&mut self) {
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
        self.book_impacts(0);
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
    pub(super) fn resolve_impacts(&mut self, dt: f64) {
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
        self.book_impacts(0);
    }

    pub(super) fn book_resting(&mut self, resolution: &Resolution) {
        self.totals.resting_loss += resolution.resting_loss;
        for k in 0..3 {
            self.totals.outside_impulse[k] += resolution.wall_impulse[k];
        }
    }

    /// The losses and heat of the step's impacts from a number on.
    fn book_impacts(&mut self, from: usize) {
        for impact in &self.impacts[from..] {
            self.totals.impact_loss += impact.normal_loss();
            self.totals.friction_loss += impact.friction_loss();
            let hit = if matches!(impact.partner, Partner::Particle(_)) { 2.0 } else { 1.0 };
            self.totals.reaction_heat += hit * impact.heat;
        }
    }
}
