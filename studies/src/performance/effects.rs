//! (h) Every effect switched on alone: what it costs, and that a scene that does not name it does not pay.

use agglo_core::Scene;

use super::measure::{median, row, solve, threads};
use super::{Context, Section};
use crate::Failure;

/// Sections that are added to the base, one at a time.
const EFFECTS: &[(&str, &str)] = &[
    ("nothing (the base again)", ""),
    ("binding", r#""binding": { "strength": 1.75, "exponent": 1, "range": 1.5 },"#),
    ("contact", r#""contact": { "restitution": 0.5 },"#),
    ("contact with friction", r#""contact": { "restitution": 0.5, "friction": { "static": 0.2, "dynamic": 0.1 } },"#),
    ("radiation", r#""thermal": { "heat_capacity": 1000, "radiation": { "emissivity": 0.01, "surroundings": 250 } },"#),
    ("convection", r#""thermal": { "heat_capacity": 1000, "convection": { "coefficient": 10, "ambient": 250 } },"#),
    ("gravity", r#""external": { "gravity": [0, 0, -9.81] },"#),
    (
        "contact and a wall",
        r#""contact": { "restitution": 0.5 }, "domain": { "walls": [{ "point": [0, 0, -5], "normal": [0, 0, 1] }] },"#,
    ),
    ("a switch", "SWITCH"),
];

fn scene(effect: &str, steps: u64) -> Result<Scene, Failure> {
    let (effect, switch) = if effect == "SWITCH" { ("", r#", "switch_from": 0.9"#) } else { (effect, "") };
    let temperature = if effect.contains("thermal") { r#", "temperature": 300"# } else { "" };
    let text = format!(
        r#"{{ "duration": {}, {effect} "particles": {{ "random_cube": {{ "count": 1000, "side": 1, "radius_ratio": 0.25,
            "density": 2000, "velocity_mean": [1, 0.1, 0.1], "velocity_spread": [1, 0.1, 0.1]{temperature} }} }},
            "near_field": {{ "attraction": {{ "strength": 0.5, "exponent": 1 }},
                "repulsion": {{ "strength": 0.25, "exponent": 2 }}, "weight": "mass-product", "cutoff": 1.0{switch} }},
            "solver": {{ "step": {{ "fixed": 1e-4 }} }}, "record": {{ "every_steps": 1000000 }} }}"#,
        1e-4 * steps as f64
    );
    super::parse(&text)
}

pub fn run(context: &Context) -> Result<Section, Failure> {
    let (rounds, steps) = if context.quick { (1, 20) } else { (7, 100) };
    let base = scene("", steps)?;
    let scenes = EFFECTS.iter().map(|(_, effect)| scene(effect, steps)).collect::<Result<Vec<_>, _>>()?;
    let mut costs = vec![Vec::new(); EFFECTS.len()];
    let mut times = Vec::new();
    threads(1, || -> Result<(), Failure> {
        for _ in 0..rounds {
            for (scene, costs) in scenes.iter().zip(&mut costs) {
                // The base just before and after, so that what changes in between spoils both.
                let before = solve(&base)?.cpu;
                let with = solve(scene)?.cpu;
                let without = 0.5 * (before + solve(&base)?.cpu);
                costs.push(100.0 * (with / without - 1.0));
                times.push(without / steps as f64 * 1e6);
            }
        }
        Ok(())
    })??;
    let mut rows = vec![row("the base", vec![median(&times)], "us/step", None)];
    for ((name, _), costs) in EFFECTS.iter().zip(costs) {
        rows.push(row(*name, costs, "%", None));
    }
    Ok(Section {
        title: "Each effect alone",
        about: format!(
            "1000 particles, near field of the paper with cut-off 1, {steps} fixed steps, no recording, one thread; what \
             each effect adds to the computing time. `nothing` says how well that can be measured."
        ),
        rows,
        figure: None,
    })
}
