//! The list of checks that CI and people both run.

use std::path::Path;
use std::process::Command;

use crate::{Failure, dependencies, outputs};

/// One check: a cargo command line with what is added to its environment, or one of our own.
enum Check {
    Cargo(&'static [&'static str], &'static [(&'static str, &'static str)]),
    Own(fn(&Path) -> Result<(), Failure>),
}

/// In the order of the time they take, so that small slips are found first.
const CHECKS: &[(&str, Check)] = &[
    ("formatting", Check::Cargo(&["fmt", "--all", "--check"], &[])),
    ("generated files are current", Check::Own(outputs::check)),
    ("direction of dependencies", Check::Own(dependencies::check)),
    (
        "lints",
        Check::Cargo(
            &["clippy", "--workspace", "--all-targets", "--features", "agglo/live", "--locked", "--", "-D", "warnings"],
            &[],
        ),
    ),
    (
        "documentation",
        Check::Cargo(
            &["doc", "--workspace", "--no-deps", "--features", "agglo/live", "--locked"],
            &[("RUSTDOCFLAGS", "-D warnings")],
        ),
    ),
    // What the README says, with everything that can be switched on.
    ("tests", Check::Cargo(&["test", "--workspace", "--locked", "--features", "agglo/live"], &[])),
    (
        "without optional parts",
        Check::Cargo(
            &["clippy", "--package", "agglo", "--no-default-features", "--locked", "--", "-D", "warnings"],
            &[],
        ),
    ),
];

/// Runs all checks; stops at the first that fails unless told to keep going.
pub fn run(root: &Path, keep_going: bool) -> Result<(), Failure> {
    let mut failed = Vec::new();
    for (name, check) in CHECKS {
        println!("== {name}");
        let done = match check {
            Check::Cargo(arguments, environment) => cargo(root, arguments, environment),
            Check::Own(check) => check(root),
        };
        if let Err(failure) = done {
            eprintln!("{name}: {failure}");
            failed.push(*name);
            if !keep_going {
                break;
            }
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join(", ")).into()) }
}

fn cargo(root: &Path, arguments: &[&str], environment: &[(&str, &str)]) -> Result<(), Failure> {
    let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned());
    let status = Command::new(cargo).args(arguments).envs(environment.iter().copied()).current_dir(root).status()?;
    if status.success() { Ok(()) } else { Err(format!("cargo {} failed", arguments.join(" ")).into()) }
}
