//! A run: from a scene to its end, one accepted step after another.

use crate::assembly::{Model, locates};
use crate::checkpoint::{Checkpoint, Counters};
use crate::contact::Touch;
use crate::diagnostics::{Level, Notice, StepDiagnostics};
use crate::error::{RunError, SetupError};
use crate::events::Events;
use crate::frame;
use crate::impact::Impact;
use crate::ledger::{Momentum, Totals, kinetic_energy};
use crate::observer::{Flow, Observer, Sample, StepReport};
use crate::placement;
use crate::scene::{ModelKind, Problem, Record, Scene};
use crate::stagger::Stagger;
use crate::state::{Columns, Particles, State};
use crate::step_control::{StepControl, local_bound};
use nalgebra::Vector3;

/// A run ends when less than this share of a step is left [-].
const END: f64 = 1e-6;
/// A residual above this share of the energies in motion is warned of [-].
const LARGE_RESIDUAL: f64 = 0.1;
/// An overlap above this share of the smallest diameter is warned of [-].
const DEEP_OVERLAP: f64 = 0.2;

/// A scene being solved.
#[derive(Debug)]
pub struct Simulation {
    pub(crate) model: Model,
    pub(crate) control: StepControl,
    pub(crate) stagger: Stagger,
    /// Events within steps; `None` where the scene has none or leaves impacts to step ends.
    pub(crate) events: Option<Events>,
    pub(crate) particles: Particles,
    pub(crate) state: State,
    pub(crate) previous_velocity: Columns,
    pub(crate) previous_totals: Totals,
    pub(crate) acceleration: Columns,
    pub(crate) touches: Vec<Touch>,
    /// Whether `touches` are those of the current positions.
    pub(crate) touches_known: bool,
    pub(crate) impacts: Vec<Impact>,
    pub(crate) notices: Vec<Notice>,
    pub(crate) diagnostics: StepDiagnostics,
    pub(crate) totals: Totals,
    pub(crate) counters: Counters,
    pub(crate) initial_energy: f64,
    /// Kinetic energy at the scene's start [J].
    initial_kinetic: f64,
    pub(crate) initial_momentum: Momentum,
    pub(crate) notices_given: u64,
    pub(crate) time: f64,
    /// What `time` is rounded by [s].
    pub(crate) time_rest: f64,
    pub(crate) next_dt: f64,
    pub(crate) duration: f64,
    /// Largest local error of a step [mean diameters].
    pub(crate) local_bound: f64,
    record: Record,
    /// Whether the observer has seen the start.
    started: bool,
    /// What positions are relative to while they are computed [m].
    pub(crate) origin: Vector3<f64>,
    /// The state in the scene's coordinates, where these are others.
    shown: Option<State>,
}

/// Notices that are given once in a run; their bits are kept in checkpoints, so numbers are never reused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OnceNotice {
    /// What the model is known to get wrong, or takes as resting.
    Model = 0,
    /// First resting contact.
    Resting = 1,
    /// A fixed step too long for contacts.
    Travel = 2,
    /// Energy that nothing explains.
    Residual = 3,
    /// Particles deep inside each other.
    Overlap = 4,
    /// First contact step.
    ContactStep = 5,
}

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ending {
    /// At the scene's duration.
    Finished,
    /// Where the observer asked it to.
    Stopped,
}

/// What a run amounted to.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// Time reached [s].
    pub time: f64,
    /// Counters.
    pub counters: Counters,
    /// Energies, momentum and clusters at the end.
    pub sample: Sample,
}

impl Simulation {
    /// Sets a scene up. `particles.file` and `particles.log` must have been resolved into `particles.list` before.
    ///
    /// # Errors
    /// What cannot be simulated, with JSON pointers: what [`Scene::validate`] finds, overlaps, missing charges, a cube
    /// that cannot be filled.
    pub fn new(scene: &Scene) -> Result<Self, SetupError> {
        let (particles, state) = placement::place(scene)?;
        let mut simulation = Self::assemble(scene, particles, state);
        simulation.start();
        Ok(simulation)
    }

    /// Sets a scene up at a checkpoint of an earlier run of it.
    ///
    /// # Errors
    /// As [`Simulation::new`], and a checkpoint that does not fit the scene.
    pub fn resume(scene: &Scene, checkpoint: &Checkpoint) -> Result<Self, SetupError> {
        // Lists and decisions that depend on the start must see the start, not the checkpoint.
        let (particles, state) = placement::place(scene)?;
        let mut simulation = Self::assemble(scene, particles, state);
        simulation.restore(checkpoint)?;
        Ok(simulation)
    }

    fn assemble(scene: &Scene, particles: Particles, mut state: State) -> Self {
        let n = particles.len();
        let origin = frame::origin(scene, &particles, &state.position);
        let shown = (origin != Vector3::zeros()).then(|| state.clone());
        state.position.shift(-origin);
        let model = Model::new(scene, &particles, &state.position);
        let control = StepControl::new(scene, model.integrator.order);
        let stagger = Stagger::new(&model, n, model.convergence(scene));
        Self {
            next_dt: control.initial,
            acceleration: Columns::zeros(if model.has_forces() { n } else { 0 }),
            previous_velocity: Columns::zeros(n),
            previous_totals: Totals::default(),
            events: Events::wanted(model.contact.as_ref(), model.field.as_ref().filter(|_| locates(scene)))
                .then(|| Events::new(&frame::order(&particles, &state.position))),
            touches: Vec::new(),
            touches_known: false,
            impacts: Vec::new(),
            notices: Vec::new(),
            diagnostics: StepDiagnostics::default(),
            totals: Totals::default(),
            counters: Counters::default(),
            initial_energy: 0.0,
            initial_kinetic: kinetic_energy(&particles, &state),
            initial_momentum: Momentum::default(),
            notices_given: 0,
            time: 0.0,
            time_rest: 0.0,
            duration: scene.duration,
            local_bound: local_bound(scene, model.integrator.order),
            record: scene.record.clone(),
            started: false,
            origin,
            shown,
            model,
            control,
            stagger,
            particles,
            state,
        }
    }

    /// Accelerations, energy and momentum at the start.
    fn start(&mut self) {
        if self.model.has_forces() {
            let mut force = Columns::zeros(self.particles.len());
            self.counters.pair_evaluations = self.model.forces(&self.state.position, &mut force);
            for i in 0..self.particles.len() {
                self.acceleration.set(i, force.get(i) / self.particles.mass[i]);
            }
        }
        self.counters.largest_momentum = self.momentum_size();
        let sample = self.sample();
        self.initial_energy = sample.ledger.residual;
        self.initial_momentum = sample.momentum;
        if self.particles.charge.is_some() && !self.model.uses_charges() {
            self.notices.push(Notice {
                level: Level::Warning,
                message: "particles carry charges, but nothing in the scene acts on them: near_field.weight \
                    `charge-product` or external.electric_field would"
                    .to_owned(),
            });
        }
        let message = match (self.model.kind, &self.model.contact) {
            (_, None) => return,
            (ModelKind::Paper, Some(_)) => "model `paper` reproduces the paper's scheme with its known failures: \
                resting contacts creep into each other and are heated again at every step, so the reaction heat has no \
                limit as the step goes to zero; fast pairs can pass through each other; model `consistent` has a limit"
                .to_owned(),
            (ModelKind::Consistent, Some(law)) if law.located => return,
            (ModelKind::Consistent, Some(law)) => format!(
                "impacts happen at the ends of time steps; approaches slower than contact.rest_speed = {} m/s, or than \
                 twice what the fields add in a step, are taken as resting (e = 0, no heat)",
                law.rest_speed
            ),
        };
        let level = if self.model.kind == ModelKind::Paper { Level::Warning } else { Level::Info };
        self.notice_once(OnceNotice::Model, level, message);
    }

    fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), SetupError> {
        let n = self.particles.len();
        let fits = checkpoint.state.position.len() == n
            && checkpoint.state.velocity.len() == n
            && checkpoint.state.temperature.as_ref().map(Vec::len) == self.state.temperature.as_ref().map(Vec::len)
            && checkpoint.acceleration.len() == self.acceleration.len();
        if !fits {
            let held = checkpoint.state.position.len();
            return Err(Problem::new(
                "/particles",
                format!("the checkpoint holds {held} particles with other columns than the scene's {n}"),
            )
            .into());
        }
        let Checkpoint {
            time,
            time_rest,
            step: _, // counted by counters.steps
            next_dt,
            state,
            acceleration,
            list_positions,
            totals,
            initial_energy,
            initial_momentum,
            counters,
            notices_given,
            collocation,
            origin,
        } = checkpoint.clone();
        let moved = Vector3::from(origin) - self.origin;
        let (mut state, mut list_positions) = (state, list_positions);
        state.position.shift(moved);
        list_positions.shift(moved);
        let restored = match (&mut self.stagger.collocation, &collocation) {
            (Some(own), Some(carried)) => own.restore(carried),
            (own, carried) => own.is_none() && carried.is_none(),
        };
        if !restored {
            return Err(Problem::new("/solver/integrator", "the checkpoint is of another integrator").into());
        }
        if let Some(field) = &mut self.model.field
            && list_positions.len() == n
        {
            field.rebuild_lists(&list_positions);
        }
        (self.time, self.time_rest, self.next_dt) = (time, time_rest, next_dt);
        (self.state, self.acceleration) = (state, acceleration);
        (self.totals, self.initial_energy, self.initial_momentum) = (totals, initial_energy, initial_momentum);
        (self.counters, self.notices_given) = (counters, notices_given);
        self.started = true;
        self.show();
        Ok(())
    }

    /// All that is needed to go on from here, bit for bit.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        let built_at = self.model.field.as_ref().and_then(|field| field.neighbors.built_at());
        Checkpoint {
            time: self.time,
            time_rest: self.time_rest,
            step: self.counters.steps,
            next_dt: self.next_dt,
            state: self.state.clone(),
            acceleration: self.acceleration.clone(),
            list_positions: built_at.cloned().unwrap_or_default(),
            totals: self.totals,
            initial_energy: self.initial_energy,
            initial_momentum: self.initial_momentum,
            counters: self.counters,
            notices_given: self.notices_given,
            collocation: self.stagger.collocation.as_ref().map(|collocation| collocation.carried()),
            origin: self.origin.into(),
        }
    }

    /// Evaluations of all forces since the start or a resumption, rejected attempts included.
    #[must_use]
    pub fn force_evaluations(&self) -> u64 {
        self.stagger.evaluations
    }

    /// Runs to the scene's duration, or to where the observer stops it. The observer sees the start as step 0 (not
    /// after [`Simulation::resume`]) and then every accepted step.
    ///
    /// # Errors
    /// A step that cannot be completed, a value that stops being finite, a failing observer.
    pub fn run(&mut self, observer: &mut dyn Observer) -> Result<Outcome, RunError> {
        let mut flow = Flow::Continue;
        if !self.started {
            self.started = true;
            flow = self.report(observer, true)?;
        }
        while flow == Flow::Continue && !self.finished() {
            self.step()?;
            flow = self.report(observer, false)?;
        }
        Ok(Outcome {
            ending: if self.finished() { Ending::Finished } else { Ending::Stopped },
            time: self.time,
            counters: self.counters,
            sample: self.sample(),
        })
    }

    fn finished(&self) -> bool {
        self.duration - self.time < END * self.next_dt.min(self.duration)
    }

    fn report(&mut self, observer: &mut dyn Observer, start: bool) -> Result<Flow, RunError> {
        self.show();
        let due = self.recording_due() && observer.wants_samples();
        let sample = (start || due || self.finished()).then(|| self.sample());
        if let Some(sample) = &sample {
            self.judge(sample)?;
        }
        let checkpoint = (self.checkpoint_due(start) && observer.wants_checkpoints()).then(|| self.checkpoint());
        observer
            .step(&StepReport {
                time: self.time,
                step: self.counters.steps,
                particles: &self.particles,
                state: self.state(),
                diagnostics: (!start).then_some(&self.diagnostics),
                impacts: &self.impacts,
                sample: sample.as_ref(),
                checkpoint: checkpoint.as_ref(),
                notices: &self.notices,
            })
            .map_err(RunError::Observer)
    }

    /// Takes what is reported of a step back to the scene's coordinates.
    fn show(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        shown.clone_from(&self.state);
        shown.position.shift(self.origin);
        for impact in &mut self.impacts {
            impact.position = (Vector3::from(impact.position) + self.origin).into();
        }
    }

    /// Refuses energies that are no numbers, and warns of errors that a user must know of.
    fn judge(&mut self, sample: &Sample) -> Result<(), RunError> {
        let ledger = &sample.ledger;
        let (energy, lost) = (ledger.balance(), ledger.totals.impact_loss + ledger.totals.friction_loss);
        if !energy.is_finite() {
            let speed = |i: &u32| self.state.velocity.get(*i as usize).norm();
            let fastest = (0..self.particles.len() as u32).max_by(|a, b| speed(a).total_cmp(&speed(b)));
            return Err(RunError::NotFinite {
                time: self.time,
                particle: fastest.unwrap_or(0),
                quantity: "energy (this is the fastest)",
                value: energy,
                advice:
                    "try smaller velocities, distances, ranges or strengths: their squares and powers must be numbers"
                        .to_owned(),
            });
        }
        if self.model.kind == ModelKind::Paper {
            return Ok(()); // Its errors are said at the start.
        }
        let moving = ledger.kinetic.max(lost).max(ledger.totals.resting_loss);
        if self.counters.steps > 0 && ledger.residual.abs() > LARGE_RESIDUAL * moving.max(self.initial_kinetic) {
            let (residual, time) = (ledger.residual, self.time);
            let message = format!(
                "the energy residual is {residual:.3e} J at t = {time} s, more than a tenth of the kinetic energy and what \
                 impacts took: a smaller solver.tolerance.position or step would resolve the motion"
            );
            self.notice_once(OnceNotice::Residual, Level::Warning, message);
        }
        let overlap = self.counters.max_overlap / self.model.smallest_diameter;
        if overlap > DEEP_OVERLAP {
            let message = format!(
                "particles (or a particle and a wall) overlap by {overlap:.2} of the smallest diameter at t = {} s: impacts \
                 are found at step ends; a smaller solver.step.max finds them earlier",
                self.time
            );
            self.notice_once(OnceNotice::Overlap, Level::Warning, message);
        }
        Ok(())
    }

    /// Whether the scene's cadence records this step.
    fn recording_due(&mut self) -> bool {
        if let Some(interval) = self.record.interval {
            // A step that ends on a multiple within round-off counts as having reached it.
            let reached = (self.time / interval + 1e-9).floor() as u64;
            // Beyond 2^53 the count is no longer exact, and every step is past the next multiple.
            let due = reached > self.counters.intervals || reached >= 1 << 53;
            self.counters.intervals = reached;
            return due;
        }
        self.counters.steps.is_multiple_of(self.record.every_steps.unwrap_or(1))
    }

    /// Whether a run that is here writes a checkpoint; `start`: of a run that has not gone anywhere yet.
    #[must_use]
    pub fn checkpoint_due(&self, start: bool) -> bool {
        let left = self.duration - self.time;
        let before_clipped = !self.finished() && left < self.next_dt;
        start || before_clipped || self.counters.steps.is_multiple_of(self.record.checkpoint_every)
    }

    /// Moves the end of the run, so that [`Simulation::run`] goes on to `duration` [s], or stops there.
    pub fn set_duration(&mut self, duration: f64) {
        self.duration = duration;
    }

    /// Radii, masses, charges.
    #[must_use]
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Positions, velocities, temperatures now.
    #[must_use]
    pub fn state(&self) -> &State {
        self.shown.as_ref().unwrap_or(&self.state)
    }

    /// Time now [s].
    #[must_use]
    pub fn time(&self) -> f64 {
        self.time
    }
}
