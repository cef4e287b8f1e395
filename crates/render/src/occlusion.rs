//! How much of their surroundings spheres hide from each other: what makes clusters look like solid things.

use std::sync::OnceLock;

/// A sphere in the directions of the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre: metres to the right, up and forward of the eye.
    pub centre: [f64; 3],
    /// Radius [m].
    pub radius: f64,
}

/// A sphere darkens what is nearer to its centre than this many of its radii [-].
const REACH: f64 = 3.0;
/// How dark a sphere makes what it hides the sky from; 1 is what geometry says, and more sets clusters off [-].
const STRENGTH: f64 = 1.4;
/// Neighbours of a sphere that count: more do not fit around one of equal size.
const MOST: usize = 24;
/// Spheres looked at in a cell; only coincident spheres fill one further.
const CELL_MOST: usize = 64;
/// Spheres that are much larger than most, and looked at by all.
const GIANTS: usize = 16;

/// The neighbours of every sphere, looked for when they are first needed: of a dense cloud only the outside is seen.
#[derive(Debug, Default)]
pub struct Occlusion {
    spheres: Vec<Sphere>,
    grid: Option<Grid>,
    /// Numbers of neighbours, by sphere.
    near: Vec<OnceLock<Vec<u32>>>,
}

impl Occlusion {
    /// Of these spheres.
    pub fn new(spheres: Vec<Sphere>) -> Self {
        let (grid, near) = (Grid::new(&spheres), spheres.iter().map(|_| OnceLock::new()).collect());
        Self { spheres, grid, near }
    }

    /// The neighbours of sphere `i`; none of one that is not there.
    fn near(&self, i: usize) -> &[u32] {
        match (&self.grid, self.near.get(i)) {
            (Some(grid), Some(near)) => near.get_or_init(|| neighbours(&self.spheres, grid, i)),
            _ => &[],
        }
    }

    /// The open part of the surroundings of a point of sphere `i` with this outward unit normal, 0 to 1.
    pub fn open(&self, i: usize, point: [f64; 3], normal: [f64; 3]) -> f32 {
        let mut open = 1.0_f64;
        for &j in self.near(i) {
            let Sphere { centre, radius } = self.spheres[j as usize];
            let to = [0, 1, 2].map(|k| centre[k] - point[k]);
            let square = to[0] * to[0] + to[1] * to[1] + to[2] * to[2];
            let reach = REACH * radius;
            if square >= reach * reach || square == 0.0 {
                continue;
            }
            let distance = square.sqrt();
            let cosine = (to[0] * normal[0] + to[1] * normal[1] + to[2] * normal[2]) / distance;
            // A sphere above the horizon hides cos (R/D)^2 of a half space; the window makes the reach finite.
            let share = (radius * radius / square).min(1.0);
            let window = 1.0 - square / (reach * reach);
            open *= 1.0 - (STRENGTH * cosine.max(0.0) * share * window).min(0.95);
        }
        open as f32
    }
}

fn neighbours(spheres: &[Sphere], grid: &Grid, i: usize) -> Vec<u32> {
    let this = spheres[i];
    let mut found: Vec<(f64, u32)> = Vec::new();
    grid.around(this.centre, |j| {
        let other = spheres[j as usize];
        let square =
            (0..3).map(|k| (other.centre[k] - this.centre[k]) * (other.centre[k] - this.centre[k])).sum::<f64>();
        let reach = this.radius + REACH * other.radius;
        if j as usize != i && square < reach * reach {
            // What is seen of it from the nearest point decides which count.
            let gap = (square.sqrt() - this.radius).max(0.1 * other.radius);
            found.push((-other.radius / gap, j));
        }
    });
    found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.dedup_by_key(|entry| entry.1);
    found.truncate(MOST);
    found.into_iter().map(|(_, j)| j).collect()
}

/// Spheres by the cell that their centre is in; cells share buckets.
#[derive(Debug)]
struct Grid {
    cell: f64,
    starts: Vec<u32>,
    entries: Vec<(u32, [i64; 3])>,
    giants: Vec<u32>,
}

impl Grid {
    fn new(spheres: &[Sphere]) -> Option<Self> {
        let mut order: Vec<u32> = (0..spheres.len() as u32).collect();
        order.sort_by(|&a, &b| spheres[b as usize].radius.total_cmp(&spheres[a as usize].radius).then(a.cmp(&b)));
        let typical = spheres[*order.get(order.len() / 2)? as usize].radius;
        let cell = (1.0 + REACH) * typical;
        if !(cell > 0.0 && cell.is_finite()) {
            return None;
        }
        let giants =
            order.iter().copied().take(GIANTS).filter(|&i| spheres[i as usize].radius > 1.5 * typical).collect();
        let mut grid =
            Self { cell, starts: vec![0; spheres.len().next_power_of_two() + 1], entries: Vec::new(), giants };
        let cells: Vec<[i64; 3]> = spheres.iter().map(|sphere| grid.cell_of(sphere.centre)).collect();
        for cell in &cells {
            let bucket = grid.bucket(*cell);
            grid.starts[bucket + 1] += 1;
        }
        for k in 1..grid.starts.len() {
            grid.starts[k] += grid.starts[k - 1];
        }
        let mut next = grid.starts.clone();
        grid.entries = vec![(0, [0; 3]); spheres.len()];
        for (i, cell) in (0..).zip(cells) {
            let bucket = grid.bucket(cell);
            grid.entries[next[bucket] as usize] = (i, cell);
            next[bucket] += 1;
        }
        Some(grid)
    }

    fn cell_of(&self, point: [f64; 3]) -> [i64; 3] {
        point.map(|x| (x / self.cell).floor() as i64)
    }

    fn bucket(&self, cell: [i64; 3]) -> usize {
        let mixed = cell.iter().fold(0x9e37_79b9_7f4a_7c15_u64, |sum, &k| {
            (sum ^ k as u64).wrapping_mul(0xff51_afd7_ed55_8ccd).rotate_left(29)
        });
        (mixed >> 7) as usize & (self.starts.len() - 2)
    }

    /// Calls `look` with every sphere in the cells around a point, and with the giants.
    fn around(&self, point: [f64; 3], mut look: impl FnMut(u32)) {
        let middle = self.cell_of(point);
        for offset in 0..27_i64 {
            let shift = [offset % 3 - 1, offset / 3 % 3 - 1, offset / 9 - 1];
            let cell = [0, 1, 2].map(|k| middle[k].saturating_add(shift[k]));
            let bucket = self.bucket(cell);
            let entries = &self.entries[self.starts[bucket] as usize..self.starts[bucket + 1] as usize];
            entries.iter().filter(|(_, of)| *of == cell).take(CELL_MOST).for_each(|(i, _)| look(*i));
        }
        self.giants.iter().for_each(|&i| look(i));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_touching_neighbour_darkens_its_own_side_only() {
        let spheres = [Sphere { centre: [0.0; 3], radius: 1.0 }, Sphere { centre: [2.0, 0.0, 0.0], radius: 1.0 }];
        let occlusion = Occlusion::new(spheres.to_vec());
        let open = |x: f64| occlusion.open(0, [x, 0.0, 0.0], [x, 0.0, 0.0]);
        assert!(open(1.0) < 0.4, "where they touch: {}", open(1.0));
        assert_eq!(open(-1.0), 1.0);
        let alone = Occlusion::new(spheres[..1].to_vec());
        assert_eq!(alone.open(0, [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]), 1.0);
    }

    #[test]
    fn every_neighbour_in_reach_is_found() {
        // A lattice: the six nearest and no more are nearer than 2.9 spacings of 1.4 radii.
        let spheres: Vec<Sphere> = (0..1000)
            .map(|k| Sphere { centre: [k % 10, k / 10 % 10, k / 100].map(|x| 3.9 * f64::from(x)), radius: 1.0 })
            .collect();
        let occlusion = Occlusion::new(spheres.to_vec());
        assert_eq!(occlusion.near(555).len(), 6, "{:?}", occlusion.near(555));
        assert_eq!(occlusion.near(0).len(), 3);
    }

    #[test]
    fn any_spheres_are_bounded_work() {
        let same = Sphere { centre: [1e300, -1e300, 0.0], radius: 1e-300 };
        let occlusion = Occlusion::new(vec![same; 5000]);
        assert!((0..5000).all(|i| occlusion.near(i).len() <= MOST));
        assert_eq!(Occlusion::new(Vec::new()).open(3, [0.0; 3], [0.0; 3]), 1.0);
    }
}
