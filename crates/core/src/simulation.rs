//! A run: from a scene to its end, one accepted step after another.

use crate::checkpoint::{Checkpoint, Counters};
use crate::error::{RunError, SetupError};
use crate::observer::{Observer, Sample};
use crate::scene::Scene;
use crate::state::{Particles, State};

/// A scene being solved.
#[derive(Debug)]
pub struct Simulation {
    particles: Particles,
    state: State,
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
    /// What cannot be simulated, with JSON pointers: overlaps, missing charges, a cube that cannot be filled.
    pub fn new(scene: &Scene) -> Result<Self, SetupError> {
        let _ = scene;
        unimplemented!()
    }

    /// Sets a scene up at a checkpoint of an earlier run of it.
    ///
    /// # Errors
    /// As [`Simulation::new`], and a checkpoint that does not fit the scene.
    pub fn resume(scene: &Scene, checkpoint: &Checkpoint) -> Result<Self, SetupError> {
        let _ = (scene, checkpoint);
        unimplemented!()
    }

    /// Runs to the scene's duration, or to where the observer stops it. The observer sees the start as step 0 (not
    /// after [`Simulation::resume`]) and then every accepted step.
    ///
    /// # Errors
    /// A step that cannot be completed, a value that stops being finite, a failing observer.
    pub fn run(&mut self, observer: &mut dyn Observer) -> Result<Outcome, RunError> {
        let _ = observer;
        unimplemented!()
    }

    /// Radii, masses, charges.
    #[must_use]
    pub fn particles(&self) -> &Particles {
        &self.particles
    }

    /// Positions, velocities, temperatures now.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.state
    }
}
