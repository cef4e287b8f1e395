//! `agglo check`: what can be said about a scene before it is solved.

use std::fmt::Write;

use agglo_core::Scene;
use agglo_core::assembly::{integrator, step_limits};
use agglo_core::characteristics::{
    Equilibrium, PairCharacteristics, SuggestedStep, Survey, cutoff_of, suggest_step, survey,
};
use agglo_core::domain::Domain;
use agglo_core::force::Field;
use agglo_core::placement::place;
use agglo_core::state::{Particles, State};
use agglo_record::channels::Effects;
use serde_json::{Value, json};

use crate::args::CheckArgs;
use crate::expectation::{Expectation, expect};
use crate::failure::{CommandResult, Message};
use crate::input::{self, LoadedScene};
use crate::numbers::{counted, short};
use crate::output;
use crate::size;
use crate::target::Target;
use crate::terminal::Terminal;
use crate::terms::terms;

/// Runs the command.
///
/// # Errors
/// All that is wrong with the scene, overlaps included.
pub fn check(args: &CheckArgs, terminal: &Terminal) -> CommandResult {
    let loaded = input::load(&args.scene.scene, &args.scene.set)?;
    let success = loaded.success(terminal);
    let (particles, state) = place(&loaded.scene).map_err(|error| loaded.failure(error.problems))?;
    let report = Report::new(&loaded, particles, state);
    let text = if args.json { format!("{:#}\n", report.json()) } else { report.text() };
    output::write_all(&Target::Standard, false, text.as_bytes())?;
    for warning in report.survey.warnings(report.scene) {
        terminal.warning(&Message::new(warning).file(&loaded.file));
    }
    Ok(success)
}

/// All that is said of a scene.
struct Report<'a> {
    scene: &'a Scene,
    file: &'a str,
    particles: Particles,
    survey: Survey,
    step: SuggestedStep,
    expectation: Expectation,
    channels: Vec<&'static str>,
    /// Order of the expansions that sum the near field, where the scene allows an error.
    far: Option<Option<usize>>,
}

impl<'a> Report<'a> {
    fn new(loaded: &'a LoadedScene, particles: Particles, state: State) -> Self {
        let scene = &loaded.scene;
        let survey = survey(scene, &particles);
        Self {
            scene,
            file: &loaded.file,
            step: suggest_step(scene, &particles, &state, &survey),
            expectation: expect(scene, &particles),
            channels: channels(scene, particles.len()),
            far: scene.near_field.as_ref().and_then(|near| near.accuracy).map(|_| {
                let periodic = Domain::new(scene.domain.as_ref()).periodic;
                Field::new(scene, &particles, &state.position, &periodic).and_then(|field| field.far_order())
            }),
            survey,
            particles,
        }
    }

    fn text(&self) -> String {
        let mut text = String::new();
        let mut row = |name: &str, value: String| _ = writeln!(text, "{name:<10} {value}");
        let name = self.scene.name.as_deref().map(|name| format!(": {name}")).unwrap_or_default();
        row("scene", format!("{}{name}", self.file));
        row("model", format!("{}, {}", word(&self.scene.model), word(&integrator(self.scene))));
        let spans = [("radius", &self.particles.radius, "m"), ("mass", &self.particles.mass, "kg")];
        let spans = spans.map(|(name, column, unit)| format!("{name} {} {unit}", span(column.iter().copied())));
        let count = counted(self.particles.len() as u64, "sphere");
        row("particles", format!("{count}, {}; no overlap", spans.join(", ")));
        for (name, value) in terms(self.scene) {
            row(name, value);
        }
        if !self.survey.pairs.is_empty() {
            row("d_e", self.equilibrium("(8)", |p| p.equilibrium));
            if self.scene.near_field.is_some() {
                row("d*", self.inflection());
            }
            if self.scene.binding.is_some() {
                row("d_a", self.equilibrium("(15)", |p| p.bonded));
                row("contact", format!("at {} m, bonds up to {} m", self.touching(), self.activation()));
            }
            if !self.survey.complete {
                row("pairs", format!("the extreme ones of {} kinds of spheres", self.survey.kinds));
            }
        }
        if let Some(far) = self.far {
            let how = match far {
                Some(order) => format!("by expansions of order {order}"),
                None => "pair by pair: too few particles, or too small an error".to_owned(),
            };
            row("near field", format!("summed {how}"));
        }
        let (initial, max, min) = step_limits(self.scene);
        let given = match self.scene.solver.step.fixed {
            Some(fixed) => format!("{} s, fixed", short(fixed)),
            None => format!("{} s, from {} to {} s", short(initial), short(min), short(max)),
        };
        row("step", format!("{given}; suggested: {} s ({})", short(self.step.seconds), self.step.limit));
        let expectation = &self.expectation;
        let steps = format!("{} s in {}", short(self.scene.duration), counted(expectation.steps, "step"));
        let fewest = if expectation.fewest_steps < expectation.steps {
            format!(" of the first size, {} at least", expectation.fewest_steps)
        } else {
            String::new()
        };
        row("run", format!("{steps}{fewest}"));
        row("channels", self.channels.join(" "));
        let (fewest, expected) = (size::human(expectation.fewest.total), size::human(expectation.expected.total));
        let range = if fewest == expected { expected } else { format!("{fewest} to {expected}") };
        let state = size::human(expectation.expected.per_frame as u64);
        let least = size::human(expectation.least_log);
        let repeated = format!("numbers that repeat take less, {least} at the least");
        row("log", format!("about {range}, {state} a recorded step; {repeated}"));
        text
    }

    fn equilibrium(&self, equation: &str, of: impl Fn(&PairCharacteristics) -> Option<Equilibrium>) -> String {
        let found: Vec<Equilibrium> = self.survey.pairs.iter().filter_map(of).collect();
        if found.is_empty() {
            return format!("none {equation}");
        }
        let distance = span(found.iter().map(|e| e.distance));
        let periods = span(found.iter().filter_map(|e| e.period));
        let stable = match found.iter().filter(|e| e.stable).count() {
            0 => "unstable".to_owned(),
            some if some == found.len() => format!("stable, natural period {periods} s"),
            some => format!("{some} of {} kinds of pairs stable, natural period {periods} s", found.len()),
        };
        format!("{distance} m {equation}, {stable}")
    }

    fn inflection(&self) -> String {
        let found = || self.survey.pairs.iter().filter_map(|p| p.inflection);
        if found().next().is_none() { "none (12)".to_owned() } else { format!("{} m (12)", span(found())) }
    }

    fn touching(&self) -> String {
        span(self.survey.pairs.iter().map(|p| p.law.touching))
    }

    fn activation(&self) -> String {
        span(self.survey.pairs.iter().filter_map(|p| p.law.activation))
    }

    fn json(&self) -> Value {
        let equilibrium = |e: Option<Equilibrium>| {
            e.map(
                |e| json!({ "distance": e.distance, "stable": e.stable, "stiffness": e.stiffness, "period": e.period }),
            )
        };
        let pair = |p: &PairCharacteristics| {
            json!({
                "particles": [p.pair.0, p.pair.1], "d_e": equilibrium(p.equilibrium), "d_star": p.inflection,
                "d_a": equilibrium(p.bonded), "cutoff": cutoff_of(self.scene, &p.law), "contact": p.law.touching,
                "activation": p.law.activation,
            })
        };
        let (initial, max, min) = step_limits(self.scene);
        let terms: serde_json::Map<String, Value> =
            terms(self.scene).into_iter().map(|(name, value)| (name.to_owned(), value.into())).collect();
        json!({
            "format": 1, "file": self.file, "name": self.scene.name, "model": self.scene.model,
            "integrator": integrator(self.scene), "expansion_order": self.far.flatten(), "particles": self.particles.len(), "overlaps": 0, "terms": terms,
            "pairs": self.survey.pairs.iter().map(pair).collect::<Vec<_>>(), "all_kinds_of_pairs": self.survey.complete,
            "step": { "initial": initial, "max": max, "min": min, "suggested": self.step.seconds,
                      "limit": self.step.limit.to_string() },
            "steps": self.expectation.steps, "fewest_steps": self.expectation.fewest_steps, "channels": self.channels,
            "log_bytes": self.expectation.expected.total, "least_log_bytes": self.expectation.least_log,
            "log_bytes_per_record": self.expectation.expected.per_frame,
            "warnings": self.survey.warnings(self.scene),
        })
    }
}

/// Names of the channels that the scene's log has.
fn channels(scene: &Scene, particles: usize) -> Vec<&'static str> {
    agglo_record::channels::present(&Effects::new(scene, particles)).map(|channel| channel.name).collect()
}

/// One number where all are equal, else the least and the largest.
fn span(values: impl Iterator<Item = f64>) -> String {
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        (low, high) = (low.min(value), high.max(value));
    }
    let (low, high) = (short(low), short(high));
    if low == high { low } else { format!("{low} to {high}") }
}

/// The word that a scene uses for a choice.
pub fn word(choice: &impl serde::Serialize) -> String {
    match serde_json::to_value(choice) {
        Ok(Value::String(word)) => word,
        _ => String::new(),
    }
}
