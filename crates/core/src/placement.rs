//! Where the particles start: from a scene to radii, masses, positions, velocities and temperatures.
//!
//! Positions along a periodic direction are wrapped into the box. Whatever the source, particles that coincide, overlap
//! or reach into a wall are refused by name: the forces between them would mean nothing.

mod cube;
mod overlap;
mod random;

use crate::domain::Domain;
use crate::error::SetupError;
use crate::scene::{ListedParticle, ParticleSource, Problem, Problems, Scene, short, sphere_mass};
use crate::state::{Columns, Particles, State};

pub use random::Stream;

/// Pairs may overlap, and particles reach into walls, by this share of the smaller diameter [-]: contacts written out in
/// decimals touch to round-off.
const TOLERANCE: f64 = 1e-9;

/// What helps against an overlap.
const OVERLAP_HINT: &str =
    "move one of them, make them smaller, or allow it by contact.initial_overlap (a share of the diameter)";

/// Pairs and particles that a refusal names.
const NAMED: usize = 10;

/// Places a scene's particles, after checking the scene as [`Scene::validate`] does.
///
/// The result has n rows throughout; a charge column only where the scene names a charge, a temperature column only with
/// `thermal`.
///
/// # Errors
/// An invalid scene; a particle source that is a file or a log and should have been resolved into a list before; a cube
/// that cannot be filled; particles that coincide, overlap, or reach into a wall.
pub fn place(scene: &Scene) -> Result<(Particles, State), SetupError> {
    let problems = scene.validate();
    if !problems.is_empty() {
        return Err(SetupError { problems });
    }
    let domain = Domain::new(scene.domain.as_ref());
    let (particles, mut state) = match &scene.particles {
        ParticleSource::RandomCube(cube) => cube::fill(cube, scene.seed, &domain)?,
        ParticleSource::List(list) => from_list(list),
        ParticleSource::File(_) | ParticleSource::Log(_) => {
            let message = "particles from a file must be read into a list before they are placed";
            return Err(Problem::new("/particles", message).into());
        }
    };
    if scene.thermal.is_none() {
        state.temperature = None;
    }
    domain.wrap(&mut state.position, |_, _, _| {});
    check_geometry(scene, &domain, &particles, &state.position)?;
    Ok((particles, state))
}

fn from_list(list: &[ListedParticle]) -> (Particles, State) {
    let charged = list.iter().any(|p| p.charge.is_some());
    let particles = Particles {
        radius: list.iter().map(|p| p.radius).collect(),
        // Validation has made sure of one of the two.
        mass: list.iter().map(|p| p.mass.unwrap_or_else(|| sphere_mass(p.density.unwrap_or(0.0), p.radius))).collect(),
        charge: charged.then(|| list.iter().map(|p| p.charge.unwrap_or(0.0)).collect()),
    };
    let mut state = State {
        position: Columns::default(),
        velocity: Columns::default(),
        // Validation has made sure that with `thermal` all have one.
        temperature: list.iter().map(|p| p.temperature).collect(),
    };
    for particle in list {
        state.position.push(particle.position);
        state.velocity.push(particle.velocity);
    }
    (particles, state)
}

/// Refuses particles that coincide, overlap or reach into a wall.
fn check_geometry(scene: &Scene, domain: &Domain, particles: &Particles, r: &Columns) -> Result<(), SetupError> {
    let listed = matches!(scene.particles, ParticleSource::List(_));
    let pointer = |i: usize| if listed { format!("/particles/list/{i}/position") } else { "/particles".to_owned() };
    let tolerance = scene.contact.as_ref().and_then(|contact| contact.initial_overlap).unwrap_or(TOLERANCE);
    let mut problems = Problems::default();
    // A cube is filled without overlap in the first place.
    let pairs =
        if listed { overlap::find(r, &particles.radius, &domain.periodic, tolerance, NAMED + 1) } else { Vec::new() };
    for pair in pairs.iter().take(NAMED) {
        let (i, j, distance) = (pair.i, pair.j, pair.distance);
        if distance == 0.0 {
            let message = format!("particles {i} and {j} are at the same place");
            problems.push(Problem::new(pointer(j), message).hint("move one of them"));
            continue;
        }
        let depth = short(particles.radius[i] + particles.radius[j] - distance);
        let message = format!("particles {i} and {j} overlap by {depth} m: their centres are {distance} m apart");
        problems.push(Problem::new(pointer(j), message).hint(OVERLAP_HINT));
    }
    if pairs.len() > NAMED {
        problems.push(Problem::new("/particles", "more particles overlap than these ten pairs"));
    }
    let mut inside = 0;
    for (w, wall) in domain.walls.iter().enumerate() {
        for i in 0..r.len() {
            let (distance, radius) = (wall.distance(&r.get(i)), particles.radius[i]);
            // Written so that a distance that is no number is refused too.
            if distance - radius >= -tolerance * 2.0 * radius {
                continue;
            }
            inside += 1;
            if inside > NAMED {
                continue;
            }
            let message = format!(
                "particle {i} reaches into wall {w}: its centre is {distance} m from the plane, less than its radius, {radius} m"
            );
            problems.push(
                Problem::new(pointer(i), message)
                    .hint("move it, or turn the wall's normal to the side of the particles"),
            );
        }
    }
    if inside > NAMED {
        let message = format!("{} more particles reach into walls", inside - NAMED);
        problems.push(Problem::new("/domain/walls", message));
    }
    if problems.is_empty() { Ok(()) } else { Err(SetupError { problems: problems.finish() }) }
}
