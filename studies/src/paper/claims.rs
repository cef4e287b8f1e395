//! What the paper says of its results, what ours say, and whether the two agree: decided by the numbers.

use super::curves::{Curves, Quantity};
use super::plan::{Binding, FIRST_STEP, GAMMA, GAMMAS, KAPPAS, Results, Setup, TYPICAL};
use super::tables::{estimate, printed, show, show_range};
use super::template::table;
use crate::run::Run;
use crate::statistics::{Estimate, median};

/// Differences beyond so many standard errors count as seen: few seeds make the standard errors themselves uncertain.
pub const SEEN: f64 = 3.0;
/// Initial temperature [K].
pub const START: f64 = 300.0;

/// Whether a claim holds for our runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Yes,
    Partly,
    No,
}

impl Verdict {
    fn of(holds: bool) -> Self {
        if holds { Self::Yes } else { Self::No }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::Partly => "partly",
            Self::No => "**no**",
        }
    }
}

/// The claims as a table.
pub fn claims(results: &Results) -> String {
    let rows: Vec<Vec<String>> = [
        steps_kept(results),
        few_iterations(results),
        steps_enlarged(results),
        iterations(results, "Table II, κ = 1 and 2·10⁶: 1735 and 1798 iterations", &KAPPAS[..2]),
        iterations(results, "Table II, κ = 4 and 8·10⁶: 5147 and 5565 iterations", &KAPPAS[2..]),
        growth_with_kappa(results),
        vibration(results),
        group_dynamics(results),
        free_temperatures(results),
        bound_temperatures(results),
        heating(results),
        clustering(results),
        insensitive_to_gamma(results),
    ]
    .into_iter()
    .map(|(claim, ours, verdict)| vec![claim.to_owned(), ours, verdict.word().to_owned()])
    .collect();
    table(&["the paper", "our runs", "agrees"], &rows).replace("---:", ":---")
}

type Claim<'a> = (&'a str, String, Verdict);

fn all_runs(results: &Results, binding: Binding) -> Vec<&Run> {
    KAPPAS.iter().flat_map(|&kappa| results.table(binding, kappa)).collect()
}

fn steps_kept(results: &Results) -> Claim<'static> {
    let runs = all_runs(results, Binding::Free);
    let kept = runs.iter().filter(|run| run.counters.steps == 5000 && run.counters.rejected_steps == 0).count();
    (
        "Without binding, steps are neither refined nor unrefined: 5000 steps",
        format!("5000 steps and no rejected attempt in {kept} of {} runs", runs.len()),
        Verdict::of(kept == runs.len()),
    )
}

fn few_iterations(results: &Results) -> Claim<'static> {
    let iterations: Vec<f64> =
        all_runs(results, Binding::Free).iter().map(|run| run.counters.iterations as f64).collect();
    let highest = iterations.iter().copied().fold(0.0, f64::max);
    let inside = KAPPAS.iter().filter(|&&kappa| within(results, Binding::Free, kappa)).count();
    let verdict = match inside {
        4 => Verdict::Yes,
        // The same picture, one iteration in nearly every step, though not the same numbers.
        _ if highest < 5150.0 => Verdict::Partly,
        _ => Verdict::No,
    };
    let seen = show_range(&iterations);
    let ours = format!("{seen} iterations; {inside} of the paper's four numbers lie in the range of our seeds");
    ("Table I: 5032 to 5038 iterations, one in nearly every step", ours, verdict)
}

/// Whether the paper's number of iterations lies in the range of our seeds.
fn within(results: &Results, binding: Binding, kappa: u32) -> bool {
    let runs = results.table(binding, kappa);
    let (_, iterations) = printed(binding, kappa);
    runs.iter().any(|run| run.counters.iterations <= iterations)
        && runs.iter().any(|run| run.counters.iterations >= iterations)
}

fn steps_enlarged(results: &Results) -> Claim<'static> {
    let steps: Vec<f64> = all_runs(results, Binding::Bound).iter().map(|run| run.counters.steps as f64).collect();
    let middle = median(&steps);
    // Halfway between the paper's 580 and 5000 on a logarithmic scale would be 1700.
    let verdict = if (500.0..700.0).contains(&middle) { Verdict::Yes } else { Verdict::of(middle < 1700.0) };
    let ours = format!("{} steps, median {middle}", show_range(&steps));
    ("With binding, steps can be enlarged: 548 to 601 steps", ours, verdict)
}

fn iterations<'a>(results: &Results, claim: &'a str, kappas: &[u32]) -> Claim<'a> {
    let inside = kappas.iter().filter(|&&kappa| within(results, Binding::Bound, kappa)).count();
    let counts: Vec<f64> = kappas
        .iter()
        .flat_map(|&kappa| results.table(Binding::Bound, kappa))
        .map(|run| run.all_iterations() as f64)
        .collect();
    let ours = format!("{} with rejected attempts, median {}", show_range(&counts), median(&counts));
    let verdict = match inside {
        0 => Verdict::No,
        _ if inside == kappas.len() => Verdict::Yes,
        _ => Verdict::Partly,
    };
    (claim, ours, verdict)
}

fn growth_with_kappa(results: &Results) -> Claim<'static> {
    let growth = iteration_growth(results);
    let significant = growth.mean > 1.0 + SEEN * growth.error;
    let verdict = match (significant, growth.mean > 2.0) {
        (true, true) => Verdict::Yes,
        (true, false) => Verdict::Partly,
        _ => Verdict::No,
    };
    let ours = format!("by a factor of {}", show(&growth, 3));
    ("Iterations grow with κ, by a factor of 3.2 from 1 to 8·10⁶", ours, verdict)
}

/// Iterations at the largest kappa over those at the smallest, seed by seed.
fn iteration_growth(results: &Results) -> Estimate {
    let (low, high) = (results.table(Binding::Bound, KAPPAS[0]), results.table(Binding::Bound, KAPPAS[3]));
    let ratio = |(low, high): (&Run, &Run)| high.all_iterations() as f64 / low.all_iterations() as f64;
    Estimate::of(&low.iter().zip(high).map(ratio).collect::<Vec<_>>())
}

fn vibration(results: &Results) -> Claim<'static> {
    let rising = |curve: &Vec<f64>| {
        let rises = curve.windows(2).filter(|pair| pair[1] > pair[0]).count();
        100.0 * rises as f64 / curve.windows(2).len() as f64
    };
    let curves = Curves::new(Quantity::Kinetic, Binding::Free, results);
    let shares = Estimate::of(&curves.by_kappa.concat().iter().map(rising).collect::<Vec<_>>());
    (
        "The near field makes the cloud vibrate: kinetic energy is not monotone",
        format!("without binding it rises for {:.0} % of the time", shares.mean),
        Verdict::of((5.0..95.0).contains(&shares.mean)),
    )
}

/// Spread of the kinetic energy per mass between the kappas, over seeds [J/kg].
pub fn spread(results: &Results, binding: Binding) -> Estimate {
    Estimate::of(&Curves::new(Quantity::Kinetic, binding, results).spreads())
}

fn group_dynamics(results: &Results) -> Claim<'static> {
    let (free, bound) = (spread(results, Binding::Free), spread(results, Binding::Bound));
    let apart = free.mean > bound.mean && free.distance(&bound) > SEEN;
    (
        "Group dynamics for different κ deviate much more without binding",
        format!(
            "spread of kinetic energy / mass between the κ {} J/kg without, {} with: {:.1} times",
            show(&free, 4),
            show(&bound, 4),
            free.mean / bound.mean
        ),
        Verdict::of(apart && free.mean > 2.0 * bound.mean),
    )
}

fn typical(results: &Results, binding: Binding, quantity: impl Fn(&Run) -> f64) -> Estimate {
    estimate(results.table(binding, TYPICAL), quantity)
}

fn free_temperatures(results: &Results) -> Claim<'static> {
    temperatures(results, Binding::Free, "Figure 4, without binding: colours from 300 to 400 K (a typical κ = 2·10⁶)")
}

fn bound_temperatures(results: &Results) -> Claim<'static> {
    temperatures(results, Binding::Bound, "Figures 5 and 10, with binding: the same colours, 300 to 400 K")
}

fn temperatures(results: &Results, binding: Binding, claim: &'static str) -> Claim<'static> {
    let (mean, hottest) =
        (typical(results, binding, Run::final_temperature), typical(results, binding, |run| run.hottest));
    let ours = format!("mean at 5 s {} K, hottest particle {} K", show(&mean, 0), show(&hottest, 0));
    (claim, ours, Verdict::of(fits_scale(results, binding)))
}

/// Whether the hottest particle is at the end of the paper's colour scale, "approximately 400 K": half of the scale
/// either way.
pub fn fits_scale(results: &Results, binding: Binding) -> bool {
    (350.0..450.0).contains(&typical(results, binding, |run| run.hottest).mean)
}

fn heating(results: &Results) -> Claim<'static> {
    let rise = |binding| typical(results, binding, |run| run.final_temperature() - START);
    let (free, bound) = (rise(Binding::Free), rise(Binding::Bound));
    (
        "With clustering the temperature rises substantially",
        format!("κ = 2·10⁶: by {} K with binding, {} K without", show(&bound, 0), show(&free, 0)),
        Verdict::of(bound.mean > 2.0 * free.mean && free.distance(&bound) > SEEN),
    )
}

fn clustering(results: &Results) -> Claim<'static> {
    let largest = |binding| typical(results, binding, largest_cluster);
    let (free, bound) = (largest(Binding::Free), largest(Binding::Bound));
    (
        "With binding an initially fine cloud forms clusters",
        format!(
            "largest cluster at 5 s: {} of 100 particles; without binding the largest group that is as close: {}",
            show(&bound, 1),
            show(&free, 1)
        ),
        Verdict::of(bound.mean > free.mean && free.distance(&bound) > SEEN),
    )
}

fn largest_cluster(run: &Run) -> f64 {
    f64::from(run.clusters.as_ref().map_or(0, |clusters| clusters.largest))
}

/// What a tenth of the typical impact duration changes, seed by seed.
pub fn gamma_effect(results: &Results, binding: Binding, quantity: impl Fn(&Run) -> f64) -> Estimate {
    let setup = Setup::at_step(binding, FIRST_STEP);
    let (long, short) =
        (results.compared(&setup.with_gamma(GAMMA)), results.compared(&setup.with_gamma(GAMMAS[GAMMAS.len() - 1])));
    Estimate::of(&long.iter().zip(short).map(|(long, short)| quantity(short) - quantity(long)).collect::<Vec<_>>())
}

fn insensitive_to_gamma(results: &Results) -> Claim<'static> {
    let free = gamma_effect(results, Binding::Free, Run::final_temperature);
    let bound = gamma_effect(results, Binding::Bound, Run::final_temperature);
    let motion = gamma_effect(results, Binding::Bound, Run::final_kinetic);
    let unseen = |effect: &Estimate| effect.mean.abs() <= SEEN * effect.error;
    let verdict = match (unseen(&free), unseen(&bound)) {
        (true, true) => Verdict::Yes,
        (false, false) => Verdict::No,
        _ => Verdict::Partly,
    };
    (
        "The system is insensitive to γ below 0.01",
        format!(
            "from γ = 0.01 to 0.001 the mean temperature changes by {} K without binding, by {} K with binding at \
             Δt = 1e-3 s, and the kinetic energy / mass of the latter by {} J/kg",
            show(&free, 1),
            show(&bound, 0),
            show(&motion, 3)
        ),
        verdict,
    )
}
