//! `agglo replay`: a line per step, or the run solved again and compared bit for bit.

use std::fs::File;
use std::io::{self, BufReader, BufWriter, Write};

use agglo_core::ledger::Ledger;
use agglo_replay::steps::StepRecord;
use agglo_replay::text::{line, printable};
use agglo_replay::verify::{Mismatch, Verification, VerifyError, What};
use agglo_replay::{Damage, Log, LogError};
use serde_json::{Map, Value, json};

use crate::args::{COMMIT, ReplayArgs, VERSION};
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::interrupt::Interrupt;
use crate::logs;
use crate::numbers::{counted, exact, short};
use crate::output;
use crate::progress::Progress;
use crate::target::Target;
use crate::terminal::Terminal;

/// Times that differ by less than this part of them are the same [-].
const SAME_TIME: f64 = 1e-9;

/// Runs the command.
///
/// # Errors
/// A file that is no log or cannot be read; with `--verify` a log without its scene.
pub fn replay(args: &ReplayArgs, terminal: &Terminal) -> CommandResult {
    let log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    if args.verify { verify(log, args, terminal) } else { list(log, args, terminal) }
}

/// A line per step.
fn list(mut log: Log<BufReader<File>>, args: &ReplayArgs, terminal: &Terminal) -> CommandResult {
    let terms = log.run().terms.clone();
    let has = |term: &str| terms.iter().any(|name| name == term);
    let columns =
        Columns { contact: has("contact"), thermal: has("thermal"), clusters: has("binding") || has("clusters") };
    let from = args.from.map_or(f64::NEG_INFINITY, |t| t - SAME_TIME * t.abs());
    let mut out = BufWriter::with_capacity(1 << 16, io::stdout().lock());
    let mut damage = log.file_damage().map_err(|error| logs::failure(&args.log, &error))?;
    let (mut lines, mut last) = (0, None);
    let written = (|| -> Result<(), io::Error> {
        if !args.json {
            columns.header(&mut out)?;
        }
        for step in log.steps() {
            match step {
                Ok(step) => {
                    last = Some(step.t);
                    if step.t < from {
                        continue;
                    }
                    lines += 1;
                    if args.json { writeln!(out, "{}", object(&step))? } else { columns.row(&mut out, &step)? }
                }
                Err(LogError::Damaged(lost)) => damage.push(lost),
                Err(error) => return Err(io::Error::other(error.to_string())),
            }
        }
        out.flush()
    })();
    match written {
        Err(error) if error.kind() == io::ErrorKind::Other => {
            return Err(Failure::Input(
                Message::new(format!("{}: {error}", args.log.display())).file(args.log.display()),
            ));
        }
        Err(error) => return Err(Failure::write("standard output", &error)),
        Ok(()) => {}
    }
    logs::warn(&args.log, &damage, terminal);
    match (args.from, last) {
        (Some(from), Some(last)) if lines == 0 => {
            let text = format!("{} ends at t = {last} s, before {from} s", args.log.display());
            Err(Failure::Input(Message::new(text).file(args.log.display())))
        }
        _ => Ok(success(&damage)),
    }
}

fn success(damage: &[Damage]) -> Success {
    if damage.is_empty() { Success::Done } else { Success::Damaged }
}

/// Columns of the table, those that the scene has.
struct Columns {
    contact: bool,
    thermal: bool,
    clusters: bool,
}

impl Columns {
    fn header(&self, out: &mut impl Write) -> io::Result<()> {
        write!(out, "{:>8} {:>12} {:>10} {:>10} {:>8}", "step", "t [s]", "dt [s]", "iterations", "rejected")?;
        if self.contact {
            write!(out, " {:>8} {:>8}", "impacts", "contacts")?;
        }
        write!(out, " {:>11} {:>11}", "kinetic [J]", "residual [J]")?;
        if self.thermal {
            write!(out, " {:>9} {:>9}", "mean [K]", "max [K]")?;
        }
        if self.clusters {
            write!(out, " {:>8} {:>7}", "clusters", "largest")?;
        }
        writeln!(out)
    }

    fn row(&self, out: &mut impl Write, step: &StepRecord) -> io::Result<()> {
        let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let diagnostics = step.diagnostics.as_ref();
        let dt = or_dash(diagnostics.map(|d| short(d.dt)));
        let iterations = or_dash(diagnostics.map(|d| d.iterations().to_string()));
        let rejected = or_dash(diagnostics.map(|d| d.rejected.len().to_string()));
        write!(out, "{:>8} {:>12} {dt:>10} {iterations:>10} {rejected:>8}", step.step, format!("{:.6}", step.t))?;
        if self.contact {
            let contacts = or_dash(diagnostics.map(|d| d.contacts.to_string()));
            write!(out, " {:>8} {contacts:>8}", step.impacts.len())?;
        }
        let energy = |of: fn(&Ledger) -> f64| or_dash(step.ledger.as_ref().map(|ledger| short(of(ledger))));
        write!(out, " {:>11} {:>12}", energy(|ledger| ledger.kinetic), energy(|ledger| ledger.residual))?;
        if self.thermal {
            let temperatures = temperatures(step);
            let (mean, max) = (temperatures.map(|(mean, _)| short(mean)), temperatures.map(|(_, max)| short(max)));
            write!(out, " {:>9} {:>9}", or_dash(mean), or_dash(max))?;
        }
        if self.clusters {
            let clusters = step.clusters.as_ref();
            let (count, largest) = (clusters.map(|c| c.count.to_string()), clusters.map(|c| c.largest.to_string()));
            write!(out, " {:>8} {:>7}", or_dash(count), or_dash(largest))?;
        }
        writeln!(out)?;
        step.notices
            .iter()
            .try_for_each(|notice| writeln!(out, "{:>8} {:?}: {}", "", notice.level, line(&notice.message)))
    }
}

/// Mean and largest temperature [K].
fn temperatures(step: &StepRecord) -> Option<(f64, f64)> {
    let temperature = step.frame.as_ref()?.temperature.as_deref()?;
    let mean = temperature.iter().sum::<f64>() / temperature.len() as f64;
    Some((mean, temperature.iter().copied().fold(f64::NEG_INFINITY, f64::max)))
}

/// A step as a JSON object; what was not recorded at this step is null, what the scene does not have is absent.
fn object(step: &StepRecord) -> Value {
    let mut object = Map::new();
    let mut put = |key: &str, value: Value| drop(object.insert(key.to_owned(), value));
    put("t", exact(step.t));
    put("step", json!(step.step));
    put("recorded", json!(step.frame.is_some()));
    put("checkpoint", json!(step.checkpoint));
    if let Some(d) = &step.diagnostics {
        put("dt", exact(d.dt));
        put("iterations", json!(d.iterations()));
        put("rejected", json!(d.rejected.len()));
        put("position_error", d.position_errors.last().copied().map_or(Value::Null, exact));
        put("contacts", json!(d.contacts));
        put("resting", json!(d.resting));
        put("pairs_evaluated", json!(d.pairs_evaluated));
        if let Some(bonds) = d.bonds {
            put("bonds", json!(bonds));
        }
    }
    put("impacts", json!(step.impacts.len()));
    if let Some(ledger) = &step.ledger {
        let Ledger { kinetic, near_field, binding, external, thermal, totals, residual } = ledger;
        for (key, value) in [
            ("kinetic", kinetic),
            ("near_field", near_field),
            ("binding", binding),
            ("external", external),
            ("thermal", thermal),
            ("reaction_heat", &totals.reaction_heat),
            ("radiated", &totals.radiated),
            ("convected", &totals.convected),
            ("impact_loss", &totals.impact_loss),
            ("friction_loss", &totals.friction_loss),
            ("residual", residual),
        ] {
            put(key, exact(*value));
        }
    }
    if let Some((mean, max)) = temperatures(step) {
        put("mean_temperature", exact(mean));
        put("max_temperature", exact(max));
    }
    if let Some(clusters) = &step.clusters {
        put("clusters", json!(clusters.count));
        put("largest_cluster", json!(clusters.largest));
        put("singletons", json!(clusters.singletons));
    }
    if !step.notices.is_empty() {
        let notices = step.notices.iter();
        let level = |level| format!("{level:?}").to_lowercase();
        put("log", notices.map(|n| json!({ "level": level(n.level), "message": n.message })).collect());
    }
    Value::Object(object)
}

/// The run solved again.
fn verify(mut log: Log<BufReader<File>>, args: &ReplayArgs, terminal: &Terminal) -> CommandResult {
    let name = args.log.display().to_string();
    let build = log.run().build.clone();
    let same_build = (build.version.as_str(), build.commit.as_str()) == (VERSION, COMMIT);
    if !same_build {
        terminal.warning(&Message::new(format!(
            "{name} was recorded by agglo {} (commit {}), and is solved again by {VERSION} (commit {COMMIT}): a \
             difference may be one of the versions",
            build.version, build.commit
        )));
    }
    let duration = log.scene().map_err(|error| logs::failure(&args.log, &error))?.duration;
    let interrupt = Interrupt::install()?;
    let mut progress = Progress::new(terminal, duration);
    let result = log.verify(args.from.unwrap_or(0.0), |report| {
        progress.step(report);
        !interrupt.asked()
    });
    progress.finish();
    let done = match result {
        Ok(done) => done,
        Err(VerifyError::Log(error)) => return Err(logs::failure(&args.log, &error)),
        Err(error) => return Err(Failure::Input(Message::new(format!("{name}: {error}")).file(&name))),
    };
    if done.mismatch.is_none() && done.messages == 0 && !done.stopped {
        logs::warn(&args.log, &done.damage, terminal);
        let text = format!("{name} holds nothing behind its start that could be compared");
        return Err(Failure::Input(Message::new(text).file(&name)));
    }
    let text = if args.json {
        format!("{:#}\n", verification_json(&done, same_build, duration))
    } else {
        printable(&verification_text(&done, &name, duration))
    };
    output::write_all(&Target::Standard, false, text.as_bytes())?;
    logs::warn(&args.log, &done.damage, terminal);
    if done.mismatch.is_some() {
        return Ok(Success::Differs);
    }
    if done.stopped {
        return Ok(Success::Interrupted);
    }
    Ok(success(&done.damage))
}

/// Whether the log ends before its scene does.
fn ends_early(done: &Verification, duration: f64) -> bool {
    done.to.1 < duration * (1.0 - SAME_TIME)
}

fn verification_text(done: &Verification, name: &str, duration: f64) -> String {
    let Verification { from, to, steps, messages, stopped, mismatch, damage: _ } = done;
    let span = format!(
        "solved again from step {} (t = {} s): {} in {}",
        from.0,
        short(from.1),
        counted(*messages, "message"),
        counted(*steps, "step")
    );
    let Some(Mismatch { t, step, channel, what }) = mismatch else {
        let of = if ends_early(done, duration) { format!(" of {} s", short(duration)) } else { String::new() };
        let upto = format!("{name}, {span}, up to t = {} s{of}", short(to.1));
        return if *stopped {
            format!("interrupted: {upto}, were the same bit for bit; the rest was not compared\n")
        } else {
            format!("same: {upto}, are the same bit for bit\n")
        };
    };
    let place = format!("at t = {t} s, step {step}, {channel}");
    let text = match what {
        What::Value(difference) => format!("{place}: {difference}"),
        What::Bytes => format!("{place}: bytes that stand for no value differ, or colours"),
        What::OnlyRecorded => format!("{place}: the log has a message that solving again does not give"),
        What::OnlySolved => format!("{place}: solving again gives a message that the log does not have"),
        What::Failed(error) => format!("{place}: the log goes on, but solving again fails: {error}"),
    };
    format!("differs: {name}, {span} were the same, then\n{text}\n")
}

fn verification_json(done: &Verification, same_build: bool, duration: f64) -> Value {
    let Verification { from, to, steps, messages, stopped, mismatch, damage } = done;
    let verdict = match (mismatch, stopped) {
        (Some(_), _) => Some("differ"),
        (None, true) => None,
        (None, false) => Some("same"),
    };
    let at = |(step, t): (u64, f64)| json!({ "step": step, "t": exact(t) });
    let difference = mismatch.as_ref().map(|Mismatch { t, step, channel, what }| {
        let mut object = json!({ "t": exact(*t), "step": step, "channel": channel });
        match what {
            What::Value(difference) => {
                object["what"] = "value".into();
                object["field"] = difference.field.as_str().into();
                object["particle"] = json!(difference.index);
                object["recorded"] = difference.a.clone();
                object["solved"] = difference.b.clone();
                object["ulp"] = json!(difference.ulp);
            }
            What::Bytes => object["what"] = "bytes".into(),
            What::OnlyRecorded => object["what"] = "only recorded".into(),
            What::OnlySolved => object["what"] = "only solved".into(),
            What::Failed(error) => {
                object["what"] = "failed".into();
                object["error"] = error.to_string().into();
            }
        }
        object
    });
    json!({
        "format": 1, "verdict": verdict, "interrupted": stopped, "damaged": !damage.is_empty(),
        "same_build": same_build, "from": at(*from), "to": at(*to), "complete": !ends_early(done, duration),
        "compared_steps": steps, "compared_messages": messages, "first_difference": difference,
    })
}
