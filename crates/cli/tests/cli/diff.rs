//! `diff`: verdicts, exit codes, reports for programs, ensembles, and every command of docs/ci.md.

use std::path::{Path, PathBuf};

use super::{CLOUD, Folder, PAIR};

/// A folder with logs of the cloud: a.mcap, b.mcap the same, seed.mcap of another seed.
fn logs() -> Folder {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    folder.agglo(&["run", "scene.json", "-o", "b.mcap"]).code(0);
    folder.agglo(&["run", "scene.json", "--set", "seed=4", "-o", "seed.mcap"]).code(0);
    folder
}

#[test]
fn the_same_runs_are_the_same() {
    let folder = logs();
    let ran = folder.agglo(&["diff", "a.mcap", "b.mcap"]).code(0);
    assert!(ran.text().starts_with("same: a.mcap and b.mcap, profile exact, 101 steps compared"), "{}", ran.text());
    for (name, record) in [("none", "none"), ("lz4", "lz4")] {
        let set = format!("record.compression={record}");
        folder.agglo(&["run", "scene.json", "--set", &set, "-o", &format!("{name}.mcap")]).code(0);
        let ran = folder.agglo(&["diff", "a.mcap", &format!("{name}.mcap")]).code(0);
        assert!(ran.text().contains("setting /record/compression"), "{}", ran.text());
    }
    // Other chunks, the same messages.
    folder.agglo(&["recover", "a.mcap", "-o", "chunks.mcap"]).code(0);
    folder.agglo(&["diff", "a.mcap", "chunks.mcap"]).code(0);
}

#[test]
fn the_report_for_programs() {
    let folder = logs();
    let ran = folder.agglo(&["diff", "seed.mcap", "a.mcap", "--json", "-"]).code(1).json();
    assert_eq!((&ran["format"], &ran["verdict"], &ran["profile"]), (&1.into(), &"differ".into(), &"exact".into()));
    for key in ["damaged", "compared_steps", "first_difference", "fields", "ignored", "growth_rate", "statistics"] {
        assert!(!ran[key].is_null() || matches!(key, "growth_rate" | "statistics"), "{key}: {ran}");
    }
    assert_eq!(ran["settings"][0]["name"], "/seed");
    for key in ["t", "step", "channel", "field", "particle", "a", "b", "abs", "rel", "ulp"] {
        assert!(ran["first_difference"].get(key).is_some(), "{key}");
    }
    let field = ran["fields"].as_array().unwrap().iter().find(|field| field["field"] == "x").unwrap();
    for key in ["channel", "field", "max_abs", "max_rel", "rms", "at", "tolerance", "passed"] {
        assert!(field.get(key).is_some(), "{key}");
    }
    assert!(field["at"]["particle"].is_u64() && field["passed"] == false);
    // Reports are written beside each other; none is replaced unasked.
    let arguments = ["diff", "seed.mcap", "a.mcap", "--json", "d.json", "--junit", "d.xml", "--markdown", "d.md"];
    folder.agglo(&arguments).code(1);
    folder.agglo(&arguments).code(2).says(&["exists", "--overwrite"]);
    folder.agglo(&[&arguments[..], &["--overwrite"]].concat()).code(1);
    folder.agglo(&["diff", "seed.mcap", "a.mcap", "--json", "a.mcap", "--overwrite"]).code(2).says(&["its own input"]);
    // Nor is one written over another, whatever both are called.
    folder.agglo(&["diff", "a.mcap", "b.mcap", "--json", "x", "--junit", "./x"]).code(2).says(&["two results", "./x"]);
    folder.agglo(&["diff", "a.mcap", "b.mcap", "--json", "-", "--markdown", "-"]).code(2).says(&["two results"]);
    let xml = String::from_utf8(folder.read("d.xml")).unwrap();
    assert!(xml.contains("<testsuite ") && xml.contains("/particles.x") && xml.contains("<failure "), "{xml}");
    assert!(String::from_utf8(folder.read("d.md")).unwrap().starts_with("### agglo diff: differ"));
}

#[test]
fn tolerances_decide_field_by_field() {
    // Two steps of another size: small differences everywhere.
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    let nudged = PAIR.replace("\"position\": [0.6,", "\"position\": [0.6000001,");
    folder.write("nudged.json", nudged);
    folder.agglo(&["run", "nudged.json", "-o", "b.mcap"]).code(0);
    let judge = |tolerance: &str, code: i32| {
        folder.write("t.json", tolerance);
        folder.agglo(&["diff", "a.mcap", "b.mcap", "--tolerance", "t.json"]).code(code)
    };
    judge(r#"{"format":1,"default":{"abs":1e-3,"rel":1e-2}}"#, 0);
    judge(r#"{"format":1,"default":{"abs":1e-9,"rel":0}}"#, 1);
    // A field's own tolerance goes before its channel's, that before the default.
    let fields = r#"{"format":1,"default":{"abs":1e-3,"rel":1e-2},"fields":{"/particles.x":{"abs":1e-12}}}"#;
    assert!(judge(fields, 1).text().contains("/particles.x"));
    let ignored = r#"{"format":1,"default":{"abs":1e-3,"rel":1e-2},"fields":{"/particles":{"ignore":true}}}"#;
    assert!(judge(ignored, 0).text().contains("ignored by name: /particles"));
    judge(r#"{"format":1,"fields":{"/particles.tempreture":{"abs":1}}}"#, 2).says(&["matches nothing"]);
    // What is named more closely goes first: all of a channel but one field, whichever way round.
    let but_one = r#"{"format":1,"default":{"abs":1e-3,"rel":1e-2},"fields":{"/particles":{"ignore":true},"/particles.x":{"abs":1e-12}}}"#;
    assert!(judge(but_one, 1).text().contains("/particles.x"));
    let one = r#"{"format":1,"default":{"abs":1e-3,"rel":1e-2},"fields":{"/particles":{"abs":1e-12},"/particles.x":{"ignore":true}}}"#;
    assert!(judge(one, 1).text().contains("/particles.vx"));
    judge(r#"{"format":1,"fields":{"/energy":{"abs":1},"/energy":{"ignore":true}}}"#, 2)
        .says(&["`/energy` stands there twice"]);
    judge(r#"{"format":2}"#, 2).says(&["format is 2"]);
    judge(r#"{"format":1,"default":{"abs":-1}}"#, 2).says(&["default.abs is -1"]);
    judge(r#"{"format":1,"defualt":{}}"#, 2).says(&["defualt"]);
    folder.agglo(&["diff", "a.mcap", "b.mcap", "--tolerance", "none.json"]).code(2).says(&["none.json"]);
    folder.agglo(&["diff", "a.mcap", "b.mcap", "--profile", "exact", "--tolerance", "t.json"]).code(2);
}

#[test]
fn other_steps_are_compared_by_time() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-o", "a.mcap"]).code(0);
    folder.agglo(&["run", "scene.json", "--set", "solver.step.fixed=1.25e-3", "-o", "b.mcap"]).code(0);
    folder.write("t.json", r#"{"format":1,"default":{"abs":1e-5,"rel":1e-3}}"#);
    // Diagnostics have no value between steps: not compared, and so not the same.
    let ran = folder.agglo(&["diff", "a.mcap", "b.mcap", "--tolerance", "t.json"]).code(1);
    assert!(ran.text().contains("not compared: /diagnostics"), "{}", ran.text());
    let ignore = ["--ignore", "/diagnostics", "--ignore", "/checkpoint", "--ignore", "/scene"];
    let ran = folder.agglo(&[&["diff", "a.mcap", "b.mcap", "--tolerance", "t.json"][..], &ignore].concat()).code(0);
    assert!(ran.text().contains("compared by time"), "{}", ran.text());
    // A log that ends earlier is not covered by the other.
    folder
        .agglo(&["run", "scene.json", "--set", "solver.step.fixed=1.25e-3", "--set", "duration=0.15", "-o", "c.mcap"])
        .code(0);
    let ran = folder.agglo(&[&["diff", "a.mcap", "c.mcap", "--tolerance", "t.json"][..], &ignore].concat()).code(1);
    assert!(ran.text().contains("the second log ends there"), "{}", ran.text());
}

#[test]
fn what_cannot_be_compared_is_never_the_same() {
    let folder = logs();
    folder.write("pair.json", PAIR);
    folder.agglo(&["run", "pair.json"]).code(0);
    let ran = folder.agglo(&["diff", "pair.mcap", "a.mcap", "--json", "d.json"]).code(2);
    ran.says(&["2 particles", "100"]);
    let report: serde_json::Value = serde_json::from_slice(&folder.read("d.json")).unwrap();
    assert_eq!(report["verdict"], "incomparable");
    folder.agglo(&["diff", "scene.json", "a.mcap"]).code(2).says(&["no MCAP file"]);
    folder.agglo(&["diff", "none.mcap", "a.mcap", "--json", "-"]).code(2).says(&["none.mcap"]);
    // Half a log: what is there is the same.
    let whole = folder.read("a.mcap");
    folder.write("cut.mcap", &whole[..whole.len() * 3 / 4]);
    let ran = folder.agglo(&["diff", "cut.mcap", "a.mcap"]);
    assert!(ran.code == Some(3) || ran.code == Some(2), "{}", ran.stderr);
}

#[test]
fn annotations_where_github_reads_them() {
    let folder = logs();
    let ran = folder.command(&["diff", "seed.mcap", "a.mcap"]).env("GITHUB_ACTIONS", "true").output().unwrap();
    let text = String::from_utf8(ran.stdout).unwrap();
    let line = text.lines().find(|line| line.starts_with("::error file=seed.mcap,title=agglo diff::")).expect("a line");
    assert!(line.contains("first difference at t = 0 s"), "{line}");
    let ran = folder.agglo(&["diff", "a.mcap", "b.mcap", "--annotations"]).code(0);
    assert!(!ran.text().contains("::"), "nothing to annotate");
}

#[test]
fn an_ensemble_of_eight_seeds_finds_what_changed_and_passes_what_did_not() {
    let folder = Folder::with(&std::fs::read_to_string(super::shipped("clustering")).unwrap());
    let run = |name: &str, settings: &[&str]| {
        let mut arguments = vec!["run", "scene.json", "-q", "-o", name, "--set", "record.every_steps=5"];
        arguments.extend(["--set", "record.markers=0"]);
        arguments.extend(settings.iter().flat_map(|setting| ["--set", setting]));
        folder.agglo(&arguments).code(0);
    };
    let names: Vec<String> = (1..=8).map(|seed| format!("seed-{seed}.mcap")).collect();
    for (seed, name) in (1..=8).zip(&names) {
        run(name, &[&format!("seed={seed}")]);
    }
    let ensemble: Vec<&str> = names.iter().map(String::as_str).collect();
    let judge = |name: &str, code: i32| {
        let ran = folder.agglo(&[&["diff", name, "seed-1.mcap", "--ensemble"], &ensemble[..]].concat()).code(code);
        assert!(ran.text().contains("judged against 8 references"), "{}", ran.text());
        ran
    };
    // Another seed than those of the ensemble; and one of them, off by a bit.
    run("fresh.mcap", &["seed=9"]);
    judge("fresh.mcap", 0);
    run("ulp.mcap", &["seed=2", "solver.step.initial=0.0010000000000000002"]);
    judge("ulp.mcap", 0);
    run("e0.mcap", &["seed=2", "contact.restitution.e0=0.525"]);
    assert!(judge("e0.mcap", 1).text().contains("largest_restitution"));
    run("kappa.mcap", &["seed=2", "thermal.reaction.energy_per_area=2.1e6"]);
    assert!(judge("kappa.mcap", 1).text().contains("largest_impact_heat"));
    run("friction.mcap", &["seed=2", "contact.friction=null"]);
    assert!(judge("friction.mcap", 1).text().contains("friction_share"));
    run("smooth.mcap", &["seed=2", "contact.friction.static=0", "contact.friction.dynamic=0"]);
    assert!(judge("smooth.mcap", 1).text().contains("friction_share"));
    // Four references are no band; without any, plain tolerances, and it says so.
    folder.agglo(&["diff", "fresh.mcap", "seed-1.mcap", "--ensemble", "seed-1.mcap", "seed-2.mcap"]).code(2);
    let ran = folder.agglo(&["diff", "ulp.mcap", "seed-2.mcap", "--profile", "statistics"]).code(0);
    assert!(ran.text().contains("plain tolerances"), "{}", ran.text());
}

fn page() -> String {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/ci.md");
    std::fs::read_to_string(path).unwrap()
}

/// A folder as the page's commands expect it, and how they are run there.
fn shell(folder: &Folder, script: &str) {
    let program = Path::new(env!("CARGO_BIN_EXE_agglo")).parent().unwrap().to_owned();
    let rest = std::env::var_os("PATH").unwrap();
    let path = std::env::join_paths(std::iter::once(program).chain(std::env::split_paths(&rest))).unwrap();
    let output = std::process::Command::new("sh")
        .args(["-ec", script])
        .current_dir(folder.path("."))
        .env("PATH", &path)
        .env("GITHUB_STEP_SUMMARY", folder.path("summary.md"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{script}\n{said}");
}

#[cfg(unix)]
#[test]
fn the_commands_of_the_page_on_ci() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("scenes")).unwrap();
    std::fs::copy(super::shipped("clustering"), folder.path("scenes/clustering.json")).unwrap();
    let page = page();
    let blocks: Vec<&str> = page.split("```sh\n").skip(1).filter_map(|rest| rest.split("```").next()).collect();
    assert_eq!(blocks.len(), 3);
    blocks.iter().for_each(|block| shell(&folder, block));
    // The workflow, as far as it can be run without GitHub.
    let workflow = page.split("```yaml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    for name in ["candidate.mcap", "diff.xml", "diff.md"] {
        std::fs::remove_file(folder.path(name)).unwrap();
    }
    let steps: Vec<&str> = workflow.lines().filter_map(|line| line.trim().strip_prefix("- run: ")).collect();
    assert_eq!(steps.len(), 4);
    for step in steps.iter().filter(|step| !step.starts_with("cargo install")) {
        shell(&folder, step);
    }
    assert!(String::from_utf8(folder.read("summary.md")).unwrap().contains("agglo diff: same"));
}
