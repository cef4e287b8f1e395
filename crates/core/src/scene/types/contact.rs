//! Impact: restitution, friction, duration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Impact between particles, and of particles with walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// Coefficient of restitution: a number, or its dependence on velocity and temperature.
    pub restitution: Restitution,
    /// Stick-slip friction; absent: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction>,
    /// How long an impact lasts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration: Option<ImpactDuration>,
    /// When impacts happen, in `consistent`: located in time (`located`, the default) or at step ends (`step`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub resolution: Option<ContactResolution>,
    /// Approaches slower than this, of contacts that fields press together, are taken as resting where the next bounce would
    /// end within the step [m/s]. Model `consistent` only; default 0.01.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0))]
    pub rest_speed: Option<f64>,
    /// Share of the smaller diameter by which particles may overlap, or reach into walls, at the start [-]; default 1e-9.
    /// A recorded state that goes on in a new scene may need it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 0.5))]
    pub initial_overlap: Option<f64>,
}

/// Coefficient of restitution, equation (35).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Restitution {
    /// The same for every impact [-].
    Constant(#[schemars(extend("minimum" = 0.0, "maximum" = 1.0))] f64),
    /// Depending on approach speed and temperature.
    Law(RestitutionLaw),
}

/// e = max(e0 (1 - u/v_star), e_min) max(1 - theta/theta_star, 0), equation (35).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestitutionLaw {
    /// Restitution of a slow, cold impact [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub e0: f64,
    /// Lower limit of the velocity-dependent factor [-]; default 0.01, or e0 where that is smaller.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub e_min: Option<f64>,
    /// Approach speed at which the velocity-dependent factor vanishes [m/s]; absent: no dependence on velocity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub v_star: Option<f64>,
    /// Temperature at which restitution vanishes [K]; absent: no dependence on temperature.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub theta_star: Option<f64>,
}

/// Stick-slip friction, equations (32)-(33).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Friction {
    /// Static coefficient mu_s [-].
    #[serde(rename = "static")]
    #[schemars(extend("minimum" = 0.0))]
    pub static_: f64,
    /// Dynamic coefficient mu_d <= mu_s [-].
    #[schemars(extend("minimum" = 0.0))]
    pub dynamic: f64,
}

/// Duration of an impact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ImpactDuration {
    /// A fraction gamma of the time step [-]; model `paper` only where there is a reaction.
    StepFraction(#[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1.0))] f64),
    /// A time [s].
    Seconds(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

/// When impacts happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactResolution {
    /// At the ends of time steps.
    Step,
    /// At their own instants, located in time.
    Located,
}
