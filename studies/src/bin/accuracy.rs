//! Writes `docs/accuracy.md`, its pages and diagrams.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use agglo_studies::Failure;
use agglo_studies::accuracy::{Options, generate};

const USAGE: &str = "usage: cargo run --release -p agglo-studies --bin accuracy -- [--budget SECONDS] [--case NAME].. [--peer COMMAND]..

  --budget SECONDS  time for the measurements of each case; default 120
  --case NAME       only this case's page, not the one that leads to all
  --peer COMMAND    asks another program about the same problems, such as \"python3 studies/peers/rebound_peer.py\"";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some(options) = parse(&arguments) else {
        eprintln!("{USAGE}");
        return ExitCode::from(2);
    };
    match write(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Option<Options> {
    let mut options = Options { budget: 120.0, peers: Vec::new(), cases: Vec::new() };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--budget" => options.budget = rest.next()?.parse().ok().filter(|&budget: &f64| budget > 0.0)?,
            "--case" => options.cases.push(rest.next()?.clone()),
            "--peer" => options.peers.push(rest.next()?.clone()),
            _ => return None,
        }
    }
    Some(options)
}

fn write(options: &Options) -> Result<(), Failure> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root: PathBuf = package.parent().unwrap_or(package).to_path_buf();
    for file in generate(options)? {
        let path = root.join(&file.path);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(|error| format!("{}: {error}", file.path))?;
        }
        std::fs::write(&path, &file.text).map_err(|error| format!("{}: {error}", file.path))?;
        println!("wrote {}", file.path);
    }
    Ok(())
}
