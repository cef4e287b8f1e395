//! Clusters of a state: the connected components of close pairs, their sizes and radii of gyration.

use std::collections::BTreeMap;

use agglo_core::assembly::Model;
use agglo_core::contact::search::{ClosePair, visit_close};
use agglo_core::state::{Columns, Particles};
use nalgebra::Vector3;

/// Clusters of a state.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clusters {
    /// Clusters of two particles or more.
    pub count: u32,
    /// Size of the largest cluster; 1 where all are alone.
    pub largest: u32,
    /// Particles that are alone.
    pub singletons: u32,
    /// Mean size of clusters of two or more [-]; 0 where there is none.
    pub mean_size: f64,
    /// How many clusters of two or more there are of each size.
    pub sizes: BTreeMap<u32, u32>,
    /// Radius of gyration of the largest cluster, of equals the one with the smallest first member [m]; 0 where all are
    /// alone.
    pub gyration_of_largest: f64,
    /// Mean radius of gyration of the clusters of two or more [m]; 0 where there is none.
    pub mean_gyration: f64,
    /// Bonded pairs.
    pub bonds: u64,
    /// Cluster of every particle, length n, numbered by first member.
    pub of: Vec<u32>,
    /// First particle whose recorded cluster is another one, with that; `None` where all agree or none is recorded.
    pub disagrees: Option<(usize, u32)>,
    /// Whether clusters are recorded at all.
    pub recorded: bool,
    /// Least and greatest count that rounding of the recorded positions allows; the same where they are exact.
    pub bounds: Bounds,
}

/// What the rounding of recorded positions leaves open: clusters without and with the pairs at the edge of the range.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bounds {
    /// Whether some pair is that close to the edge.
    pub open: bool,
    /// Bonded pairs, without and with them.
    pub bonds: (u64, u64),
}

/// Particles at one instant.
pub struct Close<'a> {
    pub particles: &'a Particles,
    pub model: &'a Model,
    pub position: &'a Columns,
}

impl Close<'_> {
    /// The clusters, where the scene counts them; `recorded` is the log's column, `rounding` the relative error of
    /// recorded coordinates where they are rounded.
    pub fn clusters(&self, recorded: Option<&[u32]>, rounding: Option<f64>) -> Option<Clusters> {
        let range = self.model.cluster_range?;
        let mut joined = Joined::new(self.particles.len());
        self.visit(range, |pair| joined.join(pair.i, pair.j, |i, j| self.separation(i, j)));
        let of = joined.numbers();
        let sizes = sizes(&of);
        let radii = self.gyration(&of, sizes.len(), &mut joined);
        let mut found = Clusters { bonds: joined.pairs, recorded: recorded.is_some(), ..count(&sizes, &radii) };
        found.disagrees = recorded.and_then(|recorded| first_difference(&of, recorded));
        found.bounds = Bounds { open: false, bonds: (joined.pairs, joined.pairs) };
        if let Some(rounding) = rounding {
            let (certain, possible) = self.edges(range, rounding);
            found.bounds = Bounds { open: certain.pairs < possible.pairs, bonds: (certain.pairs, possible.pairs) };
            if let Some(recorded) = recorded.filter(|recorded| found.bounds.open && recorded.len() == of.len())
                && refines(&certain.numbers(), recorded)
                && refines(recorded, &possible.numbers())
            {
                found.disagrees = None;
            }
        }
        found.of = of;
        Some(found)
    }

    fn visit(&self, range: f64, visit: impl FnMut(ClosePair)) {
        visit_close(self.position, &self.particles.radius, &self.model.domain.periodic, range, visit);
    }

    /// r_j - r_i by the shortest way [m].
    fn separation(&self, i: usize, j: usize) -> Vector3<f64> {
        self.model.domain.periodic.separation(self.position, i, j)
    }

    /// Particles joined by pairs that are in range however recorded coordinates were rounded, and by pairs that may be.
    fn edges(&self, range: f64, rounding: f64) -> (Joined, Joined) {
        let largest = self.position.axes().into_iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let shift = 4.0 * rounding * largest;
        let radius = &self.particles.radius;
        let smallest = 2.0 * radius.iter().copied().fold(f64::INFINITY, f64::min);
        let margin = (shift / smallest).min(0.1 * range);
        let [mut certain, mut possible] = [Joined::new(radius.len()), Joined::new(radius.len())];
        self.visit(range + margin, |pair| {
            let beyond = pair.square.sqrt() - range * (radius[pair.i as usize] + radius[pair.j as usize]);
            for (joined, by) in [(&mut certain, -shift), (&mut possible, shift)] {
                if beyond <= by {
                    joined.join(pair.i, pair.j, |_, _| Vector3::zeros());
                }
            }
        });
        (certain, possible)
    }

    /// Radius of gyration of every cluster about its centre of mass [m]. In a periodic box each member stands where the
    /// bonds put it that joined the cluster; one that spans the box has no such places for all, and its radius says little.
    fn gyration(&self, of: &[u32], count: usize, joined: &mut Joined) -> Vec<f64> {
        let mass = &self.particles.mass;
        let place: Vec<Vector3<f64>> = (0..of.len()).map(|i| joined.root(i as u32).1).collect();
        let (mut total, mut centre) = (vec![0.0; count], vec![Vector3::zeros(); count]);
        for (i, &cluster) in of.iter().enumerate() {
            total[cluster as usize] += mass[i];
            centre[cluster as usize] += mass[i] * place[i];
        }
        let mut square = vec![0.0; count];
        for (i, &cluster) in of.iter().enumerate() {
            let k = cluster as usize;
            square[k] += mass[i] * (place[i] - centre[k] / total[k]).norm_squared();
        }
        square.iter().zip(&total).map(|(square, total)| (square / total).sqrt()).collect()
    }
}

/// Counts clusters by their sizes, with their radii of gyration [m].
fn count(sizes: &[u32], radii: &[f64]) -> Clusters {
    let mut found = Clusters { largest: sizes.iter().copied().max().unwrap_or(0), ..Clusters::default() };
    let (mut members, mut sum, mut longest) = (0_u64, 0.0, 0);
    for (&size, &radius) in sizes.iter().zip(radii) {
        if size < 2 {
            found.singletons += 1;
            continue;
        }
        found.count += 1;
        *found.sizes.entry(size).or_insert(0) += 1;
        members += u64::from(size);
        sum += radius;
        if size > longest {
            (longest, found.gyration_of_largest) = (size, radius);
        }
    }
    if found.count > 0 {
        found.mean_size = members as f64 / f64::from(found.count);
        found.mean_gyration = sum / f64::from(found.count);
    }
    found
}

/// Particles joined by pairs (union-find); each knows where it stands from one that it was joined to.
struct Joined {
    /// Another particle of the same component; itself for the first member, its root.
    parent: Vec<u32>,
    /// Position relative to that one, length n [m].
    from_parent: Vec<Vector3<f64>>,
    /// Pairs so far.
    pairs: u64,
}

impl Joined {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect(), from_parent: vec![Vector3::zeros(); n], pairs: 0 }
    }

    /// Joins i and j, r_j - r_i apart.
    fn join(&mut self, i: u32, j: u32, separation: impl Fn(usize, usize) -> Vector3<f64>) {
        self.pairs += 1;
        // Most pairs of a cluster are joined already, and have been moved next to its root.
        if self.parent[i as usize] == self.parent[j as usize] {
            return;
        }
        let ((a, from_a), (b, from_b)) = (self.root(i), self.root(j));
        if a == b {
            return;
        }
        let b_from_a = from_a + separation(i as usize, j as usize) - from_b;
        // The smaller number wins, so that a root is its component's first member.
        let (root, other, place) = if a < b { (a, b, b_from_a) } else { (b, a, -b_from_a) };
        self.parent[other as usize] = root;
        self.from_parent[other as usize] = place;
    }

    /// The first member of i's component, and where i stands from it; shortens the path on its way.
    fn root(&mut self, mut i: u32) -> (u32, Vector3<f64>) {
        let mut place = Vector3::zeros();
        loop {
            let at = i as usize;
            let parent = self.parent[at];
            if parent == i {
                return (i, place);
            }
            let above = parent as usize;
            if self.parent[above] != parent {
                let further = self.from_parent[above];
                self.from_parent[at] += further;
                self.parent[at] = self.parent[above];
            }
            place += self.from_parent[at];
            i = self.parent[at];
        }
    }

    /// The component of every particle, numbered by first member.
    fn numbers(&self) -> Vec<u32> {
        let mut of: Vec<u32> = vec![0; self.parent.len()];
        let mut next = 0;
        for i in 0..of.len() {
            // A parent has a smaller number than its children, so it has its component already.
            let parent = self.parent[i] as usize;
            if parent == i {
                of[i] = next;
                next += 1;
            } else {
                of[i] = of[parent];
            }
        }
        of
    }
}

/// Members of every cluster.
pub fn sizes(of: &[u32]) -> Vec<u32> {
    let mut sizes = vec![0; of.iter().max().map_or(0, |&last| last as usize + 1)];
    for &cluster in of {
        sizes[cluster as usize] += 1;
    }
    sizes
}

/// The first particle that is in another cluster than recorded.
fn first_difference(of: &[u32], recorded: &[u32]) -> Option<(usize, u32)> {
    let mut both = of.iter().zip(recorded).enumerate();
    both.find(|(_, (found, recorded))| found != recorded).map(|(i, (_, &recorded))| (i, recorded))
}

/// Whether particles that are together in `fine` are together in `coarse` as well.
fn refines(fine: &[u32], coarse: &[u32]) -> bool {
    let mut image = BTreeMap::new();
    fine.iter().zip(coarse).all(|(fine, coarse)| *image.entry(*fine).or_insert(*coarse) == *coarse)
}
