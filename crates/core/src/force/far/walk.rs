//! Which cells a cell meets: by expansions where both are small for their distance, by pairs where both are leaves.

use super::tree::{Cell, Tree};
use std::ops::Range;

/// Particles of a cell that is a task: depends on nothing but this constant, never on the number of threads.
const TASK: usize = 2048;

/// Which cells meet by expansions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule {
    /// The sum of their radii is at most this share of their distance [-].
    pub(super) opening: f64,
    /// All pairs are farther apart than this [m].
    pub(super) reach: f64,
}

/// What one cell meets.
#[derive(Clone, Debug, Default)]
pub(super) struct Meeting {
    /// The cell.
    pub(super) cell: usize,
    /// Number of its parent's meeting; `None` without one.
    pub(super) parent: Option<usize>,
    /// Which of [`Meetings::far`] it meets by expansions.
    pub(super) far: Range<usize>,
    /// Which of [`Meetings::near`] it meets by pairs, if it is a leaf.
    pub(super) near: Range<usize>,
}

/// Meetings of some cells, parents before children.
#[derive(Clone, Debug, Default)]
pub(super) struct Meetings {
    pub(super) meetings: Vec<Meeting>,
    /// Cells.
    pub(super) far: Vec<u32>,
    /// Runs of places.
    pub(super) near: Vec<Range<u32>>,
}

/// A cell with everything below it.
#[derive(Clone, Debug)]
pub(super) struct Task {
    pub(super) cell: usize,
    /// Number of the parent's meeting at the top.
    pub(super) parent: Option<usize>,
    /// Cells that it has not met yet.
    candidates: Vec<u32>,
}

impl Task {
    /// What its cells meet.
    pub(super) fn meetings(&self, tree: &Tree, rule: Rule) -> Meetings {
        let mut meetings = Meetings::default();
        let mut walk = Walk { tree, rule, meetings: &mut meetings, tasks: None };
        walk.visit(self.cell, None, &self.candidates);
        meetings
    }
}

/// What the cells at the top of the tree meet, and tasks for all below them, in the order of places.
pub(super) fn split(tree: &Tree, rule: Rule) -> (Meetings, Vec<Task>) {
    let (mut meetings, mut tasks) = (Meetings::default(), Vec::new());
    Walk { tree, rule, meetings: &mut meetings, tasks: Some(&mut tasks) }.visit(0, None, &[0]);
    (meetings, tasks)
}

struct Walk<'a> {
    tree: &'a Tree,
    rule: Rule,
    meetings: &'a mut Meetings,
    /// Where small cells are left to; `None`: nowhere.
    tasks: Option<&'a mut Vec<Task>>,
}

impl Walk<'_> {
    /// Whether two cells meet by expansions.
    fn apart(&self, a: &Cell, b: &Cell) -> bool {
        let d: [f64; 3] = std::array::from_fn(|axis| a.centre[axis] - b.centre[axis]);
        let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let radii = a.radius + b.radius;
        radii <= self.rule.opening * distance && distance - radii > self.rule.reach
    }

    fn visit(&mut self, number: usize, parent: Option<usize>, candidates: &[u32]) {
        let cell = &self.tree.cells[number];
        if let Some(tasks) = &mut self.tasks
            && (cell.len() <= TASK || cell.is_leaf())
        {
            tasks.push(Task { cell: number, parent, candidates: candidates.to_vec() });
            return;
        }
        let (first_far, first_near) = (self.meetings.far.len(), self.meetings.near.len());
        let (mut open, mut below) = (candidates.to_vec(), Vec::new());
        while let Some(candidate) = open.pop() {
            let other = &self.tree.cells[candidate as usize];
            if self.apart(cell, other) {
                self.meetings.far.push(candidate);
            } else if cell.is_leaf() && other.is_leaf() {
                let places = other.places();
                self.meetings.near.push(places.start as u32..places.end as u32);
            } else if other.is_leaf() || (!cell.is_leaf() && cell.radius >= other.radius) {
                below.push(candidate);
            } else {
                open.extend(other.children().rev().map(|child| child as u32));
            }
        }
        join(&mut self.meetings.near, first_near);
        let meeting = self.meetings.meetings.len();
        let (far, near) = (first_far..self.meetings.far.len(), first_near..self.meetings.near.len());
        self.meetings.meetings.push(Meeting { cell: number, parent, far, near });
        for child in cell.children() {
            self.visit(child, Some(meeting), &below);
        }
    }
}

/// Joins runs from a first one on that follow each other.
fn join(runs: &mut Vec<Range<u32>>, first: usize) {
    runs[first..].sort_unstable_by_key(|run| run.start);
    let mut kept = first;
    for k in first..runs.len() {
        if k > first && runs[kept].end == runs[k].start {
            runs[kept].end = runs[k].end;
        } else {
            kept += usize::from(k > first);
            runs[kept] = runs[k].clone();
        }
    }
    runs.truncate(if runs.len() > first { kept + 1 } else { first });
}
