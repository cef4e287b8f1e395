//! Studies with agglo that write pages of its documentation.

pub mod accuracy;
pub mod hard_cases;
pub mod paper;
pub mod performance;
pub mod progress;
pub mod run;
pub mod statistics;

/// Why a study came to no end: a sentence. Studies are run by people, who read it.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;
