//! What bounds the cloud: periodic directions and plane walls.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Vector;

/// Periodic directions and plane walls.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lengths of the periodic box, which starts at the origin [m]; null: an open direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("items" = {"type": ["number", "null"], "exclusiveMinimum": 0.0}))]
    pub periodic: Option<[Option<f64>; 3]>,
    /// Plane walls.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub walls: Vec<Wall>,
}

/// A plane wall.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// A point of the plane [m].
    pub point: Vector,
    /// Normal, into the side where the particles are; any length but zero [-].
    pub normal: Vector,
}
