//! What a decoded message must be like to be one of its scene.

use agglo_core::checkpoint::Checkpoint;
use agglo_core::impact::{Impact, Partner};
use agglo_core::observer::Clusters;
use agglo_core::scene::Scene;
use agglo_core::state::{Columns, Particles, State};
use agglo_record::channels::{CHANNELS, Effects};

use crate::Frame;
use crate::messages::{Entry, Message};

/// Numbers of particles and walls, and the columns that the scene has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    particles: usize,
    walls: usize,
    charge: bool,
    thermal: bool,
    clusters: bool,
}

impl Shape {
    /// The shape of the messages of a scene.
    pub fn new(scene: &Scene, effects: &Effects) -> Self {
        let Effects { particles, charge, thermal, contact: _, clusters, markers: _, precision: _ } = *effects;
        let walls = scene.domain.as_ref().map_or(0, |domain| domain.walls.len());
        Self { particles, walls, charge, thermal, clusters }
    }

    /// What of a message makes no sense, as a sentence.
    pub fn fault(&self, entry: &Entry) -> Option<String> {
        let what = match &entry.message {
            Message::Static(particles) => self.particles(particles),
            Message::Particles(frame) => self.frame(frame),
            Message::Impacts(impacts) => self.impacts(impacts),
            Message::Clusters(clusters) => self.clusters(clusters),
            Message::Checkpoint(checkpoint) => self.checkpoint(checkpoint),
            Message::Diagnostics(_) | Message::Energy(..) | Message::Log(_) | Message::Scene => None,
        }?;
        let name = CHANNELS[entry.message.topic() as usize].name;
        Some(format!("the message on {name} at t = {} s, step {}, {what}", entry.t, entry.step))
    }

    fn particles(&self, Particles { radius, mass, charge }: &Particles) -> Option<String> {
        let n = self.particles;
        if radius.len() != n || mass.len() != n {
            return Some(format!("is of {} particles, and the scene has {n}", radius.len()));
        }
        let size = |values: &[f64]| values.iter().position(|value| !(value.is_finite() && *value > 0.0));
        if let Some(particle) = size(radius).or_else(|| size(mass)) {
            let (radius, mass) = (radius[particle], mass[particle]);
            return Some(format!("gives particle {particle} the radius {radius} m and the mass {mass} kg"));
        }
        (charge.is_some() != self.charge).then(|| "has other columns than the scene".to_owned())
    }

    fn frame(&self, Frame { t: _, step: _, position, velocity: _, temperature, cluster }: &Frame) -> Option<String> {
        let n = self.particles;
        if position.len() != n {
            return Some(format!("has {} rows, and the scene {n} particles", position.len()));
        }
        let fits = temperature.is_some() == self.thermal && cluster.is_some() == self.clusters;
        (!fits).then(|| "has other columns than the scene".to_owned())
    }

    fn impacts(&self, impacts: &[Impact]) -> Option<String> {
        if impacts.is_empty() {
            return Some("holds no impact".to_owned());
        }
        let (n, walls) = (self.particles, self.walls);
        impacts.iter().find_map(|impact| {
            let i = impact.particle;
            match impact.partner {
                _ if i as usize >= n => Some(format!("is of particle {i}, and the scene has {n}")),
                Partner::Particle(j) if j as usize >= n => Some(format!("is of particle {j}, and the scene has {n}")),
                Partner::Particle(j) if j == i => Some(format!("lets particle {i} hit itself")),
                Partner::Wall(wall) if wall as usize >= walls => {
                    Some(format!("is of wall {wall}, and the scene has {walls}"))
                }
                _ => None,
            }
        })
    }

    fn clusters(&self, Clusters { of: _, count, largest, singletons, mean_size: _ }: &Clusters) -> Option<String> {
        let n = self.particles as u64;
        [count, largest, singletons]
            .into_iter()
            .find(|number| u64::from(**number) > n)
            .map(|number| format!("counts {number}, and the scene has {n} particles"))
    }

    fn checkpoint(&self, checkpoint: &Checkpoint) -> Option<String> {
        let n = self.particles;
        let State { position, velocity, temperature } = &checkpoint.state;
        if position.len() != n || velocity.len() != n {
            return Some(format!("holds {} particles, and the scene has {n}", position.len()));
        }
        let all_or_none = |columns: &Columns| columns.len() == n || columns.is_empty();
        let fits = temperature.as_ref().map(Vec::len) == self.thermal.then_some(n)
            && all_or_none(&checkpoint.acceleration)
            && all_or_none(&checkpoint.list_positions);
        (!fits).then(|| "has other columns than the scene".to_owned())
    }
}
