//! The pair loops for potential energies: eight pairs at a time, each pair once.

use super::composition::separation;
use super::near_field::Field;
use super::potential::{Pairs, Partners, Potential, PotentialJob, compose};
use crate::cells::{Cells, Visit};
use crate::math::Sum;
use crate::neighbor::{NeighborList, Neighbors, load};
use crate::simd::{Eight, Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
use crate::tasks;
use std::ops::Range;

/// Places whose energies are summed together.
const SHARE: usize = 16;
/// Shares per task.
const TASK: usize = 16;
/// Places from which tasks are worth their overhead.
const PARALLEL_FROM: usize = 1024;
/// Blocks of consecutive partners whose bonds are looked at together, a bit for each.
const BLOCKS: usize = u64::BITS as usize;
/// Numbers of the lanes.
const LANE: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Near-field and binding energy, and a lower bound of the sum of the absolute energies of all pairs [J], with candidates
/// that are valid.
pub(super) fn energies(field: &Field, neighbors: &Neighbors, r: &Columns) -> [f64; 3] {
    match neighbors {
        Neighbors::All => energies_of_all(field, r),
        Neighbors::List(list) => {
            let sorted = |column: &[f64]| list.order().iter().map(|&i| column[i as usize]).collect::<Vec<f64>>();
            let (field, r) = (field.sorted(sorted), Columns { x: sorted(&r.x), y: sorted(&r.y), z: sorted(&r.z) });
            compose(&field, Rows { field: &field, n: r.len(), r: &r, list: Some(list) })
        }
    }
}

/// The same from the positions alone, by cells instead of lists.
pub(super) fn energies_by_cells(field: &Field, r: &Columns) -> [f64; 3] {
    let Some(cells) = Cells::new(r, field.reach(), &field.periodic) else { return energies_of_all(field, r) };
    let field = field.sorted(|column| cells.sorted(column));
    compose(&field, InCells { field: &field, r: &padded(cells.sorted_vectors(r)), n: r.len(), cells: &cells })
}

/// The same of all pairs.
fn energies_of_all(field: &Field, r: &Columns) -> [f64; 3] {
    compose(field, Rows { field, r: &padded(r.clone()), n: r.len(), list: None })
}

/// With zeros behind, so that blocks of consecutive particles are whole.
fn padded(mut r: Columns) -> Columns {
    for column in [&mut r.x, &mut r.y, &mut r.z] {
        column.resize(column.len() + LANES - 1, 0.0);
    }
    r
}

/// Sums of what `fill` makes of the places in every share of so many, a task at a time.
fn sums(n: usize, fill: impl Fn(Range<usize>, &mut [[f64; 3]]) + Sync) -> [f64; 3] {
    let mut shares = vec![[0.0; 3]; n.div_ceil(SHARE)];
    tasks::each(&mut shares, TASK, n >= PARALLEL_FROM, &|task, shares| {
        let first = task * TASK * SHARE;
        fill(first..n.min(first + TASK * SHARE), shares);
    });
    std::array::from_fn(|k| shares.iter().map(|energies| energies[k]).collect::<Sum>().value())
}

/// All particles, with partners of larger number (or place) only.
struct Rows<'a> {
    field: &'a Field,
    r: &'a Columns,
    n: usize,
    list: Option<&'a NeighborList>,
}

impl PotentialJob for Rows<'_> {
    type Output = [f64; 3];

    fn run<P: Potential, B: Potential>(self, near: P, bond: B) -> [f64; 3] {
        let Self { field, r, n, list } = self;
        let law = (near, bond);
        if list.is_none() && !field.periodic.any() {
            return sums(n, |places, shares| dispatch(OpenRows { law, field, r, n, places, shares }));
        }
        sums(n, |places, shares| dispatch(EnergyRows { law, field, r, n, list, places, shares }))
    }
}

/// All particles, with the partners that cells give them.
struct InCells<'a> {
    field: &'a Field,
    r: &'a Columns,
    n: usize,
    cells: &'a Cells,
}

impl PotentialJob for InCells<'_> {
    type Output = [f64; 3];

    fn run<P: Potential, B: Potential>(self, near: P, bond: B) -> [f64; 3] {
        let Self { field, r, n, cells } = self;
        sums(n, |places, shares| dispatch(EnergyCells { law: (near, bond), field, r, cells, places, shares }))
    }
}

/// Energies of consecutive places, with the partners that cells give them.
struct EnergyCells<'a, P, B> {
    law: (P, B),
    field: &'a Field,
    r: &'a Columns,
    cells: &'a Cells,
    places: Range<usize>,
    shares: &'a mut [[f64; 3]],
}

impl<P: Potential, B: Potential> Kernel for EnergyCells<'_, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { law, field, r, cells, places, shares } = self;
        let mut first = places.start;
        for share in shares {
            let end = places.end.min(first + SHARE);
            let mut visitor = Visitor(PairSums::<_, _, _, false>::new(simd, law, field, r));
            cells.walk(first..end, &mut visitor);
            *share = visitor.0.energies();
            first = end;
        }
    }
}

/// Adds up the energies of one place after another.
struct Visitor<'a, S: Simd, P: Potential, B: Potential>(PairSums<'a, S, P, B, false>);

impl<S: Simd, P: Potential, B: Potential> Visit for Visitor<'_, S, P, B> {
    #[inline(always)]
    fn visit(&mut self, place: usize, runs: &[Range<usize>]) {
        for run in runs {
            self.0.add_run(place, run.clone());
        }
    }
}

/// Energies of consecutive rows.
struct EnergyRows<'a, P, B> {
    law: (P, B),
    field: &'a Field,
    r: &'a Columns,
    n: usize,
    list: Option<&'a NeighborList>,
    places: Range<usize>,
    shares: &'a mut [[f64; 3]],
}

impl<P: Potential, B: Potential> Kernel for EnergyRows<'_, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { law, field, r, n, list, places, shares } = self;
        let mut first = places.start;
        for share in shares {
            let end = places.end.min(first + SHARE);
            let mut sums = PairSums::<_, _, _, false>::new(simd, law, field, r);
            for i in first..end {
                match list {
                    None => sums.add_run(i, i + 1..n),
                    Some(list) => sums.add_listed(i, list.row(i)),
                }
            }
            *share = sums.energies();
            first = end;
        }
    }
}

/// Energies of consecutive rows of all pairs in open space.
struct OpenRows<'a, P, B> {
    law: (P, B),
    field: &'a Field,
    r: &'a Columns,
    n: usize,
    places: Range<usize>,
    shares: &'a mut [[f64; 3]],
}

impl<P: Potential, B: Potential> Kernel for OpenRows<'_, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { law, field, r, n, places, shares } = self;
        let mut first = places.start;
        for share in shares {
            let end = places.end.min(first + SHARE);
            let mut sums = PairSums::<_, _, _, true>::new(simd, law, field, r);
            for i in first..end {
                sums.add_run(i, i + 1..n);
            }
            *share = sums.energies();
            first = end;
        }
    }
}

/// Consecutive particles.
struct Consecutive {
    first: usize,
    count: usize,
}

impl<S: Simd> Partners<S> for Consecutive {
    #[inline(always)]
    fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        load(simd, column, self.first)
    }

    #[inline(always)]
    fn of_padded(&self, simd: S, column: &[f64]) -> S::F {
        simd.load(column[self.first..].first_chunk().expect("a column with numbers behind its end"))
    }
}

/// Particles of a list; the last ones may be repeated.
struct Listed<'a> {
    particles: &'a [u32; LANES],
    count: usize,
}

impl<S: Simd> Partners<S> for Listed<'_> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    fn of(&self, simd: S, column: &[f64]) -> S::F {
        let mut values = [0.0; LANES];
        for k in 0..LANES {
            values[k] = column[self.particles[k] as usize];
        }
        simd.load(&values)
    }
}

/// Energies of pairs, near field and binding. What is `OPEN` needs no look at periodic directions.
struct PairSums<'a, S: Simd, P: Potential, B: Potential, const OPEN: bool> {
    simd: S,
    law: (P, B),
    sums: (P::Sums<S>, B::Sums<S>),
    field: &'a Field,
    r: &'a Columns,
}

impl<'a, S: Simd, P: Potential, B: Potential, const OPEN: bool> PairSums<'a, S, P, B, OPEN> {
    #[inline(always)]
    fn new(simd: S, law: (P, B), field: &'a Field, r: &'a Columns) -> Self {
        Self { simd, law, sums: (law.0.none(simd), law.1.none(simd)), field, r }
    }

    #[inline(always)]
    fn energies(&self) -> [f64; 3] {
        let near = self.law.0.energy(self.simd, self.sums.0);
        let bond = self.law.1.energy(self.simd, self.sums.1);
        [near.energy, bond.energy, near.size + bond.size]
    }

    /// Adds the pairs of i with consecutive others. Bonded ones are few, and looked at afterwards: together with the sums of
    /// the near field theirs would not fit into the registers.
    #[inline(always)]
    fn add_run(&mut self, i: usize, run: Range<usize>) {
        let mut from = run.start;
        while from < run.end {
            let end = run.end.min(from + LANES * BLOCKS);
            let block = |k: usize| {
                let first = from + LANES * k;
                Consecutive { first, count: LANES.min(end - first) }
            };
            let mut bonded = 0_u64;
            for k in 0..(end - from).div_ceil(LANES) {
                let partners = block(k);
                let pairs = self.pairs(i, &partners);
                self.law.0.add(&pairs, &mut self.sums.0);
                bonded |= u64::from(self.law.1.concerns(&pairs)) << k;
            }
            while bonded != 0 {
                let partners = block(bonded.trailing_zeros() as usize);
                let pairs = self.pairs(i, &partners);
                self.law.1.add(&pairs, &mut self.sums.1);
                bonded &= bonded - 1;
            }
            from = end;
        }
    }

    /// Adds the pairs of i with listed others behind it.
    #[inline(always)]
    fn add_listed(&mut self, i: usize, others: &[u32]) {
        let (mut particles, mut count) = ([i as u32; LANES], 0);
        for &j in others {
            particles[count] = j;
            count += usize::from(j as usize > i);
            if count == LANES {
                self.add(i, &Listed { particles: &particles, count });
                count = 0;
            }
        }
        if count > 0 {
            self.add(i, &Listed { particles: &particles, count });
        }
    }

    /// Adds the pairs of i with up to eight partners.
    #[inline(always)]
    fn add(&mut self, i: usize, partners: &impl Partners<S>) {
        let pairs = self.pairs(i, partners);
        self.law.0.add(&pairs, &mut self.sums.0);
        self.law.1.add(&pairs, &mut self.sums.1);
    }

    /// The pairs of i with up to eight partners.
    #[inline(always)]
    fn pairs<'p, Q: Partners<S>>(&self, i: usize, partners: &'p Q) -> Pairs<'p, S, Q> {
        let simd = self.simd;
        let periodic = &self.field.periodic;
        let Columns { x, y, z } = self.r;
        let d = [
            partners.of_padded(simd, x) - simd.splat(x[i]),
            partners.of_padded(simd, y) - simd.splat(y[i]),
            partners.of_padded(simd, z) - simd.splat(z[i]),
        ];
        let d = separation(simd, periodic, !OPEN && periodic.any(), d);
        let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        if partners.count() < LANES {
            // Surplus lanes are infinitely far.
            let inside = simd.load(&LANE).le(simd.splat(partners.count() as f64 - 1.0));
            square = square.select(inside, simd.splat(f64::INFINITY));
        }
        Pairs { simd, own: i, partners, square, inverse: simd.splat(1.0) / square.sqrt() }
    }
}
