//! Every field of every report comes back equal, and a log has only what its scene has.

use std::io::Cursor;

use agglo_core::diagnostics::{Level, Notice};
use agglo_record::channels::{CHANNELS, Effects, present};
use agglo_record::layout::layout;
use agglo_record::run::{self, INTERRUPTED};
use agglo_replay::{Frame, Log, Message};

use crate::story::{EVERYTHING, Kind, NOTHING, Told, log};

/// Puts a story together again from its log.
fn retell(bytes: &[u8]) -> Vec<Told> {
    let mut log = Log::new(Cursor::new(bytes)).unwrap();
    let mut story: Vec<Told> = Vec::new();
    for entry in log.messages() {
        let entry = entry.unwrap();
        if story.last().is_none_or(|told| told.step != entry.step) {
            story.push(Told {
                time: entry.t,
                step: entry.step,
                state: Default::default(),
                diagnostics: None,
                impacts: Vec::new(),
                sample: None,
                checkpoint: None,
                notices: Vec::new(),
            });
        }
        let told = story.last_mut().unwrap();
        assert_eq!(entry.t.to_bits(), told.time.to_bits(), "messages of one step carry one time");
        let sample = told.sample.get_or_insert_default();
        match entry.message {
            Message::Static(_) | Message::Scene => {}
            Message::Particles(Frame { t: _, step: _, position, velocity, temperature, cluster }) => {
                told.state.position = position;
                told.state.velocity = velocity;
                told.state.temperature = temperature;
                if let Some(of) = cluster {
                    sample.clusters.get_or_insert_default().of = of;
                }
            }
            Message::Diagnostics(diagnostics) => told.diagnostics = Some(diagnostics),
            Message::Energy(ledger, momentum) => {
                sample.ledger = ledger;
                sample.momentum = momentum;
            }
            Message::Clusters(clusters) => {
                let found = sample.clusters.get_or_insert_default();
                let of = std::mem::take(&mut found.of);
                *found = clusters;
                found.of = of;
            }
            Message::Impacts(impacts) => told.impacts = impacts,
            Message::Checkpoint(checkpoint) => told.checkpoint = Some(*checkpoint),
            Message::Log(notice) => told.notices.push(notice),
        }
    }
    story
}

fn comes_back(kind: &Kind) {
    // Debug prints every bit of a float that matters: the sign of zero, and NaN as equal to itself.
    let mut told = kind.story(12);
    let end = Notice { level: Level::Warning, message: INTERRUPTED.to_owned() };
    told.last_mut().unwrap().notices.push(end);
    let retold = retell(&log(kind, 12));
    assert_eq!(told.len(), retold.len());
    for (told, retold) in told.iter().zip(&retold) {
        let mut told = told.clone();
        if let Some(sample) = &mut told.sample {
            // Plain proto3 fields drop the sign of zero; only checkpoints keep it.
            sample.ledger.totals.periodic_work += 0.0;
            sample.ledger.totals.outside_impulse.iter_mut().for_each(|p| *p += 0.0);
        }
        assert_eq!(format!("{told:?}"), format!("{retold:?}"));
    }
}

#[test]
fn everything_comes_back() {
    comes_back(&EVERYTHING);
}

#[test]
fn nothing_comes_back_as_nothing() {
    comes_back(&NOTHING);
}

#[test]
fn other_compressions_come_back() {
    comes_back(&Kind { record: r#""compression": "lz4""#, ..EVERYTHING });
    comes_back(&Kind { record: r#""compression": "none""#, ..EVERYTHING });
}

#[test]
fn single_precision_rounds_states_and_nothing_else() {
    let kind = Kind { record: r#""precision": "f32""#, ..EVERYTHING };
    let told = kind.story(3);
    for (told, retold) in told.iter().zip(retell(&log(&kind, 3))) {
        for (a, b) in told.state.position.x.iter().zip(&retold.state.position.x) {
            assert_eq!(f64::from(*a as f32).to_bits(), b.to_bits());
        }
        assert_eq!(told.checkpoint, retold.checkpoint);
    }
}

#[test]
fn channels_are_those_of_the_scene() {
    let names = |kind: &Kind| -> Vec<String> {
        let mut log = Log::new(Cursor::new(log(kind, 3))).unwrap();
        log.info().unwrap().channels.into_iter().map(|channel| channel.name).collect()
    };
    let mut all: Vec<&str> = CHANNELS.iter().map(|channel| channel.name).collect();
    all.sort_unstable();
    assert_eq!(names(&EVERYTHING), all);
    assert_eq!(names(&NOTHING), ["/checkpoint", "/diagnostics", "/energy", "/log", "/particles", "/particles/static"]);
    let effects = Effects::of(&NOTHING.scene()).unwrap();
    assert_eq!(present(&effects).count(), 6);
}

#[test]
fn the_run_record_and_the_attachments_say_where_a_log_comes_from() {
    let mut log = Log::new(Cursor::new(log(&EVERYTHING, 1))).unwrap();
    let scene = EVERYTHING.scene();
    assert_eq!(log.scene().unwrap(), scene);
    assert_eq!(log.scene_json().unwrap(), scene.to_json());
    assert_eq!(log.run().scene_hash, run::hash(scene.to_json().as_bytes()));
    assert_eq!(log.run().log_format, (1, 0));
    assert_eq!(log.run().seed, 9_007_199_254_740_991);
    assert_eq!(log.run().particles, 5);
    assert_eq!(log.run().model, "consistent");
    assert_eq!(
        log.run().terms,
        ["binding", "contact", "contact.friction", "thermal", "thermal.radiation", "domain.periodic", "domain.walls"]
    );
    assert_eq!(log.attachment("layout.json").unwrap().unwrap(), layout(&scene).as_bytes());
    assert_eq!(log.particles().unwrap(), EVERYTHING.particles());
}

#[test]
fn the_index_and_a_full_reading_agree() {
    let mut log = Log::new(Cursor::new(log(&EVERYTHING, 40))).unwrap();
    let checked = log.check().unwrap();
    let info = log.info().unwrap();
    assert_eq!(checked.info, info);
    assert_eq!(checked.messages, info.channels.iter().map(|channel| channel.messages).sum::<u64>());
    assert!(info.is_whole());
    assert_eq!((info.steps, info.frames), (40, 41));
    assert_eq!((info.start, info.end), (Some(0.0), Some(0.04)));
}

#[test]
fn states_are_found_by_time() {
    // Many chunks, so that the search must pick the right one.
    let kind = Kind { n: 200, record: r#""compression": "none""#, ..EVERYTHING };
    let story = kind.story(300);
    let mut log = Log::new(Cursor::new(log(&kind, 300))).unwrap();
    assert!(log.info().unwrap().chunks > 3);
    for step in [0, 1, 57, 299, 300] {
        let t = story[step].time;
        assert_eq!(log.frame_at(t).unwrap().step, step as u64);
        assert_eq!(log.frame_at(t + 0.4e-3).unwrap().step, step as u64, "the last state at or before");
        assert_eq!(log.frame_at(t).unwrap().position, story[step].state.position);
    }
    assert_eq!(log.last_frame().unwrap().step, 300);
    assert!(matches!(log.frame_at(-1.0), Err(agglo_replay::LogError::NoState(_))));
}

#[test]
fn a_log_of_another_major_format_names_the_version_that_reads_it() {
    let mut map = agglo_record::run::RunInfo::new(&EVERYTHING.scene(), "", 5, &crate::story::build()).to_map();
    assert!(run::RunInfo::from_map(&map).is_ok());
    map.insert("log_format".to_owned(), "1.7".to_owned());
    map.insert("a key of a later minor version".to_owned(), "is passed over".to_owned());
    assert!(run::RunInfo::from_map(&map).is_ok());
    map.insert("log_format".to_owned(), "2.0".to_owned());
    let refused = |map: &_| match run::RunInfo::from_map(map) {
        Err(run::Unreadable::Version(why)) => why,
        other => panic!("{other:?}"),
    };
    // The version at hand is no help.
    map.insert("agglo_version".to_owned(), env!("CARGO_PKG_VERSION").to_owned());
    assert!(refused(&map).ends_with("read it with a version that reads 2.x"), "{}", refused(&map));
    map.insert("agglo_version".to_owned(), "7.1.0".to_owned());
    assert!(refused(&map).contains("format 2.0") && refused(&map).contains("agglo 7.1.0 or another version"));
}
