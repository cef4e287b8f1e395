//! Which runs the page needs: what each varies, and the scene for it.

use std::path::Path;

use agglo_core::scene::{ClusterCount, ImpactDuration, ModelKind, Scene, Solver, StepSize};

use crate::Failure;
use crate::run::{Case, Run};

/// The paper's reaction energies kappa [10^6 J/m^2].
pub const KAPPAS: [u32; 4] = [1, 2, 4, 8];
/// The reaction energy of single cases: the paper's "typical values" of its frames [10^6 J/m^2].
pub const TYPICAL: u32 = 2;
/// The paper's first step [s].
pub const FIRST_STEP: f64 = 1e-3;
/// The paper's bound on the step [s].
pub const LIMIT_STEP: f64 = 1e-2;
/// The largest share of the step that the paper calls typical for an impact's duration [-].
pub const GAMMA: f64 = 0.01;
/// Shares of the step whose effect is measured [-].
pub const GAMMAS: [f64; 3] = [0.1, GAMMA, 0.001];
/// Fixed steps of `consistent`: the paper's, a quarter, a sixteenth [s].
pub const FIXED_STEPS: [f64; 3] = [FIRST_STEP, FIRST_STEP / 4.0, FIRST_STEP / 16.0];
/// Steps at which the scheme of `paper` is compared with itself [s].
pub const PAPER_STEPS: [f64; 3] = [1e-2, 1e-3, 1e-4];
/// Duration of an impact in `consistent`, the paper's gamma times its first step [s].
pub const IMPACT_SECONDS: f64 = GAMMA * FIRST_STEP;
/// Particles closer than this many sums of their radii are counted as a cluster where nothing binds them: the range of
/// the binding force in the other runs [-].
const CLUSTER_RANGE: f64 = 1.65;

/// Whether the binding force acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Binding {
    /// "Without clustering forces".
    Free,
    /// "With clustering forces".
    Bound,
}

/// What a run varies, beside its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Scheme.
    pub model: ModelKind,
    /// Whether the binding force acts.
    pub binding: Binding,
    /// Reaction energy [10^6 J/m^2].
    pub kappa: u32,
    /// First and largest step [s]; in `consistent` the same, and fixed.
    pub steps: (f64, f64),
    /// Impact duration over the step [-]; `consistent` has [`IMPACT_SECONDS`] instead.
    pub gamma: f64,
}

impl Setup {
    /// A row of Table I or II.
    #[must_use]
    pub fn table(binding: Binding, kappa: u32) -> Self {
        Self { model: ModelKind::Paper, binding, kappa, steps: (FIRST_STEP, LIMIT_STEP), gamma: GAMMA }
    }

    /// A typical case of `paper` that starts at a step and never exceeds it.
    #[must_use]
    pub fn at_step(binding: Binding, step: f64) -> Self {
        Self { steps: (step, step), ..Self::table(binding, TYPICAL) }
    }

    /// The scheme of `consistent` without binding, at a fixed step.
    #[must_use]
    pub fn consistent(kappa: u32, step: f64) -> Self {
        Self { model: ModelKind::Consistent, steps: (step, step), ..Self::table(Binding::Free, kappa) }
    }

    /// The same with another impact duration.
    #[must_use]
    pub fn with_gamma(self, gamma: f64) -> Self {
        Self { gamma, ..self }
    }

    fn scene(&self, root: &Path, seed: u64) -> Result<Scene, Failure> {
        let kind = if self.binding == Binding::Bound { "binding" } else { "free" };
        let name = format!("scenes/paper-{kind}-{}e6.json", self.kappa);
        let text = std::fs::read_to_string(root.join(&name)).map_err(|error| format!("{name}: {error}"))?;
        let mut scene = Scene::parse(&text, &[]).map_err(|problems| {
            let found: Vec<String> = problems.iter().map(ToString::to_string).collect();
            format!("{name}: {}", found.join("; "))
        })?;
        scene.seed = seed;
        let duration = match self.model {
            ModelKind::Paper => {
                (scene.solver.step.initial, scene.solver.step.max) = (Some(self.steps.0), Some(self.steps.1));
                ImpactDuration::StepFraction(self.gamma)
            }
            ModelKind::Consistent => {
                scene.model = ModelKind::Consistent;
                let step = StepSize { fixed: Some(self.steps.0), ..StepSize::default() };
                scene.solver = Solver { step, ..Solver::default() };
                ImpactDuration::Seconds(IMPACT_SECONDS)
            }
        };
        if let Some(contact) = &mut scene.contact {
            contact.duration = Some(duration);
        }
        if self.binding == Binding::Free {
            scene.clusters = Some(ClusterCount { range: CLUSTER_RANGE });
        }
        Ok(scene)
    }

    fn case(&self, root: &Path, seed: u64) -> Result<Case, Failure> {
        let Self { model, binding, kappa, steps: (first, largest), gamma } = self;
        let label = format!(
            "{model:?}, {binding:?}, kappa = {kappa}e6 J/m^2, steps {first:e} to {largest:e} s, gamma = {gamma}, seed {seed}"
        );
        Ok(Case { label, scene: self.scene(root, seed)? })
    }
}

/// How many seeds each part of the page takes: 1, 2, ..
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seeds {
    /// Of the tables, the figures and the runs of `consistent`.
    pub tables: u64,
    /// Of the comparisons of steps and impact durations in `paper`.
    pub steps: u64,
}

impl Seeds {
    /// So many for the tables, half of them (rounded up) for the rest.
    #[must_use]
    pub fn new(tables: u64) -> Self {
        Self { tables, steps: tables.div_ceil(2) }
    }
}

/// All setups and how many seeds each needs, the longest runs first.
#[must_use]
pub fn setups(seeds: Seeds) -> Vec<(Setup, u64)> {
    let mut plan: Vec<(Setup, u64)> = Vec::new();
    let mut add = |setup: Setup, count: u64| {
        // The same run may serve several parts of the page.
        match plan.iter_mut().find(|(known, _)| *known == setup) {
            Some((_, known)) => *known = count.max(*known),
            None => plan.push((setup, count)),
        }
    };
    for step in FIXED_STEPS.into_iter().rev() {
        for kappa in KAPPAS {
            add(Setup::consistent(kappa, step), seeds.tables);
        }
    }
    for binding in [Binding::Bound, Binding::Free] {
        for step in PAPER_STEPS.into_iter().rev() {
            add(Setup::at_step(binding, step), seeds.steps);
        }
        for gamma in GAMMAS {
            add(Setup::at_step(binding, FIRST_STEP).with_gamma(gamma), seeds.steps);
            add(Setup::table(binding, TYPICAL).with_gamma(gamma), seeds.steps);
        }
        for kappa in KAPPAS {
            add(Setup::table(binding, kappa), seeds.tables);
        }
    }
    plan
}

/// The cases of all setups, in order.
///
/// # Errors
/// A scene of the repository that cannot be read.
pub fn cases(root: &Path, plan: &[(Setup, u64)]) -> Result<Vec<Case>, Failure> {
    plan.iter().flat_map(|(setup, count)| (1..=*count).map(move |seed| setup.case(root, seed))).collect()
}

/// The runs of a plan.
#[derive(Debug)]
pub struct Results {
    seeds: Seeds,
    runs: Vec<(Setup, Vec<Run>)>,
}

impl Results {
    /// From the runs of [`cases`], in their order.
    #[must_use]
    pub fn new(seeds: Seeds, plan: &[(Setup, u64)], runs: Vec<Run>) -> Self {
        let mut runs = runs.into_iter();
        let runs = plan.iter().map(|&(setup, count)| (setup, runs.by_ref().take(count as usize).collect())).collect();
        Self { seeds, runs }
    }

    /// How many seeds there are.
    #[must_use]
    pub fn seeds(&self) -> Seeds {
        self.seeds
    }

    /// The runs of a setup, by seed; none if the plan lacks it.
    #[must_use]
    pub fn of(&self, setup: &Setup) -> &[Run] {
        self.runs.iter().find(|(known, _)| known == setup).map_or(&[], |(_, runs)| runs)
    }

    /// The runs of a row of Table I or II, by seed.
    #[must_use]
    pub fn table(&self, binding: Binding, kappa: u32) -> &[Run] {
        self.of(&Setup::table(binding, kappa))
    }

    /// The runs of a setup for the seeds that comparisons of steps take.
    #[must_use]
    pub fn compared(&self, setup: &Setup) -> &[Run] {
        let runs = self.of(setup);
        &runs[..runs.len().min(self.seeds.steps as usize)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_a_valid_scene_and_none_is_run_twice() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let seeds = Seeds::new(3);
        assert_eq!(seeds.steps, 2);
        let plan = setups(seeds);
        let cases = cases(&root, &plan).unwrap();
        for (k, case) in cases.iter().enumerate() {
            assert_eq!(case.scene.validate(), [], "{}", case.label);
            assert!(cases[..k].iter().all(|other| other.scene != case.scene), "{} is there twice", case.label);
        }
        let results = Results::new(seeds, &plan, vec![Run::default(); cases.len()]);
        assert!(KAPPAS.iter().all(|&kappa| results.table(Binding::Bound, kappa).len() == 3));
        assert!(FIXED_STEPS.iter().all(|&step| results.of(&Setup::consistent(8, step)).len() == 3));
        assert_eq!(results.compared(&Setup::table(Binding::Free, TYPICAL)).len(), 2);
    }
}
