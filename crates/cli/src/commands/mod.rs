//! The commands, one file each.

pub mod check;
pub mod completions;
pub mod export;
pub mod info;
pub mod init;
pub mod man;
pub mod run;
pub mod schema;
