//! Motion within one step: every particle on a parabola of its own, r(tau) = r + v tau + a tau^2/2, bent by events.
//!
//! Particles without events are read from the columns that the step starts from; only those with events take space here.
//! Positions are not wrapped during a step: separations begin as minimum images and go on from there.

use super::roots::first_closing;
use crate::contact::Touch;
use crate::domain::Domain;
use crate::impact::Partner;
use crate::math::round;
use crate::state::{Columns, Particles};
use nalgebra::Vector3;

/// What becomes of a gap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Closing {
    /// It is closed.
    Closed,
    /// It closes at this time in the step [s].
    At(f64),
    /// It stays open.
    Never,
}

/// No entry.
const NONE: u32 = u32::MAX;

/// What a step starts from, and the accelerations of its parabolas.
#[derive(Clone, Copy, Debug)]
pub struct Launch<'a> {
    /// Radii, masses.
    pub particles: &'a Particles,
    /// Walls and periodic directions.
    pub domain: &'a Domain,
    /// r at tau = 0 [m].
    pub position: &'a Columns,
    /// v at tau = 0 [m/s].
    pub velocity: &'a Columns,
    /// a of the whole step [m/s^2]; empty where there are no fields.
    pub acceleration: &'a Columns,
    /// The step [s].
    pub dt: f64,
}

impl Launch<'_> {
    /// The farthest that any particle gets on its parabola [m].
    #[must_use]
    pub fn travel(&self) -> f64 {
        let dt = self.dt;
        let far = |i: usize| self.velocity.get(i).norm() * dt + 0.5 * dt * dt * self.acceleration(i).norm();
        (0..self.position.len()).map(far).fold(0.0, f64::max)
    }

    /// a of particle i [m/s^2].
    #[must_use]
    pub fn acceleration(&self, i: usize) -> Vector3<f64> {
        if self.acceleration.is_empty() { Vector3::zeros() } else { self.acceleration.get(i) }
    }
}

/// A parabola from one event to the next.
#[derive(Clone, Copy, Debug)]
pub struct Piece {
    /// Whose.
    pub particle: u32,
    /// From when on, in the step [s].
    pub since: f64,
    /// Position at `since` [m].
    pub r: Vector3<f64>,
    /// Velocity at `since` [m/s].
    pub v: Vector3<f64>,
    /// Acceleration [m/s^2].
    pub a: Vector3<f64>,
}

impl Piece {
    /// r(tau) [m].
    #[must_use]
    #[inline]
    pub fn position(&self, tau: f64) -> Vector3<f64> {
        let t = tau - self.since;
        self.r + (self.v + self.a * (0.5 * t)) * t
    }

    /// v(tau) [m/s].
    #[must_use]
    pub fn velocity(&self, tau: f64) -> Vector3<f64> {
        self.v + self.a * (tau - self.since)
    }
}

/// What is particular about a particle that had events.
#[derive(Clone, Copy, Debug)]
pub struct Bent {
    /// Where it is going now.
    pub piece: Piece,
    /// Impacts that it took part in during the step.
    pub impacts: u32,
}

/// The paths of all particles.
#[derive(Clone, Debug, Default)]
pub struct Paths {
    /// Row of a particle in `bent`, length n.
    row: Vec<u32>,
    /// Particles that had events, in the order of their first.
    pub bent: Vec<Bent>,
    /// Pieces that came to an end, in the order of time.
    pub past: Vec<Piece>,
}

impl Paths {
    /// Forgets the last step.
    pub fn start(&mut self, n: usize) {
        if self.row.len() != n {
            self.row.clear();
            self.row.resize(n, NONE);
        }
        for bent in self.bent.drain(..) {
            self.row[bent.piece.particle as usize] = NONE;
        }
        self.past.clear();
    }

    /// Whether particle i had an event.
    #[must_use]
    pub fn is_bent(&self, i: usize) -> bool {
        self.row[i] != NONE
    }

    /// Where particle i is going now.
    #[must_use]
    #[inline(always)]
    pub fn piece(&self, launch: &Launch<'_>, i: usize) -> Piece {
        match self.row[i] {
            NONE => Piece {
                particle: i as u32,
                since: 0.0,
                r: launch.position.get(i),
                v: launch.velocity.get(i),
                a: launch.acceleration(i),
            },
            row => self.bent[row as usize].piece,
        }
    }

    /// Impacts of particle i in this step.
    #[must_use]
    pub fn impacts(&self, i: usize) -> u32 {
        if self.is_bent(i) { self.bent[self.row[i] as usize].impacts } else { 0 }
    }

    /// Sends particle i, at tau, on with another velocity and acceleration.
    pub fn bend(&mut self, launch: &Launch<'_>, i: usize, tau: f64, v: Vector3<f64>, a: Vector3<f64>) {
        let old = self.piece(launch, i);
        let piece = Piece { particle: i as u32, since: tau, r: old.position(tau), v, a };
        if self.is_bent(i) {
            self.past.push(old);
            self.bent[self.row[i] as usize].piece = piece;
        } else {
            self.row[i] = self.bent.len() as u32;
            self.past.push(old);
            self.bent.push(Bent { piece, impacts: 0 });
        }
    }

    /// Counts an impact of a particle that has been bent.
    pub fn count(&mut self, i: usize) {
        if self.is_bent(i) {
            self.bent[self.row[i] as usize].impacts += 1;
        }
    }

    /// The pieces of particle i from `from` on, in the order of time, each with its end.
    pub fn pieces(&self, launch: &Launch<'_>, i: usize) -> Vec<(Piece, f64)> {
        let current = self.piece(launch, i);
        let mut pieces: Vec<Piece> = Vec::new();
        if self.is_bent(i) {
            pieces.extend(self.past.iter().filter(|piece| piece.particle as usize == i));
        }
        pieces.push(current);
        let ends = pieces.iter().skip(1).map(|piece| piece.since).chain([launch.dt]).collect::<Vec<_>>();
        pieces.into_iter().zip(ends).collect()
    }

    fn straight(&self, launch: &Launch<'_>, i: &Piece, j: &Piece) -> bool {
        launch.acceleration.is_empty() && i.a == Vector3::zeros() && j.a == Vector3::zeros()
    }

    /// Vector from i to its partner's centre, or to the nearest point of a wall, at tau [m]; `shift` takes the separation to
    /// its minimum image.
    #[must_use]
    #[inline]
    pub fn separation(&self, launch: &Launch<'_>, touch: Touch, shift: &Vector3<f64>, tau: f64) -> Vector3<f64> {
        let i = self.piece(launch, touch.i).position(tau);
        match touch.partner {
            Partner::Particle(j) => shift + self.piece(launch, j as usize).position(tau) - i,
            Partner::Wall(w) => {
                let wall = &launch.domain.walls[w as usize];
                -wall.normal * wall.distance(&i)
            }
        }
    }

    /// When, after `from` and before the step's end, a gap closes.
    ///
    /// A gap that is open by no more than `touching` [m] is closed; where it has been `solved`, it is at rest there, and what
    /// counts is whether it closes again.
    #[must_use]
    pub fn closing(
        &self,
        launch: &Launch<'_>,
        touch: Touch,
        shift: &Vector3<f64>,
        from: f64,
        (touching, solved): (f64, bool),
    ) -> Closing {
        let h = launch.dt - from;
        if let (Partner::Particle(j), true) = (touch.partner, launch.acceleration.is_empty()) {
            let unbent = self.row[touch.i] == NONE && self.row[j as usize] == NONE;
            if unbent && from == 0.0 && !solved {
                return first_meeting(launch, touch.i, j as usize, shift, touching);
            }
        }
        let i = self.piece(launch, touch.i);
        let (r, v) = (i.position(from), i.velocity(from));
        let tau = match touch.partner {
            Partner::Particle(number) => {
                let number = number as usize;
                let j = self.piece(launch, number);
                let d = (j.position(from) - r) + shift;
                let w = j.velocity(from) - v;
                let a = j.a - i.a;
                let sum = launch.particles.radius[touch.i] + launch.particles.radius[number];
                let open = d.norm_squared() - sum * sum;
                let closed = open <= 2.0 * touching * sum;
                if closed && !solved {
                    return Closing::Closed;
                }
                if self.straight(launch, &i, &j) {
                    // Touching, and solved: straight flights part for good.
                    if closed {
                        return Closing::Never;
                    }
                    return Closing::by(from, meeting(&d, &w, sum, open).filter(|&tau| tau <= h));
                }
                let mut c = [open, 2.0 * d.dot(&w), w.norm_squared() + d.dot(&a), w.dot(&a), 0.25 * a.norm_squared()];
                if closed {
                    at_rest(&mut c);
                }
                first_closing(&c, h)
            }
            Partner::Wall(w) => {
                let wall = &launch.domain.walls[w as usize];
                let open = wall.distance(&r) - launch.particles.radius[touch.i];
                let mut c = [open, v.dot(&wall.normal), 0.5 * i.a.dot(&wall.normal)];
                if open <= touching {
                    if !solved {
                        return Closing::Closed;
                    }
                    at_rest(&mut c);
                }
                first_closing(&c, h)
            }
        };
        Closing::by(from, tau)
    }
}

impl Closing {
    /// A time after `from`, if there is one.
    fn by(from: f64, tau: Option<f64>) -> Self {
        tau.map_or(Self::Never, |tau| Self::At(from + tau))
    }
}

/// [`Paths::closing`] of two on straight flights from the step's start on, most of whom never meet.
#[inline]
fn first_meeting(launch: &Launch<'_>, i: usize, j: usize, shift: &Vector3<f64>, touching: f64) -> Closing {
    let d = (launch.position.get(j) - launch.position.get(i)) + shift;
    let w = launch.velocity.get(j) - launch.velocity.get(i);
    let sum = launch.particles.radius[i] + launch.particles.radius[j];
    let open = d.norm_squared() - sum * sum;
    if open <= 2.0 * touching * sum {
        return Closing::Closed;
    }
    Closing::by(0.0, meeting(&d, &w, sum, open).filter(|&tau| tau <= launch.dt))
}

/// When two on straight flights, d apart with relative velocity w, come to a distance; `open` = d^2 - distance^2.
fn meeting(d: &Vector3<f64>, w: &Vector3<f64>, distance: f64, open: f64) -> Option<f64> {
    let approach = -d.dot(w);
    let square = w.norm_squared();
    if approach <= 0.0 {
        return None;
    }
    // The distance at which they would pass each other tells more precisely than a discriminant whether they meet.
    let passing = d + w * (approach / square);
    let chord = distance * distance - passing.norm_squared();
    (chord > 0.0).then(|| open / (approach + (square * chord).sqrt()))
}

/// A touching pair has been solved: it is neither inside its partner nor approaching.
pub(super) fn at_rest<const N: usize>(coefficients: &mut [f64; N]) {
    coefficients[0] = coefficients[0].max(0.0);
    coefficients[1] = coefficients[1].max(0.0);
}

/// What takes r_j - r_i at the step's start to its minimum image [m].
#[must_use]
pub fn image(launch: &Launch<'_>, i: usize, j: usize) -> Vector3<f64> {
    let periodic = &launch.domain.periodic;
    if !periodic.any() {
        return Vector3::zeros();
    }
    let d = launch.position.get(j) - launch.position.get(i);
    Vector3::from_fn(|axis, _| -periodic.length[axis] * round(d[axis] * periodic.inverse[axis]))
}
