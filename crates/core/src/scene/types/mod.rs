//! The scene: every quantity a scene file may name, with units and ranges.
//!
//! These types are the single source of the file format: the JSON Schema is generated from them (doc comments become
//! descriptions, `extend` attributes become ranges) and the checks of a file walk that schema.

mod contact;
mod domain;
mod fields;
mod particles;
mod record;
mod solver;
mod thermal;

pub use contact::*;
pub use domain::*;
pub use fields::*;
pub use particles::*;
pub use record::*;
pub use solver::*;
pub use thermal::*;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A scene: what to simulate, how, and what to record. A section that is absent is an effect that is absent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// A schema reference for editors; ignored ([`Scene::parse`] forgets it).
    #[serde(rename = "$schema", default, skip_serializing)]
    pub schema: Option<String>,
    /// Version of this file format; 1.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 1))]
    pub format: u32,
    /// A short name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// What the scene shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub description: Option<String>,
    /// Which of the two named models is solved.
    #[serde(default)]
    pub model: ModelKind,
    /// Seed of all random numbers [-].
    #[serde(default)]
    #[schemars(extend("minimum" = 0, "maximum" = 9_007_199_254_740_991_u64))]
    pub seed: u64,
    /// Simulated time [s].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub duration: f64,
    /// Where the particles come from: exactly one source.
    pub particles: ParticleSource,
    /// Near-field attraction and repulsion, equation (2).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near_field: Option<NearField>,
    /// Binding force that forms clusters, equation (13).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub binding: Option<Binding>,
    /// Impact, restitution and friction, equations (16)-(35).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub contact: Option<Contact>,
    /// Temperatures, equations (36)-(42). Absent: no temperatures anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermal: Option<Thermal>,
    /// How clusters are counted where there is no binding.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clusters: Option<ClusterCount>,
    /// Forces from outside the cloud.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub external: Option<External>,
    /// Periodic directions and plane walls.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub domain: Option<Domain>,
    /// Integrator, step control and tolerances, equations (43)-(55).
    #[serde(default)]
    pub solver: Solver,
    /// What is written to the log, and how often.
    #[serde(default)]
    pub record: Record,
}

/// The two named models.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ModelKind {
    /// The paper's scheme, literal where the literal thing works; reproduces its tables.
    Paper,
    /// The same physics with a limit as the step goes to zero, so that an error can be stated.
    #[default]
    Consistent,
}

/// A vector of three components.
pub type Vector = [f64; 3];

fn one() -> u32 {
    1
}
