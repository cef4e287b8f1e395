//! Every close pair once, from points sorted by the cells of a grid: memory is linear in the number of points, however
//! near to each other they are, and nothing is kept from one state to the next.
//!
//! A cell is at least as wide as the reach. Each point meets those behind it in its own cell and the next along x, and
//! those in the rows of three cells along x that follow in y and z: half of the 26 neighbours. Sorted along x first, all
//! of these are a few runs of consecutive places.

use crate::domain::Periodic;
use crate::neighbor::Grid;
use crate::state::Columns;
use std::ops::Range;

/// Below this number of points looking at all pairs is faster.
const CELLS_FROM: usize = 200;
/// Rows of cells that follow a cell, by their steps in y and z.
const ROWS: [[i64; 2]; 4] = [[1, 0], [-1, 1], [0, 1], [1, 1]];
/// Most runs of places that one point meets: its own, one across the end of a periodic direction, and two for each row.
const RUNS: usize = 2 + 2 * ROWS.len();
/// Cells that are looked at one by one before their place is found by bisection.
const NEAR: usize = 8;

/// Points sorted by cells. A *place* is a point's position in that order.
#[derive(Clone, Debug)]
pub struct Cells {
    /// `None`: all points are in one cell, in their own order.
    grid: Option<Grid>,
    /// The point at every place, length n.
    order: Vec<u32>,
    /// Key of every cell that holds points and its first place, ascending; at the end a place beyond the last.
    cells: Vec<(u64, u32)>,
}

/// The runs of places that a point meets.
#[derive(Clone, Debug, Default)]
struct Runs {
    runs: [Range<usize>; RUNS],
    count: usize,
}

impl Runs {
    fn push(&mut self, run: Range<usize>) {
        if !run.is_empty() {
            self.runs[self.count] = run;
            self.count += 1;
        }
    }
}

/// Sees places. A trait and not a closure, because a closure is compiled apart, for instructions that every machine has.
pub trait Visit {
    /// Sees a place and the runs of places that its point meets; to be inlined.
    fn visit(&mut self, place: usize, runs: &[Range<usize>]);
}

impl Cells {
    /// Sorts points for pairs up to `reach` apart [m]. Where cells would not help all points are in one.
    #[must_use]
    pub fn new(r: &Columns, reach: f64, periodic: &Periodic) -> Self {
        let n = r.len();
        let one = || Self { grid: None, order: (0..n as u32).collect(), cells: vec![(0, 0), (u64::MAX, n as u32)] };
        if n < CELLS_FROM || !reach.is_finite() || reach <= 0.0 {
            return one();
        }
        let grid = Grid::new(r, reach, periodic);
        if !grid.has_neighbours() {
            return one();
        }
        let mut keyed: Vec<(u64, u32)> = (0..n).map(|i| (grid.key(grid.cell(r, i)), i as u32)).collect();
        keyed.sort_unstable();
        let mut cells: Vec<(u64, u32)> = Vec::new();
        for (place, &(key, _)) in keyed.iter().enumerate() {
            if cells.last().is_none_or(|&(held, _)| held != key) {
                cells.push((key, place as u32));
            }
        }
        cells.push((u64::MAX, n as u32));
        Self { grid: Some(grid), order: keyed.into_iter().map(|(_, i)| i).collect(), cells }
    }

    /// The point at every place, length n.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Whether points are in their own order.
    #[must_use]
    pub fn is_one(&self) -> bool {
        self.grid.is_none()
    }

    /// A column with its values in the order of places.
    #[must_use]
    pub fn sorted(&self, column: &[f64]) -> Vec<f64> {
        self.order.iter().map(|&i| column[i as usize]).collect()
    }

    /// Vectors in the order of places.
    #[must_use]
    pub fn sorted_vectors(&self, r: &Columns) -> Columns {
        Columns { x: self.sorted(&r.x), y: self.sorted(&r.y), z: self.sorted(&r.z) }
    }

    /// Shows each of these places, with runs of places that its point meets, to a visitor. Over all places every pair
    /// within reach is met once.
    #[inline(always)]
    pub fn walk(&self, places: Range<usize>, visitor: &mut impl Visit) {
        let mut cell = self.cells.partition_point(|&(_, first)| first as usize <= places.start).saturating_sub(1);
        let mut cursors = [0; ROWS.len()];
        let mut place = places.start;
        while place < places.end {
            let mut runs = self.runs(cell, &mut cursors);
            let end = self.first(cell + 1).min(places.end);
            for place in place..end {
                runs.runs[0].start = place + 1;
                visitor.visit(place, &runs.runs[..runs.count]);
            }
            place = end;
            cell += 1;
        }
    }

    /// First place of a cell.
    fn first(&self, cell: usize) -> usize {
        self.cells[cell.min(self.cells.len() - 1)].1 as usize
    }

    /// The runs that the points of a cell meet; the first begins behind the point itself.
    fn runs(&self, cell: usize, cursors: &mut [usize; ROWS.len()]) -> Runs {
        let mut runs = Runs::default();
        let end = self.first(cell + 1);
        runs.runs[0] = self.first(cell)..end;
        runs.count = 1;
        let Some(grid) = &self.grid else { return runs };
        let key = self.cells[cell].0;
        let [x, y, z] = Grid::cell_of(key);
        if grid.is_last(0, x) {
            runs.push(self.between(grid.key([0, y, z]), grid.key([0, y, z]), 0).0);
        } else if self.cells[cell + 1].0 == key + 1 {
            runs.runs[0].end = self.first(cell + 2);
        }
        for ([dy, dz], cursor) in ROWS.into_iter().zip(cursors) {
            let (Some(y), Some(z)) = (grid.step(1, y, dy), grid.step(2, z, dz)) else { continue };
            let (left, right) = (grid.step(0, x, -1), grid.step(0, x, 1));
            let (from, to) = (left.unwrap_or(x).min(x), right.unwrap_or(x).max(x));
            let (run, found) = self.between(grid.key([from, y, z]), grid.key([to, y, z]), *cursor);
            *cursor = found;
            runs.push(run);
            // Across the end of a periodic direction there is a second run.
            for other in [left.filter(|left| *left > x), right.filter(|right| *right < x)].into_iter().flatten() {
                runs.push(self.between(grid.key([other, y, z]), grid.key([other, y, z]), 0).0);
            }
        }
        runs
    }

    /// Places of the cells with keys from one to another, and the number of the first such cell; it is looked for from
    /// `near` on first.
    fn between(&self, from: u64, to: u64, near: usize) -> (Range<usize>, usize) {
        let first = self.seek(from, near);
        let mut end = first;
        while self.cells[end].0 <= to && end + 1 < self.cells.len() {
            end += 1;
        }
        (self.first(first)..self.first(end), first)
    }

    /// The first cell whose key is not below `key`.
    fn seek(&self, key: u64, near: usize) -> usize {
        let behind = near == 0 || self.cells[near - 1].0 < key;
        if behind {
            let window = &self.cells[near..self.cells.len().min(near + NEAR)];
            if let Some(found) = window.iter().position(|&(held, _)| held >= key) {
                return near + found;
            }
        }
        self.cells.partition_point(|&(held, _)| held < key).min(self.cells.len() - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::{Cells, Visit};
    use crate::domain::Periodic;
    use crate::state::Columns;
    use rand::{Rng, SeedableRng};
    use std::ops::Range;

    fn cloud(n: usize, spread: [f64; 3]) -> Columns {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let mut uniform = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let mut r = Columns::default();
        for _ in 0..n {
            r.push(spread.map(|spread| spread * uniform()));
        }
        r
    }

    /// Counts how often every pair is met.
    struct Count<'a> {
        order: &'a [u32],
        met: &'a mut [u8],
    }

    impl Visit for Count<'_> {
        fn visit(&mut self, place: usize, runs: &[Range<usize>]) {
            for j in runs.iter().cloned().flatten() {
                let (i, j) = (self.order[place] as usize, self.order[j] as usize);
                self.met[i.min(j) * self.order.len() + i.max(j)] += 1;
            }
        }
    }

    /// Every pair within reach once, none twice, whatever the places are cut into.
    #[test]
    fn every_close_pair_is_met_once() {
        let open = [0.0; 3];
        for (n, length, spread) in [
            (50, open, [4.0; 3]),
            (600, open, [8.0; 3]),
            (600, open, [1e9, 8.0, 8.0]),
            (600, open, [0.5; 3]),
            (600, [8.0, 0.0, 8.0], [8.0; 3]),
            (600, [8.0, 8.0, 8.0], [8.0; 3]),
            (600, [3.0, 3.2, 40.0], [3.0, 3.2, 40.0]),
            (600, [2.5, 8.0, 8.0], [2.5, 8.0, 8.0]),
        ] {
            let inverse = length.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 });
            let periodic = Periodic { length, inverse };
            let r = cloud(n, spread);
            let cells = Cells::new(&r, 1.0, &periodic);
            let mut met = vec![0_u8; n * n];
            for from in (0..n).step_by(7) {
                cells.walk(from..n.min(from + 7), &mut Count { order: cells.order(), met: &mut met });
            }
            for i in 0..n {
                for j in i + 1..n {
                    let close = periodic.separation(&r, i, j).norm() <= 1.0;
                    let times = met[i * n + j];
                    assert!(times <= 1 && (times == 1 || !close), "{n} {length:?} {i} {j}: {times} times");
                }
            }
            assert!((0..n).all(|i| met[i * n + i] == 0));
        }
    }
}
