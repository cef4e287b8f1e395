//! `docs/accuracy.md`: speed against error, case by case, with other programs on the problems that they can do.

mod cases;
mod peers;

use agglo_core::Scene;
use agglo_core::scene::SolutionMethod;
use agglo_study::{Plan, Scheme, Study, Watcher, chart, page, study};
use std::fmt::Write;

pub use cases::{CASES, Case};

use crate::Failure;
use crate::paper::File;
use peers::Answer;

/// How the pages are made.
#[derive(Clone, Debug)]
pub struct Options {
    /// Time for each case [s].
    pub budget: f64,
    /// Command lines of other programs.
    pub peers: Vec<String>,
    /// Names of the cases; empty: all.
    pub cases: Vec<String>,
}

/// Studies the cases, and gives the pages and diagrams.
///
/// # Errors
/// A case that cannot be studied, a peer that fails.
pub fn generate(options: &Options) -> Result<Vec<File>, Failure> {
    let chosen: Vec<&Case> = CASES
        .iter()
        .filter(|case| options.cases.is_empty() || options.cases.iter().any(|name| name == case.name))
        .collect();
    if chosen.is_empty() {
        let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        return Err(format!("no case has that name; there are {}", names.join(", ")).into());
    }
    let mut files = Vec::new();
    for case in chosen {
        files.extend(one(case, options).map_err(|error| format!("{}: {error}", case.name))?);
    }
    if options.cases.is_empty() {
        files.push(index(&files, options));
    }
    Ok(files)
}

/// A line on standard error for each measurement.
struct Lines(&'static str);

impl Watcher for Lines {
    fn next(&mut self, done: usize, planned: usize, what: &str) -> bool {
        eprintln!("{}: {done} of {planned}: {what}", self.0);
        true
    }
}

/// Page and diagram of a case.
fn one(case: &Case, options: &Options) -> Result<Vec<File>, Failure> {
    let scene = Scene::parse(case.scene, &[]).map_err(|problems| format!("{problems:?}"))?;
    let newton = |kind| Scheme::Consistent(kind, SolutionMethod::Newton);
    let mut plan = Plan { budget: options.budget, repeats: 5, seeds: case.seeds, ..Plan::default() };
    if !case.high_order {
        plan.schemes.retain(|scheme| !scheme.is_of_high_order());
    }
    plan.schemes.extend(case.newton.iter().map(|&kind| newton(kind)));
    let found = study(&scene, &plan, &mut Lines(case.name)).map_err(|error| format!("{error:?}"))?;
    let mut curves = Vec::new();
    let mut answers = Vec::new();
    for command in options.peers.iter().filter(|_| case.peers) {
        let answer = peers::ask(command, &scene, &found)?;
        curves.extend(answer.curves.iter().map(|curve| (curve.name.clone(), curve.points.clone())));
        answers.push(answer);
    }
    let svg = chart::svg(&found, &curves)?;
    let mut text = page::markdown(&found, Some(&format!("{}.svg", case.name)));
    let description = scene.description.as_deref().unwrap_or_default();
    text = text.replacen(
        "\n\n",
        &format!("\n\n{description} Scene: `studies/src/accuracy/cases/{}.json`.\n\n", case.name),
        1,
    );
    text += &beside(&found, &answers);
    Ok(vec![
        File { path: format!("docs/accuracy/{}.svg", case.name), text: svg },
        File { path: format!("docs/accuracy/{}.md", case.name), text },
    ])
}

/// Other programs' wall times at the errors that they reach, beside our best.
fn beside(study: &Study, answers: &[Answer]) -> String {
    let mut text = String::new();
    if answers.is_empty() {
        return text;
    }
    text += "\n## Other programs, in the same run\n\n| program | error | its wall time [s] | ours at that error [s] | ours over theirs |\n|---|---:|---:|---:|---:|\n";
    for curve in answers.iter().flat_map(|answer| &answer.curves) {
        for &(error, wall) in &curve.points {
            let ours = best(study, error);
            let ratio = ours.map_or("–".to_owned(), |(seconds, _)| format!("{:.2}", seconds / wall));
            let ours = ours.map_or("–".to_owned(), |(seconds, scheme)| format!("{seconds:.1e} ({scheme})"));
            _ = writeln!(text, "| {} | {error:.1e} | {wall:.1e} | {ours} | {ratio} |", curve.name);
        }
    }
    for answer in answers {
        _ = writeln!(text, "\n{}", answer.note);
    }
    text
}

/// The least wall time at which any scheme of ours has at most this error [s], and which.
fn best(study: &Study, error: f64) -> Option<(f64, &str)> {
    (study.measurements.iter())
        .filter(|m| m.errors.position <= error)
        .map(|m| (m.wall_seconds, m.scheme.as_str()))
        .min_by(|a, b| a.0.total_cmp(&b.0))
}

/// The page that leads to the others.
fn index(files: &[File], options: &Options) -> File {
    let mut text = include_str!("accuracy/page.md").to_owned();
    for case in CASES {
        if files.iter().any(|file| file.path.contains(&format!("/{}.md", case.name))) {
            _ = writeln!(
                text,
                "\n## [{0}](accuracy/{0}.md)\n\n![wall time against error](accuracy/{0}.svg)",
                case.name
            );
        }
    }
    if options.peers.is_empty() {
        text += "\nThis page was made without other programs (`--peer`).\n";
    }
    File { path: "docs/accuracy.md".to_owned(), text }
}
