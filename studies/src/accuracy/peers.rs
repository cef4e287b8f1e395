//! Other programs: a command reads the problem as JSON on its standard input and answers with its curves.

use std::io::Write;
use std::process::{Command, Stdio};

use agglo_core::placement::place;
use agglo_core::scene::{Contact, PowerTerm, Restitution, Scene, Weight};
use agglo_study::Study;
use serde::Deserialize;
use serde_json::json;

use crate::Failure;

/// What a peer answers.
#[derive(Debug, Deserialize)]
pub struct Answer {
    /// Versions, and what was run.
    pub note: String,
    /// Its curves.
    pub curves: Vec<Curve>,
}

/// A curve of one method.
#[derive(Debug, Deserialize)]
pub struct Curve {
    /// Its name.
    pub name: String,
    /// Errors [mean diameters] and wall times [s].
    pub points: Vec<(f64, f64)>,
}

/// Asks a peer.
///
/// # Errors
/// A scene with more than a near field and impacts of one restitution, a command that fails or does not answer in the way asked for.
pub fn ask(command: &str, scene: &Scene, study: &Study) -> Result<Answer, Failure> {
    let near = scene.near_field.as_ref().ok_or("peers want a near field")?;
    let restitution = match &scene.contact {
        None => None,
        Some(Contact { restitution: Restitution::Constant(e), friction: None, .. }) => Some(*e),
        Some(_) => return Err("peers know one coefficient of restitution, and no friction".into()),
    };
    if scene.binding.is_some() || scene.external.is_some() || scene.thermal.is_some() {
        return Err("peers are asked about near fields and impacts only".into());
    }
    let (particles, state) = place(scene)?;
    let rows = |columns: &agglo_core::state::Columns| -> Vec<[f64; 3]> {
        (0..columns.len()).map(|i| columns.get(i).into()).collect()
    };
    let term = |term: &Option<PowerTerm>| term.as_ref().map_or([0.0, 1.0], |term| [term.strength, term.exponent]);
    let problem = json!({
        "mass": particles.mass, "position": rows(&state.position), "velocity": rows(&state.velocity),
        "radius": particles.radius, "restitution": restitution, "diameter": particles.mean_diameter(), "duration": study.until,
        "attraction": term(&near.attraction), "repulsion": term(&near.repulsion),
        "weight": match near.weight { Weight::MassProduct => "mass-product", Weight::None => "none", Weight::ChargeProduct => {
            return Err("peers know no charges".into());
        } },
        "reference": study.reference_positions,
    });
    let mut words = command.split_whitespace();
    let program = words.next().ok_or("an empty command")?;
    let mut child = Command::new(program).args(words).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
    if let Some(mut stdin) = child.stdin.take() {
        stdin.write_all(problem.to_string().as_bytes())?;
    }
    let output = child.wait_with_output()?;
    if !output.status.success() {
        return Err(format!("`{command}` failed: {}", output.status).into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
