//! The pair loop where everyone may reach everyone: each pair once, eight at a time.
//!
//! Rows of the triangle i < j are cut into strips of equal numbers of pairs. How many depends on the number of particles
//! alone; every strip has its own sums, which are added in order. So the number of threads changes nothing.

use super::composition::{Bond, Job, Law, Ordered, Pairs, Partners, compose, pull, separation, square_of};
use super::near_field::Field;
use crate::simd::{Arithmetic, Block, Eight, Kernel, LANES, Lanes, Simd, blocks, dispatch, fill};
use crate::state::Columns;
use crate::tasks;
use std::ops::Range;

/// Particles from which strips are worth their overhead.
const PARALLEL_FROM: usize = 300;
/// Strips then.
const STRIPS: usize = 16;
/// Particles whose sums are added together.
const SHARE: usize = 1024;
/// Numbers of the lanes.
const LANE: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Space of the loop, kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct AllPairs {
    /// Who stands where in the columns below.
    order: Vec<u32>,
    ordered: Ordered,
    /// Weights in the first group.
    weight: Option<Vec<Block>>,
    position: [Vec<Block>; 3],
    strips: Vec<Strip>,
    /// A component of all forces, in that order.
    sums: Vec<f64>,
}

/// Rows, and the forces of their pairs on all particles from the first row's block on.
#[derive(Clone, Debug, Default)]
struct Strip {
    rows: Range<usize>,
    force: [Vec<Block>; 3],
}

impl AllPairs {
    /// For particles in an order, with the columns of a field in that order.
    pub(crate) fn new(order: Vec<u32>, ordered: Ordered) -> Self {
        let n = order.len();
        let empty = || vec![Block::default(); n.div_ceil(LANES)];
        let weight = ordered.first().map(blocks);
        let (position, strips, sums) = ([empty(), empty(), empty()], strips(n), vec![0.0; n]);
        Self { order, ordered, weight, position, strips, sums }
    }

    /// Adds the forces of all pairs to `force`.
    pub(super) fn forces(&mut self, field: &Field, r: &Columns, force: &mut Columns) {
        let Self { order, ordered, weight, position, strips, sums } = self;
        for (blocks, column) in position.iter_mut().zip(r.axes()) {
            for (sorted, &i) in sums.iter_mut().zip(order.iter()) {
                *sorted = column[i as usize];
            }
            fill(blocks, sums);
        }
        compose(field, ordered, Work { field, weight: weight.as_deref(), n: r.len(), position, strips });
        for (axis, force) in force.axes_mut().into_iter().enumerate() {
            sums.fill(0.0);
            tasks::each(sums, SHARE, strips.len() > 1, &|share, force| {
                for strip in strips.iter() {
                    strip.add(axis, share * SHARE, force);
                }
            });
            for (sum, &i) in sums.iter().zip(order.iter()) {
                force[i as usize] += sum;
            }
        }
    }
}

/// Strips of about equal numbers of pairs.
fn strips(n: usize) -> Vec<Strip> {
    let count = if n < PARALLEL_FROM { 1 } else { STRIPS };
    // Rows above row x n hold a share 1 - (1 - x)^2 of the pairs.
    let begin = |k: usize| ((1.0 - (1.0 - k as f64 / count as f64).sqrt()) * n as f64) as usize;
    let strip = |rows: Range<usize>| {
        let blocks = vec![Block::default(); n.div_ceil(LANES) - rows.start / LANES];
        Strip { rows, force: [blocks.clone(), blocks.clone(), blocks] }
    };
    (0..count).map(|k| strip(begin(k)..if k + 1 == count { n } else { begin(k + 1) })).collect()
}

impl Strip {
    /// Adds its sums for the particles from `first` on, a multiple of `SHARE`.
    fn add(&self, axis: usize, first: usize, force: &mut [f64]) {
        let from = self.rows.start / LANES * LANES;
        let skip = from.saturating_sub(first);
        let Some(force) = force.get_mut(skip..) else { return };
        let sums = self.force[axis][(first + skip - from) / LANES..].iter().flat_map(|block| block.0);
        force.iter_mut().zip(sums).for_each(|(force, sum)| *force += sum);
    }
}

struct Work<'a> {
    field: &'a Field,
    weight: Option<&'a [Block]>,
    n: usize,
    position: &'a [Vec<Block>; 3],
    strips: &'a mut [Strip],
}

impl Job for Work<'_> {
    fn run<L: Law, B: Bond>(self, law: L, bond: B) {
        let Self { field, weight, n, position, strips } = self;
        let periodic = field.periodic.any();
        let run = |_: usize, strips: &mut [Strip]| {
            for strip in strips {
                for axis in &mut strip.force {
                    axis.fill(Block::default());
                }
                dispatch(Triangle { law, bond, field, periodic, weight, n, position, strip });
            }
        };
        let parallel = strips.len() > 1;
        tasks::each(strips, 1, parallel, &run);
    }
}

/// The pairs of a strip.
struct Triangle<'a, L, B> {
    law: L,
    bond: B,
    field: &'a Field,
    /// Whether any direction is periodic.
    periodic: bool,
    weight: Option<&'a [Block]>,
    n: usize,
    position: &'a [Vec<Block>; 3],
    strip: &'a mut Strip,
}

/// Eight consecutive particles.
struct Consecutive<'a> {
    first: usize,
    weight: Option<&'a Block>,
}

impl<S: Arithmetic> Partners<S> for Consecutive<'_> {
    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        crate::neighbor::load(simd, column, self.first)
    }

    #[inline(always)]
    fn weight(&self, simd: S) -> S::F {
        match self.weight {
            Some(weight) => simd.load(&weight.0),
            None => simd.splat(1.0),
        }
    }
}

impl<L: Law, B: Bond> Kernel for Triangle<'_, L, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        for i in self.strip.rows.clone() {
            self.row(simd, i);
        }
    }
}

impl<L: Law, B: Bond> Triangle<'_, L, B> {
    /// The pairs of particle i with those behind it.
    #[inline(always)]
    fn row<S: Simd>(&mut self, simd: S, i: usize) {
        let n = self.n;
        let (block, lane) = (i / LANES, i % LANES);
        let [x, y, z] = self.position;
        let own = [simd.splat(x[block].0[lane]), simd.splat(y[block].0[lane]), simd.splat(z[block].0[lane])];
        let own_weight = match self.weight {
            Some(weight) => simd.splat(weight[block].0[lane]),
            None => simd.splat(1.0),
        };
        let reach = simd.splat(square_of(self.field.cutoff));
        let (zero, infinite) = (simd.splat(0.0), simd.splat(f64::INFINITY));
        let mut sums = [zero, zero, zero];
        let first = block - self.strip.rows.start / LANES;
        let [fx, fy, fz] = &mut self.strip.force;
        // Indices and no iterators in here: what is not inlined is not compiled for the instruction set.
        let blocks = x.len();
        let (y, z) = (&y[..blocks], &z[..blocks]);
        for b in block..blocks {
            let (from, to) = (b * LANES, b - block + first);
            let d = [simd.load(&x[b].0) - own[0], simd.load(&y[b].0) - own[1], simd.load(&z[b].0) - own[2]];
            let d = separation(simd, &self.field.periodic, self.periodic, d);
            let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if b == block || from + LANES > n {
                // Those before i and behind the last are infinitely far.
                let number = simd.splat(from as f64) + simd.load(&LANE);
                square = square.select(simd.splat(i as f64 + 1.0).le(number), infinite);
                square = square.select(number.le(simd.splat(n as f64 - 1.0)), infinite);
            }
            // A closure would be compiled apart, for instructions that every machine has.
            #[allow(clippy::manual_map)]
            let weight = match self.weight {
                Some(weight) => Some(&weight[b]),
                None => None,
            };
            let partners = Consecutive { first: from, weight };
            let pairs = Pairs { simd, own: i, own_weight, partners: &partners, square };
            let pull = pull(self.law, self.bond, reach, &pairs);
            let force = [pull * d[0], pull * d[1], pull * d[2]];
            sums = [sums[0] + force[0], sums[1] + force[1], sums[2] + force[2]];
            (simd.load(&fx[to].0) - force[0]).store(&mut fx[to].0);
            (simd.load(&fy[to].0) - force[1]).store(&mut fy[to].0);
            (simd.load(&fz[to].0) - force[2]).store(&mut fz[to].0);
        }
        fx[first].0[lane] += sums[0].sum();
        fy[first].0[lane] += sums[1].sum();
        fz[first].0[lane] += sums[2].sum();
    }
}
