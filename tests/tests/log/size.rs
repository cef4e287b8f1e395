//! How large a log is, and how near the estimate comes.

use agglo_core::observer::Observer;
use agglo_record::{Options, Recorder, estimate};

use crate::story::{Kind, build, log};

/// Temperatures, but no binding, contact, charge or markers: the row that the budget is about.
const THERMAL: Kind = Kind {
    n: 100,
    charge: false,
    thermal: true,
    contact: false,
    binding: false,
    domain: false,
    markers: 0.0,
    record: r#""checkpoint_every": 1000"#,
};

/// Bytes per particle and step of a log whose mantissas are all noise, checkpoints (every fourth step in a story) left
/// out: they are due every 1000 steps in a run.
fn per_particle_step(kind: &Kind, steps: u64) -> f64 {
    let particles = kind.particles();
    let mut recorder = Recorder::create(std::io::sink(), &kind.scene(), &build(), Options::default()).unwrap();
    for mut told in kind.story(steps) {
        told.checkpoint = told.checkpoint.filter(|_| told.step % 1000 == 0);
        told.diagnostics.as_mut().map(|diagnostics| diagnostics.rejected.clear());
        told.notices.clear();
        recorder.step(&told.report(&particles)).unwrap();
    }
    let recorded = recorder.finish().unwrap();
    recorded.bytes as f64 / (kind.n as f64 * (steps + 1) as f64)
}

#[test]
fn a_hundred_particles_take_at_most_62_bytes_each() {
    // Seven 64-bit numbers are 56 bytes. The story is the worst case: every velocity and temperature is new noise.
    let bytes = per_particle_step(&THERMAL, 1500);
    assert!(bytes <= 62.0, "{bytes} bytes per particle and step");
    let with_clusters = per_particle_step(&Kind { binding: true, ..THERMAL }, 1500);
    assert!(with_clusters <= 63.0, "{with_clusters} bytes with clusters");
}

#[test]
fn many_particles_take_at_most_60_bytes_each() {
    // Four states of 1e5 particles; scene, radii, masses and one checkpoint come on top and are shared by all steps of
    // a run, so what is fixed is taken off.
    let kind = Kind { n: 100_000, ..THERMAL };
    let (few, more) = (per_particle_step(&kind, 1) * 2.0, per_particle_step(&kind, 3) * 4.0);
    let bytes = (more - few) / 2.0;
    assert!(bytes <= 60.0, "{bytes} bytes per particle and step");
}

#[test]
fn the_estimate_is_right_to_a_third() {
    for (kind, steps) in [
        (THERMAL, 1500),
        (Kind { n: 2, ..THERMAL }, 3000),
        (Kind { markers: 30.0, binding: true, ..THERMAL }, 1500),
        (Kind { record: r#""compression": "none""#, ..THERMAL }, 1500),
        (Kind { record: r#""precision": "f32", "compression": "lz4""#, ..THERMAL }, 1500),
    ] {
        let mut scene = kind.scene();
        // Stories have a checkpoint every four steps and last a millisecond a step.
        scene.record.checkpoint_every = 4;
        scene.duration = steps as f64 * 1e-3;
        let estimated = estimate(&scene, kind.n, steps).total as f64;
        let bytes = log(&kind, steps).len() as f64;
        let ratio = estimated / bytes;
        assert!((0.75..1.33).contains(&ratio), "n = {}: {estimated} estimated, {bytes} written", kind.n);
    }
}
