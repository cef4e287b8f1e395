//! The recorder's seam: who watches a run sees every accepted step here.

use crate::checkpoint::Checkpoint;
use crate::diagnostics::{Notice, StepDiagnostics};
use crate::impact::Impact;
use crate::ledger::{Ledger, Momentum};
use crate::state::{Particles, State};

/// Whether a run goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flow {
    /// Go on.
    Continue,
    /// Stop after this step; the run ends as interrupted.
    Stop,
}

/// An observer's own failure, such as a full disk; it ends the run.
pub type ObserverError = Box<dyn std::error::Error + Send + Sync>;

/// Watches a run. Called at the start (step 0) and after every accepted step, in order.
pub trait Observer {
    /// Sees a step.
    ///
    /// # Errors
    /// Whatever went wrong on the observer's side; the run stops with [`crate::RunError::Observer`].
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError>;

    /// Whether energies and clusters are wanted at the scene's recording cadence; otherwise only at start and end.
    fn wants_samples(&self) -> bool {
        true
    }

    /// Whether checkpoints are wanted.
    fn wants_checkpoints(&self) -> bool {
        true
    }
}

/// An observer that looks at nothing.
impl Observer for () {
    fn step(&mut self, _: &StepReport<'_>) -> Result<Flow, ObserverError> {
        Ok(Flow::Continue)
    }
    fn wants_samples(&self) -> bool {
        false
    }
    fn wants_checkpoints(&self) -> bool {
        false
    }
}

/// One accepted step, or the start.
#[derive(Clone, Copy, Debug)]
pub struct StepReport<'a> {
    /// Time at the step's end [s].
    pub time: f64,
    /// Number of the step; 0 is the start.
    pub step: u64,
    /// Radii, masses, charges.
    pub particles: &'a Particles,
    /// Positions, velocities, temperatures at the step's end.
    pub state: &'a State,
    /// Iterations and step control; `None` at the start.
    pub diagnostics: Option<&'a StepDiagnostics>,
    /// Impacts during the step; empty where there is no contact.
    pub impacts: &'a [Impact],
    /// Energies and clusters, on recorded steps: the start, the scene's cadence, and the end.
    pub sample: Option<&'a Sample>,
    /// All that is needed to go on from here, bit for bit, when one is due.
    pub checkpoint: Option<&'a Checkpoint>,
    /// Warnings and notable events of this step.
    pub notices: &'a [Notice],
}

/// Quantities computed on recorded steps only.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sample {
    /// Energies.
    pub ledger: Ledger,
    /// Momentum.
    pub momentum: Momentum,
    /// Clusters, where the scene has binding or names `clusters`.
    pub clusters: Option<Clusters>,
}

/// Connected components of bonded (or close) pairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clusters {
    /// Cluster of every particle, length n; numbered 0, 1, .. by their first member.
    pub of: Vec<u32>,
    /// Number of clusters of two particles or more.
    pub count: u32,
    /// Size of the largest cluster (1 where all are alone).
    pub largest: u32,
    /// Particles that are alone.
    pub singletons: u32,
    /// Mean size of clusters of two or more [-]; 0 where there is none.
    pub mean_size: f64,
}
