//! The staggered fixed-point iteration of one attempt at a step, (43)-(50) and (55) steps 1 to 4.
//!
//! Positions are solved for with temperatures held, temperatures with positions held, in turn, until both stand still.
//! In `consistent` temperatures act on motion through impacts only, which are solved at the step's end; they need no
//! iteration there and their errors are zero.

use crate::assembly::Model;
use crate::collocation::Collocation;
use crate::contact::Touch;
use crate::contact::latched::{LatchedContacts, Situation};
use crate::convergence::{Convergence, Verdict};
use crate::events::paths::Launch;
use crate::events::{Events, Laws};
use crate::scene::{ModelKind, SolutionMethod};
use crate::state::{Columns, Particles, State};
use nalgebra::Vector3;

/// What a step starts from.
#[derive(Clone, Copy, Debug)]
pub struct Start<'a> {
    /// Radii, masses, charges.
    pub particles: &'a Particles,
    /// r^L, v^L, theta^L.
    pub state: &'a State,
    /// a^L of the fields [m/s^2]; empty where there are none.
    pub acceleration: &'a Columns,
    /// t^L [s].
    pub time: f64,
}

/// Iterates of a step. Columns of effects that a scene does not have are empty.
#[derive(Clone, Debug)]
pub struct Stagger {
    /// r^K [m].
    pub position: Columns,
    pub(crate) previous_position: Columns,
    /// theta^K [K]; empty where temperatures are not iterated.
    pub temperature: Vec<f64>,
    previous_temperature: Vec<f64>,
    /// Forces of the field and from outside at r^(K-1) [N].
    pub field_force: Columns,
    /// Mean contact forces over the step [N]; `paper` only.
    pub contact_force: Columns,
    /// Reaction heat of every particle in the step [J]; empty without reaction.
    pub heat: Vec<f64>,
    /// Contacts of the step; `paper` only.
    pub latched: LatchedContacts,
    touches: Vec<Touch>,
    /// What located events add to positions at the step's end: (particle, metres).
    shifts: Vec<(usize, Vector3<f64>)>,
    /// Velocities and accelerations of an implicit integrator's parabolas; empty where there are no located events.
    path_velocity: Columns,
    path_acceleration: Columns,
    /// Errors of the iterations.
    pub sweeps: Convergence,
    /// Unordered pairs looked at for forces.
    pub pairs_evaluated: u64,
    /// Evaluations of all forces since the start or a resumption.
    pub evaluations: u64,
    /// The collocation scheme, where the integrator is one and something accelerates.
    pub collocation: Option<Box<Collocation>>,
}

impl Stagger {
    /// Space for n particles.
    #[must_use]
    pub fn new(model: &Model, n: usize, sweeps: Convergence) -> Self {
        let columns = |wanted: bool| Columns::zeros(if wanted { n } else { 0 });
        let values = |wanted: bool| vec![0.0; if wanted { n } else { 0 }];
        let latched = model.kind == ModelKind::Paper && model.contact.is_some();
        let coupled = model.kind == ModelKind::Paper && model.heat_capacity.is_some();
        let reacts = model.contact.as_ref().is_some_and(|contact| contact.reaction.is_some());
        Self {
            position: Columns::zeros(n),
            previous_position: Columns::zeros(n),
            temperature: values(coupled),
            previous_temperature: values(coupled),
            field_force: columns(model.has_forces()),
            contact_force: columns(latched),
            heat: values(latched && reacts),
            latched: LatchedContacts::default(),
            touches: Vec::new(),
            shifts: Vec::new(),
            path_velocity: Columns::default(),
            path_acceleration: Columns::default(),
            sweeps,
            pairs_evaluated: 0,
            evaluations: 0,
            collocation: (model.integrator.collocation.filter(|_| model.has_forces()))
                .map(|family| Box::new(Collocation::new(family, n))),
        }
    }

    /// Iterates until the errors pass or the attempt has to be given up. Events are located on the parabolas that the
    /// iteration found, then the iteration goes on with what they change.
    pub fn solve(&mut self, model: &mut Model, start: &Start<'_>, dt: f64, events: Option<&mut Events>) -> Verdict {
        if let Some(collocation) = &mut self.collocation {
            let end = (&mut self.position, &mut self.field_force);
            let (verdict, evaluations, pairs) = collocation.solve(model, start, dt, &mut self.sweeps, end);
            self.evaluations += evaluations;
            self.pairs_evaluated += pairs;
            return verdict;
        }
        self.predict(model, start, dt);
        if let Some(events) = events {
            // Explicit positions need no forces.
            if !model.integrator.is_explicit() {
                let verdict = self.iterate(model, start, dt);
                if verdict != Verdict::Converged {
                    return verdict;
                }
            }
            self.locate(model, start, dt, events);
        }
        self.iterate(model, start, dt)
    }

    fn iterate(&mut self, model: &mut Model, start: &Start<'_>, dt: f64) -> Verdict {
        loop {
            self.field_forces(model);
            self.contact_forces(model, start, dt);
            self.positions(model, start, dt);
            self.temperatures(model, start, dt);
            match self.note(start) {
                Verdict::Continue if model.method == SolutionMethod::Newton => self.correct(model, start, dt),
                Verdict::Continue => {}
                verdict => return verdict,
            }
        }
    }

    /// Events on the parabolas r^L + v tau + a tau^2/2 that end in the current iterate.
    fn locate(&mut self, model: &mut Model, start: &Start<'_>, dt: f64, events: &mut Events) {
        let explicit = model.integrator.is_explicit();
        if !explicit {
            self.find_paths(model, start, dt);
        }
        let (velocity, acceleration) = if explicit {
            (&start.state.velocity, start.acceleration)
        } else {
            (&self.path_velocity, &self.path_acceleration)
        };
        let (particles, position) = (start.particles, &start.state.position);
        let launch = Launch { particles, domain: &model.domain, position, velocity, acceleration, dt };
        if let Some(field) = &mut model.field {
            field.neighbors.prepare(position, &model.domain.periodic, || launch.travel());
        }
        let laws = Laws {
            contact: model.contact.as_ref(),
            field: model.field.as_ref(),
            integrator: &model.integrator,
            exchange: model.exchange.as_ref(),
            warmth: start.state.temperature.as_deref().zip(model.heat_capacity),
            time: start.time,
        };
        events.pass(&laws, &launch);
        self.shifts.extend(events.shifts.iter().map(|&(i, shift, _)| (i, shift)));
        for &(i, shift) in &self.shifts {
            self.position.add(i, shift);
        }
    }

    /// Parabolas of an implicit integrator: its mean acceleration, and the velocity that takes them to its r'.
    fn find_paths(&mut self, model: &Model, start: &Start<'_>, dt: f64) {
        let integrator = &model.integrator;
        let sum = integrator.position_sum();
        let (new, old) = (integrator.position_new / sum, integrator.position_old / sum);
        self.path_velocity.clone_from(&start.state.velocity);
        if start.acceleration.is_empty() {
            return;
        }
        self.path_acceleration.clone_from(start.acceleration);
        for i in 0..start.particles.len() {
            let mean = self.field_force.get(i) * (new / start.particles.mass[i]) + start.acceleration.get(i) * old;
            self.path_acceleration.set(i, mean);
            self.path_velocity.add(i, mean * ((sum - 0.5) * dt));
        }
    }

    /// r^0 = r^L + dt v^L + dt^2 a^L with the integrator's weights; theta^0 = theta^L.
    fn predict(&mut self, model: &Model, start: &Start<'_>, dt: f64) {
        self.sweeps.restart();
        self.latched.clear();
        self.shifts.clear();
        let weight = dt * dt * model.integrator.position_sum();
        let [r, v, a] = [&start.state.position, &start.state.velocity, start.acceleration].map(Columns::axes);
        for (axis, next) in self.position.axes_mut().into_iter().enumerate() {
            for (i, next) in next.iter_mut().enumerate() {
                *next = r[axis][i] + dt * v[axis][i];
            }
            for (next, a) in next.iter_mut().zip(a[axis]) {
                *next += weight * a;
            }
        }
        if let (false, Some(theta)) = (self.temperature.is_empty(), &start.state.temperature) {
            self.temperature.copy_from_slice(theta);
        }
    }

    /// Psi of the near field, binding and outside at r^(K-1).
    fn field_forces(&mut self, model: &mut Model) {
        std::mem::swap(&mut self.position, &mut self.previous_position);
        std::mem::swap(&mut self.temperature, &mut self.previous_temperature);
        if model.has_forces() {
            self.pairs_evaluated += model.forces(&self.previous_position, &mut self.field_force);
            self.evaluations += 1;
        }
    }

    /// Mean contact forces and reaction heat, from r^(K-1) and theta^(K-1); `paper` only.
    fn contact_forces(&mut self, model: &mut Model, start: &Start<'_>, dt: f64) {
        let (Some(law), Some(search), false) = (&model.contact, &mut model.search, self.contact_force.is_empty())
        else {
            return;
        };
        for axis in self.contact_force.axes_mut() {
            axis.fill(0.0);
        }
        self.heat.fill(0.0);
        search.touching(&self.previous_position, start.particles, &model.domain, &mut self.touches);
        let situation = Situation {
            particles: start.particles,
            domain: &model.domain,
            position: &self.previous_position,
            velocity: &start.state.velocity,
            field_force: (!self.field_force.is_empty()).then_some(&self.field_force),
            temperature: (!self.temperature.is_empty()).then_some(&self.previous_temperature),
        };
        self.latched.latch(&self.touches, &situation);
        let heat = (!self.heat.is_empty()).then_some(self.heat.as_mut_slice());
        self.latched.act(law, &situation, dt, &mut self.contact_force, heat);
    }

    /// r^K = r^L + dt v^L + dt^2/m Psi(r^(K-1)), equation (50), with the integrator's weights.
    fn positions(&mut self, model: &Model, start: &Start<'_>, dt: f64) {
        let integrator = &model.integrator;
        let (new, old) = (dt * dt * integrator.position_new, dt * dt * integrator.position_old);
        let contact = dt * dt * integrator.position_sum();
        let mass = &start.particles.mass;
        let [r, v, a] = [&start.state.position, &start.state.velocity, start.acceleration].map(Columns::axes);
        let (field, contacts) = (self.field_force.axes(), self.contact_force.axes());
        for (axis, next) in self.position.axes_mut().into_iter().enumerate() {
            for (i, next) in next.iter_mut().enumerate() {
                *next = r[axis][i] + dt * v[axis][i];
            }
            for (i, (next, force)) in next.iter_mut().zip(field[axis]).enumerate() {
                *next += new * (force / mass[i]) + old * a[axis][i];
            }
            for (i, (next, force)) in next.iter_mut().zip(contacts[axis]).enumerate() {
                *next += contact * (force / mass[i]);
            }
        }
        for &(i, shift) in &self.shifts {
            self.position.add(i, shift);
        }
    }

    /// theta^K from theta^L by reaction heat (38) and exchange (42); `paper` only.
    fn temperatures(&mut self, model: &Model, start: &Start<'_>, dt: f64) {
        let (false, Some(theta)) = (self.temperature.is_empty(), &start.state.temperature) else { return };
        self.temperature.copy_from_slice(theta);
        self.add_heat(model, start.particles);
        if let Some(exchange) = &model.exchange {
            exchange.advance(dt, &mut self.temperature);
        }
    }

    /// Stage I, equation (38).
    fn add_heat(&mut self, model: &Model, particles: &Particles) {
        let Some(capacity) = model.heat_capacity else { return };
        for ((theta, heat), mass) in self.temperature.iter_mut().zip(&self.heat).zip(&particles.mass) {
            *theta += heat / (mass * capacity);
        }
    }

    /// Errors of iteration K.
    fn note(&mut self, start: &Start<'_>) -> Verdict {
        let temperatures = if self.temperature.is_empty() {
            // Not iterated: the error is zero, and said to be.
            start.state.temperature.is_some().then_some((&[][..], &[][..]))
        } else {
            Some((self.previous_temperature.as_slice(), self.temperature.as_slice()))
        };
        self.sweeps.note((&self.previous_position, &self.position), temperatures)
    }

    /// The up to two particles that moved most in the last iteration.
    #[must_use]
    pub fn most_moved(&self) -> Vec<u32> {
        let mut moved: Vec<(f64, u32)> = (0..self.position.len())
            .map(|i| ((self.position.get(i) - self.previous_position.get(i)).norm(), i as u32))
            .collect();
        // NaN counts as most; equal moves in order of number.
        moved.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        moved.iter().take(2).filter(|(size, _)| *size > 0.0 || size.is_nan()).map(|&(_, i)| i).collect()
    }
}
