//! A run solved again from any of its checkpoints is its log, bit for bit; what is not is found and named.

use std::io::Cursor;

use agglo_core::Simulation;
use agglo_record::channels::{CHANNELS, Topic};
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;
use agglo_record::{BuildInfo, Options, Recorder};
use agglo_replay::verify::{Verification, What};
use agglo_replay::{Log, Message, RawMessage};
use agglo_tests::{scene, shipped_scenes, with};
use prost::Message as _;
use serde_json::{Value, json};

/// The log of a scene.
pub fn record(value: &Value) -> Vec<u8> {
    let scene = scene(value);
    let build = BuildInfo { version: "0.0.0".to_owned(), commit: "test".to_owned() };
    let mut bytes = Vec::new();
    let mut recorder = Recorder::create(&mut bytes, &scene, &build, Options::default()).unwrap();
    Simulation::new(&scene).unwrap().run(&mut recorder).unwrap();
    recorder.finish().unwrap();
    bytes
}

/// The same log with other messages: `edit` gives what stands in the place of each.
pub fn rewrite(bytes: &[u8], mut edit: impl FnMut(RawMessage) -> Vec<RawMessage>) -> Vec<u8> {
    let mut log = Log::new(Cursor::new(bytes)).unwrap();
    let (metadata, scene) = (log.run().to_map(), log.attachment("scene.json").unwrap().unwrap());
    let mut new = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().create(&mut new).unwrap();
    writer.write_metadata(&mcap::records::Metadata { name: "run".to_owned(), metadata }).unwrap();
    let (name, media_type) = ("scene.json".to_owned(), "application/json".to_owned());
    writer.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data: scene.into() }).unwrap();
    let ids = CHANNELS.each_ref().map(|channel| {
        let schema = writer.add_schema(channel.schema, "protobuf", channel.descriptor).unwrap();
        writer.add_channel(schema, channel.name, "protobuf", &Default::default()).unwrap()
    });
    for message in log.raw_messages() {
        for RawMessage { channel, sequence, log_time, publish_time, data } in edit(message.unwrap()) {
            let channel_id = ids[channel.topic.unwrap() as usize];
            let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time };
            writer.write_to_known_channel(&header, &data).unwrap();
        }
    }
    writer.finish().unwrap();
    drop(writer);
    new.into_inner()
}

fn verify(bytes: &[u8], from: f64) -> Verification {
    Log::new(Cursor::new(bytes)).unwrap().verify(from, |_| true).unwrap()
}

#[track_caller]
fn same(name: &str, done: &Verification) {
    assert!(done.mismatch.is_none(), "{name} from step {}: {:?}", done.from.0, done.mismatch);
    assert!(done.damage.is_empty());
}

/// A scene of few particles in which everything happens within some steps.
fn busy() -> Value {
    let cloud = agglo_tests::shipped("clustering");
    with(&cloud, &[("/particles/random_cube/count", json!(12)), ("/duration", json!(0.6))])
}

#[test]
fn every_shipped_scene_from_every_checkpoint() {
    for (name, value) in shipped_scenes() {
        // As many steps as a scene takes are not needed: some tens, with checkpoints often among them.
        let step = scene(&value).solver.step.limits().0;
        let duration = value["duration"].as_f64().unwrap().min(60.0 * step);
        let value = with(&value, &[("/duration", json!(duration)), ("/record/checkpoint_every", json!(9))]);
        let bytes = record(&value);
        let mut log = Log::new(Cursor::new(&bytes)).unwrap();
        let checkpoints: Vec<(u64, f64)> = log
            .messages()
            .only(&[Topic::Checkpoint])
            .map(|entry| entry.unwrap())
            .map(|entry| (entry.step, entry.t))
            .collect();
        assert!(checkpoints.len() > 2, "{name}: {checkpoints:?}");
        for (k, &(step, t)) in checkpoints.iter().enumerate() {
            let done = verify(&bytes, t);
            same(&name, &done);
            // Behind one at the very end nothing is left to compare: the one before it serves.
            let from = if t == duration { checkpoints[k - 1].0 } else { step };
            assert_eq!((done.from.0, done.to.1), (from, duration), "{name}");
            assert!(done.messages > 0, "{name} from step {step}");
        }
    }
}

#[test]
fn single_precision_intervals_and_drawings_come_out_the_same() {
    let value = with(
        &busy(),
        &[("/record", json!({ "precision": "f32", "interval": 0.004, "markers": 60, "checkpoint_every": 7 }))],
    );
    // By speed, whose colours refer to the fastest so far; neither clusters nor temperatures.
    let mut speed = value.clone();
    for section in ["thermal", "binding"] {
        speed.as_object_mut().unwrap().remove(section);
    }
    speed["contact"] = json!({ "restitution": 0.5, "friction": { "static": 0.2, "dynamic": 0.1 } });
    for value in [value, speed] {
        let bytes = record(&value);
        for t in [0.0, 0.1, 0.2, 0.45] {
            same("f32", &verify(&bytes, t));
        }
    }
}

/// A message with its content changed.
pub fn changed<M: prost::Message + Default>(message: &RawMessage, change: impl FnOnce(&mut M)) -> RawMessage {
    let mut content = M::decode(&message.data[..]).unwrap();
    change(&mut content);
    RawMessage { data: content.encode_to_vec(), ..message.clone() }
}

#[test]
fn what_differs_is_found_and_named() {
    let bytes = record(&busy());
    let whole = rewrite(&bytes, |message| vec![message]);
    same("rewritten", &verify(&whole, 0.0));

    let at = |message: &RawMessage, topic, step| {
        message.channel.topic == Some(topic) && message.key().is_some_and(|(_, of)| of == step)
    };
    let edited = |topic, step, edit: &dyn Fn(&RawMessage) -> Vec<RawMessage>| {
        let mut done = false;
        let bytes = rewrite(&bytes, |message| {
            if at(&message, topic, step) {
                done = true;
                edit(&message)
            } else {
                vec![message]
            }
        });
        assert!(done, "there is no message to edit");
        let mismatch = verify(&bytes, 0.0).mismatch.expect("the difference is found");
        (mismatch.step, mismatch.channel, mismatch.what)
    };

    // One unit in the last place of the seventh particle's y.
    let (step, channel, what) = edited(Topic::Particles, 20, &|message| {
        vec![changed(message, |cloud: &mut foxglove::PointCloud| cloud.data[7 * cloud.point_stride as usize + 8] ^= 1)]
    });
    assert_eq!((step, channel.as_str()), (20, "/particles"));
    let What::Value(difference) = what else { panic!("{what:?}") };
    assert_eq!((difference.field.as_str(), difference.index, difference.ulp), ("/particles.y", Some(7), Some(1)));

    let (step, channel, what) = edited(Topic::Energy, 3, &|message| {
        vec![changed(message, |ledger: &mut v1::EnergyLedger| ledger.kinetic += 1.0)]
    });
    assert_eq!((step, channel.as_str()), (3, "/energy"));
    assert!(matches!(what, What::Value(difference) if difference.field == "/energy.kinetic"));

    let missing = edited(Topic::Diagnostics, 5, &|_| Vec::new());
    assert!(matches!(missing, (5, ref channel, What::OnlySolved) if channel == "/diagnostics"), "{missing:?}");
    let twice = edited(Topic::Clusters, 5, &|message| vec![message.clone(), message.clone()]);
    assert!(matches!(twice, (5, ref channel, What::OnlyRecorded) if channel == "/clusters"), "{twice:?}");
    let later =
        edited(Topic::Energy, 9, &|message| vec![RawMessage { log_time: message.log_time + 1, ..message.clone() }]);
    assert!(matches!(later, (9, ref channel, What::Bytes) if channel == "/energy"), "{later:?}");
}

#[test]
fn a_note_at_the_end_is_not_of_the_solver_but_one_within_is() {
    let bytes = record(&busy());
    let mut log = Log::new(Cursor::new(&bytes)).unwrap();
    let topics: Vec<Option<Topic>> = log.raw_messages().map(|message| message.unwrap().channel.topic).collect();
    let messages = topics.len();
    let note = |place: usize| {
        let mut count = 0;
        rewrite(&bytes, |message| {
            count += 1;
            let (here, step) = (count == place, message.key().unwrap().1);
            let t = message.key().unwrap().0;
            let log = foxglove::Log { t, step, message: "a note".to_owned(), ..foxglove::Log::default() };
            let mut channel = message.channel.clone();
            channel.topic = Some(Topic::Log);
            channel.name = "/log".into();
            let extra = RawMessage { channel, data: log.encode_to_vec(), ..message.clone() };
            if here { vec![message, extra] } else { vec![message] }
        })
    };
    same("a note at the end", &verify(&note(messages), 0.0));
    // Behind the last message of a step in the middle.
    let next = |k: &usize| topics[*k] == Some(Topic::Diagnostics);
    let middle = (messages / 2..messages).find(next).unwrap();
    let mismatch = verify(&note(middle), 0.0).mismatch.expect("found");
    assert_eq!(mismatch.channel, "/log");
    assert!(matches!(mismatch.what, What::OnlyRecorded), "{:?}", mismatch.what);
}

/// Where a chunk begins: records are an opcode, a length, and that many bytes.
fn chunk(bytes: &[u8], number: usize) -> usize {
    let (mut at, mut seen) = (8, 0);
    loop {
        if bytes[at] == mcap::records::op::CHUNK {
            if seen == number {
                return at;
            }
            seen += 1;
        }
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
}

#[test]
fn what_is_lost_is_not_compared_and_the_rest_is() {
    // A chunk is closed after 1000 steps, so this log has some.
    let value = json!({
        "duration": 3.5, "solver": { "step": { "fixed": 1e-3 } },
        "particles": { "list": [{ "position": [0, 0, 0], "velocity": [1, 0, 0], "radius": 0.1, "mass": 1 }] },
        "external": { "gravity": [0, 0, -9.81] }
    });
    let bytes = record(&value);
    let whole = verify(&bytes, 0.0);
    same("whole", &whole);
    let mut damaged = bytes.clone();
    let middle = chunk(&bytes, 2) + 1000;
    damaged[middle] ^= 1;
    let done = verify(&damaged, 0.0);
    assert!(done.mismatch.is_none(), "{:?}", done.mismatch);
    let lost = |damage: &[agglo_replay::Damage]| damage.iter().filter(|found| found.what.contains("is lost")).count();
    assert_eq!(lost(&done.damage), 1, "{:?}", done.damage);
    assert!(done.steps >= 2000 && done.steps < whole.steps, "{} of {}", done.steps, whole.steps);
    assert_eq!(done.to, whole.to, "what follows the lost part is compared");
    // Cut off: compared up to there.
    let done = verify(&bytes[..middle], 0.0);
    assert!(done.mismatch.is_none() && !done.damage.is_empty());
    assert!(done.steps > 1000 && done.to.1 < 3.0, "{:?}", done.to);
    // A particle moved just behind the lost part is still found.
    let mut seen = 0;
    let moved = rewrite(&bytes, |message| {
        seen += usize::from(message.channel.topic == Some(Topic::Particles));
        let edit = seen == 3200 && message.channel.topic == Some(Topic::Particles);
        vec![if edit { changed(&message, |cloud: &mut foxglove::PointCloud| cloud.data[0] ^= 1) } else { message }]
    });
    assert_eq!(verify(&moved, 0.0).mismatch.expect("found").step, 3199);
}

#[test]
fn steps_gather_their_messages() {
    let bytes = record(&busy());
    let mut log = Log::new(Cursor::new(&bytes)).unwrap();
    let mut counts = [0_u64; 3];
    for entry in log.messages() {
        match entry.unwrap().message {
            Message::Diagnostics(_) => counts[0] += 1,
            Message::Impacts(impacts) => counts[1] += impacts.len() as u64,
            Message::Particles(_) => counts[2] += 1,
            _ => {}
        }
    }
    let mut gathered = [0_u64; 3];
    for (number, step) in log.steps().enumerate() {
        let step = step.unwrap();
        assert_eq!(step.step, number as u64);
        gathered[0] += u64::from(step.diagnostics.is_some());
        gathered[1] += step.impacts.len() as u64;
        gathered[2] += u64::from(step.frame.is_some() && step.ledger.is_some() && step.clusters.is_some());
    }
    assert!(counts[1] > 0 && counts == gathered, "{counts:?} {gathered:?}");
}
