//! The near field without a cut-off, by a fast multipole method: pairs of distant cells meet by Cartesian expansions.
//!
//! A tree is built afresh from every set of positions. Moments go up from its leaves, cells that are small for their
//! distance meet by expansions, what they make of each other goes down, and neighbouring leaves meet pair by pair. Order and
//! opening are the cheapest that keep a sample of the forces at the start within the scene's error.

mod expansion;
mod leaves;
mod single;
mod sweep;
#[cfg(test)]
mod tests;
mod tree;
mod walk;

use super::composition::{Bond, Job, Law, compose_unbounded};
use super::near_field::{BindingTerm, Field};
use super::potential::{self, Potential, PotentialJob};
use crate::math::Sum;
use crate::simd::dispatch;
use crate::state::Columns;
use expansion::Degrees;
use leaves::{Energies, Forces, Near};
use rayon::prelude::*;
use single::Single;
use std::ops::Range;
use sweep::{Moments, Sweep};
use tree::Tree;
use walk::{Meeting, Meetings, Rule, Task, split};

/// Below this number of particles all pairs are faster.
const FROM: usize = 3000;
/// Orders that are tried.
const ORDERS: Range<usize> = 2..13;
/// How large cells that meet by expansions may be for their distance [-]: what is tried. Expansions converge faster for
/// small ones, and more pairs are left.
const OPENINGS: [f64; 6] = [0.7, 0.65, 0.6, 0.5, 0.4, 0.3];
/// Parts of the cloud in which the error is sampled.
const SAMPLES: usize = 12;
/// The sampled error is at most this share of what is allowed: the cloud changes.
const SAFETY: f64 = 0.5;

/// Order and opening for energies, to which distant pairs give more than to forces: no less than forces have, and enough
/// for an error of their absolute values that is allowed of forces (measured).
fn for_energies(order: usize, opening: f64, accuracy: f64) -> (usize, f64) {
    let least = (-1.5 * accuracy.log10()).ceil().max(0.0) as usize;
    (order.max(least).min(ORDERS.end - 1), opening.min(0.5))
}

/// Most particles of a leaf: with fewer, expansions cost more than the pairs that they save.
fn leaf(accuracy: f64) -> usize {
    if accuracy < 1e-5 { 96 } else { 64 }
}

/// The method with its space, kept between calls.
#[derive(Clone, Debug)]
pub(crate) struct Far {
    degrees: Degrees,
    opening: f64,
    /// Those for energies.
    energies: (Degrees, f64),
    leaf: usize,
    tree: Tree,
    moments: Moments,
    forces: Vec<[f64; 3]>,
    single: Single,
}

/// Forces on some particles spread over the cloud, and what they cost.
struct Sample {
    /// In the order of places [N].
    forces: Vec<[f64; 3]>,
    /// In pairs that take as long.
    cost: f64,
}

/// A tree with moments, and what is left to be done.
struct Prepared<'a> {
    field: &'a Field,
    degrees: &'a Degrees,
    tree: &'a Tree,
    moments: &'a Moments,
    rule: Rule,
    tasks: Vec<Task>,
    top: Meetings,
    /// Local expansions of the cells at the top.
    top_local: Vec<f64>,
}

impl Far {
    /// For particles that start at r [m], with a relative error of the forces that is allowed. `None` where all pairs are
    /// faster.
    pub(crate) fn new(field: &Field, r: &Columns, accuracy: f64) -> Option<Self> {
        if r.len() < FROM || field.groups.is_empty() {
            return None;
        }
        let mut tree = Tree::default();
        tree.build(r, leaf(accuracy));
        let single = Single::new(field, tree.spacing(), accuracy);
        let mut far = Self {
            degrees: Degrees::new(ORDERS.start),
            opening: OPENINGS[0],
            energies: (Degrees::default(), 0.0),
            leaf: leaf(accuracy),
            tree,
            moments: Moments::default(),
            forces: Vec::new(),
            single,
        };
        let exact = far.sample(field, false);
        let mut best = (exact.cost, None);
        for opening in OPENINGS {
            for order in ORDERS {
                (far.degrees, far.opening) = (Degrees::new(order), opening);
                let sample = far.sample(field, true);
                if sample.cost >= best.0 {
                    break;
                }
                if error(&sample.forces, &exact.forces) <= SAFETY * accuracy {
                    best = (sample.cost, Some((order, opening)));
                    break;
                }
            }
        }
        let (order, opening) = best.1?;
        (far.degrees, far.opening) = (Degrees::new(order), opening);
        let (order, opening) = for_energies(order, opening, accuracy);
        far.energies = (Degrees::new(order), opening);
        Some(far)
    }

    /// Order of the expansions.
    pub(crate) fn order(&self) -> usize {
        self.degrees.order
    }

    /// Adds the forces of all pairs to `force` [N]; returns the number of unordered pairs that met as pairs.
    pub(super) fn forces(&mut self, field: &Field, r: &Columns, force: &mut Columns) -> u64 {
        let Self { degrees, opening, leaf, tree, moments, forces, single, .. } = self;
        tree.build(r, *leaf);
        let prepared = Prepared::new(field, degrees, *opening, tree, moments);
        let near = Near::new(single, tree, true);
        forces.resize(r.len(), [0.0; 3]);
        let mut pairs = 0;
        let job = AllTasks { prepared: &prepared, near: &near, forces, pairs: &mut pairs };
        compose_unbounded(&single.field, &near.ordered, job);
        for (axis, force) in force.axes_mut().into_iter().enumerate() {
            for (&i, own) in tree.order.iter().zip(forces.iter()) {
                force[i as usize] += own[axis];
            }
        }
        pairs / 2
    }

    /// Near-field and binding energy, and a lower bound of the sum of the absolute energies of all pairs, at positions r
    /// [J].
    pub(super) fn energies(&self, field: &Field, r: &Columns) -> [f64; 3] {
        let (mut tree, mut moments) = (Tree::default(), Moments::default());
        tree.build(r, self.leaf);
        let (degrees, opening) = &self.energies;
        let prepared = Prepared::new(field, degrees, *opening, &tree, &mut moments);
        let sorted = field.sorted(|column| tree.sorted(column));
        potential::compose(&sorted, AllEnergies(&prepared))
    }

    /// By expansions, or by pairs alone.
    fn sample(&mut self, field: &Field, by_expansions: bool) -> Sample {
        let Self { degrees, opening, tree, moments, single, .. } = self;
        let prepared = Prepared::new(field, degrees, *opening, tree, moments);
        let near = Near::new(single, tree, by_expansions);
        let mut sample = Sample { forces: Vec::new(), cost: 0.0 };
        let stride = prepared.tasks.len().div_ceil(SAMPLES);
        for task in prepared.tasks.iter().step_by(stride) {
            let mut leaf = task.cell;
            while !tree.cells[leaf].is_leaf() {
                leaf = tree.cells[leaf].children().start;
            }
            let count = tree.cells[leaf].len();
            let (size, n) = (tree.cells[task.cell].len(), tree.order.len());
            let mut own = vec![[0.0; 3]; size];
            // Who meets everyone as pairs has nothing from above.
            let (meetings, parent) = match by_expansions {
                true => (task.meetings(tree, prepared.rule), task.parent),
                false => (everyone(leaf, n), None),
            };
            let (forces, mut pairs) = (&mut own[..], 0);
            let job = OneTask {
                prepared: &prepared,
                near: &near,
                task,
                parent,
                meetings: &meetings,
                forces,
                pairs: &mut pairs,
            };
            compose_unbounded(&single.field, &near.ordered, job);
            sample.forces.extend_from_slice(&own[..count]);
            // All pairs meet once and in 64 bits; leaves meet from both sides.
            sample.cost += match by_expansions {
                true => {
                    near.cost() * pairs as f64 + meetings.far.len() as f64 * degrees.cost() * field.groups.len() as f64
                }
                false => 0.5 * Near::FULL * (size * n) as f64,
            };
        }
        sample
    }
}

/// A leaf that meets everyone as pairs.
fn everyone(leaf: usize, n: usize) -> Meetings {
    let meeting = Meeting { cell: leaf, parent: None, far: 0..0, near: 0..1 };
    Meetings { meetings: vec![meeting], far: Vec::new(), near: std::iter::once(0..n as u32).collect() }
}

/// Root of the mean square of the differences over that of the exact forces [-].
fn error(found: &[[f64; 3]], exact: &[[f64; 3]]) -> f64 {
    let (mut off, mut all) = (0.0, 0.0);
    for (found, exact) in found.iter().flatten().zip(exact.iter().flatten()) {
        off += (found - exact) * (found - exact);
        all += exact * exact;
    }
    if all > 0.0 { (off / all).sqrt() } else { 0.0 }
}

impl<'a> Prepared<'a> {
    fn new(field: &'a Field, degrees: &'a Degrees, opening: f64, tree: &'a Tree, moments: &'a mut Moments) -> Self {
        let weights = field.groups.iter().map(|group| group.weight.as_deref().map(|column| tree.sorted(column)));
        moments.fill(degrees, tree, weights.collect());
        // Bonds need pairs.
        let reach = field.binding.as_ref().map_or(0.0, BindingTerm::largest_reach);
        let rule = Rule { opening, reach };
        let (top, tasks) = split(tree, rule);
        let mut prepared = Self { field, degrees, tree, moments, rule, tasks, top, top_local: Vec::new() };
        let mut top_local = Vec::new();
        dispatch(prepared.sweep(&prepared.top, None, &mut top_local, ()));
        prepared.top_local = top_local;
        prepared
    }

    /// Goes through meetings; the first one's parent is at the top.
    fn sweep<'b, A>(
        &'b self,
        meetings: &'b Meetings,
        parent: Option<usize>,
        local: &'b mut Vec<f64>,
        at_leaf: A,
    ) -> Sweep<'b, A> {
        let stride = self.moments.stride();
        let parent = parent
            .map(|number| (self.top.meetings[number].cell, &self.top_local[number * stride..(number + 1) * stride]));
        Sweep {
            degrees: self.degrees,
            groups: &self.field.groups,
            tree: self.tree,
            moments: self.moments,
            meetings,
            parent,
            local,
            at_leaf,
        }
    }
}

/// Forces on the particles of a task. No type parameter, as in `tasks::each`: threads are compiled once, not for every law.
type TaskForces<'a> = dyn Fn((&Task, &mut [[f64; 3]])) -> u64 + Sync + 'a;

/// Forces on the particles of all tasks, in the order of places.
struct AllTasks<'a> {
    prepared: &'a Prepared<'a>,
    near: &'a Near<'a>,
    forces: &'a mut [[f64; 3]],
    pairs: &'a mut u64,
}

impl Job for AllTasks<'_> {
    fn run<L: Law, B: Bond>(self, law: L, bond: B) {
        let Self { prepared, near, mut forces, pairs } = self;
        let mut parts = Vec::with_capacity(prepared.tasks.len());
        for task in &prepared.tasks {
            let (own, rest) = forces.split_at_mut(prepared.tree.cells[task.cell].len());
            parts.push((task, own));
            forces = rest;
        }
        let one: &TaskForces<'_> = &|(task, forces)| {
            let meetings = task.meetings(prepared.tree, prepared.rule);
            task_forces(prepared, near, (task, task.parent), &meetings, forces, (law, bond))
        };
        *pairs = parts.into_par_iter().with_max_len(1).map(one).sum();
    }
}

/// Forces on the particles of one task.
struct OneTask<'a> {
    prepared: &'a Prepared<'a>,
    near: &'a Near<'a>,
    task: &'a Task,
    /// Number of the meeting above.
    parent: Option<usize>,
    meetings: &'a Meetings,
    forces: &'a mut [[f64; 3]],
    pairs: &'a mut u64,
}

impl Job for OneTask<'_> {
    fn run<L: Law, B: Bond>(self, law: L, bond: B) {
        let Self { prepared, near, task, parent, meetings, forces, pairs } = self;
        *pairs = task_forces(prepared, near, (task, parent), meetings, forces, (law, bond));
    }
}

fn task_forces<L: Law, B: Bond>(
    prepared: &Prepared<'_>,
    near: &Near<'_>,
    (task, parent): (&Task, Option<usize>),
    meetings: &Meetings,
    forces: &mut [[f64; 3]],
    (law, bond): (L, B),
) -> u64 {
    let first = prepared.tree.cells[task.cell].places().start;
    let at_leaf = Forces { law, bond, near, tree: prepared.tree, first, forces, pairs: 0 };
    dispatch(prepared.sweep(meetings, parent, &mut Vec::new(), at_leaf)).pairs
}

/// Energies of all tasks.
struct AllEnergies<'a>(&'a Prepared<'a>);

impl PotentialJob for AllEnergies<'_> {
    type Output = [f64; 3];

    fn run<P: Potential, B: Potential>(self, near: P, bond: B) -> [f64; 3] {
        let prepared = self.0;
        let one: &(dyn Fn(&Task) -> [f64; 3] + Sync) = &|task| {
            let meetings = task.meetings(prepared.tree, prepared.rule);
            let at_leaf = Energies { law: (near, bond), tree: prepared.tree, sums: [Sum::default(); 3] };
            let done = dispatch(prepared.sweep(&meetings, task.parent, &mut Vec::new(), at_leaf));
            done.sums.map(|sum| sum.value())
        };
        let parts: Vec<[f64; 3]> = prepared.tasks.par_iter().with_max_len(1).map(one).collect();
        // Everyone has met everyone from both sides.
        std::array::from_fn(|k| 0.5 * parts.iter().map(|part| part[k]).collect::<Sum>().value())
    }
}
