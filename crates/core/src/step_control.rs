//! Step size: equations (51), (54), (55) steps 5 and 6, and in `consistent` the bound on the discretisation error.

use crate::assembly::step_limits;
use crate::convergence::{Convergence, Verdict};
use crate::diagnostics::RejectionCause;
use crate::scene::{ModelKind, Scene};

/// The paper's p: the contraction of the iteration goes like dt^2.
const P: f64 = 2.0;
/// Errors below this count as zero, and their field leaves the step alone (rule 2(b) of the reproduced tables).
const ZERO: f64 = 1e-14;
/// `consistent`: largest growth and shrinkage of a step, against chatter.
const GROWTH: f64 = 2.0;
/// The same for schemes of high order, whose first steps are far from what they can do.
const HIGH_ORDER_GROWTH: f64 = 4.0;
const SHRINKAGE: f64 = 0.2;
/// `consistent`: aim below the tolerance, so that few steps are rejected.
const SAFETY: f64 = 0.9;
/// Attempts at one step before the run is given up.
pub const MAX_ATTEMPTS: u64 = 60;
/// The share of the local error that the iteration may leave.
const ITERATION_SHARE: f64 = 0.01;
/// Moves of an iteration below this many mean diameters are round-off [-].
const STANDS_STILL: f64 = 1e-14;
/// `consistent`: no pair may come nearer than this share of the smallest diameter in one step, so that impacts found at
/// step ends are found early. A hundredth costs five times the steps and gains nothing that located impacts do not.
pub const TRAVEL_SHARE: f64 = 0.05;

/// Largest local error of an adaptive step, in mean diameters [-]: TOL, with schemes of second order TOL^(3/2). Their steps
/// then go like TOL^(1/2), and what adds up over a run goes like TOL, as it nearly does with schemes of high order.
#[must_use]
pub fn local_bound(scene: &Scene, order: u32) -> f64 {
    let tolerance = scene.solver.tolerance.position;
    let second = scene.model == ModelKind::Consistent && order == 2 && scene.solver.step.fixed.is_none();
    if second { tolerance.min(tolerance * tolerance.sqrt()) } else { tolerance }
}

/// Largest last move of an iteration: of positions over their measure, of temperatures [-].
#[must_use]
pub fn iteration_tolerance(scene: &Scene, order: u32) -> (f64, f64) {
    let (position, temperature) = (scene.solver.tolerance.position, scene.solver.tolerance.temperature);
    match scene.model {
        ModelKind::Paper => (position, temperature),
        ModelKind::Consistent => {
            let least = STANDS_STILL.min(ITERATION_SHARE * position);
            ((ITERATION_SHARE * local_bound(scene, order)).max(least), ITERATION_SHARE * temperature)
        }
    }
}

/// What to do with an attempt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// Keep it, and go on with this step [s].
    Accept {
        /// Next step [s].
        next_dt: f64,
    },
    /// Try again with a smaller step.
    Reject {
        /// Why.
        cause: RejectionCause,
        /// Step of the next attempt [s].
        retry_dt: f64,
    },
}

/// What an attempt at a step looked like.
#[derive(Clone, Copy, Debug)]
pub struct Attempt {
    /// Its step [s].
    pub dt: f64,
    /// How the iteration ended.
    pub verdict: Verdict,
    /// Local discretisation error over its bound, and where it is largest; `None` in `paper`.
    pub local_error: Option<Worst>,
    /// Largest approach of any pair over what contacts allow, and of whom; `None` without contacts or in `paper`.
    pub travel: Option<Worst>,
}

/// The largest of some quantity over the particles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Worst {
    /// How large [-].
    pub size: f64,
    /// Whose it is.
    pub particle: u32,
    /// Whose is the next largest, at least half as large.
    pub partner: Option<u32>,
}

impl Worst {
    /// The largest of values for particles 0, 1, ..; a NaN is larger than any number.
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut leaders = Leaders::default();
        for (i, size) in values.enumerate() {
            leaders.see(i, size);
        }
        leaders.worst()
    }

    /// Those it concerns.
    #[must_use]
    pub fn particles(&self) -> Vec<u32> {
        let mut particles: Vec<u32> = std::iter::once(self.particle).chain(self.partner).collect();
        particles.sort_unstable();
        particles
    }
}

/// The largest and the next largest of values seen so far, with whose they are.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Leaders {
    first: (f64, u32),
    second: (f64, u32),
}

impl Leaders {
    /// Sees the value of particle i; a NaN is larger than any number.
    #[inline(always)]
    pub(crate) fn see(&mut self, i: usize, size: f64) {
        if size <= self.second.0 {
            return;
        }
        let size = if size.is_nan() { f64::INFINITY } else { size };
        if size > self.first.0 {
            (self.first, self.second) = ((size, i as u32), self.first);
        } else if size > self.second.0 {
            self.second = (size, i as u32);
        }
    }

    pub(crate) fn worst(&self) -> Worst {
        let Self { first, second } = *self;
        let partner = (second.0 > 0.0 && second.0 >= 0.5 * first.0).then_some(second.1);
        Worst { size: first.0, particle: first.1, partner }
    }
}

/// Decides on attempts.
#[derive(Clone, Debug)]
pub struct StepControl {
    model: ModelKind,
    /// First step [s].
    pub initial: f64,
    /// Largest step dt_lim [s].
    pub max: f64,
    /// Smallest step [s].
    pub min: f64,
    /// Whether the step never changes.
    pub fixed: bool,
    iteration_tolerance: (f64, f64),
    max_iterations: f64,
    order: u32,
    /// Phi_K of the last attempt, equation (54) [-].
    pub scaling: f64,
}

impl StepControl {
    /// From a scene's `solver` section; `order` is the integrator's.
    #[must_use]
    pub fn new(scene: &Scene, order: u32) -> Self {
        let step = &scene.solver.step;
        let (initial, max, min) = step_limits(scene);
        Self {
            model: scene.model,
            initial,
            max,
            min,
            fixed: step.fixed.is_some(),
            iteration_tolerance: iteration_tolerance(scene, order),
            max_iterations: f64::from(scene.solver.max_iterations),
            order,
            scaling: 1.0,
        }
    }

    /// Decides on an attempt whose iteration errors are in `sweeps`.
    pub fn decide(&mut self, sweeps: &Convergence, attempt: &Attempt) -> Decision {
        let dt = attempt.dt;
        self.scaling = self.iteration_scaling(sweeps);
        match attempt.verdict {
            Verdict::NotFinite => return Decision::Reject { cause: RejectionCause::NotFinite, retry_dt: 0.25 * dt },
            Verdict::Exhausted | Verdict::Continue => {
                // Phi_K should be below one here; where it is not the same attempt would only be repeated.
                let scaling = if self.scaling < 0.9 { self.scaling.max(0.01) } else { 0.9 };
                return Decision::Reject { cause: RejectionCause::NotConverged, retry_dt: scaling * dt };
            }
            Verdict::Converged => {}
        }
        if self.fixed {
            return Decision::Accept { next_dt: dt };
        }
        let next_dt = match self.model {
            ModelKind::Paper => self.scaling * dt,
            ModelKind::Consistent => {
                let local = self.error_scaling(attempt.local_error.map_or(0.0, |error| error.size));
                let travel = attempt.travel.map_or(self.growth(), |travel| (SAFETY / travel.size).min(self.growth()));
                if attempt.local_error.is_some_and(|error| error.size > 1.0) {
                    return Decision::Reject { cause: RejectionCause::LocalError, retry_dt: local.min(0.9) * dt };
                }
                if travel < SAFETY {
                    return Decision::Reject { cause: RejectionCause::Travel, retry_dt: travel.clamp(0.01, 0.9) * dt };
                }
                let iteration = if sweeps.iterations() == 1 { self.growth() } else { self.scaling };
                local.min(travel).min(iteration).max(SHRINKAGE) * dt
            }
        };
        Decision::Accept { next_dt: next_dt.min(self.max).max(self.min) }
    }

    /// Phi_K of (54): the factor that would have met the tolerance in exactly K_d iterations.
    fn iteration_scaling(&self, sweeps: &Convergence) -> f64 {
        let k = sweeps.iterations();
        // Rule 2(b): a step that passes in one iteration is left alone.
        if k <= 1 {
            return 1.0;
        }
        let neutral = match self.model {
            ModelKind::Paper => 1.0,
            ModelKind::Consistent => self.growth(),
        };
        let (position, temperature) = self.iteration_tolerance;
        let field = |errors: &[f64], tolerance: f64| match (errors.first(), errors.last()) {
            (Some(&first), Some(&last)) if first > ZERO && last > ZERO => {
                libm::pow(tolerance / first, 1.0 / (P * self.max_iterations))
                    / libm::pow(last / first, 1.0 / (P * k as f64))
            }
            _ => neutral,
        };
        field(&sweeps.position, position).min(field(&sweeps.temperature, temperature))
    }

    /// The factor that brings the local error, which goes like dt^(order + 1), to the tolerance.
    fn error_scaling(&self, error: f64) -> f64 {
        if error == 0.0 {
            return self.growth();
        }
        (SAFETY * libm::pow(error, -1.0 / f64::from(self.order + 1))).clamp(SHRINKAGE, self.growth())
    }

    fn growth(&self) -> f64 {
        if self.order > 2 { HIGH_ORDER_GROWTH } else { GROWTH }
    }
}
