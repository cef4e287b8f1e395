//! The page's tables.

use std::collections::BTreeMap;

use super::plan::{Binding, FIRST_STEP, FIXED_STEPS, GAMMAS, KAPPAS, PAPER_STEPS, Results, Setup, TYPICAL};
use super::template::table;
use crate::run::Run;
use crate::statistics::{Estimate, median, range};

/// Tables I and II of the paper: steps and fixed-point iterations by kappa.
pub const PAPER: [(Binding, [(u64, u64); 4]); 2] = [
    (Binding::Free, [(5000, 5037), (5000, 5038), (5000, 5037), (5000, 5032)]),
    (Binding::Bound, [(586, 1735), (585, 1798), (548, 5147), (601, 5565)]),
];

/// The paper's steps and iterations of one case; zeros if there is none.
#[must_use]
pub fn printed(binding: Binding, kappa: u32) -> (u64, u64) {
    PAPER
        .iter()
        .filter(|(known, _)| *known == binding)
        .flat_map(|(_, rows)| rows.iter().zip(KAPPAS))
        .find_map(|(row, known)| (known == kappa).then_some(*row))
        .unwrap_or_default()
}

/// Tables by the name of their gap.
pub fn values(results: &Results) -> BTreeMap<&'static str, String> {
    BTreeMap::from([
        ("table_1", counts(results, Binding::Free)),
        ("table_2", counts(results, Binding::Bound)),
        ("ends", ends(results)),
        ("heat", heat(results)),
        ("limit", limit(results)),
        ("damping", damping(results)),
        ("seeds", results.seeds().tables.to_string()),
        ("step_seeds", results.seeds().steps.to_string()),
    ])
}

/// Mean and standard error of something over runs.
pub fn estimate(runs: &[Run], quantity: impl Fn(&Run) -> f64) -> Estimate {
    Estimate::of(&runs.iter().map(quantity).collect::<Vec<_>>())
}

/// "mean ± standard error".
pub fn show(estimate: &Estimate, decimals: usize) -> String {
    format!("{:.decimals$} ± {:.decimals$}", estimate.mean, estimate.error)
}

/// "lowest–highest".
pub fn show_range(values: &[f64]) -> String {
    let (low, high) = range(values);
    if low == high { low.to_string() } else { format!("{low}–{high}") }
}

/// A time without the noise of binary fractions, "1e-3" style [s].
pub fn seconds(value: f64) -> String {
    format!("{value:e}")
}

/// Steps and iterations, ours beside the paper's.
fn counts(results: &Results, binding: Binding) -> String {
    let mut rows = Vec::new();
    for kappa in KAPPAS {
        let runs = results.table(binding, kappa);
        let (steps, iterations) = printed(binding, kappa);
        let mut row = vec![format!("{kappa}")];
        let ours = |count: fn(&Run) -> u64| -> Vec<f64> { runs.iter().map(|run| count(run) as f64).collect() };
        let counts = [(steps, ours(|run| run.counters.steps)), (iterations, ours(|run| run.counters.iterations))];
        for (printed, values) in counts {
            let first = values.first().map_or_else(String::new, ToString::to_string);
            row.extend([printed.to_string(), first, median(&values).to_string(), show_range(&values)]);
        }
        let rejected: u64 = runs.iter().map(|run| run.counters.rejected_steps).sum();
        let spent: u64 = runs.iter().map(|run| run.rejected_iterations).sum();
        row.push(format!("{rejected} ({spent})"));
        rows.push(row);
    }
    let head = [
        "κ [10⁶ J/m²]",
        "steps, paper",
        "seed 1",
        "median",
        "range",
        "iterations, paper",
        "seed 1",
        "median",
        "range",
        "rejected attempts (their iterations), all seeds",
    ];
    table(&head, &rows)
}

/// The clouds after 5 s.
fn ends(results: &Results) -> String {
    let mut rows = Vec::new();
    for (binding, name) in [(Binding::Free, "without"), (Binding::Bound, "with")] {
        for kappa in KAPPAS {
            let runs = results.table(binding, kappa);
            rows.push(vec![
                name.to_owned(),
                format!("{kappa}"),
                show(&estimate(runs, Run::final_kinetic), 3),
                show(&estimate(runs, Run::final_temperature), 1),
                show(&estimate(runs, |run| run.hottest), 0),
                show(&estimate(runs, |run| f64::from(run.clusters.as_ref().map_or(0, |clusters| clusters.count))), 1),
                show(&estimate(runs, |run| f64::from(run.clusters.as_ref().map_or(0, |clusters| clusters.largest))), 1),
                show(&estimate(runs, |run| run.lost), 3),
                show(&estimate(runs, |run| run.residual), 3),
            ]);
        }
    }
    let head = [
        "binding",
        "κ [10⁶ J/m²]",
        "kinetic energy / mass [J/kg]",
        "mean temperature [K]",
        "hottest particle at any time [K]",
        "clusters",
        "largest cluster",
        "lost in impacts / mass [J/kg]",
        "energy residual / mass [J/kg]",
    ];
    table(&head, &rows)
}

/// Setups of the reaction heat's dependence on step and impact duration.
fn heat_setups() -> Vec<Setup> {
    let mut setups = Vec::new();
    for binding in [Binding::Free, Binding::Bound] {
        if binding == Binding::Bound {
            setups.extend(GAMMAS.map(|gamma| Setup::table(binding, TYPICAL).with_gamma(gamma)));
        }
        setups.extend(GAMMAS.map(|gamma| Setup::at_step(binding, FIRST_STEP).with_gamma(gamma)));
        setups.push(Setup::at_step(binding, PAPER_STEPS[PAPER_STEPS.len() - 1]));
    }
    setups
}

fn heat(results: &Results) -> String {
    let rows: Vec<Vec<String>> = heat_setups()
        .into_iter()
        .map(|setup| {
            let runs = results.compared(&setup);
            vec![
                if setup.binding == Binding::Bound { "with" } else { "without" }.to_owned(),
                seconds(setup.steps.1),
                setup.gamma.to_string(),
                show(&estimate(runs, Run::final_temperature), 0),
                show(&estimate(runs, Run::final_kinetic), 3),
                show(&estimate(runs, |run| run.counters.impacts as f64), 0),
                show(&estimate(runs, |run| 1e3 * run.counters.max_overlap), 1),
            ]
        })
        .collect();
    let head = [
        "binding",
        "largest step [s]",
        "γ",
        "mean temperature [K]",
        "kinetic energy / mass [J/kg]",
        "contacts summed over steps",
        "deepest overlap [mm]",
    ];
    table(&head, &rows)
}

/// `consistent` at three fixed steps.
fn limit(results: &Results) -> String {
    let mut rows = Vec::new();
    for kappa in KAPPAS {
        for step in FIXED_STEPS {
            let runs = results.of(&Setup::consistent(kappa, step));
            let residual = runs.iter().map(|run| run.residual.abs()).fold(0.0, f64::max);
            rows.push(vec![
                format!("{kappa}"),
                seconds(step),
                show(&estimate(runs, Run::final_kinetic), 3),
                show(&estimate(runs, Run::final_temperature), 1),
                show(&estimate(runs, |run| run.counters.impacts as f64), 1),
                format!("{residual:.1e}"),
                show(&estimate(runs, |run| 1e3 * run.counters.max_overlap), 2),
            ]);
        }
    }
    let head = [
        "κ [10⁶ J/m²]",
        "Δt [s]",
        "kinetic energy / mass [J/kg]",
        "mean temperature [K]",
        "impacts",
        "largest energy residual / mass [J/kg]",
        "deepest overlap [mm]",
    ];
    table(&head, &rows)
}

/// `paper` without binding at three steps.
fn damping(results: &Results) -> String {
    let rows: Vec<Vec<String>> = PAPER_STEPS
        .into_iter()
        .map(|step| {
            let runs = results.compared(&Setup::at_step(Binding::Free, step));
            vec![
                seconds(step),
                show(&estimate(runs, Run::final_kinetic), 3),
                show(&estimate(runs, |run| run.residual), 3),
                show(&estimate(runs, Run::final_temperature), 1),
            ]
        })
        .collect();
    table(&["Δt [s]", "kinetic energy / mass [J/kg]", "energy residual / mass [J/kg]", "mean temperature [K]"], &rows)
}
