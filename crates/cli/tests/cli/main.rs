//! The program as its users meet it: commands, exit codes, messages, files.
//!
//! `help`     texts that are generated: help (a golden file), completions, manual pages, schemas
//! `scenes`   scenes given and refused: places, hints, `--errors json`, `--set`, `init`, `check`
//! `runs`     runs and their logs: summary, streams, interruption, failure, the same bytes every time
//! `files`    what is read and written: overwriting, folders, full disks, closed pipes
//! `judged`   logs whose checksums hold and that are no logs of a run
//! `logs`     `info` and `export`, on whole and damaged logs
//! `analyze`  pages, tables, reports, and what a log says that is not so
//! `bombs`    logs that are built to take memory: every command stays below 256 MiB
//! `diff`     verdicts, tolerances, ensembles, the commands of docs/ci.md
//! `planted`  differences planted into a log, each found where it is
//! `render`   pictures: what they show, where, in which colours; what is refused; damaged logs
//! `replay`   steps listed and verified, runs that go on: interrupted, cut off, killed
//! `study`    speed against error: table, files, what is refused
//! `live`     runs that are watched
//! `view`     what is served, and to whom; Rerun; the Python page
//! `readme`   every command of the README

#![allow(clippy::unwrap_used)] // What is unexpected fails the test.

mod analyze;
mod bombs;
mod diff;
mod files;
mod help;
mod judged;
mod live;
mod logs;
mod planted;
mod readme;
mod render;
mod replay;
mod runs;
mod scenes;
mod study;
mod view;

use std::path::Path;
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

/// A folder of its own, with scenes in it, where commands are run.
struct Folder(TempDir);

/// What a command came to.
#[derive(Debug)]
struct Ran {
    code: Option<i32>,
    stdout: Vec<u8>,
    stderr: String,
}

impl From<Output> for Ran {
    fn from(output: Output) -> Self {
        let stderr = String::from_utf8(output.stderr).expect("messages are UTF-8");
        Self { code: output.status.code(), stdout: output.stdout, stderr }
    }
}

impl Ran {
    /// Standard output as text.
    fn text(&self) -> &str {
        std::str::from_utf8(&self.stdout).expect("the output is UTF-8")
    }

    /// Standard output as JSON.
    fn json(&self) -> serde_json::Value {
        serde_json::from_str(self.text()).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }

    /// The lines of standard error as JSON objects.
    fn errors(&self) -> Vec<serde_json::Value> {
        self.stderr.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
    }

    /// Checks the exit code.
    #[track_caller]
    fn code(self, code: i32) -> Self {
        assert_eq!(self.code, Some(code), "stderr: {}", self.stderr);
        self
    }

    /// Checks that an error says all of this.
    #[track_caller]
    fn says(self, parts: &[&str]) -> Self {
        for part in parts {
            assert!(self.stderr.contains(part), "{part:?} is not in: {}", self.stderr);
        }
        self
    }
}

/// A Python that has these modules. Where there is none the check is passed over, aloud, unless AGGLO_REQUIRE_PYTHON
/// is 1, as in CI.
fn python(check: &str, modules: &str) -> Option<String> {
    use std::io::Write;
    let python = std::env::var("AGGLO_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let probe = Command::new(&python).args(["-c", &format!("import {modules}")]).output();
    if probe.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let how = format!("{python} -m pip install -r tests/viewers/requirements.txt");
    assert!(std::env::var("AGGLO_REQUIRE_PYTHON").as_deref() != Ok("1"), "{modules} are missing: {how}");
    // `eprintln!` of a test that passes is not shown; this is.
    _ = writeln!(std::io::stderr(), "SKIPPED {check}: {modules} are missing ({how})");
    None
}

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    /// A folder with a scene `scene.json`.
    fn with(scene: &str) -> Self {
        let folder = Self::new();
        folder.write("scene.json", scene);
        folder
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).expect("a file in the temporary folder");
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Names of all files, sorted.
    fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("the temporary folder");
        let mut names: Vec<_> =
            entries.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8")).collect();
        names.sort();
        names
    }

    /// The program, about to run in this folder.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_agglo"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null());
        // Whatever the tests are started from, help is wrapped alike and nothing is coloured.
        command.env("COLUMNS", "100").env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
        command
    }

    /// Runs the program.
    fn agglo(&self, arguments: &[&str]) -> Ran {
        self.command(arguments).output().expect("the program starts").into()
    }

    /// Runs the program with this on standard input.
    fn agglo_reading(&self, arguments: &[&str], input: &[u8]) -> Ran {
        use std::io::Write;
        let mut command = self.command(arguments);
        let mut child =
            command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        // A program that refuses its input early closes the pipe; that is for its own output to tell.
        _ = stdin.write_all(input);
        drop(stdin);
        child.wait_with_output().expect("it ends").into()
    }
}

/// A scene shipped with the repository.
fn shipped(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(format!("{name}.json"))
}

/// Two bound spheres: 200 equal steps without impacts.
const PAIR: &str = r#"{
  "name": "pair", "duration": 0.2, "seed": 7,
  "particles": { "list": [
    { "position": [0, 0, 0], "radius": 0.05, "mass": 1 },
    { "position": [0.6, 0, 0], "radius": 0.05, "mass": 1 }
  ] },
  "near_field": {
    "attraction": { "strength": 0.5, "exponent": 1 }, "repulsion": { "strength": 0.25, "exponent": 2 }
  },
  "solver": { "step": { "fixed": 1e-3 } }
}
"#;

/// A hundred spheres with every effect, in 100 steps.
const CLOUD: &str = r#"{
  "name": "cloud", "model": "paper", "duration": 0.1, "seed": 3,
  "particles": { "random_cube": {
    "count": 100, "side": 1, "radius_ratio": 0.25, "density": 2000, "temperature": 300,
    "velocity_mean": [1, 0.1, 0.1], "velocity_spread": [1, 0.1, 0.1]
  } },
  "near_field": {
    "attraction": { "strength": 0.5, "exponent": 1 }, "repulsion": { "strength": 0.25, "exponent": 2 },
    "weight": "mass-product", "cutoff": "inflection"
  },
  "binding": { "strength": 1.75, "exponent": 1, "range": 1.65 },
  "contact": {
    "restitution": { "e0": 0.5, "v_star": 10, "theta_star": 3000 }, "friction": { "static": 0.2, "dynamic": 0.1 },
    "duration": { "step_fraction": 0.01 }
  },
  "thermal": {
    "heat_capacity": 1000, "radiation": { "emissivity": 0.01, "surroundings": 300 },
    "reaction": { "energy_per_area": 2e6, "force_scale": 1000 }
  },
  "solver": { "step": { "initial": 1e-3, "max": 1e-3 } }
}
"#;
