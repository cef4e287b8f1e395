//! What a log tells, recomputed from states, impacts and scene in one pass, and compared with what it says.
//!
//! - Energies that a state holds (kinetic, near field, binding, external, thermal) and its momenta come from the state
//!   and the scene. Reaction heat, impact and friction loss are summed up from the impacts of every step. Heat given off
//!   follows from the balance of thermal energy; where a scene has both convection and radiation, how it splits is a
//!   quadrature over recorded states, with a bound of its error. Loss in resting contacts, periodic work and impulse from
//!   outside are in the log only. [`Label`] says which is which.
//! - Clusters are the connected components of bonded (or close) pairs; `history` says how they are followed.
//! - Two values agree when they are no farther apart than round-off allows: 1e-12 of the sum of the absolute
//!   contributions, 1e-6 where states are recorded in single precision, or the quadrature's error.
//!
//! The log is read once (its first states twice); memory does not grow with its length.

mod agreement;
mod books;
pub mod chart;
mod clusters;
mod fold;
pub mod history;
mod iterations;
mod pipeline;
pub mod report;
mod series;
mod state;

use std::io::{Read, Seek};

use agglo_core::assembly::Model;
use agglo_core::ledger::Ledger;
use agglo_core::placement::place;
use agglo_core::scene::{Precision, Scene};
use agglo_core::state::{Columns, Particles};
use agglo_record::channels::{Effects, Topic};
use agglo_record::run::RunInfo;

pub use agreement::{Agreement, Comparison, Difference, Label, Term};
pub use clusters::Clusters;
pub use iterations::{CAUSES, Iterations, Spread};
pub use series::{Series, Span};
pub use state::Temperature;

use crate::error::{Damage, LogError};
use crate::judge::Shape;
use crate::log::Log;
use crate::messages::Message;
use books::Books;
use fold::Fold;
use history::{Counts, Life};
use pipeline::Outcome;
use state::Basis;

/// Damages that are kept one by one; beyond it they are counted.
const DAMAGE_KEPT: usize = 1000;

/// What is analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Each so-many-th recorded state, the first one included; iterations and impacts are always all taken.
    pub every: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { every: 1 }
    }
}

/// What a state came to, recomputed.
#[derive(Clone, Debug, PartialEq)]
pub struct StateRow {
    /// Time [s].
    pub t: f64,
    /// Step number.
    pub step: u64,
    /// Energies [J]. Values that are recorded only are the log's; NaN where it lacks them.
    pub ledger: Ledger,
    /// Sum of m v [kg m/s].
    pub momentum: [f64; 3],
    /// Sum of r x m v about the origin [kg m^2/s].
    pub angular_momentum: [f64; 3],
    /// Temperatures, where the scene has any.
    pub temperature: Option<Temperature>,
    /// Clusters, where the scene counts them; who is in which is not kept.
    pub clusters: Option<Clusters>,
}

impl StateRow {
    /// The value of a term of the ledger; `None` for vectors and what is no energy.
    #[must_use]
    pub fn value(&self, term: Term) -> Option<f64> {
        let (ledger, totals) = (&self.ledger, &self.ledger.totals);
        Some(match term {
            Term::Kinetic => ledger.kinetic,
            Term::NearField => ledger.near_field,
            Term::Binding => ledger.binding,
            Term::External => ledger.external,
            Term::Thermal => ledger.thermal,
            Term::ReactionHeat => totals.reaction_heat,
            Term::Radiated => totals.radiated,
            Term::Convected => totals.convected,
            Term::ImpactLoss => totals.impact_loss,
            Term::FrictionLoss => totals.friction_loss,
            Term::RestingLoss => totals.resting_loss,
            Term::PeriodicWork => totals.periodic_work,
            Term::Residual => ledger.residual,
            _ => return None,
        })
    }
}

/// What a step says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepRow {
    /// Time at its end [s].
    pub t: f64,
    /// Step number.
    pub step: u64,
    /// Step size [s].
    pub dt: f64,
    /// Iterations of the accepted attempt.
    pub iterations: u64,
    /// Rejected attempts.
    pub rejected: u64,
    /// Contraction eps_K / eps_(K-1) [-]; NaN with a single iteration.
    pub contraction: f64,
    /// Impacts.
    pub impacts: u64,
}

/// Takes rows while the log is read. All are called in the log's order.
pub trait Sink {
    /// A step.
    ///
    /// # Errors
    /// What ends the analysis.
    fn step(&mut self, row: &StepRow) -> Result<(), Failed>;
    /// A state that was analysed.
    ///
    /// # Errors
    /// What ends the analysis.
    fn state(&mut self, row: &StateRow) -> Result<(), Failed>;
    /// A cluster that ended.
    ///
    /// # Errors
    /// What ends the analysis.
    fn life(&mut self, life: &Life) -> Result<(), Failed>;
}

/// A sink that wants nothing but the [`Analysis`].
impl Sink for () {
    fn step(&mut self, _: &StepRow) -> Result<(), Failed> {
        Ok(())
    }

    fn state(&mut self, _: &StateRow) -> Result<(), Failed> {
        Ok(())
    }

    fn life(&mut self, _: &Life) -> Result<(), Failed> {
        Ok(())
    }
}

/// An analysis that did not reach its end.
#[derive(Debug)]
pub enum Failed {
    /// The log cannot be read.
    Log(LogError),
    /// The log lacks its scene, or the scene cannot be set up; a sentence.
    Scene(String),
    /// The sink refused a row.
    Sink(std::io::Error),
    /// The sink asked to stop.
    Stopped,
}

impl std::fmt::Display for Failed {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::Scene(what) => f.write_str(what),
            Self::Sink(error) => write!(f, "a result could not be written: {error}"),
            Self::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for Failed {}

impl From<LogError> for Failed {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<std::io::Error> for Failed {
    fn from(error: std::io::Error) -> Self {
        Self::Sink(error)
    }
}

/// What is lost of a log.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Lost {
    /// The first thousand damages, in order.
    pub damage: Vec<Damage>,
    /// Damages beyond those.
    pub more: u64,
    /// Messages that are missing without a trace or in the wrong place, as sentences; the first thousand.
    pub gaps: Vec<String>,
    /// Gaps beyond those.
    pub more_gaps: u64,
}

impl Lost {
    /// Whether nothing is.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.damage.is_empty() && self.gaps.is_empty()
    }

    fn note(&mut self, damage: Damage) {
        if self.damage.len() < DAMAGE_KEPT { self.damage.push(damage) } else { self.more += 1 }
    }

    fn gap(&mut self, what: String) {
        if self.gaps.len() < DAMAGE_KEPT { self.gaps.push(what) } else { self.more_gaps += 1 }
    }
}

/// Curves for charts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curves {
    /// Kinetic energy [J].
    pub kinetic: Series,
    /// Mean temperature [K].
    pub mean_temperature: Series,
    /// Highest temperature [K].
    pub max_temperature: Series,
    /// Clusters of two or more.
    pub clusters: Series,
    /// Size of the largest cluster.
    pub largest: Series,
    /// Particles that are alone.
    pub singletons: Series,
    /// Energy that nothing explains [J].
    pub residual: Series,
    /// Step size [s].
    pub step_size: Series,
    /// Iterations of a step.
    pub iterations: Series,
    /// Rejected attempts, of steps with any.
    pub rejected: Series,
}

impl Curves {
    fn state(&mut self, row: &StateRow) {
        let t = row.t;
        self.kinetic.push(t, row.ledger.kinetic);
        self.residual.push(t, row.ledger.residual);
        if let Some(temperature) = &row.temperature {
            self.mean_temperature.push(t, temperature.mean);
            self.max_temperature.push(t, temperature.max);
        }
        if let Some(clusters) = &row.clusters {
            self.clusters.push(t, clusters.count.into());
            self.largest.push(t, clusters.largest.into());
            self.singletons.push(t, clusters.singletons.into());
        }
    }
}

/// What a log came to.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// Which scene, build and model the log comes from.
    pub run: RunInfo,
    /// Text of the scene, as resolved.
    pub scene: String,
    /// Duration that the scene asks for [s].
    pub duration: f64,
    /// Number and time [s] of the last step.
    pub end: (u64, f64),
    /// Recorded states in the log.
    pub recorded_states: u64,
    /// States that were analysed.
    pub states: u64,
    /// The first of them.
    pub first: Option<StateRow>,
    /// The last of them.
    pub last: Option<StateRow>,
    /// How the steps went.
    pub iterations: Iterations,
    /// Impacts.
    pub impacts: u64,
    /// What became of clusters, where the scene counts them.
    pub clusters: Option<Counts>,
    /// Recorded against recomputed.
    pub agreement: Agreement,
    /// Warnings and errors that the run itself recorded.
    pub warnings: u64,
    /// Curves for charts.
    pub curves: Curves,
    /// What is lost.
    pub lost: Lost,
}

impl<R: Read + Seek + Send> Log<R> {
    /// Analyses the log in one pass; rows go to `sink` as they come. Of a damaged log what is whole is used.
    ///
    /// # Errors
    /// A log that cannot be read, that lacks its scene or holds nothing; what the sink says.
    pub fn analyze(&mut self, options: &Options, sink: &mut dyn Sink) -> Result<Analysis, Failed> {
        let text = self.scene_json()?;
        let scene = Scene::parse(&text, &[]).map_err(LogError::Scene)?;
        self.meets(&scene)?;
        let (particles, without) = self.particles_or_placed(&scene)?;
        let Some(start) = self.first_positions(particles.len())? else {
            return Err(LogError::Damaged(Damage { offset: self.size(), what: "no state is left".to_owned() }).into());
        };
        let single = scene.record.precision == Precision::F32;
        let model = Model::new(&scene, &particles, &start);
        let counts_clusters = model.cluster_range.is_some();
        let books = Books::new(&scene, &particles, single);
        let shape = Shape::new(&scene, &Effects::new(&scene, particles.len()));
        let basis = Basis { model, particles, shape, single };
        let mut fold = Fold::new(&scene, books, counts_clusters);
        let recorded_states = pipeline::run(self, &basis, options.every.max(1), |outcome| match outcome {
            Outcome::Part(t, step, part) => fold.take(t, step, part, sink),
            Outcome::Lost(damage) => {
                fold.lose(damage);
                Ok(())
            }
            Outcome::Wrong(damage) => {
                fold.lost.gap(damage.what);
                Ok(())
            }
            Outcome::Failed(error) => Err(error.into()),
        })?;
        fold.finish(sink)?;
        let not_said = without.filter(|damage| !fold.lost.damage.contains(damage));
        self.file_damage()?.into_iter().chain(not_said).for_each(|damage| fold.lost.note(damage));
        Ok(Analysis {
            run: self.run().clone(),
            scene: text,
            duration: scene.duration,
            end: fold.steps_end,
            recorded_states,
            states: fold.states,
            first: fold.first,
            last: fold.last,
            iterations: fold.iterations,
            impacts: fold.books.impacts.count,
            clusters: fold.history.map(|history| history.counts),
            agreement: fold.agreement,
            warnings: fold.warnings,
            curves: fold.curves,
            lost: fold.lost,
        })
    }

    /// Radii, masses, charges: from the log, or where that part is lost from the scene, and then what is lost.
    fn particles_or_placed(&mut self, scene: &Scene) -> Result<(Particles, Option<Damage>), Failed> {
        match self.particles() {
            Err(LogError::Damaged(damage)) => {
                let placed = place(scene).map_err(|error| Failed::Scene(error.to_string()))?;
                Ok((placed.0, Some(damage)))
            }
            other => Ok((other?, None)),
        }
    }

    /// Positions of the first state that is whole.
    fn first_positions(&mut self, n: usize) -> Result<Option<Columns>, LogError> {
        for entry in self.messages().only(&[Topic::Particles]) {
            match entry {
                Ok(entry) => match entry.message {
                    Message::Particles(frame) if frame.position.len() == n => return Ok(Some(frame.position)),
                    _ => {}
                },
                Err(LogError::Damaged(_)) => {}
                Err(other) => return Err(other),
            }
        }
        Ok(None)
    }
}
