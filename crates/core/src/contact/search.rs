//! Finding who is close: pairs with s <= factor (b_i + b_j), and particles at walls.

use crate::contact::Touch;
use crate::domain::{Domain, Periodic};
use crate::impact::Partner;
use crate::neighbor::Neighbors;
use crate::simd::{Task, vectorized};
use crate::state::{Columns, Particles};

/// Surfaces closer than this share of the smaller diameter touch [-].
pub const TOUCHING: f64 = 1e-9;
/// Partners tested together before a look at which of them are close.
const GROUP: usize = 16;

/// A close pair, i < j.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosePair {
    /// The smaller number.
    pub i: u32,
    /// The larger number.
    pub j: u32,
    /// Square of the distance of the centres [m^2].
    pub square: f64,
}

/// Finds close pairs, in ascending order of (i, j).
#[derive(Clone, Debug)]
pub struct Search {
    neighbors: Neighbors,
    pairs: Vec<ClosePair>,
}

impl Search {
    /// For factors up to `largest_factor` [-], from the positions at the start.
    #[must_use]
    pub fn new(largest_factor: f64, particles: &Particles, start: &Columns, domain: &Domain) -> Self {
        let largest = particles.radius.iter().copied().fold(0.0, f64::max);
        // A little more than the range, for contacts that touch within round-off.
        let range = 2.0 * largest * largest_factor * (1.0 + 2.0 * TOUCHING);
        Self { neighbors: Neighbors::choose(range, start, &domain.periodic), pairs: Vec::new() }
    }

    /// Pairs with s <= factor (b_i + b_j) at positions r.
    pub fn close(&mut self, r: &Columns, particles: &Particles, domain: &Domain, factor: f64) -> &[ClosePair] {
        self.neighbors.update(r, &domain.periodic);
        self.pairs.clear();
        let (neighbors, pairs) = (&self.neighbors, &mut self.pairs);
        vectorized(Scan { neighbors, r, radius: &particles.radius, periodic: &domain.periodic, factor, pairs });
        &self.pairs
    }

    /// Pairs and walls whose surfaces touch or overlap at positions r, put into `touches` in ascending order.
    pub fn touching(&mut self, r: &Columns, particles: &Particles, domain: &Domain, touches: &mut Vec<Touch>) {
        touches.clear();
        for pair in self.close(r, particles, domain, 1.0 + TOUCHING) {
            touches.push(Touch { i: pair.i as usize, partner: Partner::Particle(pair.j) });
        }
        for (w, wall) in domain.walls.iter().enumerate() {
            for i in 0..r.len() {
                if wall.distance(&r.get(i)) <= particles.radius[i] * (1.0 + TOUCHING) {
                    touches.push(Touch { i, partner: Partner::Wall(w as u32) });
                }
            }
        }
    }
}

/// Looks at every candidate pair once.
struct Scan<'a> {
    neighbors: &'a Neighbors,
    r: &'a Columns,
    radius: &'a [f64],
    periodic: &'a Periodic,
    factor: f64,
    pairs: &'a mut Vec<ClosePair>,
}

impl Task for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        if self.periodic.any() { self.all::<true>() } else { self.all::<false>() }
    }
}

impl Scan<'_> {
    #[inline(always)]
    fn all<const PERIODIC: bool>(self) {
        let n = self.radius.len();
        for i in 0..n {
            if let Some(row) = self.neighbors.row(i) {
                let after = row.partition_point(|&j| j as usize <= i);
                for &j in &row[after..] {
                    let square = self.square::<PERIODIC>(i, j as usize);
                    keep(self.pairs, i, j as usize, square, self.reach(i, j as usize));
                }
                continue;
            }
            let mut from = i + 1;
            while let Some((squares, reaches)) = self.group::<PERIODIC>(i, from) {
                let mut any = false;
                for k in 0..GROUP {
                    any |= squares[k] <= reaches[k];
                }
                if any {
                    (0..GROUP).for_each(|k| keep(self.pairs, i, from + k, squares[k], reaches[k]));
                }
                from += GROUP;
            }
            for j in from..n {
                keep(self.pairs, i, j, self.square::<PERIODIC>(i, j), self.reach(i, j));
            }
        }
    }

    /// Squares of distances and of reaches from i to a whole group.
    #[inline(always)]
    fn group<const PERIODIC: bool>(&self, i: usize, from: usize) -> Option<([f64; GROUP], [f64; GROUP])> {
        let [x, y, z] = self.r.axes();
        let (xs, ys, zs) =
            (x.get(from..)?.first_chunk()?, y.get(from..)?.first_chunk()?, z.get(from..)?.first_chunk()?);
        let radii: &[f64; GROUP] = self.radius.get(from..)?.first_chunk()?;
        let own = [x[i], y[i], z[i], self.radius[i]];
        let difference = |axis: usize, other: f64| {
            let d = other - own[axis];
            if PERIODIC { self.periodic.minimum_image(axis, d) } else { d }
        };
        let (mut squares, mut reaches) = ([0.0; GROUP], [0.0; GROUP]);
        let (xs, ys, zs): (&[f64; GROUP], &[f64; GROUP], &[f64; GROUP]) = (xs, ys, zs);
        for k in 0..GROUP {
            let (dx, dy, dz) = (difference(0, xs[k]), difference(1, ys[k]), difference(2, zs[k]));
            squares[k] = dx * dx + dy * dy + dz * dz;
        }
        for k in 0..GROUP {
            let reach = self.factor * (own[3] + radii[k]);
            reaches[k] = reach * reach;
        }
        Some((squares, reaches))
    }

    #[inline(always)]
    fn square<const PERIODIC: bool>(&self, i: usize, j: usize) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let column = self.r.axes()[axis];
            let d = column[j] - column[i];
            let d = if PERIODIC { self.periodic.minimum_image(axis, d) } else { d };
            square += d * d;
        }
        square
    }

    /// Square of factor (b_i + b_j).
    #[inline(always)]
    fn reach(&self, i: usize, j: usize) -> f64 {
        let reach = self.factor * (self.radius[i] + self.radius[j]);
        reach * reach
    }
}

fn keep(pairs: &mut Vec<ClosePair>, i: usize, j: usize, square: f64, reach: f64) {
    if square <= reach {
        pairs.push(ClosePair { i: i as u32, j: j as u32, square });
    }
}
