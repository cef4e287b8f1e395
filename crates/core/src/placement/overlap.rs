//! Finds overlapping spheres of any radii in O(n log n) time and O(n) memory.
//!
//! Every sphere belongs to the level of the smallest power of two above its diameter, which is the edge of that level's
//! cells. Two spheres that overlap are at most one cell of the larger's level apart, so each sphere asks its own level
//! and those above it, 27 cells each. Levels without spheres cost nothing.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::domain::Periodic;
use crate::state::Columns;

/// Two spheres that overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    /// The one with the smaller number.
    pub i: usize,
    /// The other.
    pub j: usize,
    /// Distance of the centres [m].
    pub distance: f64,
}

/// Number of a cell along each axis.
type Cell = [i64; 3];

/// The spheres of one level, sorted by cell.
struct Level {
    edge: f64,
    spheres: Vec<(Cell, u32)>,
}

/// Up to `limit` pairs that overlap by more than `tolerance` of the smaller diameter, sorted by number. The search ends
/// once it has found so many, so that a heap of coincident particles costs no more than a good scene.
pub(super) fn find(r: &Columns, radius: &[f64], periodic: &Periodic, tolerance: f64, limit: usize) -> Vec<Pair> {
    let corner = r.axes().map(|column| column.iter().copied().fold(f64::INFINITY, f64::min));
    let far = r.axes().map(|column| column.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    // The sum of two radii may round to just above the edge; the cells are then still a factor of up to two wider, and
    // exactly at the edge a power of two leaves nothing to round.
    let exponent = |i: usize| libm::ilogb(2.0 * radius[i]) + 1;
    let mut levels: BTreeMap<i32, Level> = BTreeMap::new();
    for i in 0..r.len() {
        let level = levels
            .entry(exponent(i))
            .or_insert_with(|| Level { edge: libm::scalbn(1.0, exponent(i)), spheres: Vec::new() });
        level.spheres.push((cell(&r.get(i), &corner, level.edge), i as u32));
    }
    for level in levels.values_mut() {
        level.spheres.sort_unstable();
    }
    let mut found = Vec::new();
    for (&own, level) in &levels {
        for &(_, i) in &level.spheres {
            let i = i as usize;
            for (&other, above) in levels.range(own..) {
                for image in images(&r.get(i), &corner, &far, periodic, above.edge) {
                    above.visit(cell(&image, &corner, above.edge), |j| {
                        // Within a level each pair is seen from both sides.
                        if found.len() >= limit || (other == own && j <= i) {
                            return;
                        }
                        let distance = (r.get(j) - image).norm();
                        let slack = tolerance * 2.0 * radius[i].min(radius[j]);
                        if distance - (radius[i] + radius[j]) < -slack {
                            found.push(Pair { i: i.min(j), j: i.max(j), distance });
                        }
                    });
                }
            }
            if found.len() >= limit {
                break;
            }
        }
    }
    found.sort_by_key(|pair| (pair.i, pair.j));
    found
}

fn cell(r: &Vector3<f64>, corner: &[f64; 3], edge: f64) -> Cell {
    // Casting saturates, which only puts particles beyond reach of each other into one cell.
    std::array::from_fn(|k| ((r[k] - corner[k]) / edge).floor() as i64)
}

/// A position and those of its periodic images that reach the cloud.
fn images(
    r: &Vector3<f64>,
    corner: &[f64; 3],
    far: &[f64; 3],
    periodic: &Periodic,
    reach: f64,
) -> impl Iterator<Item = Vector3<f64>> + use<> {
    let shifts: [[Option<f64>; 3]; 3] = std::array::from_fn(|k| {
        let length = periodic.length[k];
        let up = length > 0.0 && r[k] + length - reach <= far[k];
        let down = length > 0.0 && r[k] - length + reach >= corner[k];
        [Some(0.0), up.then_some(length), down.then_some(-length)]
    });
    let r = *r;
    shifts[0].into_iter().flatten().flat_map(move |x| {
        shifts[1]
            .into_iter()
            .flatten()
            .flat_map(move |y| shifts[2].into_iter().flatten().map(move |z| r + Vector3::new(x, y, z)))
    })
}

impl Level {
    /// Calls `visit` with every sphere in the 27 cells around one.
    fn visit(&self, [x, y, z]: Cell, mut visit: impl FnMut(usize)) {
        for x in neighbours(x) {
            for y in neighbours(y) {
                let (first, last) = ([x, y, z.saturating_sub(1)], [x, y, z.saturating_add(1)]);
                let start = self.spheres.partition_point(|(cell, _)| *cell < first);
                for (_, j) in self.spheres[start..].iter().take_while(|(cell, _)| *cell <= last) {
                    visit(*j as usize);
                }
            }
        }
    }
}

/// A cell's number and those beside it, each once.
fn neighbours(at: i64) -> impl Iterator<Item = i64> {
    at.saturating_sub(1)..=at.saturating_add(1)
}

#[cfg(test)]
mod tests {
    use super::super::random::Stream;
    use super::*;

    /// The same by looking at every pair.
    fn every_pair(r: &Columns, radius: &[f64], periodic: &Periodic, tolerance: f64) -> Vec<(usize, usize)> {
        let mut found = Vec::new();
        for i in 0..r.len() {
            for j in i + 1..r.len() {
                let gap = periodic.separation(r, i, j).norm() - (radius[i] + radius[j]);
                if gap < -tolerance * 2.0 * radius[i].min(radius[j]) {
                    found.push((i, j));
                }
            }
        }
        found
    }

    #[test]
    fn finds_what_looking_at_every_pair_finds() {
        for seed in 0..20 {
            let mut stream = Stream::new(seed, 0);
            let n = 300;
            let mut r = Columns::default();
            let mut radius = Vec::new();
            for _ in 0..n {
                r.push(std::array::from_fn(|_| 4.0 * stream.uniform()));
                // Four decades of size.
                radius.push(libm::pow(10.0, -4.0 * stream.uniform()) * 0.4);
            }
            for length in [[0.0; 3], [4.0; 3], [4.0, 0.0, 5.0]] {
                let inverse = length.map(|l: f64| if l > 0.0 { 1.0 / l } else { 0.0 });
                let periodic = Periodic { length, inverse };
                let found: Vec<_> = find(&r, &radius, &periodic, 1e-9, usize::MAX).iter().map(|p| (p.i, p.j)).collect();
                let expected = every_pair(&r, &radius, &periodic, 1e-9);
                assert!(!expected.is_empty());
                assert_eq!(found, expected, "seed {seed}, lengths {length:?}");
            }
        }
    }

    #[test]
    fn a_heap_of_coincident_particles_ends_at_the_limit() {
        let n = 100_000;
        let r = Columns::zeros(n);
        let pairs = find(&r, &vec![1.0; n], &Periodic::default(), 1e-9, 11);
        assert_eq!(pairs.len(), 11);
        assert!(pairs.iter().all(|p| p.distance == 0.0));
    }

    #[test]
    fn touching_and_far_away_is_no_overlap() {
        let mut r = Columns::default();
        for x in [-1e300, 0.0, 0.1, 0.2, 0.3, 1e300] {
            r.push([x, 0.0, 0.0]);
        }
        assert_eq!(find(&r, &[0.05; 6], &Periodic::default(), 1e-9, 10), []);
        assert_eq!(find(&r, &[0.0501; 6], &Periodic::default(), 1e-9, 10).len(), 3);
    }
}
