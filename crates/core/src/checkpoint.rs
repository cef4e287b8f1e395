//! All that is needed to go on with a run, bit for bit.

use crate::collocation::Carried;
use crate::ledger::{Momentum, Totals};
use crate::state::{Columns, State};

/// All that is needed, beside the scene, to go on with a run bit for bit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// Time [s].
    pub time: f64,
    /// What the time is rounded by, so that equal steps add up exactly [s].
    pub time_rest: f64,
    /// Step number.
    pub step: u64,
    /// Next step size before it is clipped to the run's end [s].
    pub next_dt: f64,
    /// Positions, velocities, temperatures.
    pub state: State,
    /// Accelerations that the next step starts from [m/s^2]; empty columns where there are no fields.
    pub acceleration: Columns,
    /// Positions at which the neighbour lists were last built [m]; empty columns where there are none.
    pub list_positions: Columns,
    /// Accumulated energies and impulses.
    pub totals: Totals,
    /// Total energy at the start [J], against which the residual is taken.
    pub initial_energy: f64,
    /// Momentum at the start.
    pub initial_momentum: Momentum,
    /// Counters so far.
    pub counters: Counters,
    /// Bits of the notices that are given once per run and have been given.
    pub notices_given: u64,
    /// What the positions are relative to [m]; zero but for scenes far away.
    pub origin: [f64; 3],
    /// What a collocation scheme carries from step to step; `None` with other integrators.
    pub collocation: Option<Carried>,
}

/// Counters of a run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counters {
    /// Accepted steps.
    pub steps: u64,
    /// Iterations of accepted steps.
    pub iterations: u64,
    /// Rejected attempts.
    pub rejected_steps: u64,
    /// Impacts reported.
    pub impacts: u64,
    /// Pair distances evaluated for forces, each unordered pair once.
    pub pair_evaluations: u64,
    /// Recorded intervals so far, for scenes with `record.interval`.
    pub intervals: u64,
    /// Deepest overlap seen at a step's end [m].
    pub max_overlap: f64,
    /// Largest sum of m |v| at a step's end [kg m/s], against which momentum is judged.
    pub largest_momentum: f64,
}
