//! The log: what is recorded comes back, the same run gives the same bytes, and no failure looks like success.

#![allow(missing_docs, clippy::unwrap_used)]

#[path = "log/analysis.rs"]
mod analysis;
#[path = "log/apart.rs"]
mod apart;
#[path = "log/bytes.rs"]
mod bytes;
#[path = "log/compat.rs"]
mod compat;
#[path = "log/csv.rs"]
mod csv;
#[path = "log/damage.rs"]
mod damage;
#[path = "log/dependencies.rs"]
mod dependencies;
#[path = "log/failures.rs"]
mod failures;
#[path = "log/fields.rs"]
mod fields;
#[path = "log/kept.rs"]
mod kept;
#[path = "log/layout.rs"]
mod layout;
#[path = "log/size.rs"]
mod size;
#[path = "log/source.rs"]
mod source;
#[path = "log/story.rs"]
mod story;
#[path = "log/verify.rs"]
mod verify;
#[path = "log/viewers.rs"]
mod viewers;
