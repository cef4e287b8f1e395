//! What a study tries: schemes, each with fixed steps and with tolerances.

use agglo_core::Scene;
use agglo_core::scene::{ContactResolution, IntegratorKind, ModelKind, SolutionMethod, StepSize};
use serde::Serialize;

/// Iteration tolerance of runs with a fixed step, in mean diameters [-]: what is measured is the scheme, not how well its
/// equations are solved.
const SOLVED: f64 = 1e-10;
/// Step limit of runs with a tolerance, as a share of the time studied [-]: the tolerance decides, not the limit.
const LONGEST: f64 = 1.0;

/// A way to solve a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// The model `paper`: backward Euler as in the paper's (55).
    Paper,
    /// The model `consistent` with an integrator and a method.
    Consistent(IntegratorKind, SolutionMethod),
}

impl Scheme {
    /// From a name such as `paper`, `gauss-radau` or `trapezoidal+newton`.
    ///
    /// # Errors
    /// A name that is none; all that are.
    pub fn parse(name: &str) -> Result<Self, String> {
        if name == "paper" {
            return Ok(Self::Paper);
        }
        let (integrator, method) = match name.strip_suffix("+newton") {
            Some(integrator) => (integrator, SolutionMethod::Newton),
            None => (name, SolutionMethod::Staggered),
        };
        let known = INTEGRATORS.iter().find(|&&kind| word(&kind) == integrator);
        known.map(|&kind| Self::Consistent(kind, method)).ok_or_else(|| {
            let names: Vec<String> = INTEGRATORS.iter().map(word).collect();
            format!("no scheme is called `{name}`; there are paper, {}, each also with +newton", names.join(", "))
        })
    }

    /// Whether its order is above two.
    #[must_use]
    pub fn is_of_high_order(&self) -> bool {
        matches!(self, Self::Consistent(IntegratorKind::GaussLegendre | IntegratorKind::GaussRadau, _))
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> String {
        match self {
            Self::Paper => "paper".to_owned(),
            Self::Consistent(kind, SolutionMethod::Staggered) => word(kind),
            Self::Consistent(kind, SolutionMethod::Newton) => format!("{}+newton", word(kind)),
        }
    }
}

const INTEGRATORS: [IntegratorKind; 5] = [
    IntegratorKind::BackwardEuler,
    IntegratorKind::Trapezoidal,
    IntegratorKind::VelocityVerlet,
    IntegratorKind::GaussLegendre,
    IntegratorKind::GaussRadau,
];

/// The word that a scene uses for a choice.
fn word(choice: &impl Serialize) -> String {
    serde_json::to_value(choice).ok().and_then(|value| value.as_str().map(str::to_owned)).unwrap_or_default()
}

/// What governs the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// A fixed step [s].
    Step(f64),
    /// A tolerance of the positions [mean diameters].
    Tolerance(f64),
}

/// One thing to try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Case {
    /// How the scene is solved.
    pub scheme: Scheme,
    /// What governs the step.
    pub control: Control,
}

impl Case {
    /// The scene of this case, until a time [s].
    #[must_use]
    pub fn scene(&self, scene: &Scene, until: f64) -> Scene {
        let mut scene = scene.clone();
        scene.duration = until;
        let tolerance = scene.solver.tolerance.position;
        match self.scheme {
            Scheme::Paper => {
                scene.model = ModelKind::Paper;
                scene.solver.integrator = None;
                scene.solver.method = SolutionMethod::Staggered;
                if let Some(contact) = &mut scene.contact {
                    (contact.resolution, contact.rest_speed) = (None, None);
                }
            }
            Scheme::Consistent(kind, method) => {
                scene.model = ModelKind::Consistent;
                scene.solver.integrator = Some(kind);
                scene.solver.method = method;
                scene.solver.tolerance.position = SOLVED.min(tolerance);
                // Schemes of high order leave impacts to step ends unless they are asked to locate them.
                if let Some(contact) = &mut scene.contact {
                    contact.resolution.get_or_insert(ContactResolution::Located);
                }
            }
        }
        match self.control {
            Control::Step(dt) => scene.solver.step = StepSize { fixed: Some(dt), ..StepSize::default() },
            Control::Tolerance(tolerance) => {
                scene.solver.tolerance.position = tolerance;
                let initial = scene.solver.step.limits().0.min(LONGEST * until);
                scene.solver.step =
                    StepSize { initial: Some(initial), max: Some(LONGEST * until), ..StepSize::default() };
            }
        }
        scene
    }
}

/// What a study tries.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Schemes, in the order of the table.
    pub schemes: Vec<Scheme>,
    /// Fixed steps [s]; empty: found from the scene, from coarse to fine until nothing is left to gain.
    pub steps: Vec<f64>,
    /// Tolerances [mean diameters]; empty: the powers of ten from 1e-3 to 1e-12.
    pub tolerances: Vec<f64>,
    /// Repeats of every measurement of time.
    pub repeats: usize,
    /// Time that all measurements may take [s].
    pub budget: f64,
    /// Seeds of the statistics after the references part; 0: none.
    pub seeds: u64,
}

impl Default for Plan {
    fn default() -> Self {
        let consistent = INTEGRATORS.map(|kind| Scheme::Consistent(kind, SolutionMethod::Staggered));
        Self {
            schemes: [Scheme::Paper].into_iter().chain(consistent).collect(),
            steps: Vec::new(),
            tolerances: Vec::new(),
            repeats: 3,
            budget: 60.0,
            seeds: 0,
        }
    }
}

impl Plan {
    /// Series of cases, each from coarse to fine: a scheme with fixed steps, a scheme with tolerances. `until` is the time
    /// studied [s], `step` one that resolves the motion [s].
    #[must_use]
    pub fn series(&self, until: f64, step: f64) -> Vec<Vec<Case>> {
        let both = self.steps.is_empty() == self.tolerances.is_empty();
        let mut series = Vec::new();
        for &scheme in &self.schemes {
            let case = |control| Case { scheme, control };
            if both || !self.steps.is_empty() {
                series.push(self.steps(scheme, until, step).into_iter().map(|dt| case(Control::Step(dt))).collect());
            }
            // The paper's step control knows no discretisation error.
            if scheme != Scheme::Paper && (both || !self.tolerances.is_empty()) {
                let tolerances = if self.tolerances.is_empty() {
                    (3..=12).map(|k| 10_f64.powi(-k)).collect()
                } else {
                    self.tolerances.clone()
                };
                series.push(tolerances.into_iter().map(|tolerance| case(Control::Tolerance(tolerance))).collect());
            }
        }
        series
    }

    fn steps(&self, scheme: Scheme, until: f64, step: f64) -> Vec<f64> {
        if !self.steps.is_empty() {
            return self.steps.clone();
        }
        let high = scheme.is_of_high_order();
        // Whole numbers of steps, so that none is clipped: from four steps per period, halved, or times 2^(-1/2) where
        // an order is high enough for that to be a large step in the error.
        let (from, ratio, count) = if high { (0.5 * until, 0.5_f64.sqrt(), 16) } else { (12.0 * step, 0.5, 16) };
        let mut steps: Vec<f64> = Vec::new();
        for k in 0..count {
            let dt = until / (until / (from * ratio.powi(k))).ceil().max(1.0);
            if steps.last().is_none_or(|&last| dt < 0.99 * last) {
                steps.push(dt);
            }
        }
        steps
    }
}
