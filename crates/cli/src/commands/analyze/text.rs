//! An analysis as a page for people.

use std::fmt::Write;

use agglo_replay::analysis::{Analysis, CAUSES, Label, Spread, StateRow, Term};

use agglo_replay::text::line;

use crate::args::AnalyzeArgs;
use crate::numbers::{counted, short};

/// The page.
pub fn text(args: &AnalyzeArgs, analysis: &Analysis) -> String {
    let mut text = String::new();
    facts(args, analysis, &mut text);
    ledger(analysis, &mut text);
    verdict(analysis, &mut text);
    text
}

fn facts(args: &AnalyzeArgs, analysis: &Analysis, text: &mut String) {
    let mut row = |name: &str, value: String| _ = writeln!(text, "{name:<12} {}", line(&value));
    let run = &analysis.run;
    let lost = analysis.lost.damage.len() + analysis.lost.gaps.len();
    let state = if lost > 0 { format!(", damaged in {}", counted(lost as u64, "place")) } else { String::new() };
    row("log", format!("{}{state}", args.log.display()));
    let name = if run.scene_name.is_empty() { "without a name" } else { &run.scene_name };
    let particles = counted(run.particles, "particle");
    row("scene", format!("{name}, model {}, seed {}, {particles}", run.model, run.seed));
    let (_, t) = analysis.end;
    let found = &analysis.iterations;
    let mut states = counted(analysis.recorded_states, "recorded state");
    if analysis.states != analysis.recorded_states {
        _ = write!(states, ", {} analysed", analysis.states);
    }
    row(
        "time",
        format!("0 to {} s of {} s, {}, {states}", short(t), short(analysis.duration), counted(found.steps, "step")),
    );
    if found.steps > 0 {
        let (total, mean) = (counted(found.total, "iteration"), short(found.mean()));
        row("iterations", format!("{total}, {mean} a step, {} at most", found.max));
        row("step size", format!("{} s", range(&found.step_size)));
        let causes = CAUSES.iter().zip(found.rejected).filter(|(_, count)| *count > 0);
        let causes: Vec<String> = causes.map(|(cause, count)| format!("{count} {}", cause.replace('_', " "))).collect();
        let causes = if causes.is_empty() { String::new() } else { format!(": {}", causes.join(", ")) };
        row("rejected", format!("{}{causes}", counted(found.rejected_total(), "attempt")));
        if found.contraction.count > 0 {
            row("contraction", range(&found.contraction));
        }
    }
    if run.terms.iter().any(|term| term == "contact") {
        row("impacts", analysis.impacts.to_string());
    }
    let (Some(first), Some(last)) = (&analysis.first, &analysis.last) else { return };
    if let (Some(from), Some(to)) = (&first.temperature, &last.temperature) {
        let highest = analysis.curves.max_temperature.spans().iter().map(|span| span.high.1).fold(to.max, f64::max);
        row(
            "temperature",
            format!("mean {} K, then {} K; {} K at most", short(from.mean), short(to.mean), short(highest)),
        );
    }
    if let (Some(counts), Some(found)) = (&analysis.clusters, &last.clusters) {
        let clusters = counted(found.count.into(), "cluster");
        let size = if found.count > 0 {
            let (mean, largest) = (short(found.mean_size), found.largest);
            format!(" of {mean} in the mean, the largest of {largest}")
        } else {
            String::new()
        };
        row("clusters", format!("at the end {clusters}{size}, {} alone", found.singletons));
        let (mergers, break_ups) = (counted(counts.mergers, "merger"), counted(counts.break_ups, "break-up"));
        let mut events = format!("{} formed, {mergers}, {break_ups}, {} dispersed", counts.formed, counts.dispersed);
        if let Some(mean) = counts.mean_lifetime() {
            _ = write!(events, "; {} s in the mean until they ended", short(mean));
        }
        row("", events);
    }
}

/// Least to greatest, and mean.
fn range(spread: &Spread) -> String {
    format!("{} to {}, mean {}", short(spread.min), short(spread.max), short(spread.mean()))
}

/// The ledger at the first and last state: the terms that the scene has.
fn ledger(analysis: &Analysis, text: &mut String) {
    let (Some(first), Some(last)) = (&analysis.first, &analysis.last) else {
        _ = writeln!(text, "\nno state is whole");
        return;
    };
    let from = format!("t = {} s", short(first.t));
    let to = format!("t = {} s", short(last.t));
    _ = writeln!(
        text,
        "\n{:<20} {from:>14} {to:>14}  {:<13} {:>12} {:>10}",
        "energy [J]", "value is", "differs by", "allowed"
    );
    for (term, found) in analysis.agreement.terms() {
        let value = |state: &StateRow| state.value(term);
        let (Some(a), Some(b)) = (value(first), value(last)) else { continue };
        let nothing = a == 0.0 && b == 0.0 && found.largest.is_none_or(|d| d.recorded == 0.0 && d.recomputed == 0.0);
        if nothing && term != Term::Residual {
            continue;
        }
        let name = term.name().replace('_', " ");
        let (difference, allowed) = match &found.largest {
            Some(d) => (short(d.size()), short(d.tolerance)),
            None => ("-".to_owned(), "-".to_owned()),
        };
        let mark = if found.agrees() == Some(false) { "  disagrees" } else { "" };
        let label = found.label.text();
        let (a, b) = (short(a), short(b));
        _ = writeln!(text, "{name:<20} {a:>14} {b:>14}  {label:<13} {difference:>12} {allowed:>10}{mark}");
    }
}

fn verdict(analysis: &Analysis, text: &mut String) {
    let terms: Vec<_> = analysis.agreement.terms().collect();
    let compared: u64 = terms.iter().map(|(_, found)| found.compared).sum();
    let wrong: Vec<_> =
        terms.iter().filter(|(_, found)| found.agrees() == Some(false)).map(|(term, _)| term.name()).collect();
    let verdict = if compared == 0 {
        "nothing in the log could be compared".to_owned()
    } else if wrong.is_empty() {
        format!("the log agrees with itself in all {} that were compared", counted(compared, "value"))
    } else {
        format!("the log contradicts itself in: {}", wrong.join(", "))
    };
    _ = writeln!(text, "\n{verdict}");
    if terms.iter().any(|(_, found)| found.label == Label::Quadrature) {
        _ = writeln!(text, "quadrature: a sum over recorded states, compared within the error that it may have");
    }
}
