//! Clusters of a state: the connected components of close pairs, their sizes and radii of gyration.

use std::collections::BTreeMap;

use agglo_core::assembly::Model;
use agglo_core::clusters::components;
use agglo_core::contact::search::ClosePair;
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
        let pairs = self.pairs(range);
        let n = self.particles.len();
        let found = components(n, &pairs);
        let sizes = sizes(&found.of);
        let radii = self.gyration(&found.of, sizes.len(), &pairs);
        let mut histogram = BTreeMap::new();
        let (mut sum, mut largest) = (0.0, None);
        for (&size, &radius) in sizes.iter().zip(&radii).filter(|(size, _)| **size > 1) {
            *histogram.entry(size).or_insert(0) += 1;
            sum += radius;
            if largest.is_none_or(|(held, _)| size > held) {
                largest = Some((size, radius));
            }
        }
        let mut disagrees = recorded.and_then(|recorded| first_difference(&found.of, recorded));
        let mut bounds = Bounds { open: false, bonds: (pairs.len() as u64, pairs.len() as u64) };
        if let Some(rounding) = rounding {
            let (certain, possible) = self.edges(range, rounding);
            bounds =
                Bounds { open: certain.len() < possible.len(), bonds: (certain.len() as u64, possible.len() as u64) };
            if let (Some(_), Some(recorded)) = (disagrees, recorded)
                && bounds.open
                && recorded.len() == n
                && refines(&components(n, &certain).of, recorded)
                && refines(recorded, &components(n, &possible).of)
            {
                disagrees = None;
            }
        }
        Some(Clusters {
            count: found.count,
            largest: found.largest,
            singletons: found.singletons,
            mean_size: found.mean_size,
            sizes: histogram,
            gyration_of_largest: largest.map_or(0.0, |(_, radius)| radius),
            mean_gyration: if found.count == 0 { 0.0 } else { sum / f64::from(found.count) },
            bonds: pairs.len() as u64,
            of: found.of,
            disagrees,
            recorded: recorded.is_some(),
            bounds,
        })
    }

    fn pairs(&self, range: f64) -> Vec<ClosePair> {
        let Some(search) = &self.model.search else { return Vec::new() };
        // A search of its own: what it finds must not depend on states that it saw before.
        search.clone().close(self.position, self.particles, &self.model.domain, range).to_vec()
    }

    /// Pairs that are in range however recorded coordinates were rounded, and pairs that may be.
    fn edges(&self, range: f64, rounding: f64) -> (Vec<ClosePair>, Vec<ClosePair>) {
        let largest = self.position.axes().into_iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
        let shift = 4.0 * rounding * largest;
        let smallest = 2.0 * self.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let margin = (shift / smallest).min(0.1 * range);
        let possible = self.pairs(range + margin);
        let radius = &self.particles.radius;
        let distance =
            |pair: &ClosePair| (pair.square.sqrt(), range * (radius[pair.i as usize] + radius[pair.j as usize]));
        let within = |by: f64| {
            possible.iter().copied().filter(move |pair| {
                let (s, reach) = distance(pair);
                s <= reach + by
            })
        };
        (within(-shift).collect(), within(shift).collect())
    }

    /// Radius of gyration of every cluster about its centre of mass [m].
    fn gyration(&self, of: &[u32], count: usize, pairs: &[ClosePair]) -> Vec<f64> {
        let unwrapped;
        let r = if self.model.domain.periodic.any() {
            unwrapped = self.unwrap(of, pairs);
            &unwrapped
        } else {
            self.position
        };
        let mass = &self.particles.mass;
        let (mut total, mut centre) = (vec![0.0; count], vec![Vector3::zeros(); count]);
        for (i, &cluster) in of.iter().enumerate() {
            total[cluster as usize] += mass[i];
            centre[cluster as usize] += mass[i] * r.get(i);
        }
        let mut square = vec![0.0; count];
        for (i, &cluster) in of.iter().enumerate() {
            let k = cluster as usize;
            square[k] += mass[i] * (r.get(i) - centre[k] / total[k]).norm_squared();
        }
        square.iter().zip(&total).map(|(square, total)| (square / total).sqrt()).collect()
    }

    /// Positions in which no bond of a cluster crosses the periodic box: each member beside the one that it was reached
    /// from. (A cluster that spans the box has no such positions; some of its bonds then stay stretched.)
    fn unwrap(&self, of: &[u32], pairs: &[ClosePair]) -> Columns {
        let n = of.len();
        let (start, partners) = adjacency(n, pairs);
        let mut r = self.position.clone();
        let mut seen = vec![false; n];
        let mut open = Vec::new();
        for first in 0..n {
            if std::mem::replace(&mut seen[first], true) {
                continue;
            }
            open.push(first);
            while let Some(i) = open.pop() {
                for &j in &partners[start[i]..start[i + 1]] {
                    let j = j as usize;
                    if !std::mem::replace(&mut seen[j], true) {
                        let beside = r.get(i) + self.model.domain.periodic.separation(self.position, i, j);
                        r.set(j, beside);
                        open.push(j);
                    }
                }
            }
        }
        r
    }
}

/// Partners of every particle: those of i are `partners[start[i]..start[i + 1]]`.
fn adjacency(n: usize, pairs: &[ClosePair]) -> (Vec<usize>, Vec<u32>) {
    let mut start = vec![0; n + 1];
    for pair in pairs {
        start[pair.i as usize + 1] += 1;
        start[pair.j as usize + 1] += 1;
    }
    for i in 0..n {
        start[i + 1] += start[i];
    }
    let mut next = start.clone();
    let mut partners = vec![0; 2 * pairs.len()];
    for pair in pairs {
        for (from, to) in [(pair.i, pair.j), (pair.j, pair.i)] {
            let place = &mut next[from as usize];
            partners[*place] = to;
            *place += 1;
        }
    }
    (start, partners)
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
