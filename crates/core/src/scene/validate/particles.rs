//! Particles: one radius, one mass, and the temperatures and charges that other sections ask for.

use std::f64::consts::PI;

use crate::scene::{ParticleSource, Problem, Problems, RandomCube, Scene, Weight};

impl RandomCube {
    /// Radius of each of the spheres [m]; `None` unless exactly one of `radius` and `radius_ratio` is given.
    #[must_use]
    pub fn radius_of_each(&self) -> Option<f64> {
        match (self.radius, self.radius_ratio) {
            (Some(radius), None) => Some(radius),
            (None, Some(ratio)) => Some(ratio * self.side / libm::cbrt(f64::from(self.count))),
            _ => None,
        }
    }
}

/// Mass of a sphere [kg] of density [kg/m^3] and radius [m].
pub(crate) fn sphere_mass(density: f64, radius: f64) -> f64 {
    density * (4.0 / 3.0 * PI * radius * radius * radius)
}

/// Why a mass or a radius [kg, m] cannot be computed with, if so.
fn degenerate(radius: f64, mass: f64) -> Option<String> {
    // Reduced masses multiply two masses and forces divide by one: both must stay far from the ends of the range.
    const RANGE: std::ops::RangeInclusive<f64> = 1e-100..=1e100;
    let outside = |what: &str, value: f64, unit: &str| {
        format!("the {what} {value:e} {unit} cannot be computed with; it must be from 1e-100 to 1e100 {unit}")
    };
    if !RANGE.contains(&radius) {
        Some(outside("radius", radius, "m"))
    } else if !RANGE.contains(&mass) {
        Some(outside("mass", mass, "kg"))
    } else {
        None
    }
}

pub(super) fn check(scene: &Scene, problems: &mut Problems) {
    let charges = if charge_weighted(scene) {
        Needed::ByAll
    } else if scene.external.is_some_and(|external| external.electric_field.is_some()) {
        Needed::BySome
    } else {
        Needed::No
    };
    match &scene.particles {
        ParticleSource::RandomCube(cube) => check_cube(scene, cube, charges, problems),
        ParticleSource::List(list) => {
            for (k, particle) in list.iter().enumerate() {
                let pointer = || format!("/particles/list/{k}");
                match (particle.density, particle.mass) {
                    (Some(_), Some(_)) => problems.push(
                        Problem::new(pointer(), "a particle has a density or a mass, not both")
                            .hint("keep one of them"),
                    ),
                    (None, None) => problems.push(
                        Problem::new(pointer(), "the particle has neither a density nor a mass")
                            .hint("add \"density\" [kg/m^3] or \"mass\" [kg]"),
                    ),
                    (density, mass) => {
                        let mass = mass.or(density.map(|d| sphere_mass(d, particle.radius))).unwrap_or(0.0);
                        if let Some(what) = degenerate(particle.radius, mass) {
                            problems.push(Problem::new(pointer(), what));
                        }
                    }
                }
                if scene.thermal.is_some() && particle.temperature.is_none() {
                    problems.push(no_temperature(pointer()));
                }
                if charges == Needed::ByAll && particle.charge.is_none() {
                    problems.push(
                        Problem::new(pointer(), "the particle has no charge, which the weight `charge-product` needs")
                            .hint("add \"charge\" [C]; 0 for a neutral particle"),
                    );
                }
            }
            if charges == Needed::BySome && list.iter().all(|p| p.charge.is_none()) {
                problems.push(no_field_charge("/particles/list"));
            }
        }
        // Their columns are known once the file is read, and checked then as a list.
        ParticleSource::File(_) | ParticleSource::Log(_) => {}
    }
}

fn check_cube(scene: &Scene, cube: &RandomCube, charges: Needed, problems: &mut Problems) {
    let pointer = "/particles/random_cube";
    match cube.radius_of_each() {
        Some(radius) => {
            if let Some(what) = degenerate(radius, sphere_mass(cube.density, radius)) {
                problems.push(Problem::new(pointer, what));
            }
        }
        None if cube.radius.is_some() => {
            let at = format!("{pointer}/radius_ratio");
            problems.push(Problem::new(at, "radius and radius_ratio exclude each other").hint("keep one of them"));
        }
        None => problems.push(
            Problem::new(pointer, "the spheres have no radius")
                .hint("add \"radius\" [m], or \"radius_ratio\", the radius over side/count^(1/3)"),
        ),
    }
    let fastest = (0..3).map(|k| cube.velocity_mean[k].abs() + cube.velocity_spread[k]).fold(0.0, f64::max);
    if !fastest.is_finite() {
        let at = format!("{pointer}/velocity_spread");
        problems.push(Problem::new(at, "velocity_mean and velocity_spread add up to more than a double can hold"));
    }
    if scene.thermal.is_some() && cube.temperature.is_none() {
        problems.push(no_temperature(pointer.into()));
    }
    if cube.charge.is_none() {
        match charges {
            Needed::ByAll => problems.push(
                Problem::new(pointer, "the particles have no charge, which the weight `charge-product` needs")
                    .hint("add \"charge\" [C]: a number, or an array of numbers dealt in turn"),
            ),
            Needed::BySome => problems.push(no_field_charge(pointer)),
            Needed::No => {}
        }
    }
}

/// Who must have a charge.
#[derive(Clone, Copy, PartialEq)]
enum Needed {
    ByAll,
    BySome,
    No,
}

/// Whether any term of the near field or the binding is weighted by charges.
fn charge_weighted(scene: &Scene) -> bool {
    let field = scene.near_field.as_ref();
    let common = field.map_or(Weight::default(), |field| field.weight);
    let terms = field.into_iter().flat_map(|field| [&field.attraction, &field.repulsion]).flatten();
    let weights = terms.map(|term| term.weight).chain(scene.binding.as_ref().map(|binding| binding.weight));
    weights.map(|own| own.unwrap_or(common)).any(|weight| weight == Weight::ChargeProduct)
}

fn no_temperature(pointer: String) -> Problem {
    Problem::new(pointer, "there is no temperature, which `thermal` needs").hint("add \"temperature\" [K]")
}

fn no_field_charge(pointer: &str) -> Problem {
    Problem::new(pointer, "no particle has a charge, so that external.electric_field does nothing")
        .hint("add \"charge\" [C], or leave electric_field out")
}
