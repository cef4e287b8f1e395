//! The pair loop for potential energies: eight pairs at a time, each pair once.

use super::composition::{separation, square_of};
use super::near_field::{BindingTerm, Field, Group};
use super::power::Power;
use crate::cells::{Cells, Visit};
use crate::math::Sum;
use crate::neighbor::{NeighborList, Neighbors, load};
use crate::simd::{Eight, Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
use rayon::prelude::*;
use std::ops::Range;

/// Places per task.
const TASK: usize = 256;
/// Places from which tasks are worth their overhead.
const PARALLEL_FROM: usize = 1024;
/// Numbers of the lanes.
const LANE: Eight = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

/// Near-field and binding energy, and the sum of the absolute energies of all pairs [J], with candidates that are valid.
pub(super) fn energies(field: &Field, neighbors: &Neighbors, r: &Columns) -> [f64; 3] {
    match neighbors {
        Neighbors::All => rows(r.len(), |first, energy| dispatch(EnergyRows { field, r, list: None, first, energy })),
        Neighbors::List(list) => {
            let sorted = |column: &[f64]| list.order().iter().map(|&i| column[i as usize]).collect::<Vec<f64>>();
            let (field, r) = (field.sorted(sorted), Columns { x: sorted(&r.x), y: sorted(&r.y), z: sorted(&r.z) });
            rows(r.len(), |first, energy| {
                dispatch(EnergyRows { field: &field, r: &r, list: Some(list), first, energy });
            })
        }
    }
}

/// The same from the positions alone, by cells instead of lists.
pub(super) fn energies_by_cells(field: &Field, r: &Columns) -> [f64; 3] {
    let cells = Cells::new(r, field.reach(), &field.periodic);
    let (sorted, ordered);
    let (field, r) = if cells.is_one() {
        (field, r)
    } else {
        (sorted, ordered) = (field.sorted(|column| cells.sorted(column)), cells.sorted_vectors(r));
        (&sorted, &ordered)
    };
    rows(r.len(), |first, energy| dispatch(EnergyCells { field, r, cells: &cells, first, energy }))
}

/// Sums of what `fill` puts into the rows from a first one on, a task at a time.
fn rows(n: usize, fill: impl Fn(usize, &mut [[f64; 3]]) + Sync) -> [f64; 3] {
    let mut each = vec![[0.0; 3]; n];
    let task = |(task, each): (usize, &mut [[f64; 3]])| fill(task * TASK, each);
    if n < PARALLEL_FROM {
        each.chunks_mut(TASK).enumerate().for_each(task);
    } else {
        each.par_chunks_mut(TASK).enumerate().for_each(task);
    }
    std::array::from_fn(|k| each.iter().map(|energies| energies[k]).collect::<Sum>().value())
}

/// Energies of consecutive places, with the partners that cells give them.
struct EnergyCells<'a> {
    field: &'a Field,
    r: &'a Columns,
    cells: &'a Cells,
    first: usize,
    energy: &'a mut [[f64; 3]],
}

impl Kernel for EnergyCells<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { field, r, cells, first, energy } = self;
        let places = first..first + energy.len();
        cells.walk(places, &mut Visitor { simd, field, r, first, energy });
    }
}

/// Adds up the energies of one place after another.
struct Visitor<'a, S> {
    simd: S,
    field: &'a Field,
    r: &'a Columns,
    first: usize,
    energy: &'a mut [[f64; 3]],
}

impl<S: Simd> Visit for Visitor<'_, S> {
    #[inline(always)]
    fn visit(&mut self, place: usize, runs: &[Range<usize>]) {
        let mut row = Row::new(self.simd, self.field, self.r, place);
        for run in runs {
            row.add_run(run.clone());
        }
        self.energy[place - self.first] = row.energies();
    }
}

/// Energies of consecutive rows, with partners of larger number (or place) only.
struct EnergyRows<'a> {
    field: &'a Field,
    r: &'a Columns,
    list: Option<&'a NeighborList>,
    first: usize,
    energy: &'a mut [[f64; 3]],
}

impl Kernel for EnergyRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { field, r, list, first, energy } = self;
        for (k, energy) in energy.iter_mut().enumerate() {
            let i = first + k;
            let mut row = Row::new(simd, field, r, i);
            match list {
                None => row.add_run(i + 1..r.len()),
                Some(list) => row.add_listed(list.row(i)),
            }
            *energy = row.energies();
        }
    }
}

/// Up to eight partners.
trait Partners<S: Simd> {
    /// How many.
    fn count(&self) -> usize;
    /// Their values in a column; anything beyond their number.
    fn of(&self, simd: S, column: &[f64]) -> S::F;
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

/// A particle and the energies of its pairs so far: near field, binding, absolute.
struct Row<'a, S: Simd> {
    simd: S,
    field: &'a Field,
    r: &'a Columns,
    i: usize,
    lanes: [S::F; 3],
}

impl<'a, S: Simd> Row<'a, S> {
    #[inline(always)]
    fn new(simd: S, field: &'a Field, r: &'a Columns, i: usize) -> Self {
        Self { simd, field, r, i, lanes: [simd.splat(0.0); 3] }
    }

    #[inline(always)]
    fn energies(&self) -> [f64; 3] {
        let [near_field, binding, size] = self.lanes;
        [near_field.sum(), binding.sum(), size.sum()]
    }

    /// Adds the pairs with consecutive others.
    #[inline(always)]
    fn add_run(&mut self, run: Range<usize>) {
        let mut first = run.start;
        while first < run.end {
            let count = LANES.min(run.end - first);
            self.add(&Consecutive { first, count });
            first += count;
        }
    }

    /// Adds the pairs with listed others behind the particle itself.
    #[inline(always)]
    fn add_listed(&mut self, others: &[u32]) {
        let (mut particles, mut count) = ([self.i as u32; LANES], 0);
        for &j in others {
            particles[count] = j;
            count += usize::from(j as usize > self.i);
            if count == LANES {
                self.add(&Listed { particles: &particles, count });
                count = 0;
            }
        }
        if count > 0 {
            self.add(&Listed { particles: &particles, count });
        }
    }

    /// Adds the pairs with up to eight partners.
    #[inline(always)]
    fn add(&mut self, partners: &impl Partners<S>) {
        let simd = self.simd;
        let periodic = &self.field.periodic;
        let (Columns { x, y, z }, i) = (self.r, self.i);
        let d = [
            partners.of(simd, x) - simd.splat(x[i]),
            partners.of(simd, y) - simd.splat(y[i]),
            partners.of(simd, z) - simd.splat(z[i]),
        ];
        let d = separation(simd, periodic, periodic.any(), d);
        let mut square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
        // Surplus lanes are infinitely far.
        let inside = simd.load(&LANE).le(simd.splat(partners.count() as f64 - 1.0));
        square = square.select(inside, simd.splat(f64::INFINITY));
        let inverse = simd.splat(1.0) / square.sqrt();
        let near_field = self.near_field(partners, square, inverse);
        self.lanes[0] = self.lanes[0] + near_field;
        self.lanes[2] = self.lanes[2] + magnitude(simd, near_field);
        if let Some(binding) = &self.field.binding
            && let Some(binding) = self.bound(binding, partners, square, inverse)
        {
            self.lanes[1] = self.lanes[1] + binding;
            self.lanes[2] = self.lanes[2] + magnitude(simd, binding);
        }
    }

    /// Products of a column's values.
    #[inline(always)]
    fn product(&self, partners: &impl Partners<S>, column: &[f64]) -> S::F {
        partners.of(self.simd, column) * self.simd.splat(column[self.i])
    }

    /// Near-field potentials (2) with cut-off and switch [J].
    #[inline(always)]
    fn near_field(&self, partners: &impl Partners<S>, square: S::F, inverse: S::F) -> S::F {
        let simd = self.simd;
        let mut energy = simd.splat(0.0);
        for group in &self.field.groups {
            energy = energy + self.group(group, partners, square, inverse);
        }
        if let Some(switch) = self.field.switch {
            energy = energy * switch.lanes(simd, square * inverse).0;
        }
        energy.keep(square.le(simd.splat(square_of(self.field.cutoff))))
    }

    /// Potentials of terms that share a weight [J].
    #[inline(always)]
    fn group(&self, group: &Group, partners: &impl Partners<S>, square: S::F, inverse: S::F) -> S::F {
        let simd = self.simd;
        let mut energy = simd.splat(0.0);
        for term in &group.terms {
            let potential = potential(simd, &term.power, square, inverse);
            energy = energy + simd.splat(term.strength) * (potential - simd.splat(term.shift));
        }
        match &group.weight {
            Some(weight) => energy * self.product(partners, weight),
            None => energy,
        }
    }

    /// Binding potentials (13) of bonded pairs [J]; `None` where no pair is.
    #[inline(always)]
    fn bound(&self, term: &BindingTerm, partners: &impl Partners<S>, square: S::F, inverse: S::F) -> Option<S::F> {
        let simd = self.simd;
        let sum = match &term.radius {
            Some(radius) => partners.of(simd, radius) + simd.splat(radius[self.i]),
            None => simd.splat(term.largest + term.largest),
        };
        let reach = simd.splat(term.range) * sum;
        let reach_square = reach * reach;
        let bonded = square.le(reach_square);
        if !S::F::any(bonded) {
            return None;
        }
        // The same potential at the activation distance, which may differ from pair to pair.
        let shift = potential(simd, &term.power, reach_square, simd.splat(1.0) / reach_square.sqrt());
        let mut energy = simd.splat(term.strength) * (potential(simd, &term.power, square, inverse) - shift);
        if let Some(weight) = &term.weight {
            energy = energy * self.product(partners, weight);
        }
        Some(energy.keep(bonded))
    }
}

/// Without the sign.
#[inline(always)]
fn magnitude<S: Simd>(simd: S, x: S::F) -> S::F {
    x.and_bits(simd.bits(!(1 << 63)))
}

/// P(beta) from s^2 and 1/s.
#[inline(always)]
fn potential<S: Simd>(simd: S, power: &Power, square: S::F, inverse: S::F) -> S::F {
    let logarithm = if power.potential_needs_logarithm() { crate::lanes::ln(simd, square) } else { inverse };
    // A logarithm does not need the power.
    let of_power = if power.exponent == 1.0 { inverse } else { power.lanes(simd, logarithm, inverse) };
    power.potential_lanes(simd, square, logarithm, inverse, of_power)
}
