//! The one table of channels: topic, message, and when a log has it.

use agglo_core::scene::{ParticleSource, Precision, Scene};

use crate::RecordError;

/// Largest number of particles that are drawn as spheres: viewers are smooth up to it and freeze at ten times as many.
pub const MAX_MARKERS: usize = 10_000;

/// What of a scene decides about channels and columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effects {
    /// Number of particles n [-].
    pub particles: usize,
    /// Whether particles carry charges.
    pub charge: bool,
    /// Whether there are temperatures.
    pub thermal: bool,
    /// Whether there are impacts.
    pub contact: bool,
    /// Whether clusters are counted.
    pub clusters: bool,
    /// Whether particles are drawn as coloured spheres.
    pub markers: bool,
    /// Number format of recorded states.
    pub precision: Precision,
}

impl Effects {
    /// The effects of a scene of `particles` particles.
    #[must_use]
    pub fn new(scene: &Scene, particles: usize) -> Self {
        Self {
            particles,
            charge: match &scene.particles {
                ParticleSource::RandomCube(cube) => cube.charge.is_some(),
                ParticleSource::List(list) => list.iter().any(|particle| particle.charge.is_some()),
                ParticleSource::File(_) | ParticleSource::Log(_) => false,
            },
            thermal: scene.thermal.is_some(),
            contact: scene.contact.is_some(),
            clusters: scene.binding.is_some() || scene.clusters.is_some(),
            markers: scene.record.markers > 0.0 && particles <= MAX_MARKERS,
            precision: scene.record.precision,
        }
    }

    /// The effects of a scene whose particles are known.
    ///
    /// # Errors
    /// [`RecordError::Unresolved`] where the scene still refers to a file or log.
    pub fn of(scene: &Scene) -> Result<Self, RecordError> {
        let particles = match &scene.particles {
            ParticleSource::RandomCube(cube) => cube.count as usize,
            ParticleSource::List(list) => list.len(),
            ParticleSource::File(_) | ParticleSource::Log(_) => return Err(RecordError::Unresolved),
        };
        Ok(Self::new(scene, particles))
    }
}

/// A channel of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// Radii, masses, charges.
    ParticlesStatic,
    /// Iterations and step control.
    Diagnostics,
    /// Impacts of a step.
    Impacts,
    /// States.
    Particles,
    /// Energies and momentum.
    Energy,
    /// Cluster counts.
    Clusters,
    /// Spheres, walls and box for viewers.
    Scene,
    /// Messages for people.
    Log,
    /// All that is needed to go on; last, so that a log that is carried on ends whole with it.
    Checkpoint,
}

/// A row of the table of channels.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Which channel.
    pub topic: Topic,
    /// Its name in the log.
    pub name: &'static str,
    /// Full name of its message.
    pub schema: &'static str,
    /// The message's descriptor set, as the log embeds it.
    pub descriptor: &'static [u8],
    /// When a message is written.
    pub when: &'static str,
    /// Whether a log of such a scene has the channel.
    pub present: fn(&Effects) -> bool,
}

macro_rules! channel {
    ($topic:ident, $name:literal, $schema:literal, $when:literal, $present:expr) => {
        Channel {
            topic: Topic::$topic,
            name: $name,
            schema: $schema,
            descriptor: include_bytes!(concat!("generated/", $schema, ".bin")),
            when: $when,
            present: $present,
        }
    };
}

/// All channels, in the order in which a step writes them; the order of [`Topic`].
pub const CHANNELS: [Channel; 9] = [
    channel!(ParticlesStatic, "/particles/static", "agglo.v1.ParticleStatic", "once, first", |_| true),
    channel!(Diagnostics, "/diagnostics", "agglo.v1.StepDiagnostics", "every step", |_| true),
    channel!(Impacts, "/impacts", "agglo.v1.Impacts", "every step that has any", |e| e.contact),
    channel!(Particles, "/particles", "foxglove.PointCloud", "every recorded step", |_| true),
    channel!(Energy, "/energy", "agglo.v1.EnergyLedger", "every recorded step", |_| true),
    channel!(Clusters, "/clusters", "agglo.v1.Clusters", "every recorded step", |e| e.clusters),
    channel!(Scene, "/scene", "foxglove.SceneUpdate", "recorded steps, at most at record.markers Hz", |e| e.markers),
    channel!(Log, "/log", "foxglove.Log", "warnings and notable events", |_| true),
    channel!(
        Checkpoint,
        "/checkpoint",
        "agglo.v1.Checkpoint",
        "start, before the clipped last step, every so many steps",
        |_| true
    ),
];

/// The channels that a log of such a scene has.
pub fn present(effects: &Effects) -> impl Iterator<Item = &'static Channel> {
    CHANNELS.iter().filter(|channel| (channel.present)(effects))
}

/// The channel with this name.
#[must_use]
pub fn by_name(name: &str) -> Option<&'static Channel> {
    CHANNELS.iter().find(|channel| channel.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_stand_where_their_topic_says() {
        for (k, channel) in CHANNELS.iter().enumerate() {
            assert_eq!(channel.topic as usize, k, "{}", channel.name);
        }
    }
}
