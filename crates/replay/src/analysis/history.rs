//! What becomes of clusters from one recorded state to the next.
//!
//! Clusters have two members or more. A cluster of one state and one of the next are *linked* where they share at least
//! two particles (a particle that changes clusters is no event). A cluster that is linked to several later ones breaks
//! up, into one more part for each beyond the first; a cluster that is linked to several earlier ones is a merger, one
//! for each beyond the first. Links make an earlier cluster go on as a later one, the largest share first (of equals that
//! of the older cluster, then that to the later cluster with the smaller first member), each cluster once. A cluster that
//! does not go on ends: *merged* where it is linked at all, else *dispersed*. One that continues none is new.
//!
//! A lifetime runs from the first state with the cluster to the first without it. What happens between recorded states
//! is not seen.

use super::clusters::sizes;

/// A cluster from its first state to its last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Life {
    /// Running number, by first state and first member.
    pub id: u64,
    /// Time of the first state that has it [s].
    pub born: f64,
    /// Whether that is the first state of all: it may be older.
    pub from_start: bool,
    /// Time of the first state without it; of those that last, of the last state [s].
    pub ended: f64,
    /// What became of it.
    pub end: End,
    /// Members at its largest.
    pub largest: u32,
}

/// How a cluster ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Two or more of its members are in a cluster that continues another one.
    Merged,
    /// No two of its members are together any more.
    Dispersed,
    /// It is there in the last state.
    Lasts,
}

/// Events counted over all states.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Mergers.
    pub mergers: u64,
    /// Break-ups.
    pub break_ups: u64,
    /// Clusters that continue none, those of the first state not counted.
    pub formed: u64,
    /// Clusters that ended merged.
    pub merged: u64,
    /// Clusters that dispersed.
    pub dispersed: u64,
    /// Clusters that were there in the last state.
    pub lasting: u64,
    /// Sum of the lifetimes of clusters that ended [s].
    sum: f64,
    /// Longest lifetime of one that ended [s].
    pub longest: f64,
}

impl Counts {
    /// Mean lifetime of clusters that ended [s]; `None` where none did.
    #[must_use]
    pub fn mean_lifetime(&self) -> Option<f64> {
        let ended = self.merged + self.dispersed;
        (ended > 0).then(|| self.sum / ended as f64)
    }

    fn note(&mut self, life: &Life) {
        match life.end {
            End::Lasts => {
                self.lasting += 1;
                return;
            }
            End::Merged => self.merged += 1,
            End::Dispersed => self.dispersed += 1,
        }
        self.sum += life.ended - life.born;
        self.longest = self.longest.max(life.ended - life.born);
    }
}

/// Follows clusters through the states.
#[derive(Clone, Debug, Default)]
pub struct History {
    /// Events so far.
    pub counts: Counts,
    /// Cluster of every particle in the last state.
    of: Vec<u32>,
    /// The cluster with each number of the last state; `None` for particles that are alone.
    alive: Vec<Option<Life>>,
    last: Option<f64>,
    next: u64,
}

/// An earlier and a later cluster that share members.
#[derive(Clone, Copy, Debug)]
struct Link {
    before: u32,
    after: u32,
    shared: u32,
}

impl History {
    /// Takes the next state: the cluster of every particle, numbered by first member. Clusters that end go to `ended`.
    pub fn step(&mut self, t: f64, of: &[u32], mut ended: impl FnMut(&Life)) {
        if self.last.is_some() && self.of == of {
            // Every cluster goes on as itself.
            self.last = Some(t);
            return;
        }
        let sizes = sizes(of);
        let from_start = self.last.is_none();
        let links = self.links(of);
        let heir = self.heirs(&links, sizes.len());
        for runs in runs(&links, |link| link.before) {
            self.counts.break_ups += runs as u64 - 1;
        }
        let mut by_later = links.clone();
        by_later.sort_unstable_by_key(|link| (link.after, link.before));
        for runs in runs(&by_later, |link| link.after) {
            self.counts.mergers += runs as u64 - 1;
        }
        let mut alive: Vec<Option<Life>> = vec![None; sizes.len()];
        for (number, life) in std::mem::take(&mut self.alive).into_iter().enumerate() {
            let Some(mut life) = life else { continue };
            if let Some(after) = heir[number] {
                life.largest = life.largest.max(sizes[after as usize]);
                alive[after as usize] = Some(life);
                continue;
            }
            let linked = links.binary_search_by_key(&number, |link| link.before as usize).is_ok();
            (life.ended, life.end) = (t, if linked { End::Merged } else { End::Dispersed });
            self.counts.note(&life);
            ended(&life);
        }
        for (life, &size) in alive.iter_mut().zip(&sizes) {
            if life.is_none() && size > 1 {
                let (id, end) = (self.next, End::Lasts);
                *life = Some(Life { id, born: t, from_start, ended: t, end, largest: size });
                self.next += 1;
                self.counts.formed += u64::from(!from_start);
            }
        }
        (self.alive, self.last) = (alive, Some(t));
        self.of.clear();
        self.of.extend_from_slice(of);
    }

    /// Ends the history: all clusters that are left last.
    pub fn finish(&mut self, mut ended: impl FnMut(&Life)) {
        let last = self.last.unwrap_or(0.0);
        for mut life in std::mem::take(&mut self.alive).into_iter().flatten() {
            (life.ended, life.end) = (last, End::Lasts);
            self.counts.note(&life);
            ended(&life);
        }
    }

    /// Links to the clusters of the next state, by earlier and then later cluster.
    fn links(&self, of: &[u32]) -> Vec<Link> {
        let both = self.of.iter().zip(of);
        let followed = |before: u32| self.alive.get(before as usize).is_some_and(Option::is_some);
        let mut shared: Vec<(u32, u32)> =
            both.filter(|(before, _)| followed(**before)).map(|(before, after)| (*before, *after)).collect();
        shared.sort_unstable();
        let same = shared.chunk_by(|a, b| a == b).filter(|members| members.len() > 1);
        same.map(|members| Link { before: members[0].0, after: members[0].1, shared: members.len() as u32 }).collect()
    }

    /// The later cluster as which each earlier one goes on.
    fn heirs(&self, links: &[Link], later: usize) -> Vec<Option<u32>> {
        let mut order: Vec<&Link> = links.iter().collect();
        let age = |before: u32| self.alive[before as usize].map(|life| life.id);
        order.sort_by_key(|link| (std::cmp::Reverse(link.shared), age(link.before), link.after));
        let mut heir = vec![None; self.alive.len()];
        let mut taken = vec![false; later];
        for link in order {
            let (before, after) = (link.before as usize, link.after as usize);
            if heir[before].is_none() && !taken[after] {
                (heir[before], taken[after]) = (Some(link.after), true);
            }
        }
        heir
    }
}

/// Lengths of the runs of links with the same key.
fn runs(links: &[Link], key: impl Fn(&Link) -> u32) -> Vec<usize> {
    links.chunk_by(|a, b| key(a) == key(b)).map(<[Link]>::len).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn follow(states: &[&[u32]]) -> (Counts, Vec<Life>) {
        let (mut history, mut lives) = (History::default(), Vec::new());
        for (k, of) in states.iter().enumerate() {
            history.step(k as f64, of, |life| lives.push(*life));
        }
        history.finish(|life| lives.push(*life));
        (history.counts, lives)
    }

    #[test]
    fn two_pairs_merge_and_part() {
        // {0, 1} and {2, 3}; all four; {0, 1, 2} and 3; {0, 1} and {2, 3}; nobody.
        let (counts, lives) = follow(&[&[0, 0, 1, 1], &[0, 0, 0, 0], &[0, 0, 0, 1], &[0, 0, 1, 1], &[0, 1, 2, 3]]);
        assert_eq!((counts.mergers, counts.break_ups, counts.formed), (1, 0, 1), "3 was alone before {{2, 3}}");
        let of = |id: u64| *lives.iter().find(|life| life.id == id).unwrap();
        assert_eq!((of(0).born, of(0).ended, of(0).end, of(0).largest), (0.0, 4.0, End::Dispersed, 4));
        assert_eq!((of(1).born, of(1).ended, of(1).end), (0.0, 1.0, End::Merged), "of equals the older goes on");
        assert_eq!((of(2).born, of(2).ended, of(2).end), (3.0, 4.0, End::Dispersed));
        assert_eq!((counts.mean_lifetime(), counts.longest), (Some(2.0), 4.0));
    }

    #[test]
    fn the_larger_part_goes_on() {
        let (counts, lives) = follow(&[&[0; 5], &[0, 0, 1, 1, 1]]);
        assert_eq!((counts.mergers, counts.break_ups, counts.formed, counts.lasting), (0, 1, 1, 2));
        assert_eq!(lives.iter().map(|life| (life.id, life.born)).collect::<Vec<_>>(), [(1, 1.0), (0, 0.0)]);
    }

    #[test]
    fn one_that_changes_clusters_is_no_event() {
        let (counts, lives) = follow(&[&[0, 0, 0, 1, 1], &[0, 0, 1, 1, 1]]);
        assert_eq!(counts, Counts { lasting: 2, ..Counts::default() });
        assert_eq!(lives.iter().map(|life| life.largest).collect::<Vec<_>>(), [3, 3]);
    }
}
