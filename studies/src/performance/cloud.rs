//! (d) A bonded cloud with a cut-off of a few diameters: time and memory per particle, from a thousand to a million.

use std::process::Command;

use agglo_core::Scene;

use super::measure::{median, peak_memory, row, solve, threads};
use super::{Context, Section, scaling};
use crate::Failure;

/// A cloud of the same density for any n: mean spacing 1, diameters 0.5, cut-off three diameters.
pub fn scene(n: usize, steps: u64) -> Result<Scene, Failure> {
    let side = (n as f64).cbrt();
    let text = format!(
        r#"{{ "duration": {duration}, "particles": {{ "random_cube": {{
            "count": {n}, "side": {side:?}, "radius": 0.25, "density": 2.0, "velocity_spread": [1, 1, 1] }} }},
            "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": 1 }},
                "repulsion": {{ "strength": 0.25, "exponent": 2 }}, "weight": "mass-product", "cutoff": 1.5 }},
            "binding": {{ "strength": 0.5, "exponent": 1, "range": 1.5 }},
            "solver": {{ "step": {{ "fixed": 0.002 }} }}, "record": {{ "every_steps": 1000000 }} }}"#,
        duration = 0.002 * steps as f64
    );
    super::parse(&text)
}

/// Runs one size in a process of its own and prints seconds per particle-step and bytes per particle.
pub fn child(n: usize, steps: u64) -> Result<(), Failure> {
    let before = peak_memory().unwrap_or(f64::NAN);
    let solved = threads(1, || solve(&scene(n, steps)?))??;
    let memory = peak_memory().unwrap_or(f64::NAN) - before;
    println!("{:e} {:e}", solved.cpu / (n as u64 * solved.steps) as f64, memory / n as f64);
    Ok(())
}

pub fn run(context: &Context) -> Result<Section, Failure> {
    let sizes: &[(usize, u64)] = if context.quick {
        &[(1000, 50), (10_000, 20)]
    } else {
        &[(1000, 2000), (10_000, 200), (100_000, 40), (1_000_000, 20)]
    };
    let rounds = if context.quick { 1 } else { 3 };
    let mut found = vec![(Vec::new(), Vec::new()); sizes.len()];
    for _ in 0..rounds {
        for (&(n, steps), found) in sizes.iter().zip(&mut found) {
            let output = Command::new(std::env::current_exe()?)
                .args(["--child", &n.to_string(), &steps.to_string()])
                .output()?;
            let text = String::from_utf8(output.stdout)?;
            let mut numbers = text.split_whitespace().map(str::parse::<f64>);
            let (Some(Ok(seconds)), Some(Ok(bytes))) = (numbers.next(), numbers.next()) else {
                return Err(format!("the run of {n} particles said `{text}`").into());
            };
            found.0.push(seconds * 1e9);
            found.1.push(bytes);
        }
    }
    let (mut rows, mut points) = (Vec::new(), Vec::new());
    let mut reference = Vec::new();
    for (&(n, _), (time, bytes)) in sizes.iter().zip(found) {
        if n == 10_000 {
            reference.clone_from(&time);
        }
        if n > 10_000 {
            let ratio = time.iter().zip(&reference).map(|(a, b)| a / b).collect();
            let limit = (n == 1_000_000).then(|| ("limit".into(), 1.3));
            rows.push(row(format!("n = {n}, over n = 10000"), ratio, "-", limit));
        }
        points.push((n as f64, median(&time)));
        rows.push(row(format!("n = {n}"), time, "ns/particle-step", None));
        let limit = (n >= 100_000).then(|| ("limit".into(), 300.0));
        rows.push(row(format!("n = {n}, memory"), bytes, "B/particle", limit));
    }
    let figure = scaling::svg(&points)?;
    Ok(Section {
        title: "Bonded cloud",
        about: "A random cloud of the same density at every size (mean spacing 1, diameter 0.5), mass-product law with \
                exponents 1 and 2, cut-off 3 diameters, binding up to 1.5 diameters, fixed steps, no recording, one thread. \
                Memory is the most that the process held, scene and setting up included, less what it held before."
            .to_owned(),
        rows,
        figure: Some(("cost", figure)),
    })
}
