//! (g) Recording on and off: what a log costs the solver, in bytes, and against plain writing and compressing.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use agglo_core::observer::ObserverError;
use agglo_core::scene::{Compression, ParticleSource};
use agglo_core::{Flow, Observer, Scene, Simulation, StepReport};
use agglo_record::channels::Topic;
use agglo_record::{BuildInfo, Options, Recorder};

use super::measure::{row, solve, threads};
use super::{Context, Section};
use crate::Failure;

/// Largest ratio to plain writing or compressing that reaches 60 % of its rate [-].
const SHARE: f64 = 1.0 / 0.6;
/// What plain writing hands over at once [bytes].
const PLAIN: usize = 1 << 20;

/// A recorder, and how long it took of the solver's thread.
struct Timed {
    recorder: Recorder<BufWriter<File>>,
    seconds: f64,
}

impl Observer for Timed {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        let start = Instant::now();
        let flow = self.recorder.step(report);
        self.seconds += start.elapsed().as_secs_f64();
        flow
    }
}

/// What a recorded run came to.
struct Recorded {
    /// From the first step to the log's end [s].
    wall: f64,
    /// Of it in the recorder, where it has no thread of its own [s].
    recording: f64,
    /// Of the `/particles` messages, uncompressed [bytes].
    states: u64,
    /// Recorded states.
    frames: u64,
    /// Of the log [bytes].
    bytes: u64,
}

fn record(scene: &Scene, compression: Compression, apart: bool, path: &Path) -> Result<Recorded, Failure> {
    let mut scene = scene.clone();
    scene.record.compression = compression;
    let mut simulation = Simulation::new(&scene)?;
    let build = BuildInfo { version: env!("CARGO_PKG_VERSION").to_owned(), commit: "unknown".to_owned() };
    let mut recorder = Recorder::create(BufWriter::new(File::create(path)?), &scene, &build, Options::default())?;
    let states = Arc::new(AtomicU64::new(0));
    let counted = Arc::clone(&states);
    recorder.tap(Box::new(move |message| {
        if message.topic == Topic::Particles {
            counted.fetch_add(message.data.len() as u64, Ordering::Relaxed);
        }
    }));
    let recorder = if apart { recorder.on_own_thread()? } else { recorder };
    let mut timed = Timed { recorder, seconds: 0.0 };
    let start = Instant::now();
    simulation.run(&mut timed)?;
    let finishing = Instant::now();
    let done = timed.recorder.finish()?;
    Ok(Recorded {
        wall: start.elapsed().as_secs_f64(),
        recording: timed.seconds + finishing.elapsed().as_secs_f64(),
        states: states.load(Ordering::Relaxed),
        frames: done.frames,
        bytes: done.bytes,
    })
}

/// Seconds of writing these bytes as `dd` does, and of one core's `zstd -1` on them.
fn plainly(bytes: &[u8], path: &Path) -> Result<(f64, f64), Failure> {
    let start = Instant::now();
    let mut file = File::create(path)?;
    for block in bytes.chunks(PLAIN) {
        file.write_all(block)?;
    }
    let writing = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let compressed = zstd::stream::encode_all(bytes, 1)?;
    let compressing = start.elapsed().as_secs_f64();
    if compressed.is_empty() { Err("nothing was compressed".into()) } else { Ok((writing, compressing)) }
}

/// The cloud of `cloud.rs` with temperatures, every step recorded.
fn scene(n: usize, steps: u64) -> Result<Scene, Failure> {
    let mut scene = super::cloud::scene(n, steps)?;
    let warm = super::parse(
        r#"{ "duration": 1, "particles": { "random_cube": {
            "count": 1, "side": 1, "radius": 0.25, "density": 2.0, "temperature": 300 } },
            "thermal": { "heat_capacity": 1000, "radiation": { "emissivity": 0.5, "surroundings": 250 } } }"#,
    )?;
    scene.thermal = warm.thermal;
    if let (ParticleSource::RandomCube(cube), ParticleSource::RandomCube(warm)) = (&mut scene.particles, warm.particles)
    {
        cube.temperature = warm.temperature;
    }
    scene.record.every_steps = Some(1);
    Ok(scene)
}

pub fn run(context: &Context) -> Result<Section, Failure> {
    let (n, steps, rounds) = if context.quick { (10_000, 5, 1) } else { (100_000, 20, 5) };
    let large = scene(n, steps)?;
    let log = context.scratch.join("recorded.mcap");
    let other = context.scratch.join("plain");
    let mut found: [Vec<f64>; 6] = Default::default();
    for _ in 0..rounds {
        let off = threads(1, || solve(&large))??.wall;
        let beside = threads(1, || record(&large, Compression::Zstd, true, &log))??;
        let within = threads(1, || record(&large, Compression::Zstd, false, &log))??;
        let plain = threads(1, || record(&large, Compression::None, false, &log))??;
        let (writing, compressing) = plainly(&std::fs::read(&log)?, &other)?;
        let per_state = |bytes: u64| bytes as f64 / (beside.frames * n as u64) as f64;
        for (found, value) in found.iter_mut().zip([
            beside.wall / off,
            within.wall / off,
            plain.recording / writing,
            within.recording / compressing,
            per_state(beside.states),
            per_state(beside.bytes),
        ]) {
            found.push(value);
        }
    }
    let small = threads(1, || record(&scene(100, 200)?, Compression::Zstd, false, &log))??;
    let small = small.states as f64 / (small.frames * 100) as f64;
    let [beside, within, writing, compressing, states, file] = found;
    let limit = |value: f64| Some(("limit".to_owned(), value));
    Ok(Section {
        title: "Recording",
        about: "The bonded cloud with temperatures, 100 000 particles, 20 steps, every step recorded; the solver has one \
                thread. Wall time, closing the log included, over that of the same run without a log; the recorder's time on \
                the solver's thread over that of writing the same bytes in blocks of 1 MiB, as `dd` does, and of one core's \
                `zstd -1` on them: limits are those of 60 % of either's rate."
            .to_owned(),
        rows: vec![
            row("solver and log, a thread each, over no log", beside, "-", limit(1.1)),
            row("solver and log on one thread, over no log", within, "-", None),
            row("`compression: none`, over plain writing", writing, "-", limit(SHARE)),
            row("the default, over `zstd -1`", compressing, "-", limit(SHARE)),
            row("`/particles`", states, "B/particle-step", limit(60.0)),
            row("`/particles`, n = 100", vec![small], "B/particle-step", limit(62.0)),
            row("the whole log, compressed", file, "B/particle-step", None),
        ],
        figure: None,
    })
}
