//! (a) The paper's scenes, every step recorded, by the program itself.

use std::process::Command;
use std::time::Instant;

use super::measure::row;
use super::{Context, Section};
use crate::Failure;

/// Scene, settings, what it is called, and the most seconds it may take.
const RUNS: &[(&str, &[&str], &str, f64)] = &[
    ("clustering", &[], "n = 100 with binding, 5 s", 0.15),
    ("paper-free-1e6", &[], "n = 100 without binding, 5 s", 0.25),
    ("clustering", &["--set", "particles.random_cube.count=1000"], "n = 1000 with binding, 5 s", 5.0),
];

pub fn run(context: &Context) -> Result<Section, Failure> {
    let program = std::env::current_exe()?.with_file_name("agglo");
    let mut section = Section {
        title: "The paper's scenes",
        about: "`agglo run` of the shipped scenes on one thread, model `paper`, every step recorded: wall time from start to \
                end of the program."
            .to_owned(),
        rows: Vec::new(),
        figure: None,
    };
    if !program.is_file() {
        section.about.push_str(" The program was not built: `cargo build --release`.");
        return Ok(section);
    }
    let log = context.scratch.join("run.mcap");
    for (scene, settings, what, limit) in RUNS {
        let scene = context.root.join("scenes").join(format!("{scene}.json"));
        let mut seconds = Vec::new();
        for _ in 0..if context.quick { 1 } else { 9 } {
            let start = Instant::now();
            let mut command = Command::new(&program);
            command
                .args(["run", "--overwrite", "-q", "--threads", "1"])
                .arg(&scene)
                .args(*settings)
                .arg("-o")
                .arg(&log);
            if !command.status()?.success() {
                return Err(format!("agglo run {} failed", scene.display()).into());
            }
            seconds.push(start.elapsed().as_secs_f64());
        }
        section.rows.push(row(*what, seconds, "s", Some(("limit".into(), *limit))));
    }
    Ok(section)
}
