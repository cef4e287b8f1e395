//! Clusters: the connected components of close pairs, by union-find.

use crate::contact::search::ClosePair;
use crate::observer::Clusters;

/// Components of n particles joined by pairs.
#[must_use]
pub fn components(n: usize, pairs: &[ClosePair]) -> Clusters {
    let mut parent: Vec<u32> = (0..n as u32).collect();
    for pair in pairs {
        let (a, b) = (root(&mut parent, pair.i), root(&mut parent, pair.j));
        // The smaller number wins, so that a root is its component's first member.
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut number = vec![u32::MAX; n];
    let mut sizes: Vec<u32> = Vec::new();
    let mut of = vec![0; n];
    for i in 0..n {
        let root = root(&mut parent, i as u32) as usize;
        if number[root] == u32::MAX {
            number[root] = sizes.len() as u32;
            sizes.push(0);
        }
        of[i] = number[root];
        sizes[of[i] as usize] += 1;
    }
    let singletons = sizes.iter().filter(|&&size| size == 1).count() as u32;
    let count = sizes.len() as u32 - singletons;
    let mean_size = if count == 0 { 0.0 } else { (n as f64 - f64::from(singletons)) / f64::from(count) };
    Clusters { of, count, largest: sizes.iter().copied().max().unwrap_or(0), singletons, mean_size }
}

/// First member of i's component; halves the path on its way.
fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::components;
    use crate::contact::search::ClosePair;

    #[test]
    fn a_chain_a_pair_and_a_loner() {
        let pair = |i, j| ClosePair { i, j, square: 1.0 };
        let clusters = components(6, &[pair(4, 5), pair(0, 3), pair(1, 3)]);
        assert_eq!(clusters.of, [0, 0, 1, 0, 2, 2]);
        assert_eq!((clusters.count, clusters.largest, clusters.singletons), (2, 3, 1));
        assert_eq!(clusters.mean_size, 2.5);
    }
}
