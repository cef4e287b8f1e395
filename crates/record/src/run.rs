//! The metadata record `run`: which scene, build and model a log comes from.

use std::collections::BTreeMap;

use agglo_core::scene::{Contact, Domain, External, ModelKind, NearField, Scene, Thermal};
use sha2::{Digest, Sha256};

/// Name of the metadata record.
pub const RECORD: &str = "run";

/// Name of the attachment with the scene, as resolved.
pub const SCENE: &str = "scene.json";

/// Name of the attachment with the viewer layout.
pub const LAYOUT: &str = "layout.json";

/// What `/log` says last where a run was asked to stop.
pub const INTERRUPTED: &str = "the run was interrupted";

/// Version of the log format that this version writes: (major, minor). Fields are added with the minor; a reader
/// refuses a major that it does not know.
pub const LOG_FORMAT: (u32, u32) = (1, 0);

/// What was built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildInfo {
    /// Version of agglo, such as `0.1.0`.
    pub version: String,
    /// Commit that was built, `unknown` outside a repository.
    pub commit: String,
}

/// A metadata record `run` that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Unreadable {
    /// It is of a format that this version does not read; what reads it, as a sentence.
    Version(String),
    /// It is not one that agglo writes; what is wrong, as a sentence.
    Foreign(String),
}

impl std::fmt::Display for Unreadable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Version(why) | Self::Foreign(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for Unreadable {}

/// The metadata record `run`.
#[derive(Clone, Debug, PartialEq)]
pub struct RunInfo {
    /// Version of the log format: (major, minor).
    pub log_format: (u32, u32),
    /// What wrote the log.
    pub build: BuildInfo,
    /// Name of the scene; empty where it has none.
    pub scene_name: String,
    /// SHA-256 of the attachment `scene.json`, in hexadecimal digits.
    pub scene_hash: String,
    /// Seed of all random numbers [-].
    pub seed: u64,
    /// Model: `paper` or `consistent`.
    pub model: String,
    /// Number of particles n [-].
    pub particles: u64,
    /// Log time over simulated time [-].
    pub time_scale: f64,
    /// Effects that the scene switches on.
    pub terms: Vec<String>,
}

impl RunInfo {
    /// The record for a scene of `particles` particles whose attachment is `scene_json`.
    #[must_use]
    pub fn new(scene: &Scene, scene_json: &str, particles: usize, build: &BuildInfo) -> Self {
        Self {
            log_format: LOG_FORMAT,
            build: build.clone(),
            scene_name: scene.name.clone().unwrap_or_default(),
            scene_hash: hash(scene_json.as_bytes()),
            seed: scene.seed,
            model: match scene.model {
                ModelKind::Paper => "paper".to_owned(),
                ModelKind::Consistent => "consistent".to_owned(),
            },
            particles: particles as u64,
            time_scale: scene.record.time_scale,
            terms: terms(scene).into_iter().map(str::to_owned).collect(),
        }
    }

    /// The record's keys and values.
    #[must_use]
    pub fn to_map(&self) -> BTreeMap<String, String> {
        let Self {
            log_format: (major, minor),
            build: BuildInfo { version, commit },
            scene_name,
            scene_hash,
            seed,
            model,
            particles,
            time_scale,
            terms,
        } = self;
        [
            ("log_format", format!("{major}.{minor}")),
            ("agglo_version", version.clone()),
            ("agglo_commit", commit.clone()),
            ("scene_name", scene_name.clone()),
            ("scene_hash", format!("sha256:{scene_hash}")),
            ("seed", seed.to_string()),
            ("model", model.clone()),
            ("n", particles.to_string()),
            ("units", "SI".to_owned()),
            // The shortest text that reads back to the same number.
            ("time_scale", format!("{time_scale:?}")),
            ("terms", terms.join(" ")),
        ]
        .into_iter()
        .map(|(key, value)| (key.to_owned(), value))
        .collect()
    }

    /// Reads the record back. Keys that this version does not know are passed over.
    ///
    /// # Errors
    /// A format of another major version, a key that is missing or unreadable.
    pub fn from_map(map: &BTreeMap<String, String>) -> Result<Self, Unreadable> {
        let text = |key: &str| {
            let missing = || Unreadable::Foreign(format!("its metadata record `{RECORD}` has no {key}"));
            map.get(key).map(String::as_str).ok_or_else(missing)
        };
        let format = text("log_format")?;
        let (major, minor) = format.split_once('.').unwrap_or((format, "0"));
        let log_format: (u32, u32) = (number("log_format", major)?, number("log_format", minor)?);
        if log_format.0 != LOG_FORMAT.0 {
            let written_by = text("agglo_version").ok().filter(|version| *version != env!("CARGO_PKG_VERSION"));
            let named = written_by.map(|version| format!("agglo {version} or another ")).unwrap_or_default();
            let article = if named.is_empty() { "a " } else { "" };
            return Err(Unreadable::Version(format!(
                "the log has format {format}, and this version reads {}.x; read it with {named}{article}version that \
                 reads {}.x",
                LOG_FORMAT.0, log_format.0
            )));
        }
        let hash = text("scene_hash")?;
        Ok(Self {
            log_format,
            build: BuildInfo { version: text("agglo_version")?.to_owned(), commit: text("agglo_commit")?.to_owned() },
            scene_name: text("scene_name")?.to_owned(),
            scene_hash: hash.strip_prefix("sha256:").unwrap_or(hash).to_owned(),
            seed: number("seed", text("seed")?)?,
            model: text("model")?.to_owned(),
            particles: number("n", text("n")?)?,
            time_scale: number("time_scale", text("time_scale")?)?,
            terms: text("terms")?.split_whitespace().map(str::to_owned).collect(),
        })
    }
}

fn number<T: std::str::FromStr>(key: &str, text: &str) -> Result<T, Unreadable> {
    text.parse().map_err(|_| Unreadable::Foreign(format!("its {key} is {text:?}, not a number")))
}

/// SHA-256 in hexadecimal digits.
#[must_use]
pub fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The effects that a scene switches on, by their place in the scene.
#[must_use]
pub fn terms(scene: &Scene) -> Vec<&'static str> {
    let Scene {
        schema: _,
        format: _,
        name: _,
        description: _,
        model: _,
        seed: _,
        duration: _,
        particles: _,
        near_field,
        binding,
        contact,
        thermal,
        clusters,
        external,
        domain,
        solver: _,
        record: _,
    } = scene;
    let mut terms = Vec::new();
    let mut add = |on: bool, term: &'static str| {
        if on {
            terms.push(term);
        }
    };
    if let Some(NearField { attraction, repulsion, weight: _, cutoff: _, switch_from: _, accuracy: _ }) = near_field {
        add(attraction.is_some(), "near_field.attraction");
        add(repulsion.is_some(), "near_field.repulsion");
    }
    add(binding.is_some(), "binding");
    if let Some(Contact { restitution: _, friction, duration: _, resolution: _, rest_speed: _, initial_overlap: _ }) =
        contact
    {
        add(true, "contact");
        add(friction.is_some(), "contact.friction");
    }
    if let Some(Thermal { heat_capacity: _, radiation, convection, reaction }) = thermal {
        add(true, "thermal");
        add(radiation.is_some(), "thermal.radiation");
        add(convection.is_some(), "thermal.convection");
        add(reaction.is_some(), "thermal.reaction");
    }
    add(clusters.is_some(), "clusters");
    if let Some(External { gravity, electric_field }) = external {
        add(gravity.is_some(), "external.gravity");
        add(electric_field.is_some(), "external.electric_field");
    }
    if let Some(Domain { periodic, walls }) = domain {
        add(periodic.is_some_and(|lengths| lengths.iter().any(Option::is_some)), "domain.periodic");
        add(!walls.is_empty(), "domain.walls");
    }
    terms
}

/// Log time of a simulated time [ns]: round(t time_scale 1e9).
#[must_use]
pub fn log_time(t: f64, time_scale: f64) -> u64 {
    // A float-to-integer cast saturates: times beyond 584 years of log time share the last nanosecond.
    (t * time_scale * 1e9).round() as u64
}
