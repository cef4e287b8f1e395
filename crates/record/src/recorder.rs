//! The recorder: watches a run and writes its log.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use agglo_core::diagnostics::{Level, Notice};
use agglo_core::observer::{Flow, Observer, ObserverError, StepReport};
use agglo_core::scene::{Compression, Scene};
use agglo_core::state::{Particles, State};
use mcap::records::MessageHeader;

use crate::channels::{CHANNELS, Topic, present};
use crate::cloud::Frame;
use crate::encoder::{Encoded, Encoder};
use crate::error::RecordError;
use crate::layout::layout;
use crate::run::{self, BuildInfo, RunInfo};
use crate::sink::{Sink, sink};

/// Uncompressed size at which a chunk is closed, at the end of a step [bytes]: the smaller, the less is lost when a run
/// is killed and the sooner a viewer has loaded what it shows; the larger, the better it compresses.
const CHUNK_BYTES: usize = 1024 * 1024;

/// Steps after which a chunk is closed however small it is, so that small scenes do not lose a whole run.
const CHUNK_STEPS: u64 = 1000;

/// Level of zstd: a second level costs twice the time and saves less than 1 % on mantissas.
const ZSTD_LEVEL: u32 = 1;

/// How a log is written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// Largest size of the log [bytes]; `None`: any. A log may exceed it by its last chunk and summary.
    pub max_bytes: Option<u64>,
}

/// Sees every message that goes into a log, as it goes in: who watches a run gets what is recorded.
pub type Tap = Box<dyn FnMut(Encoded<'_>) + Send>;

/// What was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// Size of the log [bytes].
    pub bytes: u64,
    /// Messages on all channels.
    pub messages: u64,
    /// Recorded states.
    pub frames: u64,
}

/// Writes the log of one run to `W`, which need not seek.
///
/// A log is whole only after [`Recorder::finish`]; dropping a recorder loses the error of a full disk.
#[must_use = "a log is whole only after `finish`"]
pub struct Recorder<W: Write> {
    encoder: Encoder,
    container: Container<W>,
    bytes: Arc<AtomicU64>,
    options: Options,
    started: bool,
    failure: Option<String>,
}

impl<W: Write> Recorder<W> {
    /// Starts a log: writes its metadata, the scene as resolved, the viewer layout, and the schemas and channels that
    /// the scene has.
    ///
    /// # Errors
    /// A write that failed; a scene whose particles still refer to a file or log.
    pub fn create(writer: W, scene: &Scene, build: &BuildInfo, options: Options) -> Result<Self, RecordError> {
        let encoder = Encoder::new(scene)?;
        let effects = *encoder.effects();
        let scene_json = scene.to_json();
        let run = RunInfo::new(scene, &scene_json, effects.particles, build);

        let (sink, bytes) = sink(writer);
        let mut writer = mcap::Writer::with_options(sink, write_options(scene.record.compression, &build.version))?;
        writer.write_metadata(&mcap::records::Metadata { name: run::RECORD.to_owned(), metadata: run.to_map() })?;
        let layout = layout(scene);
        for (name, text) in [(run::SCENE, &scene_json), (run::LAYOUT, &layout)] {
            writer.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.to_owned(),
                media_type: "application/json".to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        let mut ids = [None; CHANNELS.len()];
        for channel in present(&effects) {
            let schema = writer.add_schema(channel.schema, "protobuf", channel.descriptor)?;
            ids[channel.topic as usize] =
                Some(writer.add_channel(schema, channel.name, "protobuf", &BTreeMap::new())?);
        }
        let counts = [0; CHANNELS.len()];
        let container = Container { writer, ids, counts, pending_bytes: 0, pending_steps: 0, messages: 0, tap: None };
        Ok(Self { encoder, container, bytes, options, started: false, failure: None })
    }

    /// Writes a message to `/log` at the time of the last step, for what the solver cannot say itself: why a run ended.
    ///
    /// # Errors
    /// A write that failed, now or before.
    pub fn note(&mut self, level: Level, message: impl Into<String>) -> Result<(), RecordError> {
        self.guarded(|recorder| recorder.notice(&Notice { level, message: message.into() }))
    }

    /// From now on `tap` sees every message, after the log has it. It cannot change the log.
    pub fn tap(&mut self, tap: Tap) {
        self.container.tap = Some(tap);
    }

    /// Bytes that have left for the output so far; the rest of the current chunk is still to come.
    #[must_use]
    pub fn bytes_written(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Completes the log: the last chunk, the index, the end mark. The output is flushed.
    ///
    /// # Errors
    /// A write that failed, now or before: the log is then cut off, though all chunks up to there are whole.
    pub fn finish(mut self) -> Result<Recorded, RecordError> {
        self.guarded(|recorder| Ok(recorder.container.writer.finish().map(drop)?))?;
        let Container { messages, counts, .. } = &self.container;
        Ok(Recorded {
            bytes: self.bytes_written(),
            messages: *messages,
            frames: counts[Topic::Particles as usize].into(),
        })
    }

    /// Runs what may fail to write, and refuses to go on after a failure: what follows it would be taken for whole.
    fn guarded<T>(&mut self, act: impl FnOnce(&mut Self) -> Result<T, RecordError>) -> Result<T, RecordError> {
        if let Some(first) = &self.failure {
            return Err(RecordError::AfterFailure(first.clone()));
        }
        let done = act(self);
        if let Err(error @ (RecordError::Write(_) | RecordError::Encode(_))) = &done {
            self.failure = Some(error.to_string());
        }
        done
    }

    fn record(&mut self, report: &StepReport<'_>) -> Result<(), RecordError> {
        let Self { encoder, container, .. } = self;
        encoder.step(report, &mut |message| container.send(message))?;
        self.end_step()
    }

    fn notice(&mut self, notice: &Notice) -> Result<(), RecordError> {
        let Self { encoder, container, .. } = self;
        encoder.notice(notice, &mut |message| container.send(message))
    }

    /// Takes over one step of an earlier log of the same run, its messages as they stand there. [`Recorder::begin`] must
    /// have been called before.
    ///
    /// # Errors
    /// A write that failed, now or before; a message of a channel that the scene does not have.
    pub fn carry(&mut self, particles: &Particles, step: &CarriedStep) -> Result<(), RecordError> {
        self.guarded(|recorder| {
            if let Some(frame) = &step.frame {
                recorder.encoder.pass(particles, frame);
            }
            for (topic, log_time, data) in &step.messages {
                recorder.container.send(Encoded { topic: *topic, log_time: *log_time, data })?;
            }
            recorder.end_step()
        })
    }

    /// Takes note of the start of a run whose first steps are carried over from an earlier log.
    pub fn begin(&mut self, particles: &Particles, start: &State) {
        self.encoder.begin(particles, start);
    }

    /// Closes the chunk at the end of a step when it is due.
    fn end_step(&mut self) -> Result<(), RecordError> {
        self.container.pending_steps += 1;
        // The start is written out at once: a log that is cut off later still says what was run.
        let first = !std::mem::replace(&mut self.started, true);
        let Container { pending_bytes, pending_steps, .. } = self.container;
        if !first && pending_bytes < CHUNK_BYTES && pending_steps < CHUNK_STEPS {
            return Ok(());
        }
        self.container.flush()?;
        match self.options.max_bytes {
            Some(limit) if self.bytes_written() > limit => {
                Err(RecordError::TooLarge { bytes: self.bytes_written(), limit })
            }
            _ => Ok(()),
        }
    }
}

/// A step of an earlier log, as it stands there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarriedStep {
    /// Channel, log time [ns] and content of its messages.
    pub messages: Vec<(Topic, u64, Vec<u8>)>,
    /// Its recorded state, if it has one.
    pub frame: Option<Frame>,
}

/// The MCAP file being written.
struct Container<W: Write> {
    writer: mcap::Writer<Sink<W>>,
    ids: [Option<u16>; CHANNELS.len()],
    counts: [u32; CHANNELS.len()],
    pending_bytes: usize,
    pending_steps: u64,
    messages: u64,
    tap: Option<Tap>,
}

impl<W: Write> Container<W> {
    fn send(&mut self, message: Encoded<'_>) -> Result<(), RecordError> {
        let Encoded { topic, log_time, data } = message;
        let Some(channel_id) = self.ids[topic as usize] else {
            let name = CHANNELS[topic as usize].name;
            return Err(RecordError::Mismatch(format!("a message for {name}, which this scene does not have")));
        };
        let count = &mut self.counts[topic as usize];
        let header = MessageHeader { channel_id, sequence: *count, log_time, publish_time: log_time };
        *count = count.wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)?;
        self.messages += 1;
        self.pending_bytes += data.len();
        if let Some(tap) = &mut self.tap {
            tap(message);
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush()?;
        self.pending_bytes = 0;
        self.pending_steps = 0;
        Ok(())
    }
}

impl<W: Write> Observer for Recorder<W> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.guarded(|recorder| recorder.record(report))?;
        Ok(Flow::Continue)
    }
}

/// Options that make the same bytes of the same messages: no threads, no clock, and chunks that are closed by us.
/// `version` is that of agglo.
#[must_use]
pub fn write_options(compression: Compression, version: &str) -> mcap::WriteOptions {
    let (compression, level) = match compression {
        Compression::Zstd => (Some(mcap::Compression::Zstd), ZSTD_LEVEL),
        Compression::Lz4 => (Some(mcap::Compression::Lz4), 0),
        Compression::None => (None, 0),
    };
    mcap::WriteOptions::new()
        .compression(compression)
        .compression_level(level)
        .compression_threads(0)
        .chunk_size(None)
        .disable_seeking(true)
        .library(format!("agglo {version}"))
}
