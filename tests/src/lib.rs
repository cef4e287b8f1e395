//! Shared helpers of the test binaries: scenes from JSON, runs watched step by step, random numbers.

use agglo_core::diagnostics::StepDiagnostics;
use agglo_core::impact::Impact;
use agglo_core::observer::{ObserverError, Sample};
use agglo_core::state::State;
use agglo_core::{Flow, Observer, Outcome, RunError, Scene, Simulation, StepReport};
use serde_json::Value;
use std::path::{Path, PathBuf};

pub mod hard;

/// A scene that must be right.
///
/// # Panics
/// With all problems, if it is not.
#[must_use]
pub fn scene(value: &Value) -> Scene {
    Scene::parse(&value.to_string(), &[]).unwrap_or_else(|problems| panic!("{problems:#?}\nin {value:#}"))
}

/// `value` with other values at some JSON pointers; objects on the way there are made.
///
/// # Panics
/// If a pointer leads through something that is no object.
#[must_use]
pub fn with(value: &Value, changes: &[(&str, Value)]) -> Value {
    let mut value = value.clone();
    for (pointer, change) in changes {
        let place = pointer.split('/').skip(1).fold(&mut value, |at, key| match key.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => &mut at[key],
        });
        *place = change.clone();
    }
    value
}

/// The scenes that agglo ships, by file name, as JSON.
///
/// # Panics
/// If they cannot be read.
#[must_use]
pub fn shipped_scenes() -> Vec<(String, Value)> {
    let folder: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join("scenes");
    let files = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut scenes: Vec<(String, Value)> = files
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            let name = path.file_name()?.to_str()?.strip_suffix(".json")?.to_owned();
            let text = std::fs::read_to_string(&path).ok()?;
            Some((name, serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))))
        })
        .collect();
    scenes.sort_by(|a, b| a.0.cmp(&b.0));
    assert!(!scenes.is_empty(), "no scenes in {}", folder.display());
    scenes
}

/// A shipped scene as JSON.
///
/// # Panics
/// If there is none of that name.
#[must_use]
pub fn shipped(name: &str) -> Value {
    let found = shipped_scenes().into_iter().find(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("no shipped scene {name}")).1
}

/// An observer that calls a function at the start and after every step.
pub struct Watch<F>(pub F);

impl<F: FnMut(&StepReport<'_>)> Observer for Watch<F> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.0(report);
        Ok(Flow::Continue)
    }
}

/// Sets a scene up and runs it to its end.
///
/// # Errors
/// A run that fails.
///
/// # Panics
/// If it cannot be set up.
pub fn try_run(scene: &Scene, watch: impl FnMut(&StepReport<'_>)) -> Result<Outcome, RunError> {
    start(scene).run(&mut Watch(watch))
}

/// Runs a scene that must get to its end.
///
/// # Panics
/// If it does not.
pub fn run(scene: &Scene, watch: impl FnMut(&StepReport<'_>)) -> Outcome {
    try_run(scene, watch).unwrap_or_else(|error| panic!("{}: {error}", scene.name.as_deref().unwrap_or("scene")))
}

/// Sets a scene up that must be right.
///
/// # Panics
/// If it is not.
#[must_use]
pub fn start(scene: &Scene) -> Simulation {
    Simulation::new(scene).unwrap_or_else(|error| panic!("{error}"))
}

/// Everything that was seen of one step.
#[derive(Clone, Debug)]
pub struct Step {
    /// Time at its end [s].
    pub time: f64,
    /// State at its end.
    pub state: State,
    /// `None` at the start.
    pub diagnostics: Option<StepDiagnostics>,
    /// Impacts in it.
    pub impacts: Vec<Impact>,
    /// Energies, where they were taken.
    pub sample: Option<Sample>,
}

impl Step {
    /// What a report says.
    #[must_use]
    pub fn of(report: &StepReport<'_>) -> Self {
        Self {
            time: report.time,
            state: report.state.clone(),
            diagnostics: report.diagnostics.cloned(),
            impacts: report.impacts.to_vec(),
            sample: report.sample.cloned(),
        }
    }
}

/// All steps of a run, the start first, and what it amounted to.
///
/// # Panics
/// If the run fails.
#[must_use]
pub fn record(scene: &Scene) -> (Vec<Step>, Outcome) {
    let mut steps = Vec::new();
    let outcome = run(scene, |report| steps.push(Step::of(report)));
    (steps, outcome)
}

/// All bits of a state, in order: equal if and only if the states are the same to the last bit.
#[must_use]
pub fn bits(state: &State) -> Vec<u64> {
    let columns = [&state.position, &state.velocity].into_iter().flat_map(|columns| columns.axes());
    columns.chain(state.temperature.as_deref()).flatten().map(|x| x.to_bits()).collect()
}

/// Order of convergence that two errors show whose steps differ by `ratio`.
#[must_use]
pub fn order(coarse: f64, fine: f64, ratio: f64) -> f64 {
    (coarse / fine).ln() / ratio.ln()
}

/// Random numbers for tests (SplitMix64): the same on every machine.
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Three components, each uniform in [low, high).
    pub fn vector(&mut self, low: f64, high: f64) -> [f64; 3] {
        [self.between(low, high), self.between(low, high), self.between(low, high)]
    }
}
