//! Impacts in `consistent`: instantaneous, at the end of a step, pair after pair in rounds.
//!
//! Every pair that touches and approaches faster than the rest speed gets the impulse P = m_eff (1 + e) u and its
//! friction; rounds repeat until none does. What still approaches is taken as resting: e = 0, no heat, until nothing
//! approaches. The rest speed is the scene's, or twice the approach that the fields add in the step where that is more:
//! a pair pressed together by a field would otherwise hit, and heat, anew at every step. Every impulse is a two-body impact with e <= 1, so kinetic energy never grows.

use super::friction::tangential;
use super::{ContactLaw, Touch};
use crate::domain::Domain;
use crate::impact::Impact;
use crate::state::{Columns, Particles};
use nalgebra::Vector3;

/// Rounds of impacts before what still approaches is taken as resting. A cradle of n spheres needs about n.
const MAX_ROUNDS: u64 = 200;
/// Passes over resting contacts; each takes out what the last left in its neighbours.
const MAX_PASSES: u64 = 100;
/// Passes end when nothing approaches faster than this share of the rest speed [-].
const AT_REST: f64 = 1e-6;

/// What the impacts of one step amounted to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Resolution {
    /// Contacts that approached.
    pub contacts: u64,
    /// Of those, taken as resting.
    pub resting: u64,
    /// Rounds of impacts.
    pub rounds: u64,
    /// Kinetic energy taken out by resting contacts [J].
    pub resting_loss: f64,
    /// Momentum given to the cloud by walls [N s].
    pub wall_impulse: Vector3<f64>,
}

/// One touching pair or wall, with its geometry.
#[derive(Clone, Copy, Debug)]
struct Contact {
    touch: Touch,
    normal: Vector3<f64>,
    effective_mass: f64,
    rest_speed: f64,
    rests: bool,
}

/// Particles that can be hit, and what is known about them.
#[derive(Debug)]
pub struct Bodies<'a> {
    /// Radii and masses.
    pub particles: &'a Particles,
    /// Walls and periodic directions.
    pub domain: &'a Domain,
    /// Positions [m].
    pub position: &'a Columns,
    /// Velocities, changed by impacts [m/s].
    pub velocity: &'a mut Columns,
    /// Temperatures, changed by reaction heat [K].
    pub temperature: Option<&'a mut Vec<f64>>,
    /// Accelerations by fields [m/s^2]; empty where there are none.
    pub acceleration: &'a Columns,
    /// The step that ends [s].
    pub dt: f64,
    /// Heat capacity [J/(kg K)]; without meaning where there are no temperatures.
    pub heat_capacity: f64,
}

/// Solves all impacts of a step that ends at `time`, and reports them in `impacts`.
pub fn resolve(
    law: &ContactLaw,
    touches: &[Touch],
    time: f64,
    bodies: &mut Bodies<'_>,
    impacts: &mut Vec<Impact>,
) -> Resolution {
    let mut contacts: Vec<Contact> = touches
        .iter()
        .map(|&touch| Contact::new(touch, law, bodies))
        .filter(|contact| contact.normal.iter().all(|x| x.is_finite()))
        .collect();
    let mut result = Resolution {
        contacts: contacts.iter().filter(|contact| contact.approach(bodies) > 0.0).count() as u64,
        ..Resolution::default()
    };
    while result.rounds < MAX_ROUNDS {
        let mut any = false;
        for contact in &contacts {
            let u = contact.approach(bodies);
            if u > contact.rest_speed {
                any = true;
                let impact = contact.impact(law, u, time, bodies);
                contact.book_wall(&impact, &mut result);
                impacts.push(impact);
            }
        }
        if !any {
            break;
        }
        result.rounds += 1;
    }
    for _ in 0..MAX_PASSES {
        let mut done = true;
        for contact in &mut contacts {
            let u = contact.approach(bodies);
            if u > 0.0 {
                contact.rests = true;
                done &= u <= AT_REST * contact.rest_speed;
                let rest = contact.collide(law, u, 0.0, time, bodies);
                contact.book_wall(&rest, &mut result);
                result.resting_loss += rest.normal_loss() + rest.friction_loss();
            }
        }
        if done {
            break;
        }
    }
    result.resting = contacts.iter().filter(|contact| contact.rests).count() as u64;
    result
}

impl Contact {
    fn new(touch: Touch, law: &ContactLaw, bodies: &Bodies<'_>) -> Self {
        let normal = touch.geometry(bodies.position, bodies.particles, bodies.domain).0;
        let pressed = if bodies.acceleration.is_empty() {
            0.0
        } else {
            bodies.dt * touch.relative_velocity(bodies.acceleration).dot(&normal)
        };
        Self {
            touch,
            normal,
            effective_mass: touch.effective_mass(bodies.particles),
            rest_speed: law.rest_speed.max(2.0 * pressed),
            rests: false,
        }
    }

    fn approach(&self, bodies: &Bodies<'_>) -> f64 {
        self.touch.relative_velocity(bodies.velocity).dot(&self.normal)
    }

    fn book_wall(&self, impact: &Impact, result: &mut Resolution) {
        if self.touch.j().is_none() {
            result.wall_impulse += Vector3::from(impact.tangential_impulse) - self.normal * impact.normal_impulse;
        }
    }

    /// An impact at approach speed u: restitution (35), friction (33), reaction heat (39).
    fn impact(&self, law: &ContactLaw, u: f64, time: f64, bodies: &mut Bodies<'_>) -> Impact {
        let e = law.restitution.at(u, self.touch.temperature(bodies.temperature.as_deref().map(Vec::as_slice)));
        let mut impact = self.collide(law, u, e, time, bodies);
        if let (Some(reaction), Some(temperature)) = (&law.reaction, bodies.temperature.as_deref_mut()) {
            // The duration only turns the impulse into the mean force of the reaction law.
            let force = impact.normal_impulse / law.duration(0.0);
            impact.heat = reaction.at(force, self.touch.smaller_radius(bodies.particles));
            for k in [Some(self.touch.i), self.touch.j()].into_iter().flatten() {
                temperature[k] += impact.heat / (bodies.particles.mass[k] * bodies.heat_capacity);
            }
        }
        impact
    }

    /// The mechanics of an impact with restitution e; changes velocities.
    fn collide(&self, law: &ContactLaw, u: f64, e: f64, time: f64, bodies: &mut Bodies<'_>) -> Impact {
        let n = self.normal;
        let before = self.touch.relative_velocity(bodies.velocity);
        let normal_impulse = self.effective_mass * (1.0 + e) * u;
        let (tangential_impulse, slip) = match law.friction {
            Some(friction) => {
                let (impulse, slip) = friction.impulse(-tangential(before, n) * self.effective_mass, normal_impulse);
                (impulse, Some(slip))
            }
            None => (Vector3::zeros(), None),
        };
        self.touch.kick(bodies.velocity, bodies.particles, tangential_impulse - n * normal_impulse);
        let after = self.touch.relative_velocity(bodies.velocity);
        Impact {
            time,
            particle: self.touch.i as u32,
            partner: self.touch.partner,
            normal: n.into(),
            gap_rate_before: -u,
            gap_rate_after: -after.dot(&n),
            tangential_before: tangential(before, n).into(),
            tangential_after: tangential(after, n).into(),
            restitution: e,
            normal_impulse,
            tangential_impulse: tangential_impulse.into(),
            slip,
            heat: 0.0,
            position: (bodies.position.get(self.touch.i) + n * bodies.particles.radius[self.touch.i]).into(),
        }
    }
}
