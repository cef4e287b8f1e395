//! agglo's recorder: solver states to MCAP messages.
//!
//! [`Recorder`] watches a run as an [`agglo_core::Observer`] and writes a log that holds all that is needed to replay
//! it. The same scene and build give the same file, byte for byte: no wall time, host, path or thread count is in it.
//!
//! | module | holds |
//! |---|---|
//! | [`channels`] | the one table of topics, their messages, and when a log has them |
//! | [`encoder`] | reports to messages, in their order |
//! | [`convert`] | solver values to messages and back, exactly |
//! | [`cloud`] | states as rows of `foxglove.PointCloud`, and back |
//! | [`layout`] | the viewer layout that fits a scene |
//! | [`run`] | the metadata record `run` |
//! | [`proto`] | the messages themselves, generated from `schemas/` |
//! | [`size`] | how large a log will be |

mod apart;
pub mod channels;
pub mod cloud;
mod container;
pub mod convert;
pub mod encoder;
mod error;
pub mod layout;
mod markers;
pub mod palette;
pub mod proto;
mod recorder;
pub mod run;
mod sink;
pub mod size;

pub use container::write_options;
pub use error::RecordError;
pub use recorder::{CarriedStep, Options, Recorded, Recorder, Tap};
pub use run::BuildInfo;
pub use size::{SizeEstimate, estimate, least};
