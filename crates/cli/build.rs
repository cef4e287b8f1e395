//! Tells the program which commit it was built from, if that can be known: from the file that `cargo package` leaves,
//! or from git where this package is checked out as part of its own repository.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let commit = packaged().or_else(checked_out).unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=AGGLO_COMMIT={commit}");
}

/// The commit in `.cargo_vcs_info.json`.
fn packaged() -> Option<String> {
    let path = ".cargo_vcs_info.json";
    let text = std::fs::read_to_string(path).ok()?;
    println!("cargo::rerun-if-changed={path}");
    let commit = text.split("\"sha1\"").nth(1)?.split('"').nth(1)?;
    hexadecimal(commit)
}

/// The commit that is checked out, unless the repository around this package is another project's.
fn checked_out() -> Option<String> {
    if git(&["rev-parse", "--show-prefix"])? != "crates/cli/" {
        return None;
    }
    // Both change with every commit and checkout; naming a file that does not exist would rebuild every time.
    for name in ["HEAD", "logs/HEAD"] {
        if let Some(path) = git(&["rev-parse", "--git-path", name]).filter(|path| Path::new(path).exists()) {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    hexadecimal(&git(&["rev-parse", "HEAD"])?)
}

fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok().filter(|output| output.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
}

/// The first twelve digits.
fn hexadecimal(commit: &str) -> Option<String> {
    let short = commit.get(..12)?;
    short.bytes().all(|b| b.is_ascii_hexdigit()).then(|| short.to_owned())
}
