//! Solves a scene and records it: `cargo run --release --example record -- scenes/clustering.json clustering.mcap`.

use std::fs::File;

use agglo_core::diagnostics::Level;
use agglo_core::{Scene, Simulation};
use agglo_record::{BuildInfo, Options, Recorder};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(input), Some(output)) = (arguments.next(), arguments.next()) else {
        return Err("usage: record SCENE LOG".into());
    };
    let text = std::fs::read_to_string(&input)?;
    let scene = Scene::parse(&text, &[])
        .map_err(|problems| problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))?;
    let mut simulation = Simulation::new(&scene)?;

    let build = BuildInfo { version: env!("CARGO_PKG_VERSION").to_owned(), commit: "unknown".to_owned() };
    let mut recorder = Recorder::create(File::create(&output)?, &scene, &build, Options::default())?;
    let outcome = simulation.run(&mut recorder);
    // A run that failed leaves a log up to its last step, which says why it ended there.
    if let Err(error) = &outcome {
        recorder.note(Level::Error, error.to_string())?;
    }
    let recorded = recorder.finish()?;
    let outcome = outcome?;
    println!("{} steps, {} states, {} bytes", outcome.counters.steps, recorded.frames, recorded.bytes);
    Ok(())
}
