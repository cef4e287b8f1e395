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
/// Most cells for a point that have an entry in a table each.
const TABLE: usize = 8;
/// Cells that are looked at one by one before their place is found by bisection.
const NEAR: usize = 8;

/// Points sorted by cells. A *place* is a point's position in that order.
#[derive(Clone, Debug)]
pub struct Cells {
    grid: Grid,
    /// Cells are at least this wide [m].
    reach: f64,
    /// The point at every place, length n.
    order: Vec<u32>,
    index: Index,
}

/// Where the points of a cell are.
#[derive(Clone, Debug)]
enum Index {
    /// Key of every cell that holds points and its first place, ascending; at the end a place beyond the last.
    Sorted(Vec<(u64, u32)>),
    /// First place of every cell, and at the end a place beyond the last: nothing has to be looked for, where the space is
    /// not too empty.
    Table(Vec<u32>),
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

/// A row of cells along x.
#[derive(Clone, Copy, Debug)]
struct Row {
    /// Its y and z.
    at: [i64; 2],
    /// Those of the rows that follow it; `None` beyond the ends of an open direction.
    following: [Option<[i64; 2]>; ROWS.len()],
}

impl Row {
    /// That of a cell.
    fn of(grid: &Grid, [_, y, z]: [i64; 3]) -> Self {
        let following = ROWS.map(|[dy, dz]| Some([grid.step(1, y, dy)?, grid.step(2, z, dz)?]));
        Self { at: [y, z], following }
    }
}

/// Sees places. A trait and not a closure, because a closure is compiled apart, for instructions that every machine has.
pub trait Visit {
    /// Sees a place and the runs of places that its point meets; to be inlined.
    fn visit(&mut self, place: usize, runs: &[Range<usize>]);
}

impl Cells {
    /// Sorts points for pairs up to `reach` apart [m]; `None` where cells would not help.
    #[must_use]
    pub fn new(r: &Columns, reach: f64, periodic: &Periodic) -> Option<Self> {
        let n = r.len();
        if n < CELLS_FROM || !reach.is_finite() || reach <= 0.0 {
            return None;
        }
        let grid = Grid::new(r, reach, periodic);
        if !grid.has_neighbours() {
            return None;
        }
        let (order, index) = if grid.cells() <= (TABLE * n) as u128 { counted(r, &grid) } else { sorted(r, &grid) };
        Some(Self { grid, reach, order, index })
    }

    /// The point at every place, length n.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// A column with its values in the order of places.
    #[must_use]
    pub fn sorted(&self, column: &[f64]) -> Vec<f64> {
        self.order.iter().map(|&i| column[i as usize]).collect()
    }

    /// How far pairs may be apart that are met [m].
    #[must_use]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// Runs of places of all that may be as near as the reach to point i, itself included.
    pub fn near(&self, r: &Columns, i: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let grid = &self.grid;
        let [x, y, z] = grid.cell(r, i);
        let (left, right) = (grid.step(0, x, -1), grid.step(0, x, 1));
        let (from, to) = (left.unwrap_or(x).min(x), right.unwrap_or(x).max(x));
        // Across the end of a periodic direction there is a second run.
        let beyond = left.filter(|left| *left > x).or(right.filter(|right| *right < x));
        let rows = (-1..=1).flat_map(|dz| (-1..=1).map(move |dy| [dy, dz]));
        rows.filter_map(move |[dy, dz]| Some([grid.step(1, y, dy)?, grid.step(2, z, dz)?]))
            .flat_map(move |[y, z]| [Some((from, to)), beyond.map(|x| (x, x))].map(|run| run.map(|run| (run, y, z))))
            .flatten()
            .map(move |((from, to), y, z)| self.index.between(grid, [from, y, z], to, 0).0)
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
        let mut cell = self.index.holding(places.start);
        let mut at = self.index.cell(&self.grid, cell);
        let mut row = Row::of(&self.grid, at);
        let mut cursors = [0; ROWS.len()];
        let mut place = places.start;
        while place < places.end {
            let end = self.index.first(cell + 1).min(places.end);
            if place < end {
                if [at[1], at[2]] != row.at {
                    row = Row::of(&self.grid, at);
                }
                let mut runs = self.runs(cell, at[0], &row, &mut cursors);
                for place in place..end {
                    runs.runs[0].start = place + 1;
                    visitor.visit(place, &runs.runs[..runs.count]);
                }
                place = end;
            }
            cell += 1;
            at = self.index.after(&self.grid, cell, at);
        }
    }

    /// The runs that the points of a cell, at `x` in a row, meet; the first begins behind the point itself.
    fn runs(&self, cell: usize, x: i64, row: &Row, cursors: &mut [usize; ROWS.len()]) -> Runs {
        let mut runs = Runs::default();
        runs.runs[0] = self.index.first(cell)..self.index.first(cell + 1);
        runs.count = 1;
        let grid = &self.grid;
        let between =
            |from: i64, to: i64, [y, z]: [i64; 2], near: usize| self.index.between(grid, [from, y, z], to, near);
        if grid.is_last(0, x) {
            runs.push(between(0, 0, row.at, 0).0);
        } else if let Some(next) = grid.step(0, x, 1) {
            runs.runs[0].end = between(next, next, row.at, cell).0.end.max(runs.runs[0].end);
        }
        let (left, right) = (grid.step(0, x, -1), grid.step(0, x, 1));
        let (from, to) = (left.unwrap_or(x).min(x), right.unwrap_or(x).max(x));
        for (following, cursor) in row.following.iter().zip(cursors) {
            let &Some(following) = following else { continue };
            let (run, found) = between(from, to, following, *cursor);
            *cursor = found;
            runs.push(run);
            // Across the end of a periodic direction there is a second run.
            for other in [left.filter(|left| *left > x), right.filter(|right| *right < x)].into_iter().flatten() {
                runs.push(between(other, other, following, 0).0);
            }
        }
        runs
    }
}

/// Points in the order of the cells that hold them, by counting.
fn counted(r: &Columns, grid: &Grid) -> (Vec<u32>, Index) {
    let cells: Vec<u32> = (0..r.len()).map(|i| grid.number(grid.cell(r, i)) as u32).collect();
    let mut first = vec![0_u32; grid.cells() as usize + 1];
    for &cell in &cells {
        first[cell as usize + 1] += 1;
    }
    for cell in 1..first.len() {
        first[cell] += first[cell - 1];
    }
    let mut order = vec![0; cells.len()];
    for (i, &cell) in cells.iter().enumerate() {
        order[first[cell as usize] as usize] = i as u32;
        first[cell as usize] += 1;
    }
    // Each entry has moved on to the first place of the next cell.
    first.rotate_right(1);
    first[0] = 0;
    (order, Index::Table(first))
}

/// The same by sorting, where most cells are empty.
fn sorted(r: &Columns, grid: &Grid) -> (Vec<u32>, Index) {
    let n = r.len();
    let mut keyed: Vec<(u64, u32)> = (0..n).map(|i| (grid.key(grid.cell(r, i)), i as u32)).collect();
    keyed.sort_unstable();
    let mut cells: Vec<(u64, u32)> = Vec::new();
    for (place, &(key, _)) in keyed.iter().enumerate() {
        if cells.last().is_none_or(|&(held, _)| held != key) {
            cells.push((key, place as u32));
        }
    }
    cells.push((u64::MAX, n as u32));
    (keyed.into_iter().map(|(_, i)| i).collect(), Index::Sorted(cells))
}

impl Index {
    /// First place of a cell.
    #[inline(always)]
    fn first(&self, cell: usize) -> usize {
        match self {
            Self::Sorted(cells) => cells[cell.min(cells.len() - 1)].1 as usize,
            Self::Table(first) => first[cell.min(first.len() - 1)] as usize,
        }
    }

    /// The cell that holds a place.
    fn holding(&self, place: usize) -> usize {
        match self {
            Self::Sorted(cells) => cells.partition_point(|&(_, first)| first as usize <= place),
            Self::Table(first) => first.partition_point(|&first| first as usize <= place),
        }
        .saturating_sub(1)
    }

    /// Where in the grid a cell is.
    #[inline(always)]
    fn cell(&self, grid: &Grid, cell: usize) -> [i64; 3] {
        match self {
            Self::Sorted(cells) => Grid::cell_of(cells[cell].0),
            Self::Table(_) => grid.cell_at(cell),
        }
    }

    /// Where in the grid a cell is, from where the one before it is.
    #[inline(always)]
    fn after(&self, grid: &Grid, cell: usize, before: [i64; 3]) -> [i64; 3] {
        match self {
            Self::Sorted(cells) => Grid::cell_of(cells[cell.min(cells.len() - 1)].0),
            Self::Table(_) => grid.after(before),
        }
    }

    /// Places of the cells of a row up to one along x, and the number of the first of them; it is looked for from `near` on
    /// first.
    #[inline(always)]
    fn between(&self, grid: &Grid, from: [i64; 3], to: i64, near: usize) -> (Range<usize>, usize) {
        match self {
            Self::Table(first) => {
                let cell = grid.number(from);
                (first[cell] as usize..first[cell + 1 + (to - from[0]) as usize] as usize, cell)
            }
            Self::Sorted(cells) => {
                let (key, last) = (grid.key(from), grid.key([to, from[1], from[2]]));
                let begin = seek(cells, key, near);
                let mut end = begin;
                while cells[end].0 <= last && end + 1 < cells.len() {
                    end += 1;
                }
                (cells[begin].1 as usize..cells[end].1 as usize, begin)
            }
        }
    }
}

/// The first cell whose key is not below `key`.
fn seek(cells: &[(u64, u32)], key: u64, near: usize) -> usize {
    let behind = near == 0 || cells[near - 1].0 < key;
    if behind {
        let window = &cells[near..cells.len().min(near + NEAR)];
        if let Some(found) = window.iter().position(|&(held, _)| held >= key) {
            return near + found;
        }
    }
    cells.partition_point(|&(held, _)| held < key).min(cells.len() - 1)
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
            (200, open, [4.0; 3]),
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
            let Some(cells) = Cells::new(&r, 1.0, &periodic) else {
                assert!(length.iter().any(|&l| l > 0.0 && l < 3.0), "{n} {length:?}: no cells");
                continue;
            };
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
            for i in (0..n).step_by(13) {
                let mut near: Vec<usize> = cells.near(&r, i).flatten().map(|p| cells.order()[p] as usize).collect();
                near.sort_unstable();
                assert!(near.windows(2).all(|pair| pair[0] < pair[1]), "{n} {length:?} {i}: one twice");
                for j in 0..n {
                    let close = periodic.separation(&r, i, j).norm() <= 1.0;
                    assert!(!close || near.binary_search(&j).is_ok(), "{n} {length:?} {i} {j}: missed");
                }
            }
        }
    }
}
