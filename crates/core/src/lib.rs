//! The solver of agglo: direct simulation of charged, colliding, clustering, heating clouds of spheres.
//!
//! The model is T. I. Zohdi's, "Charge-induced clustering in multifield particulate flows", IJNME 2004; equation numbers
//! in these pages are that paper's. The crate knows no files, no log format and no terminal: a [`scene::Scene`] goes in,
//! an [`observer::Observer`] sees every accepted step.
//!
//! All quantities are in SI units. Results are the same bits for every number of threads.

pub mod checkpoint;
pub mod diagnostics;
pub mod error;
pub mod impact;
pub mod ledger;
pub mod observer;
pub mod scene;
pub mod simulation;
pub mod state;

pub use error::{RunError, SetupError};
pub use observer::{Flow, Observer, StepReport};
pub use scene::Scene;
pub use simulation::{Ending, Outcome, Simulation};
