//! Arguments of `agglo analyze`.

use std::path::PathBuf;

use clap::Args;

use crate::target::Target;

/// Arguments of `agglo analyze`.
#[derive(Args, Debug)]
pub struct AnalyzeArgs {
    /// Log file
    pub log: PathBuf,
    /// Write everything as JSON; `-` writes to standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<Target>,
    /// Write tables to this folder, which is made if it does not exist: energy.csv, steps.csv and, as the scene has
    /// them, temperature.csv, clusters.csv, cluster_sizes.csv, cluster_lives.csv
    #[arg(long, value_name = "DIR")]
    pub csv: Option<PathBuf>,
    /// Draw kinetic energy, temperature, clusters, step size and iterations over time, as SVG; `-` writes to standard
    /// output
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<Target>,
    /// Write a report as one HTML page that needs nothing else; `-` writes to standard output
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<Target>,
    /// Analyse each N-th recorded state; impacts and iterations are always all taken
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    pub every: u64,
    /// Replace files that exist
    #[arg(long)]
    pub overwrite: bool,
}
