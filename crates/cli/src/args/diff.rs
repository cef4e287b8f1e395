//! Arguments of `agglo diff`.

use std::path::PathBuf;

use agglo_replay::diff::Profile;
use clap::{Args, ValueEnum};

use crate::target::Target;

/// Arguments of `agglo diff`.
#[derive(Args, Debug)]
pub struct DiffArgs {
    /// Log that is judged
    pub a: PathBuf,
    /// Log that it is compared with, the reference
    pub b: PathBuf,
    /// How to compare: `exact` bit for bit, `state` field by field within tolerances, `statistics` by curves in time, for
    /// chaotic runs [default: exact; state with --tolerance, statistics with --ensemble]
    #[arg(long, value_enum)]
    pub profile: Option<ProfileName>,
    /// Tolerance file (JSON): what may differ by how much, and what is ignored
    #[arg(long, value_name = "FILE")]
    pub tolerance: Option<PathBuf>,
    /// Ignore a field or channel, such as `/diagnostics` or `/particles.cluster`
    #[arg(long, value_name = "NAME")]
    pub ignore: Vec<String>,
    /// More reference runs: with B at least five, of the same scene and other seeds. They make bands in time that A must
    /// stay in
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub ensemble: Vec<PathBuf>,
    /// Chance that a run in which nothing differs fails, with --ensemble
    #[arg(long, value_name = "P", default_value_t = 0.01, value_parser = significance, requires = "ensemble")]
    pub significance: f64,
    /// Write the comparison as JSON; `-` writes to standard output, in place of the text
    #[arg(long, value_name = "FILE")]
    pub json: Option<Target>,
    /// Write it as JUnit XML
    #[arg(long, value_name = "FILE")]
    pub junit: Option<Target>,
    /// Write it as Markdown
    #[arg(long, value_name = "FILE")]
    pub markdown: Option<Target>,
    /// Print GitHub annotations; on by itself where GITHUB_ACTIONS is set
    #[arg(long)]
    pub annotations: bool,
    /// Replace files that exist
    #[arg(long)]
    pub overwrite: bool,
}

/// How logs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProfileName {
    /// Bit for bit.
    Exact,
    /// Field by field, within tolerances.
    State,
    /// Curves in time, for chaotic runs.
    Statistics,
}

impl From<ProfileName> for Profile {
    fn from(name: ProfileName) -> Self {
        match name {
            ProfileName::Exact => Self::Exact,
            ProfileName::State => Self::State,
            ProfileName::Statistics => Self::Statistics,
        }
    }
}

fn significance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(p) if p > 0.0 && p < 1.0 => Ok(p),
        _ => Err(format!("{text:?} is not a probability between 0 and 1")),
    }
}
