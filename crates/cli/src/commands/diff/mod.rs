//! `agglo diff`: compares two logs, for people and for CI.

mod annotations;
mod json;
mod junit;
mod markdown;
mod text;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use agglo_replay::Log;
use agglo_replay::diff::{self, LEAST_REFERENCES, Profile, Report, Tolerances, Verdict};
use agglo_replay::text::printable;

use crate::args::DiffArgs;
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::logs;
use crate::output;
use crate::progress::Progress;
use crate::target::Target;
use crate::terminal::Terminal;

/// The two logs' names, as they were given.
#[derive(Clone, Copy, Debug)]
pub struct Names<'a> {
    a: &'a str,
    b: &'a str,
}

/// Runs the command.
///
/// # Errors
/// Logs that cannot be compared, a bad tolerance file, an output that cannot be written.
pub fn diff(args: &DiffArgs, terminal: &Terminal) -> CommandResult {
    let targets = [&args.json, &args.junit, &args.markdown].into_iter().flatten();
    output::distinct(targets.clone())?;
    for target in targets {
        for input in [&args.a, &args.b].into_iter().chain(&args.ensemble).chain(&args.tolerance) {
            output::differs(target, Some(input))?;
        }
        output::check(target, args.overwrite)?;
    }
    let tolerances = tolerances(args)?;
    let profile = args.profile.map_or_else(
        || match (&args.tolerance, args.ensemble.is_empty()) {
            (_, false) => Profile::Statistics,
            (Some(_), true) => Profile::State,
            (None, true) => Profile::Exact,
        },
        Profile::from,
    );
    if profile == Profile::Exact && args.tolerance.is_some() {
        let text = "the profile `exact` has no tolerances";
        return Err(Failure::Input(Message::new(text).hint("leave out --tolerance, or use --profile state")));
    }
    if profile != Profile::Statistics && !args.ensemble.is_empty() {
        let text = format!("the profile `{}` has no use for --ensemble", profile.name());
        return Err(Failure::Input(Message::new(text).hint("leave it out, or use --profile statistics")));
    }
    let (a, b) = (args.a.display().to_string(), args.b.display().to_string());
    let names = Names { a: &a, b: &b };
    let report = match compare(args, profile, tolerances, terminal) {
        Ok(report) => report,
        // Programs that read the report learn of it there as well.
        Err(Failure::Input(message)) => Report::unreadable(profile, message.text),
        Err(other) => return Err(other),
    };
    write(args, names, &report, terminal)?;
    logs::warn(&args.a, &report.damage_a, terminal);
    logs::warn(&args.b, &report.damage_b, terminal);
    match &report.verdict {
        Verdict::Incomparable(why) => {
            Err(Failure::Input(Message::new(format!("{a} and {b} could not be compared: {why}"))))
        }
        Verdict::Differ => Ok(Success::Differs),
        Verdict::Same if report.damaged() => Ok(Success::Damaged),
        Verdict::Same => Ok(Success::Done),
    }
}

fn tolerances(args: &DiffArgs) -> Result<Tolerances, Failure> {
    let mut tolerances = match &args.tolerance {
        Some(path) => {
            let name = path.display().to_string();
            let text = std::fs::read_to_string(path).map_err(|error| {
                Failure::Input(Message::new(format!("cannot read the tolerance file {name}: {error}")).file(&name))
            })?;
            Tolerances::parse(&text).map_err(|why| {
                let hint = r#"a tolerance file looks like {"format":1,"fields":{"/particles.x":{"abs":1e-9}}}"#;
                Failure::Input(Message::new(format!("the tolerance file {name}: {why}")).file(name).hint(hint))
            })?
        }
        None => Tolerances::default(),
    };
    args.ignore.iter().for_each(|name| tolerances.ignore(name));
    Ok(tolerances)
}

fn open(path: &Path) -> Result<Log<BufReader<File>>, Failure> {
    logs::open(path).map_err(|error| logs::failure(path, &error))
}

fn compare(args: &DiffArgs, profile: Profile, tolerances: Tolerances, terminal: &Terminal) -> Result<Report, Failure> {
    let mut a = open(&args.a)?;
    if profile == Profile::Statistics {
        let paths = references(args, terminal);
        if !args.ensemble.is_empty() && paths.len() < LEAST_REFERENCES {
            let text = format!("a band needs {LEAST_REFERENCES} reference runs, and there are {}", paths.len());
            let hint = "B counts as one, A and repeated names do not; run the scene with other seeds";
            return Err(Failure::Input(Message::new(text).hint(hint)));
        }
        let mut logs = paths.iter().map(|path| open(path)).collect::<Result<Vec<_>, _>>()?;
        let report = diff::judge(&mut a, &mut logs, args.significance, tolerances);
        return report.map_err(|error| logs::failure(&args.a, &error));
    }
    let mut b = open(&args.b)?;
    let duration = a.scene().map_or(0.0, |scene| scene.duration);
    let mut progress = Progress::new(terminal, duration);
    let report = diff::diff(&mut a, &mut b, profile, tolerances, |t, step| progress.carried(t, step));
    progress.finish();
    report.map_err(|error| logs::failure(&args.a, &error))
}

/// B and the ensemble, each file once, and not the log that is judged.
fn references(args: &DiffArgs, terminal: &Terminal) -> Vec<PathBuf> {
    let file = |path: &PathBuf| std::fs::canonicalize(path).unwrap_or_else(|_| path.clone());
    let mut seen = Vec::new();
    let mut found = vec![args.b.clone()];
    seen.push(file(&args.b));
    for path in &args.ensemble {
        let of = file(path);
        if of == file(&args.a) {
            terminal.note(format!("{} is the log that is judged, and is left out of its own band", path.display()));
        } else if !seen.contains(&of) {
            found.push(path.clone());
            seen.push(of);
        }
    }
    found
}

fn write(args: &DiffArgs, names: Names<'_>, report: &Report, terminal: &Terminal) -> Result<(), Failure> {
    let mut streamed = false;
    for (target, make) in [
        (&args.json, json::report as fn(Names<'_>, &Report) -> String),
        (&args.junit, junit::report),
        (&args.markdown, markdown::report),
    ] {
        let Some(target) = target else { continue };
        streamed |= *target == Target::Standard;
        output::write_all(target, args.overwrite, make(names, report).as_bytes())?;
    }
    let mut text = String::new();
    if !streamed && !terminal.quiet {
        text += &printable(&text::report(names, report));
    }
    let github = std::env::var_os("GITHUB_ACTIONS").is_some_and(|value| value == "true");
    if (args.annotations || github) && !streamed {
        text += &printable(&annotations::report(names, report));
    }
    output::write_all(&Target::Standard, false, text.as_bytes())
}
