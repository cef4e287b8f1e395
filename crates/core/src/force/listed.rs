//! The pair loop over lists: every particle with its own row of partners, eight at a time.
//!
//! Each pair is met from both sides, so no sums are shared and the split over threads changes nothing; since every
//! operation is symmetric in i and j, Newton's third law holds to the last bit of each pair.

use super::composition::{Bond, Job, Law, Ordered, Pairs, Partners, compose, pull, separation, square_of};
use super::near_field::Field;
use crate::neighbor::{NeighborList, Rows, TASK};
use crate::simd::{Arithmetic, Block, Eight, Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
use crate::tasks;
use rayon::prelude::*;

/// Particles from which tasks are worth their overhead.
const PARALLEL_FROM: usize = 2048;
/// Numbers of the lanes.
const LANE: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Space of the loop, in the order of places, kept between calls.
#[derive(Clone, Debug, Default)]
pub(crate) struct Listed {
    ordered: Ordered,
    /// x, y, z and weight in the first group.
    records: Vec<[f64; 4]>,
    forces: Vec<[f64; 3]>,
    /// The place of every particle.
    place: Vec<u32>,
    /// The build of the list that the order is of.
    build: u64,
}

impl Listed {
    /// Adds the forces of all pairs of a valid list to `force`.
    pub(super) fn forces(&mut self, field: &Field, list: &NeighborList, r: &Columns, force: &mut Columns) {
        let n = r.len();
        let order = list.order();
        if self.build != list.builds() || self.place.len() != n {
            self.sort(field, list);
        }
        let parallel = n >= PARALLEL_FROM;
        let (periodic, built_at) = (&field.periodic, list.positions().axes());
        let renew = |(records, order): (&mut [[f64; 4]], &[u32])| {
            for (record, &i) in records.iter_mut().zip(order) {
                let i = i as usize;
                [record[0], record[1], record[2]] = [r.x[i], r.y[i], r.z[i]];
            }
            // Whoever left the box on one side and came back on the other goes on as if there were no box.
            for axis in (0..3).filter(|&axis| periodic.length[axis] > 0.0) {
                let (length, inverse) = (periodic.length[axis], periodic.inverse[axis]);
                for (record, &i) in records.iter_mut().zip(order) {
                    let start = built_at[axis][i as usize];
                    let start = start - length * (start / length).floor();
                    record[axis] -= length * crate::math::round((record[axis] - start) * inverse);
                }
            }
        };
        if parallel {
            self.records.par_chunks_mut(TASK).zip(order.par_chunks(TASK)).for_each(renew);
        } else {
            renew((&mut self.records, order));
        }
        let Self { ordered, records, forces, place, .. } = self;
        compose(field, ordered, Work { field, list, records, forces });
        let forces = &*forces;
        #[allow(clippy::type_complexity)] // what `zip` makes of three columns
        let add = |(((x, y), z), place): (((&mut [f64], &mut [f64]), &mut [f64]), &[u32])| {
            for (((x, y), z), &place) in x.iter_mut().zip(y).zip(z).zip(place) {
                let force = &forces[place as usize];
                *x += force[0];
                *y += force[1];
                *z += force[2];
            }
        };
        let Columns { x, y, z } = force;
        if parallel {
            x.par_chunks_mut(TASK)
                .zip(y.par_chunks_mut(TASK))
                .zip(z.par_chunks_mut(TASK))
                .zip(place.par_chunks(TASK))
                .for_each(add);
        } else {
            add((((x.as_mut_slice(), y.as_mut_slice()), z.as_mut_slice()), place.as_slice()));
        }
    }

    /// Takes over the order of a list.
    fn sort(&mut self, field: &Field, list: &NeighborList) {
        let order = list.order();
        let n = order.len();
        self.ordered = Ordered::new(&field.groups, field.binding.as_ref(), |column| {
            order.iter().map(|&i| column[i as usize]).collect()
        });
        let weight = self.ordered.first();
        self.records.clear();
        self.records.extend((0..n).map(|place| [0.0, 0.0, 0.0, weight.map_or(1.0, |weight| weight[place])]));
        self.forces.resize(n, [0.0; 3]);
        self.place.resize(n, 0);
        for (place, &i) in order.iter().enumerate() {
            self.place[i as usize] = place as u32;
        }
        self.build = list.builds();
    }
}

struct Work<'a> {
    field: &'a Field,
    list: &'a NeighborList,
    records: &'a [[f64; 4]],
    forces: &'a mut [[f64; 3]],
}

impl Job for Work<'_> {
    fn run<L: Law, B: Bond>(self, law: L, bond: B) {
        let Self { field, list, records, forces } = self;
        let periodic = field.periodic.any();
        let run = |task: usize, forces: &mut [[f64; 3]]| {
            let (rows, first) = (&list.tasks()[task], task * TASK);
            dispatch(ListedRows { law, bond, field, periodic, records, first, rows, forces });
        };
        tasks::each(forces, TASK, records.len() >= PARALLEL_FROM, &run);
    }
}

/// The rows of consecutive places.
struct ListedRows<'a, L, B> {
    law: L,
    bond: B,
    field: &'a Field,
    /// Whether any direction is periodic.
    periodic: bool,
    records: &'a [[f64; 4]],
    first: usize,
    rows: &'a Rows,
    forces: &'a mut [[f64; 3]],
}

/// The next eight places, or fewer, and the weights that came with their positions.
struct Places<'a> {
    places: &'a [u32],
    weight: &'a Block,
}

impl<S: Arithmetic> Partners<S> for Places<'_> {
    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        let mut values = [0.0; LANES];
        for k in 0..self.places.len().min(LANES) {
            values[k] = column[self.places[k] as usize];
        }
        simd.load(&values)
    }

    #[inline(always)]
    fn weight(&self, simd: S) -> S::F {
        simd.load(&self.weight.0)
    }
}

/// Blocks that are looked at together.
const TILE: usize = 16;

/// Distances to eight partners of a row, kept in the first cache level: two short loops keep a processor busier than a long
/// one, in which all waits for the one before. (Indices and no iterators in here: what is not inlined is not compiled for
/// the instruction set.)
#[derive(Clone, Copy, Default)]
struct Slot {
    x: Block,
    y: Block,
    z: Block,
    weight: Block,
    square: Block,
}

impl<L: Law, B: Bond> Kernel for ListedRows<'_, L, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let mut tile = [Slot::default(); TILE];
        for k in 0..self.forces.len() {
            let mut sums = [simd.splat(0.0); 3];
            let mut rest = self.rows.row(k);
            while !rest.is_empty() {
                let (partners, others) = rest.split_at(rest.len().min(TILE * LANES));
                self.distances(simd, &mut tile, k, partners);
                self.pulls(simd, &tile, k, partners, &mut sums);
                rest = others;
            }
            self.forces[k] = [sums[0].sum(), sums[1].sum(), sums[2].sum()];
        }
    }
}

impl<L: Law, B: Bond> ListedRows<'_, L, B> {
    /// r_j - r_i and s^2 for the partners of the k-th place.
    #[inline(always)]
    fn distances<S: Simd>(&self, simd: S, tile: &mut [Slot; TILE], k: usize, partners: &[u32]) {
        let own = &self.records[self.first + k];
        let mut records = [own; LANES];
        let own = [simd.splat(own[0]), simd.splat(own[1]), simd.splat(own[2])];
        let images = self.periodic && !self.rows.inside(k);
        let (blocks, rest) = partners.as_chunks::<LANES>();
        for b in 0..partners.len().div_ceil(LANES) {
            if b < blocks.len() {
                for l in 0..LANES {
                    records[l] = &self.records[blocks[b][l] as usize];
                }
            } else {
                for l in 0..rest.len() {
                    records[l] = &self.records[rest[l] as usize];
                }
            }
            let columns = simd.transpose(records);
            let d = [columns[0] - own[0], columns[1] - own[1], columns[2] - own[2]];
            let d = separation(simd, &self.field.periodic, images, d);
            let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
            if b == blocks.len() {
                // Surplus lanes are infinitely far.
                let inside = simd.load(&LANE).le(simd.splat(rest.len() as f64 - 1.0));
                square = square.select(inside, simd.splat(f64::INFINITY));
            }
            let slot = &mut tile[b];
            d[0].store(&mut slot.x.0);
            d[1].store(&mut slot.y.0);
            d[2].store(&mut slot.z.0);
            columns[3].store(&mut slot.weight.0);
            square.store(&mut slot.square.0);
        }
    }

    /// Adds the forces of the partners of the k-th place.
    #[inline(always)]
    fn pulls<S: Simd>(&self, simd: S, tile: &[Slot; TILE], k: usize, partners: &[u32], sums: &mut [S::F; 3]) {
        let place = self.first + k;
        let own_weight = simd.splat(self.records[place][3]);
        let reach = simd.splat(square_of(self.field.cutoff));
        for b in 0..partners.len().div_ceil(LANES) {
            let slot = &tile[b];
            let places = Places { places: &partners[b * LANES..], weight: &slot.weight };
            let square = simd.load(&slot.square.0);
            let pairs = Pairs { simd, own: place, own_weight, partners: &places, square };
            let pull = pull(self.law, self.bond, reach, &pairs);
            sums[0] = sums[0] + pull * simd.load(&slot.x.0);
            sums[1] = sums[1] + pull * simd.load(&slot.y.0);
            sums[2] = sums[2] + pull * simd.load(&slot.z.0);
        }
    }
}
