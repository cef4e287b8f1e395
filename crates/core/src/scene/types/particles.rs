//! Where the particles come from: a cube filled at random, a list, a table, a log.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Vector;

/// Where the particles come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ParticleSource {
    /// Equal spheres placed at random in a cube, without overlap.
    RandomCube(RandomCube),
    /// Every particle written out.
    List(#[schemars(length(min = 1))] Vec<ListedParticle>),
    /// A CSV file with the columns of `agglo export` (of several times the last).
    File(FileSource),
    /// A state recorded in a log.
    Log(LogSource),
}

/// Equal spheres placed at random in a cube, without overlap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RandomCube {
    /// Number of particles [-].
    #[schemars(extend("minimum" = 1, "maximum" = 100_000_000))]
    pub count: u32,
    /// Edge of the cube that holds the centres [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub side: f64,
    /// Radius over side/count^(1/3) [-]; this or `radius`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius_ratio: Option<f64>,
    /// Radius [m]; this or `radius_ratio`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: Option<f64>,
    /// Mass density of the spheres [kg/m^3].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: f64,
    /// Initial temperature [K]; needed by `thermal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: Option<f64>,
    /// Mean velocity [m/s].
    #[serde(default)]
    pub velocity_mean: Vector,
    /// Half width of the uniform distribution of each velocity component [m/s].
    #[serde(default)]
    #[schemars(extend("items" = {"type": "number", "minimum": 0.0}))]
    pub velocity_spread: Vector,
    /// Charge of every particle, or charges dealt in turn [C].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub charge: Option<ChargeDeal>,
}

/// One charge for all, or several dealt in turn [C].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ChargeDeal {
    /// The same charge for every particle [C].
    Same(f64),
    /// Particle k gets charge k modulo the length [C].
    InTurn(#[schemars(length(min = 1))] Vec<f64>),
}

/// One particle, written out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListedParticle {
    /// Position of the centre [m].
    pub position: Vector,
    /// Velocity [m/s].
    #[serde(default)]
    pub velocity: Vector,
    /// Radius [m].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f64,
    /// Mass density [kg/m^3]; this or `mass`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: Option<f64>,
    /// Mass [kg]; this or `density`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub mass: Option<f64>,
    /// Temperature [K]; needed by `thermal`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub temperature: Option<f64>,
    /// Charge [C].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub charge: Option<f64>,
}

/// A CSV file of particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileSource {
    /// Path; a relative one starts at the scene's folder.
    #[schemars(length(min = 1))]
    pub path: String,
}

/// A state recorded in a log.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LogSource {
    /// Path; a relative one starts at the scene's folder.
    #[schemars(length(min = 1))]
    pub path: String,
    /// The last recorded state at or before this time is taken [s].
    #[schemars(extend("minimum" = 0.0))]
    pub time: f64,
}
