//! Numbers, and sentences that depend on numbers, for the page's text.

use std::collections::BTreeMap;

use super::claims::{SEEN, START, fits_scale, gamma_effect, spread};
use super::plan::{Binding, FIRST_STEP, FIXED_STEPS, GAMMA, GAMMAS, KAPPAS, PAPER_STEPS, Results, Setup, TYPICAL};
use super::tables::{estimate, printed, seconds, show};
use super::template::table;
use crate::run::Run;
use crate::statistics::{Estimate, median, root_mean_square};

/// Bound K_d on the iterations of a step in the paper.
const MOST_ITERATIONS: f64 = 100.0;

/// Texts by the name of their gap.
pub fn values(results: &Results) -> BTreeMap<&'static str, String> {
    let mut values = counts(results);
    values.extend(dynamics(results));
    values.extend(heat(results));
    values.extend(limit(results));
    values
}

fn counts(results: &Results) -> BTreeMap<&'static str, String> {
    let of =
        |binding| -> Vec<Run> { KAPPAS.iter().flat_map(|&kappa| results.table(binding, kappa)).cloned().collect() };
    let (free, bound) = (of(Binding::Free), of(Binding::Bound));
    let excess = estimate(&free, |run| (run.counters.iterations - run.counters.steps) as f64);
    let attempts = |kappa: u32| {
        let ours: Vec<f64> =
            results.table(Binding::Bound, kappa).iter().map(|run| run.counters.iterations as f64).collect();
        let (_, iterations) = printed(Binding::Bound, kappa);
        format!("{:.0}", (iterations as f64 - median(&ours)) / MOST_ITERATIONS)
    };
    let rejected: u64 = bound.iter().map(|run| run.counters.rejected_steps).sum();
    BTreeMap::from([
        ("free_excess", format!("{:.0}", excess.mean)),
        ("free_impacts", format!("{:.0}", estimate(&free, |run| run.counters.impacts as f64).mean)),
        ("attempts_4", attempts(KAPPAS[2])),
        ("attempts_8", attempts(KAPPAS[3])),
        (
            "rejected",
            match rejected {
                0 => format!("none of our {} runs with binding rejected an attempt", bound.len()),
                _ => format!("our {} runs with binding rejected {rejected} attempts together", bound.len()),
            },
        ),
        (
            "sweeps",
            format!("{:.1}", estimate(&bound, |run| run.counters.iterations as f64 / run.counters.steps as f64).mean),
        ),
    ])
}

fn dynamics(results: &Results) -> BTreeMap<&'static str, String> {
    let runs = |binding| KAPPAS.iter().flat_map(move |&kappa| results.table(binding, kappa));
    let mean = |binding, quantity: fn(&Run) -> f64| Estimate::of(&runs(binding).map(quantity).collect::<Vec<_>>()).mean;
    let percent = |binding| {
        let level = mean(binding, |run| root_mean_square(&run.kinetic));
        format!("{:.1} %", 100.0 * spread(results, binding).mean / level)
    };
    let relative = |binding| format!("{:.3}", mean(binding, |run| run.final_kinetic() - run.drift));
    // What left the motion is the sum of both; the residual is negative where the scheme damps.
    let damped = |binding| {
        let (lost, damped) = (mean(binding, |run| run.lost), -mean(binding, |run| run.residual));
        format!("{:.0} %", 100.0 * damped / (lost + damped))
    };
    let scale = |binding| if fits_scale(results, binding) { "fit the paper's colour scale" } else { "do not fit it" };
    let gamma_tenth = results.compared(&Setup::table(Binding::Bound, TYPICAL).with_gamma(GAMMAS[0]));
    BTreeMap::from([
        ("spread_free", show(&spread(results, Binding::Free), 4)),
        ("spread_bound", show(&spread(results, Binding::Bound), 4)),
        ("spread_free_percent", percent(Binding::Free)),
        ("spread_bound_percent", percent(Binding::Bound)),
        ("drift", format!("{:.3}", mean(Binding::Bound, |run| run.drift))),
        ("relative_free", relative(Binding::Free)),
        ("relative_bound", relative(Binding::Bound)),
        ("damped_free", damped(Binding::Free)),
        ("damped_bound", damped(Binding::Bound)),
        ("scale_free", scale(Binding::Free).to_owned()),
        ("scale_bound", scale(Binding::Bound).to_owned()),
        ("tenth_mean", show(&estimate(gamma_tenth, Run::final_temperature), 0)),
        ("tenth_hottest", show(&estimate(gamma_tenth, |run| run.hottest), 0)),
    ])
}

fn heat(results: &Results) -> BTreeMap<&'static str, String> {
    let rise = |setup: &Setup| estimate(results.compared(setup), |run| run.final_temperature() - START).mean;
    let typical = Setup::table(Binding::Bound, TYPICAL);
    let by_step = rise(&Setup::at_step(Binding::Bound, PAPER_STEPS[PAPER_STEPS.len() - 1])) / rise(&typical);
    let by_gamma = rise(&typical.with_gamma(GAMMAS[GAMMAS.len() - 1])) / rise(&typical.with_gamma(GAMMA));
    let free = gamma_effect(results, Binding::Free, Run::final_temperature);
    let motion = gamma_effect(results, Binding::Bound, Run::final_kinetic);
    let seen = |effect: &Estimate| {
        if effect.mean.abs() > SEEN * effect.error { "changes visibly" } else { "does not change visibly" }
    };
    BTreeMap::from([
        ("heat_by_step", format!("{by_step:.0}")),
        ("heat_verdict", if by_step > 2.0 { "has no limit" } else { "depends little on the step" }.to_owned()),
        ("heat_by_gamma", format!("{by_gamma:.1}")),
        (
            "gamma_verdict",
            if by_gamma > 1.5 { "does not hold for the heat of bound particles" } else { "holds" }.to_owned(),
        ),
        ("gamma_free", seen(&free).to_owned()),
        ("gamma_motion", seen(&motion).to_owned()),
    ])
}

/// Over seeds, the mean over kappa of a quantity at one step less the same at the finest step.
fn paired(results: &Results, step: f64, quantity: fn(&Run) -> f64) -> Estimate {
    let finest = FIXED_STEPS[FIXED_STEPS.len() - 1];
    let differences = (0..results.seeds().tables as usize).map(|seed| {
        let of = |step| -> Vec<f64> {
            KAPPAS.iter().filter_map(|&k| results.of(&Setup::consistent(k, step)).get(seed)).map(quantity).collect()
        };
        Estimate::of(&of(step)).mean - Estimate::of(&of(finest)).mean
    });
    Estimate::of(&differences.collect::<Vec<_>>())
}

fn limit(results: &Results) -> BTreeMap<&'static str, String> {
    let coarse = &FIXED_STEPS[..FIXED_STEPS.len() - 1];
    let finest = FIXED_STEPS[FIXED_STEPS.len() - 1];
    let quantities: [fn(&Run) -> f64; 3] =
        [Run::final_kinetic, Run::final_temperature, |run| run.counters.impacts as f64];
    let rows: Vec<Vec<String>> = coarse
        .iter()
        .map(|&step| {
            let [kinetic, temperature, impacts] = quantities.map(|quantity| paired(results, step, quantity));
            vec![seconds(step), show(&kinetic, 3), show(&temperature, 1), show(&impacts, 1)]
        })
        .collect();
    let largest = coarse
        .iter()
        .flat_map(|&step| quantities.map(|quantity| paired(results, step, quantity)))
        .map(|difference| difference.mean.abs() / difference.error)
        .fold(0.0, f64::max);
    let residuals: Vec<f64> = FIXED_STEPS
        .iter()
        .map(|&step| {
            let runs = KAPPAS.iter().flat_map(|&kappa| results.of(&Setup::consistent(kappa, step)));
            root_mean_square(&runs.map(|run| run.residual).collect::<Vec<_>>())
        })
        .collect();
    // Steps differ by a factor of four.
    let order = |k: usize| format!("{:.1}", (residuals[k] / residuals[k + 1]).log2() / 2.0);
    let typical = |setup: &Setup, quantity: fn(&Run) -> f64| estimate(results.compared(setup), quantity);
    let ours = typical(&Setup::consistent(TYPICAL, finest), Run::final_kinetic);
    let paper = |step| typical(&Setup::at_step(Binding::Free, step), Run::final_kinetic);
    let nearest = paper(PAPER_STEPS[PAPER_STEPS.len() - 1]);
    BTreeMap::from([
        ("paired", table(&["Δt [s]", "kinetic energy / mass [J/kg]", "mean temperature [K]", "impacts"], &rows)),
        ("largest_distance", format!("{largest:.1}")),
        (
            "limit_verdict",
            if largest <= SEEN {
                "so no dependence on the step is seen in these statistics"
            } else {
                "so some of these statistics still depend on the step"
            }
            .to_owned(),
        ),
        ("residual_coarse", format!("{:.1e}", residuals[0])),
        ("residual_fine", format!("{:.1e}", residuals[residuals.len() - 1])),
        ("order_coarse", order(0)),
        ("order_fine", order(1)),
        ("consistent_kinetic", show(&ours, 3)),
        ("paper_kinetic", show(&paper(FIRST_STEP), 3)),
        ("paper_kinetic_fine", show(&nearest, 3)),
        ("finest", seconds(finest)),
        ("meet", if nearest.distance(&ours) <= SEEN { "agrees with" } else { "is still apart from" }.to_owned()),
    ])
}
