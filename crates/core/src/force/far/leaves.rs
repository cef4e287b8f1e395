//! What particles of a leaf get: from its local expansion, and from neighbouring leaves pair by pair.

use super::expansion::Degrees;
use super::single::Single;
use super::sweep::{AtLeaf, Local, from_centre, lanes_below};
use super::tree::{Cell, Tree};
use crate::force::composition::{self, Bond, Law, Ordered};
use crate::force::potential::{self, Potential};
use crate::math::Sum;
use crate::neighbor::load;
use crate::simd::{Arithmetic, LANES, Lanes, Simd};
use std::ops::Range;

/// Eight consecutive particles, or fewer.
struct Block<'a> {
    first: usize,
    count: usize,
    /// Weights in the first group.
    weight: Option<&'a [f64]>,
}

impl<S: Arithmetic> composition::Partners<S> for Block<'_> {
    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        load(simd, column, self.first)
    }

    #[inline(always)]
    fn weight(&self, simd: S) -> S::F {
        match self.weight {
            Some(weight) => load(simd, weight, self.first),
            None => simd.splat(1.0),
        }
    }
}

impl<S: Simd> potential::Partners<S> for Block<'_> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        load(simd, column, self.first)
    }
}

/// From a place to eight others, and the squares of the distances; surplus ones and itself are infinitely far.
#[inline(always)]
fn separation<S: Simd>(simd: S, tree: &Tree, own: usize, block: &Block<'_>, at: [S::F; 3]) -> ([S::F; 3], S::F) {
    let (d, infinite) = (
        [
            at[0] - simd.splat(tree.position.x[own]),
            at[1] - simd.splat(tree.position.y[own]),
            at[2] - simd.splat(tree.position.z[own]),
        ],
        simd.splat(f64::INFINITY),
    );
    let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if own >= block.first && own < block.first + LANES {
        let (lane, number) =
            (simd.splat((own - block.first) as f64), simd.load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
        let equal = infinite.select(number.le(lane), square);
        square = equal.select(lane.le(number), square);
    }
    (d, square)
}

/// Neighbouring leaves' pairs: columns in the order of places, and units.
pub(super) struct Near<'a> {
    single: &'a Single,
    pub(super) ordered: Ordered,
    range: [f64; 2],
}

impl<'a> Near<'a> {
    /// Time that a pair takes in 64 bits; in 32 bits it takes 1 (measured, AVX-512).
    pub(super) const FULL: f64 = 2.4;

    /// Time that a pair takes.
    pub(super) fn cost(&self) -> f64 {
        if self.range == Single::NEVER { Self::FULL } else { 1.0 }
    }

    /// With squares of distances, in units, between which 32 bits serve.
    pub(super) fn new(single: &'a Single, tree: &Tree, range: [f64; 2]) -> Self {
        let field = &single.field;
        let ordered = Ordered::new(&field.groups, field.binding.as_ref(), |column| tree.sorted(column));
        Self { single, ordered, range }
    }

    /// The pull of eight pairs [N/m], in 32 bits where they serve; infinitely distant ones have none.
    #[inline(always)]
    fn pull<S: Simd>(&self, simd: S, law: impl Law, own: usize, partners: &Block<'_>, square: S::F) -> S::F {
        let weight = match partners.weight {
            Some(weight) => weight[own],
            None => 1.0,
        };
        let square = square * simd.splat(self.single.square);
        let [low, high] = self.range;
        let outside = S::F::any(square.le(simd.splat(low))) || S::F::any(simd.splat(high).le(square));
        let pull = if outside {
            let pairs = composition::Pairs { simd, own, own_weight: simd.splat(weight), partners, square };
            law.pull(&pairs).keep(square.le(simd.splat(f64::MAX)))
        } else {
            let (single, square) = (simd.single(), simd.narrow(square));
            let own_weight = single.splat(weight);
            simd.widen(law.pull(&composition::Pairs { simd: single, own, own_weight, partners, square }))
        };
        pull * simd.splat(self.single.pull)
    }
}

/// Forces on the particles of leaves.
pub(super) struct Forces<'a, L, B> {
    pub(super) law: L,
    pub(super) bond: B,
    pub(super) near: &'a Near<'a>,
    pub(super) tree: &'a Tree,
    /// Place of the first force.
    pub(super) first: usize,
    pub(super) forces: &'a mut [[f64; 3]],
    /// Ordered pairs that met.
    pub(super) pairs: u64,
}

impl<L: Law, B: Bond> AtLeaf for Forces<'_, L, B> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, degrees: &Degrees, cell: &Cell, local: &Local<'_>, near: &[Range<u32>]) {
        let tree = self.tree;
        let [x, y, z] = tree.position.axes();
        let weight = self.near.ordered.first();
        let zero = simd.splat(0.0);
        let mut powers = vec![zero; degrees.count()];
        let Range { start, end } = cell.places();
        let mut first = start;
        while first < end {
            let count = LANES.min(end - first);
            let block = Block { first, count, weight };
            let at = [load(simd, x, first), load(simd, y, first), load(simd, z, first)];
            let mut force = [zero; 3];
            for run in near {
                for own in run.start as usize..run.end as usize {
                    let (d, square) = separation(simd, tree, own, &block, at);
                    let near_field = self.near.pull(simd, self.law, own, &block, square);
                    // Binding has its own weights.
                    let own_weight = simd.splat(1.0);
                    let pairs = composition::Pairs { simd, own, own_weight, partners: &block, square };
                    let pull = self.bond.add(&pairs, near_field);
                    force = [force[0] - pull * d[0], force[1] - pull * d[1], force[2] - pull * d[2]];
                }
                self.pairs += count as u64 * u64::from(run.end - run.start);
            }
            degrees.powers(simd, from_centre(simd, tree, cell, first), &mut powers);
            for group in 0..local.groups() {
                let gradient = degrees.gradient(simd, local.of(group), &powers);
                let weight = local.weight(simd, group, first);
                for axis in 0..3 {
                    force[axis] = force[axis] - weight * gradient[axis];
                }
            }
            let force = [force[0].to_array(), force[1].to_array(), force[2].to_array()];
            for k in 0..count {
                self.forces[first + k - self.first] = [force[0][k], force[1][k], force[2][k]];
            }
            first += LANES;
        }
    }
}

/// Energies of leaves: near field, binding, absolute values; every pair from both sides.
pub(super) struct Energies<'a, P, B> {
    pub(super) law: (P, B),
    pub(super) tree: &'a Tree,
    pub(super) sums: [Sum; 3],
}

impl<P: Potential, B: Potential> AtLeaf for Energies<'_, P, B> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, degrees: &Degrees, cell: &Cell, local: &Local<'_>, near: &[Range<u32>]) {
        let (law, tree) = (self.law, self.tree);
        let [x, y, z] = tree.position.axes();
        let zero = simd.splat(0.0);
        let (mut sums, mut distant) = ((law.0.none(simd), law.1.none(simd)), zero);
        let mut powers = vec![zero; degrees.count()];
        let Range { start, end } = cell.places();
        let mut first = start;
        while first < end {
            let block = Block { first, count: LANES.min(end - first), weight: None };
            let inside = lanes_below(simd, block.count);
            let at = [load(simd, x, first), load(simd, y, first), load(simd, z, first)];
            for run in near {
                for own in run.start as usize..run.end as usize {
                    let (_, square) = separation(simd, tree, own, &block, at);
                    let square = square.select(inside, simd.splat(f64::INFINITY));
                    let inverse = simd.splat(1.0) / square.sqrt();
                    let pairs = potential::Pairs { simd, own, partners: &block, square, inverse };
                    law.0.add(&pairs, &mut sums.0);
                    law.1.add(&pairs, &mut sums.1);
                }
            }
            degrees.powers(simd, from_centre(simd, tree, cell, first), &mut powers);
            for group in 0..local.groups() {
                let potential = degrees.potential(simd, local.of(group), &powers);
                distant = distant + (local.weight(simd, group, first) * potential).keep(inside);
            }
            first += LANES;
        }
        let (near_field, bond) = (law.0.energy(simd, sums.0), law.1.energy(simd, sums.1));
        let distant = distant.sum();
        self.sums[0].add(near_field.energy);
        self.sums[0].add(distant);
        self.sums[1].add(bond.energy);
        self.sums[2].add(near_field.size + bond.size + distant.abs());
    }
}
