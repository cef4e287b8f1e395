//! The messages of a log, typed, in the order in which they were written.

use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::sync::Arc;

use agglo_core::checkpoint::Checkpoint;
use agglo_core::diagnostics::{Level, Notice, StepDiagnostics};
use agglo_core::impact::Impact;
use agglo_core::ledger::{Ledger, Momentum};
use agglo_core::observer::Clusters;
use agglo_core::state::Particles;
use agglo_record::channels::{CHANNELS, Topic, by_name};
use agglo_record::cloud::{self, Frame};
use agglo_record::convert::{self, Malformed};
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;
use agglo_record::run::INTERRUPTED;
use mcap::records::op;
use prost::Message as _;

use crate::container::{ChunkReader, ChunkRef, Fault};
use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::records;
use crate::wire;

/// A message of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Time [s].
    pub t: f64,
    /// Step number; 0 is the start.
    pub step: u64,
    /// What it says.
    pub message: Message,
}

/// What a message says.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// Radii, masses, charges: the first message.
    Static(Particles),
    /// A recorded state.
    Particles(Frame),
    /// Iterations and step control.
    Diagnostics(StepDiagnostics),
    /// Energies and momentum.
    Energy(Ledger, Momentum),
    /// Cluster counts; which cluster a particle is in stands in [`Frame::cluster`], so `of` is empty here.
    Clusters(Clusters),
    /// The impacts of a step.
    Impacts(Vec<Impact>),
    /// All that is needed to go on from here.
    Checkpoint(Box<Checkpoint>),
    /// A message for people.
    Log(Notice),
    /// Spheres for viewers: the state once more, drawn.
    Scene,
}

impl Message {
    /// The channel that this message belongs to.
    #[must_use]
    pub fn topic(&self) -> Topic {
        match self {
            Self::Static(_) => Topic::ParticlesStatic,
            Self::Particles(_) => Topic::Particles,
            Self::Diagnostics(_) => Topic::Diagnostics,
            Self::Energy(..) => Topic::Energy,
            Self::Clusters(_) => Topic::Clusters,
            Self::Impacts(_) => Topic::Impacts,
            Self::Checkpoint(_) => Topic::Checkpoint,
            Self::Log(_) => Topic::Log,
            Self::Scene => Topic::Scene,
        }
    }

    /// Whether it says that a run ended before its time: it was interrupted, or failed.
    pub(crate) fn ends_early(&self) -> bool {
        matches!(self, Self::Log(Notice { level, message }) if *level == Level::Error || message == INTERRUPTED)
    }

    pub(crate) fn decode(topic: Topic, data: &[u8]) -> Result<Entry, Malformed> {
        let cut = |error: prost::DecodeError| Malformed(error.to_string());
        if matches!(topic, Topic::Impacts | Topic::Diagnostics) && wire::is_hollow(data) {
            return Err(Malformed("thousands of its parts say nothing".to_owned()));
        }
        Ok(match topic {
            Topic::ParticlesStatic => {
                let message = v1::ParticleStatic::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                Entry { t, step, message: Self::Static(convert::read_particles(message)?) }
            }
            Topic::Particles => {
                let frame = cloud::decode(&foxglove::PointCloud::decode(data).map_err(cut)?)?;
                Entry { t: frame.t, step: frame.step, message: Self::Particles(frame) }
            }
            Topic::Diagnostics => {
                let message = v1::StepDiagnostics::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                Entry { t, step, message: Self::Diagnostics(convert::read_diagnostics(message)?) }
            }
            Topic::Energy => {
                let message = v1::EnergyLedger::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                let (ledger, momentum) = convert::read_energy(message);
                Entry { t, step, message: Self::Energy(ledger, momentum) }
            }
            Topic::Clusters => {
                let message = v1::Clusters::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                Entry { t, step, message: Self::Clusters(convert::read_clusters(message)) }
            }
            Topic::Impacts => {
                let message = v1::Impacts::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                Entry { t, step, message: Self::Impacts(convert::read_impacts(message)?) }
            }
            Topic::Checkpoint => {
                let checkpoint = convert::read_checkpoint(v1::Checkpoint::decode(data).map_err(cut)?)?;
                let (t, step) = (checkpoint.time, checkpoint.step);
                Entry { t, step, message: Self::Checkpoint(Box::new(checkpoint)) }
            }
            Topic::Log => {
                let message = foxglove::Log::decode(data).map_err(cut)?;
                let (t, step) = (message.t, message.step);
                Entry { t, step, message: Self::Log(convert::read_notice(message)) }
            }
            Topic::Scene => {
                let message = foxglove::SceneUpdate::decode(data).map_err(cut)?;
                Entry { t: message.t, step: message.step, message: Self::Scene }
            }
        })
    }
}

/// A message as it stands in the log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawMessage {
    /// Its channel.
    pub channel: Channel,
    /// Running number on its channel.
    pub sequence: u32,
    /// Log time [ns].
    pub log_time: u64,
    /// Publish time [ns].
    pub publish_time: u64,
    /// The message, encoded.
    pub data: Vec<u8>,
}

impl RawMessage {
    /// The message, decoded; `None` on channels that this version does not know.
    ///
    /// # Errors
    /// A message that makes no sense.
    pub fn decode(&self) -> Result<Option<Entry>, Malformed> {
        self.channel.topic.map(|topic| Message::decode(topic, &self.data)).transpose()
    }

    /// Time [s] and step, read without decoding the rest; `None` where the encoding is broken or the channel unknown.
    #[must_use]
    pub fn key(&self) -> Option<(f64, u64)> {
        wire::key(self.channel.topic?, &self.data)
    }
}

/// A channel of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// Its name.
    pub name: Arc<str>,
    /// What it is to us; `None` for channels that this version does not know.
    pub topic: Option<Topic>,
}

impl Channel {
    /// The channel of this name.
    pub fn named(name: &str) -> Self {
        Self { name: name.into(), topic: by_name(name).map(|channel| channel.topic) }
    }
}

/// The channel of every channel number that has been met.
pub type Channels = BTreeMap<u16, Channel>;

/// Iterates over the messages of a log as they stand in it.
///
/// A part that is lost comes up as [`LogError::Damaged`] in its place, and a log that was cut off ends with one; the
/// messages behind it follow if the iteration goes on. After [`LogError::Io`] it ends.
pub struct RawMessages<'a, R> {
    log: &'a mut Log<R>,
    /// Topics that are wanted; `None`: all, unknown ones included.
    only: Option<Vec<Topic>>,
    channels: Channels,
    /// Chunks still to be read, the next one last.
    chunks: Vec<ChunkRef>,
    open: Option<(ChunkRef, ChunkReader)>,
    /// Damage known from the start, which comes up at the end.
    known: Vec<Damage>,
    /// The largest message that makes sense [bytes].
    largest: usize,
    /// Records without sense so far, and where the first that is not named stands [byte].
    senseless: (u64, u64),
}

/// Records without sense that are named one by one; beyond it they are counted.
const NAMED: u64 = 1000;

/// What came out of one record.
enum Step {
    Message(RawMessage),
    Channel(u16, Channel),
    Malformed(String),
    Nothing,
}

impl<'a, R: Read + Seek> RawMessages<'a, R> {
    pub(crate) fn new(log: &'a mut Log<R>, chunks: std::ops::Range<usize>) -> Self {
        let chunks: Vec<ChunkRef> = log.container.chunks[chunks].iter().rev().copied().collect();
        let known = log.container.damage.iter().rev().cloned().collect();
        let (channels, largest) = (log.channels.clone(), log.container.largest_message());
        Self { log, only: None, channels, chunks, open: None, known, largest, senseless: (0, 0) }
    }

    /// The same, with the messages of these topics only; the others are not even copied.
    #[must_use]
    pub fn only(mut self, topics: &[Topic]) -> Self {
        self.only = Some(topics.to_vec());
        self
    }

    /// The same, without the damage that was known before: for a part of a log.
    pub(crate) fn part(mut self) -> Self {
        self.known.clear();
        self
    }

    /// The largest chunk that makes sense [bytes]: no step takes more.
    pub(crate) fn largest_chunk(&self) -> usize {
        self.log.container.largest_chunk()
    }

    /// What was counted only, once.
    fn unnamed(&mut self) -> Option<Damage> {
        let (count, offset) = std::mem::take(&mut self.senseless);
        let more = count.checked_sub(NAMED).filter(|more| *more > 0)?;
        Some(Damage { offset, what: format!("{more} more records from here on make no sense") })
    }

    /// Where the chunk that is being read begins [byte].
    pub(crate) fn offset(&self) -> u64 {
        self.open.as_ref().map_or(self.log.container.size, |(chunk, _)| chunk.offset)
    }
}

/// Reads one record of a chunk.
fn examine(channels: &Channels, only: Option<&[Topic]>, largest: usize, opcode: u8, body: &[u8]) -> Step {
    match opcode {
        op::CHANNEL => match records::channel(body) {
            Some((id, _, topic)) => Step::Channel(id, Channel::named(topic)),
            None => Step::Malformed("a channel record".to_owned()),
        },
        op::MESSAGE => {
            // Channel, sequence, log time, publish time; then the message.
            let Some((head, data)) = body.split_at_checked(2 + 4 + 8 + 8) else {
                return Step::Malformed("a message record".to_owned());
            };
            let Some(channel) = channels.get(&u16::from_le_bytes([head[0], head[1]])) else {
                return Step::Malformed("a message on a channel that is not described".to_owned());
            };
            if data.len() > largest {
                let (name, size) = (&channel.name, data.len());
                return Step::Malformed(format!("{size} bytes on {name}, more than all particles need"));
            }
            if only.is_some_and(|only| channel.topic.is_none_or(|topic| !only.contains(&topic))) {
                return Step::Nothing;
            }
            let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| head[at + k]));
            Step::Message(RawMessage {
                channel: channel.clone(),
                sequence: u32::from_le_bytes(std::array::from_fn(|k| head[2 + k])),
                log_time: word(6),
                publish_time: word(14),
                data: data.to_vec(),
            })
        }
        _ => Step::Nothing,
    }
}

pub(crate) fn senseless(offset: u64, what: &str) -> Damage {
    Damage { offset, what: format!("a message in the chunk from here makes no sense: {what}") }
}

impl<R: Read + Seek> Iterator for RawMessages<'_, R> {
    type Item = Result<RawMessage, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let Some((chunk, mut reader)) = self.open.take() else {
                match self.chunks.pop() {
                    Some(chunk) => self.open = Some((chunk, self.log.container.open_chunk(chunk))),
                    None => {
                        return self
                            .known
                            .pop()
                            .or_else(|| self.unnamed())
                            .map(|damage| Err(LogError::Damaged(damage)));
                    }
                }
                continue;
            };
            let lost = |what: String| {
                let what = format!("a chunk of {} bytes is lost: {what}", chunk.length);
                LogError::Damaged(Damage { offset: chunk.offset, what })
            };
            let (channels, only, largest) = (&self.channels, self.only.as_deref(), self.largest);
            let record = self
                .log
                .container
                .next_record(&mut reader, |opcode, body| examine(channels, only, largest, opcode, body));
            match record {
                None => {}
                Some(Err(Fault::Lost(why))) => return Some(Err(lost(why))),
                Some(Err(Fault::Io(error))) => {
                    self.chunks.clear();
                    self.known.clear();
                    return Some(Err(error.into()));
                }
                Some(Ok(step)) => {
                    self.open = Some((chunk, reader));
                    match step {
                        Step::Message(message) => return Some(Ok(message)),
                        Step::Channel(id, channel) => drop(self.channels.insert(id, channel)),
                        Step::Malformed(what) => {
                            self.senseless.0 += 1;
                            if self.senseless.0 <= NAMED {
                                return Some(Err(LogError::Damaged(senseless(chunk.offset, &what))));
                            }
                            if self.senseless.0 == NAMED + 1 {
                                self.senseless.1 = chunk.offset;
                            }
                        }
                        Step::Nothing => {}
                    }
                }
            }
        }
    }
}

/// Iterates over the messages of a log, decoded; channels that this version does not know are passed over. Damage comes
/// up as in [`RawMessages`].
pub struct Messages<'a, R> {
    raw: RawMessages<'a, R>,
}

impl<'a, R: Read + Seek> Messages<'a, R> {
    pub(crate) fn new(log: &'a mut Log<R>, chunks: std::ops::Range<usize>) -> Self {
        let known: Vec<Topic> = CHANNELS.iter().map(|channel| channel.topic).collect();
        Self { raw: RawMessages::new(log, chunks).only(&known) }
    }

    /// The same, with the messages of these topics only; the others are not decoded.
    #[must_use]
    pub fn only(self, topics: &[Topic]) -> Self {
        Self { raw: self.raw.only(topics) }
    }

    /// The same, without the damage that was known before: for a part of a log.
    pub(crate) fn part(self) -> Self {
        Self { raw: self.raw.part() }
    }
}

impl<R: Read + Seek> Iterator for Messages<'_, R> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            let message = match self.raw.next()? {
                Ok(message) => message,
                Err(error) => return Some(Err(error)),
            };
            match message.decode() {
                Ok(Some(entry)) => return Some(Ok(entry)),
                Ok(None) => {}
                Err(malformed) => {
                    return Some(Err(LogError::Damaged(senseless(self.raw.offset(), &malformed.to_string()))));
                }
            }
        }
    }
}
