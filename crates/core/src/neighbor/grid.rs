//! A grid of cells for pairs that are met once, straight from the cells.

use crate::domain::Periodic;
use crate::state::Columns;

/// A grid of cubic cells at least `reach` wide; in periodic directions a whole number of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    origin: [f64; 3],
    inverse: [f64; 3],
    /// Number of cells in periodic directions, 0 in open ones.
    wrapped: [i64; 3],
    /// Number of cells in every direction.
    count: [i64; 3],
}

impl Grid {
    /// For points and a reach [m].
    pub(crate) fn new(r: &Columns, reach: f64, periodic: &Periodic) -> Self {
        let mut grid = Self { origin: [0.0; 3], inverse: [0.0; 3], wrapped: [0; 3], count: [0; 3] };
        for axis in 0..3 {
            let length = periodic.length[axis];
            if length > 0.0 {
                let cells = (length / reach).floor().clamp(1.0, 1_048_576.0);
                grid.wrapped[axis] = cells as i64;
                grid.count[axis] = cells as i64;
                grid.inverse[axis] = cells / length;
            } else {
                let (low, high) = bounds(r.axes()[axis]);
                grid.origin[axis] = low;
                // 20 bits of cell number in each direction: wider cells where the cloud is larger than that.
                grid.inverse[axis] = 1.0 / reach.max((high - low) / 1_000_000.0);
                grid.count[axis] = ((high - low) * grid.inverse[axis]).floor() as i64 + 1;
            }
        }
        grid
    }

    /// Cell of point i.
    pub(crate) fn cell(&self, r: &Columns, i: usize) -> [i64; 3] {
        std::array::from_fn(|axis| {
            // `as` turns a NaN into 0 and clamps infinities: such a step is rejected later.
            let cell = floor((r.axes()[axis][i] - self.origin[axis]) * self.inverse[axis]);
            let count = self.count[axis];
            // Nearly all are in the box: a division is only for those that are not.
            if (0..count).contains(&cell) {
                cell
            } else if self.wrapped[axis] > 0 {
                cell.rem_euclid(count)
            } else {
                cell.clamp(0, count - 1)
            }
        })
    }

    /// Sort key of a cell: cells that differ only in x are neighbours in order.
    pub(crate) fn key(&self, cell: [i64; 3]) -> u64 {
        ((cell[2] as u64) << 42) | ((cell[1] as u64) << 21) | cell[0] as u64
    }

    /// Number of cells.
    pub(crate) fn cells(&self) -> u128 {
        self.count.iter().map(|&count| count as u128).product()
    }

    /// Number of a cell in the order of keys, where all are counted.
    pub(crate) fn number(&self, cell: [i64; 3]) -> usize {
        ((cell[2] * self.count[1] + cell[1]) * self.count[0] + cell[0]) as usize
    }

    /// The cell with a number.
    pub(crate) fn cell_at(&self, number: usize) -> [i64; 3] {
        let (nx, ny) = (self.count[0] as u32, self.count[1] as u32);
        let number = number as u32;
        let row = number / nx;
        [i64::from(number % nx), i64::from(row % ny), i64::from(row / ny)]
    }

    /// The cell whose number follows that of another.
    #[inline(always)]
    pub(crate) fn after(&self, [x, y, z]: [i64; 3]) -> [i64; 3] {
        if x + 1 < self.count[0] {
            [x + 1, y, z]
        } else if y + 1 < self.count[1] {
            [0, y + 1, z]
        } else {
            [0, 0, z + 1]
        }
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

    /// The cell one step further, or back, along an axis; `None` beyond the ends of an open one.
    pub(crate) fn step(&self, axis: usize, c: i64, by: i64) -> Option<i64> {
        let (count, periodic) = (self.count[axis], self.wrapped[axis] > 0);
        match c + by {
            -1 => periodic.then_some(count - 1),
            c if c == count => periodic.then_some(0),
            c => Some(c),
        }
    }
}

/// The largest whole number that is not above x; without the call that `f64::floor` is where the target has no instruction.
#[inline(always)]
fn floor(x: f64) -> i64 {
    let whole = x as i64;
    whole.saturating_sub(i64::from(whole as f64 > x))
}

/// Smallest and largest of some finite numbers; (0, 0) of none.
pub(crate) fn bounds(column: &[f64]) -> (f64, f64) {
    let finite = column.iter().copied().filter(|x| x.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    if low <= high { (low, high) } else { (0.0, 0.0) }
}
