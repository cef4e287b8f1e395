//! An analysis as one HTML page: charts, scene, the ledger's closure, iterations. Nothing is fetched, nothing runs, and
//! every text from the log is escaped.

use minijinja::value::Serde;
use minijinja::{AutoEscape, Environment};
use serde::Serialize;

use super::agreement::{Comparison, Difference, Term};
use super::iterations::CAUSES;
use super::{Analysis, StateRow, chart};
use crate::text::{line, printable};

const TEMPLATE: &str = include_str!("report.html");
/// Longest scene that is printed [bytes]; particle lists can be long.
const LONGEST_SCENE: usize = 200_000;

/// A report that could not be made.
#[derive(Debug)]
pub struct ReportError(String);

impl std::fmt::Display for ReportError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the report cannot be drawn: {}", self.0)
    }
}

impl std::error::Error for ReportError {}

#[derive(Serialize)]
struct Page {
    title: String,
    description: String,
    facts: Vec<(&'static str, String)>,
    verdict: String,
    agrees: bool,
    losses: Vec<String>,
    pictures: Vec<Picture>,
    ledger: Vec<Row>,
    others: Vec<Row>,
    iterations: Vec<(String, String)>,
    histogram: Vec<Bar>,
    clusters: Vec<(&'static str, String)>,
    scene: String,
    scene_cut: bool,
}

#[derive(Serialize)]
struct Picture {
    name: &'static str,
    svg: String,
}

/// A quantity: values at the first and last state, and how it compares.
#[derive(Serialize)]
struct Row {
    name: &'static str,
    unit: &'static str,
    label: &'static str,
    first: String,
    last: String,
    difference: String,
    tolerance: String,
    verdict: &'static str,
    bad: bool,
    note: String,
}

/// A row of the histogram.
#[derive(Serialize)]
struct Bar {
    iterations: String,
    steps: u64,
    percent: f64,
}

/// The page; `file` is the log's name.
///
/// # Errors
/// A drawing that fails.
pub fn html(analysis: &Analysis, file: &str) -> Result<String, ReportError> {
    let failed = |error: &dyn std::fmt::Display| ReportError(error.to_string());
    let mut environment = Environment::new();
    environment.set_auto_escape_callback(|_| AutoEscape::Html);
    environment.add_template("report.html", TEMPLATE).map_err(|e| failed(&e))?;
    let pictures = chart::pictures(analysis).map_err(|e| failed(&e))?;
    let template = environment.get_template("report.html").map_err(|e| failed(&e))?;
    template.render(Serde(page(analysis, file, pictures))).map_err(|e| failed(&e))
}

fn page(analysis: &Analysis, file: &str, pictures: Vec<(&'static str, String)>) -> Page {
    let run = &analysis.run;
    let scene: serde_json::Value = serde_json::from_str(&analysis.scene).unwrap_or_default();
    let mut text = format!("{scene:#}");
    let scene_cut = text.len() > LONGEST_SCENE;
    if scene_cut {
        let end = (0..=LONGEST_SCENE).rev().find(|&k| text.is_char_boundary(k)).unwrap_or(0);
        text.truncate(end);
    }
    let terms = |ledger: bool| {
        let wanted = move |term: &Term| (term.channel() == "/energy") == ledger;
        analysis.agreement.terms().filter(move |(term, _)| wanted(term))
    };
    let agrees = analysis.agreement.agrees();
    let name = if run.scene_name.is_empty() { "a scene without a name" } else { &run.scene_name };
    Page {
        title: line(name),
        description: printable(scene["description"].as_str().unwrap_or_default()),
        facts: facts(analysis, file),
        verdict: if agrees {
            "The log agrees with itself: what was recomputed is what was recorded, within round-off.".to_owned()
        } else {
            "The log contradicts itself: what was recomputed is not what was recorded, see below.".to_owned()
        },
        agrees,
        losses: losses(analysis),
        pictures: pictures.into_iter().map(|(name, svg)| Picture { name, svg }).collect(),
        ledger: terms(true).map(|(term, found)| row(analysis, term, found)).collect(),
        others: terms(false)
            .filter(|(_, found)| found.compared > 0)
            .map(|(t, found)| row(analysis, t, found))
            .collect(),
        iterations: iterations(analysis),
        histogram: histogram(analysis),
        clusters: clusters(analysis),
        scene: printable(&text),
        scene_cut,
    }
}

fn facts(analysis: &Analysis, file: &str) -> Vec<(&'static str, String)> {
    let run = &analysis.run;
    let (step, t) = analysis.end;
    vec![
        ("log", line(file)),
        ("scene", line(&format!("hash {}", run.scene_hash))),
        ("run", line(&format!("model {}, seed {}, {} particles", run.model, run.seed, run.particles))),
        ("terms", line(&run.terms.join(", "))),
        ("time", format!("0 to {} s of {} s, {step} steps", short(t), short(analysis.duration))),
        ("states", format!("{} recorded, {} analysed", analysis.recorded_states, analysis.states)),
        ("impacts", analysis.impacts.to_string()),
        ("recorded by", line(&format!("agglo {} (commit {})", run.build.version, run.build.commit))),
    ]
}

fn losses(analysis: &Analysis) -> Vec<String> {
    const SHOWN: usize = 20;
    let lost = &analysis.lost;
    let all = lost.damage.iter().map(|lost| line(&lost.to_string())).chain(lost.gaps.iter().map(|gap| line(gap)));
    let mut shown: Vec<String> = all.take(SHOWN).collect();
    let total = (lost.damage.len() + lost.gaps.len()) as u64 + lost.more + lost.more_gaps;
    if total > SHOWN as u64 {
        shown.push(format!("and {} more", total - SHOWN as u64));
    }
    shown
}

fn row(analysis: &Analysis, term: Term, found: &Comparison) -> Row {
    let at = |state: &Option<StateRow>| {
        let value = state.as_ref().and_then(|state| state.value(term));
        value.map_or_else(|| "–".to_owned(), short)
    };
    let of =
        |number: fn(&Difference) -> f64| found.largest.as_ref().map_or_else(|| "–".to_owned(), |d| short(number(d)));
    Row {
        name: term.name(),
        unit: term.unit(),
        label: found.label.text(),
        first: at(&analysis.first),
        last: at(&analysis.last),
        difference: of(Difference::size),
        tolerance: of(|difference| difference.tolerance),
        verdict: match found.agrees() {
            Some(true) => "agrees",
            Some(false) => "disagrees",
            None => "not compared",
        },
        bad: found.agrees() == Some(false),
        note: found.first.as_ref().map_or_else(String::new, |d| {
            let place = format!("first at t = {} s, step {}", d.t, d.step);
            format!("{place}: recorded {:?}, recomputed {:?}", d.recorded, d.recomputed)
        }),
    }
}

fn iterations(analysis: &Analysis) -> Vec<(String, String)> {
    let found = &analysis.iterations;
    if found.steps == 0 {
        return Vec::new();
    }
    let size = &found.step_size;
    let mut rows = vec![
        ("steps".to_owned(), found.steps.to_string()),
        ("iterations".to_owned(), format!("{}, {} a step, {} at most", found.total, short(found.mean()), found.max)),
        (
            "step size [s]".to_owned(),
            format!("{} to {}, mean {}", short(size.min), short(size.max), short(size.mean())),
        ),
        ("rejected attempts".to_owned(), found.rejected_total().to_string()),
    ];
    for (cause, count) in CAUSES.iter().zip(found.rejected).filter(|(_, count)| *count > 0) {
        rows.push((format!("– {}", cause.replace('_', " ")), count.to_string()));
    }
    let contraction = &found.contraction;
    if contraction.count > 0 {
        let (mean, max) = (short(contraction.mean()), short(contraction.max));
        rows.push(("contraction ε_K/ε_(K−1)".to_owned(), format!("mean {mean}, largest {max}")));
    }
    rows
}

fn histogram(analysis: &Analysis) -> Vec<Bar> {
    const BARS: usize = 30;
    let found = &analysis.iterations;
    let most = found.histogram.values().copied().max().unwrap_or(1).max(1) as f64;
    let bar = |iterations: String, steps: u64| Bar { iterations, steps, percent: 100.0 * steps as f64 / most };
    let mut bars: Vec<Bar> = found.histogram.iter().take(BARS).map(|(k, &steps)| bar(k.to_string(), steps)).collect();
    let rest: u64 = found.histogram.values().skip(BARS).sum();
    if rest > 0 {
        bars.push(bar("more".to_owned(), rest));
    }
    bars
}

fn clusters(analysis: &Analysis) -> Vec<(&'static str, String)> {
    let Some(counts) = &analysis.clusters else { return Vec::new() };
    let mut rows = Vec::new();
    if let Some(last) = analysis.last.as_ref().and_then(|state| state.clusters.as_ref()) {
        let (count, largest, alone) = (last.count, last.largest, last.singletons);
        rows.push(("at the end", format!("{count} clusters, the largest of {largest}, {alone} alone")));
        let sizes: Vec<String> = last.sizes.iter().map(|(size, count)| format!("{count} of {size}")).collect();
        rows.push(("sizes", sizes.join(", ")));
        let radii =
            format!("{} in the mean, {} of the largest", short(last.mean_gyration), short(last.gyration_of_largest));
        rows.push(("radius of gyration [m]", radii));
    }
    rows.push(("mergers, break-ups", format!("{}, {}", counts.mergers, counts.break_ups)));
    let (formed, dispersed, lasting) = (counts.formed, counts.dispersed, counts.lasting);
    rows.push(("formed, dispersed, lasting", format!("{formed}, {dispersed}, {lasting}")));
    if let Some(mean) = counts.mean_lifetime() {
        let text = format!("{} in the mean, {} at most, of those that ended", short(mean), short(counts.longest));
        rows.push(("lifetime [s]", text));
    }
    rows
}

/// Four significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}
