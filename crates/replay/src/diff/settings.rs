//! What two logs say about the runs they come from: header and scene.

use agglo_core::scene::Scene;
use serde_json::Value;

use crate::{LogError, RunInfo};

/// What a setting decides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// What is solved, and how.
    Physics,
    /// What is written down, and when.
    Recording,
    /// How it is packed: the data are the same.
    Packing,
    /// Names and descriptions.
    Text,
    /// What wrote the log.
    Build,
}

impl Kind {
    /// A word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Physics => "physics",
            Self::Recording => "recording",
            Self::Packing => "packing",
            Self::Text => "text",
            Self::Build => "build",
        }
    }
}

/// A setting that differs.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// JSON pointer into the scene, or the name of a key of the header.
    pub name: String,
    /// Value in the first log; null where it has none.
    pub a: Value,
    /// Value in the second.
    pub b: Value,
    /// What it decides.
    pub kind: Kind,
}

/// Longest list of particles of which single values are named; of a longer one only that it differs.
const SHOWN: usize = 1000;

/// The settings in which two scenes differ, each by its pointer.
pub fn scenes(a: &Scene, b: &Scene) -> Result<Vec<Setting>, LogError> {
    let tree = |scene: &Scene| -> Value { serde_json::from_str(&scene.to_json()).unwrap_or(Value::Null) };
    let mut found = Vec::new();
    compare("", &tree(a), &tree(b), &mut found);
    Ok(found)
}

fn compare(pointer: &str, a: &Value, b: &Value, found: &mut Vec<Setting>) {
    let below = |key: &str| format!("{pointer}/{}", key.replace('~', "~0").replace('/', "~1"));
    match (a, b) {
        (Value::Object(left), Value::Object(right)) => {
            for (key, a) in left {
                compare(&below(key), a, right.get(key).unwrap_or(&Value::Null), found);
            }
            for (key, b) in right.iter().filter(|(key, _)| !left.contains_key(*key)) {
                compare(&below(key), &Value::Null, b, found);
            }
        }
        (Value::Array(left), Value::Array(right)) if left.len() == right.len() && left.len() <= SHOWN => {
            for (k, (a, b)) in left.iter().zip(right).enumerate() {
                compare(&below(&k.to_string()), a, b, found);
            }
        }
        _ if a != b => {
            let short = |value: &Value| match value {
                Value::Array(list) => format!("a list of {}", list.len()).into(),
                other => other.clone(),
            };
            found.push(Setting { name: pointer.to_owned(), a: short(a), b: short(b), kind: kind(pointer) });
        }
        _ => {}
    }
}

fn kind(pointer: &str) -> Kind {
    match pointer {
        "/name" | "/description" | "/$schema" => Kind::Text,
        "/record/compression" => Kind::Packing,
        _ if pointer.starts_with("/record") => Kind::Recording,
        _ => Kind::Physics,
    }
}

/// The keys in which two headers differ, without those that follow from the scene.
pub fn headers(a: &RunInfo, b: &RunInfo) -> Vec<Setting> {
    let RunInfo {
        log_format,
        build,
        scene_name: _,
        scene_hash: _,
        seed: _,
        model: _,
        particles: _,
        time_scale: _,
        terms: _,
    } = a;
    let mut found = Vec::new();
    let mut add = |name: &str, a: String, b: String| {
        if a != b {
            found.push(Setting { name: name.to_owned(), a: a.into(), b: b.into(), kind: Kind::Build });
        }
    };
    let format = |(major, minor): (u32, u32)| format!("{major}.{minor}");
    add("log_format", format(*log_format), format(b.log_format));
    add("agglo_version", build.version.clone(), b.build.version.clone());
    add("agglo_commit", build.commit.clone(), b.build.commit.clone());
    found
}

/// A value as text, short.
#[must_use]
pub fn text(value: &Value) -> String {
    match value {
        Value::Null => "absent".to_owned(),
        other => other.to_string(),
    }
}
