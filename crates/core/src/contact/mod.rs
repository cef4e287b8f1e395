//! Contact: who touches ([`search`]), what one impact does ([`normal`], [`friction`], [`restitution`]), and how all
//! impacts of a step are solved: [`latched`] in `paper`, [`resolve`] in `consistent`. The three are apart so that each
//! can be replaced by itself.

pub mod complementarity;
pub mod friction;
pub mod instant;
pub mod latched;
pub mod normal;
pub mod resolve;
pub mod restitution;
pub mod search;

use crate::assembly::locates;
use crate::domain::Wall;
use crate::impact::Partner;
use crate::scene::{self, ContactResolution, ImpactDuration, ModelKind};
use crate::state::{Columns, Particles};
use crate::thermal::reaction::ReactionHeat;
use friction::Friction;
use nalgebra::Vector3;
use restitution::Restitution;

/// Approaches slower than this are taken as resting where the scene does not say [m/s].
pub const REST_SPEED: f64 = 0.01;

/// The contact laws of a scene.
#[derive(Clone, Debug)]
pub struct ContactLaw {
    /// Restitution (35).
    pub restitution: Restitution,
    /// Friction (32)-(33).
    pub friction: Option<Friction>,
    /// Duration of an impact.
    pub duration: Option<ImpactDuration>,
    /// Reaction heat (39).
    pub reaction: Option<ReactionHeat>,
    /// Approaches slower than this are taken as resting, in `consistent` [m/s].
    pub rest_speed: f64,
    /// Whether impacts happen at their own instants, not at the ends of steps.
    pub located: bool,
}

impl ContactLaw {
    /// From a scene; `None` where it has no contact.
    #[must_use]
    pub fn new(scene: &scene::Scene) -> Option<Self> {
        let contact = scene.contact.as_ref()?;
        Some(Self {
            restitution: Restitution::new(contact.restitution),
            friction: contact.friction.map(Friction::new),
            duration: contact.duration,
            reaction: scene.thermal.as_ref().and_then(ReactionHeat::new),
            rest_speed: contact.rest_speed.unwrap_or(REST_SPEED),
            located: match contact.resolution {
                Some(resolution) => scene.model == ModelKind::Consistent && resolution == ContactResolution::Located,
                None => locates(scene),
            },
        })
    }

    /// Duration of an impact in a step of dt [s]; 0 where the scene gives none.
    #[must_use]
    pub fn duration(&self, dt: f64) -> f64 {
        match self.duration {
            Some(ImpactDuration::StepFraction(fraction)) => fraction * dt,
            Some(ImpactDuration::Seconds(seconds)) => seconds,
            None => 0.0,
        }
    }
}

/// One particle touching another or a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Particle i.
    pub i: usize,
    /// Its partner.
    pub partner: Partner,
}

impl Touch {
    /// Particle j; `None` for a wall.
    #[must_use]
    pub fn j(&self) -> Option<usize> {
        match self.partner {
            Partner::Particle(j) => Some(j as usize),
            Partner::Wall(_) => None,
        }
    }

    /// The partner's number among its kind.
    #[must_use]
    pub fn partner_number(&self) -> u32 {
        match self.partner {
            Partner::Particle(number) | Partner::Wall(number) => number,
        }
    }

    /// v_i - v_j of velocities [m/s], or of accelerations [m/s^2]; walls stand still.
    #[must_use]
    pub fn relative_velocity(&self, v: &Columns) -> Vector3<f64> {
        self.j().map_or(v.get(self.i), |j| v.get(self.i) - v.get(j))
    }

    /// m_i m_j / (m_i + m_j), or m_i against a wall [kg].
    #[must_use]
    pub fn effective_mass(&self, particles: &Particles) -> f64 {
        let m_i = particles.mass[self.i];
        self.j().map_or(m_i, |j| (m_i * particles.mass[j]) / (m_i + particles.mass[j]))
    }

    /// Mean temperature of those that take part; a wall's does not count [K].
    #[must_use]
    pub fn temperature(&self, temperature: Option<&[f64]>) -> Option<f64> {
        let temperature = temperature?;
        Some(self.j().map_or(temperature[self.i], |j| 0.5 * (temperature[self.i] + temperature[j])))
    }

    /// The smaller radius [m].
    #[must_use]
    pub fn smaller_radius(&self, particles: &Particles) -> f64 {
        self.j().map_or(particles.radius[self.i], |j| particles.radius[self.i].min(particles.radius[j]))
    }

    /// Unit normal n_ij from i to its partner, and the gap between the surfaces [m].
    #[must_use]
    pub fn geometry(&self, r: &Columns, particles: &Particles, domain: &crate::domain::Domain) -> (Vector3<f64>, f64) {
        match self.partner {
            Partner::Particle(j) => {
                let d = domain.periodic.separation(r, self.i, j as usize);
                let s = d.norm();
                (d / s, s - (particles.radius[self.i] + particles.radius[j as usize]))
            }
            Partner::Wall(w) => {
                let wall: &Wall = &domain.walls[w as usize];
                (-wall.normal, wall.distance(&r.get(self.i)) - particles.radius[self.i])
            }
        }
    }

    /// Gives impulse p to i and -p to its partner.
    pub fn kick(&self, v: &mut Columns, particles: &Particles, p: Vector3<f64>) {
        v.add(self.i, p / particles.mass[self.i]);
        if let Some(j) = self.j() {
            v.add(j, -p / particles.mass[j]);
        }
    }
}
