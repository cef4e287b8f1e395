//! Which pairs are worth a look: all of them, or those in lists built from a sorted grid of cells.
//!
//! A list holds, for every particle, all others closer than range + skin, in ascending order. It stays valid until some
//! particle has moved half a skin. Memory is linear in the number of particles, however large the space they fill:
//! cells exist only where there are particles.

use crate::domain::Periodic;
use crate::state::Columns;

/// Below this number of particles the all-pairs loop is faster than any list.
const LIST_FROM: usize = 200;
/// A list is used where it holds less than this share of all pairs.
const LIST_SHARE: f64 = 0.25;

/// Candidate partners of every particle.
#[derive(Clone, Debug)]
pub enum Neighbors {
    /// Everyone.
    All,
    /// Those in a list.
    List(NeighborList),
}

/// Partners closer than range + skin.
#[derive(Clone, Debug, Default)]
pub struct NeighborList {
    range: f64,
    skin: f64,
    /// Row i is `partners[start[i]..start[i + 1]]`.
    start: Vec<usize>,
    partners: Vec<u32>,
    /// Positions at the last build; empty before the first.
    built_at: Columns,
    cells: Vec<(u64, u32)>,
}

impl Neighbors {
    /// Chooses for pairs up to `range` apart [m], from the positions at the start.
    #[must_use]
    pub fn choose(range: f64, r: &Columns, periodic: &Periodic) -> Self {
        let n = r.len();
        if n < LIST_FROM || !range.is_finite() {
            return Self::All;
        }
        let volume: f64 = (0..3)
            .map(|axis| {
                let column = r.axes()[axis];
                let (low, high) = bounds(column);
                if periodic.length[axis] > 0.0 { periodic.length[axis] } else { (high - low).max(range) }
            })
            .product();
        let spacing = libm::cbrt(volume / n as f64);
        let skin = (0.5 * spacing).clamp(0.1 * range, range);
        let reach = range + skin;
        if 4.2 * reach * reach * reach > LIST_SHARE * volume {
            return Self::All;
        }
        Self::List(NeighborList { range, skin, ..NeighborList::default() })
    }

    /// Makes the candidates valid for these positions.
    pub fn update(&mut self, r: &Columns, periodic: &Periodic) {
        if let Self::List(list) = self
            && list.outdated(r, periodic)
        {
            list.build(r, periodic);
        }
    }

    /// Makes the candidates valid for these positions and for all that particles reach within `travel()` of them [m].
    pub fn prepare(&mut self, r: &Columns, periodic: &Periodic, travel: impl FnOnce() -> f64) {
        if let Self::List(list) = self {
            let travel = travel();
            if list.outdated_by(r, periodic, travel) {
                list.build(r, periodic);
            }
        }
    }

    /// Whether the candidates hold for these positions.
    #[must_use]
    pub fn valid(&self, r: &Columns, periodic: &Periodic) -> bool {
        match self {
            Self::All => true,
            Self::List(list) => !list.outdated(r, periodic),
        }
    }

    /// Positions of the last build, which a checkpoint keeps; `None` without a list.
    #[must_use]
    pub fn built_at(&self) -> Option<&Columns> {
        match self {
            Self::All => None,
            Self::List(list) => Some(&list.built_at),
        }
    }

    /// Number of unordered candidate pairs among n particles.
    #[must_use]
    pub fn pairs(&self, n: usize) -> u64 {
        match self {
            Self::All => n as u64 * (n as u64 - u64::from(n > 0)) / 2,
            Self::List(list) => list.partners.len() as u64 / 2,
        }
    }

    /// Partners of particle i, ascending; `None` for everyone.
    #[must_use]
    pub fn row(&self, i: usize) -> Option<&[u32]> {
        match self {
            Self::All => None,
            Self::List(list) => Some(&list.partners[list.start[i]..list.start[i + 1]]),
        }
    }
}

impl NeighborList {
    fn outdated(&self, r: &Columns, periodic: &Periodic) -> bool {
        self.outdated_by(r, periodic, 0.0)
    }

    /// Whether some particle has moved half a skin, less what it is still going to move [m].
    fn outdated_by(&self, r: &Columns, periodic: &Periodic, travel: f64) -> bool {
        if self.built_at.len() != r.len() {
            return true;
        }
        let limit = (0.5 * self.skin - travel).max(0.0);
        let limit = limit * limit;
        let square = |i: usize| -> f64 {
            (0..3)
                .map(|axis| {
                    let d = periodic.minimum_image(axis, r.axes()[axis][i] - self.built_at.axes()[axis][i]);
                    d * d
                })
                .sum()
        };
        // A NaN counts as moved: the build copes with it, and the step is rejected for it.
        (0..r.len()).map(square).any(|moved| moved >= limit || moved.is_nan())
    }

    /// Builds the rows for these positions.
    pub fn build(&mut self, r: &Columns, periodic: &Periodic) {
        let n = r.len();
        let grid = Grid::new(r, self.range + self.skin, periodic);
        self.cells.clear();
        self.cells.extend((0..n).map(|i| (grid.key(grid.cell(r, i)), i as u32)));
        self.cells.sort_unstable();
        let reach = (self.range + self.skin) * (self.range + self.skin);
        self.start.clear();
        self.partners.clear();
        self.start.push(0);
        for i in 0..n {
            let from = self.partners.len();
            grid.visit(grid.cell(r, i), &self.cells, |j| {
                if j as usize != i && periodic.separation(r, i, j as usize).norm_squared() <= reach {
                    self.partners.push(j);
                }
            });
            self.partners[from..].sort_unstable();
            self.start.push(self.partners.len());
        }
        self.built_at.clone_from(r);
    }
}

/// A grid of cubic cells at least `reach` wide; in periodic directions a whole number of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    origin: [f64; 3],
    inverse: [f64; 3],
    /// Number of cells in periodic directions, 0 in open ones.
    wrapped: [i64; 3],
}

impl Grid {
    /// For points and a reach [m].
    pub(crate) fn new(r: &Columns, reach: f64, periodic: &Periodic) -> Self {
        let mut grid = Self { origin: [0.0; 3], inverse: [0.0; 3], wrapped: [0; 3] };
        for axis in 0..3 {
            let length = periodic.length[axis];
            if length > 0.0 {
                let cells = (length / reach).floor().clamp(1.0, 1_048_576.0);
                grid.wrapped[axis] = cells as i64;
                grid.inverse[axis] = cells / length;
            } else {
                let (low, high) = bounds(r.axes()[axis]);
                grid.origin[axis] = low;
                // 20 bits of cell number in each direction: wider cells where the cloud is larger than that.
                grid.inverse[axis] = 1.0 / reach.max((high - low) / 1_000_000.0);
            }
        }
        grid
    }

    /// Cell of point i.
    pub(crate) fn cell(&self, r: &Columns, i: usize) -> [i64; 3] {
        std::array::from_fn(|axis| {
            // `as` turns a NaN into 0 and clamps infinities: such a step is rejected later.
            let cell = ((r.axes()[axis][i] - self.origin[axis]) * self.inverse[axis]).floor() as i64;
            if self.wrapped[axis] > 0 { cell.rem_euclid(self.wrapped[axis]) } else { cell.clamp(0, 1_000_001) }
        })
    }

    /// Sort key of a cell: cells that differ only in x are neighbours in order.
    pub(crate) fn key(&self, cell: [i64; 3]) -> u64 {
        ((cell[2] as u64) << 42) | ((cell[1] as u64) << 21) | cell[0] as u64
    }

    /// The cell with a key.
    pub(crate) fn cell_of(key: u64) -> [i64; 3] {
        const MASK: u64 = (1 << 21) - 1;
        [(key & MASK) as i64, (key >> 21 & MASK) as i64, (key >> 42) as i64]
    }

    /// Whether the two neighbours of a cell differ from it and from each other in every direction.
    pub(crate) fn has_neighbours(&self) -> bool {
        self.wrapped.iter().all(|&cells| cells == 0 || cells > 2)
    }

    /// Whether a cell is the last along a periodic axis.
    pub(crate) fn is_last(&self, axis: usize, c: i64) -> bool {
        self.wrapped[axis] > 0 && c + 1 == self.wrapped[axis]
    }

    /// The cell one step further along an axis; `None` before the first of an open one.
    pub(crate) fn step(&self, axis: usize, c: i64, by: i64) -> Option<i64> {
        let wrapped = self.wrapped[axis];
        if wrapped > 0 { Some((c + by).rem_euclid(wrapped)) } else { Some(c + by).filter(|&c| c >= 0) }
    }

    /// Calls `visit` for every point in the 27 cells about a cell, each once; `cells` is sorted (key, point).
    pub(crate) fn visit(&self, cell: [i64; 3], cells: &[(u64, u32)], mut visit: impl FnMut(u32)) {
        let about: [([i64; 3], usize); 3] = std::array::from_fn(|axis| self.about(axis, cell[axis]));
        for &z in &about[2].0[..about[2].1] {
            for &y in &about[1].0[..about[1].1] {
                for &x in &about[0].0[..about[0].1] {
                    let key = self.key([x, y, z]);
                    let from = cells.partition_point(|&(k, _)| k < key);
                    for &(_, j) in cells[from..].iter().take_while(|&&(k, _)| k == key) {
                        visit(j);
                    }
                }
            }
        }
    }

    /// The up to three distinct cells about one along an axis.
    fn about(&self, axis: usize, c: i64) -> ([i64; 3], usize) {
        let mut cells = [0; 3];
        let mut count = 0;
        for d in -1..=1 {
            let wrapped = self.wrapped[axis];
            let cell = if wrapped > 0 { (c + d).rem_euclid(wrapped) } else { c + d };
            if cell >= 0 && !cells[..count].contains(&cell) {
                cells[count] = cell;
                count += 1;
            }
        }
        (cells, count)
    }
}

/// Smallest and largest of some finite numbers; (0, 0) of none.
fn bounds(column: &[f64]) -> (f64, f64) {
    let finite = column.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if low <= high { (low, high) } else { (0.0, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::{NeighborList, Neighbors};
    use crate::domain::Periodic;
    use crate::state::Columns;
    use rand::{Rng, SeedableRng};

    fn cloud(n: usize, spread: f64) -> Columns {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut uniform = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let mut r = Columns::default();
        for _ in 0..n {
            r.push([spread * uniform(), spread * uniform(), spread * uniform()]);
        }
        r
    }

    fn rows(list: &Neighbors, n: usize) -> Vec<Vec<u32>> {
        (0..n).map(|i| list.row(i).unwrap().to_vec()).collect()
    }

    #[test]
    fn lists_hold_exactly_the_pairs_in_reach() {
        for (length, spread) in
            [([0.0; 3], 10.0), ([10.0, 0.0, 10.0], 10.0), ([10.0, 2.5, 10.0], 10.0), ([0.0; 3], 1e9)]
        {
            let inverse = length.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 });
            let periodic = Periodic { length, inverse };
            let mut r = cloud(500, spread);
            if length[1] > 0.0 {
                for y in &mut r.y {
                    *y *= 0.25;
                }
            }
            let mut list = NeighborList { range: 1.0, skin: 0.2, ..NeighborList::default() };
            list.build(&r, &periodic);
            let found = rows(&Neighbors::List(list), 500);
            for (i, row) in found.iter().enumerate() {
                let expected: Vec<u32> = (0..500)
                    .filter(|&j| j != i && periodic.separation(&r, i, j).norm_squared() <= 1.2f64 * 1.2)
                    .map(|j| j as u32)
                    .collect();
                assert_eq!(*row, expected, "particle {i}");
            }
        }
    }
}
