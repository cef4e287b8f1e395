//! The pair loop over lists: every particle with its own row of partners, eight at a time.
//!
//! Each pair is met from both sides, so no sums are shared and the split over threads changes nothing; since every
//! operation is symmetric in i and j, Newton's third law holds to the last bit of each pair.

use super::composition::{Bond, Job, Law, Ordered, Pairs, Partners, compose, pull, separation, square_of};
use super::near_field::Field;
use crate::neighbor::{NeighborList, Rows, TASK};
use crate::simd::{Eight, Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
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
        let renew = |(records, order): (&mut [[f64; 4]], &[u32])| {
            for (record, &i) in records.iter_mut().zip(order) {
                let i = i as usize;
                [record[0], record[1], record[2]] = [r.x[i], r.y[i], r.z[i]];
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
        let run = |(task, (rows, forces)): (usize, (&Rows, &mut [[f64; 3]]))| {
            let first = task * TASK;
            dispatch(ListedRows { law, bond, field, periodic, records, first, rows, forces });
        };
        if records.len() < PARALLEL_FROM {
            list.tasks().iter().zip(forces.chunks_mut(TASK)).enumerate().for_each(run);
        } else {
            list.tasks().par_iter().zip(forces.par_chunks_mut(TASK)).enumerate().for_each(run);
        }
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

/// Eight places, and the weights that came with their positions.
struct Places<'a, F> {
    places: &'a [u32; LANES],
    weight: F,
}

impl<S: Simd> Partners<S> for Places<'_, S::F> {
    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            values[k] = column[self.places[k] as usize];
        }
        simd.load(&values)
    }

    #[inline(always)]
    fn weight(&self, _: S) -> S::F {
        self.weight
    }
}

impl<L: Law, B: Bond> Kernel for ListedRows<'_, L, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        for k in 0..self.forces.len() {
            let own = &self.records[self.first + k];
            let mut row = Row {
                place: self.first + k,
                own: [simd.splat(own[0]), simd.splat(own[1]), simd.splat(own[2])],
                weight: simd.splat(own[3]),
                sums: [simd.splat(0.0); 3],
            };
            let mut rest = [row.place as u32; LANES];
            for partners in self.rows.row(k).chunks(LANES) {
                let places = match partners.first_chunk() {
                    Some(places) => places,
                    None => {
                        rest[..partners.len()].copy_from_slice(partners);
                        &rest
                    }
                };
                self.block(simd, &mut row, places, partners.len());
            }
            let [x, y, z] = row.sums;
            self.forces[k] = [x.sum(), y.sum(), z.sum()];
        }
    }
}

/// A particle, and the sums over its partners.
struct Row<S: Simd> {
    place: usize,
    own: [S::F; 3],
    weight: S::F,
    sums: [S::F; 3],
}

impl<L: Law, B: Bond> ListedRows<'_, L, B> {
    /// Adds the forces of eight places, of which the first `count` are partners.
    #[inline(always)]
    fn block<S: Simd>(&mut self, simd: S, row: &mut Row<S>, places: &[u32; LANES], count: usize) {
        let mut records = [&self.records[0]; LANES];
        for k in 0..LANES {
            records[k] = &self.records[places[k] as usize];
        }
        let [x, y, z, weight] = simd.transpose(records);
        let d = [x - row.own[0], y - row.own[1], z - row.own[2]];
        let d = separation(simd, &self.field.periodic, self.periodic, d);
        let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if count < LANES {
            // Surplus lanes are infinitely far.
            let inside = simd.load(&LANE).le(simd.splat(count as f64 - 1.0));
            square = square.select(inside, simd.splat(f64::INFINITY));
        }
        let partners = Places { places, weight };
        let pairs = Pairs { simd, own: row.place, own_weight: row.weight, partners: &partners, square };
        let pull = pull(self.law, self.bond, simd.splat(square_of(self.field.cutoff)), &pairs);
        for axis in 0..3 {
            row.sums[axis] = row.sums[axis] + pull * d[axis];
        }
    }
}
