//! Contacts in `paper`: seen on an iterate, held to the end of the step, acting as mean forces (28), (29), (33).
//!
//! Testing contact on every iterate anew, as the paper's Remark 1 has it, never converges: the impulse removes the
//! overlap that caused it. So a pair is latched for the step once it is seen touching and approaching.

use super::friction::tangential;
use super::normal::{self, Side};
use super::{ContactLaw, Touch};
use crate::domain::Domain;
use crate::impact::Impact;
use crate::state::{Columns, Particles};
use nalgebra::Vector3;

/// A latched contact, and what it does in the current iteration.
#[derive(Clone, Copy, Debug)]
pub struct Latched {
    touch: Touch,
    normal: Vector3<f64>,
    restitution: f64,
    normal_impulse: f64,
    tangential_impulse: Vector3<f64>,
    slip: bool,
    heat: f64,
}

/// All latched contacts of a step, in ascending order.
#[derive(Clone, Debug, Default)]
pub struct LatchedContacts {
    contacts: Vec<Latched>,
}

/// What contacts act on: positions of the last iterate [m], velocities at the step's start [m/s], the field's forces on
/// the last iterate [N], temperatures of the last iterate [K].
#[derive(Clone, Copy, Debug)]
pub struct Situation<'a> {
    /// Radii and masses.
    pub particles: &'a Particles,
    /// Walls and periodic directions.
    pub domain: &'a Domain,
    /// Positions of the last iterate [m].
    pub position: &'a Columns,
    /// Velocities at the step's start [m/s].
    pub velocity: &'a Columns,
    /// Forces of the field and from outside on the last iterate [N].
    pub field_force: Option<&'a Columns>,
    /// Temperatures of the last iterate [K].
    pub temperature: Option<&'a [f64]>,
}

impl LatchedContacts {
    /// Lets go of all.
    pub fn clear(&mut self) {
        self.contacts.clear();
    }

    /// Number of latched contacts.
    #[must_use]
    pub fn len(&self) -> usize {
        self.contacts.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.contacts.is_empty()
    }

    /// Latches those of the touching pairs and walls that approach and are not latched yet.
    pub fn latch(&mut self, touches: &[Touch], at: &Situation<'_>) {
        let order = |touch: &Touch| match touch.partner {
            crate::impact::Partner::Particle(j) => (0, touch.i, j),
            crate::impact::Partner::Wall(w) => (1 + w, touch.i, 0),
        };
        for &touch in touches {
            let Err(place) = self.contacts.binary_search_by_key(&order(&touch), |held| order(&held.touch)) else {
                continue;
            };
            let (normal, _) = touch.geometry(at.position, at.particles, at.domain);
            if touch.relative_velocity(at.velocity).dot(&normal) > 0.0 {
                self.contacts.insert(
                    place,
                    Latched {
                        touch,
                        normal,
                        restitution: 0.0,
                        normal_impulse: 0.0,
                        tangential_impulse: Vector3::zeros(),
                        slip: false,
                        heat: 0.0,
                    },
                );
            }
        }
    }

    /// Adds the mean contact forces over a step of dt to `force` [N] and reaction heat to `heat` [J].
    pub fn act(
        &mut self,
        law: &ContactLaw,
        at: &Situation<'_>,
        dt: f64,
        force: &mut Columns,
        mut heat: Option<&mut [f64]>,
    ) {
        let duration = law.duration(dt);
        let field = |i: usize| at.field_force.map_or_else(Vector3::zeros, |force| force.get(i));
        for held in &mut self.contacts {
            let Touch { i, .. } = held.touch;
            let j = held.touch.j();
            let (n, _) = held.touch.geometry(at.position, at.particles, at.domain);
            let relative = held.touch.relative_velocity(at.velocity);
            let e = law.restitution.at(relative.dot(&n), held.touch.temperature(at.temperature));
            let (dt1, dt2) = normal::phases(duration, e);
            let side = |k: usize| Side {
                inverse_mass: 1.0 / at.particles.mass[k],
                velocity: at.velocity.get(k).dot(&n),
                compression: field(k).dot(&n) * dt1,
                recovery: field(k).dot(&n) * dt2,
            };
            let wall = Side { inverse_mass: 0.0, velocity: 0.0, compression: 0.0, recovery: 0.0 };
            let impulse = normal::impulse(&side(i), &j.map_or(wall, side), e);
            (held.normal, held.restitution, held.normal_impulse) = (n, e, impulse);
            (held.tangential_impulse, held.slip) = match law.friction {
                Some(friction) if impulse > 0.0 => {
                    let pull = |k: usize| field(k) / at.particles.mass[k];
                    let sliding = relative + (pull(i) - j.map_or_else(Vector3::zeros, pull)) * duration;
                    let stick = -tangential(sliding, n) * held.touch.effective_mass(at.particles);
                    friction.impulse(stick, impulse)
                }
                _ => (Vector3::zeros(), false),
            };
            let on_i = (held.tangential_impulse - n * impulse) / dt;
            force.add(i, on_i);
            if let Some(j) = j {
                force.add(j, -on_i);
            }
            held.heat = match (&law.reaction, &mut heat) {
                (Some(reaction), Some(heat)) if impulse > 0.0 => {
                    let each = reaction.at(impulse / duration, held.touch.smaller_radius(at.particles));
                    heat[i] += each;
                    if let Some(j) = j {
                        heat[j] += each;
                    }
                    each
                }
                _ => 0.0,
            };
        }
    }

    /// Reports the contacts that pushed, with velocities before and after the step.
    pub fn report(
        &self,
        time: f64,
        particles: &Particles,
        position: &Columns,
        (before, after): (&Columns, &Columns),
        has_friction: bool,
        impacts: &mut Vec<Impact>,
    ) {
        for held in self.contacts.iter().filter(|held| held.normal_impulse > 0.0) {
            let (w_before, w_after) = (held.touch.relative_velocity(before), held.touch.relative_velocity(after));
            impacts.push(Impact {
                time,
                particle: held.touch.i as u32,
                partner: held.touch.partner,
                normal: held.normal.into(),
                gap_rate_before: -w_before.dot(&held.normal),
                gap_rate_after: -w_after.dot(&held.normal),
                tangential_before: tangential(w_before, held.normal).into(),
                tangential_after: tangential(w_after, held.normal).into(),
                restitution: held.restitution,
                normal_impulse: held.normal_impulse,
                tangential_impulse: held.tangential_impulse.into(),
                slip: has_friction.then_some(held.slip),
                heat: held.heat,
                position: (position.get(held.touch.i) + held.normal * particles.radius[held.touch.i]).into(),
            });
        }
    }
}
