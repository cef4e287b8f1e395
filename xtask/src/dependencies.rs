//! The direction of dependencies between our crates: core <- record <- replay <- {render, study} <- cli.

use std::path::Path;
use std::process::Command;

use crate::Failure;

/// Each library crate and the crates of ours it may use. What is not listed here may use all of them.
const ALLOWED: &[(&str, &[&str])] = &[
    ("agglo-core", &[]),
    ("agglo-record", &["agglo-core"]),
    ("agglo-replay", &["agglo-core", "agglo-record"]),
    ("agglo-render", &["agglo-core", "agglo-record", "agglo-replay"]),
    ("agglo-study", &["agglo-core", "agglo-record", "agglo-replay"]),
    ("agglo", &["agglo-core", "agglo-record", "agglo-replay", "agglo-render", "agglo-study"]),
];

/// Crates that the solver must not see: it knows no files, no log format and no terminal.
const FOREIGN_TO_CORE: &[&str] = &["mcap", "prost", "csv", "clap", "indicatif", "anstream", "ctrlc"];

/// Fails where a crate of ours uses one that it must not know.
pub fn check(root: &Path) -> Result<(), Failure> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(root)
        .output()
        .map_err(|e| format!("cargo metadata: {e}"))?;
    if !output.status.success() {
        return Err(format!("cargo metadata: {}", String::from_utf8_lossy(&output.stderr)).into());
    }
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout)?;
    let mut faults = Vec::new();
    for (package, allowed) in ALLOWED {
        let Some(found) = metadata["packages"].as_array().into_iter().flatten().find(|p| p["name"] == *package) else {
            faults.push(format!("there is no package {package}"));
            continue;
        };
        for dependency in found["dependencies"].as_array().into_iter().flatten() {
            let name = dependency["name"].as_str().unwrap_or_default();
            // Tests and examples may look at whatever they like.
            if dependency["kind"] == "dev" {
                continue;
            }
            let ours = ALLOWED.iter().any(|(ours, _)| *ours == name);
            if ours && !allowed.contains(&name) {
                faults.push(format!("{package} must not use {name}"));
            }
            if *package == "agglo-core" && FOREIGN_TO_CORE.contains(&name) {
                faults.push(format!("agglo-core must not use {name}: it knows no files, no log format, no terminal"));
            }
        }
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n").into()) }
}
