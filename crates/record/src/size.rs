//! How large a log will be.

use agglo_core::scene::{Compression, Precision, Scene};

use crate::channels::Effects;
use crate::cloud::CloudWriter;

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
    // Share of a byte that is left of it. Mantissas do not compress; signs, exponents and colours do. Measured on the
    // paper's cloud, rounded up.
    let (floats, rest) = match record.compression {
        Compression::Zstd => (0.93, 0.45),
        Compression::Lz4 => (1.0, 0.7),
        Compression::None => (1.0, 1.0),
    };
    let columns = 6.0 + f64::from(u8::from(effects.thermal));
    let number = match effects.precision {
        Precision::F64 => 8.0,
        Precision::F32 => 4.0,
    };
    let row = columns * number;
    let other = CloudWriter::new(&effects).stride() as f64 - row;
    // Every message has a header of 31 bytes in its chunk and an entry of 16 bytes in the index behind it.
    const INDEX: f64 = 16.0;
    const HEADER: f64 = 31.0;
    let per_step = 140.0 * rest + HEADER * rest + INDEX;
    let cloud = n * (row * floats + other * rest) + 400.0 * rest + INDEX;
    let energy = (180.0 + HEADER) * rest + INDEX;
    let clusters = if effects.clusters { (40.0 + HEADER) * rest + INDEX } else { 0.0 };
    let per_frame = cloud + energy + clusters;
    let per_marker = if effects.markers { n * 115.0 * 0.6 * rest / 0.45 + INDEX } else { 0.0 };
    let per_checkpoint = n * (12.0 + columns - 6.0) * 8.0 * floats + 600.0;
    let fixed = 60_000.0 + scene.to_json().len() as f64 + n * 24.0;

    let frames = match (record.every_steps, record.interval) {
        (_, Some(interval)) => ((scene.duration / interval).ceil() as u64).min(steps),
        (every, None) => steps / every.unwrap_or(1).max(1),
    }
    .saturating_add(2);
    let markers = (scene.duration * record.time_scale * record.markers).ceil().min(frames as f64);
    let checkpoints = (steps / record.checkpoint_every.max(1) + 2) as f64;
    let total = fixed
        + per_step * steps as f64
        + per_frame * frames as f64
        + per_marker * markers
        + per_checkpoint * checkpoints;
    SizeEstimate { per_step, per_frame, per_marker, per_checkpoint, fixed, steps, frames, total: total.ceil() as u64 }
}
