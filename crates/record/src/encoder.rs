//! What the solver reports, as the messages of a log in their order.

use agglo_core::diagnostics::Notice;
use agglo_core::observer::{Sample, StepReport};
use agglo_core::scene::{Precision, Scene};
use agglo_core::state::{Particles, State};
use prost::Message;

use crate::channels::{CHANNELS, Effects, Topic};
use crate::cloud::{CloudWriter, Frame};
use crate::convert;
use crate::error::RecordError;
use crate::markers::Markers;
use crate::palette::Palette;
use crate::run::log_time;

/// An encoded message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Encoded<'a> {
    /// Its channel.
    pub topic: Topic,
    /// Log time [ns].
    pub log_time: u64,
    /// The message.
    pub data: &'a [u8],
}

/// Takes encoded messages, one after another.
pub type Send<'a> = &'a mut dyn FnMut(Encoded<'_>) -> Result<(), RecordError>;

/// Turns reports into messages. The same reports give the same bytes.
#[derive(Clone, Debug)]
pub struct Encoder {
    /// Until the first state is known, where states are drawn.
    scene: Option<Scene>,
    effects: Effects,
    time_scale: f64,
    cloud: CloudWriter,
    /// What draws states, from then on.
    drawing: Option<Drawing>,
    buffer: Vec<u8>,
    /// Time, step and log time of the last step seen.
    last: (f64, u64, u64),
    started: bool,
}

#[derive(Clone, Debug)]
struct Drawing {
    markers: Markers,
    palette: Palette,
    /// A state as it reads back from the log, which colours follow: a reader must come to the same ones.
    as_recorded: State,
}

impl Drawing {
    fn colors(&mut self, precision: Precision, particles: &Particles, state: &State) -> &[[u8; 4]] {
        match precision {
            Precision::F64 => self.palette.colors(particles, state),
            Precision::F32 => {
                round(&mut self.as_recorded, state);
                self.palette.colors(particles, &self.as_recorded)
            }
        }
    }
}

/// Copies a state as it reads back from f32.
fn round(to: &mut State, from: &State) {
    let single = |to: &mut [f64], from: &[f64]| {
        for (to, from) in to.iter_mut().zip(from) {
            *to = f64::from(*from as f32);
        }
    };
    to.clone_from(from);
    for (to, from) in to.position.axes_mut().into_iter().zip(from.position.axes()) {
        single(to, from);
    }
    for (to, from) in to.velocity.axes_mut().into_iter().zip(from.velocity.axes()) {
        single(to, from);
    }
    if let (Some(to), Some(from)) = (&mut to.temperature, &from.temperature) {
        single(to, from);
    }
}

impl Encoder {
    /// An encoder for a run of a scene from its start.
    ///
    /// # Errors
    /// A scene whose particles still refer to a file or log.
    pub fn new(scene: &Scene) -> Result<Self, RecordError> {
        let effects = Effects::of(scene)?;
        Ok(Self {
            scene: effects.markers.then(|| scene.clone()),
            cloud: CloudWriter::new(&effects),
            effects,
            time_scale: scene.record.time_scale,
            drawing: None,
            buffer: Vec::new(),
            last: (0.0, 0, 0),
            started: false,
        })
    }

    /// What of the scene decides about channels and columns.
    #[must_use]
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// Takes note of the start of a run whose first steps are in a log already; nothing is encoded.
    pub fn begin(&mut self, particles: &Particles, start: &State) {
        self.started = true;
        if let Some(scene) = self.scene.take() {
            self.drawing = Some(Drawing {
                markers: Markers::new(&scene, scene.record.markers, particles, start),
                palette: Palette::new(&scene, particles, start),
                as_recorded: State::default(),
            });
        }
    }

    /// Takes note of a state that is in a log already; nothing is encoded.
    pub fn pass(&mut self, particles: &Particles, frame: &Frame) {
        let Frame { t, step, position, velocity, temperature, cluster: _ } = frame;
        self.last = (*t, *step, log_time(*t, self.time_scale));
        if let Some(drawing) = &mut self.drawing {
            let (position, velocity, temperature) = (position.clone(), velocity.clone(), temperature.clone());
            drawing.palette.colors(particles, &State { position, velocity, temperature });
            drawing.markers.due(self.last.2);
        }
    }

    /// The messages of a step.
    ///
    /// # Errors
    /// What `send` says; columns that are not those of the scene.
    pub fn step(&mut self, report: &StepReport<'_>, send: Send<'_>) -> Result<(), RecordError> {
        // Taken apart without `..`: what the solver newly reports must be recorded.
        let StepReport { time, step, particles, state, diagnostics, impacts, sample, checkpoint, notices } = *report;
        self.last = (time, step, log_time(time, self.time_scale));
        self.check(report)?;
        if !self.started {
            self.begin(particles, state);
            self.send(Topic::ParticlesStatic, &convert::particles(time, step, particles), send)?;
        }
        if let Some(diagnostics) = diagnostics {
            self.send(Topic::Diagnostics, &convert::diagnostics(time, step, diagnostics), send)?;
        }
        if !impacts.is_empty() {
            self.send(Topic::Impacts, &convert::impacts(time, step, impacts), send)?;
        }
        if let Some(sample) = sample {
            self.frame(report, sample, send)?;
        }
        for notice in notices {
            self.notice(notice, send)?;
        }
        if let Some(checkpoint) = checkpoint {
            self.send(Topic::Checkpoint, &convert::checkpoint(checkpoint), send)?;
        }
        Ok(())
    }

    /// A message for people at the time of the last step.
    ///
    /// # Errors
    /// What `send` says.
    pub fn notice(&mut self, notice: &Notice, send: Send<'_>) -> Result<(), RecordError> {
        let (time, step, log_time) = self.last;
        self.send(Topic::Log, &convert::notice(time, step, log_time, notice), send)
    }

    /// A recorded state, with what is computed for recorded states only.
    fn frame(&mut self, report: &StepReport<'_>, sample: &Sample, send: Send<'_>) -> Result<(), RecordError> {
        let (time, step, log_time) = self.last;
        let clusters = if self.effects.clusters { sample.clusters.as_ref() } else { None };
        let mut drawing = self.drawing.take();
        let precision = self.effects.precision;
        let colors = drawing.as_mut().map(|drawing| drawing.colors(precision, report.particles, report.state));
        self.buffer.clear();
        self.cloud.encode(&mut self.buffer, self.last, report.state, clusters.map(|found| &found.of[..]), colors);
        send(Encoded { topic: Topic::Particles, log_time, data: &self.buffer })?;
        let energy = convert::energy(time, step, sample, report.particles, report.state);
        self.send(Topic::Energy, &energy, send)?;
        if let Some(clusters) = clusters {
            self.send(Topic::Clusters, &convert::clusters(time, step, clusters), send)?;
        }
        if let Some(Drawing { markers, palette, .. }) = &mut drawing
            && markers.due(log_time)
        {
            self.send(Topic::Scene, markers.message(self.last, report.state, palette.last()), send)?;
        }
        self.drawing = drawing;
        Ok(())
    }

    fn send(&mut self, topic: Topic, message: &impl Message, send: Send<'_>) -> Result<(), RecordError> {
        if !(CHANNELS[topic as usize].present)(&self.effects) {
            let name = CHANNELS[topic as usize].name;
            return Err(RecordError::Mismatch(format!("a message for {name}, which this scene does not have")));
        }
        self.buffer.clear();
        // Encoding into a Vec cannot run out of space.
        let _ = message.encode(&mut self.buffer);
        send(Encoded { topic, log_time: self.last.2, data: &self.buffer })
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
