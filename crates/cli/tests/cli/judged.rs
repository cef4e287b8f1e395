//! Logs whose checksums hold and whose messages are not those of a run: every command says so, and none passes them on.

use agglo_record::channels::Topic;
use agglo_record::proto::agglo::v1;
use agglo_record::proto::foxglove;
use prost::Message;

use super::planted::Parts;
use super::{CLOUD, Folder};

/// A folder with whole.mcap, a run of 40 steps, and what is in it.
fn base() -> (Folder, Parts) {
    let scene =
        CLOUD.replace("\"count\": 100", "\"count\": 30").replace("\"radius_ratio\": 0.25", "\"radius_ratio\": 0.4");
    let record = "\"record\": { \"checkpoint_every\": 10, \"markers\": 0 }, \"duration\": 0.04";
    let folder = Folder::with(&scene.replace("\"duration\": 0.1", record));
    folder.agglo(&["run", "scene.json", "-o", "whole.mcap"]).code(0);
    let parts = Parts::of(&folder.read("whole.mcap"));
    (folder, parts)
}

fn of(topic: Topic) -> impl Fn(&agglo_replay::RawMessage) -> bool {
    move |message| message.channel.topic == Some(topic)
}

/// Takes all messages of a channel away.
fn without(parts: &mut Parts, topic: Topic) {
    parts.messages.retain(|message| message.channel.topic != Some(topic));
}

/// Place of the k-th message of a channel.
fn nth(parts: &Parts, topic: Topic, k: usize) -> usize {
    let places = parts.messages.iter().enumerate().filter(|(_, message)| of(topic)(message));
    places.map(|(place, _)| place).nth(k).expect("there is one")
}

/// The content of the k-th message of a channel.
fn data(parts: &mut Parts, topic: Topic, k: usize) -> &mut Vec<u8> {
    let place = nth(parts, topic, k);
    &mut parts.messages[place].data
}

/// A log without the k-th message of a channel.
fn lose(parts: &mut Parts, topic: Topic, k: usize) {
    let place = nth(parts, topic, k);
    parts.messages.remove(place);
}

fn impacts(parts: &mut Parts, change: impl FnOnce(&mut v1::Impacts)) {
    let data = data(parts, Topic::Impacts, 0);
    let mut content = v1::Impacts::decode(&data[..]).unwrap();
    change(&mut content);
    *data = content.encode_to_vec();
}

/// What is wrong, how it is made, and what `info --check` says; whether a run can go on, `export --at all` has something
/// to write, and `analyze` comes to numbers that contradict each other.
struct Case(&'static str, fn(&mut Parts), &'static str, Uses);

#[derive(Clone, Copy, PartialEq)]
enum Uses {
    /// Part of it is used by all.
    All,
    /// Nothing can go on from it.
    NotResume,
    /// Nor can it be exported or analysed.
    NotEven,
}

const CASES: [Case; 19] = [
    Case(
        "garbage for a state",
        |p| *data(p, Topic::Particles, 15) = b"\xff\x01garbage".to_vec(),
        "makes no sense",
        Uses::All,
    ),
    Case("an empty ledger", |p| data(p, Topic::Energy, 15).clear(), "/energy", Uses::All),
    Case(
        "a state of fewer rows",
        |p| {
            p.edit(Topic::Particles, 15, |cloud: &mut foxglove::PointCloud| {
                let stride = cloud.point_stride as usize;
                cloud.data.truncate(7 * stride);
            })
        },
        "has 7 rows, and the scene 30 particles",
        Uses::All,
    ),
    Case(
        "no radii",
        |p| without(p, Topic::ParticlesStatic),
        "step 0 at t = 0 s has no message on /particles/static",
        Uses::NotEven,
    ),
    Case(
        "no states",
        |p| without(p, Topic::Particles),
        "41 steps from 0 (t = 0 s) to 40 have no message on /particles",
        Uses::NotEven,
    ),
    Case("no ledgers", |p| without(p, Topic::Energy), "to 40 have no message on /energy", Uses::NotResume),
    Case("no cluster counts", |p| without(p, Topic::Clusters), "to 40 have no message on /clusters", Uses::NotResume),
    Case(
        "no checkpoints",
        |p| without(p, Topic::Checkpoint),
        "5 steps from 0 (t = 0 s) to 40 have no message on /checkpoint",
        Uses::NotResume,
    ),
    Case("no diagnostics", |p| without(p, Topic::Diagnostics), "have no message on /diagnostics", Uses::All),
    Case("a state missing", |p| lose(p, Topic::Particles, 15), "step 15 at t = 0.015", Uses::All),
    Case("a step missing", |p| p.messages.retain(|m| m.key().unwrap().1 != 15), "step 15 is not in the log", Uses::All),
    Case(
        "the last step missing",
        |p| p.messages.retain(|m| m.key().unwrap().1 != 40),
        "the log ends with step 39",
        Uses::All,
    ),
    Case("impacts missing", |p| lose(p, Topic::Impacts, 0), "impacts, and the log has", Uses::All),
    Case(
        "impacts twice",
        |p| {
            let k = nth(p, Topic::Impacts, 0);
            p.messages.insert(k, p.messages[k].clone());
        },
        "has two messages on /impacts",
        Uses::All,
    ),
    Case(
        "an impact of a particle that is not there",
        |p| impacts(p, |impacts| impacts.events[0].i = 30),
        "is of particle 30, and the scene has 30",
        Uses::All,
    ),
    Case(
        "states swapped",
        |p| {
            let (a, b) = (nth(p, Topic::Particles, 15), nth(p, Topic::Particles, 16));
            let data = std::mem::take(&mut p.messages[a].data);
            p.messages[a].data = std::mem::replace(&mut p.messages[b].data, data);
        },
        "step 15 follows step 16",
        Uses::All,
    ),
    Case(
        "another n in the metadata",
        |p| drop(p.metadata.insert("n".into(), "31".into())),
        "says that n is 31",
        Uses::All,
    ),
    Case(
        "another seed in the metadata",
        |p| drop(p.metadata.insert("seed".into(), "4".into())),
        "says that seed is 4",
        Uses::All,
    ),
    Case(
        "other terms in the metadata",
        |p| drop(p.metadata.insert("terms".into(), "contact".into())),
        "says that terms is contact",
        Uses::All,
    ),
];

#[test]
fn what_is_no_log_of_a_run_is_said_by_every_command_and_never_passed_on() {
    let (folder, whole) = base();
    let uncut = folder.read("whole.mcap");
    folder.write("m.mcap", whole.write());
    for command in [&["info", "m.mcap", "--check"][..], &["analyze", "m.mcap"], &["replay", "m.mcap", "--verify"]] {
        folder.agglo(command).code(0);
    }
    for Case(name, edit, says, uses) in CASES {
        let mut parts = Parts::of(&uncut);
        edit(&mut parts);
        folder.write("m.mcap", parts.write());
        let ran = folder.agglo(&["info", "m.mcap", "--check"]);
        assert!(ran.code == Some(3) && ran.stderr.contains(says), "{name}: info: {:?} {}", ran.code, ran.stderr);
        let ran = folder.agglo(&["recover", "m.mcap", "-o", "recovered.mcap", "--overwrite"]);
        assert_eq!(ran.code, Some(3), "{name}: recover: {}", ran.stderr);
        let ran = folder.agglo(&["run", "--resume", "m.mcap", "-o", "resumed.mcap", "--overwrite"]);
        if uses == Uses::All {
            assert!(ran.code == Some(3) && ran.stderr.contains("is used up to step"), "{name}: resume: {}", ran.stderr);
            assert!(folder.read("resumed.mcap") == uncut, "{name}: another run");
        } else {
            assert!(
                ran.code == Some(2) && ran.stderr.contains("no whole checkpoint"),
                "{name}: resume: {}",
                ran.stderr
            );
        }
        let ran = folder.agglo(&["export", "m.mcap", "--format", "csv", "--at", "all", "-o", "-"]);
        assert_eq!(ran.code, Some(if uses == Uses::NotEven { 2 } else { 3 }), "{name}: export: {}", ran.stderr);
        let ran = folder.agglo(&["analyze", "m.mcap"]);
        // Of checkpoints an analysis has no need; impacts that are missing contradict the ledger, and radii can be had again.
        let wanted: &[i32] = match (name, uses) {
            ("no checkpoints", _) => &[0],
            ("impacts missing", _) => &[1],
            ("no radii", _) => &[3],
            (_, Uses::NotEven) => &[2],
            _ => &[3],
        };
        assert!(ran.code.is_some_and(|code| wanted.contains(&code)), "{name}: analyze: {:?} {}", ran.code, ran.stderr);
    }
}

#[test]
fn a_log_that_ends_early_is_verified_up_to_there_and_not_called_complete() {
    let (folder, mut parts) = base();
    parts.messages.retain(|message| message.key().unwrap().1 <= 25);
    folder.write("short.mcap", parts.write());
    let ran = folder.agglo(&["replay", "short.mcap", "--verify"]).code(3).says(&["the log ends with step 25"]);
    assert!(ran.text().contains("up to t = 0.025 s of 0.04 s"), "{}", ran.text());
    // One that says why it ends there is whole.
    let log = foxglove::Log { message: "the run was interrupted".to_owned(), t: 0.025, step: 25, ..Default::default() };
    let last = parts.messages.last().unwrap().clone();
    let channel = agglo_replay::Channel::named("/log");
    parts.messages.push(agglo_replay::RawMessage { channel, data: log.encode_to_vec(), ..last });
    folder.write("noted.mcap", parts.write());
    folder.agglo(&["replay", "noted.mcap", "--verify"]).code(0);
    folder.agglo(&["info", "noted.mcap", "--check"]).code(0);
    folder.agglo(&["analyze", "noted.mcap"]).code(0);
    folder.agglo(&["run", "--resume", "noted.mcap", "-o", "resumed.mcap"]).code(0);
    assert!(folder.read("resumed.mcap") == folder.read("whole.mcap"));
}

#[cfg(unix)]
#[test]
fn an_interrupted_verification_has_no_verdict() {
    let folder =
        Folder::with(&CLOUD.replace("\"duration\": 0.1", "\"duration\": 4, \"record\": { \"every_steps\": 100 }"));
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    // It may not listen yet, or be done already: some of these come in between.
    let mut interrupted = 0;
    for delay in [40, 80, 120, 160] {
        let mut command = folder.command(&["replay", "scene.mcap", "--verify"]);
        let child = command.stdout(std::process::Stdio::piped()).spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(delay));
        _ = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        assert_ne!(output.status.code(), Some(1), "{text}");
        if output.status.code() == Some(130) {
            assert!(text.starts_with("interrupted: scene.mcap, solved again from step 0"), "{text}");
            interrupted += 1;
        }
    }
    assert!(interrupted > 0, "no signal came in between");
}

#[test]
fn statistics_judge_nothing_by_what_is_lost() {
    let (folder, _) = base();
    let whole = folder.read("whole.mcap");
    let judge = |a: &str, b: &str, code: i32| folder.agglo(&["diff", a, b, "--profile", "statistics"]).code(code);
    judge("whole.mcap", "whole.mcap", 0);
    // Lost between 0.002 s and 0.008 s: the blocks up to 0.005 s and 0.01 s say nothing, and all others are the same.
    let mut gap = Parts::of(&whole);
    gap.messages.retain(|message| !(3..=7).contains(&message.key().unwrap().1));
    folder.write("gap.mcap", gap.write());
    let ran = judge("gap.mcap", "whole.mcap", 3);
    assert!(ran.text().starts_with("same: ") && ran.text().contains("not compared: curves.kinetic"), "{}", ran.text());
    judge("whole.mcap", "gap.mcap", 2).says(&["a part of the second log is lost between"]);
    // Something that differs elsewhere still differs, and a curve has no step.
    let mut hot = Parts::of(&gap.write());
    for step in 20..=40 {
        hot.edit(Topic::Energy, step, |ledger: &mut v1::EnergyLedger| ledger.kinetic *= 2.0);
    }
    folder.write("hot.mcap", hot.write());
    let ran = judge("hot.mcap", "whole.mcap", 1);
    assert!(ran.text().contains("first difference at t = 0.02 s, curves.kinetic"), "{}", ran.text());
    let ran =
        folder.agglo(&["diff", "hot.mcap", "whole.mcap", "--profile", "statistics", "--json", "-"]).code(1).json();
    assert!(ran["first_difference"]["step"].is_null(), "{}", ran["first_difference"]);
    // States that are not there, or make no sense, are not passed over.
    let mut none = Parts::of(&whole);
    without(&mut none, Topic::Particles);
    folder.write("none.mcap", none.write());
    judge("none.mcap", "whole.mcap", 2).says(&["so much is lost that no curve is whole"]);
    let mut garbage = Parts::of(&whole);
    let place = nth(&garbage, Topic::Particles, 30);
    garbage.messages[place].data.truncate(100);
    folder.write("garbage.mcap", garbage.write());
    judge("garbage.mcap", "whole.mcap", 3);
    // A reference that was cut off decides nothing.
    folder.write("cut.mcap", &whole[..whole.len() / 2]);
    judge("whole.mcap", "cut.mcap", 2);
    let mut short = Parts::of(&whole);
    short.messages.retain(|message| message.key().unwrap().1 <= 30);
    folder.write("short.mcap", short.write());
    judge("whole.mcap", "short.mcap", 2).says(&["the end of the second log is lost from t = 0.03 s on"]);
}

#[test]
fn any_significance_between_0_and_1_is_judged() {
    let (folder, _) = base();
    let mut names = Vec::new();
    for seed in 1..=5 {
        let (name, set) = (format!("{seed}.mcap"), format!("seed={seed}"));
        folder.agglo(&["run", "scene.json", "--set", &set, "-o", &name]).code(0);
        names.push(name);
    }
    for significance in ["1e-300", "5e-324", "1e-17", "0.5", "0.9999999999999999"] {
        let mut arguments = vec!["diff", "whole.mcap", "1.mcap", "--significance", significance, "--ensemble"];
        arguments.extend(names.iter().map(String::as_str));
        let ran = folder.agglo(&arguments);
        assert!(matches!(ran.code, Some(0 | 1)), "{significance}: {:?} {}", ran.code, ran.stderr);
    }
}

#[test]
fn what_a_log_says_cannot_make_a_terminal_do_things() {
    let (folder, mut parts) = base();
    let hostile = "a\u{1b}[31mb\u{202e}c\u{9b}\nd";
    parts.metadata.insert("scene_name".into(), hostile.into());
    parts.metadata.insert("agglo_commit".into(), hostile.into());
    parts.metadata.insert("terms".into(), hostile.into());
    parts.edit(Topic::Log, 0, |log: &mut foxglove::Log| log.message = hostile.into());
    folder.write("m.mcap", parts.write());
    let commands = [
        &["info", "m.mcap"][..],
        &["analyze", "m.mcap"],
        &["replay", "m.mcap"],
        &["replay", "m.mcap", "--verify"],
        &["diff", "m.mcap", "whole.mcap", "--annotations"],
        &["analyze", "m.mcap", "--report", "-"],
        &["analyze", "m.mcap", "--plot", "-"],
    ];
    let raw = |c: char| matches!(c, '\u{1b}' | '\u{202e}' | '\u{9b}');
    for command in commands {
        let ran = folder.agglo(command);
        assert!(!ran.text().contains(raw), "{command:?}: {:?}", ran.text());
        assert!(!ran.stderr.contains(raw), "{command:?}: {:?}", ran.stderr);
    }
    let ran = folder.agglo(&["info", "m.mcap"]);
    assert!(ran.text().contains("a\\u{1b}[31mb\\u{202e}c\\u{9b}\\u{a}d"), "{}", ran.text());
}

#[cfg(unix)]
#[test]
fn interrupted_commands_leave_nothing_half_written() {
    let folder = Folder::with(&CLOUD.replace("\"duration\": 0.1", "\"duration\": 1"));
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    let before = folder.files();
    let commands = [
        &["export", "scene.mcap", "--format", "csv", "--at", "all", "-o", "out"][..],
        &["export", "scene.mcap", "--format", "vtp", "--at", "all", "-o", "out.pvd"],
        &["recover", "scene.mcap", "-o", "out"],
        &["analyze", "scene.mcap", "--json", "out"],
    ];
    let mut interrupted = 0;
    for (command, delay) in commands.iter().flat_map(|command| [(command, 20), (command, 60)]) {
        let child =
            folder.command(command).stderr(std::process::Stdio::null()).stdout(std::process::Stdio::null()).spawn();
        let mut child = child.unwrap();
        std::thread::sleep(std::time::Duration::from_millis(delay));
        _ = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
        match child.wait().unwrap().code() {
            Some(130) => {
                interrupted += 1;
                assert_eq!(folder.files(), before, "{command:?}");
            }
            // Done already, or not listening yet.
            _ => {
                for name in folder.files().into_iter().filter(|name| !before.contains(name)) {
                    assert!(!name.ends_with(".part"), "{command:?} leaves {name}");
                    let path = folder.path(&name);
                    _ = std::fs::remove_file(&path).or_else(|_| std::fs::remove_dir_all(&path));
                }
            }
        }
    }
    assert!(interrupted > 0, "no signal came in between");
}

#[test]
fn a_checkpoint_of_another_state_is_not_gone_on_from() {
    let (folder, mut parts) = base();
    for step in [10, 20, 30, 40] {
        parts.edit(Topic::Checkpoint, step, |checkpoint: &mut v1::Checkpoint| {
            checkpoint.velocity.as_mut().unwrap().x[3] *= 1.0 + 1e-15;
        });
    }
    folder.write("m.mcap", parts.write());
    let ran = folder.agglo(&["run", "--resume", "m.mcap", "-o", "resumed.mcap"]).code(2);
    ran.says(&["its checkpoint of step 40", "holds another state than /particles"]);
    let (_, mut parts) = base();
    parts.edit(Topic::ParticlesStatic, 0, |fixed: &mut v1::ParticleStatic| fixed.mass[1] *= 2.0);
    folder.write("m.mcap", parts.write());
    let ran = folder.agglo(&["run", "--resume", "m.mcap", "-o", "resumed.mcap"]).code(2);
    ran.says(&["other radii, masses or charges than its scene"]);
    assert!(!folder.path("resumed.mcap").exists());
}
