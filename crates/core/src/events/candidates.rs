//! Pairs and walls that may touch during a step, found once at its start and added to where an impact speeds someone up.

use super::paths::{Launch, image};
use crate::contact::Touch;
use crate::contact::search::{TOUCHING, visit_close};
use crate::impact::Partner;
use crate::simd::{Task, vectorized};
use nalgebra::Vector3;

/// End of a chain.
const END: u32 = u32::MAX;
/// Particles looked at together.
const GROUP: usize = 16;
/// Reach over the step of a slow particle, in root mean square speeds [-]: impacts may speed it up.
const RESERVE: f64 = 2.0;

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
    grown: Vec<f64>,
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
        let touches = &mut self.touches;
        visit_close(launch.position, &self.grown, &launch.domain.periodic, 1.0, |pair| {
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
        let near = vectorized(Near { launch, i, reach: radius[i] + reach, reaches: &self.reach });
        let others: Vec<usize> = near.into_iter().filter(|&j| j != i && !self.holds(i, j)).collect();
        for j in others {
            self.touches.push(Touch { i: i.min(j), partner: Partner::Particle(i.max(j) as u32) });
        }
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

    /// All candidates of particle i.
    pub fn chain(&self, i: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.first(i), move |&k| self.after(i, k))
    }

    fn holds(&self, i: usize, j: usize) -> bool {
        let touch = Touch { i: i.min(j), partner: Partner::Particle(i.max(j) as u32) };
        self.chain(i).any(|k| self.touches[k] == touch)
    }
}

/// Particles whose own reach meets that of particle i.
struct Near<'a> {
    launch: &'a Launch<'a>,
    i: usize,
    reach: f64,
    reaches: &'a [f64],
}

impl Task for Near<'_> {
    type Output = Vec<usize>;

    #[inline(always)]
    fn run(self) -> Vec<usize> {
        let [x, y, z] = self.launch.position.axes();
        let (radius, periodic, i) = (&self.launch.particles.radius, &self.launch.domain.periodic, self.i);
        let close = |j: usize| {
            let d = [x[j] - x[i], y[j] - y[i], z[j] - z[i]];
            let [a, b, c]: [f64; 3] = std::array::from_fn(|axis| periodic.minimum_image(axis, d[axis]));
            let reach = self.reach + radius[j] + self.reaches[j];
            a * a + b * b + c * c <= reach * reach
        };
        let n = radius.len();
        let mut found = Vec::new();
        let mut from = 0;
        while from < n {
            let to = n.min(from + GROUP);
            let mut any = false;
            for j in from..to {
                any |= close(j);
            }
            if any {
                found.extend((from..to).filter(|&j| close(j)));
            }
            from = to;
        }
        found
    }
}
