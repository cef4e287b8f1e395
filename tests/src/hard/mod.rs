//! Hard cases: what is right, and what each scheme makes of it. Tests assert this table, `docs/hard-cases.md` prints it.

mod fields;
mod impacts;
mod rest;
mod symmetry;
mod thermal;

use crate::Step;
use agglo_core::{Outcome, Scene, Simulation};
use serde_json::{Value, json};

/// A way to solve a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// `consistent` with an integrator, impacts and crossings located in time.
    Consistent(&'static str),
    /// The model `paper`.
    Paper,
}

/// Every scheme, the default of scenes with impacts first.
pub const SCHEMES: [Scheme; 6] = [
    Scheme::Consistent("velocity-verlet"),
    Scheme::Consistent("trapezoidal"),
    Scheme::Consistent("backward-euler"),
    Scheme::Consistent("gauss-legendre"),
    Scheme::Consistent("gauss-radau"),
    Scheme::Paper,
];

/// What a scheme's answer to a hard case is like.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// It has one.
    Found {
        /// What was measured, in words.
        measured: String,
        /// Its distance from the right answer.
        error: f64,
        /// The distance up to which it is right.
        bound: f64,
    },
    /// It says by name that it cannot.
    Refused(String),
}

/// How an answer is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judgement {
    /// Within its bound.
    Right,
    /// A wrong number.
    Wrong,
    /// A named error instead of a number.
    Refused,
}

impl Answer {
    /// An answer that is right if `error` is at most `bound`.
    #[must_use]
    pub fn found(measured: impl Into<String>, error: f64, bound: f64) -> Self {
        Self::Found { measured: measured.into(), error, bound }
    }

    /// Right, wrong or refused.
    #[must_use]
    pub fn judgement(&self) -> Judgement {
        match self {
            Self::Refused(_) => Judgement::Refused,
            Self::Found { error, bound, .. } if error <= bound => Judgement::Right,
            Self::Found { .. } => Judgement::Wrong,
        }
    }
}

/// An answer, or the words with which a scheme refused the scene or gave up its run.
pub type Solved = Result<Answer, String>;

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct HardCase {
    /// Its name, that of its test.
    pub name: &'static str,
    /// The situation.
    pub case: &'static str,
    /// What is right.
    pub right: &'static str,
    solve: fn(Scheme) -> Solved,
}

impl HardCase {
    /// What a scheme makes of it.
    #[must_use]
    pub fn answer(&self, scheme: Scheme) -> Answer {
        (self.solve)(scheme).unwrap_or_else(Answer::Refused)
    }
}

/// The hard cases, in the order of the page.
pub const CASES: &[HardCase] = &[
    fields::TEN_THOUSAND_PERIODS,
    impacts::HEAD_ON,
    impacts::OBLIQUE,
    impacts::FASTER_THAN_A_DIAMETER,
    impacts::BREAK_SHOT,
    impacts::CRADLE,
    rest::COLLAPSE_OF_THREE,
    rest::BALL_TO_REST,
    rest::SLOW_DECAY,
    rest::ATTRACTED_PAIR,
    rest::RESTING_CLUSTER,
    rest::ORBIT_WITH_FRICTION,
    impacts::OVERLAP,
    fields::VIOLENT_RELEASE,
    fields::CROSSINGS,
    thermal::TINY_HOT_SPHERE,
    thermal::BEYOND_THETA_STAR,
    thermal::FREE_COOLING,
    symmetry::PERMUTED,
    symmetry::MIRRORED,
    symmetry::SHIFTED,
    symmetry::TWO_HALVES,
    symmetry::ALMOST_NOTHING,
];

impl Scheme {
    /// Its name in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent(integrator) => integrator,
            Self::Paper => "paper",
        }
    }

    /// Whether it is of high order: it collocates.
    fn collocates(self) -> bool {
        matches!(self, Self::Consistent("gauss-legendre" | "gauss-radau"))
    }

    /// A scene as this scheme solves it.
    fn scene(self, value: &Value) -> Value {
        let mut value = value.clone();
        match self {
            Self::Consistent(integrator) => {
                value["solver"]["integrator"] = json!(integrator);
                if value.get("contact").is_some() {
                    value["contact"]["resolution"] = json!("located");
                }
            }
            Self::Paper => {
                value["model"] = json!("paper");
                if let Some(contact) = value.get_mut("contact").and_then(Value::as_object_mut) {
                    contact.remove("rest_speed");
                    contact.insert("duration".to_owned(), json!({ "step_fraction": 0.01 }));
                }
            }
        }
        value
    }

    /// All steps of a run, the start first, and what it amounted to.
    fn record(self, value: &Value) -> Result<(Vec<Step>, Outcome), String> {
        let mut steps = Vec::new();
        let outcome = self.run(value, |report| steps.push(Step::of(report)))?;
        Ok((steps, outcome))
    }

    /// Runs a scene; watched, it keeps nothing.
    fn run(self, value: &Value, watch: impl FnMut(&agglo_core::StepReport<'_>)) -> Result<Outcome, String> {
        let outcome = self.start(value)?.run(&mut crate::Watch(watch)).map_err(|error| error.to_string())?;
        let energy = outcome.sample.ledger.balance();
        if energy.is_finite() { Ok(outcome) } else { Err(format!("an energy of {energy} J")) }
    }

    fn start(self, value: &Value) -> Result<Simulation, String> {
        let scene = Scene::parse(&self.scene(value).to_string(), &[])
            .map_err(|problems| problems.first().map_or_else(String::new, ToString::to_string))?;
        Simulation::new(&scene).map_err(|error| error.to_string())
    }
}

/// A sphere of 0.1 m diameter and 1 kg.
fn ball(position: [f64; 3], velocity: [f64; 3]) -> Value {
    json!({ "position": position, "velocity": velocity, "radius": 0.05, "mass": 1.0 })
}

/// Spheres that collide with restitution e, in fixed steps [s].
fn balls(list: &[Value], duration: f64, dt: f64, e: impl Into<Value>) -> Value {
    json!({
        "duration": duration, "particles": { "list": list }, "contact": { "restitution": e.into() },
        "solver": { "step": { "fixed": dt } }
    })
}

/// Velocities at the end of a run.
fn last_velocities(steps: &[Step]) -> Vec<nalgebra::Vector3<f64>> {
    let v = &steps[steps.len() - 1].state.velocity;
    (0..v.len()).map(|i| v.get(i)).collect()
}

/// The larger of two errors; NaN is the largest.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
