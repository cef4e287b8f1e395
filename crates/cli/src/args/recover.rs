//! Arguments of `agglo recover`.

use std::path::PathBuf;

use clap::Args;

use crate::target::Target;

/// Arguments of `agglo recover`.
#[derive(Args, Debug)]
pub struct RecoverArgs {
    /// Log file, damaged or cut off
    pub log: PathBuf,
    /// Log to write; `-` writes to standard output
    #[arg(short, long, value_name = "NEW")]
    pub output: Target,
    /// Replace a file that exists
    #[arg(long)]
    pub overwrite: bool,
}
