//! Comparing two logs: headers and scenes first, then the data, step by step or by time.
//!
//! What was not compared is never taken for the same: it is named, and the verdict is not [`Verdict::Same`] unless it is
//! ignored by name.

mod around;
mod by_time;
mod cause;
mod compare;
mod curves;
mod growth;
mod report;
mod settings;
mod statistics;
mod steps;
mod tolerance;

use std::io::{Read, Seek};

use agglo_core::scene::Scene;
use agglo_core::state::Particles;
use agglo_record::channels::{CHANNELS, Topic};

use crate::error::LogError;
use crate::fields;
use crate::log::Log;
use crate::messages::{Message, RawMessage};
use by_time::ByTime;
pub use cause::Cause;
use compare::Comparison;
pub use compare::{Exactness, FieldReport};
pub use curves::Curves;
use growth::Growth;
pub use growth::Rate;
pub use report::{First, Profile, Report, Structure, Verdict};
pub use settings::{Kind, Setting, text as setting_text};
pub use statistics::{Band, Judgement, LEAST_REFERENCES, Statistics, judge};
use steps::{RawStep, RawSteps};
pub use tolerance::{Scale, Tolerance, Tolerances};

/// Times that differ by less than this part of them are the same [-].
const SAME_TIME: f64 = 1e-9;

/// Compares log `a` with log `b`, the reference. `watch` sees time [s] and number of every
/// step.
///
/// # Errors
/// A log that cannot be read at all, or a device that fails. Damage, and what makes logs incomparable, are part of the
/// answer.
pub fn diff<R: Read + Seek>(
    a: &mut Log<R>,
    b: &mut Log<R>,
    profile: Profile,
    tolerances: Tolerances,
    mut watch: impl FnMut(f64, u64),
) -> Result<Report, LogError> {
    let mut report = Report::new(profile);
    let (scene_a, scene_b) = (a.scene(), b.scene());
    report.settings = settings::headers(a.run(), b.run());
    let (scene_a, scene_b) = match (scene_a, scene_b) {
        (Ok(scene_a), Ok(scene_b)) => {
            report.settings.extend(settings::scenes(&scene_a, &scene_b)?);
            (Some(scene_a), Some(scene_b))
        }
        (scene_a, scene_b) => {
            for (error, damage) in [(scene_a.err(), &mut report.damage_a), (scene_b.err(), &mut report.damage_b)] {
                match error {
                    Some(LogError::Damaged(lost)) => damage.push(lost),
                    Some(other) => return Err(other),
                    None => {}
                }
            }
            (None, None)
        }
    };
    if a.run().particles != b.run().particles {
        let (left, right) = (a.run().particles, b.run().particles);
        return Ok(report.incomparable(format!("the first log has {left} particles and the second {right}")));
    }
    let scenes_agree = !report.settings.iter().any(|setting| !matches!(setting.kind, Kind::Packing | Kind::Build));
    let around = if profile == Profile::Exact { around::differences(a, b, scenes_agree)? } else { Vec::new() };
    let exactness = if profile == Profile::Exact { Exactness::Bits } else { Exactness::Tolerances };
    let comparison = Comparison::new(exactness, tolerances);
    let pass = Pass {
        report,
        comparison,
        around,
        growth: Growth::default(),
        parted: None,
        particles: None,
        scene: scene_b.as_ref(),
    };
    let (mut report, parted) = pass.run(a, b, &mut watch)?;
    if let (Some((t, step, particle)), Some(scene)) = (parted, scene_a.as_ref()) {
        report.cause = cause::find(a, scene, t, step, particle)?;
    }
    Ok(report)
}

/// What of some channels is drawn from states: a state that is the same within tolerances may be drawn in another colour.
fn drawings(topics: &[Topic]) -> Vec<String> {
    let colours = ["red", "green", "blue", "alpha"].map(|colour| format!("/particles.{colour}"));
    let scene = topics.contains(&Topic::Scene).then(|| CHANNELS[Topic::Scene as usize].name.to_owned());
    scene.into_iter().flat_map(|scene| std::iter::once(scene).chain(colours.clone())).collect()
}

/// Time [s], step and, where it is known, particle.
type Parting = (f64, u64, Option<usize>);

/// One reading of both logs.
struct Pass<'a> {
    report: Report,
    comparison: Comparison,
    /// What differs around the messages: its name, and how.
    around: Vec<(String, String)>,
    growth: Growth,
    /// Where states first differ.
    parted: Option<Parting>,
    particles: Option<Particles>,
    scene: Option<&'a Scene>,
}

/// Why one of two logs does not have a step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Only {
    A,
    B,
}

impl Pass<'_> {
    fn run<R: Read + Seek>(
        mut self,
        a: &mut Log<R>,
        b: &mut Log<R>,
        watch: &mut dyn FnMut(f64, u64),
    ) -> Result<(Report, Option<Parting>), LogError> {
        let (damage_a, damage_b) = (a.file_damage()?, b.file_damage()?);
        let topics = |log: &Log<R>| log.channels.values().filter_map(|channel| channel.topic).collect::<Vec<_>>();
        let known: Vec<Topic> = topics(a).into_iter().chain(topics(b)).collect();
        for &topic in &known {
            // An entry for a whole channel refers to what either log describes, messages or not.
            self.comparison.tolerances.ignores(CHANNELS[topic as usize].name);
        }
        let (mut left, mut right) = (RawSteps::new(a.raw_messages()), RawSteps::new(b.raw_messages()));
        let (mut x, mut y) = (left.step()?, right.step()?);
        let mut by_time = self.cadence_differs().then(ByTime::default);
        loop {
            if let Some(first) = &x {
                watch(first.t, first.step);
            }
            match (x.take(), y.take()) {
                (None, None) => break,
                (Some(first), Some(second)) if first.step == second.step && by_time.is_none() => {
                    if self.steps_part(&first, &second) {
                        by_time = Some(ByTime::default());
                        self.report.by_time_from = Some(first.t.min(second.t));
                        (x, y) = (Some(first), Some(second));
                        continue;
                    }
                    self.step(&first, &second);
                    (x, y) = (left.step()?, right.step()?);
                }
                (first, second) if by_time.is_some() => {
                    // The log that is behind goes first.
                    let take_a = match (&first, &second) {
                        (Some(first), Some(second)) => first.t <= second.t,
                        (first, _) => first.is_some(),
                    };
                    let by_time = by_time.get_or_insert_default();
                    if take_a {
                        by_time.a(first.as_ref(), &mut self);
                        (x, y) = (left.step()?, second);
                    } else {
                        by_time.b(second.as_ref(), &mut self);
                        (x, y) = (first, right.step()?);
                    }
                }
                (Some(first), second) if second.as_ref().is_none_or(|second| first.step < second.step) => {
                    if !right.gap {
                        self.only(&first, Only::A);
                    }
                    (x, y) = (left.step()?, second);
                }
                (first, Some(second)) => {
                    if !left.gap {
                        self.only(&second, Only::B);
                    }
                    (x, y) = (first, right.step()?);
                }
                (Some(_), None) => break, // taken by the arm before last
            }
        }
        if let Some(by_time) = by_time {
            by_time.finish(&mut self);
        }
        for (steps, which) in [(&left, "first"), (&right, "second")] {
            if let Some((at, channel)) = &steps.unordered {
                self.report.structure(channel, &format!("steps of the {which} log are out of order"), *at);
            }
        }
        let Self { mut report, mut comparison, around, growth, parted, .. } = self;
        report.damage_a.extend(left.damage.into_iter().chain(damage_a));
        report.damage_b.extend(right.damage.into_iter().chain(damage_b));
        for damage in [&mut report.damage_a, &mut report.damage_b] {
            damage.sort_by_key(|lost| lost.offset);
            damage.dedup();
        }
        report.growth = growth.rate();
        if report.profile == Profile::State {
            report.drawn = drawings(&known);
        }
        let around = around.into_iter().filter(|(name, _)| !comparison.tolerances.ignores(name)).collect();
        Self::conclude(&mut report, comparison, around);
        Ok((report, parted))
    }

    /// Whether the scenes ask for states at other steps or times.
    fn cadence_differs(&mut self) -> bool {
        let cadence = |setting: &Setting| matches!(setting.name.as_str(), "/record/every_steps" | "/record/interval");
        let differs = self.report.profile == Profile::State && self.report.settings.iter().any(cadence);
        if differs {
            self.report.by_time_from = Some(0.0);
        }
        differs
    }

    /// Whether steps of the same number end at other times, so that states have to be compared by time.
    fn steps_part(&self, a: &RawStep, b: &RawStep) -> bool {
        self.report.profile == Profile::State && (a.t - b.t).abs() > SAME_TIME * a.t.abs().max(b.t.abs())
    }

    fn conclude(report: &mut Report, comparison: Comparison, around: Vec<(String, String)>) {
        let unmatched = comparison.tolerances.unmatched();
        report.ignored = comparison.tolerances.ignored();
        report.fields = comparison.finish();
        if report.compared_steps == 0 && report.verdict == Verdict::Same {
            report.verdict = Verdict::Incomparable("the two logs share no whole step".to_owned());
        }
        if let [first, ..] = &unmatched[..] {
            let known = report.fields.iter().map(|field| format!("{}.{}", field.channel, field.field));
            let near = known.min_by_key(|known| strsim::levenshtein(known, first));
            let hint = near.map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
            let why = format!("the tolerance for `{first}` matches nothing in either log{hint}");
            report.verdict = Verdict::Incomparable(why);
        }
        let exact = report.profile == Profile::Exact;
        let decides = |setting: &Setting| exact && !matches!(setting.kind, Kind::Packing | Kind::Build);
        if let Some(setting) = report.settings.iter().find(|setting| decides(setting)) {
            let what = format!("the scenes differ in {}", setting.name);
            let first = First { t: 0.0, step: Some(0), channel: "scene.json".to_owned(), value: None, what };
            report.first.get_or_insert(first);
            if report.verdict == Verdict::Same {
                report.verdict = Verdict::Differ;
            }
        }
        for (name, what) in around {
            report.structure(&name, &what, (0.0, 0));
        }
        let failed = report.fields.iter().any(|field| !field.passed) || !report.structure.is_empty();
        if report.verdict == Verdict::Same && (failed || !report.not_compared.is_empty()) {
            report.verdict = Verdict::Differ;
        }
    }

    /// A step that only one log has.
    fn only(&mut self, step: &RawStep, which: Only) {
        let first = step.messages.iter().find(|message| !self.comparison.tolerances.ignores(&message.channel.name));
        if let Some(first) = first {
            let other = if which == Only::A { "second" } else { "first" };
            let what = format!("the {other} log does not have the step");
            self.report.structure(&first.channel.name, &what, (step.t, step.step));
        }
    }

    /// Compares a step that both logs have.
    fn step(&mut self, a: &RawStep, b: &RawStep) {
        self.report.compared_steps += 1;
        let same = |(a, b): (&RawMessage, &RawMessage)| {
            a.channel.name == b.channel.name && a.data == b.data && stamps(a) == stamps(b)
        };
        // Fields are listed once for every channel, though all messages may be the same.
        let listed = b.messages.iter().filter_map(|m| m.channel.topic).all(|topic| self.comparison.knows(topic));
        if listed && a.messages.len() == b.messages.len() && a.messages.iter().zip(&b.messages).all(same) {
            b.messages.iter().filter_map(|message| message.channel.topic).for_each(|topic| self.comparison.same(topic));
            return;
        }
        let mut names: Vec<&str> = Vec::new();
        for message in a.messages.iter().chain(&b.messages) {
            if !names.contains(&&*message.channel.name) {
                names.push(&message.channel.name);
            }
        }
        for name in &names {
            if self.comparison.tolerances.ignores(name) {
                continue;
            }
            let of = |step: &RawStep| -> Vec<RawMessage> {
                step.messages.iter().filter(|message| &*message.channel.name == *name).cloned().collect()
            };
            self.channel(name, &of(a), &of(b), (b.t, b.step));
        }
        let order = |step: &RawStep| -> Vec<_> {
            let rank = |message: &RawMessage| names.iter().position(|name| *name == &*message.channel.name);
            step.messages.iter().filter_map(rank).collect()
        };
        let count = |step: &RawStep, name: &&str| step.messages.iter().filter(|m| &*m.channel.name == *name).count();
        let complete = names.iter().all(|name| count(a, name) == count(b, name));
        let (first, second) = (order(a), order(b));
        let moved = first.iter().zip(&second).find(|(first, second)| first != second).and_then(|(_, &k)| names.get(k));
        if let (true, Some(name)) = (complete, moved) {
            self.report.structure(name, "the messages of the step are in another order", (b.t, b.step));
        }
        self.distance(a, b);
    }

    /// Compares the messages that a step has on one channel.
    fn channel(&mut self, name: &str, a: &[RawMessage], b: &[RawMessage], at: (f64, u64)) {
        for (first, second) in a.iter().zip(b) {
            self.message(name, first, second, at);
        }
        if a.len() != b.len() {
            let other = if a.len() > b.len() { "second" } else { "first" };
            self.report.structure(name, &format!("the {other} log does not have the message"), at);
        }
    }

    fn message(&mut self, name: &str, a: &RawMessage, b: &RawMessage, (t, step): (f64, u64)) {
        let exact = self.report.profile == Profile::Exact;
        let bytes = a.data == b.data;
        // Log times follow from times: where these differ, they do as well.
        let at_once = a.key().map(|(t, _)| t.to_bits()) == b.key().map(|(t, _)| t.to_bits());
        let scaled = self.report.settings.iter().any(|setting| setting.name == "/record/time_scale");
        let stamped = stamps(a) == stamps(b) || !exact && (scaled || !at_once);
        let Some(topic) = b.channel.topic else {
            if !bytes {
                self.report.structure(name, "a message that this version does not know differs", (t, step));
            }
            self.stamp(name, stamped, (t, step));
            return;
        };
        if bytes && self.comparison.knows(topic) {
            self.comparison.same(topic);
            self.stamp(name, stamped, (t, step));
            return;
        }
        let (first, second) = match (a.decode(), b.decode()) {
            (Ok(Some(first)), Ok(Some(second))) => (first, second),
            _ => {
                self.report.structure(name, "the message makes no sense in one of the logs", (t, step));
                return;
            }
        };
        let beyond = self.comparison.entries(&first, &second);
        if let Some(value) = beyond {
            if topic == Topic::Particles && self.parted.is_none() {
                self.parted = Some((t, step, value.index));
            }
            let what = value.to_string();
            self.report.first(First { t, step: Some(step), channel: name.to_owned(), value: Some(value), what });
        } else if exact && !bytes && fields::first_difference(&first, &second).is_none() {
            // What is drawn, or what a later version added, has no values here.
            self.report.structure(name, "what of the message is compared by its bytes differs", (t, step));
        }
        self.stamp(name, stamped, (t, step));
    }

    fn stamp(&mut self, name: &str, right: bool, at: (f64, u64)) {
        if !right {
            self.report.structure(name, "the message has another log or publish time", at);
        }
    }

    /// Takes the distance of the states of a step, for the rate at which runs part.
    fn distance(&mut self, a: &RawStep, b: &RawStep) {
        if self.particles.is_none()
            && let Some(Message::Static(particles)) = b.get(Topic::ParticlesStatic)
        {
            self.particles = Some(particles);
        }
        let raw = |step: &RawStep| step.messages.iter().find(|m| m.channel.topic == Some(Topic::Particles)).cloned();
        let Some(particles) = &self.particles else { return };
        let (Some(first), Some(second)) = (raw(a), raw(b)) else { return };
        if first.data == second.data {
            return;
        }
        let (Some(Message::Particles(first)), Some(Message::Particles(second))) =
            (a.get(Topic::Particles), b.get(Topic::Particles))
        else {
            return;
        };
        let n = first.position.len().min(second.position.len()).min(particles.len());
        if n == 0 {
            return;
        }
        let square = |k: usize| (first.position.get(k) - second.position.get(k)).norm_squared();
        let mean = (0..n).map(square).sum::<f64>() / n as f64;
        self.growth.add(b.t, mean.sqrt() / particles.mean_diameter());
    }
}

/// When a message is said to have been logged and published [ns].
fn stamps(message: &RawMessage) -> (u64, u64) {
    (message.log_time, message.publish_time)
}
