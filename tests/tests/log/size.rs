//! How large a log is, and how near the estimate comes.

use agglo_core::observer::Observer;
use agglo_core::scene::{Compression, Precision};
use agglo_core::{Scene, Simulation};
use agglo_record::channels::{Effects, present};
use agglo_record::cloud::CloudWriter;
use agglo_record::{Options, Recorder, estimate};

use crate::story::{Kind, build};

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
        if let Some(diagnostics) = &mut told.diagnostics {
            diagnostics.rejected.clear();
        }
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

/// Bytes of a log of four states of 10 000 particles, whose every state is drawn or none is.
fn drawn_over_undrawn(kind: Kind) -> f64 {
    let bytes = |markers| per_particle_step(&Kind { n: 10_000, markers, ..kind }, 3);
    bytes(1e6) / bytes(0.0)
}

#[test]
fn spheres_and_colours_add_at_most_three_fifths() {
    // The worst case: noise, and every recorded state is drawn; at 30 Hz most are not.
    for (name, kind) in [
        ("temperatures and clusters", Kind { binding: true, ..THERMAL }),
        ("temperatures", THERMAL),
        ("speeds", Kind { thermal: false, ..THERMAL }),
        ("charges", Kind { thermal: false, charge: true, ..THERMAL }),
    ] {
        let ratio = drawn_over_undrawn(kind);
        assert!(ratio <= 1.6, "{name}: {ratio} times the states alone");
    }
}

#[test]
fn more_than_ten_thousand_are_not_drawn() {
    let effects = |n| {
        let kind = Kind { n, markers: 30.0, ..THERMAL };
        Effects::of(&kind.scene()).unwrap()
    };
    let topics = |n| present(&effects(n)).map(|channel| channel.name).collect::<Vec<_>>();
    assert!(topics(10_000).contains(&"/scene") && !topics(10_001).contains(&"/scene"));
    // Four bytes of colour.
    assert_eq!(CloudWriter::new(&effects(10_000)).stride(), CloudWriter::new(&effects(10_001)).stride() + 4);
}

/// Records a run of a scene and compares with the estimate for as many steps.
fn estimated_over_written(change: impl Fn(&mut Scene), text: &str) -> f64 {
    let mut scene = Scene::parse(text, &[]).unwrap();
    change(&mut scene);
    let mut simulation = Simulation::new(&scene).unwrap();
    let mut recorder = Recorder::create(std::io::sink(), &scene, &build(), Options::default()).unwrap();
    let outcome = simulation.run(&mut recorder).unwrap();
    let bytes = recorder.finish().unwrap().bytes as f64;
    estimate(&scene, simulation.particles().len(), outcome.counters.steps).total as f64 / bytes
}

#[test]
fn the_estimate_is_right_to_a_third() {
    // Impacts are not in the estimate, so the paper's cloud is taken without binding: it has few.
    let cloud = include_str!("../../../scenes/paper-free-2e6.json");
    let pair = include_str!("../../../scenes/two-body-oscillator.json");
    type Change = fn(&mut Scene);
    let cases: [(&str, &str, Change); 6] = [
        ("cloud", cloud, |scene| scene.duration = 1.0),
        ("cloud without markers", cloud, |scene| {
            scene.duration = 1.0;
            scene.record.markers = 0.0;
        }),
        ("cloud, uncompressed", cloud, |scene| {
            scene.duration = 1.0;
            scene.record.compression = Compression::None;
        }),
        ("cloud, single precision, lz4", cloud, |scene| {
            scene.duration = 1.0;
            scene.record.precision = Precision::F32;
            scene.record.compression = Compression::Lz4;
        }),
        ("cloud, every tenth step", cloud, |scene| {
            scene.duration = 1.0;
            scene.record.every_steps = Some(10);
        }),
        ("cloud, by time", cloud, |scene| {
            scene.duration = 1.0;
            scene.record.every_steps = None;
            scene.record.interval = Some(0.05);
        }),
    ];
    for (name, text, change) in cases {
        let ratio = estimated_over_written(change, text);
        assert!((0.75..1.33).contains(&ratio), "{name}: {ratio} of what was written");
    }
    // Two bodies on a line hold many zeros, which the estimate cannot know: it may be too large, but not too small.
    let ratio = estimated_over_written(|_| {}, pair);
    assert!((0.9..2.5).contains(&ratio), "two bodies: {ratio} of what was written");
}
