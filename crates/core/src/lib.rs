//! The solver of agglo: direct simulation of charged, colliding, clustering, heating clouds of spheres.
//!
//! The model is T. I. Zohdi's, "Charge-induced clustering in multifield particulate flows", IJNME 2004; equation numbers
//! in these pages are that paper's. The crate knows no files, no log format and no terminal: a [`scene::Scene`] goes in,
//! an [`observer::Observer`] sees every accepted step.
//!
//! All quantities are in SI units. Results are the same bits for every number of threads.

pub mod assembly;
pub mod cells;
pub mod characteristics;
pub mod checkpoint;
pub mod clusters;
pub mod collocation;
pub mod contact;
pub mod convergence;
pub mod diagnostics;
pub mod domain;
pub mod error;
pub mod events;
pub mod force;
pub mod frame;
pub mod impact;
pub mod integrator;
pub mod lanes;
pub mod ledger;
mod local_error;
pub mod math;
pub mod neighbor;
mod newton;
pub mod observer;
pub mod placement;
pub mod scene;
pub mod simd;
pub mod simulation;
pub mod stagger;
pub mod state;
mod step;
pub mod step_control;
mod tasks;
pub mod thermal;

pub use error::{RunError, SetupError};
pub use observer::{Flow, Observer, StepReport};
pub use scene::Scene;
pub use simulation::{Ending, Outcome, Simulation};
