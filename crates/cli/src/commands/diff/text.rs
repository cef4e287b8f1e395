//! A comparison for people.

use std::fmt::Write;

use agglo_replay::diff::{Profile, Report, Verdict, setting_text};

use super::{Names, json};
use crate::numbers::{counted, short};

/// Fields and curves that are listed.
const SHOWN: usize = 12;
/// Settings that are listed.
const SETTINGS: usize = 20;

/// The verdict, and what it rests on.
pub fn report(names: Names<'_>, report: &Report) -> String {
    let mut text = String::new();
    _ = writeln!(
        text,
        "{}: {} and {}, profile {}, {} compared",
        json::verdict(&report.verdict),
        names.a,
        names.b,
        report.profile.name(),
        counted(report.compared_steps, if report.profile == Profile::Statistics { "state" } else { "step" })
    );
    settings(&mut text, report);
    if let Some(t) = report.by_time_from {
        _ = writeln!(text, "the steps differ from t = {} s on: states are compared by time, interpolated", short(t));
    }
    if let Some(first) = &report.first {
        let place = if first.channel.is_empty() { String::new() } else { format!(", {}", first.channel) };
        _ = writeln!(text, "first difference at {}{place}: {}", first.place(), first.what);
    }
    if let Some(cause) = &report.cause {
        _ = writeln!(text, "just before the states part: {cause}");
    }
    for found in &report.structure {
        let channel = if found.channel.is_empty() { "steps" } else { &found.channel };
        let times = counted(found.count, "time");
        _ = writeln!(
            text,
            "{channel}: {} ({times}, first at t = {} s, step {})",
            found.what,
            short(found.t),
            found.step
        );
    }
    fields(&mut text, report);
    if let Some(growth) = report.growth {
        let (from, to) = growth.span;
        let (rate, error) = (short(growth.rate), short(growth.error));
        _ = writeln!(text, "the runs part at {rate} ± {error} per second from t = {} to {} s", short(from), short(to));
    }
    curves(&mut text, report);
    for what in &report.not_compared {
        _ = writeln!(text, "not compared: {what}");
    }
    if !report.drawn.is_empty() {
        _ = writeln!(text, "not compared, for they are drawn from the states: {}", report.drawn.join(", "));
    }
    if !report.ignored.is_empty() {
        _ = writeln!(text, "ignored by name: {}", report.ignored.join(", "));
    }
    if report.damaged() && report.verdict == Verdict::Same {
        text += "what could be read is the same, but a part of the logs is lost\n";
    }
    text
}

fn settings(text: &mut String, report: &Report) {
    for setting in report.settings.iter().take(SETTINGS) {
        let (a, b) = (setting_text(&setting.a), setting_text(&setting.b));
        _ = writeln!(text, "setting {}: {a} and {b} ({})", setting.name, setting.kind.name());
    }
    if report.settings.len() > SETTINGS {
        _ = writeln!(text, "{} more settings differ", report.settings.len() - SETTINGS);
    }
}

fn fields(text: &mut String, report: &Report) {
    let mut differing: Vec<_> = report.fields.iter().filter(|field| field.at.is_some() || !field.passed).collect();
    if differing.is_empty() {
        return;
    }
    differing.sort_by_key(|field| field.passed);
    let exact = report.profile == Profile::Exact;
    _ = writeln!(text, "{:<34} {:>10} {:>10} {:>10} {:>9}  at", "field", "max |a-b|", "relative", "rms", "ulp");
    for field in differing.iter().take(SHOWN) {
        let ulp = field.max_ulp.map_or_else(|| "-".to_owned(), |ulp| short(ulp as f64));
        let place = field.at.map_or_else(String::new, |(t, _, index)| {
            let whose = if field.is_particle() { format!(", particle {index}") } else { String::new() };
            format!("t = {} s{whose}", short(t))
        });
        let mark = if exact || field.passed { "" } else { "  beyond its tolerance" };
        let name = format!("{}.{}", field.channel, field.field);
        let (abs, rel, rms) = (short(field.max_abs), short(field.max_rel), short(field.rms()));
        _ = writeln!(text, "{name:<34} {abs:>10} {rel:>10} {rms:>10} {ulp:>9}  {place}{mark}");
    }
    if differing.len() > SHOWN {
        _ = writeln!(text, "{} more fields differ; --json lists all", differing.len() - SHOWN);
    }
}

fn curves(text: &mut String, report: &Report) {
    let Some(statistics) = &report.statistics else { return };
    match statistics.significance {
        Some(significance) => {
            _ = writeln!(
                text,
                "judged against {} references; a run in which nothing differs fails with a chance of {significance}",
                statistics.references
            );
        }
        None => {
            text.push_str(
                "judged against one run, within plain tolerances on its curves: with --ensemble it would be judged at a \
                 stated significance\n",
            );
        }
    }
    _ = writeln!(
        text,
        "{:<22} {:>19} {:>11} {:>11} {:>11} {:>11}",
        "curve", "from to [s]", "value", "expected", "allowed ±", "probability"
    );
    let beyond = statistics.judgements.iter().filter(|judgement| !judgement.passed).count();
    for judgement in statistics.judgements.iter().take(SHOWN.min(beyond.max(3))) {
        let span = format!("{} {}", short(judgement.span.0), short(judgement.span.1));
        let probability = judgement.probability.map_or_else(|| "-".to_owned(), short);
        let mark = if judgement.passed { "" } else { "  outside" };
        let (value, mean, allowed) = (short(judgement.value), short(judgement.mean), short(judgement.allowed));
        _ = writeln!(
            text,
            "{:<22} {span:>19} {value:>11} {mean:>11} {allowed:>11} {probability:>11}{mark}",
            judgement.curve
        );
    }
    if beyond > SHOWN {
        _ = writeln!(text, "{} more are outside; --json lists all", beyond - SHOWN);
    }
}
