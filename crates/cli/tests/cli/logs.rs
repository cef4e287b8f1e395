//! `info` and `export`.

use super::{CLOUD, Folder, PAIR};

/// A folder with `scene.mcap`.
fn recorded(scene: &str) -> Folder {
    let folder = Folder::with(scene);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    folder
}

#[test]
fn info_says_what_is_in_a_log() {
    let folder = recorded(CLOUD);
    for arguments in [&["info", "scene.mcap"][..], &["info", "scene.mcap", "--check"]] {
        let ran = folder.agglo(arguments).code(0);
        for part in ["cloud", "100", "/particles", "/impacts", "foxglove.PointCloud", "paper", "whole"] {
            assert!(ran.text().contains(part), "{part:?} is not in: {}", ran.text());
        }
    }
    let json = folder.agglo(&["info", "scene.mcap", "--json"]).code(0).json();
    assert_eq!((&json["particles"], &json["damaged"]), (&100.into(), &false.into()), "{json}");
}

#[test]
fn damaged_logs_are_exit_3() {
    let folder = recorded(CLOUD);
    let whole = folder.read("scene.mcap");
    folder.write("cut.mcap", &whole[..whole.len() / 2]);
    let ran = folder.agglo(&["info", "cut.mcap"]).code(3);
    assert!(ran.text().contains("damaged"), "{}", ran.text());
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    folder.write("flipped.mcap", &flipped);
    folder.agglo(&["info", "flipped.mcap", "--check"]).code(3);
    // What is whole is exported, and the loss is said.
    let ran = folder.agglo(&["export", "cut.mcap", "--format", "csv", "--at", "0", "-o", "-"]).code(3);
    assert_eq!(ran.text().lines().count(), 101);
    assert!(!ran.stderr.is_empty());
}

#[test]
fn no_log_is_exit_2() {
    let folder = recorded(PAIR);
    for command in [&["info"][..], &["export", "--format", "csv", "-o", "-"]] {
        for (name, says) in [("missing.mcap", "missing.mcap"), ("scene.json", "scene.json"), (".", "folder")] {
            let arguments: Vec<_> = command.iter().copied().chain([name]).collect();
            folder.agglo(&arguments).code(2).says(&[says]);
        }
        folder.write("empty.mcap", "");
        let arguments: Vec<_> = command.iter().copied().chain(["empty.mcap"]).collect();
        folder.agglo(&arguments).code(2).says(&["empty.mcap"]);
    }
}

#[test]
fn csv_has_the_columns_that_the_scene_has() {
    let folder = recorded(CLOUD);
    let end = folder.agglo(&["export", "scene.mcap", "--format", "csv", "-o", "-"]).code(0);
    let mut lines = end.text().lines();
    assert_eq!(lines.next(), Some("t,step,id,x,y,z,vx,vy,vz,radius,mass,temperature,cluster"));
    assert_eq!(lines.count(), 100);
    assert!(end.text().lines().nth(1).unwrap().starts_with("0.1,100,0,"), "{}", end.text());
    let all = folder.agglo(&["export", "scene.mcap", "--format", "csv", "--at", "all", "-o", "-"]).code(0);
    assert_eq!(all.text().lines().count(), 1 + 101 * 100);
    let middle = folder.agglo(&["export", "scene.mcap", "--format", "csv", "--at", "0.0505", "-o", "-"]).code(0);
    assert!(middle.text().lines().nth(1).unwrap().split(',').nth(1) == Some("50"), "{}", middle.text());
    // Every digit that tells one number from the next: the text reads back to the recorded positions.
    let pair = recorded(PAIR);
    let first = pair.agglo(&["export", "scene.mcap", "--format", "csv", "--at", "0", "-o", "-"]).code(0);
    assert_eq!(
        first.text(),
        "t,step,id,x,y,z,vx,vy,vz,radius,mass\n\
         0.0,0,0,0.0,0.0,0.0,0.0,0.0,0.0,0.05,1.0\n\
         0.0,0,1,0.6,0.0,0.0,0.0,0.0,0.0,0.05,1.0\n"
    );
}

#[test]
fn a_time_behind_the_last_state_is_the_last_state() {
    let folder = recorded(PAIR);
    let at =
        |at: &str| folder.agglo(&["export", "scene.mcap", "--format", "csv", "--at", at, "-o", "-"]).code(0).stdout;
    assert_eq!(at("1e9"), at("end"));
}

#[test]
fn times_are_met_to_a_part_in_a_billion() {
    let folder = recorded(PAIR);
    let export = |at: &str| folder.agglo(&["export", "scene.mcap", "--format", "csv", "--at", at, "-o", "-"]);
    for step in [3, 6, 7, 12, 119] {
        // Steps add up to 0.007000000000000001 and the like, which nobody types.
        let text = export(&format!("{}", f64::from(step) / 1000.0)).code(0);
        assert_eq!(text.text().lines().nth(1).unwrap().split(',').nth(1), Some(step.to_string().as_str()));
    }
    assert!(export("0.2").code(0).stderr.is_empty());
    export("0.3").code(0).says(&["note: scene.mcap ends at t = 0.2", "before 0.3 s"]);
    export("-1").code(2).says(&["t = -1 s is before the first recorded state at 0 s"]);
}

#[test]
fn what_a_killed_run_left_is_pointed_at() {
    let folder = Folder::new();
    folder.write("scene.aB3x.mcap.part", "");
    folder.write("scenery.aB3x.mcap.part", "");
    folder.agglo(&["info", "scene.mcap"]).code(2).says(&["agglo info scene.aB3x.mcap.part"]);
    let ran = folder.agglo(&["info", "other.mcap"]).code(2);
    assert!(!ran.stderr.contains(".part"), "{}", ran.stderr);
}
