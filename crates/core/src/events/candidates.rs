//! Pairs and walls that may touch during a step, found once at its start and added to where an impact speeds someone up.

use super::paths::{Launch, image};
use crate::cells::Cells;
use crate::contact::Touch;
use crate::contact::search::{TOUCHING, cells, visit_close_in};
use crate::impact::Partner;
use nalgebra::Vector3;

/// End of a chain.
const END: u32 = u32::MAX;
/// Reach over the step of a slow particle, in root mean square speeds [-]: impacts may speed it up. A gas of hard spheres is
/// solved fastest from 1.0 to 1.3; more makes candidates that never meet, less has too many widened.
const RESERVE: f64 = 1.2;

/// Candidates of a step. Each particle has a chain of those it takes part in.
#[derive(Clone, Debug, Default)]
pub struct Candidates {
    /// Who may touch whom.
    pub touches: Vec<Touch>,
    /// What takes each separation at the step's start to its minimum image [m].
    pub shifts: Vec<Vector3<f64>>,
    /// How far each particle may get from where it starts, length n [m].
    pub reach: Vec<f64>,
    head: Vec<u32>,
    /// Next candidate in the chain of i and in that of its partner.
    next: Vec<[u32; 2]>,
    /// Radius and reach of every particle, length n [m], at the step's start.
    grown: Vec<f64>,
    /// The largest of them, of those that have been widened too [m].
    largest: f64,
    /// Where they were found; `None`: by looking at all.
    cells: Option<Cells>,
}

impl Candidates {
    /// Finds them for a step.
    pub fn find(&mut self, launch: &Launch<'_>) {
        let n = launch.particles.len();
        self.touches.clear();
        self.shifts.clear();
        self.next.clear();
        self.head.clear();
        self.head.resize(n, END);
        self.measure(launch);
        self.grown.clear();
        self.grown.extend(
            launch.particles.radius.iter().zip(&self.reach).map(|(b, reach)| b * (1.0 + 2.0 * TOUCHING) + reach),
        );
        self.largest = self.grown.iter().copied().fold(0.0, f64::max);
        let (touches, grown, periodic) = (&mut self.touches, &self.grown, &launch.domain.periodic);
        self.cells = cells(launch.position, grown, periodic, 1.0);
        visit_close_in(self.cells.as_ref(), launch.position, grown, periodic, 1.0, |pair| {
            touches.push(Touch { i: pair.i as usize, partner: Partner::Particle(pair.j) });
        });
        for (w, wall) in launch.domain.walls.iter().enumerate() {
            for i in 0..n {
                if wall.distance(&launch.position.get(i)) <= self.grown[i] {
                    self.touches.push(Touch { i, partner: Partner::Wall(w as u32) });
                }
            }
        }
        for k in 0..self.touches.len() {
            self.link(launch, k);
        }
    }

    /// |v| dt + |a| dt^2/2, or a little more for the slow.
    fn measure(&mut self, launch: &Launch<'_>) {
        let (dt, n) = (launch.dt, launch.particles.len());
        let squares: f64 = (0..n).map(|i| launch.velocity.get(i).norm_squared()).sum();
        let least = RESERVE * (squares / n as f64).sqrt() * dt;
        self.reach.clear();
        self.reach.extend((0..n).map(|i| {
            let far = launch.velocity.get(i).norm() * dt + 0.5 * dt * dt * launch.acceleration(i).norm();
            far.max(least)
        }));
    }

    fn link(&mut self, launch: &Launch<'_>, k: usize) {
        let touch = self.touches[k];
        self.shifts.push(touch.j().map_or(Vector3::zeros(), |j| image(launch, touch.i, j)));
        let first = std::mem::replace(&mut self.head[touch.i], k as u32);
        let second = touch.j().map_or(END, |j| std::mem::replace(&mut self.head[j], k as u32));
        self.next.push([first, second]);
    }

    /// The first candidate of particle i, to be followed by [`Candidates::after`].
    #[must_use]
    pub fn first(&self, i: usize) -> Option<usize> {
        let k = self.head[i];
        (k != END).then_some(k as usize)
    }

    /// The next candidate of particle i after candidate k.
    #[must_use]
    pub fn after(&self, i: usize, k: usize) -> Option<usize> {
        let next = self.next[k][usize::from(self.touches[k].i != i)];
        (next != END).then_some(next as usize)
    }

    /// Widens the reach of a particle that an impact has sent farther than foreseen; returns whether there are new ones.
    pub fn widen(&mut self, launch: &Launch<'_>, i: usize, reach: f64) -> bool {
        if reach <= self.reach[i] {
            return false;
        }
        self.reach[i] = reach;
        let known = self.touches.len();
        let (r, radius) = (launch.position.get(i), &launch.particles.radius);
        for j in self.near(launch, i) {
            self.touches.push(Touch { i: i.min(j), partner: Partner::Particle(i.max(j) as u32) });
        }
        self.largest = self.largest.max(radius[i] * (1.0 + 2.0 * TOUCHING) + reach);
        for (w, wall) in launch.domain.walls.iter().enumerate() {
            let touch = Touch { i, partner: Partner::Wall(w as u32) };
            if wall.distance(&r) <= radius[i] + reach && !self.chain(i).any(|k| self.touches[k] == touch) {
                self.touches.push(touch);
            }
        }
        for k in known..self.touches.len() {
            self.link(launch, k);
        }
        self.touches.len() > known
    }

    /// Particles whose own reach meets that of particle i and that are no candidates yet, ascending.
    fn near(&self, launch: &Launch<'_>, i: usize) -> Vec<usize> {
        let (radius, periodic) = (&launch.particles.radius, &launch.domain.periodic);
        let own = radius[i] + self.reach[i];
        let close = |&j: &usize| {
            let reach = own + radius[j] + self.reach[j];
            j != i && periodic.separation(launch.position, i, j).norm_squared() <= reach * reach && !self.holds(i, j)
        };
        let mut found: Vec<usize> = match &self.cells {
            Some(cells) if own + self.largest <= cells.reach() => {
                let places = cells.near(launch.position, i).flatten();
                places.map(|place| cells.order()[place] as usize).filter(close).collect()
            }
            _ => (0..radius.len()).filter(close).collect(),
        };
        found.sort_unstable();
        found
    }

    /// All candidates of particle i.
    pub fn chain(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.first(i), move |&k| self.after(i, k))
    }

    fn holds(&self, i: usize, j: usize) -> bool {
        let touch = Touch { i: i.min(j), partner: Partner::Particle(i.max(j) as u32) };
        self.chain(i).any(|k| self.touches[k] == touch)
    }
}
