//! Integrator, step control and tolerances.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Integrator, step control and tolerances.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Time integrator; default `backward-euler` in `paper`; in `consistent` `gauss-legendre` where forces are smooth (a near
    /// field without cut-off that keeps particles apart, no contact, binding or domain), else `velocity-verlet`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integrator: Option<IntegratorKind>,
    /// How the coupled equations of a step are solved.
    pub method: SolutionMethod,
    /// What is done about the jumps of forces at the cut-off and at the activation distance; default `located` in `consistent`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub crossings: Option<Crossings>,
    /// Step size.
    pub step: StepSize,
    /// Tolerances of both fields, equations (53)-(54).
    pub tolerance: Tolerance,
    /// Bound K_d on the iterations of a step [-].
    #[schemars(extend("minimum" = 1, "maximum" = 100_000))]
    pub max_iterations: u32,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            integrator: None,
            method: SolutionMethod::default(),
            crossings: None,
            step: StepSize::default(),
            tolerance: Tolerance::default(),
            max_iterations: 100,
        }
    }
}

/// Time integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum IntegratorKind {
    /// First order, damps vibrations; the paper's (49).
    BackwardEuler,
    /// Second order, implicit.
    Trapezoidal,
    /// Second order, explicit in the positions.
    VelocityVerlet,
    /// Eighth order, implicit, symmetric: collocation at four Gauss-Legendre points.
    GaussLegendre,
    /// Order 15, implicit: collocation at eight Gauss-Radau points.
    GaussRadau,
}

/// How the coupled equations of a step are solved.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SolutionMethod {
    /// Staggered fixed-point iteration, equation (55).
    #[default]
    Staggered,
    /// Newton's method, the paper's Remark 3.
    Newton,
}

/// What is done about the jumps of forces at the cut-off and at the activation distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Crossings {
    /// Crossings are located in time: steps keep their order.
    Located,
    /// Nothing, as most programs for molecules have it: cheaper, and of first order in the size of the jumps.
    Ignored,
}

/// Step size: adaptive between `min` and `max`, or `fixed`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepSize {
    /// First step [s]; default 1e-3, or `max` where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub initial: Option<f64>,
    /// Largest step, the paper's dt_lim [s]; default 1e-2 (5e-2 with `gauss-legendre` and `gauss-radau`), or `initial` where
    /// that is larger.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub max: Option<f64>,
    /// Smallest step; a run that needs a smaller one fails [s]; default 1e-10, or a millionth of `initial` where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub min: Option<f64>,
    /// A step that never changes [s]; excludes the others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub fixed: Option<f64>,
}

impl StepSize {
    /// The first, the largest and the smallest step [s], defaults filled in; all three are `fixed` where it is given.
    #[must_use]
    pub fn limits(&self) -> (f64, f64, f64) {
        if let Some(fixed) = self.fixed {
            return (fixed, fixed, fixed);
        }
        let initial = self.initial.unwrap_or(self.max.map_or(1e-3, |max| max.min(1e-3)));
        let max = self.max.unwrap_or(initial.max(1e-2));
        (initial, max, self.min.unwrap_or((1e-6 * initial).min(1e-10)))
    }
}

/// Tolerances of both fields.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tolerance {
    /// Positions, TOL_r [-]: relative to the positions in `paper`, to the mean diameter in `consistent`, where adaptive steps of
    /// the second-order schemes keep their local error below TOL_r^(3/2).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub position: f64,
    /// Temperatures, TOL_theta, relative [-].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { position: 1e-6, temperature: 1e-6 }
    }
}
