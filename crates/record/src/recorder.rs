//! The recorder: watches a run and writes its log.

use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use agglo_core::diagnostics::{Level, Notice};
use agglo_core::observer::{Flow, Observer, ObserverError, Sample, StepReport};
use agglo_core::scene::{Compression, Scene};
use mcap::records::MessageHeader;
use prost::Message;

use crate::channels::{CHANNELS, Effects, Topic, present};
use crate::cloud::CloudWriter;
use crate::convert;
use crate::error::RecordError;
use crate::markers::Markers;
use crate::palette::Palette;
use crate::run::{self, BuildInfo, RunInfo, log_time};
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
    writer: mcap::Writer<Sink<W>>,
    bytes: Arc<AtomicU64>,
    options: Options,
    scene: Option<Scene>,
    effects: Effects,
    time_scale: f64,
    ids: [Option<u16>; CHANNELS.len()],
    counts: [u32; CHANNELS.len()],
    cloud: CloudWriter,
    markers: Option<(Markers, Palette)>,
    buffer: Vec<u8>,
    /// Time, step and log time of the last step seen.
    last: (f64, u64, u64),
    started: bool,
    pending_bytes: usize,
    pending_steps: u64,
    messages: u64,
    frames: u64,
    failure: Option<String>,
}

impl<W: Write> Recorder<W> {
    /// Starts a log: writes its metadata, the scene as resolved, the viewer layout, and the schemas and channels that
    /// the scene has.
    ///
    /// # Errors
    /// A write that failed; a scene whose particles still refer to a file or log.
    pub fn create(writer: W, scene: &Scene, build: &BuildInfo, options: Options) -> Result<Self, RecordError> {
        let effects = Effects::of(scene)?;
        let scene_json = scene.to_json();
        let run = RunInfo::new(scene, &scene_json, effects.particles, build);

        let (sink, bytes) = sink(writer);
        let mut writer = mcap::Writer::with_options(sink, write_options(scene, build))?;
        writer.write_metadata(&mcap::records::Metadata { name: run::RECORD.to_owned(), metadata: run.to_map() })?;
        for (name, text) in [(run::SCENE, scene_json.as_str()), (run::LAYOUT, run::LAYOUT_JSON)] {
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
        Ok(Self {
            writer,
            bytes,
            options,
            scene: effects.markers.then(|| scene.clone()),
            effects,
            time_scale: scene.record.time_scale,
            ids,
            counts: [0; CHANNELS.len()],
            cloud: CloudWriter::new(&effects),
            markers: None,
            buffer: Vec::new(),
            last: (0.0, 0, 0),
            started: false,
            pending_bytes: 0,
            pending_steps: 0,
            messages: 0,
            frames: 0,
            failure: None,
        })
    }

    /// Writes a message to `/log` at the time of the last step, for what the solver cannot say itself: why a run ended.
    ///
    /// # Errors
    /// A write that failed, now or before.
    pub fn note(&mut self, level: Level, message: impl Into<String>) -> Result<(), RecordError> {
        self.guarded(|recorder| recorder.notice(&Notice { level, message: message.into() }))
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
        self.guarded(|recorder| Ok(recorder.writer.finish().map(drop)?))?;
        Ok(Recorded { bytes: self.bytes_written(), messages: self.messages, frames: self.frames })
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
        // Taken apart without `..`: what the solver newly reports must be recorded.
        let StepReport { time, step, particles, state, diagnostics, impacts, sample, checkpoint, notices } = *report;
        self.last = (time, step, log_time(time, self.time_scale));
        self.check(report)?;
        if !self.started {
            self.send(Topic::ParticlesStatic, &convert::particles(time, step, particles))?;
            if let Some(scene) = self.scene.take() {
                let palette = Palette::new(&scene, particles, state);
                self.markers = Some((Markers::new(&scene, scene.record.markers), palette));
            }
        }
        if let Some(diagnostics) = diagnostics {
            self.send(Topic::Diagnostics, &convert::diagnostics(time, step, diagnostics))?;
        }
        if !impacts.is_empty() {
            self.send(Topic::Impacts, &convert::impacts(time, step, impacts))?;
        }
        if let Some(sample) = sample {
            self.frame(report, sample)?;
        }
        if let Some(checkpoint) = checkpoint {
            self.send(Topic::Checkpoint, &convert::checkpoint(checkpoint))?;
        }
        for notice in notices {
            self.notice(notice)?;
        }
        self.pending_steps += 1;
        // The start is written out at once: a log that is cut off later still says what was run.
        if !self.started || self.pending_bytes >= CHUNK_BYTES || self.pending_steps >= CHUNK_STEPS {
            self.flush()?;
        }
        self.started = true;
        Ok(())
    }

    /// A recorded state, with what is computed for recorded states only.
    fn frame(&mut self, report: &StepReport<'_>, sample: &Sample) -> Result<(), RecordError> {
        let (time, step, log_time) = self.last;
        let clusters = if self.effects.clusters { sample.clusters.as_ref() } else { None };
        let mut markers = self.markers.take();
        let colors = markers.as_mut().map(|(_, palette)| palette.colors(report.particles, report.state));
        self.buffer.clear();
        self.cloud.encode(&mut self.buffer, self.last, report.state, clusters.map(|found| &found.of[..]), colors);
        self.send_buffer(Topic::Particles)?;
        self.send(Topic::Energy, &convert::energy(time, step, sample))?;
        if let Some(clusters) = clusters {
            self.send(Topic::Clusters, &convert::clusters(time, step, clusters))?;
        }
        if let Some((markers, palette)) = &mut markers
            && markers.due(log_time)
        {
            self.send(Topic::Scene, markers.message(self.last, report.particles, report.state, palette.last()))?;
        }
        self.markers = markers;
        self.frames += 1;
        Ok(())
    }

    fn notice(&mut self, notice: &Notice) -> Result<(), RecordError> {
        let (time, step, log_time) = self.last;
        self.send(Topic::Log, &convert::notice(time, step, log_time, notice))
    }

    fn send(&mut self, topic: Topic, message: &impl Message) -> Result<(), RecordError> {
        self.buffer.clear();
        // Encoding into a Vec cannot run out of space.
        let _ = message.encode(&mut self.buffer);
        self.send_buffer(topic)
    }

    fn send_buffer(&mut self, topic: Topic) -> Result<(), RecordError> {
        let Some(channel_id) = self.ids[topic as usize] else {
            let name = CHANNELS[topic as usize].name;
            return Err(RecordError::Mismatch(format!("a message for {name}, which this scene does not have")));
        };
        let count = &mut self.counts[topic as usize];
        let (_, _, log_time) = self.last;
        let header = MessageHeader { channel_id, sequence: *count, log_time, publish_time: log_time };
        *count = count.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &self.buffer)?;
        self.messages += 1;
        self.pending_bytes += self.buffer.len();
        Ok(())
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        self.writer.flush()?;
        self.pending_bytes = 0;
        self.pending_steps = 0;
        match self.options.max_bytes {
            Some(limit) if self.bytes_written() > limit => {
                Err(RecordError::TooLarge { bytes: self.bytes_written(), limit })
            }
            _ => Ok(()),
        }
    }

    /// Columns of a length or presence that the log's layout does not have would be written as nonsense.
    fn check(&self, report: &StepReport<'_>) -> Result<(), RecordError> {
        let n = self.effects.particles;
        let state = report.state;
        let thermal = state.temperature.as_ref().map(Vec::len);
        let clusters = report.sample.and_then(|sample| sample.clusters.as_ref()).map(|clusters| clusters.of.len());
        let expected = |on: bool| on.then_some(n);
        let fault = if report.particles.len() != n || state.position.len() != n || state.velocity.len() != n {
            format!("{} particles instead of {n}", state.position.len())
        } else if thermal != expected(self.effects.thermal) {
            format!("{thermal:?} temperatures instead of {:?}", expected(self.effects.thermal))
        } else if report.sample.is_some() && clusters != expected(self.effects.clusters) {
            format!("clusters of {clusters:?} particles instead of {:?}", expected(self.effects.clusters))
        } else {
            return Ok(());
        };
        Err(RecordError::Mismatch(fault))
    }
}

impl<W: Write> Observer for Recorder<W> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.guarded(|recorder| recorder.record(report))?;
        Ok(Flow::Continue)
    }
}

/// Options that make the same bytes of the same messages: no threads, no clock, and chunks that are closed by us.
fn write_options(scene: &Scene, build: &BuildInfo) -> mcap::WriteOptions {
    let compression = match scene.record.compression {
        Compression::Zstd => Some(mcap::Compression::Zstd),
        Compression::Lz4 => Some(mcap::Compression::Lz4),
        Compression::None => None,
    };
    mcap::WriteOptions::new()
        .compression(compression)
        .compression_level(match scene.record.compression {
            Compression::Zstd => ZSTD_LEVEL,
            Compression::Lz4 | Compression::None => 0,
        })
        .compression_threads(0)
        .chunk_size(None)
        .disable_seeking(true)
        .library(format!("agglo {}", build.version))
}
