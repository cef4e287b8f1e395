//! What errors are measured against: two solutions of high order, and the time until which they agree.

use agglo_core::scene::{IntegratorKind, SolutionMethod};
use agglo_core::{RunError, Scene, SetupError, Simulation};

use crate::measure::{Errors, Watch, run};
use crate::plan::{Case, Control, Scheme};

/// Tolerances of the reference and of the run that it is compared with [mean diameters].
const TOLERANCES: [f64; 2] = [1e-13, 1e-11];
/// Largest difference of the two for which errors are still measured [mean diameters].
const AGREEMENT: f64 = 1e-9;
/// Parts of the duration after each of which the two are compared.
const PARTS: u32 = 16;

/// The reference.
#[derive(Clone, Debug)]
pub struct References {
    /// End of the time over which errors are measured [s].
    pub until: f64,
    /// Whether that is the scene's duration.
    pub whole: bool,
    /// Whether a contact comes to rest soon after it.
    pub rests: bool,
    /// Difference of the two references at that time: how well the reference itself is known.
    pub uncertainty: Errors,
    /// The reference's end state and impacts.
    pub(crate) end: Watch,
    /// Force evaluations of the reference.
    pub evaluations: u64,
}

/// A reference that could not be had.
#[derive(Debug)]
pub enum ReferenceError {
    /// The scene cannot be set up.
    Setup(SetupError),
    /// A run failed.
    Run(RunError),
    /// The two part before the first comparison: time [s], their difference [mean diameters].
    Parted(f64, f64),
}

impl std::fmt::Display for ReferenceError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Setup(error) => write!(f, "{error}"),
            Self::Run(error) => write!(f, "the reference failed: {error}"),
            Self::Parted(time, difference) => write!(
                f,
                "two references of order 15 already differ by {difference:.1e} mean diameters at t = {time} s, so there is \
                 nothing to measure errors against"
            ),
        }
    }
}

impl std::error::Error for ReferenceError {}

impl References {
    /// Solves the scene twice by Gauss-Radau collocation of order 15, and looks how long the two agree and no contact comes to
    /// rest.
    ///
    /// # Errors
    /// A scene that cannot be run, references that never agree.
    pub fn new(scene: &Scene) -> Result<Self, ReferenceError> {
        let scheme = Scheme::Consistent(IntegratorKind::GaussRadau, SolutionMethod::Staggered);
        let case = |tolerance| Case { scheme, control: Control::Tolerance(tolerance) };
        let scenes = TOLERANCES.map(|tolerance| case(tolerance).scene(scene, scene.duration));
        let start = |scene: &Scene| Simulation::new(scene).map_err(ReferenceError::Setup);
        let (mut first, mut second) = (start(&scenes[0])?, start(&scenes[1])?);
        let (mut one, mut other) = (Watch::default(), Watch::default());
        let mut best: Option<Self> = None;
        let mut parted = (0.0, 0.0);
        for part in 1..=PARTS {
            let until = scene.duration * f64::from(part) / f64::from(PARTS);
            let solved = run(&mut first, until, &mut one).and_then(|_| run(&mut second, until, &mut other));
            match solved {
                Ok(_) => {}
                // A reference of high order ends where a contact comes to rest.
                Err(RunError::Resting { .. }) if best.is_some() => {
                    best = best.map(|best| Self { rests: true, ..best });
                    break;
                }
                Err(error) => return Err(ReferenceError::Run(error)),
            }
            let uncertainty = Errors::between(&other, &one);
            if uncertainty.position > AGREEMENT || uncertainty.position.is_nan() {
                parted = (until, uncertainty.position);
                break;
            }
            best = Some(Self {
                until,
                whole: part == PARTS,
                rests: false,
                uncertainty,
                end: one.clone(),
                evaluations: first.force_evaluations(),
            });
        }
        best.ok_or(ReferenceError::Parted(parted.0, parted.1))
    }

    /// Positions at its end [m].
    pub(crate) fn positions(&self) -> Vec<[f64; 3]> {
        let r = &self.end.state.position;
        (0..r.len()).map(|i| r.get(i).into()).collect()
    }
}
