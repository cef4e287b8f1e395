//! Solving a recorded run again, and comparing bit for bit.

use std::io::{Read, Seek};

use agglo_core::checkpoint::Checkpoint;
use agglo_core::observer::{Flow, Observer, ObserverError, StepReport};
use agglo_core::scene::{Problem, Scene};
use agglo_core::{Ending, RunError, SetupError, Simulation};
use agglo_record::channels::{CHANNELS, Effects, Topic};
use agglo_record::encoder::{Encoded, Encoder};

use crate::error::{Damage, LogError};
use crate::fields::{self, Difference};
use crate::log::Log;
use crate::messages::{Message, RawMessage, RawMessages};

/// What came of solving a run again.
#[derive(Debug)]
pub struct Verification {
    /// Step and time [s] from which it was solved.
    pub from: (u64, f64),
    /// The last step that was compared, and its time [s].
    pub to: (u64, f64),
    /// Steps that were compared.
    pub steps: u64,
    /// Messages that were compared.
    pub messages: u64,
    /// Whether `watch` stopped it.
    pub stopped: bool,
    /// The first difference; `None` where every bit is the same.
    pub mismatch: Option<Mismatch>,
    /// Parts of the log that could not be read, and so not be compared.
    pub damage: Vec<Damage>,
}

/// Where a log and the run solved again part.
#[derive(Debug)]
pub struct Mismatch {
    /// Time [s].
    pub t: f64,
    /// Step.
    pub step: u64,
    /// Name of the channel.
    pub channel: String,
    /// What differs.
    pub what: What,
}

/// How a message and the one solved again differ.
#[derive(Debug)]
pub enum What {
    /// A value.
    Value(Difference),
    /// Bytes that stand for no value that this version knows, or colours.
    Bytes,
    /// The log has the message, solving again does not give it.
    OnlyRecorded,
    /// Solving again gives the message, the log does not have it.
    OnlySolved,
    /// The run cannot be solved to here again.
    Failed(RunError),
}

/// A run that cannot be solved again at all.
#[derive(Debug)]
pub enum VerifyError {
    /// The log could not be read.
    Log(LogError),
    /// Its scene cannot be set up.
    Scene(Vec<Problem>),
}

impl std::fmt::Display for VerifyError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::Scene(problems) => {
                f.write_str("the scene in the log cannot be set up")?;
                problems.iter().try_for_each(|problem| write!(f, "\n{problem}"))
            }
        }
    }
}

impl std::error::Error for VerifyError {}

impl From<LogError> for VerifyError {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<SetupError> for VerifyError {
    fn from(error: SetupError) -> Self {
        Self::Scene(error.problems)
    }
}

impl<R: Read + Seek> Log<R> {
    /// Solves the run again from the last checkpoint at or before `from` [s] behind which the log goes on, and compares
    /// every message from there on with the log. `watch` sees every step and stops the comparison by returning false.
    ///
    /// # Errors
    /// A log without a scene, or one whose particles are others than its scene's; a device that fails. Differences and
    /// damage are part of the answer.
    pub fn verify(
        &mut self,
        from: f64,
        mut watch: impl FnMut(&StepReport<'_>) -> bool,
    ) -> Result<Verification, VerifyError> {
        let scene = self.scene()?;
        self.meets(&scene)?;
        let start = self.checkpoint_before(from)?;
        let mut simulation = Simulation::new(&scene)?;
        let mut encoder =
            Encoder::new(&scene).map_err(|error| VerifyError::Scene(vec![Problem::new("", error.to_string())]))?;
        let damage = self.file_damage()?;
        let size = self.size();
        let mut recorded =
            Recorded { messages: self.raw_messages(), next: None, damage, gap: false, ended_early: false };
        let mut from = (0, 0.0);
        if let Some(checkpoint) = &start {
            from = (checkpoint.step, checkpoint.time);
            encoder.begin(simulation.particles(), simulation.state());
            recorded.pass_to(checkpoint, &mut encoder, &simulation)?;
            simulation = Simulation::resume(&scene, checkpoint)?;
        }
        let mut comparison = Comparison {
            encoder,
            recorded,
            done: Verification {
                from,
                to: from,
                steps: 0,
                messages: 0,
                stopped: false,
                mismatch: None,
                damage: Vec::new(),
            },
            failure: None,
            watch: &mut watch,
        };
        let result = simulation.run(&mut comparison);
        let Comparison { mut recorded, mut done, failure, .. } = comparison;
        if let Some(error) = failure {
            return Err(error.into());
        }
        if done.mismatch.is_none() && !done.stopped {
            done.mismatch = match (recorded.goes_on()?, result) {
                // The log goes on; where solving again failed, that is why it does not.
                (true, Err(error)) => Some(recorded.mismatch(What::Failed(error), done.to)),
                (true, Ok(_)) => Some(recorded.mismatch(What::OnlyRecorded, done.to)),
                (false, result) => {
                    let ended = matches!(&result, Ok(outcome) if outcome.ending == Ending::Finished);
                    if !ended && !recorded.ended_early && recorded.damage.is_empty() {
                        let ((step, t), duration) = (done.to, scene.duration);
                        let what = format!(
                            "the log ends with step {step} at t = {t} s, and its scene at {duration} s; nothing in it \
                             says that the run was interrupted"
                        );
                        recorded.damage.push(Damage { offset: size, what });
                    }
                    None
                }
            };
        }
        done.damage = recorded.damage;
        done.damage.sort_by_key(|lost| lost.offset);
        done.damage.dedup();
        Ok(done)
    }

    /// The last checkpoint at or before a time behind which there is a step, but not the start, which the scene itself
    /// gives. Runs end with a checkpoint: from there, nothing could be compared.
    fn checkpoint_before(&mut self, t: f64) -> Result<Option<Checkpoint>, LogError> {
        let (mut found, mut latest) = (None, None);
        if t <= 0.0 {
            return Ok(found);
        }
        for entry in self.messages().only(&[Topic::Diagnostics, Topic::Checkpoint]) {
            match entry {
                Ok(entry) => match entry.message {
                    Message::Checkpoint(checkpoint) if entry.t <= t => {
                        latest = (checkpoint.step > 0).then_some(*checkpoint);
                    }
                    _ => {
                        if latest.is_some() {
                            found = latest.take();
                        }
                        if entry.t > t {
                            break;
                        }
                    }
                },
                Err(LogError::Damaged(_)) => {}
                Err(other) => return Err(other),
            }
        }
        Ok(found)
    }
}

impl<R: Read + Seek> Log<R> {
    /// That its scene has as many particles as the log: to be asked before they are placed, which takes memory for all.
    ///
    /// # Errors
    /// A scene of others, as damage; a device that fails.
    pub fn meets(&mut self, scene: &Scene) -> Result<(), LogError> {
        let expected = Effects::of(scene).map_or(0, |effects| effects.particles);
        match self.particles() {
            Ok(particles) if particles.len() != expected => Err(LogError::Damaged(Damage {
                offset: 0,
                what: format!("the scene has {expected} particles, the log {}", particles.len()),
            })),
            Err(LogError::Io(error)) => Err(error.into()),
            // Where they are lost, what the metadata say must do.
            Err(_) if self.run().particles != expected as u64 => Err(LogError::Damaged(Damage {
                offset: 0,
                what: format!("the scene has {expected} particles, the log {}", self.run().particles),
            })),
            _ => Ok(()),
        }
    }
}

/// What is in the log, one message at a time.
struct Recorded<'a, R> {
    messages: RawMessages<'a, R>,
    next: Option<RawMessage>,
    damage: Vec<Damage>,
    /// Whether something was lost since the last message that was taken.
    gap: bool,
    /// Whether it ends by saying that the run was interrupted or failed.
    ended_early: bool,
}

impl<R: Read + Seek> Recorded<'_, R> {
    /// The next message, which stays the next one.
    fn peek(&mut self) -> Result<Option<&RawMessage>, LogError> {
        while self.next.is_none() {
            match self.messages.next() {
                Some(Ok(message)) => self.next = Some(message),
                Some(Err(LogError::Damaged(lost))) => {
                    self.gap = true;
                    self.damage.push(lost);
                }
                Some(Err(other)) => return Err(other),
                None => break,
            }
        }
        Ok(self.next.as_ref())
    }

    /// Reads to just behind a checkpoint; the encoder sees the states that pass.
    fn pass_to(&mut self, checkpoint: &Checkpoint, encoder: &mut Encoder, start: &Simulation) -> Result<(), LogError> {
        let draws = encoder.effects().markers;
        while let Some(message) = self.peek()? {
            let is = |topic| message.channel.topic == Some(topic);
            let last = is(Topic::Checkpoint) && message.key().is_some_and(|(_, step)| step == checkpoint.step);
            if draws
                && is(Topic::Particles)
                && let Ok(Message::Particles(frame)) =
                    Message::decode(Topic::Particles, &message.data).map(|e| e.message)
            {
                encoder.pass(start.particles(), &frame);
            }
            self.next = None;
            if last {
                break;
            }
        }
        self.gap = false;
        Ok(())
    }

    /// Whether the log goes on with what the solver must have said: a last message for people is not of the solver.
    fn goes_on(&mut self) -> Result<bool, LogError> {
        while let Some(message) = self.peek()? {
            if message.channel.topic != Some(Topic::Log) {
                break;
            }
            let Some(note) = self.next.take() else { break };
            if self.peek()?.is_some() {
                self.next = Some(note);
                break;
            }
            self.ended_early |= matches!(note.decode(), Ok(Some(entry)) if entry.message.ends_early());
        }
        Ok(self.next.is_some())
    }

    /// That the next message is only here, or why.
    fn mismatch(&self, what: What, (step, t): (u64, f64)) -> Mismatch {
        let next = self.next.as_ref();
        let (t, step) = next.and_then(RawMessage::key).unwrap_or((t, step));
        let channel = next.map_or_else(String::new, |message| message.channel.name.to_string());
        Mismatch { t, step, channel, what }
    }
}

/// Compares a run being solved with its log.
struct Comparison<'a, 'w, R> {
    encoder: Encoder,
    recorded: Recorded<'a, R>,
    done: Verification,
    failure: Option<LogError>,
    watch: &'w mut dyn FnMut(&StepReport<'_>) -> bool,
}

impl<R: Read + Seek> Observer for Comparison<'_, '_, R> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        let Self { encoder, recorded, done, failure, watch } = self;
        let at = (report.step, report.time);
        let mut compared = 0;
        encoder.step(report, &mut |solved| {
            if done.mismatch.is_none() && failure.is_none() {
                match compare(recorded, &solved, at) {
                    Ok(Ok(same)) => compared += u64::from(same),
                    Ok(Err(mismatch)) => done.mismatch = Some(mismatch),
                    Err(error) => *failure = Some(error),
                }
            }
            Ok(())
        })?;
        if compared > 0 {
            done.messages += compared;
            done.steps += 1;
            done.to = at;
        }
        if done.mismatch.is_some() || failure.is_some() {
            return Ok(Flow::Stop);
        }
        if !watch(report) {
            done.stopped = true;
            return Ok(Flow::Stop);
        }
        // A run that was interrupted is compared as far as it went.
        match recorded.goes_on() {
            Ok(true) => Ok(Flow::Continue),
            Ok(false) => Ok(Flow::Stop),
            Err(error) => {
                *failure = Some(error);
                Ok(Flow::Stop)
            }
        }
    }
}

/// Compares a message with the next one in the log: whether it was compared, which it is not where that part of the log
/// is lost.
fn compare<R: Read + Seek>(
    recorded: &mut Recorded<'_, R>,
    solved: &Encoded<'_>,
    (step, t): (u64, f64),
) -> Result<Result<bool, Mismatch>, LogError> {
    let channel = CHANNELS[solved.topic as usize].name;
    let differ = |what| Mismatch { t, step, channel: channel.to_owned(), what };
    let Some(message) = recorded.peek()? else {
        // The log ends within a step only where it was cut off.
        return Ok(if recorded.gap { Ok(false) } else { Err(differ(What::OnlySolved)) });
    };
    let (is_same_channel, key) = (message.channel.topic == Some(solved.topic), message.key());
    if is_same_channel && message.data == solved.data && message.log_time == solved.log_time {
        (recorded.next, recorded.gap) = (None, false);
        return Ok(Ok(true));
    }
    let lost = recorded.gap && key.is_some_and(|(_, of)| of > step);
    if lost {
        return Ok(Ok(false));
    }
    let Some(message) = &recorded.next else { return Ok(Ok(false)) };
    let (same_step, behind) = (key.is_some_and(|(_, of)| of == step), key.is_some_and(|(_, of)| of < step));
    Ok(Err(if is_same_channel && same_step {
        differ(difference(message, solved))
    } else if behind || same_step && message.channel.topic.is_none_or(|topic| (topic as usize) < solved.topic as usize)
    {
        recorded.mismatch(What::OnlyRecorded, (step, t))
    } else {
        differ(What::OnlySolved)
    }))
}

/// The first value that differs between a message and the one solved again.
fn difference(recorded: &RawMessage, solved: &Encoded<'_>) -> What {
    let decode = |data: &[u8]| Message::decode(solved.topic, data).ok();
    match (decode(&recorded.data), decode(solved.data)) {
        (Some(recorded), Some(solved)) => fields::first_difference(&recorded, &solved).map_or(What::Bytes, What::Value),
        _ => What::Bytes,
    }
}
