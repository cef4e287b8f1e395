//! Clusters through time: which particles are in which, and colours that stay with them.

use crate::canvas::Rgb;
use crate::colors::{CLUSTERS, SINGLE, cluster};

/// Groups of two particles or more with the same number, the largest first, of equal ones that with the smaller number.
/// Members are in rising order.
pub fn groups(numbers: &[u32]) -> Vec<(u32, Vec<usize>)> {
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by_key(|&particle| numbers[particle]);
    let mut groups: Vec<(u32, Vec<usize>)> = order
        .chunk_by(|&a, &b| numbers[a] == numbers[b])
        .filter(|members| members.len() > 1)
        .map(|members| (numbers[members[0]], members.to_vec()))
        .collect();
    groups.sort_by_key(|(number, members)| (std::cmp::Reverse(members.len()), *number));
    groups
}

/// Gives clusters colours. A cluster keeps the colour of the one of the moment before that most of its particles come
/// from, where no larger cluster has it already.
#[derive(Clone, Debug, Default)]
pub struct ClusterColors {
    /// The cluster that each particle was in, as a running number that is never used again.
    before: Vec<Option<usize>>,
    /// Place in the cycle of colours, by running number.
    places: Vec<usize>,
}

impl ClusterColors {
    /// The colours of the particles at the next moment, by their clusters' numbers.
    pub fn next(&mut self, numbers: &[u32]) -> Vec<Rgb> {
        let mut colors = vec![SINGLE; numbers.len()];
        let mut now = vec![None; numbers.len()];
        self.before.resize(numbers.len(), None);
        let groups = groups(numbers);
        let mut claimed: Vec<Option<usize>> = Vec::with_capacity(groups.len());
        let mut taken = std::collections::BTreeSet::new();
        for (_, members) in &groups {
            let origin = self.origins(members).into_iter().find(|origin| taken.insert(*origin));
            claimed.push(origin);
        }
        let mut uses = [0_usize; CLUSTERS.len()];
        claimed.iter().flatten().for_each(|&origin| uses[self.places[origin]] += 1);
        for ((_, members), claim) in groups.iter().zip(claimed) {
            let identity = claim.unwrap_or_else(|| {
                // The colour that is used least, the first of several.
                let place = (0..uses.len()).min_by_key(|&place| uses[place]).unwrap_or(0);
                uses[place] += 1;
                self.places.push(place);
                self.places.len() - 1
            });
            for &particle in members {
                now[particle] = Some(identity);
                colors[particle] = cluster(self.places[identity]);
            }
        }
        self.before = now;
        colors
    }

    /// The clusters that particles were in before, that of most of them first.
    fn origins(&self, members: &[usize]) -> Vec<usize> {
        let mut before: Vec<usize> = members.iter().filter_map(|&particle| self.before[particle]).collect();
        before.sort_unstable();
        let mut counts: Vec<(usize, usize)> = before.chunk_by(|a, b| a == b).map(|run| (run.len(), run[0])).collect();
        counts.sort_by_key(|&(count, origin)| (std::cmp::Reverse(count), origin));
        counts.into_iter().map(|(_, origin)| origin).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_come_largest_first() {
        assert_eq!(groups(&[0, 1, 0, 2, 1, 1, u32::MAX]), [(1, vec![1, 4, 5]), (0, vec![0, 2])]);
    }

    #[test]
    fn clusters_keep_their_colours_when_numbers_change() {
        let mut colors = ClusterColors::default();
        let first = colors.next(&[0, 1, 1, 1, 2, 2]);
        assert_eq!([first[0], first[1], first[4]], [SINGLE, cluster(0), cluster(1)]);
        // Particle 0 joins the pair, whose number becomes 0.
        let second = colors.next(&[0, 1, 1, 1, 0, 0]);
        assert_eq!(second, [first[4], first[1], first[1], first[1], first[4], first[4]]);
        // All merge: the larger half decides; of equal ones the older.
        assert_eq!(colors.next(&[0; 6]), [first[1]; 6]);
        // A split: the larger part keeps the colour, the other gets a new one.
        let parts = colors.next(&[0, 0, 1, 1, 1, 1]);
        assert!(parts[2] == first[1] && parts[0] != parts[2] && parts[0] != SINGLE);
    }
}
