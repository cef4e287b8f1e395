//! How large a log will be.

use agglo_core::scene::{Compression, ParticleSource, Precision, Record, Scene};

use crate::channels::Effects;
use crate::cloud::CloudWriter;

/// Head of a message in its chunk [bytes].
const HEAD: f64 = 31.0;

/// Entry of a message in the index behind its chunk [bytes].
const INDEX: f64 = 16.0;

/// What compression leaves of the numbers of a cloud that keeps moving: with steps so small that only the last bytes of
/// its positions change, a tenth [-].
const MOVING: f64 = 0.1;

/// An estimate of a log's size, without impacts and rejected attempts, whose numbers only a run can tell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeEstimate {
    /// Every accepted step: diagnostics [bytes].
    pub per_step: f64,
    /// Every recorded state, its energies and clusters [bytes].
    pub per_frame: f64,
    /// Every set of spheres for viewers; 0 without [bytes].
    pub per_marker: f64,
    /// Every checkpoint [bytes].
    pub per_checkpoint: f64,
    /// Written once: scene, layout, schemas, radii and masses [bytes].
    pub fixed: f64,
    /// Steps that were assumed.
    pub steps: u64,
    /// Recorded states that follow from them.
    pub frames: u64,
    /// All together [bytes].
    pub total: u64,
}

/// Estimates the log of a scene of `particles` particles over `steps` accepted steps.
#[must_use]
pub fn estimate(scene: &Scene, particles: usize, steps: u64) -> SizeEstimate {
    let effects = Effects::new(scene, particles);
    let n = particles as f64;
    let record = &scene.record;
    // What is left of a byte of a measured number, whose mantissa does not compress, and of any other byte.
    let (number, other) = match record.compression {
        Compression::Zstd => (0.9, 0.15),
        Compression::Lz4 => (1.0, 0.3),
        Compression::None => (1.0, 1.0),
    };
    // A message of `numbers` bytes of measured numbers and `others` other bytes, with its head in the chunk and its
    // entry in the index behind the chunk, which is not compressed.
    let message = |numbers: f64, others: f64| numbers * number + (others + HEAD) * other + INDEX;

    let width = match effects.precision {
        Precision::F64 => 8.0,
        Precision::F32 => 4.0,
    };
    let columns = if effects.thermal { 7.0 } else { 6.0 };
    let row = columns * width;
    let rest_of_row = CloudWriter::new(&effects).stride() as f64 - row;

    // Typical messages of the shipped scenes: some three iterations a step, a dozen energies that are not zero.
    let per_step = message(45.0, 25.0);
    let clusters = if effects.clusters { message(4.0, 24.0) } else { 0.0 };
    let per_frame = message(n * row, n * rest_of_row + 270.0) + message(100.0, 60.0) + clusters;
    // Positions stand in the state just before, so that little of a sphere is new.
    let per_marker = if effects.markers { message(n * 12.0, n * 100.0 + 150.0) } else { 0.0 };
    let per_checkpoint = message(n * (columns + 3.0) * 8.0, 300.0);
    // Layout, schemas and the index of chunks; the scene; ids, radii, masses.
    let fixed = 26_000.0 + scene.to_json().len() as f64 + n * 24.0 * number;

    let frames = frames(record, scene.duration, steps).saturating_add(2);
    let markers = (scene.duration * record.time_scale * record.markers).ceil().min(frames as f64);
    let checkpoints = (steps / record.checkpoint_every.max(1) + 2) as f64;
    let total = fixed
        + per_step * steps as f64
        + per_frame * frames as f64
        + per_marker * markers
        + per_checkpoint * checkpoints;
    SizeEstimate { per_step, per_frame, per_marker, per_checkpoint, fixed, steps, frames, total: total.ceil() as u64 }
}

/// Bytes that the log of a scene of `particles` particles takes at the very least in no fewer than `steps` accepted
/// steps.
///
/// Compression leaves next to nothing of states that repeat, so of most scenes only the index is certain; a cloud that
/// is thrown at random and that no wall stops cannot come to rest.
#[must_use]
pub fn least(scene: &Scene, particles: usize, steps: u64) -> u64 {
    /// Schemas, layout and the end of a log, a good part smaller than they are [bytes].
    const FIXED: f64 = 12_000.0;
    let effects = Effects::new(scene, particles);
    let thrown = match &scene.particles {
        ParticleSource::RandomCube(cube) => cube.velocity_spread.iter().all(|spread| *spread > 0.0),
        _ => false,
    };
    let walls = scene.domain.as_ref().is_some_and(|domain| !domain.walls.is_empty());
    let left = match scene.record.compression {
        Compression::None => 1.0,
        _ if thrown && !walls => MOVING,
        _ => 0.0,
    };
    let state = particles as f64 * CloudWriter::new(&effects).stride() as f64;
    // A state comes with its energies, and with its clusters where they are counted.
    let messages = if effects.clusters { 3.0 } else { 2.0 };
    let per_frame = messages * INDEX + state * left;
    let frames = frames(&scene.record, scene.duration, steps).saturating_sub(1);
    (FIXED + scene.to_json().len() as f64 + INDEX * steps as f64 + per_frame * frames as f64) as u64
}

/// Recorded states in so many steps, those at both ends apart.
fn frames(record: &Record, duration: f64, steps: u64) -> u64 {
    match (record.every_steps, record.interval) {
        (_, Some(interval)) => ((duration / interval).ceil() as u64).min(steps),
        (every, None) => steps / every.unwrap_or(1).max(1),
    }
}
