//! The commands, one file each.

pub mod analyze;
pub mod check;
pub mod completions;
pub mod diff;
pub mod export;
pub mod info;
pub mod init;
pub mod man;
pub mod recover;
pub mod render;
pub mod replay;
mod resume;
pub mod run;
pub mod schema;
pub mod study;
pub mod view;
