//! Numbers, and sentences that depend on numbers, for the page's text.

use std::collections::BTreeMap;

use super::claims::{SEEN, START, fits_scale, gamma_effect, spread};
use super::plan::{Binding, GAMMA, GAMMAS, KAPPAS, PAPER_STEPS, Results, Setup, TYPICAL};
use super::tables::{estimate, printed, show};
use crate::run::Run;
use crate::statistics::{Estimate, median, root_mean_square};

/// Bound K_d on the iterations of a step in the paper.
const MOST_ITERATIONS: f64 = 100.0;

/// Texts by the name of their gap.
pub fn values(results: &Results) -> BTreeMap<&'static str, String> {
    let mut values = counts(results);
    values.extend(dynamics(results));
    values.extend(heat(results));
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
