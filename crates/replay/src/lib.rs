//! agglo's log: typed reading, particle sources and analysis of MCAP logs.
//!
//! ```no_run
//! use agglo_replay::{Log, Message};
//!
//! # fn main() -> Result<(), agglo_replay::LogError> {
//! let mut log = Log::open("clustering.mcap")?;
//! for entry in log.messages() {
//!     let entry = entry?;
//!     if let Message::Energy(ledger, _) = entry.message {
//!         println!("{} s: {} J", entry.t, ledger.kinetic);
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! Every chunk's checksum is verified before anything in it is believed; what is lost of a damaged log comes up as an
//! error among its messages, in its place. No input makes the reader panic, and memory is bounded by the largest chunk.

pub mod analysis;
mod container;
pub mod csv;
pub mod diff;
mod error;
pub mod export;
pub mod fields;
mod info;
mod judge;
mod log;
mod messages;
mod records;
pub mod recover;
pub mod resume;
mod source;
pub mod steps;
mod summary;
pub mod text;
pub mod verify;
mod wire;

pub use agglo_record::cloud::Frame;
pub use agglo_record::run::RunInfo;
pub use error::{Damage, LogError, NoState};
pub use info::{ChannelInfo, Checked, Info};
pub use log::Log;
pub use messages::{Channel, Entry, Message, Messages, RawMessage, RawMessages};
pub use source::{DamagedSource, resolve_particles};
