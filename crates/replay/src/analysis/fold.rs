//! The pass over the log: what belongs to a step is put together, compared, summed up and handed on.

use agglo_core::diagnostics::{Level, Notice, StepDiagnostics};
use agglo_core::impact::Impact;
use agglo_core::ledger::{Ledger, Momentum};
use agglo_core::observer;
use agglo_core::scene::Scene;

use super::agreement::{Agreement, Difference, Label, Term};
use super::books::{Books, GivenOff, Ways};
use super::clusters::Clusters;
use super::history::History;
use super::iterations::Iterations;
use super::state::{DOUBLE, Rounded, StateValues, Tolerances};
use super::{Curves, Failed, Lost, Sink, StateRow, StepRow};
use crate::error::Damage;

/// What a message came to.
pub enum Part {
    /// A recorded state.
    State(Box<StateValues>),
    /// Iterations and step control.
    Diagnostics(StepDiagnostics),
    /// Recorded energies and momentum.
    Energy(Box<(Ledger, Momentum)>),
    /// Recorded cluster counts.
    Clusters(observer::Clusters),
    /// Impacts.
    Impacts(Vec<Impact>),
    /// A message for people.
    Notice(Notice),
}

/// Parts of one step.
#[derive(Default)]
struct Step {
    t: f64,
    number: u64,
    state: Option<Box<StateValues>>,
    diagnostics: Option<StepDiagnostics>,
    ledger: Option<Box<(Ledger, Momentum)>>,
    clusters: Option<observer::Clusters>,
    impacts: Vec<Impact>,
    /// Whether some of it, or something just before or behind it, is lost.
    damaged: bool,
}

/// Everything that is kept from step to step.
pub struct Fold {
    pub agreement: Agreement,
    pub iterations: Iterations,
    pub history: Option<History>,
    pub curves: Curves,
    pub first: Option<StateRow>,
    pub last: Option<StateRow>,
    pub states: u64,
    pub steps_end: (u64, f64),
    pub warnings: u64,
    pub lost: Lost,
    pub books: Books,
    has_contact: bool,
    /// Balance at the start that residuals are taken against, with its round-off [J].
    initial: Option<Rounded<f64>>,
    current: Option<Step>,
    previous: Option<u64>,
}

impl Fold {
    pub fn new(scene: &Scene, books: Books, counts_clusters: bool) -> Self {
        let mut agreement = Agreement::default();
        for term in [Term::RestingLoss, Term::PeriodicWork, Term::OutsideImpulse] {
            agreement.label(term, Label::RecordedOnly);
        }
        if books.ways() == Ways::Both {
            agreement.label(Term::Convected, Label::Quadrature);
            agreement.label(Term::Radiated, Label::Quadrature);
        }
        Self {
            agreement,
            iterations: Iterations::default(),
            history: counts_clusters.then(History::default),
            curves: Curves::default(),
            first: None,
            last: None,
            states: 0,
            steps_end: (0, 0.0),
            warnings: 0,
            lost: Lost::default(),
            has_contact: scene.contact.is_some(),
            books,
            initial: None,
            current: None,
            previous: None,
        }
    }

    /// Takes what a message came to.
    pub fn take(&mut self, t: f64, number: u64, part: Part, sink: &mut dyn Sink) -> Result<(), Failed> {
        if let Part::Notice(notice) = &part {
            // Said of a step, or of how the run ended: it begins none.
            self.warnings += u64::from(notice.level != Level::Info);
            return Ok(());
        }
        if self.current.as_ref().is_none_or(|step| step.number != number) {
            self.close(sink)?;
            self.current = Some(Step { t, number, ..Step::default() });
        }
        let Some(step) = &mut self.current else { return Ok(()) };
        // Of what stands there twice, which is said elsewhere, the last counts.
        match part {
            Part::State(state) => step.state = Some(state),
            Part::Diagnostics(diagnostics) => step.diagnostics = Some(diagnostics),
            Part::Energy(energy) => step.ledger = Some(energy),
            Part::Clusters(clusters) => step.clusters = Some(clusters),
            Part::Impacts(impacts) => step.impacts = impacts,
            Part::Notice(_) => {}
        }
        Ok(())
    }

    /// Takes note of a part that is lost.
    pub fn lose(&mut self, damage: Damage) {
        self.lost.note(damage);
        match &mut self.current {
            Some(step) => step.damaged = true,
            None => self.books.lose(),
        }
    }

    /// Ends the pass.
    pub fn finish(&mut self, sink: &mut dyn Sink) -> Result<(), Failed> {
        self.close(sink)?;
        if let Some(history) = &mut self.history {
            let mut result = Ok(());
            history.finish(|life| {
                if result.is_ok() {
                    result = sink.life(life);
                }
            });
            result?;
        }
        Ok(())
    }

    /// Puts the current step into all books.
    fn close(&mut self, sink: &mut dyn Sink) -> Result<(), Failed> {
        let Some(step) = self.current.take() else { return Ok(()) };
        self.follow(&step);
        self.books.add_impacts(&step.impacts);
        if let Some(diagnostics) = &step.diagnostics {
            self.diagnostics(&step, diagnostics, sink)?;
        }
        if let Some(ledger) = &step.ledger {
            self.impacts(&step, &ledger.0);
        }
        let Step { t, number, state, diagnostics, ledger, clusters, .. } = step;
        let Some(state) = state else { return Ok(()) };
        if let (Some(found), Some(recorded)) = (&state.clusters, &clusters) {
            self.clusters(t, number, found, recorded);
        }
        if let Some(found) = &state.clusters {
            self.cluster_numbers(t, number, found, diagnostics.as_ref());
        }
        self.state(*state, ledger.as_deref(), sink)
    }

    /// Takes note of the step, and of what is lost between it and the one before.
    fn follow(&mut self, step: &Step) {
        let expected = self.previous.map_or(0, |number| number.saturating_add(1));
        // Sums over impacts are no longer known.
        if step.number != expected || step.damaged {
            self.books.lose();
        }
        self.previous = Some(step.number);
        self.steps_end = (step.number, step.t);
    }

    fn diagnostics(&mut self, step: &Step, diagnostics: &StepDiagnostics, sink: &mut dyn Sink) -> Result<(), Failed> {
        let (t, number) = (step.t, step.number);
        let contraction = self.iterations.add(diagnostics);
        // A step of one iteration has none.
        let tolerance = if contraction.is_finite() { DOUBLE * contraction.abs() } else { 0.0 };
        let (recorded, recomputed) = (diagnostics.contraction, contraction);
        let difference = Difference { t, step: number, index: None, recorded, recomputed, tolerance };
        self.agreement.compare(Term::Contraction, difference);
        self.curves.step_size.push(t, diagnostics.dt);
        self.curves.iterations.push(t, diagnostics.iterations() as f64);
        if !diagnostics.rejected.is_empty() {
            self.curves.rejected.push(t, diagnostics.rejected.len() as f64);
        }
        sink.step(&StepRow {
            t,
            step: number,
            dt: diagnostics.dt,
            iterations: diagnostics.iterations(),
            rejected: diagnostics.rejected.len() as u64,
            contraction,
            impacts: step.impacts.len() as u64,
        })
    }

    /// Sums of impacts against recorded ones.
    fn impacts(&mut self, step: &Step, recorded: &Ledger) {
        if !self.books.meet(&recorded.totals) {
            return;
        }
        let sums = self.books.impacts;
        for (term, recorded, sum) in [
            (Term::ReactionHeat, recorded.totals.reaction_heat, sums.reaction_heat),
            (Term::ImpactLoss, recorded.totals.impact_loss, sums.impact_loss),
            (Term::FrictionLoss, recorded.totals.friction_loss, sums.friction_loss),
        ] {
            self.compare(term, (step.t, step.number), recorded, sum);
        }
    }

    fn compare(&mut self, term: Term, (t, step): (f64, u64), recorded: f64, found: Rounded<f64>) {
        let Rounded { value: recomputed, tolerance } = found;
        self.agreement.compare(term, Difference { t, step, index: None, recorded, recomputed, tolerance });
    }

    fn vector(&mut self, term: Term, (t, step): (f64, u64), recorded: [f64; 3], found: Rounded<[f64; 3]>) {
        for (k, (recorded, recomputed)) in recorded.into_iter().zip(found.value).enumerate() {
            let (index, tolerance) = (Some(k), found.tolerance);
            self.agreement.compare(term, Difference { t, step, index, recorded, recomputed, tolerance });
        }
    }

    /// Cluster counts against recorded ones. Where rounded positions leave open who is bonded, counts are not compared;
    /// the clusters themselves then are.
    fn clusters(&mut self, t: f64, step: u64, found: &Clusters, recorded: &observer::Clusters) {
        if found.bounds.open {
            return;
        }
        let exact = |value: f64| Rounded { value, tolerance: 0.0 };
        for (term, recorded, found) in [
            (Term::ClusterCount, f64::from(recorded.count), exact(f64::from(found.count))),
            (Term::LargestCluster, f64::from(recorded.largest), exact(f64::from(found.largest))),
            (Term::Singletons, f64::from(recorded.singletons), exact(f64::from(found.singletons))),
            (
                Term::MeanClusterSize,
                recorded.mean_size,
                Rounded { value: found.mean_size, tolerance: DOUBLE * found.mean_size },
            ),
        ] {
            self.compare(term, (t, step), recorded, found);
        }
    }

    /// The cluster of every particle, and bonds, against recorded ones.
    fn cluster_numbers(&mut self, t: f64, step: u64, found: &Clusters, diagnostics: Option<&StepDiagnostics>) {
        let difference =
            |index, recorded, recomputed, tolerance| Difference { t, step, index, recorded, recomputed, tolerance };
        if found.recorded {
            let (index, recorded, recomputed) = match found.disagrees {
                Some((i, recorded)) => (Some(i), recorded, found.of.get(i).copied().unwrap_or(0)),
                None => (None, 0, 0),
            };
            let difference = difference(index, f64::from(recorded), f64::from(recomputed), 0.0);
            self.agreement.compare(Term::Cluster, difference);
        }
        if let Some(recorded) = diagnostics.and_then(|diagnostics| diagnostics.bonds) {
            let (least, most) = found.bounds.bonds;
            let tolerance = (most - least) as f64;
            self.agreement.compare(Term::Bonds, difference(None, recorded as f64, found.bonds as f64, tolerance));
        }
    }

    /// A recorded state: its row, and what of it is compared.
    fn state(
        &mut self,
        mut state: StateValues,
        recorded: Option<&(Ledger, Momentum)>,
        sink: &mut dyn Sink,
    ) -> Result<(), Failed> {
        let (t, step) = (state.t, state.step);
        let place = (t, step);
        let steps = self.iterations.steps;
        let given_off = self.books.given_off(&state, recorded.map(|(ledger, _)| ledger), steps);
        let ledger = self.ledger(&state, given_off.as_ref(), recorded.map(|(ledger, _)| ledger));
        if let Some((ledger, momentum)) = recorded {
            self.held(place, ledger, &state.held, &state.tolerances);
            self.vector(Term::Momentum, place, momentum.linear, state.linear);
            self.vector(Term::AngularMomentum, place, momentum.angular, state.angular);
            if let Some(given_off) = given_off {
                self.compare(Term::Convected, place, ledger.totals.convected, given_off.convected);
                self.compare(Term::Radiated, place, ledger.totals.radiated, given_off.radiated);
            }
        }
        let ledger = self.residual(place, ledger, &state.tolerances, given_off, recorded.map(|(ledger, _)| ledger));
        let mut result = Ok(());
        if let (Some(history), Some(clusters)) = (&mut self.history, &state.clusters) {
            history.step(t, &clusters.of, |life| {
                if result.is_ok() {
                    result = sink.life(life);
                }
            });
        }
        result?;
        let mut clusters = state.clusters.take();
        if let Some(clusters) = &mut clusters {
            clusters.of = Vec::new();
        }
        let row = StateRow {
            t,
            step,
            ledger,
            momentum: state.linear.value,
            angular_momentum: state.angular.value,
            temperature: state.temperature,
            clusters,
        };
        self.curves.state(&row);
        self.states += 1;
        sink.state(&row)?;
        self.first.get_or_insert_with(|| row.clone());
        self.last = Some(row);
        Ok(())
    }

    /// The ledger of a state, without its residual: what is recorded only comes from the log.
    fn ledger(&self, state: &StateValues, given_off: Option<&GivenOff>, recorded: Option<&Ledger>) -> Ledger {
        let mut ledger = state.held;
        let unknown = Ledger {
            totals: agglo_core::ledger::Totals {
                resting_loss: f64::NAN,
                periodic_work: f64::NAN,
                convected: f64::NAN,
                radiated: f64::NAN,
                ..Default::default()
            },
            ..Ledger::default()
        };
        let recorded = recorded.unwrap_or(&unknown);
        ledger.totals = recorded.totals;
        let sums = &self.books.impacts;
        ledger.totals.reaction_heat = sums.reaction_heat.value;
        ledger.totals.impact_loss = sums.impact_loss.value;
        ledger.totals.friction_loss = sums.friction_loss.value;
        if let Some(given_off) = given_off {
            ledger.totals.convected = given_off.convected.value;
            ledger.totals.radiated = given_off.radiated.value;
        }
        if !self.has_contact {
            // Nothing rests where nothing touches, whatever the log says.
            ledger.totals.resting_loss = 0.0;
        }
        ledger
    }

    fn held(&mut self, place: (f64, u64), recorded: &Ledger, found: &Ledger, tolerances: &Tolerances) {
        for (term, recorded, value, tolerance) in [
            (Term::Kinetic, recorded.kinetic, found.kinetic, tolerances.kinetic),
            (Term::NearField, recorded.near_field, found.near_field, tolerances.near_field),
            (Term::Binding, recorded.binding, found.binding, tolerances.binding),
            (Term::External, recorded.external, found.external, tolerances.external),
            (Term::Thermal, recorded.thermal, found.thermal, tolerances.thermal),
        ] {
            self.compare(term, place, recorded, Rounded { value, tolerance });
        }
    }

    /// Fills in the residual, and compares it. Its round-off is that of all terms, now and at the start.
    fn residual(
        &mut self,
        place: (f64, u64),
        mut ledger: Ledger,
        tolerances: &Tolerances,
        given_off: Option<GivenOff>,
        recorded: Option<&Ledger>,
    ) -> Ledger {
        let sums = &self.books.impacts;
        let cumulative = sums.reaction_heat.tolerance + sums.impact_loss.tolerance + sums.friction_loss.tolerance;
        let given_off = given_off.map_or(0.0, |given_off| given_off.all.tolerance);
        let now = Rounded { value: ledger.balance(), tolerance: tolerances.sum() + cumulative + given_off };
        let initial = match (self.initial, recorded) {
            (Some(initial), _) => initial,
            (None, _) if place.1 == 0 => now,
            // The start is lost: the first residual is believed.
            (None, Some(recorded)) => {
                let value = now.value - recorded.residual;
                self.initial = Some(Rounded { value, tolerance: now.tolerance });
                ledger.residual = recorded.residual;
                return ledger;
            }
            (None, None) => Rounded { value: f64::NAN, tolerance: 0.0 },
        };
        if !initial.value.is_nan() {
            self.initial = Some(initial);
        }
        ledger.residual = now.value - initial.value;
        if let Some(recorded) = recorded {
            let found = Rounded { value: ledger.residual, tolerance: now.tolerance + initial.tolerance };
            self.compare(Term::Residual, place, recorded.residual, found);
        }
        ledger
    }
}
