//! Writes `docs/paper.md` and its figures: the runs of Zohdi's paper, ours beside the paper's.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use agglo_studies::Failure;
use agglo_studies::paper::{self, File};

const USAGE: &str = "usage: cargo run --release -p agglo-studies --bin paper -- [--seeds N] [--check]

  --seeds N  runs seeds 1 to N of every case, at least 3; default 8, which docs/paper.md is made with
  --check    compares with the files that are there, and writes nothing";

const DEFAULT_SEEDS: u64 = 8;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((seeds, check)) = parse(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    let done = paper::generate(&root(), seeds)
        .and_then(|files| if check { compare(&root(), &files) } else { write(&root(), &files) });
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

/// Number of seeds, and whether to compare only; `None` if the arguments make no sense.
fn parse(arguments: &[String]) -> Option<(u64, bool)> {
    let (mut seeds, mut check) = (DEFAULT_SEEDS, false);
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--seeds" => seeds = rest.next()?.parse().ok().filter(|&seeds| (3..=1000).contains(&seeds))?,
            "--check" => check = true,
            _ => return None,
        }
    }
    Some((seeds, check))
}

/// The workspace's folder, which holds this package's.
fn root() -> PathBuf {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    package.parent().unwrap_or(package).to_path_buf()
}

fn write(root: &Path, files: &[File]) -> Result<(), Failure> {
    for file in files {
        let path = root.join(&file.path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", file.path))?;
        }
        std::fs::write(&path, &file.text).map_err(|error| format!("{}: {error}", file.path))?;
        println!("wrote {}", file.path);
    }
    Ok(())
}

fn compare(root: &Path, files: &[File]) -> Result<(), Failure> {
    let stale: Vec<&str> = files
        .iter()
        .filter(|file| std::fs::read(root.join(&file.path)).ok().as_deref() != Some(file.text.as_bytes()))
        .map(|file| file.path.as_str())
        .collect();
    if stale.is_empty() { Ok(()) } else { Err(format!("out of date: {}", stale.join(", ")).into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_that_make_no_sense_are_refused() {
        let parse = |text: &str| parse(&text.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
        assert_eq!(parse(""), Some((DEFAULT_SEEDS, false)));
        assert_eq!(parse("--check --seeds 5"), Some((5, true)));
        for wrong in ["--seeds", "--seeds 2", "--seeds many", "--seeds 1001", "5", "--chekc"] {
            assert_eq!(parse(wrong), None, "{wrong}");
        }
    }
}
