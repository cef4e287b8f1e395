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
use crate::state::Columns;
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

/// From a place to eight others, and the squares of the distances; itself is infinitely far.
#[inline(always)]
fn separation<S: Simd>(
    simd: S,
    [x, y, z]: [&[f64]; 3],
    own: usize,
    block: &Block<'_>,
    at: [S::F; 3],
) -> ([S::F; 3], S::F) {
    let d = [at[0] - simd.splat(x[own]), at[1] - simd.splat(y[own]), at[2] - simd.splat(z[own])];
    let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    if own >= block.first && own < block.first + LANES {
        let (lane, number) =
            (simd.splat((own - block.first) as f64), simd.load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]));
        let equal = simd.splat(f64::INFINITY).select(number.le(lane), square);
        square = equal.select(lane.le(number), square);
    }
    (d, square)
}

/// What neighbouring leaves meet with: columns in the order of places, lengths and pulls in units.
pub(super) struct Near<'a> {
    single: &'a Single,
    pub(super) ordered: Ordered,
    position: Columns,
    /// Weights in the first group; 1 where it has none.
    weight: Vec<f32>,
    /// Whether pairs are computed in 32 bits.
    serves: bool,
}

impl<'a> Near<'a> {
    /// Time that a pair takes in 64 bits; in 32 bits it takes 1 (measured, AVX-512).
    pub(super) const FULL: f64 = 2.0;

    /// In 32 bits, if they serve and are wanted.
    pub(super) fn new(single: &'a Single, tree: &Tree, wanted: bool) -> Self {
        let field = &single.field;
        let ordered = Ordered::new(&field.groups, field.binding.as_ref(), |column| tree.sorted(column));
        let scaled = |column: &[f64]| column.iter().map(|x| x / single.length).collect::<Vec<f64>>();
        let [x, y, z] = tree.position.axes().map(scaled);
        let weight = match ordered.first() {
            Some(column) => column.iter().map(|&weight| weight as f32).collect(),
            None => vec![1.0; x.len()],
        };
        Self { single, ordered, position: Columns { x, y, z }, weight, serves: single.serves && wanted }
    }

    /// Time that a pair takes.
    pub(super) fn cost(&self) -> f64 {
        if self.serves { 1.0 } else { Self::FULL }
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

impl<L: Law, B: Bond> Forces<'_, L, B> {
    /// Forces on eight particles from all others in some runs, in units.
    #[inline(always)]
    fn of_pairs<S: Simd>(&self, simd: S, block: &Block<'_>, runs: &[Range<u32>], serves: bool) -> [S::F; 3] {
        let Near { single, ordered, position, weight, .. } = self.near;
        let [x, y, z] = position.axes();
        let at = [load(simd, x, block.first), load(simd, y, block.first), load(simd, z, block.first)];
        let mut force = [simd.splat(0.0); 3];
        for run in runs {
            for own in run.start as usize..run.end as usize {
                let (d, square) = separation(simd, [x, y, z], own, block, at);
                let mut pull = if serves {
                    let (single, square) = (simd.single(), simd.narrow(square));
                    let own_weight = single.splat(f64::from(weight[own]));
                    // An infinite square gives none.
                    simd.widen(self.law.pull(&composition::Pairs {
                        simd: single,
                        own,
                        own_weight,
                        partners: block,
                        square,
                    }))
                } else {
                    let own_weight = match ordered.first() {
                        Some(weight) => simd.splat(weight[own]),
                        None => simd.splat(1.0),
                    };
                    let pairs = composition::Pairs { simd, own, own_weight, partners: block, square };
                    self.law.pull(&pairs).keep(square.le(simd.splat(f64::MAX)))
                };
                if B::BINDS {
                    let (own_weight, square) = (simd.splat(1.0), square * simd.splat(single.length * single.length));
                    let pairs = composition::Pairs { simd, own, own_weight, partners: block, square };
                    pull = pull + self.bond.add(&pairs, simd.splat(0.0)) * simd.splat(1.0 / single.pull);
                }
                force = [force[0] - pull * d[0], force[1] - pull * d[1], force[2] - pull * d[2]];
            }
        }
        force
    }
}

/// Whether all numbers are.
#[inline(always)]
fn finite<S: Simd>(simd: S, x: [S::F; 3]) -> bool {
    let zero = simd.splat(0.0);
    let none = x[0] * zero + x[1] * zero + x[2] * zero;
    S::F::bitmask(none.le(zero)) == (1 << LANES) - 1
}

impl<L: Law, B: Bond> AtLeaf for Forces<'_, L, B> {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, simd: S, degrees: &Degrees, cell: &Cell, local: &Local<'_>, near: &[Range<u32>]) {
        let mut powers = vec![simd.splat(0.0); degrees.count()];
        let unit = simd.splat(self.near.single.pull * self.near.single.length);
        let Range { start, end } = cell.places();
        let mut first = start;
        while first < end {
            let count = LANES.min(end - first);
            let block = Block { first, count, weight: self.near.ordered.first() };
            let mut force = [simd.splat(f64::NAN); 3];
            if self.near.serves {
                force = self.of_pairs(simd, &block, near, true);
            }
            // Two that nearly coincide are beyond 32 bits.
            if !finite(simd, force) {
                force = self.of_pairs(simd, &block, near, false);
            }
            force = [force[0] * unit, force[1] * unit, force[2] * unit];
            for run in near {
                self.pairs += count as u64 * u64::from(run.end - run.start);
            }
            degrees.powers(simd, from_centre(simd, self.tree, cell, first), &mut powers);
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
                    let (_, square) = separation(simd, [x, y, z], own, &block, at);
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
