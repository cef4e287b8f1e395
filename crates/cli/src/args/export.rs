//! Arguments of `agglo export`.

use std::path::PathBuf;

use agglo_replay::export::At;
use clap::{Args, ValueEnum};

use crate::target::Target;

/// Arguments of `agglo export`.
#[derive(Args, Debug)]
pub struct ExportArgs {
    /// Log file
    pub log: PathBuf,
    /// Format to write
    #[arg(long, value_enum)]
    pub format: ExportFormat,
    /// Which states: a time in seconds (the last state at or before it), `end`, or `all`
    #[arg(long, value_name = "T", default_value = "end", allow_negative_numbers = true)]
    pub at: At,
    /// File to write; `-` writes to standard output
    #[arg(short, long, value_name = "PATH")]
    pub output: Target,
    /// Replace a file that exists
    #[arg(long)]
    pub overwrite: bool,
}

/// Formats of `agglo export`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// Comma-separated values, a line per particle.
    Csv,
    /// Extended XYZ, for OVITO and ASE.
    Extxyz,
    /// VTK PolyData, for ParaView, PyVista and OVITO; `--at all` writes a .pvd that lists a file per state.
    Vtp,
    /// Parquet, for pandas and polars: the columns of the CSV.
    Parquet,
}
