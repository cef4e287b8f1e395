//! A log: what stands in front of its messages, and ways to the messages.

use std::fs::File;
use std::io::{BufReader, Read, Seek};
use std::path::Path;

use agglo_core::scene::Scene;
use agglo_core::state::Particles;
use agglo_record::BuildInfo;
use agglo_record::channels::{Effects, Topic, present};
use agglo_record::cloud::Frame;
use agglo_record::run::{self, RunInfo, Unreadable, log_time};
use mcap::records::op;

use crate::container::Container;
use crate::error::{Damage, LogError, NoState};
use crate::messages::{Channel, Channels, Message, Messages, RawMessages};
use crate::records;
use crate::steps::Steps;

/// Times that differ by less than this part of them are the same: a step's end adds up to 0.3000000000000001 s where
/// people write 0.3 [-].
const SAME_TIME: f64 = 1e-9;

/// Particles that a log may claim without its scene being asked: the memory that they may take is small.
const UNQUESTIONED: u64 = 8192;

/// How many particles a scene has, read without keeping any; none where it makes no sense.
fn particles_of(scene: &[u8]) -> u64 {
    #[derive(serde::Deserialize)]
    struct Outline {
        particles: Source,
    }
    #[derive(serde::Deserialize)]
    struct Source {
        random_cube: Option<Cube>,
        list: Option<Vec<serde::de::IgnoredAny>>,
    }
    #[derive(serde::Deserialize)]
    struct Cube {
        count: u64,
    }
    let Ok(Outline { particles }) = serde_json::from_slice(scene) else { return 0 };
    let listed = particles.list.map_or(0, |list| list.len() as u64);
    particles.random_cube.map_or(listed, |cube| cube.count)
}

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
        let kind = std::fs::metadata(path)?.file_type();
        if kind.is_dir() {
            return Err(LogError::Io(std::io::ErrorKind::IsADirectory.into()));
        }
        if !kind.is_file() {
            let what = "it is a pipe or a device, and the index of a log stands at its end: save it to a file first";
            return Err(LogError::Io(std::io::Error::new(std::io::ErrorKind::InvalidInput, what)));
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
        let mut container = Container::open(reader)?;
        let named = container.metadata.get(run::RECORD).map(RunInfo::from_map);
        let run = match named {
            Some(Ok(run)) => run,
            unusable => Self::guess_run(&mut container, unusable)?,
        };
        container.allow(run.particles);
        if run.particles > UNQUESTIONED {
            // Memory for many particles is given where the scene has them too.
            let scene = container.attachment(run::SCENE).ok().flatten();
            container.allow(scene.map_or(UNQUESTIONED, |scene| particles_of(&scene).min(run.particles)));
        }
        let mut log = Self { container, channels: Channels::new(), run };
        log.channels = log.find_channels()?;
        Ok(log)
    }

    /// What should tell whose log this is may itself be damaged: then the scene tells.
    fn guess_run(
        container: &mut Container<R>,
        unusable: Option<Result<RunInfo, Unreadable>>,
    ) -> Result<RunInfo, LogError> {
        let error = match unusable {
            Some(Err(Unreadable::Version(why))) => LogError::Version(why),
            Some(Err(Unreadable::Foreign(why))) => LogError::Foreign(why),
            _ => LogError::Foreign("it has no metadata record `run`".to_owned()),
        };
        if container.index.is_some() && container.damage.is_empty() {
            match container.check_data() {
                Ok(()) => return Err(error),
                Err(LogError::Damaged(lost)) => container.damage.push(lost),
                Err(other) => return Err(other),
            }
        }
        let lost = container.damage.first().cloned().unwrap_or(Damage { offset: 0, what: error.to_string() });
        // A particle that a scene lists takes some hundred bytes there.
        container.allow(container.size / 100);
        let unknown = || BuildInfo { version: "unknown".to_owned(), commit: "unknown".to_owned() };
        let json = match container.attachment(run::SCENE) {
            Ok(Some(bytes)) => String::from_utf8(bytes).ok(),
            Err(LogError::Io(error)) => return Err(error.into()),
            _ => None,
        };
        let scene = json.and_then(|json| Some((Scene::parse(&json, &[]).ok()?, json)));
        let effects = scene.as_ref().and_then(|(scene, _)| Effects::of(scene).ok());
        let (Some((scene, json)), Some(effects)) = (scene, effects) else {
            return Err(LogError::Damaged(Damage {
                offset: lost.offset,
                what: format!("nothing can be read without the metadata record `run` and the scene. {}", lost.what),
            }));
        };
        let what = "the metadata record `run` cannot be read: what it says is taken from the scene".to_owned();
        container.damage.insert(0, Damage { offset: 0, what });
        Ok(RunInfo::new(&scene, &json, effects.particles, &unknown()))
    }

    /// The channels as the index has them, else as the first whole chunk describes them, else as the scene has them.
    fn find_channels(&mut self) -> Result<Channels, LogError> {
        if let Some(index) = &self.container.index {
            return Ok(index.channels.iter().map(|(&id, (topic, _))| (id, Channel::named(topic))).collect());
        }
        let mut channels = Channels::new();
        for chunk in self.container.chunks.clone() {
            let mut reader = self.container.open_chunk(chunk);
            let channel = |opcode, body: &[u8]| match records::channel(body) {
                Some((id, _, topic)) if opcode == op::CHANNEL => Some((id, Channel::named(topic))),
                _ => None,
            };
            // Damage comes up when the messages are read.
            let mut whole = false;
            while let Some(Ok(found)) = self.container.next_record(&mut reader, channel) {
                channels.extend(found);
                whole = true;
            }
            // Only the first chunk of our logs describes channels.
            if whole {
                break;
            }
        }
        if channels.is_empty()
            && let Ok(scene) = self.scene()
            && let Ok(effects) = Effects::of(&scene)
        {
            channels = (0..).zip(present(&effects)).map(|(id, channel)| (id, Channel::named(channel.name))).collect();
            let what = "the description of the channels is lost: they are those of the scene".to_owned();
            self.container.damage.insert(0, Damage { offset: 0, what });
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
        let data = self.container.check_data().map(|()| None);
        for found in [data, self.scene_json().map(Some)] {
            match found {
                Ok(None) => {}
                Ok(Some(scene)) => damage.extend(self.contradiction(&scene)),
                Err(LogError::Damaged(lost)) => damage.push(lost),
                Err(other) => return Err(other),
            }
        }
        Ok(damage)
    }

    /// What the metadata record says otherwise than the scene.
    fn contradiction(&self, json: &str) -> Option<Damage> {
        let scene = Scene::parse(json, &[]).ok()?;
        let n = Effects::of(&scene).ok()?.particles;
        let (said, RunInfo { seed, model, particles, time_scale, terms, .. }) =
            (&self.run, RunInfo::new(&scene, json, n, &self.run.build));
        let pairs = [
            ("n", said.particles.to_string(), particles.to_string()),
            ("seed", said.seed.to_string(), seed.to_string()),
            ("model", said.model.clone(), model),
            ("time_scale", said.time_scale.to_string(), time_scale.to_string()),
            ("terms", said.terms.join(" "), terms.join(" ")),
        ];
        let (key, said, scene) = pairs.into_iter().find(|(_, said, scene)| said != scene)?;
        let what = format!("the metadata record `run` says that {key} is {said}, and the scene that it is {scene}");
        Some(Damage { offset: 0, what })
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
            // Its own checksum holds: it may be the hash that is damaged.
            match self.container.check_data() {
                Ok(()) if self.container.damage.is_empty() => {
                    return Err(lost("is not the one whose hash stands in the metadata"));
                }
                Ok(()) | Err(LogError::Damaged(_)) => {}
                Err(other) => return Err(other),
            }
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
