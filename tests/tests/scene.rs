//! The scene format: what is refused and how, what is accepted and kept, and where particles start.

#![allow(missing_docs, clippy::unwrap_used)]

#[path = "scene/corpus.rs"]
mod corpus;
#[path = "scene/generated.rs"]
mod generated;
#[path = "scene/placement.rs"]
mod placement;
#[path = "scene/round_trip.rs"]
mod round_trip;
#[path = "scene/schema.rs"]
mod schema;

use std::path::{Path, PathBuf};

/// A folder of the repository.
pub fn directory(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

/// The JSON files of a folder with their names, sorted.
fn texts(folder: &str) -> Vec<(String, String)> {
    let folder = directory(folder);
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".json"))
        .collect();
    names.sort();
    names.into_iter().map(|name| (name.clone(), std::fs::read_to_string(folder.join(name)).unwrap())).collect()
}

/// The scenes that agglo ships.
pub fn shipped_scenes() -> Vec<(String, String)> {
    texts("scenes")
}

/// Scenes with something wrong.
pub fn broken_scenes() -> Vec<(String, String)> {
    texts("tests/broken")
}
