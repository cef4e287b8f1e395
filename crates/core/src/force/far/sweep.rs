//! Moments up, local expansions down.

use super::expansion::Degrees;
use super::tree::{Cell, Tree};
use super::walk::Meetings;
use crate::force::near_field::Group;
use crate::neighbor::load;
use crate::simd::{Kernel, LANES, Lanes, Simd, dispatch};
use rayon::prelude::*;
use std::ops::Range;

/// Moments of every cell: of every group of terms, padded to a multiple of four.
#[derive(Clone, Debug, Default)]
pub(super) struct Moments {
    /// Numbers kept for a group.
    padded: usize,
    /// Weights of every group in the order of places; `None`: 1.
    weights: Vec<Option<Vec<f64>>>,
    values: Vec<f64>,
}

impl Moments {
    /// Numbers kept for a cell.
    pub(super) fn stride(&self) -> usize {
        self.padded * self.weights.len()
    }

    fn of(&self, cell: usize) -> &[f64] {
        &self.values[cell * self.stride()..(cell + 1) * self.stride()]
    }

    /// Moments of all cells of a tree.
    pub(super) fn fill(&mut self, degrees: &Degrees, tree: &Tree, weights: Vec<Option<Vec<f64>>>) {
        self.padded = degrees.count().next_multiple_of(4);
        self.weights = weights;
        let (stride, padded) = (self.stride(), self.padded);
        self.values.clear();
        self.values.resize(stride * tree.cells.len(), 0.0);
        let weights = &self.weights;
        let leaves = self.values.par_chunks_mut(stride).zip(&tree.cells).with_min_len(16);
        leaves.filter(|(_, cell)| cell.is_leaf()).for_each(|(moments, cell)| {
            for (moments, weight) in moments.chunks_mut(padded).zip(weights) {
                dispatch(OfLeaf { degrees, tree, cell, weight: weight.as_deref(), moments });
            }
        });
        let mut powers = vec![0.0; degrees.count()];
        for (number, cell) in tree.cells.iter().enumerate().rev() {
            for child in cell.children() {
                let (head, tail) = self.values.split_at_mut(child * stride);
                let to = &mut head[number * stride..(number + 1) * stride];
                degrees.powers_of(difference(cell, &tree.cells[child]), &mut powers);
                for (to, from) in to.chunks_mut(padded).zip(tail[..stride].chunks(padded)) {
                    degrees.shift_moments(&from[..degrees.count()], &powers, to);
                }
            }
        }
    }
}

/// Centre of one cell less that of another.
fn difference(to: &Cell, from: &Cell) -> [f64; 3] {
    std::array::from_fn(|axis| to.centre[axis] - from.centre[axis])
}

/// Moments of a leaf.
struct OfLeaf<'a> {
    degrees: &'a Degrees,
    tree: &'a Tree,
    cell: &'a Cell,
    weight: Option<&'a [f64]>,
    moments: &'a mut [f64],
}

impl Kernel for OfLeaf<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { degrees, tree, cell, weight, moments } = self;
        let count = degrees.count();
        let (mut powers, mut sums) = (vec![simd.splat(0.0); count], vec![simd.splat(0.0); count]);
        let Range { start, end } = cell.places();
        let mut first = start;
        while first < end {
            let u = from_centre(simd, tree, cell, first);
            let zero = simd.splat(0.0);
            degrees.powers(simd, [zero - u[0], zero - u[1], zero - u[2]], &mut powers);
            let weight = match weight {
                Some(weight) => load(simd, weight, first),
                None => simd.splat(1.0),
            };
            let weight = weight.keep(lanes_below(simd, end - first));
            for k in 0..count {
                sums[k] = sums[k] + weight * powers[k];
            }
            first += LANES;
        }
        for k in 0..count {
            moments[k] = sums[k].sum();
        }
    }
}

/// Eight particles relative to a cell's centre.
#[inline(always)]
pub(super) fn from_centre<S: Simd>(simd: S, tree: &Tree, cell: &Cell, first: usize) -> [S::F; 3] {
    let [x, y, z] = tree.position.axes();
    [
        load(simd, x, first) - simd.splat(cell.centre[0]),
        load(simd, y, first) - simd.splat(cell.centre[1]),
        load(simd, z, first) - simd.splat(cell.centre[2]),
    ]
}

/// The first so many lanes.
#[inline(always)]
pub(super) fn lanes_below<S: Simd>(simd: S, count: usize) -> <S::F as Lanes>::Mask {
    simd.load(&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]).le(simd.splat(count as f64 - 1.0))
}

/// What is done at leaves.
pub(super) trait AtLeaf {
    /// A leaf with its local expansion, and the runs of places that it meets as pairs; to be inlined.
    fn leaf<S: Simd>(&mut self, simd: S, degrees: &Degrees, cell: &Cell, local: &Local<'_>, near: &[Range<u32>]);
}

impl AtLeaf for () {
    #[inline(always)]
    fn leaf<S: Simd>(&mut self, _: S, _: &Degrees, _: &Cell, _: &Local<'_>, _: &[Range<u32>]) {}
}

/// Local expansions of a cell.
pub(super) struct Local<'a> {
    /// Of all groups.
    values: &'a [f64],
    padded: usize,
    count: usize,
    /// Weights of the groups.
    weights: &'a [Option<Vec<f64>>],
}

impl Local<'_> {
    /// How many groups there are.
    #[inline(always)]
    pub(super) fn groups(&self) -> usize {
        self.weights.len()
    }

    /// That of a group.
    #[inline(always)]
    pub(super) fn of(&self, group: usize) -> &[f64] {
        &self.values[group * self.padded..group * self.padded + self.count]
    }

    /// Weights of eight particles in a group.
    #[inline(always)]
    pub(super) fn weight<S: Simd>(&self, simd: S, group: usize, first: usize) -> S::F {
        match &self.weights[group] {
            Some(weight) => load(simd, weight, first),
            None => simd.splat(1.0),
        }
    }
}

/// Goes through meetings, and gives back what was done at leaves.
pub(super) struct Sweep<'a, A> {
    pub(super) degrees: &'a Degrees,
    pub(super) groups: &'a [Group],
    pub(super) tree: &'a Tree,
    pub(super) moments: &'a Moments,
    pub(super) meetings: &'a Meetings,
    /// The cell above the first one, and its local expansion.
    pub(super) parent: Option<(usize, &'a [f64])>,
    /// Local expansions of all meetings.
    pub(super) local: &'a mut Vec<f64>,
    pub(super) at_leaf: A,
}

impl<A: AtLeaf> Kernel for Sweep<'_, A> {
    type Output = A;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> A {
        let Self { degrees, groups, tree, moments, meetings, parent, local, mut at_leaf } = self;
        let (stride, padded, count) = (moments.stride(), moments.padded, degrees.count());
        let zero = simd.splat(0.0);
        let mut space = Space {
            moments: vec![zero; padded],
            taylor: vec![zero; count],
            derivatives: vec![zero; count],
            local: vec![zero; stride],
        };
        let mut powers = vec![0.0; count];
        local.clear();
        local.resize(stride * meetings.meetings.len(), 0.0);
        for (number, meeting) in meetings.meetings.iter().enumerate() {
            let cell = &tree.cells[meeting.cell];
            let (above, rest) = local.split_at_mut(number * stride);
            let own = &mut rest[..stride];
            let parent = match meeting.parent {
                // Only the first meeting's parent is elsewhere.
                None => parent,
                Some(parent) => Some((meetings.meetings[parent].cell, &above[parent * stride..(parent + 1) * stride])),
            };
            if let Some((parent, values)) = parent {
                degrees.powers_of(difference(cell, &tree.cells[parent]), &mut powers);
                for group in 0..groups.len() {
                    let span = group * padded..group * padded + count;
                    degrees.shift_local(&values[span.clone()], &powers, &mut own[span]);
                }
            }
            let far = &meetings.far[meeting.far.clone()];
            if !far.is_empty() {
                for k in 0..stride {
                    space.local[k] = zero;
                }
                let mut first = 0;
                while first < far.len() {
                    let sources = &far[first..far.len().min(first + LANES)];
                    space.meet(simd, degrees, groups, (tree, moments), cell, sources);
                    first += LANES;
                }
                for k in 0..stride {
                    own[k] += space.local[k].sum();
                }
            }
            if cell.is_leaf() {
                let local = Local { values: own, padded, count, weights: &moments.weights };
                at_leaf.leaf(simd, degrees, cell, &local, &meetings.near[meeting.near.clone()]);
            }
        }
        at_leaf
    }
}

/// Space for eight meetings at once.
struct Space<F> {
    moments: Vec<F>,
    taylor: Vec<F>,
    derivatives: Vec<F>,
    local: Vec<F>,
}

impl<F: Lanes> Space<F> {
    /// Adds what up to eight distant cells make of a local expansion.
    #[inline(always)]
    fn meet<S: Simd<F = F>>(
        &mut self,
        simd: S,
        degrees: &Degrees,
        groups: &[Group],
        (tree, moments): (&Tree, &Moments),
        cell: &Cell,
        sources: &[u32],
    ) {
        let last = sources.len() - 1;
        let mut r = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let source = &tree.cells[sources[lane.min(last)] as usize];
            for axis in 0..3 {
                r[axis][lane] = cell.centre[axis] - source.centre[axis];
            }
        }
        let r = [simd.load(&r[0]), simd.load(&r[1]), simd.load(&r[2])];
        let used = lanes_below(simd, sources.len());
        let (count, padded) = (degrees.count(), moments.padded);
        for g in 0..groups.len() {
            degrees.derivatives(simd, &groups[g].terms, r, &mut self.taylor, &mut self.derivatives);
            let mut k = 0;
            while k < padded {
                let mut records = [&[0.0; 4]; LANES];
                for lane in 0..LANES {
                    let of = moments.of(sources[lane.min(last)] as usize);
                    if let Some(four) = of[g * padded + k..].first_chunk::<4>() {
                        records[lane] = four;
                    }
                }
                let four = simd.transpose(records);
                for l in 0..4 {
                    self.moments[k + l] = four[l].keep(used);
                }
                k += 4;
            }
            let span = g * padded..g * padded + count;
            degrees.add_local(simd, &self.moments, &self.derivatives, &mut self.local[span]);
        }
    }
}
