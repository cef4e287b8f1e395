//! A binary tree: particles sorted along a space-filling curve, cells halved along x, y, z in turn until few are left in each.

use crate::neighbor::bounds;
use crate::state::Columns;
use rayon::prelude::*;
use std::ops::Range;

/// Bits of a coordinate in a key; three times as many is the greatest depth.
const BITS: u32 = 21;

/// A cell and the ball that holds its particles.
#[derive(Clone, Debug, Default)]
pub(super) struct Cell {
    /// Places of its particles.
    first: u32,
    end: u32,
    /// Numbers of its children; none: a leaf.
    first_child: u32,
    end_child: u32,
    depth: u32,
    /// Centre of the box around its particles [m].
    pub(super) centre: [f64; 3],
    /// Distance of the farthest particle from it [m].
    pub(super) radius: f64,
}

impl Cell {
    pub(super) fn places(&self) -> Range<usize> {
        self.first as usize..self.end as usize
    }

    pub(super) fn len(&self) -> usize {
        (self.end - self.first) as usize
    }

    pub(super) fn children(&self) -> Range<usize> {
        self.first_child as usize..self.end_child as usize
    }

    pub(super) fn is_leaf(&self) -> bool {
        self.first_child == self.end_child
    }
}

/// Particles in the order of places, and cells: a parent before its children, which follow each other.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    /// The particle at every place, length n.
    pub(super) order: Vec<u32>,
    /// Positions in the order of places [m].
    pub(super) position: Columns,
    pub(super) cells: Vec<Cell>,
    keyed: Vec<(u64, u32)>,
}

impl Tree {
    /// Builds it for positions r, at least one [m], with at most so many particles in a leaf.
    pub(super) fn build(&mut self, r: &Columns, leaf: usize) {
        self.sort(r);
        self.divide(leaf);
        let position = &self.position;
        self.cells.par_iter_mut().with_min_len(64).for_each(|cell| {
            let columns = position.axes().map(|column| &column[cell.places()]);
            let ends = columns.map(bounds);
            cell.centre = ends.map(|(low, high)| 0.5 * (low + high));
            let [x, y, z] = cell.centre;
            let mut square = 0.0_f64;
            for k in 0..columns[0].len() {
                let d = [columns[0][k] - x, columns[1][k] - y, columns[2][k] - z];
                square = square.max(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            }
            cell.radius = square.sqrt();
        });
    }

    /// A distance in the middle of those between neighbours [m].
    pub(super) fn spacing(&self) -> f64 {
        let leaves = self.cells.iter().filter(|cell| cell.is_leaf() && cell.radius > 0.0);
        let mut spacings: Vec<f64> = leaves.map(|leaf| leaf.radius / (leaf.len() as f64).cbrt()).collect();
        spacings.sort_unstable_by(f64::total_cmp);
        spacings.get(spacings.len() / 2).copied().unwrap_or(1.0)
    }

    /// A column in the order of places.
    pub(super) fn sorted(&self, column: &[f64]) -> Vec<f64> {
        self.order.iter().map(|&i| column[i as usize]).collect()
    }

    fn sort(&mut self, r: &Columns) {
        let ends = r.axes().map(bounds);
        let size = ends.iter().fold(0.0_f64, |size, (low, high)| size.max(high - low));
        let scale = if size > 0.0 { f64::from(1_u32 << BITS) / size } else { 0.0 };
        let digit = |x: f64, low: f64| spread((((x - low) * scale) as u64).min((1 << BITS) - 1));
        let key = |i: usize| digit(r.x[i], ends[0].0) | digit(r.y[i], ends[1].0) << 1 | digit(r.z[i], ends[2].0) << 2;
        self.keyed.clear();
        self.keyed.extend((0..r.len()).map(|i| (key(i), i as u32)));
        self.keyed.par_sort_unstable();
        self.order.clear();
        self.order.extend(self.keyed.iter().map(|&(_, i)| i));
        let Columns { x, y, z } = &mut self.position;
        for (sorted, column) in [x, y, z].into_iter().zip(r.axes()) {
            sorted.clear();
            sorted.extend(self.order.iter().map(|&i| column[i as usize]));
        }
    }

    fn divide(&mut self, leaf: usize) {
        self.cells.clear();
        self.cells.push(Cell { end: self.keyed.len() as u32, ..Cell::default() });
        let mut number = 0;
        while number < self.cells.len() {
            let (places, depth) = (self.cells[number].places(), self.cells[number].depth);
            let children = self.cells.len();
            if places.len() > leaf && depth < 3 * BITS {
                // Halved across one axis after the other.
                let bit = 1 << (3 * BITS - 1 - depth);
                let middle = places.start + self.keyed[places.clone()].partition_point(|(key, _)| key & bit == 0);
                for half in [places.start..middle, middle..places.end].into_iter().filter(|half| !half.is_empty()) {
                    let (first, end) = (half.start as u32, half.end as u32);
                    self.cells.push(Cell { first, end, depth: depth + 1, ..Cell::default() });
                }
            }
            (self.cells[number].first_child, self.cells[number].end_child) = (children as u32, self.cells.len() as u32);
            number += 1;
        }
    }
}

/// Two zeros between any two bits of a number below 2^21.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001F_0000_0000_FFFF;
    let x = (x | x << 16) & 0x001F_0000_FF00_00FF;
    let x = (x | x << 8) & 0x100F_00F0_0F00_F00F;
    let x = (x | x << 4) & 0x10C3_0C30_C30C_30C3;
    (x | x << 2) & 0x1249_2492_4924_9249
}
