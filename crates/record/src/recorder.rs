//! The recorder: watches a run and writes its log.

use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use agglo_core::diagnostics::{Level, Notice};
use agglo_core::observer::{Flow, Observer, ObserverError, StepReport};
use agglo_core::scene::Scene;
use agglo_core::state::{Particles, State};

use crate::apart::Apart;
use crate::channels::Topic;
use crate::cloud::Frame;
use crate::container::{Container, Totals};
use crate::encoder::{Encoded, Encoder};
use crate::error::RecordError;
use crate::run::{BuildInfo, RunInfo};
use crate::sink::sink;

/// Uncompressed size at which a chunk is closed, at the end of a step [bytes]: the smaller, the less is lost when a run
/// is killed and the sooner a viewer has loaded what it shows; the larger, the better it compresses.
const CHUNK_BYTES: usize = 1024 * 1024;

/// Steps after which a chunk is closed however small it is, so that small scenes do not lose a whole run.
const CHUNK_STEPS: u64 = 1000;

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
    file: File<W>,
    /// Of messages in the current chunk [bytes].
    pending_bytes: usize,
    /// In the current chunk.
    pending_steps: u64,
    bytes: Arc<AtomicU64>,
    options: Options,
    started: bool,
    failure: Option<String>,
}

/// Where the file is written.
enum File<W: Write> {
    Here(Box<Container<W>>),
    Apart(Apart),
}

impl<W: Write> File<W> {
    fn send(&mut self, message: Encoded<'_>) -> Result<(), RecordError> {
        match self {
            Self::Here(container) => container.send(message),
            Self::Apart(apart) => apart.send(message),
        }
    }

    fn flush(&mut self) -> Result<(), RecordError> {
        match self {
            Self::Here(container) => container.flush(),
            Self::Apart(apart) => apart.flush(),
        }
    }

    /// Waits until what was flushed has left for the output.
    fn wait(&mut self) -> Result<(), RecordError> {
        match self {
            Self::Apart(apart) => apart.wait(),
            Self::Here(_) => Ok(()),
        }
    }

    fn finish(&mut self) -> Result<Totals, RecordError> {
        match self {
            Self::Here(container) => container.finish(),
            Self::Apart(apart) => apart.finish(),
        }
    }
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
        let container = Container::create(sink, scene, &scene_json, &effects, &run)?;
        let file = File::Here(Box::new(container));
        let (pending_bytes, pending_steps) = (0, 0);
        Ok(Self { encoder, file, pending_bytes, pending_steps, bytes, options, started: false, failure: None })
    }

    /// From now on compresses and writes on a thread of its own, beside the solver. The log is the same; a failure of the
    /// output comes up up to three batches of messages later.
    ///
    /// # Errors
    /// A thread that the operating system refuses.
    pub fn on_own_thread(self) -> Result<Self, RecordError>
    where
        W: Send + 'static,
    {
        let file = match self.file {
            File::Here(container) => File::Apart(Apart::new(*container)?),
            apart @ File::Apart(_) => apart,
        };
        Ok(Self { file, ..self })
    }

    /// Writes a message to `/log` at the time of the last step, for what the solver cannot say itself: why a run ended.
    ///
    /// # Errors
    /// A write that failed, now or before.
    pub fn note(&mut self, level: Level, message: impl Into<String>) -> Result<(), RecordError> {
        self.guarded(|recorder| recorder.notice(&Notice { level, message: message.into() }))
    }

    /// From now on `tap` sees every message, after the log has it and on the thread that writes it. It cannot change the
    /// log.
    ///
    /// # Panics
    /// After [`Recorder::on_own_thread`].
    pub fn tap(&mut self, tap: Tap) {
        match &mut self.file {
            File::Here(container) => container.tap = Some(tap),
            File::Apart(_) => panic!("a tap goes in before the recorder has a thread of its own"),
        }
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
        let Totals { messages, frames } = self.guarded(|recorder| recorder.file.finish())?;
        Ok(Recorded { bytes: self.bytes_written(), messages, frames })
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
        let Self { encoder, file, pending_bytes, .. } = self;
        encoder.step(report, &mut |message| send(file, pending_bytes, message))?;
        self.end_step()
    }

    fn notice(&mut self, notice: &Notice) -> Result<(), RecordError> {
        let Self { encoder, file, pending_bytes, .. } = self;
        encoder.notice(notice, &mut |message| send(file, pending_bytes, message))
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
                let message = Encoded { topic: *topic, log_time: *log_time, data };
                send(&mut recorder.file, &mut recorder.pending_bytes, message)?;
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
        self.pending_steps += 1;
        // The start is written out at once: a log that is cut off later still says what was run.
        let first = !std::mem::replace(&mut self.started, true);
        if !first && self.pending_bytes < CHUNK_BYTES && self.pending_steps < CHUNK_STEPS {
            return Ok(());
        }
        (self.pending_bytes, self.pending_steps) = (0, 0);
        self.file.flush()?;
        // An output that takes nothing at all is noticed at once, and a limit always at the same step.
        if first || self.options.max_bytes.is_some() {
            self.file.wait()?;
        }
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

/// Sends a message, and counts it into the current chunk.
fn send<W: Write>(file: &mut File<W>, pending_bytes: &mut usize, message: Encoded<'_>) -> Result<(), RecordError> {
    *pending_bytes += message.data.len();
    file.send(message)
}

impl<W: Write> Observer for Recorder<W> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.guarded(|recorder| recorder.record(report))?;
        Ok(Flow::Continue)
    }
}
