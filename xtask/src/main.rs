//! agglo's chores: `cargo xtask gen` writes what is generated, `cargo xtask ci` runs the checks.
//!
//! No build script runs anywhere: generated files are committed, and `ci` fails where they are out of date.

mod checks;
mod copies;
mod dependencies;
mod messages;
mod outputs;
mod schema;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// A chore's failure, as a sentence.
type Failure = Box<dyn std::error::Error>;

const USAGE: &str = "usage: cargo xtask gen | gen --check | deps | ci [--keep-going]

  gen            writes protobuf code, descriptors, the scene schema and embedded copies
  gen --check    says which of them are out of date, and writes nothing
  deps           checks the direction of dependencies: core <- record <- replay <- {render, study} <- cli
  ci             runs every check, in the order in which CI does
  ci --keep-going  goes on after a check that failed";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments.as_slice() {
        ["gen"] => outputs::write(&root()),
        ["gen", "--check"] => outputs::check(&root()),
        ["deps"] => dependencies::check(&root()),
        ["ci"] => checks::run(&root(), false),
        ["ci", "--keep-going"] => checks::run(&root(), true),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// The workspace's folder, which holds this package's.
fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_path_buf()
}
