//! Impacts in `consistent`: instantaneous, at the end of a step, pair after pair in rounds.
//!
//! Every pair that touches and approaches faster than the rest speed gets the impulse P = m_eff (1 + e) u and its
//! friction; rounds repeat until none does. What still approaches is taken as resting: plastic, no heat, until nothing
//! approaches. Every impulse is a two-body impact with e <= 1, so kinetic energy never grows.
//!
//! The rest speed is the scene's, or twice the approach d dt that the fields add in the step where that is more (d the
//! acceleration that presses the pair together): such a pair would otherwise hit, and heat, anew at every step.
//!
//! A pressed contact would sink by d dt^2/2 in the next step. So each step begins with [`lift`]: impulses that are plastic
//! in u + p d dt, the mean approach during that step (p the integrator's weight of a constant acceleration). What rests
//! stays where it is and carries the force m d; the energy lent at the start of a step comes back at its end.

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
    /// Acceleration by which the fields press the two together, d [m/s^2]; negative where they pull them apart.
    pressing: f64,
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
    /// The step that ends, or begins [s].
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
    let mut contacts = contacts_of(law, touches, bodies);
    let mut result = Resolution {
        contacts: contacts.iter().filter(|contact| contact.approach(bodies) > 0.0).count() as u64,
        ..Resolution::default()
    };
    let fastest = contacts.iter().map(|contact| contact.approach(bodies)).fold(0.0, f64::max);
    // Without a floor, plastic impacts in a dense cloud would be reported down to round-off.
    let still = |contact: &Contact| AT_REST * contact.rest_speed.max(fastest);
    while result.rounds < MAX_ROUNDS {
        let mut any = false;
        for contact in &contacts {
            let u = contact.approach(bodies);
            if u > contact.rest_speed.max(still(contact)) {
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
    rest(law, &mut contacts, 0.0, time, bodies, &mut result);
    result
}

/// Impulses at the start of a step that keep pressed contacts from sinking in it; `weight` is the integrator's weight of a
/// constant acceleration in the position.
pub fn lift(law: &ContactLaw, touches: &[Touch], weight: f64, time: f64, bodies: &mut Bodies<'_>) -> Resolution {
    let mut contacts = contacts_of(law, touches, bodies);
    let mut result = Resolution::default();
    rest(law, &mut contacts, weight * bodies.dt, time, bodies, &mut result);
    result
}

fn contacts_of(law: &ContactLaw, touches: &[Touch], bodies: &Bodies<'_>) -> Vec<Contact> {
    touches
        .iter()
        .map(|&touch| Contact::new(touch, law, bodies))
        .filter(|contact| contact.normal.iter().all(|x| x.is_finite()))
        .collect()
}

/// Plastic impulses until u + ahead d <= 0 at every contact.
fn rest(
    law: &ContactLaw,
    contacts: &mut [Contact],
    ahead: f64,
    time: f64,
    bodies: &mut Bodies<'_>,
    result: &mut Resolution,
) {
    let mean = |contact: &Contact, bodies: &Bodies<'_>| contact.approach(bodies) + ahead * contact.pressing;
    let fastest = contacts.iter().map(|contact| mean(contact, bodies)).fold(0.0, f64::max);
    for _ in 0..MAX_PASSES {
        let mut done = true;
        for contact in &mut *contacts {
            let mean = mean(contact, bodies);
            if mean > 0.0 {
                contact.rests = true;
                done &= mean <= AT_REST * contact.rest_speed.max(fastest);
                let u = contact.approach(bodies);
                let rest = contact.collide(law, (u, mean), time, bodies);
                contact.book_wall(&rest, result);
                result.resting_loss += rest.normal_loss() + rest.friction_loss();
            }
        }
        if done {
            break;
        }
    }
    result.resting = contacts.iter().filter(|contact| contact.rests).count() as u64;
}

impl Contact {
    fn new(touch: Touch, law: &ContactLaw, bodies: &Bodies<'_>) -> Self {
        let normal = touch.geometry(bodies.position, bodies.particles, bodies.domain).0;
        let pressing = if bodies.acceleration.is_empty() {
            0.0
        } else {
            touch.relative_velocity(bodies.acceleration).dot(&normal)
        };
        Self {
            touch,
            normal,
            effective_mass: touch.effective_mass(bodies.particles),
            pressing,
            rest_speed: law.rest_speed.max(2.0 * bodies.dt * pressing),
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
        let mut impact = self.collide(law, (u, (1.0 + e) * u), time, bodies);
        impact.restitution = e;
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

    /// The mechanics of an impact at approach u that changes the approach by `change`; changes velocities.
    fn collide(&self, law: &ContactLaw, (u, change): (f64, f64), time: f64, bodies: &mut Bodies<'_>) -> Impact {
        let n = self.normal;
        let before = self.touch.relative_velocity(bodies.velocity);
        let normal_impulse = self.effective_mass * change;
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
            restitution: 0.0,
            normal_impulse,
            tangential_impulse: tangential_impulse.into(),
            slip,
            heat: 0.0,
            position: (bodies.position.get(self.touch.i) + n * bodies.particles.radius[self.touch.i]).into(),
        }
    }
}
