//! Going on with a recorded run: what is taken over from its log, and from where it is solved again.

use std::io::{Read, Seek, Write};

use agglo_core::checkpoint::Checkpoint;
use agglo_core::state::{Particles, State};
use agglo_record::channels::Topic;
use agglo_record::{CarriedStep, RecordError, Recorder};

use crate::Frame;
use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::{Entry, Message, RawMessage};

/// Times closer than this share of a run's duration are not told apart [-].
const SAME_TIME: f64 = 1e-9;

/// From where a run can go on.
#[derive(Clone, Debug, PartialEq)]
pub struct Resumption {
    /// The checkpoint.
    pub checkpoint: Checkpoint,
    /// The last step of the log that is whole up to there: steps behind the checkpoint are solved again.
    pub last_step: u64,
    /// Time of that step [s].
    pub last_time: f64,
}

/// What was taken over could not be.
#[derive(Debug)]
pub enum CarryError {
    /// The old log could not be read.
    Log(LogError),
    /// The new log could not be written.
    Record(RecordError),
    /// The old log is of another run than its scene and checkpoint; a sentence.
    Stranger(String),
}

impl std::fmt::Display for CarryError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::Record(error) => error.fmt(f),
            Self::Stranger(what) => f.write_str(what),
        }
    }
}

impl std::error::Error for CarryError {}

impl<R: Read + Seek> Log<R> {
    /// The last checkpoint from which a run to `duration` [s] can go on so that it is the run that was never
    /// interrupted. `recorded` is the duration that the log was recorded for [s]: where the two differ, steps that either
    /// end may have cut short are solved again. Nothing behind the first thing that is wrong is used; `None`, with what is
    /// wrong, where not even the start is whole.
    ///
    /// # Errors
    /// A device that fails.
    pub fn resumption(&mut self, recorded: f64, duration: f64) -> Result<(Option<Resumption>, Vec<Damage>), LogError> {
        let nearest_end = if recorded == duration { f64::INFINITY } else { recorded.min(duration) };
        let mut damage = self.file_damage()?;
        let mut found = None;
        let (mut last_step, mut last_time) = (0, 0.0);
        let mut unknown = None;
        let mut judged = self.judged()?;
        while let Some(message) = judged.next() {
            let (message, entry) = match message {
                Ok(message) => message,
                Err(LogError::Damaged(lost)) => {
                    damage.push(lost);
                    break;
                }
                Err(other) => return Err(other),
            };
            if !judged.is_content() {
                break;
            }
            let Some(Entry { t, step, message }) = entry else {
                let what =
                    || format!("messages on {}, which this version does not know, are left out", message.channel.name);
                unknown.get_or_insert_with(|| Damage { offset: judged.offset(), what: what() });
                continue;
            };
            match message {
                Message::Diagnostics(diagnostics) => {
                    let first_attempt = diagnostics.rejected.first().map_or(diagnostics.dt, |attempt| attempt.dt);
                    if last_time + first_attempt >= nearest_end * (1.0 - SAME_TIME) {
                        break;
                    }
                    (last_step, last_time) = (step, t);
                }
                Message::Checkpoint(checkpoint) => found = Some(*checkpoint),
                _ => {}
            }
        }
        damage.extend(judged.stop());
        damage.extend(unknown);
        damage.extend(self.damage().iter().cloned());
        damage.sort_by_key(|lost| lost.offset);
        damage.dedup();
        Ok((found.map(|checkpoint| Resumption { checkpoint, last_step, last_time }), damage))
    }

    /// Writes the steps up to a checkpoint to a new log, as they stand here. The checkpoint itself goes with them only if
    /// the new run would write it: `keep`. `state` is that of the checkpoint, in the scene's coordinates. `watch` sees time [s] and number of every step, and ends this by returning false,
    /// which then comes back.
    ///
    /// # Errors
    /// What cannot be read or written.
    pub fn carry<W: Write>(
        &mut self,
        checkpoint: &Checkpoint,
        keep: bool,
        (particles, state): (&Particles, &State),
        recorder: &mut Recorder<W>,
        mut watch: impl FnMut(f64, u64) -> bool,
    ) -> Result<bool, CarryError> {
        let mut step = CarriedStep::default();
        let mut number = 0;
        for message in self.raw_messages() {
            let message = message.map_err(CarryError::Log)?;
            let (Some(topic), Some((t, of))) = (message.channel.topic, message.key()) else { continue };
            if of != number {
                recorder.carry(particles, &step).map_err(CarryError::Record)?;
                step = CarriedStep::default();
                number = of;
                if !watch(t, of) {
                    return Ok(false);
                }
            }
            let RawMessage { log_time, data, .. } = message;
            let last = topic == Topic::Checkpoint && of == checkpoint.step;
            if matches!(topic, Topic::Particles | Topic::ParticlesStatic) {
                match Message::decode(topic, &data).map(|entry| entry.message) {
                    Ok(Message::Static(found)) if found != *particles => {
                        let what = "its particles have other radii, masses or charges than its scene gives them";
                        return Err(CarryError::Stranger(what.to_owned()));
                    }
                    Ok(Message::Particles(frame)) if of == checkpoint.step && !shows(&frame, state) => {
                        let what =
                            format!("its checkpoint of step {of} at t = {t} s holds another state than /particles");
                        return Err(CarryError::Stranger(what));
                    }
                    Ok(Message::Particles(frame)) => step.frame = Some(frame),
                    _ => {}
                }
            }
            if !last || keep {
                step.messages.push((topic, log_time, data));
            }
            if last {
                break;
            }
        }
        recorder.carry(particles, &step).map_err(CarryError::Record)?;
        Ok(true)
    }
}

/// Whether a recorded state is this one, to the bit as far as it is recorded.
fn shows(frame: &Frame, state: &State) -> bool {
    let same = |recorded: &[f64], values: &[f64]| {
        let of = |value: f64| [value.to_bits(), f64::from(value as f32).to_bits()];
        recorded.len() == values.len()
            && recorded.iter().zip(values).all(|(recorded, value)| of(*value).contains(&recorded.to_bits()))
    };
    let columns =
        |recorded: [&[f64]; 3], values: [&[f64]; 3]| recorded.into_iter().zip(values).all(|(a, b)| same(a, b));
    columns(frame.position.axes(), state.position.axes())
        && columns(frame.velocity.axes(), state.velocity.axes())
        && same(frame.temperature.as_deref().unwrap_or_default(), state.temperature.as_deref().unwrap_or_default())
}
