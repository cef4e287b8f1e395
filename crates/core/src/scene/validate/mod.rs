//! Checks what concerns several values of a scene at once, and whole scenes that no text was checked for.

mod contact;
mod domain;
mod forces;
mod particles;
mod solver;

pub(crate) use particles::sphere_mass;

use super::check::check;
use super::schema::schema;
use super::tree::{Node, Origin};
use super::{ParticleSource, Problem, Problems, Scene};

impl Scene {
    /// Combinations that make no sense; every value by itself is in its range.
    pub(super) fn cross_check(&self, problems: &mut Problems) {
        let mut found = Vec::new();
        particles::check(self, problems);
        forces::check(self, &mut found);
        contact::check(self, &mut found);
        domain::check(self, &mut found);
        solver::check(self, &mut found);
        found.into_iter().for_each(|problem| problems.push(problem));
    }

    /// Values out of range, in a scene that was put together in memory.
    pub(super) fn range_check(&self, problems: &mut Problems) {
        let schema = schema();
        let mut checked = |value: serde_json::Result<serde_json::Value>, pointer: &str, part| match value {
            Ok(value) => check(&Node::from_value(&value, &Origin::Memory), pointer, schema, part, problems),
            Err(error) => problems.push(Problem::new(pointer, format!("this cannot be written as JSON: {error}"))),
        };
        let ParticleSource::List(list) = &self.particles else {
            return checked(serde_json::to_value(self), "", schema);
        };
        // A list may hold a million particles: they are checked one by one, beside a scene with the first alone.
        let first = list.iter().take(1).cloned().collect();
        checked(serde_json::to_value(self.with_particles(ParticleSource::List(first))), "", schema);
        let Some(part) = schema.pointer("/$defs/ListedParticle") else { return };
        for (k, particle) in list.iter().enumerate().skip(1) {
            checked(serde_json::to_value(particle), &format!("/particles/list/{k}"), part);
        }
    }

    /// This scene with other particles.
    #[must_use]
    pub fn with_particles(&self, particles: ParticleSource) -> Self {
        Self {
            particles,
            schema: self.schema.clone(),
            format: self.format,
            name: self.name.clone(),
            description: self.description.clone(),
            model: self.model,
            seed: self.seed,
            duration: self.duration,
            near_field: self.near_field.clone(),
            binding: self.binding.clone(),
            contact: self.contact.clone(),
            thermal: self.thermal.clone(),
            clusters: self.clusters,
            external: self.external,
            domain: self.domain.clone(),
            solver: self.solver.clone(),
            record: self.record.clone(),
        }
    }
}

/// The largest radius of a scene, where it is known before its particles are read [m].
fn largest_radius(scene: &Scene) -> Option<f64> {
    match &scene.particles {
        ParticleSource::RandomCube(cube) => cube.radius_of_each(),
        ParticleSource::List(list) => list.iter().map(|p| p.radius).reduce(f64::max),
        ParticleSource::File(_) | ParticleSource::Log(_) => None,
    }
}
