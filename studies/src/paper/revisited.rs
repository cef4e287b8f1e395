//! The paper's cases solved by `consistent`: what of its findings is left where the step goes to zero.

use std::collections::BTreeMap;

use super::claims::{SEEN, START, Verdict};
use super::curves::{Curves, Quantity};
use super::plan::{Binding, FIRST_STEP, FIXED_STEPS, KAPPAS, PAPER_STEPS, Results, Setup, TYPICAL};
use super::tables::{estimate, seconds, show};
use super::template::table;
use crate::run::Run;
use crate::statistics::{Estimate, root_mean_square};

/// Both cases, and what the page calls them.
const BINDINGS: [(Binding, &str); 2] = [(Binding::Free, "without"), (Binding::Bound, "with")];
/// The finest step [s].
const FINEST: f64 = FIXED_STEPS[FIXED_STEPS.len() - 1];
/// The step above it [s].
const SECOND: f64 = FIXED_STEPS[FIXED_STEPS.len() - 2];

/// A quantity of a run, its heading, and its decimals.
type Measured = (&'static str, fn(&Run) -> f64, usize);

/// What steps are compared by.
const MEASURED: [Measured; 6] = [
    ("kinetic energy / mass [J/kg]", Run::final_kinetic, 3),
    ("mean temperature [K]", Run::final_temperature, 1),
    ("reaction heat / mass [J/kg]", |run| run.reaction_heat, 0),
    ("largest cluster", Run::largest_cluster, 1),
    ("lost in impacts / mass [J/kg]", |run| run.lost, 3),
    ("impacts", |run| run.counters.impacts as f64, 0),
];

/// Texts and tables by the name of their gap.
pub fn values(results: &Results) -> BTreeMap<&'static str, String> {
    let (apart, what) = largest_distance(results);
    let residuals = |binding| FIXED_STEPS.map(|step| residual(results, binding, step));
    let (free, bound) = (residuals(Binding::Free), residuals(Binding::Bound));
    let order = |residuals: [f64; 3]| format!("{:.1}", (residuals[0] / residuals[2]).log(FIXED_STEPS[0] / FINEST));
    let ours = finest(results, Binding::Free, Run::final_kinetic);
    let paper = |step| estimate(results.compared(&Setup::at_step(Binding::Free, step)), Run::final_kinetic);
    let nearest = paper(PAPER_STEPS[PAPER_STEPS.len() - 1]);
    BTreeMap::from([
        ("consistent", cases(results)),
        ("paired", differences(results)),
        ("findings", findings(results)),
        ("heat_free", heat(results, Binding::Free)),
        ("heat_bound", heat(results, Binding::Bound)),
        ("finest", seconds(FINEST)),
        ("second", seconds(SECOND)),
        ("largest_distance", format!("{apart:.1} standard errors ({what})")),
        (
            "limit_verdict",
            if apart <= SEEN {
                "so no dependence on the step is seen in these statistics"
            } else {
                "so this one still depends on the step"
            }
            .to_owned(),
        ),
        ("residual_free", format!("{:.1e}", free[2])),
        ("residual_bound", format!("{:.1e}", bound[2])),
        ("order_free", order(free)),
        ("order_bound", order(bound)),
        ("consistent_kinetic", show(&ours, 3)),
        ("paper_kinetic", show(&paper(FIRST_STEP), 3)),
        ("paper_kinetic_fine", show(&nearest, 3)),
        ("meet", if nearest.distance(&ours) <= SEEN { "agrees with" } else { "is still apart from" }.to_owned()),
    ])
}

/// Runs of one case at one step, by seed.
fn runs(results: &Results, binding: Binding, kappa: u32, step: f64) -> &[Run] {
    results.of(&Setup::consistent(binding, kappa, step))
}

/// The typical case at the finest step.
fn finest(results: &Results, binding: Binding, quantity: impl Fn(&Run) -> f64) -> Estimate {
    estimate(runs(results, binding, TYPICAL, FINEST), quantity)
}

/// Root mean square of the energy residuals of all kappa [J/kg].
fn residual(results: &Results, binding: Binding, step: f64) -> f64 {
    let runs = KAPPAS.iter().flat_map(|&kappa| runs(results, binding, kappa, step));
    root_mean_square(&runs.map(|run| run.residual).collect::<Vec<_>>())
}

/// All cases at all steps.
fn cases(results: &Results) -> String {
    let mut rows = Vec::new();
    for (binding, name) in BINDINGS {
        for kappa in KAPPAS {
            for step in FIXED_STEPS {
                let runs = runs(results, binding, kappa, step);
                let largest = runs.iter().map(|run| run.residual.abs()).fold(0.0, f64::max);
                let mut row = vec![name.to_owned(), kappa.to_string(), seconds(step)];
                row.extend(MEASURED.map(|(_, quantity, decimals)| show(&estimate(runs, quantity), decimals)));
                row.push(show(&estimate(runs, |run| run.hottest), 0));
                row.push(format!("{largest:.1e}"));
                rows.push(row);
            }
        }
    }
    let mut head = vec!["binding", "κ [10⁶ J/m²]", "Δt [s]"];
    head.extend(MEASURED.map(|(name, ..)| name));
    head.extend(["hottest particle at any time [K]", "largest energy residual / mass [J/kg]"]);
    table(&head, &rows)
}

/// Over seeds, the mean over kappa of a quantity at one step less the same at the finest step.
fn paired(results: &Results, binding: Binding, step: f64, quantity: fn(&Run) -> f64) -> Estimate {
    let differences = (0..results.seeds().consistent as usize).map(|seed| {
        let mean = |step| {
            let of_kappa = KAPPAS.iter().filter_map(|&kappa| runs(results, binding, kappa, step).get(seed));
            Estimate::of(&of_kappa.map(quantity).collect::<Vec<_>>()).mean
        };
        mean(step) - mean(FINEST)
    });
    Estimate::of(&differences.collect::<Vec<_>>())
}

/// Differences between steps.
fn differences(results: &Results) -> String {
    let mut rows = Vec::new();
    for (binding, name) in BINDINGS {
        for &step in &FIXED_STEPS[..FIXED_STEPS.len() - 1] {
            let mut row = vec![name.to_owned(), seconds(step)];
            row.extend(
                MEASURED.map(|(_, quantity, decimals)| show(&paired(results, binding, step, quantity), decimals)),
            );
            rows.push(row);
        }
    }
    let mut head = vec!["binding", "Δt [s]"];
    head.extend(MEASURED.map(|(name, ..)| name));
    table(&head, &rows)
}

/// The largest difference between the two finer steps in standard errors, and of what it is.
fn largest_distance(results: &Results) -> (f64, String) {
    let mut largest = (0.0, String::new());
    for (binding, name) in BINDINGS {
        for (what, quantity, _) in MEASURED {
            let difference = paired(results, binding, SECOND, quantity);
            let apart = difference.mean.abs() / difference.error;
            if apart > largest.0 {
                largest = (apart, format!("{what} {name} binding"));
            }
        }
    }
    largest
}

/// How far the reaction heats of the two finer steps are apart.
fn heat(results: &Results, binding: Binding) -> String {
    let apart = paired(results, binding, SECOND, |run| run.reaction_heat);
    format!("{} J/kg, {:.1} standard errors,", show(&apart, 0), apart.mean.abs() / apart.error)
}

/// Spread of the kinetic energy per mass between the kappas for the same seed [J/kg], and over the kinetic energy [%].
fn spread(results: &Results, binding: Binding) -> (Estimate, f64) {
    let curves = Curves::of(Quantity::Kinetic, |kappa| runs(results, binding, kappa, FINEST));
    let spread = Estimate::of(&curves.spreads());
    (spread, 100.0 * spread.mean / root_mean_square(&curves.by_kappa.concat().concat()))
}

/// The paper's findings as a table.
fn findings(results: &Results) -> String {
    let rows: Vec<Vec<String>> = [clustering(results), heating(results), colours(results), dynamics(results)]
        .into_iter()
        .chain([marginal(results), motion(results, Binding::Free), motion(results, Binding::Bound)])
        .map(|(finding, ours, verdict)| vec![finding.to_owned(), ours, verdict.word().to_owned()])
        .collect();
    table(&["the paper finds", "`consistent`, at its finest step", "survives"], &rows).replace("---:", ":---")
}

type Finding = (&'static str, String, Verdict);

fn clustering(results: &Results) -> Finding {
    let [free, bound] = BINDINGS.map(|(binding, _)| finest(results, binding, Run::largest_cluster));
    (
        "With binding the cloud forms clusters",
        format!("largest cluster at 5 s {} of 100 particles with binding, {} without", show(&bound, 1), show(&free, 1)),
        Verdict::of(bound.mean > free.mean && free.distance(&bound) > SEEN),
    )
}

fn heating(results: &Results) -> Finding {
    let [free, bound] = BINDINGS.map(|(binding, _)| finest(results, binding, |run| run.final_temperature() - START));
    (
        "With clustering the temperature rises substantially",
        format!("κ = 2·10⁶: by {} K with binding, {} K without", show(&bound, 0), show(&free, 1)),
        Verdict::of(bound.mean > 2.0 * free.mean && free.distance(&bound) > SEEN),
    )
}

fn colours(results: &Results) -> Finding {
    let [free, bound] = BINDINGS.map(|(binding, _)| finest(results, binding, |run| run.hottest));
    let fits = |hottest: &Estimate| (350.0..450.0).contains(&hottest.mean);
    let verdict = match (fits(&free), fits(&bound)) {
        (true, true) => Verdict::Yes,
        (false, false) => Verdict::No,
        _ => Verdict::Partly,
    };
    let ours = format!("κ = 2·10⁶: hottest particle {} K without binding, {} K with", show(&free, 0), show(&bound, 0));
    ("Temperatures from 300 to 400 K, with and without binding", ours, verdict)
}

fn dynamics(results: &Results) -> Finding {
    let [(free, _), (bound, _)] = BINDINGS.map(|(binding, _)| spread(results, binding));
    (
        "Group dynamics for different κ deviate much more without binding",
        format!(
            "spread of kinetic energy / mass between the κ {} J/kg without, {} with",
            show(&free, 4),
            show(&bound, 4)
        ),
        Verdict::of(free.mean > 2.0 * bound.mean && free.distance(&bound) > SEEN),
    )
}

fn marginal(results: &Results) -> Finding {
    let (_, percent) = spread(results, Binding::Bound);
    let end = |kappa| estimate(runs(results, Binding::Bound, kappa, FINEST), Run::final_kinetic);
    let (low, high) = (end(KAPPAS[0]), end(KAPPAS[KAPPAS.len() - 1]));
    let ours = format!(
        "with binding that spread is {percent:.1} % of the kinetic energy, which ends at {} J/kg for κ = 10⁶ and {} for 8·10⁶",
        show(&low, 3),
        show(&high, 3)
    );
    ("Under clustering κ hardly changes the motion", ours, Verdict::of(percent < 2.0 && low.distance(&high) <= SEEN))
}

/// Kinetic energy at the end, against the paper's scheme at the paper's steps.
fn motion(results: &Results, binding: Binding) -> Finding {
    let ours = finest(results, binding, Run::final_kinetic);
    let paper = estimate(results.table(binding, TYPICAL), Run::final_kinetic);
    let finding = match binding {
        Binding::Free => "The kinetic energy without binding after 5 s, by the paper's scheme and step",
        Binding::Bound => "The kinetic energy with binding after 5 s, by the paper's scheme and step",
    };
    let text = format!("{} J/kg; the paper's scheme {} J/kg", show(&ours, 3), show(&paper, 3));
    (finding, text, Verdict::of(ours.distance(&paper) <= SEEN))
}
