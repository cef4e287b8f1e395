//! Arguments of `agglo analyze`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `agglo analyze`.
#[derive(Args, Debug)]
pub struct AnalyzeArgs {
    /// Log file
    pub log: PathBuf,
}
