//! Forces on particles at a distance: near field, binding, gravity, electric field; and how clusters are counted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Vector;

/// Near field, equation (2): force on i along n_ij is alpha1 s^-beta1 - alpha2 s^-beta2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NearField {
    /// Attraction alpha1, beta1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attraction: Option<PowerTerm>,
    /// Repulsion alpha2, beta2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repulsion: Option<PowerTerm>,
    /// Pair weight that multiplies the strengths.
    #[serde(default)]
    pub weight: Weight,
    /// Distance beyond which the near field is zero.
    #[serde(default)]
    pub cutoff: Cutoff,
    /// Distance from which the potential is switched smoothly to zero at the cut-off [m].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub switch_from: Option<f64>,
    /// Relative force error allowed to a long-range method [-]; absent: forces are summed exactly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 1.0))]
    pub accuracy: Option<f64>,
}

/// One power-law term strength * weight * s^-exponent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PowerTerm {
    /// Strength before the pair weight [N m^exponent per unit of weight].
    #[schemars(extend("minimum" = 0.0))]
    pub strength: f64,
    /// Exponent beta of the force [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub exponent: f64,
    /// Pair weight of this term; absent: the near field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<Weight>,
}

/// Pair weight w_ij that multiplies a strength.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Weight {
    /// 1.
    #[default]
    None,
    /// m_i m_j [kg^2], the paper's choice.
    MassProduct,
    /// -q_i q_j for attraction, |q_i q_j| for repulsion and binding [C^2].
    ChargeProduct,
}

/// Where the near field ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Cutoff {
    /// By name.
    Named(NamedCutoff),
    /// At this distance [m].
    Distance(#[schemars(extend("exclusiveMinimum" = 0.0))] f64),
}

impl Default for Cutoff {
    fn default() -> Self {
        Self::Named(NamedCutoff::None)
    }
}

/// Cut-offs with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NamedCutoff {
    /// At the inflection of the potential, equation (12), the paper's choice.
    Inflection,
    /// No cut-off: every pair interacts.
    None,
}

/// Binding, equation (13): an extra attraction strength * weight * s^-exponent while s <= range (b_i + b_j).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Binding {
    /// Strength alpha_a before the pair weight [N m^exponent per unit of weight].
    #[schemars(extend("minimum" = 0.0))]
    pub strength: f64,
    /// Exponent beta_a [-].
    #[schemars(extend("minimum" = 0.0, "maximum" = 100.0))]
    pub exponent: f64,
    /// Activation distance over the sum of the radii, delta_a [-].
    #[schemars(extend("minimum" = 1.0))]
    pub range: f64,
    /// Pair weight; absent: the near field's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight: Option<Weight>,
}

/// Clusters of scenes without binding.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClusterCount {
    /// Pairs closer than range (b_i + b_j) belong together [-].
    #[schemars(extend("minimum" = 1.0))]
    pub range: f64,
}

/// Forces from outside the cloud.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct External {
    /// Acceleration of gravity [m/s^2].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity: Option<Vector>,
    /// Electric field [V/m]; needs charges.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub electric_field: Option<Vector>,
}
