//! The JSON Schema of scene files, from the Rust types that read them.

use std::path::PathBuf;

use crate::Failure;
use crate::outputs::Output;

/// `schemas/scene.schema.json`.
pub fn generate() -> Result<Vec<Output>, Failure> {
    let mut text = serde_json::to_string_pretty(&agglo_core::scene::json_schema())?;
    text.push('\n');
    Ok(vec![Output { path: PathBuf::from("schemas/scene.schema.json"), content: text.into_bytes() }])
}
