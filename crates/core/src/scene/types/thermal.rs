//! Temperatures: heat capacity, radiation, convection, reaction heat.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Temperatures and heat exchange.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Thermal {
    /// Heat capacity C [J/(kg K)].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub heat_capacity: f64,
    /// Radiation to far surroundings, equation (41).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radiation: Option<Radiation>,
    /// Convection to an ambient gas, equation (41).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convection: Option<Convection>,
    /// Heat of surface reactions set off by impacts, equation (39).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reaction: Option<Reaction>,
}

/// Radiation to far surroundings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Radiation {
    /// Emissivity epsilon [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub emissivity: f64,
    /// Temperature theta_s of the surroundings [K].
    #[schemars(extend("minimum" = 0.0))]
    pub surroundings: f64,
}

/// Convection to an ambient gas.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Convection {
    /// Heat transfer coefficient h_c [W/(m^2 K)].
    #[schemars(extend("minimum" = 0.0))]
    pub coefficient: f64,
    /// Temperature theta_0 of the gas [K].
    #[schemars(extend("minimum" = 0.0))]
    pub ambient: f64,
}

/// Surface reaction heat kappa min(|I_n|/I*, 1) pi b^2, equation (39).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reaction {
    /// Reaction energy kappa per contact area [J/m^2].
    #[schemars(extend("minimum" = 0.0))]
    pub energy_per_area: f64,
    /// Mean impact force I* at which the reaction is complete [N].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_scale: f64,
}
