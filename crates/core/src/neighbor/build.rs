//! Building a list: particles sorted by rows of a grid, then eight candidates at a time.

use super::{NeighborList, Rows, TASK};
use crate::domain::Periodic;
use crate::lanes::round;
use crate::math::median;
use crate::simd::{Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
use rayon::prelude::*;
use std::ops::Range;

/// Bits of a sort key for z and y each, and for x.
const ROW_BITS: u32 = 21;
const X_BITS: u32 = 22;
/// Steps along x over a reach: finer ones look at fewer candidates in vain.
const X_STEPS: f64 = 64.0;
/// Particles from which sorting and sharing out are worth their overhead.
const PARALLEL_FROM: usize = 2048;

/// The set bits of a mask, in order, and then anything.
const PLACES: [[u8; LANES]; 256] = {
    let mut places = [[0; LANES]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut bit, mut count) = (0, 0);
        while bit < LANES {
            if mask >> bit & 1 == 1 {
                places[mask][count] = bit as u8;
                count += 1;
            }
            bit += 1;
        }
        mask += 1;
    }
    places
};

impl NeighborList {
    /// Builds the rows for these positions.
    pub fn build(&mut self, r: &Columns, periodic: &Periodic) {
        let n = r.len();
        let reach = self.range + self.skin;
        let sorting = [0, 1, 2].map(|axis| Steps::new(r.axes()[axis], axis, reach, periodic));
        let key = |i: usize| {
            let step = |axis: usize| sorting[axis].step(r.axes()[axis][i]);
            (step(2) << (ROW_BITS + X_BITS)) | (step(1) << X_BITS) | step(0)
        };
        let mut keyed: Vec<(u64, u32)>;
        if n < PARALLEL_FROM {
            keyed = (0..n).map(|i| (key(i), i as u32)).collect();
            keyed.sort_unstable();
        } else {
            keyed = (0..n).into_par_iter().map(|i| (key(i), i as u32)).collect();
            keyed.par_sort_unstable();
        }
        self.order.clear();
        self.order.extend(keyed.iter().map(|&(_, i)| i));
        let order = &self.order;
        let column = |axis: usize| padded(order, r.axes()[axis], |x| sorting[axis].wrap(x));
        let sorted = Columns { x: column(0), y: column(1), z: column(2) };
        let keys: Vec<u64> = keyed.into_iter().map(|(key, _)| key).collect();
        let search = Search { keys: &keys, r: &sorted, sorting, periodic, reach };
        self.tasks.resize_with(n.div_ceil(TASK), Rows::default);
        let fill = |(task, rows): (usize, &mut Rows)| {
            dispatch(Fill { search: &search, places: task * TASK..n.min((task + 1) * TASK), rows });
        };
        if n < PARALLEL_FROM {
            self.tasks.iter_mut().enumerate().for_each(fill);
        } else {
            self.tasks.par_iter_mut().enumerate().for_each(fill);
        }
        self.built_at.clone_from(r);
        self.builds += 1;
    }
}

/// A column in the order of places, inside the box, with room for a whole vector behind the last.
fn padded(order: &[u32], column: &[f64], wrap: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut sorted = Vec::with_capacity(order.len() + LANES);
    sorted.extend(order.iter().map(|&i| wrap(column[i as usize])));
    sorted.resize(order.len() + LANES, f64::INFINITY);
    sorted
}

/// Coordinates along an axis as small integers, ascending with the coordinate.
#[derive(Clone, Copy, Debug)]
struct Steps {
    origin: f64,
    inverse: f64,
    /// Length of the box where the direction is periodic, else 0 [m].
    length: f64,
    last: u64,
}

impl Steps {
    fn new(column: &[f64], axis: usize, reach: f64, periodic: &Periodic) -> Self {
        let (bits, wanted) = if axis == 0 { (X_BITS, reach / X_STEPS) } else { (ROW_BITS, reach) };
        let most = (1_u64 << bits) - 2;
        let length = periodic.length[axis];
        if length > 0.0 {
            // Rows must have a whole number of steps, else the first and the last are not neighbours.
            let steps = (length / wanted).floor().clamp(1.0, most as f64);
            return Self { origin: 0.0, inverse: steps / length, length, last: steps as u64 - 1 };
        }
        let (low, high) = super::bounds(column);
        // Where the cloud is larger than all steps the outermost ones take all that is beyond: it is centred where most are.
        let wide = (high - low) / wanted >= most as f64;
        let origin = if wide { median(column) - 0.5 * most as f64 * wanted } else { low };
        Self { origin, inverse: 1.0 / wanted, length, last: most }
    }

    /// The coordinate in the box.
    #[inline(always)]
    fn wrap(&self, x: f64) -> f64 {
        if self.length > 0.0 { x - self.length * (x / self.length).floor() } else { x }
    }

    /// The step that holds a coordinate.
    #[inline(always)]
    fn step(&self, x: f64) -> u64 {
        // `as` turns a NaN into 0 and clamps infinities: such a step is rejected later.
        (((self.wrap(x) - self.origin) * self.inverse) as u64).min(self.last)
    }

    /// The up to three steps about one, ascending.
    fn about(&self, step: u64) -> ([u64; 3], usize) {
        let mut about = [0; 3];
        let mut count = 0;
        let mut push = |step: u64| {
            if !about[..count].contains(&step) {
                about[count] = step;
                count += 1;
            }
        };
        match (step.checked_sub(1), self.length > 0.0) {
            (Some(before), _) => push(before),
            (None, true) => push(self.last),
            (None, false) => {}
        }
        push(step);
        if step < self.last {
            push(step + 1);
        } else if self.length > 0.0 {
            push(0);
        }
        about[..count].sort_unstable();
        (about, count)
    }
}

/// What is needed to find partners.
struct Search<'a> {
    /// Sort key of every place, ascending.
    keys: &'a [u64],
    /// Positions in the order of places.
    r: &'a Columns,
    sorting: [Steps; 3],
    periodic: &'a Periodic,
    reach: f64,
}

/// A row of the grid near the one that is being filled.
#[derive(Clone, Copy, Debug, Default)]
struct Near {
    /// Key of its first step.
    key: u64,
    /// Places of the last range along x; ranges only move up.
    from: usize,
    to: usize,
}

/// Fills the rows of some places.
struct Fill<'a> {
    search: &'a Search<'a>,
    places: Range<usize>,
    rows: &'a mut Rows,
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { search, places, rows } = self;
        let mut near = ([Near::default(); 9], 0);
        let mut row = u64::MAX;
        let (mut start, mut found) = (Vec::with_capacity(TASK + 1), vec![0; 64 * TASK]);
        start.push(0);
        let mut inside = Vec::with_capacity(TASK);
        let mut count = 0;
        for place in places {
            let key = search.keys[place] >> X_BITS;
            if key != row {
                row = key;
                near = search.near(row);
            }
            count = search.partners(simd, place, &mut near.0[..near.1], &mut found, count);
            start.push(count as u32);
            inside.push(search.inside(place));
        }
        // Little more room than is needed, since there are many lists.
        if rows.partners.capacity() < count || rows.partners.capacity() > count + count / 4 {
            rows.partners = Vec::with_capacity(count + count / 16);
        }
        rows.partners.clear();
        rows.partners.extend_from_slice(&found[..count]);
        (rows.start, rows.inside) = (start, inside);
    }
}

impl Search<'_> {
    /// The rows about one.
    fn near(&self, row: u64) -> ([Near; 9], usize) {
        let (z, y) = (row >> ROW_BITS, row & ((1 << ROW_BITS) - 1));
        let (zs, ys) = (self.sorting[2].about(z), self.sorting[1].about(y));
        let mut near = [Near::default(); 9];
        let mut count = 0;
        for &z in &zs.0[..zs.1] {
            for &y in &ys.0[..ys.1] {
                let key = ((z << ROW_BITS) | y) << X_BITS;
                let from = self.keys.partition_point(|&held| held < key);
                near[count] = Near { key, from, to: from };
                count += 1;
            }
        }
        (near, count)
    }

    /// Puts the partners of a place behind the first `count` of `found`; returns how many there are then.
    #[inline(always)]
    fn partners<S: Simd>(
        &self,
        simd: S,
        place: usize,
        near: &mut [Near],
        found: &mut Vec<u32>,
        mut count: usize,
    ) -> usize {
        let along = &self.sorting[0];
        let x = self.r.x[place];
        let (low, high) = (x - self.reach, x + self.reach);
        // What is beyond an end of a periodic box is at its other end.
        let whole = along.length > 0.0 && 2.0 * self.reach >= along.length;
        let (from, to) = if whole { (0, along.last) } else { (along.inside(low), along.inside(high)) };
        for near in near {
            while near.from < self.keys.len() && self.keys[near.from] < near.key + from {
                near.from += 1;
            }
            near.to = near.to.max(near.from);
            while near.to < self.keys.len() && self.keys[near.to] <= near.key + to {
                near.to += 1;
            }
            count = self.test(simd, place, near.from..near.to, found, count);
            if along.length > 0.0 && !whole {
                if low < 0.0 {
                    let range = self.range(near.key, along.inside(low + along.length), along.last);
                    count = self.test(simd, place, range, found, count);
                }
                if high >= along.length {
                    let range = self.range(near.key, 0, along.inside(high - along.length));
                    count = self.test(simd, place, range, found, count);
                }
            }
        }
        count
    }

    /// Whether all that is in reach of a place is in the box with it: no images have to be looked at.
    #[inline(always)]
    fn inside(&self, place: usize) -> bool {
        let mut inside = true;
        for axis in 0..3 {
            let (x, length) = (self.r.axes()[axis][place], self.periodic.length[axis]);
            inside &= length == 0.0 || (x >= self.reach && x <= length - self.reach);
        }
        inside
    }

    /// Places of a row from one step to another.
    fn range(&self, key: u64, from: u64, to: u64) -> Range<usize> {
        self.keys.partition_point(|&held| held < key + from)..self.keys.partition_point(|&held| held <= key + to)
    }

    /// Puts those of a range of places that are in reach behind the first `count` of `found`.
    #[inline(always)]
    fn test<S: Simd>(
        &self,
        simd: S,
        place: usize,
        range: Range<usize>,
        found: &mut Vec<u32>,
        mut count: usize,
    ) -> usize {
        if found.len() < count + range.len() + LANES {
            found.resize(2 * (count + range.len() + LANES), 0);
        }
        let axes = self.r.axes();
        let own = [simd.splat(axes[0][place]), simd.splat(axes[1][place]), simd.splat(axes[2][place])];
        let reach = simd.splat(self.reach * self.reach);
        let images = !self.inside(place);
        let mut first = range.start;
        while first < range.end {
            let mut square = simd.splat(0.0);
            for axis in 0..3 {
                let Some(others) = axes[axis][first..].first_chunk() else { return count };
                let mut d = simd.load(others) - own[axis];
                if images {
                    let images = round(simd, d * simd.splat(self.periodic.inverse[axis]));
                    d = d - simd.splat(self.periodic.length[axis]) * images;
                }
                square = square + d * d;
            }
            let mut mask = S::F::bitmask(square.le(reach));
            if range.end - first < LANES {
                mask &= (1 << (range.end - first)) - 1;
            }
            if place.wrapping_sub(first) < LANES {
                mask &= !(1 << (place - first));
            }
            let Some(room) = found[count..].first_chunk_mut::<LANES>() else { return count };
            let set = &PLACES[(mask & 0xFF) as usize];
            for k in 0..LANES {
                room[k] = first as u32 + u32::from(set[k]);
            }
            count += mask.count_ones() as usize;
            first += LANES;
        }
        count
    }
}

impl Steps {
    /// The step that holds a coordinate that is not to be wrapped.
    #[inline(always)]
    fn inside(&self, x: f64) -> u64 {
        (((x - self.origin) * self.inverse) as u64).min(self.last)
    }
}
