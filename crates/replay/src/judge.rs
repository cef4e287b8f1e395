//! What the messages of a log owe to its scene and to each other, beyond what their checksums tell: steps that follow each
//! other, every message of a step once and in its place, states when they are due, an end that is the scene's.

mod due;
mod judged;
mod shape;

use std::io::{Read, Seek};

use agglo_core::checkpoint::Counters;
use agglo_core::scene::{Record, Scene};
use agglo_record::channels::{CHANNELS, Effects, Topic, present};
use agglo_record::run::log_time;

use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::{Entry, Message, RawMessage};
pub use shape::Shape;

/// Faults that are named one by one; beyond it they are counted.
const NAMED: usize = 1000;
/// Times closer than this share of a run's duration are not told apart [-].
const SAME_TIME: f64 = 1e-9;
/// A run may end this share of a step before its duration [-]; the solver's own share is a tenth of it.
const END: f64 = 1e-5;

/// Which messages a step has, by the place of their channel in the table.
type Seen = [bool; CHANNELS.len()];

/// What a scene says about its log.
#[derive(Clone, Debug)]
struct Plan {
    record: Record,
    duration: f64,
    /// Channels that the scene's effects switch on.
    present: Seen,
}

/// A step whose messages are gathered.
#[derive(Clone, Copy, Debug)]
struct Step {
    number: u64,
    t: f64,
    offset: u64,
    seen: Seen,
    /// Whether some of it may be lost for a reason that is known.
    excused: bool,
}

/// Steps that lack the same messages.
#[derive(Clone, Copy, Debug)]
struct Lacking {
    what: Seen,
    first: Step,
    last: u64,
    count: u64,
}

/// Watches the messages of a log go by.
#[derive(Debug)]
pub struct Judge {
    plan: Option<Plan>,
    shape: Option<Shape>,
    time_scale: f64,
    /// Channels whose messages go by.
    shown: Seen,
    step: Option<Step>,
    /// Number and time of the last step that is over, and the time of the one before it [s].
    before: Option<(u64, f64, f64)>,
    /// Whether something was lost since the last step that is over.
    excused: bool,
    lacking: Option<Lacking>,
    /// Interval of log time that was drawn last.
    drawn: Option<u64>,
    /// Sums since the start, as far as nothing was lost.
    sums: Option<Counters>,
    /// Whether the last message says why the run ended early.
    ended_early: bool,
    /// From when to when something may be lost or wrong [s].
    lost: Option<(f64, f64)>,
    found: Vec<Damage>,
    /// Faults that were named.
    named: usize,
    /// Faults beyond those that are named, and where the first of them is.
    more: Option<(u64, u64)>,
}

impl<R: Read + Seek> Log<R> {
    /// A judge of messages on some channels; of a log whose scene is lost, what needs no scene is judged.
    ///
    /// # Errors
    /// A device that fails.
    pub(crate) fn judge(&mut self, shown: &[Topic]) -> Result<Judge, LogError> {
        let scene = match self.scene() {
            Err(LogError::Io(error)) => return Err(error.into()),
            other => other.ok(),
        };
        Ok(Judge::new(scene.as_ref(), self.run().time_scale, shown))
    }
}

/// All channels.
pub const ALL: [Topic; CHANNELS.len()] = {
    let mut all = [Topic::Log; CHANNELS.len()];
    let mut k = 0;
    while k < all.len() {
        all[k] = CHANNELS[k].topic;
        k += 1;
    }
    all
};

impl Judge {
    fn new(scene: Option<&Scene>, time_scale: f64, topics: &[Topic]) -> Self {
        let mut shown = [false; CHANNELS.len()];
        topics.iter().for_each(|topic| shown[*topic as usize] = true);
        let known = scene.and_then(|scene| Some((scene, Effects::of(scene).ok()?)));
        let plan = known.map(|(scene, effects)| {
            let mut on = [false; CHANNELS.len()];
            present(&effects).for_each(|channel| on[channel.topic as usize] = true);
            Plan { record: scene.record.clone(), duration: scene.duration, present: on }
        });
        Self {
            shape: known.map(|(scene, effects)| Shape::new(scene, &effects)),
            plan,
            time_scale,
            shown,
            step: None,
            before: None,
            excused: false,
            lacking: None,
            drawn: None,
            sums: Some(Counters::default()),
            ended_early: false,
            lost: None,
            found: Vec::new(),
            named: 0,
            more: None,
        }
    }

    /// Takes a message of the chunk at `offset`, as it stands there. One that says no step is for who decodes it to report.
    pub fn message(&mut self, message: &RawMessage, offset: u64) {
        let Some(topic) = message.channel.topic else { return };
        let Some((t, number)) = message.key() else { return self.lose() };
        self.ended_early = false;
        if topic == Topic::Log {
            // Said of a step, or of how the run ended: it begins none.
            return;
        }
        if self.step.is_none_or(|step| step.number != number) {
            self.begin(t, number, offset);
        }
        let Some(step) = &mut self.step else { return };
        let (k, of, seen) = (topic as usize, step.t, step.seen);
        step.seen[k] = true;
        let name = CHANNELS[k].name;
        if seen[k] {
            self.fault(offset, || format!("step {number} has two messages on {name}"));
        } else if let Some(behind) = (k + 1..seen.len()).find(|later| seen[*later]) {
            self.fault(offset, || format!("in step {number}, {name} stands behind {}", CHANNELS[behind].name));
        }
        let due = log_time(t, self.time_scale);
        if t.to_bits() != of.to_bits() {
            self.fault(offset, || format!("step {number} is of t = {of} s, and its message on {name} of {t} s"));
        } else if (message.log_time, message.publish_time) != (due, due) {
            let (log_time, publish_time) = (message.log_time, message.publish_time);
            let what = format!(
                "the message on {name} of step {number} has the log time {log_time} ns and the publish time \
                 {publish_time} ns, and belongs to {due} ns"
            );
            self.fault(offset, || what);
        }
        if message.data.is_empty() {
            self.fault(offset, || format!("the message on {name} in step {number} is empty"));
        }
        if topic == Topic::Checkpoint {
            // The last message of its step.
            self.close();
        }
    }

    /// Takes what the message that went by last says; `false` where that makes no sense for the scene.
    pub fn entry(&mut self, entry: &Entry, offset: u64) -> bool {
        if let Some(what) = self.shape.as_ref().and_then(|shape| shape.fault(entry)) {
            self.fault(offset, || what);
            self.sums = None;
            return false;
        }
        match &entry.message {
            Message::Diagnostics(diagnostics) => {
                if let Some(sums) = &mut self.sums {
                    sums.steps = sums.steps.saturating_add(1);
                    sums.iterations = sums.iterations.saturating_add(diagnostics.iterations());
                    sums.rejected_steps = sums.rejected_steps.saturating_add(diagnostics.rejected.len() as u64);
                }
            }
            Message::Impacts(impacts) => {
                if let Some(sums) = &mut self.sums {
                    sums.impacts = sums.impacts.saturating_add(impacts.len() as u64);
                }
            }
            Message::Checkpoint(checkpoint) => self.count(entry.step, &checkpoint.counters, offset),
            Message::Log(_) => self.ended_early = entry.message.ends_early(),
            _ => {}
        }
        true
    }

    /// Compares what has gone by with what a checkpoint counted.
    fn count(&mut self, step: u64, counted: &Counters, offset: u64) {
        if let Some(sums) = self.sums.replace(*counted) {
            let pairs = [
                ("steps", sums.steps, counted.steps),
                ("impacts", sums.impacts, counted.impacts),
                ("iterations", sums.iterations, counted.iterations),
                ("rejected attempts", sums.rejected_steps, counted.rejected_steps),
            ];
            for (what, sum, counted) in pairs.into_iter().filter(|(_, sum, counted)| sum != counted) {
                let text =
                    format!("the checkpoint of step {step} counts {counted} {what}, and the log has {sum} up to there");
                self.fault(offset, || text);
            }
        }
    }

    /// Something is lost here: what is missing around it needs no other explanation.
    pub fn lose(&mut self) {
        self.excused = true;
        self.sums = None;
        if let Some(step) = &mut self.step {
            step.excused = true;
        }
        self.touch(None);
    }

    /// From when to when something may be lost or wrong [s]; infinite where the end is lost.
    pub fn lost(&self) -> Option<(f64, f64)> {
        self.lost
    }

    /// Something is wrong between the last step that was whole and a time [s], or the current step.
    fn touch(&mut self, t: Option<f64>) {
        let now = self.step.map(|step| step.t);
        let from = self.before.map(|(_, t, _)| t).or(now).unwrap_or(0.0);
        let to = t.or(now).unwrap_or(from);
        let (first, last) = self.lost.unwrap_or((from, to));
        self.lost = Some((first.min(from), last.max(to)));
    }

    /// Whether nothing is wrong so far.
    pub fn is_content(&self) -> bool {
        self.found.is_empty() && self.lacking.is_none()
    }

    /// What was found since it was last taken; steps that lack messages are gathered, and come when others follow.
    pub fn take(&mut self) -> Vec<Damage> {
        std::mem::take(&mut self.found)
    }

    /// Ends the log at `size` bytes; what was found comes back.
    pub fn finish(&mut self, size: u64) -> Vec<Damage> {
        self.close();
        if self.excused {
            self.touch(Some(f64::INFINITY));
        }
        if let (Some(plan), false, false) = (&self.plan, self.excused, self.ended_early) {
            let duration = plan.duration;
            match self.before {
                None => {
                    self.fault(size, || "there is no message in it".to_owned());
                    self.touch(Some(f64::INFINITY));
                }
                Some((number, t, before)) if !ends(duration, t, t - before) => {
                    let what = format!(
                        "the log ends with step {number} at t = {t} s, and its scene at {duration} s; nothing in it says that \
                         the run was interrupted"
                    );
                    self.fault(size, || what);
                    self.touch(Some(f64::INFINITY));
                }
                Some(_) => {}
            }
        }
        self.settle();
        if let Some((more, offset)) = self.more {
            self.found.push(Damage { offset, what: format!("{more} more messages or steps from here on are wrong") });
        }
        self.take()
    }

    /// As [`Judge::finish`], where the rest of the log is not looked at.
    pub fn stop(mut self) -> Vec<Damage> {
        self.settle();
        self.found
    }

    fn begin(&mut self, t: f64, number: u64, offset: u64) {
        self.close();
        let excused = self.excused;
        let expected = self.before.map_or(0, |(before, ..)| before.saturating_add(1));
        let what = match self.before {
            _ if number == expected => None,
            None => Some(format!("the log begins with step {number}: what came before is not in it")),
            Some((before, ..)) if number <= before => Some(format!("step {number} follows step {before}")),
            Some((before, ..)) if number == before.saturating_add(2) => {
                Some(format!("step {} is not in the log", before.saturating_add(1)))
            }
            Some((before, ..)) => Some(format!("the steps between {before} and {number} are not in the log")),
        };
        if number != expected {
            self.sums = None;
        }
        // A loss explains steps that are missing, and none that come twice.
        let explained = excused && number >= expected;
        if let Some(what) = what.filter(|_| !explained) {
            self.fault(offset, || what);
        }
        if self.before.is_some_and(|(_, before, _)| t < before) || !t.is_finite() {
            self.fault(offset, || format!("step {number} is of t = {t} s, which is before the step that it follows"));
        }
        if excused || number != expected {
            self.touch(Some(t));
        }
        self.step = Some(Step { number, t, offset, seen: [false; CHANNELS.len()], excused });
    }

    /// Ends the step that is gathered.
    fn close(&mut self) {
        let Some(step) = self.step.take() else { return };
        let due = self.due(&step);
        let mut lacks = [false; CHANNELS.len()];
        for (lacks, (due, seen)) in lacks.iter_mut().zip(due.into_iter().zip(step.seen)) {
            *lacks = due && !seen;
        }
        if lacks.contains(&true) && !step.excused {
            self.touch(Some(step.t));
            match &mut self.lacking {
                Some(known) if known.what == lacks => (known.last, known.count) = (step.number, known.count + 1),
                _ => {
                    self.settle();
                    self.lacking = Some(Lacking { what: lacks, first: step, last: step.number, count: 1 });
                }
            }
        }
        self.excused = step.excused;
        let before = self.before.map_or(step.t, |(_, t, _)| t);
        self.before = Some((step.number, step.t, before));
    }

    /// Names the steps that lack the same messages.
    fn settle(&mut self) {
        let Some(Lacking { what, first, last, count }) = self.lacking.take() else { return };
        let names: Vec<&str> = CHANNELS.iter().zip(what).filter(|(_, lacks)| *lacks).map(|(c, _)| c.name).collect();
        let names = names.join(", ");
        let Step { number, t, offset, .. } = first;
        self.fault(offset, || match count {
            1 => format!("step {number} at t = {t} s has no message on {names}"),
            _ => format!("{count} steps from {number} (t = {t} s) to {last} have no message on {names}"),
        });
    }

    /// Takes note of something that is wrong, such as a message that makes no sense.
    pub fn fault(&mut self, offset: u64, what: impl FnOnce() -> String) {
        self.touch(None);
        match &mut self.more {
            Some((more, _)) => *more += 1,
            None if self.named < NAMED => {
                self.named += 1;
                self.found.push(Damage { offset, what: what() });
            }
            None => self.more = Some((1, offset)),
        }
    }
}

/// Whether a run of some duration [s] ends at a time, after a step of `dt` [s].
fn ends(duration: f64, t: f64, dt: f64) -> bool {
    duration - t <= (END * dt).max(SAME_TIME * duration)
}
