//! The command line: commands, options and their help, from which completions and manual pages are generated as well.

mod analyze;
mod diff;
mod export;
mod recover;
mod render;
mod replay;
mod study;
mod view;

pub use analyze::AnalyzeArgs;
pub use diff::DiffArgs;
pub use export::{ExportArgs, ExportFormat};
pub use recover::RecoverArgs;
pub use render::{Background, Quantity as RenderQuantity, RenderArgs, RenderFormat};
pub use replay::ReplayArgs;
pub use study::StudyArgs;
pub use view::ViewArgs;

use std::path::PathBuf;

use agglo_core::scene::Setting;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::target::Target;

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
/// Commit that the program was built from; `unknown` outside a repository.
pub const COMMIT: &str = env!("AGGLO_COMMIT");

/// Direct simulation of charged, colliding, clustering, heating particle clouds, with logs that can be trusted.
#[derive(Debug, Parser)]
#[command(name = "agglo", version = long_version(), max_term_width = 100)]
#[command(
    after_help = "Exit codes: 0 done · 1 failed · 2 bad input or usage · 3 done, but the input is damaged · 130 \
                        interrupted · 101 a bug.\nStart with `agglo init`, which lists the scenes that come along."
)]
pub struct Cli {
    /// What holds for every command.
    #[command(flatten)]
    pub global: Global,
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

fn long_version() -> String {
    format!("{VERSION} (commit {COMMIT})")
}

/// Options of every command.
#[derive(Args, Clone, Debug, Default)]
#[command(next_help_heading = "Global options")]
pub struct Global {
    /// Say nothing but errors
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Say more
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// When to use colour; `auto` heeds NO_COLOR
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t)]
    pub color: Color,
    /// How to show progress; `auto` draws a bar on a terminal, `json` writes a line a second
    #[arg(long, global = true, value_name = "HOW", value_enum, default_value_t)]
    pub progress: ProgressKind,
    /// How to write errors and warnings; `json` writes an object a line
    #[arg(long, global = true, value_name = "FORMAT", value_enum, default_value_t)]
    pub errors: ErrorFormat,
    /// Number of threads; results do not depend on it [default: one per core]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Widest instruction set to use; results do not depend on it
    #[arg(long, global = true, value_name = "SET", value_enum, default_value_t)]
    pub simd: InstructionSet,
}

/// Instruction sets of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum InstructionSet {
    /// The widest that the machine has.
    #[default]
    Auto,
    /// AVX-512, 512-bit vectors of x86-64.
    Avx512,
    /// AVX2, 256-bit vectors of x86-64.
    Avx2,
    /// What every machine of the kind has.
    Portable,
}

/// When to use colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal, unless NO_COLOR is set.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// How to show progress.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProgressKind {
    /// A bar on a terminal, else nothing.
    #[default]
    Auto,
    /// Nothing.
    Never,
    /// A JSON object a line, once a second.
    Json,
}

/// How to write errors and warnings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ErrorFormat {
    /// For people.
    #[default]
    Text,
    /// A JSON object a line.
    Json,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Solve a scene and record every step
    Run(RunArgs),
    /// Check a scene and say what to expect of it, without solving it
    Check(CheckArgs),
    /// Write a scene to start from, or list them
    Init(InitArgs),
    /// Say what is in a log, whole or damaged
    Info(InfoArgs),
    /// Recompute energies, clusters, temperatures and iterations from a log, and compare them with what it says
    Analyze(AnalyzeArgs),
    /// Say what happened at each step of a log, or solve it again and compare bit for bit
    Replay(ReplayArgs),
    /// Compare two logs
    Diff(DiffArgs),
    /// Write the particles of a log for other programs
    Export(ExportArgs),
    /// Show a log in Foxglove, Lichtblick or Rerun: serve it to them, and say how to open it
    View(ViewArgs),
    /// Write a valid log of all that is whole in a damaged one
    Recover(RecoverArgs),
    /// Draw pictures of a log: shaded spheres of true size, one moment, a sheet of several, or an animation
    Render(RenderArgs),
    /// Measure speed against error: integrators, steps and tolerances against a reference
    Study(StudyArgs),
    /// Print the schema of scene files or of log messages
    Schema(SchemaArgs),
    /// Print a shell's completion script
    Completions(CompletionsArgs),
    /// Write manual pages
    Man(ManArgs),
}

/// A scene and what is set in it.
#[derive(Args, Debug)]
pub struct SceneArgs {
    /// Scene file; `-` reads standard input
    pub scene: Target,
    /// Set a value of the scene, such as `solver.step.initial=1e-4`; VALUE is JSON, else a string; `null` removes the
    /// key, as in `thermal=null`
    #[arg(long, value_name = "POINTER=VALUE", value_parser = setting)]
    pub set: Vec<Setting>,
}

/// Arguments of `agglo run`.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Scene file; `-` reads standard input
    #[arg(required_unless_present = "resume")]
    pub scene: Option<Target>,
    /// Set a value of the scene, such as `solver.step.initial=1e-4`; VALUE is JSON, else a string; `null` removes the
    /// key, as in `thermal=null`
    #[arg(long, value_name = "POINTER=VALUE", value_parser = setting)]
    pub set: Vec<Setting>,
    /// Go on with the run of this log, from its last checkpoint; what was recorded up to there is carried over, and the
    /// new log is the one of a run that was never interrupted. Only `--set duration=..` may differ
    #[arg(long, value_name = "OLD", conflicts_with_all = ["scene", "no_log"], requires = "output")]
    pub resume: Option<PathBuf>,
    /// Log file; `-` writes to standard output [default: the scene's name with .mcap, in the working folder]
    #[arg(short, long, value_name = "LOG")]
    pub output: Option<Target>,
    /// Replace files that exist; a good old log survives a run that fails
    #[arg(long)]
    pub overwrite: bool,
    /// Write a summary of the run as JSON; `-` writes to standard output
    #[arg(long, value_name = "FILE")]
    pub summary: Option<Target>,
    /// Record nothing
    #[arg(long, conflicts_with_all = ["output", "max_log"])]
    pub no_log: bool,
    /// Largest log allowed, such as `500MB` or `2GiB`; a run that reaches it stops
    #[arg(long, value_name = "SIZE", value_parser = crate::size::parse)]
    pub max_log: Option<u64>,
    /// Let Foxglove and Lichtblick watch the run while it solves; ADDR is `HOST:PORT`, `HOST` or `PORT`, and the default
    /// 127.0.0.1:8765 can be reached from this machine only
    #[arg(long, value_name = "ADDR", num_args = 0..=1, require_equals = true, default_missing_value = "127.0.0.1:8765")]
    pub live: Option<String>,
}

/// Arguments of `agglo check`.
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `agglo init`.
#[derive(Args, Debug)]
pub struct InitArgs {
    /// Name of the scene; without it, all are listed
    pub name: Option<String>,
    /// File to write; `-` writes to standard output [default: NAME.json in the working folder]
    #[arg(short, long, value_name = "FILE", requires = "name")]
    pub output: Option<Target>,
    /// Replace a file that exists
    #[arg(long)]
    pub overwrite: bool,
}

/// Arguments of `agglo info`.
#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Log file
    pub log: PathBuf,
    /// Read all of it and check every checksum
    #[arg(long)]
    pub check: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

/// Arguments of `agglo schema`.
#[derive(Args, Debug)]
pub struct SchemaArgs {
    /// Which schema
    #[arg(value_enum, default_value_t)]
    pub of: SchemaKind,
}

/// Schemas that can be printed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// JSON Schema of scene files.
    #[default]
    Scene,
    /// Protobuf definitions of the log's own messages.
    Messages,
}

/// Arguments of `agglo completions`.
#[derive(Args, Debug)]
pub struct CompletionsArgs {
    /// Shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `agglo man`.
#[derive(Args, Debug)]
pub struct ManArgs {
    /// Folder to write agglo.1, agglo-run.1, .. to; it is made if it does not exist
    pub dir: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    pub overwrite: bool,
}

fn setting(text: &str) -> Result<Setting, String> {
    Setting::parse(text).map_err(|problem| match problem.hint {
        Some(hint) => format!("{}; {hint}", problem.message),
        None => problem.message,
    })
}
