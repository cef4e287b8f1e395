//! Writes `docs/hard-cases.md`: every hard case in every scheme.

use std::path::Path;
use std::process::ExitCode;

use agglo_studies::hard_cases::{PATH, page};

fn main() -> ExitCode {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = package.parent().unwrap_or(package).join(PATH);
    match std::fs::write(&path, page()) {
        Ok(()) => {
            println!("wrote {PATH}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {PATH}: {error}");
            ExitCode::FAILURE
        }
    }
}
