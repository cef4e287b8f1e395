//! A log: what stands in front of its messages, and ways to the messages.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use agglo_core::scene::Scene;
use agglo_core::state::Particles;
use agglo_record::channels::Topic;
use agglo_record::cloud::Frame;
use agglo_record::run::{self, RunInfo, Unreadable, log_time};
use mcap::records::{Record, op};

use crate::container::Container;
use crate::error::{Damage, LogError, NoState};
use crate::messages::{Channel, Channels, Message, Messages, RawMessages};
use crate::steps::Steps;

/// Times that differ by less than this part of them are the same: a step's end adds up to 0.3000000000000001 s where
/// people write 0.3 [-].
const SAME_TIME: f64 = 1e-9;

/// A log that can be read.
pub struct Log<R> {
    pub(crate) container: Container<R>,
    pub(crate) channels: Channels,
    run: RunInfo,
}

impl<R> std::fmt::Debug for Log<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Log").field("run", &self.run).field("size", &self.container.size).finish_non_exhaustive()
    }
}

impl Log<BufReader<File>> {
    /// Opens a log in a file.
    ///
    /// # Errors
    /// A file that cannot be read, that is no log of agglo, or one of a format that this version does not know.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, LogError> {
        let path = path.as_ref();
        if path.is_dir() {
            return Err(LogError::Io(std::io::ErrorKind::IsADirectory.into()));
        }
        Self::new(BufReader::with_capacity(64 * 1024, File::open(path)?))
    }
}

impl<R: Read + Seek> Log<R> {
    /// Opens a log.
    ///
    /// # Errors
    /// As [`Log::open`].
    pub fn new(reader: R) -> Result<Self, LogError> {
        let container = Container::open(reader)?;
        let run = match container.metadata.get(run::RECORD) {
            Some(map) => RunInfo::from_map(map).map_err(|unreadable| match unreadable {
                Unreadable::Version(why) => LogError::Version(why),
                Unreadable::Foreign(why) => LogError::Foreign(why),
            })?,
            // What should have told whose log this is may itself be lost.
            None => {
                return Err(match container.damage.first() {
                    Some(damage) => LogError::Damaged(Damage {
                        offset: damage.offset,
                        what: format!("nothing can be read without the metadata record `run`. {}", damage.what),
                    }),
                    None => LogError::Foreign("it has no metadata record `run`".to_owned()),
                });
            }
        };
        let mut log = Self { container, channels: Channels::new(), run };
        log.channels = log.find_channels()?;
        Ok(log)
    }

    /// The channels as the index has them, else as the first chunk describes them.
    fn find_channels(&mut self) -> Result<Channels, LogError> {
        if let Some(index) = &self.container.index {
            let channels = index.summary.channels.values();
            return Ok(channels.map(|channel| (channel.id, Channel::named(&channel.topic))).collect());
        }
        let mut channels = Channels::new();
        let Some(first) = self.container.chunks.first().copied() else { return Ok(channels) };
        let mut reader = self.container.open_chunk(first);
        let channel = |opcode, body: &[u8]| match mcap::parse_record(opcode, body) {
            Ok(Record::Channel(channel)) if opcode == op::CHANNEL => Some((channel.id, Channel::named(&channel.topic))),
            _ => None,
        };
        // Damage comes up when the messages are read.
        while let Some(Ok(found)) = self.container.next_record(&mut reader, channel) {
            channels.extend(found);
        }
        Ok(channels)
    }

    /// Which scene, build and model the log comes from.
    #[must_use]
    pub fn run(&self) -> &RunInfo {
        &self.run
    }

    /// Size of the file [bytes].
    #[must_use]
    pub fn size(&self) -> u64 {
        self.container.size
    }

    /// What is known to be lost without reading the chunks; empty where the log's index is whole.
    #[must_use]
    pub fn damage(&self) -> &[Damage] {
        &self.container.damage
    }

    /// What the checksums over the whole file, its scene and its layout say is lost, whatever the messages say.
    ///
    /// # Errors
    /// A device that fails.
    pub fn file_damage(&mut self) -> Result<Vec<Damage>, LogError> {
        let mut damage = Vec::new();
        for found in [self.container.check_data(), self.scene_json().map(drop)] {
            match found {
                Ok(()) => {}
                Err(LogError::Damaged(lost)) => damage.push(lost),
                Err(other) => return Err(other),
            }
        }
        Ok(damage)
    }

    /// The content of an attachment; `None` where the log has none of that name.
    ///
    /// # Errors
    /// Damage, or a device that fails.
    pub fn attachment(&mut self, name: &str) -> Result<Option<Vec<u8>>, LogError> {
        self.container.attachment(name)
    }

    /// The text of the scene, as resolved.
    ///
    /// # Errors
    /// A scene that is missing, damaged, or not the one that the log was written for.
    pub fn scene_json(&mut self) -> Result<String, LogError> {
        let lost = |what: &str| LogError::Damaged(Damage { offset: 0, what: format!("the scene {what}") });
        let bytes = self.attachment(run::SCENE)?.ok_or_else(|| lost("is missing"))?;
        if run::hash(&bytes) != self.run.scene_hash {
            return Err(lost("is not the one whose hash stands in the metadata"));
        }
        String::from_utf8(bytes).map_err(|_| lost("is not UTF-8"))
    }

    /// The scene, as resolved.
    ///
    /// # Errors
    /// As [`Log::scene_json`], and a scene of another version.
    pub fn scene(&mut self) -> Result<Scene, LogError> {
        Scene::parse(&self.scene_json()?, &[]).map_err(LogError::Scene)
    }

    /// All messages, in the order in which they were written.
    pub fn messages(&mut self) -> Messages<'_, R> {
        let all = 0..self.container.chunks.len();
        Messages::new(self, all)
    }

    /// All steps, the messages of each gathered.
    pub fn steps(&mut self) -> Steps<'_, R> {
        Steps::new(self.messages())
    }

    /// All messages as they stand in the log, in the order in which they were written.
    pub fn raw_messages(&mut self) -> RawMessages<'_, R> {
        let all = 0..self.container.chunks.len();
        RawMessages::new(self, all)
    }

    /// The messages of some chunks.
    pub(crate) fn part(&mut self, chunks: std::ops::Range<usize>) -> Messages<'_, R> {
        Messages::new(self, chunks).part()
    }

    /// Radii, masses, charges.
    ///
    /// # Errors
    /// Damage, or a device that fails.
    pub fn particles(&mut self) -> Result<Particles, LogError> {
        for entry in self.messages().only(&[Topic::ParticlesStatic]) {
            if let Message::Static(particles) = entry?.message {
                return Ok(particles);
            }
        }
        Err(LogError::Damaged(Damage { offset: self.size(), what: "the particles are not in the log".to_owned() }))
    }

    /// The last recorded state at or before a time [s], which may be off by a part in 1e9.
    ///
    /// # Errors
    /// [`LogError::NoState`] before the first one; damage in the part of the log where the state must be, or where a
    /// later one could have been.
    pub fn frame_at(&mut self, t: f64) -> Result<Frame, LogError> {
        self.frame_near(t).map(|(frame, _)| frame)
    }

    /// As [`Log::frame_at`], and whether the log ends with that state and before the time.
    pub(crate) fn frame_near(&mut self, t: f64) -> Result<(Frame, bool), LogError> {
        let slack = SAME_TIME * t.abs();
        let latest = log_time(t + slack, self.run.time_scale);
        // Rounding keeps the order of times, so no state up to t is in a chunk that begins later.
        let end = self.container.chunks.partition_point(|chunk| chunk.start <= latest);
        let (frame, is_last) = match self.last_frame_in(end, t + slack) {
            Err(LogError::NoState(_)) => return Err(LogError::NoState(NoState { time: t, first: self.first_time()? })),
            other => other?,
        };
        let beyond = is_last && frame.t < t - slack && end == self.container.chunks.len();
        match self.container.damage.first() {
            Some(damage) if beyond => Err(LogError::Damaged(damage.clone())),
            _ => Ok((frame, beyond)),
        }
    }

    /// The time of the first recorded state [s].
    fn first_time(&mut self) -> Result<Option<f64>, LogError> {
        for entry in self.messages().only(&[Topic::Particles]) {
            if let Message::Particles(frame) = entry?.message {
                return Ok(Some(frame.t));
            }
        }
        Ok(None)
    }

    /// The last recorded state; of a log that was cut off the last whole one, see [`Log::damage`].
    ///
    /// # Errors
    /// [`LogError::NoState`] where there is none; damage in the part of the log where the state must be.
    pub fn last_frame(&mut self) -> Result<Frame, LogError> {
        self.last_frame_in(self.container.chunks.len(), f64::INFINITY).map(|(frame, _)| frame)
    }

    /// The last state at or before `t` in the first `end` chunks, and whether none is behind it there.
    fn last_frame_in(&mut self, end: usize, t: f64) -> Result<(Frame, bool), LogError> {
        let mut is_last = true;
        for chunk in (0..end).rev() {
            let mut found = None;
            for entry in self.part(chunk..chunk + 1).only(&[Topic::Particles]) {
                match entry?.message {
                    Message::Particles(frame) if frame.t <= t => found = Some(frame),
                    Message::Particles(_) => is_last = false,
                    _ => {}
                }
            }
            if let Some(frame) = found {
                return Ok((frame, is_last));
            }
        }
        Err(LogError::NoState(NoState { time: t, first: None }))
    }
}
