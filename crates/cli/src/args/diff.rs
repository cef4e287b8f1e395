//! Arguments of `agglo diff`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of `agglo diff`.
#[derive(Args, Debug)]
pub struct DiffArgs {
    /// Log that is judged
    pub a: PathBuf,
    /// Log that it is compared with, the reference
    pub b: PathBuf,
}
