//! Events located in time within a step: impacts, and crossings of the cut-off and of the activation distance.
//!
//! Between events every particle flies on a parabola, [`paths`]. Impacts are solved in the order of time, each with all
//! contacts that touch at its instant ([`crate::contact::instant`]), and cost O(neighbours). Crossings change the force but
//! not the velocity: what the step's end would miss of them is added afterwards, [`crossings`]. Both leave schemes of
//! second order at second order. Nothing depends on the numbering of particles but the order of sums.

pub mod candidates;
pub mod crossings;
pub mod impacts;
pub mod paths;
pub mod restarts;
pub mod roots;

use crate::contact::ContactLaw;
use crate::contact::instant::Booked;
use crate::force::Field;
use crate::frame::ranks;
use crate::impact::{Impact, Partner};
use crate::integrator::Integrator;
use crate::state::Columns;
use crate::thermal::exchange::{Exchange, Exchanged};
use crossings::Crossings;
use impacts::{Impacts, Warmth};
use nalgebra::Vector3;
use paths::{Launch, Paths};

/// What the events of a step need to know of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Laws<'a> {
    /// Contact, where there is one.
    pub contact: Option<&'a ContactLaw>,
    /// Pair forces, where their jumps are to be located.
    pub field: Option<&'a Field>,
    /// The integrator's weights.
    pub integrator: &'a Integrator,
    /// Exchange of heat.
    pub exchange: Option<&'a Exchange>,
    /// Temperatures at the step's start, length n [K], with the heat capacity [J/(kg K)].
    pub warmth: Option<(&'a [f64], f64)>,
    /// Time at the step's start [s].
    pub time: f64,
}

/// What the events of a step did.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Places of the particles in an order that does not depend on their numbers, length n.
    ranks: Vec<u32>,
    paths: Paths,
    impacts: Impacts,
    crossings: Crossings,
    /// Impacts in the order of time.
    pub reports: Vec<Impact>,
    /// Contacts, rounds, losses.
    pub booked: Booked,
    /// Heat exchanged so far by particles that had impacts.
    pub exchanged: Exchanged,
    /// What events add to positions and velocities at the step's end: (particle, metres, m/s).
    pub shifts: Vec<(usize, Vector3<f64>, Vector3<f64>)>,
}

impl Events {
    /// Whether a scene has any.
    #[must_use]
    pub fn wanted(contact: Option<&ContactLaw>, field: Option<&Field>) -> bool {
        contact.is_some_and(|law| law.located) || field.is_some_and(Field::jumps)
    }

    /// No events yet, of particles in an order.
    #[must_use]
    pub fn new(order: &[u32]) -> Self {
        Self { ranks: ranks(order), ..Self::default() }
    }

    /// Goes through the events of a step whose parabolas are given by `launch`.
    pub fn pass(&mut self, laws: &Laws<'_>, launch: &Launch<'_>) {
        self.paths.start(launch.particles.len());
        self.reports.clear();
        self.shifts.clear();
        (self.booked, self.exchanged) = (Booked::default(), Exchanged::default());
        if let Some(law) = laws.contact.filter(|law| law.located) {
            let (thetas, capacity) = laws.warmth.map_or((None, f64::INFINITY), |(thetas, c)| (Some(thetas), c));
            let warmth = Warmth { thetas, capacity, exchange: laws.exchange };
            let mut outcome = impacts::Outcome {
                reports: &mut self.reports,
                booked: &mut self.booked,
                exchanged: &mut self.exchanged,
            };
            self.impacts.pass(law, laws.time, launch, (&warmth, &self.ranks), &mut self.paths, &mut outcome);
        }
        self.collect(launch);
        if let Some(field) = laws.field.filter(|field| field.jumps()) {
            self.crossings.pass((field, &self.ranks), laws.integrator, launch, &self.paths, &mut self.shifts);
        }
    }

    /// Impacts of what touches where a launch begins, and who bounced: (particle, m/s, and K where there are temperatures).
    ///
    /// # Errors
    /// A contact that stays closed from then on: particle and partner.
    #[allow(clippy::type_complexity)] // one caller
    pub fn strike(
        &mut self,
        law: &ContactLaw,
        laws: &Laws<'_>,
        launch: &Launch<'_>,
    ) -> Result<Vec<(usize, Vector3<f64>, Option<f64>)>, (usize, Partner)> {
        self.paths.start(launch.particles.len());
        self.reports.clear();
        (self.booked, self.exchanged) = (Booked::default(), Exchanged::default());
        let (thetas, capacity) = laws.warmth.map_or((None, f64::INFINITY), |(thetas, c)| (Some(thetas), c));
        let warmth = Warmth { thetas, capacity, exchange: laws.exchange };
        let mut outcome =
            impacts::Outcome { reports: &mut self.reports, booked: &mut self.booked, exchanged: &mut self.exchanged };
        let held = self.impacts.strike(law, laws.time, launch, (&warmth, &self.ranks), &mut self.paths, &mut outcome);
        let warm = |i: usize| self.impacts.warmed.iter().find(|&&(k, ..)| k == i).map(|&(_, theta, _)| theta);
        let bent = self.paths.bent.iter().map(|bent| (bent.piece.particle as usize, bent.piece.v));
        let bent = bent.map(|(i, v)| (i, v, warm(i))).collect();
        // The next step's flights are none of these.
        self.impacts.cool();
        held.map_or(Ok(bent), Err)
    }

    /// What bent paths add to those that were foreseen.
    fn collect(&mut self, launch: &Launch<'_>) {
        let dt = launch.dt;
        for bent in &self.paths.bent {
            let i = bent.piece.particle as usize;
            let (r, v, a) = (launch.position.get(i), launch.velocity.get(i), launch.acceleration(i));
            let shift = bent.piece.position(dt) - (r + (v + a * (0.5 * dt)) * dt);
            self.shifts.push((i, shift, bent.piece.velocity(dt) - (v + a * dt)));
        }
        for &(i, shift) in &self.impacts.drift {
            self.shifts.push((i, shift, Vector3::zeros()));
        }
    }

    /// Temperatures of those that had impacts, with the time in the step that each is of: (particle, K, s).
    pub fn warmed(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        self.impacts.warmed.iter().copied()
    }

    /// Number of crossings.
    #[must_use]
    pub fn crossings(&self) -> u64 {
        self.crossings.count
    }

    /// Whether some particle had so many impacts that it took a contact step.
    #[must_use]
    pub fn contact_step(&self) -> bool {
        self.impacts.worn
    }

    /// By how much crossings changed accelerations, length n [m/s^2]; `None` where there were no crossings.
    #[must_use]
    pub fn jumps(&self) -> Option<&Columns> {
        (self.crossings.count > 0).then_some(&self.crossings.jump)
    }
}
