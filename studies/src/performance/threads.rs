//! Two threads, against what a loop without any sharing gains from them in the same run.

use std::time::Instant;

use rayon::prelude::*;

use super::measure::{row, solve, threads};
use super::{Context, Section, cloud, fluid};
use crate::Failure;

pub fn run(context: &Context) -> Result<Section, Failure> {
    let rounds = if context.quick { 1 } else { 5 };
    let pairs = format!(
        r#"{{ "duration": {:?}, "particles": {{ "random_cube": {{
            "count": 4000, "side": 1, "radius_ratio": 0.25, "density": 2000 }} }},
            "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": 1 }},
                "repulsion": {{ "strength": 0.25, "exponent": 2 }}, "weight": "mass-product", "cutoff": 1.0 }},
            "solver": {{ "step": {{ "fixed": 1e-4 }} }}, "record": {{ "every_steps": 1000000 }} }}"#,
        1e-4 * 20.0
    );
    let scenes = [
        ("all pairs, n = 4000", super::parse(&pairs)?),
        ("Lennard-Jones fluid, n = 32000", fluid::Fluid::new(20).scene(20)?),
        ("bonded cloud, n = 100000", cloud::scene(100_000, 10)?),
    ];
    let mut rows = Vec::new();
    for (what, scene) in &scenes {
        let mut shares = Vec::new();
        for _ in 0..rounds {
            let ideal = threads(1, loop_seconds)? / threads(2, loop_seconds)?;
            let one = threads(1, || solve(scene))??.wall;
            let two = threads(2, || solve(scene))??.wall;
            shares.push(one / two / ideal);
        }
        rows.push(row(*what, shares, "-", None));
    }
    Ok(Section {
        title: "Two threads",
        about: "Gain in wall time from a second thread over the gain of an embarrassingly parallel loop measured just \
                before; should be at least 0.9. Both mean little where other programs use the processor."
            .to_owned(),
        rows,
        figure: None,
    })
}

/// Wall seconds of work that shares nothing.
fn loop_seconds() -> f64 {
    let start = Instant::now();
    let sum: f64 =
        (0..64_u64).into_par_iter().map(|k| (0..2_000_000).fold(k as f64, |x, _| x * 0.999_999_9 + 1e-7)).sum();
    // Used, so that the loop is not left out.
    if sum.is_nan() { f64::NAN } else { start.elapsed().as_secs_f64() }
}
