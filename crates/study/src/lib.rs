//! Speed against error: a scene solved by several integrators with several steps and tolerances, measured against a
//! reference.
//!
//! [`Plan`] says what is tried, [`References`] what errors are measured against and until when that means anything,
//! [`study`] does it within a budget of time, and [`table`], [`chart`] and [`page`] show the result.

pub mod chart;
mod fit;
mod measure;
pub mod page;
mod plan;
mod reference;
mod seeds;
mod study;
pub mod table;

pub use fit::{Fit, fits};
pub use measure::{Errors, Measurement};
pub use plan::{Case, Control, Plan, Scheme};
pub use reference::References;
pub use seeds::{Ensemble, Mean};
pub use study::{Failed, Skipped, Study, Watcher, study};
