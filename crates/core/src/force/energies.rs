//! The pair loop for potential energies: eight pairs at a time, each pair once.
//!
//! Nothing is written to memory in between, which is what takes the time where no forces are wanted.

use super::near_field::{BindingTerm, Field, Group};
use super::power::{LANES, Power};
use super::rows::{PARALLEL_FROM, ROWS, square_of, sum};
use crate::cells::{Cells, Visit};
use crate::math::Sum;
use crate::simd::{Task, vectorized};
use crate::state::Columns;
use rayon::prelude::*;
use std::ops::Range;

/// One number for each of eight pairs.
type Eight = [f64; LANES];

/// Near-field and binding energy, and the sum of the absolute energies of all pairs [J]; each pair is met once, in the
/// row of its first particle.
pub(super) fn energies(field: &Field, r: &Columns) -> [f64; 3] {
    let mut each = vec![[0.0; 3]; r.len()];
    let fill = |(task, each): (usize, &mut [[f64; 3]])| {
        vectorized(EnergyRows { field, r, first: task * ROWS, energy: each });
    };
    if field.neighbors.pairs(r.len()) < PARALLEL_FROM {
        fill((0, &mut each));
    } else {
        each.par_chunks_mut(ROWS).enumerate().for_each(fill);
    }
    total(&each)
}

/// The same from the positions alone, by cells instead of lists.
pub(super) fn energies_by_cells(field: &Field, r: &Columns) -> [f64; 3] {
    let cells = Cells::new(r, field.reach(), &field.periodic);
    let (sorted, ordered);
    let (field, r) = if cells.is_one() {
        (field, r)
    } else {
        (sorted, ordered) = (field.sorted(&cells), cells.sorted_vectors(r));
        (&sorted, &ordered)
    };
    let mut each = vec![[0.0; 3]; r.len()];
    let fill = |(task, energy): (usize, &mut [[f64; 3]])| {
        vectorized(EnergyCells { field, r, cells: &cells, first: task * TASK, energy });
    };
    if r.len() < PARALLEL_PLACES {
        each.chunks_mut(TASK).enumerate().for_each(fill);
    } else {
        each.par_chunks_mut(TASK).enumerate().for_each(fill);
    }
    total(&each)
}

fn total(each: &[[f64; 3]]) -> [f64; 3] {
    std::array::from_fn(|k| each.iter().map(|energies| energies[k]).collect::<Sum>().value())
}

/// Places per task by cells, and places from which tasks are worth their overhead.
const TASK: usize = 256;
const PARALLEL_PLACES: usize = 1024;

/// Energies of consecutive places, with the partners that cells give them.
struct EnergyCells<'a> {
    field: &'a Field,
    r: &'a Columns,
    cells: &'a Cells,
    first: usize,
    energy: &'a mut [[f64; 3]],
}

impl Task for EnergyCells<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        if self.field.periodic.any() { self.all::<true>() } else { self.all::<false>() }
    }
}

impl EnergyCells<'_> {
    #[inline(always)]
    fn all<const PERIODIC: bool>(self) {
        let Self { field, r, cells, first, energy } = self;
        let places = first..first + energy.len();
        cells.walk(places, &mut Visitor::<PERIODIC> { field, r, first, energy });
    }
}

/// Adds up the energies of one place after another.
struct Visitor<'a, const PERIODIC: bool> {
    field: &'a Field,
    r: &'a Columns,
    first: usize,
    energy: &'a mut [[f64; 3]],
}

impl<const PERIODIC: bool> Visit for Visitor<'_, PERIODIC> {
    #[inline(always)]
    fn visit(&mut self, place: usize, runs: &[Range<usize>]) {
        let mut lanes = [[0.0; LANES]; 3];
        for run in runs {
            add_run::<PERIODIC>(self.field, self.r, place, run.clone(), &mut lanes);
        }
        self.energy[place - self.first] = [sum(&lanes[0]), sum(&lanes[1]), sum(&lanes[2])];
    }
}

/// Energies of consecutive rows, with partners of larger number only.
pub(super) struct EnergyRows<'a> {
    pub(super) field: &'a Field,
    pub(super) r: &'a Columns,
    pub(super) first: usize,
    pub(super) energy: &'a mut [[f64; 3]],
}

impl Task for EnergyRows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        if self.field.periodic.any() { self.all::<true>() } else { self.all::<false>() }
    }
}

impl EnergyRows<'_> {
    #[inline(always)]
    fn all<const PERIODIC: bool>(self) {
        for (k, energy) in self.energy.iter_mut().enumerate() {
            let lanes = row::<PERIODIC>(self.field, self.r, self.first + k);
            *energy = [sum(&lanes[0]), sum(&lanes[1]), sum(&lanes[2])];
        }
    }
}

/// Near-field, binding and absolute energy of the pairs of particle i with partners of larger number, in lanes.
#[inline(always)]
fn row<const PERIODIC: bool>(field: &Field, r: &Columns, i: usize) -> [Eight; 3] {
    let mut lanes = [[0.0; LANES]; 3];
    match field.neighbors.row(i) {
        None => add_run::<PERIODIC>(field, r, i, i + 1..r.len(), &mut lanes),
        Some(list) => {
            let after = list.partition_point(|&j| (j as usize) < i);
            for partners in list[after..].chunks(LANES) {
                add::<PERIODIC>(field, r, i, &Listed(partners), &mut lanes);
            }
        }
    }
    lanes
}

/// Adds the energies of particle i with consecutive others to lanes.
#[inline(always)]
fn add_run<const PERIODIC: bool>(field: &Field, r: &Columns, i: usize, run: Range<usize>, lanes: &mut [Eight; 3]) {
    let mut first = run.start;
    while first < run.end {
        let count = LANES.min(run.end - first);
        add::<PERIODIC>(field, r, i, &Consecutive { first, count }, lanes);
        first += count;
    }
}

/// Up to eight partners.
trait Partners {
    /// How many.
    fn count(&self) -> usize;
    /// Their values in a column; zero beyond their number.
    fn of(&self, column: &[f64]) -> Eight;
}

/// Consecutive particles.
struct Consecutive {
    first: usize,
    count: usize,
}

impl Partners for Consecutive {
    #[inline(always)]
    fn count(&self) -> usize {
        self.count
    }

    #[inline(always)]
    fn of(&self, column: &[f64]) -> Eight {
        let rest = &column[self.first..];
        if let Some(values) = rest.first_chunk::<LANES>() {
            return *values;
        }
        let mut values = [0.0; LANES];
        for (value, &held) in values.iter_mut().zip(&rest[..self.count]) {
            *value = held;
        }
        values
    }
}

/// Particles of a list.
struct Listed<'a>(&'a [u32]);

impl Partners for Listed<'_> {
    #[inline(always)]
    fn count(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn of(&self, column: &[f64]) -> Eight {
        let mut values = [0.0; LANES];
        for (value, &j) in values.iter_mut().zip(self.0) {
            *value = column[j as usize];
        }
        values
    }
}

/// Adds the energies of particle i with up to eight partners to lanes.
#[inline(always)]
fn add<const PERIODIC: bool>(field: &Field, r: &Columns, i: usize, partners: &impl Partners, lanes: &mut [Eight; 3]) {
    let mut square = [0.0; LANES];
    for axis in 0..3 {
        let column = r.axes()[axis];
        let (own, others) = (column[i], partners.of(column));
        for k in 0..LANES {
            let d = others[k] - own;
            let d = if PERIODIC { field.periodic.minimum_image(axis, d) } else { d };
            square[k] += d * d;
        }
    }
    // Surplus lanes are infinitely far.
    for k in 0..LANES {
        square[k] = if k < partners.count() { square[k] } else { f64::INFINITY };
    }
    let mut inverse = [0.0; LANES];
    for k in 0..LANES {
        inverse[k] = 1.0 / square[k].sqrt();
    }
    let near_field = near_field(field, i, partners, &square, &inverse);
    for k in 0..LANES {
        lanes[0][k] += near_field[k];
        lanes[2][k] += near_field[k].abs();
    }
    if let Some(binding) = &field.binding
        && let Some(binding) = bound(binding, i, partners, &square, &inverse)
    {
        for k in 0..LANES {
            lanes[1][k] += binding[k];
            lanes[2][k] += binding[k].abs();
        }
    }
}

/// Near-field potentials (2) with cut-off and switch [J].
#[inline(always)]
fn near_field(field: &Field, i: usize, partners: &impl Partners, square: &Eight, inverse: &Eight) -> Eight {
    let mut energy = [0.0; LANES];
    for group in &field.groups {
        let part = group_energy(group, i, partners, square, inverse);
        for k in 0..LANES {
            energy[k] += part[k];
        }
    }
    if let Some(switch) = field.switch {
        for k in 0..LANES {
            energy[k] *= switch.at(square[k] * inverse[k]).0;
        }
    }
    let reach = square_of(field.cutoff);
    for k in 0..LANES {
        energy[k] = if square[k] <= reach { energy[k] } else { 0.0 };
    }
    energy
}

/// Potentials of terms that share a weight [J].
#[inline(always)]
fn group_energy(group: &Group, i: usize, partners: &impl Partners, square: &Eight, inverse: &Eight) -> Eight {
    let mut energy = [0.0; LANES];
    for term in &group.terms {
        let potential = potential(&term.power, square, inverse);
        for k in 0..LANES {
            energy[k] += term.strength * (potential[k] - term.shift);
        }
    }
    if let Some(weight) = &group.weight {
        let (own, others) = (weight[i], partners.of(weight));
        for k in 0..LANES {
            energy[k] *= others[k] * own;
        }
    }
    energy
}

/// Binding potentials (13) of bonded pairs [J]; `None` where no pair is.
#[inline(always)]
fn bound(binding: &BindingTerm, i: usize, partners: &impl Partners, square: &Eight, inverse: &Eight) -> Option<Eight> {
    let (own, others) = (binding.radius[i], partners.of(&binding.radius));
    let (mut reach, mut reach_square) = ([1.0; LANES], [1.0; LANES]);
    let mut any = false;
    for k in 0..LANES {
        reach[k] = binding.range * (others[k] + own);
        reach_square[k] = reach[k] * reach[k];
        any |= square[k] <= reach_square[k];
    }
    if !any {
        return None;
    }
    let mut reach_inverse = [0.0; LANES];
    for k in 0..LANES {
        reach_inverse[k] = 1.0 / reach[k];
    }
    // The same potential at the activation distance, which differs from pair to pair.
    let shift = potential(&binding.power, &reach_square, &reach_inverse);
    let mut energy = potential(&binding.power, square, inverse);
    for k in 0..LANES {
        energy[k] = binding.strength * (energy[k] - shift[k]);
    }
    if let Some(weight) = &binding.weight {
        let (own, others) = (weight[i], partners.of(weight));
        for k in 0..LANES {
            energy[k] *= others[k] * own;
        }
    }
    for k in 0..LANES {
        energy[k] = if square[k] <= reach_square[k] { energy[k] } else { 0.0 };
    }
    Some(energy)
}

/// P(beta) from s^2 and 1/s.
#[inline(always)]
fn potential(power: &Power, square: &Eight, inverse: &Eight) -> Eight {
    let (mut of_power, mut potential) = ([0.0; LANES], [0.0; LANES]);
    // A logarithm does not need the power.
    if power.exponent != 1.0 {
        power.block::<LANES, LANES>(square, inverse, &mut of_power);
    }
    power.potential_block::<LANES, LANES>(square, inverse, &of_power, &mut potential);
    potential
}
