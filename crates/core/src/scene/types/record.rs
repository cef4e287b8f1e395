//! What is written to the log.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What is written to the log, and how often.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Record {
    /// States are recorded every so many steps [-]; this or `interval`; default 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("minimum" = 1, "maximum" = 9_007_199_254_740_991_u64))]
    pub every_steps: Option<u64>,
    /// States are recorded at the first step end after every such interval of simulated time [s].
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub interval: Option<f64>,
    /// Number format of recorded states.
    pub precision: Precision,
    /// Rate of the sphere channel in log time [Hz]; 0: off.
    #[schemars(extend("minimum" = 0.0))]
    pub markers: f64,
    /// Compression of the log's chunks.
    pub compression: Compression,
    /// A checkpoint every so many steps [-].
    #[schemars(extend("minimum" = 1, "maximum" = 9_007_199_254_740_991_u64))]
    pub checkpoint_every: u64,
    /// Log time over simulated time [-].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub time_scale: f64,
}

impl Default for Record {
    fn default() -> Self {
        Self {
            every_steps: None,
            interval: None,
            precision: Precision::F64,
            markers: 30.0,
            compression: Compression::Zstd,
            checkpoint_every: 1000,
            time_scale: 1.0,
        }
    }
}

/// Number format of recorded states.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Precision {
    /// 64-bit floats: replay is exact.
    F64,
    /// 32-bit floats: half the size.
    F32,
}

/// Compression of the log's chunks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// Zstandard, level 1.
    Zstd,
    /// LZ4.
    Lz4,
    /// None.
    None,
}
