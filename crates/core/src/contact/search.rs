//! Finding who is close: pairs with s <= factor (b_i + b_j), and particles at walls.

use crate::cells::{Cells, Visit};
use crate::contact::Touch;
use crate::domain::{Domain, Periodic};
use crate::impact::Partner;
use crate::neighbor::Neighbors;
use crate::simd::{Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::{Columns, Particles};
use std::ops::Range;

/// Surfaces closer than this share of the smaller diameter touch [-].
pub const TOUCHING: f64 = 1e-9;

/// A close pair, i < j.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosePair {
    /// The smaller number.
    pub i: u32,
    /// The larger number.
    pub j: u32,
    /// Square of the distance of the centres [m^2].
    pub square: f64,
}

/// Finds close pairs, in ascending order of (i, j).
#[derive(Clone, Debug)]
pub struct Search {
    neighbors: Neighbors,
    pairs: Vec<ClosePair>,
}

impl Search {
    /// For factors up to `largest_factor` [-], from the positions at the start.
    #[must_use]
    pub fn new(largest_factor: f64, particles: &Particles, start: &Columns, domain: &Domain) -> Self {
        let largest = particles.radius.iter().copied().fold(0.0, f64::max);
        // A little more than the range, for contacts that touch within round-off.
        let range = 2.0 * largest * largest_factor * (1.0 + 2.0 * TOUCHING);
        Self { neighbors: Neighbors::choose(range, start, &domain.periodic), pairs: Vec::new() }
    }

    /// Pairs with s <= factor (b_i + b_j) at positions r.
    pub fn close(&mut self, r: &Columns, particles: &Particles, domain: &Domain, factor: f64) -> &[ClosePair] {
        self.neighbors.update(r, &domain.periodic);
        self.pairs.clear();
        let (neighbors, pairs) = (&self.neighbors, &mut self.pairs);
        let test = Test::new(r, &particles.radius, &domain.periodic, factor);
        dispatch(Scan { neighbors, test, pairs });
        &self.pairs
    }

    /// Pairs and walls whose surfaces touch or overlap at positions r, put into `touches` in ascending order.
    pub fn touching(&mut self, r: &Columns, particles: &Particles, domain: &Domain, touches: &mut Vec<Touch>) {
        touches.clear();
        for pair in self.close(r, particles, domain, 1.0 + TOUCHING) {
            touches.push(Touch { i: pair.i as usize, partner: Partner::Particle(pair.j) });
        }
        for (w, wall) in domain.walls.iter().enumerate() {
            for i in 0..r.len() {
                if wall.distance(&r.get(i)) <= particles.radius[i] * (1.0 + TOUCHING) {
                    touches.push(Touch { i, partner: Partner::Wall(w as u32) });
                }
            }
        }
    }
}

/// Calls `visit` for each pair with s <= factor (b_i + b_j) at positions r once, in no particular order but always the
/// same; memory is linear in the number of particles, however many pairs there are.
pub fn visit_close(r: &Columns, radius: &[f64], periodic: &Periodic, factor: f64, visit: impl FnMut(ClosePair)) {
    visit_close_in(cells(r, radius, periodic, factor).as_ref(), r, radius, periodic, factor, visit);
}

/// The cells that pairs with s <= factor (b_i + b_j) are found in; `None` where all pairs are looked at.
#[must_use]
pub fn cells(r: &Columns, radius: &[f64], periodic: &Periodic, factor: f64) -> Option<Cells> {
    let largest = radius.iter().copied().fold(0.0, f64::max);
    Cells::new(r, 2.0 * largest * factor * (1.0 + TOUCHING), periodic)
}

/// [`visit_close`] in these [`cells`].
pub fn visit_close_in(
    cells: Option<&Cells>,
    r: &Columns,
    radius: &[f64],
    periodic: &Periodic,
    factor: f64,
    visit: impl FnMut(ClosePair),
) {
    let Some(cells) = cells else {
        let test = Test::new(r, radius, periodic, factor);
        return dispatch(Walk { cells: None, test, visit });
    };
    let (r, radius) = (cells.sorted_vectors(r), cells.sorted(radius));
    let test = Test::new(&r, &radius, periodic, factor);
    dispatch(Walk { cells: Some(cells), test, visit });
}

/// Looks at every pair once, or at every pair that cells bring together.
struct Walk<'a, V> {
    cells: Option<&'a Cells>,
    /// Particles, where there are cells in the order of places.
    test: Test<'a>,
    visit: V,
}

impl<V: FnMut(ClosePair)> Kernel for Walk<'_, V> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        if self.test.periodic.any() { self.all::<S, true>(simd) } else { self.all::<S, false>(simd) }
    }
}

impl<V: FnMut(ClosePair)> Walk<'_, V> {
    #[inline(always)]
    fn all<S: Simd, const PERIODIC: bool>(self, simd: S) {
        let Self { cells, test, mut visit } = self;
        let test = test.of_one_length();
        let n = test.radius.len();
        match cells {
            Some(cells) => cells.walk(0..n, &mut Visitor::<S, V, PERIODIC> { simd, test, order: cells.order(), visit }),
            None => {
                let mut keep = |i: usize, j: usize, square| visit(ClosePair { i: i as u32, j: j as u32, square });
                (0..n).for_each(|i| test.run::<S, PERIODIC>(simd, i, i + 1..n, &mut keep));
            }
        }
    }
}

/// Tests the pairs of one place after another.
struct Visitor<'a, S, V, const PERIODIC: bool> {
    simd: S,
    test: Test<'a>,
    order: &'a [u32],
    visit: V,
}

impl<S: Simd, V: FnMut(ClosePair), const PERIODIC: bool> Visit for Visitor<'_, S, V, PERIODIC> {
    #[inline(always)]
    fn visit(&mut self, place: usize, runs: &[Range<usize>]) {
        let Self { simd, test, order, visit } = self;
        for run in runs {
            test.run::<S, PERIODIC>(*simd, place, run.clone(), |i, j, square| {
                let (i, j) = (order[i], order[j]);
                visit(ClosePair { i: i.min(j), j: i.max(j), square });
            });
        }
    }
}

/// Looks at every candidate pair once.
struct Scan<'a> {
    neighbors: &'a Neighbors,
    test: Test<'a>,
    pairs: &'a mut Vec<ClosePair>,
}

impl Kernel for Scan<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        if self.test.periodic.any() { self.all::<S, true>(simd) } else { self.all::<S, false>(simd) }
    }
}

impl Scan<'_> {
    #[inline(always)]
    fn all<S: Simd, const PERIODIC: bool>(self, simd: S) {
        let Self { neighbors, test, pairs } = self;
        let test = test.of_one_length();
        let mut keep = |i: usize, j: usize, square| pairs.push(ClosePair { i: i as u32, j: j as u32, square });
        let n = test.radius.len();
        match neighbors {
            Neighbors::All => (0..n).for_each(|i| test.run::<S, PERIODIC>(simd, i, i + 1..n, &mut keep)),
            Neighbors::List(list) => {
                let order = list.order();
                for (place, &i) in order.iter().enumerate() {
                    for &other in list.row(place) {
                        let j = order[other as usize];
                        if i < j {
                            test.pair::<PERIODIC>(i as usize, j as usize, &mut keep);
                        }
                    }
                }
                pairs.sort_unstable_by_key(|pair| (pair.i, pair.j));
            }
        }
    }
}

/// Tells which pairs are close.
#[derive(Clone, Copy)]
struct Test<'a> {
    r: [&'a [f64]; 3],
    radius: &'a [f64],
    periodic: &'a Periodic,
    factor: f64,
    /// Square of the reach of all pairs [m^2], where radii are equal.
    reach: Option<f64>,
}

impl<'a> Test<'a> {
    fn new(r: &'a Columns, radius: &'a [f64], periodic: &'a Periodic, factor: f64) -> Self {
        let mut test = Self { r: r.axes(), radius, periodic, factor, reach: None };
        if radius.iter().all(|b| *b == radius[0]) {
            test.reach = (!radius.is_empty()).then(|| test.reach(0, 0));
        }
        test
    }

    /// The same; inlined into a kernel it tells the compiler that one check of a place does for all columns.
    #[inline(always)]
    fn of_one_length(self) -> Self {
        Self { r: self.r.map(|column| &column[..self.radius.len()]), ..self }
    }

    /// Calls `keep` for those of consecutive particles that are close to i.
    #[inline(always)]
    fn run<S: Simd, const PERIODIC: bool>(
        &self,
        simd: S,
        i: usize,
        run: Range<usize>,
        mut keep: impl FnMut(usize, usize, f64),
    ) {
        let mut from = run.start;
        while from < run.end {
            // The last eight begin earlier rather than leave particles over.
            let first = from.min(self.radius.len().saturating_sub(LANES));
            let end = run.end.min(first + LANES);
            match self.eight::<S, PERIODIC>(simd, i, first) {
                Some((squares, close)) if close != 0 => {
                    let mut close = close & ((1 << (end - first)) - (1 << (from - first)));
                    let squares = squares.to_array();
                    while close != 0 {
                        let k = close.trailing_zeros() as usize;
                        keep(i, first + k, squares[k % LANES]);
                        close &= close - 1;
                    }
                }
                Some(_) => {}
                None => (from..end).for_each(|j| self.pair::<PERIODIC>(i, j, &mut keep)),
            }
            from = end;
        }
    }

    #[inline(always)]
    fn pair<const PERIODIC: bool>(&self, i: usize, j: usize, keep: &mut impl FnMut(usize, usize, f64)) {
        let square = self.square::<PERIODIC>(i, j);
        if square <= self.reach(i, j) {
            keep(i, j, square);
        }
    }

    /// Squares of the distances from i to eight consecutive particles, and a bit for each that is close.
    #[inline(always)]
    fn eight<S: Simd, const PERIODIC: bool>(&self, simd: S, i: usize, first: usize) -> Option<(S::F, u32)> {
        let mut square = simd.splat(0.0);
        for axis in 0..3 {
            let column = self.r[axis];
            let d = simd.load(column.get(first..)?.first_chunk()?) - simd.splat(column[i]);
            let d = if PERIODIC { self.periodic.minimum_images(simd, axis, d) } else { d };
            square = square + d * d;
        }
        let reach = match self.reach {
            Some(reach) => simd.splat(reach),
            None => {
                let radius = simd.load(self.radius.get(first..)?.first_chunk()?);
                let reach = simd.splat(self.factor) * (simd.splat(self.radius[i]) + radius);
                reach * reach
            }
        };
        Some((square, S::F::bitmask(square.le(reach))))
    }

    #[inline(always)]
    fn square<const PERIODIC: bool>(&self, i: usize, j: usize) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let column = self.r[axis];
            let d = column[j] - column[i];
            let d = if PERIODIC { self.periodic.minimum_image(axis, d) } else { d };
            square += d * d;
        }
        square
    }

    /// Square of factor (b_i + b_j).
    #[inline(always)]
    fn reach(&self, i: usize, j: usize) -> f64 {
        let reach = self.factor * (self.radius[i] + self.radius[j]);
        reach * reach
    }
}
