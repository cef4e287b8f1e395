//! From a scene to its clusters, without files: `cargo run --release -p agglo-core --example cluster_count`.

use agglo_core::observer::ObserverError;
use agglo_core::{Flow, Observer, Scene, Simulation, StepReport};

/// Prints a line for every half second of simulated time.
struct EveryHalfSecond {
    next: f64,
}

impl Observer for EveryHalfSecond {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        if let Some(sample) = report.sample.filter(|_| report.time >= self.next) {
            self.next += 0.5;
            let clusters = sample.clusters.as_ref().map_or(0, |clusters| clusters.count);
            println!("t = {:.3} s: {clusters} clusters, {:.2} J kinetic", report.time, sample.ledger.kinetic);
        }
        Ok(Flow::Continue)
    }
}

const SCENE: &str = r#"{
    "duration": 2.0,
    "particles": { "random_cube": {
        "count": 60, "side": 1.0, "radius_ratio": 0.25, "density": 2000.0, "velocity_spread": [1.0, 0.1, 0.1]
    } },
    "near_field": {
        "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.25, "exponent": 2.0 },
        "weight": "mass-product", "cutoff": "inflection"
    },
    "binding": { "strength": 1.75, "exponent": 1.0, "range": 1.65 },
    "contact": { "restitution": 0.5 }
}"#;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let scene = Scene::parse(SCENE, &[]).map_err(|problems| agglo_core::SetupError { problems })?;
    let outcome = Simulation::new(&scene)?.run(&mut EveryHalfSecond { next: 0.0 })?;
    println!("{} steps, {} impacts", outcome.counters.steps, outcome.counters.impacts);
    Ok(())
}
