//! Draws the pictures of the documentation: the shipped scenes are run, their logs kept in memory, and `agglo render`'s
//! library draws them.

use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use agglo_core::{Scene, SetupError, Simulation};
use agglo_record::run::BuildInfo;
use agglo_record::{Options as LogOptions, Recorder};
use agglo_render::options::{ClusterChoice, Options, Quantity, When};
use agglo_render::{Drawn, draw};
use agglo_replay::Log;
use agglo_studies::Failure;
use agglo_studies::progress::Progress;

const USAGE: &str = "usage: cargo run --release -p agglo-studies --bin pictures -- [--check]

  --check  compares with the files that are there, and writes nothing";

/// Temperatures at the ends of the colour bar of the paper's Figures 4, 5 and 10 [K].
const PAPER_RANGE: [f64; 2] = [300.0, 400.0];

/// A picture: the file, the scene, and what `agglo render` is asked for.
struct Picture {
    path: &'static str,
    scene: &'static str,
    options: Options,
}

/// All of them; those of one log stand together.
fn pictures() -> Vec<Picture> {
    let sheet = Options { at: vec![When::Frames(8)], size: Some([1160, 680]), ..usual() };
    let single = Options { size: Some([760, 640]), ..usual() };
    let picture = |path, scene, options| Picture { path, scene, options };
    vec![
        picture("docs/clustering.png", "clustering", sheet.clone()),
        picture(
            "docs/pictures/cluster.png",
            "clustering",
            Options { color: Some(Quantity::Cluster), ..single.clone() },
        ),
        picture("docs/paper/figure-4.png", "paper-free-2e6", Options { range: Some(PAPER_RANGE), ..sheet.clone() }),
        picture("docs/paper/figure-5.png", "paper-binding-2e6", sheet),
        picture(
            "docs/paper/figure-10.png",
            "paper-binding-2e6",
            Options { cluster: Some(ClusterChoice::Largest), ..single.clone() },
        ),
        picture("docs/pictures/charge.png", "charged-cloud", Options { magnified: 2.0, ..single.clone() }),
        picture(
            "docs/pictures/box.png",
            "free-cooling-gas",
            Options { at: vec![When::Time(0.0), When::End], size: Some([960, 500]), ..single },
        ),
    ]
}

/// As all pictures of the documentation are: few colours, few bytes.
fn usual() -> Options {
    Options { indexed: true, ..Options::default() }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let check = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => false,
        ["--check"] => true,
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match make(&root(), check) {
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

/// Draws every picture, and writes it or compares it with the file.
fn make(root: &Path, check: bool) -> Result<(), Failure> {
    let pictures = pictures();
    let progress = Progress::new(pictures.len());
    let (mut log, mut stale) = ((String::new(), Vec::new()), Vec::new());
    for Picture { path, scene, options } in pictures {
        if log.0 != scene {
            log = (scene.to_owned(), record(root, scene).map_err(|error| format!("{scene}: {error}"))?);
        }
        let bytes = render(&log.1, &options).map_err(|error| format!("{path}: {error}"))?;
        progress.done();
        let file = root.join(path);
        if !check {
            if let Some(folder) = file.parent() {
                std::fs::create_dir_all(folder).map_err(|error| format!("{path}: {error}"))?;
            }
            std::fs::write(&file, &bytes).map_err(|error| format!("{path}: {error}"))?;
            println!("wrote {path}, {} kB", bytes.len().div_ceil(1000));
        } else if std::fs::read(&file).ok().as_deref() != Some(&bytes[..]) {
            stale.push(path);
        }
    }
    if stale.is_empty() { Ok(()) } else { Err(format!("out of date: {}", stale.join(", ")).into()) }
}

/// The log of a shipped scene.
fn record(root: &Path, name: &str) -> Result<Vec<u8>, Failure> {
    let text = std::fs::read_to_string(root.join(format!("scenes/{name}.json")))?;
    let mut scene = Scene::parse(&text, &[]).map_err(|problems| SetupError { problems })?;
    // Spheres for viewers are not what is drawn here.
    scene.record.markers = 0.0;
    let build = BuildInfo { version: env!("CARGO_PKG_VERSION").to_owned(), commit: "unknown".to_owned() };
    let mut bytes = Vec::new();
    let mut recorder = Recorder::create(&mut bytes, &scene, &build, LogOptions::default())?;
    Simulation::new(&scene)?.run(&mut recorder)?;
    recorder.finish()?;
    Ok(bytes)
}

fn render(log: &[u8], options: &Options) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let drawn = draw(&mut Log::new(Cursor::new(log))?, options, &mut bytes, &mut |_, _| true)?;
    match drawn {
        Drawn { lost: 0, valueless: 0, ref damage, .. } if damage.is_empty() => Ok(bytes),
        _ => Err(format!("something is missing: {drawn:?}").into()),
    }
}
