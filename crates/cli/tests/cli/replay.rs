//! `replay`, and `run --resume`: the log of a run that goes on is that of one that was never interrupted.

use std::time::Duration;

use super::{CLOUD, Folder, PAIR};

/// A scene whose log is cut into chunks of 1000 steps, with checkpoints now and then.
fn long() -> String {
    PAIR.replace("\"duration\": 0.2", "\"duration\": 5, \"record\": { \"checkpoint_every\": 300 }")
}

#[test]
fn a_line_per_step() {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json"]).code(0);
    let ran = folder.agglo(&["replay", "scene.mcap"]).code(0);
    let rows: Vec<&str> =
        ran.text().lines().filter(|line| line.trim().starts_with(|c: char| c.is_ascii_digit())).collect();
    assert_eq!(rows.len(), 101, "the start and 100 steps");
    for column in ["iterations", "impacts", "residual [J]", "max [K]", "largest"] {
        assert!(ran.text().lines().next().unwrap().contains(column), "{column}");
    }
    assert!(ran.text().contains("Warning: model `paper`"), "notices are shown in their place");
    let ran = folder.agglo(&["replay", "scene.mcap", "--json", "--from", "0.05"]).code(0);
    let lines: Vec<serde_json::Value> = ran.text().lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 51);
    for (k, line) in lines.iter().enumerate() {
        assert_eq!(line["step"], 50 + k as u64);
        for key in ["t", "dt", "kinetic", "residual", "mean_temperature", "clusters", "impacts", "iterations"] {
            assert!(line[key].is_number(), "{key}: {line}");
        }
    }
    folder.agglo(&["replay", "scene.mcap", "--from", "7"]).code(2).says(&["ends at t = 0.1", "before 7 s"]);
    // What a scene does not have is no column.
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json"]).code(0);
    let ran = folder.agglo(&["replay", "scene.mcap"]).code(0);
    assert!(!ran.text().contains("impacts") && !ran.text().contains("[K]") && !ran.text().contains("clusters"));
}

#[test]
fn verify_says_what_it_compared() {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "--set", "record.checkpoint_every=30"]).code(0);
    let ran = folder.agglo(&["replay", "scene.mcap", "--verify"]).code(0);
    assert!(ran.text().starts_with("same: scene.mcap, solved again from step 0"), "{}", ran.text());
    let ran = folder.agglo(&["replay", "scene.mcap", "--verify", "--from", "0.07", "--json"]).code(0).json();
    assert_eq!((&ran["verdict"], &ran["from"]["step"], &ran["to"]["step"]), (&"same".into(), &60.into(), &100.into()));
    assert_eq!(
        (&ran["compared_steps"], &ran["complete"], &ran["same_build"]),
        (&40.into(), &true.into(), &true.into())
    );
    assert!(ran["first_difference"].is_null());
    // A flipped bit is damage, and what is whole is compared.
    let mut bytes = folder.read("scene.mcap");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    folder.write("damaged.mcap", &bytes);
    folder.agglo(&["replay", "damaged.mcap", "--verify"]).code(3).says(&["is damaged at byte"]);
    folder.agglo(&["replay", "damaged.mcap"]).code(3).says(&["is damaged at byte"]);
    folder.agglo(&["replay", "scene.json"]).code(2).says(&["no MCAP file"]);
    folder.agglo(&["replay", "scene.mcap", "--from", "-1"]).code(2);
}

/// Resumes, and compares with the log of a run that was never interrupted.
#[track_caller]
fn resumes(folder: &Folder, old: &str, settings: &[&str], whole: &[u8], code: i32) {
    let mut arguments = vec!["run", "--resume", old, "-o", "resumed.mcap", "--overwrite"];
    arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
    folder.agglo(&arguments).code(code);
    assert!(folder.read("resumed.mcap") == whole, "{old} {settings:?}");
}

#[test]
fn a_resumed_run_is_the_uncut_one() {
    let records = [
        r#"{ "checkpoint_every": 10 }"#,
        r#"{ "checkpoint_every": 1, "every_steps": 7 }"#,
        r#"{ "checkpoint_every": 13, "interval": 0.003, "precision": "f32", "markers": 100, "compression": "lz4" }"#,
    ];
    let scenes = [
        CLOUD.to_owned(),
        // Steps that adapt, and end a little before or behind every duration.
        CLOUD
            .replace("\"max\": 1e-3", "\"max\": 7.3e-3")
            .replace("\"paper\"", "\"consistent\"")
            .replace("\"duration\": { \"step_fraction\": 0.01 }", "\"duration\": { \"seconds\": 1e-5 }"),
        PAIR.to_owned(),
    ];
    for scene in scenes {
        for record in records {
            let folder =
                Folder::with(&scene.replace("\"duration\": 0.", &format!("\"record\": {record}, \"duration\": 0.")));
            let duration = |t: &str| format!("duration={t}");
            let log = |name: &str, t: &str| {
                folder.agglo(&["run", "scene.json", "--set", &duration(t), "-o", name]).code(0);
                folder.read(name)
            };
            let (short, long) = (log("short.mcap", "0.0501"), log("long.mcap", "0.1"));
            resumes(&folder, "long.mcap", &[], &long, 0);
            resumes(&folder, "short.mcap", &[&duration("0.1")], &long, 0);
            resumes(&folder, "long.mcap", &[&duration("0.0501")], &short, 0);
        }
    }
}

#[test]
fn a_log_cut_off_anywhere_resumes_to_the_uncut_one() {
    let folder = Folder::with(&long());
    folder.agglo(&["run", "scene.json"]).code(0);
    let whole = folder.read("scene.mcap");
    let first = folder.agglo(&["info", "scene.mcap", "--json"]).code(0).json();
    assert!(first["chunks"].as_u64().unwrap() > 4);
    for k in 1..12 {
        folder.write("cut.mcap", &whole[..whole.len() * k / 12]);
        let ran = folder.agglo(&["run", "--resume", "cut.mcap", "-o", "resumed.mcap", "--overwrite"]);
        if ran.code == Some(2) {
            assert!(ran.stderr.contains("no whole checkpoint") || k == 1, "{k}: {}", ran.stderr);
            continue;
        }
        ran.code(3).says(&["cut.mcap is damaged"]);
        assert!(folder.read("resumed.mcap") == whole, "cut off after {k} of 12 parts");
    }
    // A hole: what is behind it is solved again.
    let mut damaged = whole.clone();
    damaged[whole.len() / 2] ^= 1;
    folder.write("cut.mcap", &damaged);
    resumes(&folder, "cut.mcap", &[], &whole, 3);
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_goes_on() {
    // A checkpoint at every step: the note that the run was interrupted then stands right behind one.
    let scene = CLOUD.replace("\"duration\": 0.1", "\"duration\": 1, \"record\": { \"checkpoint_every\": 1 }");
    let folder = Folder::with(&scene);
    folder.agglo(&["run", "scene.json", "-o", "whole.mcap"]).code(0);
    let whole = folder.read("whole.mcap");
    let child = folder.command(&["run", "scene.json", "-q"]).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(150));
    // It may be done already: then this is one more resumption of a whole log.
    _ = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    child.wait_with_output().unwrap();
    resumes(&folder, "scene.mcap", &[], &whole, 0);
}

/// Kills runs at moments spread over their length; AGGLO_KILLS says how many.
#[cfg(unix)]
#[test]
fn a_killed_run_loses_nothing_that_was_flushed_and_resumes_to_the_uncut_log() {
    let kills: u64 = std::env::var("AGGLO_KILLS").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    let folder = Folder::with(
        &CLOUD.replace("\"duration\": 0.1", "\"duration\": 0.5, \"record\": { \"checkpoint_every\": 40 }"),
    );
    let started = std::time::Instant::now();
    folder.agglo(&["run", "scene.json", "-o", "whole.mcap"]).code(0);
    let length = started.elapsed();
    let whole = folder.read("whole.mcap");
    let mut resumed = 0;
    for k in 0..kills {
        let mut child = folder.command(&["run", "scene.json", "-o", "killed.mcap", "-q"]).spawn().unwrap();
        std::thread::sleep(length.mul_f64((k as f64 + 0.5) / kills as f64));
        child.kill().unwrap();
        child.wait().unwrap();
        let Some(part) = folder.files().into_iter().find(|name| name.starts_with("killed.")) else { continue };
        let bytes = folder.read(&part);
        assert!(whole.starts_with(&bytes), "what is there of kill {k} is the beginning of the uncut log");
        let info = folder.agglo(&["info", &part, "--check", "--json"]);
        if bytes.is_empty() {
            info.code(2).says(&["it is empty"]);
        } else {
            // Every whole chunk counts: none that reached the disk is lost.
            let complete = chunks(&whole).filter(|end| *end <= bytes.len()).count() as u64;
            if info.code != Some(2) {
                assert_eq!(info.json()["chunks"], complete, "kill {k}");
            }
            if complete > 0 {
                let code = if bytes.len() == whole.len() { 0 } else { 3 };
                resumes(&folder, &part, &[], &whole, code);
                resumed += 1;
            }
        }
        std::fs::remove_file(folder.path(&part)).unwrap();
    }
    assert!(resumed * 2 > kills, "{resumed} of {kills} kills left something to resume");
}

/// Where the chunks of an MCAP file end: records are an opcode, a length, and that many bytes.
fn chunks(bytes: &[u8]) -> impl Iterator<Item = usize> {
    let mut at = 8;
    std::iter::from_fn(move || {
        while at + 9 <= bytes.len() {
            let (opcode, length) = (bytes[at], u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()));
            at += 9 + length as usize;
            if opcode == 6 {
                return Some(at);
            }
        }
        None
    })
}

#[test]
fn only_the_duration_may_differ() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json"]).code(0);
    let resume = |rest: &[&str]| folder.agglo(&[&["run", "--resume", "scene.mcap"], rest].concat());
    resume(&["-o", "x.mcap", "--set", "seed=4"]).code(2).says(&["/seed would make it another one", "particles.log"]);
    resume(&["-o", "x.mcap", "--set", "duration=-1"]).code(2).says(&["duration"]);
    resume(&["-o", "scene.mcap", "--overwrite"]).code(2).says(&["its own input"]);
    resume(&[]).code(2).says(&["--output"]);
    resume(&["-o", "x.mcap", "scene.json"]).code(2).says(&["cannot be used with"]);
    folder.agglo(&["run"]).code(2).says(&["SCENE"]);
    folder.agglo(&["run", "--resume", "none.mcap", "-o", "x.mcap"]).code(2).says(&["cannot read the log none.mcap"]);
    folder.agglo(&["run", "--resume", "scene.json", "-o", "x.mcap"]).code(2).says(&["no MCAP file"]);
    assert_eq!(folder.files(), ["scene.json", "scene.mcap"]);
}
