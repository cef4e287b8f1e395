//! What the solver says about one accepted step: iterations, errors, step control, rejected attempts.

/// Diagnostics of one accepted step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepDiagnostics {
    /// Step size that was accepted [s].
    pub dt: f64,
    /// Position error of every iteration K = 1, 2, .., equation (52) in `paper`, largest displacement over the mean
    /// diameter in `consistent` [-]. Its length is the number of iterations.
    pub position_errors: Vec<f64>,
    /// Temperature error of every iteration [-]; empty without `thermal`.
    pub temperature_errors: Vec<f64>,
    /// Violation ratio Z_K of the last iteration, equation (53) [-].
    pub violation: f64,
    /// Step scaling Phi_K, equation (54) [-].
    pub scaling: f64,
    /// Estimated contraction: last over last but one position error [-]; NaN with a single iteration.
    pub contraction: f64,
    /// Estimated local discretisation error over the mean diameter [-]; `None` in `paper`.
    pub local_error: Option<f64>,
    /// Attempts at this step that were rejected before, in order.
    pub rejected: Vec<RejectedAttempt>,
    /// Pairs (and particle-wall pairs) in contact and approaching, resting ones included.
    pub contacts: u64,
    /// Of those, taken as resting.
    pub resting: u64,
    /// Bonded pairs; `None` without binding.
    pub bonds: Option<u64>,
    /// Rounds of impacts solved at the step's end, or at its instants where impacts are located.
    pub rounds: u64,
    /// Largest approach speed that the step's impact instants left to contacts that touch [m/s]; `None` where impacts are not
    /// located.
    pub impact_residual: Option<f64>,
    /// Impact instants that ended otherwise than by their rule: rounds, sweeps or exchanges used up, or bodies that bounce no
    /// more in this step; `None` where impacts are not located.
    pub fallbacks: Option<u64>,
    /// Crossings of the cut-off and of the activation distance located in the step; `None` where no located force jumps.
    pub crossings: Option<u64>,
    /// Pair distances evaluated for forces during the step, rejected attempts included (each unordered pair once).
    pub pairs_evaluated: u64,
}

impl StepDiagnostics {
    /// Number of iterations K of the accepted attempt.
    #[must_use]
    pub fn iterations(&self) -> u64 {
        self.position_errors.len() as u64
    }
}

/// An attempt at a step that was given up.
#[derive(Clone, Debug, PartialEq)]
pub struct RejectedAttempt {
    /// Step size of the attempt [s].
    pub dt: f64,
    /// Why.
    pub cause: RejectionCause,
    /// Iterations spent.
    pub iterations: u64,
    /// Violation ratio reached [-].
    pub violation: f64,
    /// Particle with the largest change in the last iteration.
    pub particle: u32,
}

/// Why an attempt was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RejectionCause {
    /// K_d iterations without reaching the tolerance.
    NotConverged,
    /// A value stopped being a finite number.
    NotFinite,
    /// The local discretisation error exceeded the tolerance.
    LocalError,
    /// A particle would have moved too far for contacts to be seen.
    Travel,
}

/// How loud a notice is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// For information.
    Info,
    /// The user should know.
    Warning,
    /// The run failed.
    Error,
}

/// Something worth saying about the run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// How loud.
    pub level: Level,
    /// A sentence.
    pub message: String,
}
