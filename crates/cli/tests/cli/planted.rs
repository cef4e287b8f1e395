//! Differences planted into a log, one at a time: verdict, exit code, and where the first difference is.

use std::io::Cursor;

use agglo_record::channels::{CHANNELS, Topic};
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;
use agglo_replay::{Channel, Log, RawMessage};
use prost::Message;

use super::{CLOUD, Folder};

/// What is in a log, apart.
pub struct Parts {
    pub metadata: std::collections::BTreeMap<String, String>,
    pub scene: Vec<u8>,
    /// Attachments beside the scene, by name.
    pub attachments: Vec<(String, Vec<u8>)>,
    pub messages: Vec<RawMessage>,
}

type Writer<'a> = mcap::Writer<&'a mut Cursor<Vec<u8>>>;

impl Parts {
    pub fn of(bytes: &[u8]) -> Self {
        let mut log = Log::new(Cursor::new(bytes)).unwrap();
        Self {
            metadata: log.run().to_map(),
            scene: log.attachment("scene.json").unwrap().unwrap(),
            attachments: log
                .attachment("layout.json")
                .unwrap()
                .into_iter()
                .map(|data| ("layout.json".into(), data))
                .collect(),
            messages: log.raw_messages().map(Result::unwrap).collect(),
        }
    }

    /// The log made of them; chunks are closed by size alone.
    pub fn write(&self) -> Vec<u8> {
        self.write_with(None)
    }

    /// The same, one schema described otherwise.
    fn write_with(&self, other: Option<&str>) -> Vec<u8> {
        let mut new = Cursor::new(Vec::new());
        let mut writer = mcap::WriteOptions::new().create(&mut new).unwrap();
        self.begin(&mut writer);
        if let Some(channel) = CHANNELS.iter().find(|channel| Some(channel.schema) == other) {
            let schema = writer.add_schema(channel.schema, "protobuf", &channel.descriptor[1..]).unwrap();
            writer.add_channel(schema, channel.name, "protobuf", &Default::default()).unwrap();
        }
        self.messages.iter().for_each(|message| Self::add(&mut writer, message));
        writer.finish().unwrap();
        drop(writer);
        new.into_inner()
    }

    /// Writes what stands before the messages.
    pub fn begin(&self, writer: &mut Writer<'_>) {
        let record = mcap::records::Metadata { name: "run".to_owned(), metadata: self.metadata.clone() };
        writer.write_metadata(&record).unwrap();
        let scene = ("scene.json".to_owned(), self.scene.clone());
        for (name, data) in std::iter::once(&scene).chain(&self.attachments) {
            let (name, media_type, data) = (name.clone(), "application/json".to_owned(), data.into());
            writer.attach(&mcap::Attachment { log_time: 0, create_time: 0, name, media_type, data }).unwrap();
        }
    }

    /// Writes a message.
    pub fn add(writer: &mut Writer<'_>, message: &RawMessage) {
        let RawMessage { channel, sequence, log_time, publish_time, data } = message;
        let id = match channel.topic.map(|topic| &CHANNELS[topic as usize]) {
            Some(known) => {
                let schema = writer.add_schema(known.schema, "protobuf", known.descriptor).unwrap();
                writer.add_channel(schema, known.name, "protobuf", &Default::default()).unwrap()
            }
            None => writer.add_channel(0, &channel.name, "json", &Default::default()).unwrap(),
        };
        let header = mcap::records::MessageHeader {
            channel_id: id,
            sequence: *sequence,
            log_time: *log_time,
            publish_time: *publish_time,
        };
        writer.write_to_known_channel(&header, data).unwrap();
    }

    /// Where the message of a channel at a step stands.
    fn place(&self, topic: Topic, step: u64) -> usize {
        let is = |m: &RawMessage| m.channel.topic == Some(topic) && m.key().is_some_and(|(_, of)| of == step);
        self.messages.iter().position(is).unwrap_or_else(|| panic!("no {topic:?} at step {step}"))
    }

    pub fn edit<M: Message + Default>(&mut self, topic: Topic, step: u64, change: impl FnOnce(&mut M)) {
        let place = self.place(topic, step);
        let message = &mut self.messages[place];
        let mut content = M::decode(&message.data[..]).unwrap();
        change(&mut content);
        message.data = content.encode_to_vec();
    }

    /// Changes the eight bytes of a number of a particle: column 0 is x, 3 is vx, 6 is the temperature.
    pub fn number(&mut self, step: u64, particle: usize, column: usize, change: impl FnOnce(f64) -> f64) {
        self.edit(Topic::Particles, step, |cloud: &mut foxglove::PointCloud| {
            let at = particle * cloud.point_stride as usize + 8 * column;
            let bytes: &mut [u8] = &mut cloud.data[at..at + 8];
            let value = f64::from_le_bytes(bytes.try_into().unwrap());
            bytes.copy_from_slice(&change(value).to_le_bytes());
        });
    }

    fn drop_step(&mut self, step: u64) {
        self.messages.retain(|message| message.key().is_none_or(|(_, of)| of != step));
    }

    /// Another text of the scene, with the hash that belongs to it.
    pub fn rewrite_scene(&mut self, from: &str, to: &str) {
        let text = String::from_utf8(self.scene.clone()).unwrap();
        assert!(text.contains(from), "{from} is not in the scene");
        self.scene = text.replacen(from, to, 1).into_bytes();
        self.metadata.insert("scene_hash".to_owned(), format!("sha256:{}", agglo_record::run::hash(&self.scene)));
    }
}

fn up(value: f64) -> f64 {
    f64::from_bits(value.to_bits() + 1)
}

/// What is expected of a comparison: exit code, verdict, and channel, step and particle of the first difference.
struct Expected(i32, &'static str, Option<(&'static str, u64, Option<u64>)>);

type Edit = fn(&mut Parts);

/// A first difference without a particle.
const fn at(channel: &'static str, step: u64) -> Expected {
    Expected(1, "differ", Some((channel, step, None)))
}

const fn of(channel: &'static str, step: u64, particle: u64) -> Expected {
    Expected(1, "differ", Some((channel, step, Some(particle))))
}

const SAME: Expected = Expected(0, "same", None);

/// Name, edit, and what the profile `exact` says.
const PLANTED: [(&str, Edit, Expected); 36] = [
    ("nothing", |_| {}, SAME),
    ("one ulp in x of particle 7", |p| p.number(9, 7, 0, up), of("/particles", 9, 7)),
    ("one ulp in vz of the last particle", |p| p.number(20, 29, 5, up), of("/particles", 20, 29)),
    ("one ulp in a temperature", |p| p.number(3, 0, 6, up), of("/particles", 3, 0)),
    ("NaN for a velocity", |p| p.number(4, 11, 3, |_| f64::NAN), of("/particles", 4, 11)),
    ("infinity for a position", |p| p.number(4, 11, 1, |_| f64::INFINITY), of("/particles", 4, 11)),
    ("the sign of a velocity", |p| p.number(1, 2, 4, |v| -v), of("/particles", 1, 2)),
    (
        "two particles swapped",
        |p| {
            p.edit(Topic::Particles, 6, |cloud: &mut foxglove::PointCloud| {
                let stride = cloud.point_stride as usize;
                let (first, second) = cloud.data.split_at_mut(5 * stride);
                first[3 * stride..4 * stride].swap_with_slice(&mut second[..stride]);
            });
        },
        of("/particles", 6, 3),
    ),
    (
        "a cluster number",
        |p| {
            p.edit(Topic::Particles, 5, |cloud: &mut foxglove::PointCloud| cloud.data[56] ^= 1);
        },
        of("/particles", 5, 0),
    ),
    (
        "a colour",
        |p| {
            p.edit(Topic::Particles, 5, |cloud: &mut foxglove::PointCloud| cloud.data[60] ^= 0x10);
        },
        at("/particles", 5),
    ),
    (
        "one ulp in the time of a state",
        |p| {
            p.edit(Topic::Particles, 8, |cloud: &mut foxglove::PointCloud| cloud.t = up(cloud.t));
        },
        at("/particles", 8),
    ),
    (
        "one ulp in an energy",
        |p| {
            p.edit(Topic::Energy, 10, |ledger: &mut v1::EnergyLedger| ledger.near_field = up(ledger.near_field));
        },
        at("/energy", 10),
    ),
    (
        "a residual next to nothing",
        |p| {
            p.edit(Topic::Energy, 0, |ledger: &mut v1::EnergyLedger| ledger.residual = 1e-300);
        },
        at("/energy", 0),
    ),
    (
        "a cluster more",
        |p| {
            p.edit(Topic::Clusters, 12, |clusters: &mut v1::Clusters| clusters.count += 1);
        },
        at("/clusters", 12),
    ),
    (
        "a step size",
        |p| {
            p.edit(Topic::Diagnostics, 2, |step: &mut v1::StepDiagnostics| step.dt = up(step.dt));
        },
        at("/diagnostics", 2),
    ),
    (
        "an iteration more",
        |p| {
            p.edit(Topic::Diagnostics, 2, |step: &mut v1::StepDiagnostics| {
                step.iterations += 1;
                step.position_errors.push(1e-9);
            });
        },
        at("/diagnostics", 2),
    ),
    (
        "a radius",
        |p| {
            p.edit(Topic::ParticlesStatic, 0, |fixed: &mut v1::ParticleStatic| fixed.radius[4] = up(fixed.radius[4]));
        },
        of("/particles/static", 0, 4),
    ),
    (
        "a mass",
        |p| {
            p.edit(Topic::ParticlesStatic, 0, |fixed: &mut v1::ParticleStatic| fixed.mass[1] *= 2.0);
        },
        of("/particles/static", 0, 1),
    ),
    (
        "a checkpoint's next step",
        |p| {
            p.edit(Topic::Checkpoint, 0, |checkpoint: &mut v1::Checkpoint| checkpoint.next_dt *= 2.0);
        },
        at("/checkpoint", 0),
    ),
    (
        "a warning's text",
        |p| {
            p.edit(Topic::Log, 0, |log: &mut foxglove::Log| log.message.push('!'));
        },
        at("/log", 0),
    ),
    (
        "an extra impact",
        |p| {
            let place = p.messages.iter().position(|m| m.channel.topic == Some(Topic::Impacts)).unwrap();
            let mut impacts = v1::Impacts::decode(&p.messages[place].data[..]).unwrap();
            impacts.events.push(impacts.events[0]);
            p.messages[place].data = impacts.encode_to_vec();
        },
        Expected(1, "differ", None),
    ),
    (
        "an impact's heat",
        |p| {
            let place = p.messages.iter().position(|m| m.channel.topic == Some(Topic::Impacts)).unwrap();
            let mut impacts = v1::Impacts::decode(&p.messages[place].data[..]).unwrap();
            impacts.events[0].heat = up(impacts.events[0].heat);
            p.messages[place].data = impacts.encode_to_vec();
        },
        Expected(1, "differ", None),
    ),
    ("a missing step", |p| p.drop_step(15), at("/diagnostics", 15)),
    ("missing last steps", |p| (36..=40).for_each(|step| p.drop_step(step)), at("/diagnostics", 36)),
    (
        "a missing state",
        |p| {
            let place = p.place(Topic::Particles, 7);
            p.messages.remove(place);
        },
        at("/particles", 7),
    ),
    (
        "a message twice",
        |p| {
            let place = p.place(Topic::Energy, 7);
            p.messages.insert(place, p.messages[place].clone());
        },
        at("/energy", 7),
    ),
    (
        "messages of a step in another order",
        |p| {
            let (first, second) = (p.place(Topic::Diagnostics, 7), p.place(Topic::Particles, 7));
            p.messages.swap(first, second);
        },
        at("/diagnostics", 7),
    ),
    (
        "a step behind the next one",
        |p| {
            let (from, to) = (p.place(Topic::Diagnostics, 20), p.place(Topic::Diagnostics, 21));
            let end = p.place(Topic::Diagnostics, 22);
            p.messages[from..end].rotate_left(to - from);
        },
        at("/diagnostics", 20),
    ),
    (
        "a log time",
        |p| {
            let place = p.place(Topic::Energy, 30);
            p.messages[place].log_time += 1;
        },
        at("/energy", 30),
    ),
    (
        "a publish time",
        |p| {
            let place = p.place(Topic::Energy, 30);
            p.messages[place].publish_time += 1;
        },
        at("/energy", 30),
    ),
    (
        "a sphere drawn elsewhere",
        |p| {
            p.edit(Topic::Scene, 0, |scene: &mut foxglove::SceneUpdate| {
                scene.entities[0].spheres[3].color.as_mut().unwrap().r += 0.25;
            });
        },
        at("/scene", 0),
    ),
    ("another layout", |p| p.attachments[0].1.push(b' '), at("layout.json", 0)),
    ("no layout", |p| p.attachments.clear(), at("layout.json", 0)),
    ("an attachment more", |p| p.attachments.push(("notes.txt".into(), b"mine".to_vec())), at("notes.txt", 0)),
    (
        "terms in the metadata",
        |p| {
            p.metadata.insert("terms".into(), "contact".into());
        },
        at("run", 0),
    ),
    (
        "a value of the scene",
        |p| p.rewrite_scene("\"heat_capacity\": 1000", "\"heat_capacity\": 1001"),
        at("scene.json", 0),
    ),
];

fn base() -> (Folder, Vec<u8>) {
    let scene = CLOUD.replace("\"count\": 100", "\"count\": 30").replace("\"duration\": 0.1", "\"duration\": 0.04");
    let folder = Folder::with(&scene.replace("\"radius_ratio\": 0.25", "\"radius_ratio\": 0.4"));
    folder.agglo(&["run", "scene.json", "-o", "b.mcap"]).code(0);
    let bytes = folder.read("b.mcap");
    (folder, bytes)
}

#[test]
fn every_planted_difference_is_found_where_it_is() {
    let (folder, bytes) = base();
    for (name, edit, Expected(code, verdict, first)) in PLANTED {
        let mut parts = Parts::of(&bytes);
        edit(&mut parts);
        folder.write("a.mcap", parts.write());
        let ran = folder.agglo(&["diff", "a.mcap", "b.mcap", "--json", "-"]);
        assert_eq!(ran.code, Some(code), "{name}: {} {}", ran.text(), ran.stderr);
        let report = ran.json();
        assert_eq!(report["verdict"], verdict, "{name}");
        let found = &report["first_difference"];
        match first {
            Some((channel, step, particle)) => {
                assert_eq!((&found["channel"], &found["step"]), (&channel.into(), &step.into()), "{name}: {found}");
                assert_eq!(found["particle"].as_u64(), particle, "{name}: {found}");
            }
            None => assert_eq!(found.is_null(), code == 0, "{name}: {found}"),
        }
        // In the other direction as well: what is missing here is too much there.
        let other = folder.agglo(&["diff", "b.mcap", "a.mcap"]);
        assert_eq!(other.code, Some(code), "{name}, the other way round: {}", other.text());
    }
}

#[test]
fn damage_and_unknown_channels_are_no_differences_of_data() {
    let (folder, bytes) = base();
    // Cut off before its index: all data are there.
    folder.write("cut.mcap", &bytes[..bytes.len() - 60]);
    folder.agglo(&["diff", "cut.mcap", "b.mcap"]).code(3).says(&["is damaged"]);
    folder.agglo(&["diff", "b.mcap", "cut.mcap"]).code(3);
    // A damaged log that also differs differs.
    let mut parts = Parts::of(&bytes);
    parts.number(2, 2, 2, up);
    let other = parts.write();
    folder.write("both.mcap", &other[..other.len() - 60]);
    folder.agglo(&["diff", "both.mcap", "b.mcap"]).code(1);
    // Another schema for the same bytes.
    let other = Parts::of(&bytes).write_with(Some("agglo.v1.Clusters"));
    folder.write("schema.mcap", other);
    let ran = folder.agglo(&["diff", "schema.mcap", "b.mcap"]).code(1);
    assert!(ran.text().contains("/clusters: the channel has another schema or encoding"), "{}", ran.text());
    // Nothing whole to compare.
    folder.write("start.mcap", &bytes[..bytes.len() / 50]);
    folder.agglo(&["diff", "start.mcap", "b.mcap"]).code(2);
    // A later version may have channels that this one does not know: compared as bytes, missing is different.
    let mut parts = Parts::of(&bytes);
    let later = RawMessage { channel: Channel::named("/later"), data: b"{}".to_vec(), ..parts.messages[10].clone() };
    parts.messages.insert(11, later.clone());
    folder.write("later.mcap", parts.write());
    folder.agglo(&["diff", "later.mcap", "b.mcap"]).code(1);
    folder.agglo(&["diff", "later.mcap", "later.mcap"]).code(0);
    folder.agglo(&["diff", "later.mcap", "b.mcap", "--ignore", "/later"]).code(0);
    parts.messages[11].data = b"[]".to_vec();
    folder.write("changed.mcap", parts.write());
    folder.agglo(&["diff", "changed.mcap", "later.mcap"]).code(1);
}

#[test]
fn what_only_bits_tell_apart_is_the_same_within_tolerances() {
    let (folder, bytes) = base();
    folder.write("t.json", r#"{"format":1,"default":{"abs":1e-9,"rel":1e-9}}"#);
    let judge = |edit: Edit, code: i32| {
        let mut parts = Parts::of(&bytes);
        edit(&mut parts);
        folder.write("a.mcap", parts.write());
        folder.agglo(&["diff", "a.mcap", "b.mcap", "--tolerance", "t.json"]).code(code);
    };
    judge(|p| p.number(9, 7, 0, up), 0);
    judge(|p| p.number(9, 7, 0, |x| x + 1e-6), 1);
    judge(|p| p.number(9, 7, 0, |_| f64::NAN), 1);
    judge(|p| p.drop_step(15), 1);
    judge(|p| p.edit(Topic::Clusters, 12, |clusters: &mut v1::Clusters| clusters.count += 1), 1);
    // Order and log time are compared in every profile.
    judge(
        |p| {
            let (first, second) = (p.place(Topic::Diagnostics, 7), p.place(Topic::Particles, 7));
            p.messages.swap(first, second);
        },
        1,
    );
    judge(
        |p| {
            let place = p.place(Topic::Energy, 30);
            p.messages[place].log_time += 1;
        },
        1,
    );
    // What is drawn from the states is not compared, and named.
    let mut parts = Parts::of(&bytes);
    parts.edit(Topic::Particles, 5, |cloud: &mut foxglove::PointCloud| cloud.data[60] ^= 0x10);
    folder.write("a.mcap", parts.write());
    let arguments = ["diff", "a.mcap", "b.mcap", "--tolerance", "t.json"];
    let ran = folder.agglo(&arguments).code(0);
    assert!(
        ran.text().contains("not compared, for they are drawn from the states: /scene, /particles.red"),
        "{}",
        ran.text()
    );
    let ran = folder.agglo(&[&arguments[..], &["--json", "-"]].concat()).code(0).json();
    assert_eq!(
        (&ran["drawn_not_compared"][0], &ran["drawn_not_compared"][4]),
        (&"/scene".into(), &"/particles.alpha".into())
    );
    // A setting that changes nothing in the data is listed, and is no difference.
    judge(|p| p.rewrite_scene("\"name\": \"cloud\"", "\"name\": \"fog\""), 0);
}
