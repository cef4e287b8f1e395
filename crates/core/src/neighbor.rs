//! Which pairs are worth a look: all of them, or those in lists built from particles sorted in space.
//!
//! A list holds, for every particle, all others closer than range + skin. It stays valid until some particle has moved
//! half a skin. Particles are numbered by *places* in it: sorted by rows along x of a grid in y and z, and along x within a
//! row, so that partners are near in memory too. Memory is linear in the number of particles, however large the space
//! they fill.

use crate::domain::Periodic;
use crate::simd::{Arithmetic, Eight, Kernel, LANES, Lanes, Simd, dispatch};
use crate::state::Columns;
use rayon::prelude::*;

mod build;
mod grid;

pub(crate) use grid::{Grid, bounds};

/// Below this number of particles the all-pairs loop is faster than any list.
const LIST_FROM: usize = 200;
/// A list is used where it holds less than this share of all pairs: a pair of a list costs up to four of the all-pairs
/// loop, which evaluates each pair once and needs no gathering.
const LIST_SHARE: f64 = 0.2;
/// Skin over the mean spacing of particles [-]: wider ones cost more pairs, narrower ones more builds.
const SKIN: f64 = 0.4;
/// Places per task: depends on nothing but this constant, never on the number of threads.
pub(crate) const TASK: usize = 256;

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
    /// The particle at every place.
    order: Vec<u32>,
    /// Rows of `TASK` places each.
    tasks: Vec<Rows>,
    /// Positions at the last build; empty before the first.
    built_at: Columns,
    /// Counts builds.
    builds: u64,
}

/// The rows of consecutive places.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rows {
    /// Row k is `partners[start[k]..start[k + 1]]`.
    start: Vec<u32>,
    /// Places.
    partners: Vec<u32>,
    /// Whether no partner of a row is an image, at the last build and since.
    inside: Vec<bool>,
}

impl Rows {
    /// Whether no partner of the k-th place is an image.
    #[inline(always)]
    pub(crate) fn inside(&self, k: usize) -> bool {
        self.inside[k]
    }

    /// Partners of the k-th place, as places.
    #[inline(always)]
    pub(crate) fn row(&self, k: usize) -> &[u32] {
        &self.partners[self.start[k] as usize..self.start[k + 1] as usize]
    }
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
        let skin = (SKIN * spacing).clamp(0.1 * range, range);
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
            Self::List(list) => list.tasks.iter().map(|rows| rows.partners.len() as u64).sum::<u64>() / 2,
        }
    }
}

impl NeighborList {
    /// For pairs up to `range` apart, and `skin` further [m]; nothing is in it yet.
    #[must_use]
    pub fn new(range: f64, skin: f64) -> Self {
        Self { range, skin, ..Self::default() }
    }

    /// The particle at every place, length n.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Partners of the particle at a place, as places.
    #[must_use]
    pub fn row(&self, place: usize) -> &[u32] {
        self.tasks[place / TASK].row(place % TASK)
    }

    /// Positions at the last build.
    pub(crate) fn positions(&self) -> &Columns {
        &self.built_at
    }

    /// Rows, `TASK` places at a time.
    pub(crate) fn tasks(&self) -> &[Rows] {
        &self.tasks
    }

    /// How often it has been built.
    #[must_use]
    pub fn builds(&self) -> u64 {
        self.builds
    }

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
        let moved = |first: usize, count: usize| {
            dispatch(Moved { from: slices(&self.built_at, first, count), to: slices(r, first, count), periodic, limit })
        };
        let n = r.len();
        if n < PARALLEL_FROM {
            moved(0, n)
        } else {
            (0..n.div_ceil(PARALLEL_FROM))
                .into_par_iter()
                .any(|k| moved(k * PARALLEL_FROM, PARALLEL_FROM.min(n - k * PARALLEL_FROM)))
        }
    }
}

/// Particles that one task looks through.
const PARALLEL_FROM: usize = 16_384;

fn slices(columns: &Columns, first: usize, count: usize) -> [&[f64]; 3] {
    columns.axes().map(|column| &column[first..first + count])
}

/// Whether any particle moved at least the root of `limit`.
struct Moved<'a> {
    from: [&'a [f64]; 3],
    to: [&'a [f64]; 3],
    periodic: &'a Periodic,
    limit: f64,
}

impl Kernel for Moved<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> bool {
        let Self { from, to, periodic, limit } = self;
        let limit = simd.splat(limit);
        let n = to[0].len();
        let mut first = 0;
        while first < n {
            let mut square = simd.splat(0.0);
            for axis in 0..3 {
                let d = load(simd, to[axis], first) - load(simd, from[axis], first);
                let images = crate::lanes::round(simd, d * simd.splat(periodic.inverse[axis]));
                let d = d - simd.splat(periodic.length[axis]) * images;
                square = square + d * d;
            }
            // A NaN counts as moved: the build copes with it, and the step is rejected for it.
            if S::F::bitmask(limit.le(square)) != 0 || S::F::bitmask(square.le(limit)) != 0xFF {
                return true;
            }
            first += LANES;
        }
        false
    }
}

/// Eight numbers from `first` on, zeros behind the last.
#[inline(always)]
pub(crate) fn load<S: Arithmetic>(simd: S, column: &[f64], first: usize) -> S::F {
    match column[first..].first_chunk::<LANES>() {
        Some(eight) => simd.load(eight),
        None => {
            let mut eight: Eight = [0.0; LANES];
            eight[..column.len() - first].copy_from_slice(&column[first..]);
            simd.load(&eight)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::NeighborList;
    use crate::domain::Periodic;
    use crate::state::Columns;
    use rand::{Rng, SeedableRng};

    fn cloud(n: usize, spread: [f64; 3]) -> Columns {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut uniform = || (rng.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let mut r = Columns::default();
        for _ in 0..n {
            r.push(spread.map(|spread| spread * uniform()));
        }
        r
    }

    /// Partners of every particle by number, ascending.
    fn partners(list: &NeighborList) -> Vec<Vec<u32>> {
        let mut partners = vec![Vec::new(); list.order().len()];
        for (place, &i) in list.order().iter().enumerate() {
            partners[i as usize] = list.row(place).iter().map(|&q| list.order()[q as usize]).collect();
            partners[i as usize].sort_unstable();
        }
        partners
    }

    #[test]
    fn lists_hold_exactly_the_pairs_in_reach() {
        for (length, spread) in [
            ([0.0; 3], [10.0; 3]),
            ([10.0, 0.0, 10.0], [10.0; 3]),
            ([10.0, 2.5, 10.0], [10.0, 2.5, 10.0]),
            ([2.5, 10.0, 0.0], [2.5, 10.0, 10.0]),
            ([4.0, 4.0, 4.0], [4.0; 3]),
            ([0.0; 3], [1e9; 3]),
            ([0.0; 3], [1e9, 3.0, 3.0]),
            ([0.0; 3], [1.0, 300.0, 1.0]),
        ] {
            let inverse = length.map(|l| if l > 0.0 { 1.0 / l } else { 0.0 });
            let periodic = Periodic { length, inverse };
            for n in [1, 9, 700] {
                let mut r = cloud(n, spread);
                // Predicted positions may be outside the box.
                r.x[0] -= 0.3;
                let mut list = NeighborList::new(1.0, 0.2);
                list.build(&r, &periodic);
                for (i, row) in partners(&list).iter().enumerate() {
                    let expected: Vec<u32> = (0..n)
                        .filter(|&j| j != i && periodic.separation(&r, i, j).norm_squared() <= 1.2f64 * 1.2)
                        .map(|j| j as u32)
                        .collect();
                    assert_eq!(*row, expected, "particle {i} of {n} in {spread:?}, box {length:?}");
                }
            }
        }
    }

    /// An outlier as far away as numbers go neither loses pairs nor makes cells too wide to be of use.
    #[test]
    fn outliers_and_numbers_that_are_none_are_survived() {
        let mut r = cloud(500, [10.0; 3]);
        r.set(17, [1e18, -1e18, 0.0].into());
        r.set(40, [f64::NAN, 1.0, f64::INFINITY].into());
        let mut list = NeighborList::new(1.0, 0.2);
        list.build(&r, &Periodic::default());
        let found = partners(&list);
        for i in 0..500 {
            let close = |j: &usize| *j != i && Periodic::default().separation(&r, i, *j).norm_squared() <= 1.44;
            let expected: Vec<u32> = (0..500).filter(close).map(|j| j as u32).collect();
            assert_eq!(found[i], expected, "particle {i}");
        }
    }

    #[test]
    fn a_list_is_outdated_when_someone_moved_half_a_skin() {
        let r = cloud(100, [3.0; 3]);
        let periodic = Periodic { length: [0.0, 0.0, 3.0], inverse: [0.0, 0.0, 1.0 / 3.0] };
        let mut list = NeighborList::new(1.0, 0.2);
        assert!(list.outdated(&r, &periodic));
        list.build(&r, &periodic);
        for (by, outdated) in
            [(0.0, false), (0.099, false), (0.101, true), (3.0, false), (2.95, false), (f64::NAN, true)]
        {
            let mut moved = r.clone();
            moved.z[99] += by;
            assert_eq!(list.outdated(&moved, &periodic), outdated, "moved by {by}");
        }
    }
}
