//! The messages of a log, gathered by step.

use std::io::{Read, Seek};

use agglo_core::diagnostics::{Notice, StepDiagnostics};
use agglo_core::impact::Impact;
use agglo_core::ledger::Ledger;
use agglo_core::observer::Clusters;
use agglo_record::cloud::Frame;

use crate::error::LogError;
use crate::messages::{Entry, Message, Messages};

/// What a log says about one step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StepRecord {
    /// Time at the step's end [s].
    pub t: f64,
    /// Number of the step; 0 is the start.
    pub step: u64,
    /// Iterations and step control; `None` at the start.
    pub diagnostics: Option<StepDiagnostics>,
    /// Impacts.
    pub impacts: Vec<Impact>,
    /// The state, on recorded steps.
    pub frame: Option<Frame>,
    /// Energies, on recorded steps.
    pub ledger: Option<Ledger>,
    /// Cluster counts, on recorded steps of scenes that have clusters.
    pub clusters: Option<Clusters>,
    /// Messages for people.
    pub notices: Vec<Notice>,
    /// Whether a run can go on from here.
    pub checkpoint: bool,
}

impl StepRecord {
    fn take(&mut self, entry: Entry) {
        let Entry { t, step, message } = entry;
        (self.t, self.step) = (t, step);
        match message {
            Message::Static(_) | Message::Scene => {}
            Message::Particles(frame) => self.frame = Some(frame),
            Message::Diagnostics(diagnostics) => self.diagnostics = Some(diagnostics),
            Message::Energy(ledger, _) => self.ledger = Some(ledger),
            Message::Clusters(clusters) => self.clusters = Some(clusters),
            Message::Impacts(impacts) => self.impacts = impacts,
            Message::Checkpoint(_) => self.checkpoint = true,
            Message::Log(notice) => self.notices.push(notice),
        }
    }
}

/// Iterates over the steps of a log. Damage comes up in its place, as in [`Messages`]; steps are never split by it,
/// because they are written whole.
pub struct Steps<'a, R> {
    messages: Messages<'a, R>,
    /// The first message of the step after the one that was given out last.
    next: Option<Result<Entry, LogError>>,
}

impl<'a, R: Read + Seek> Steps<'a, R> {
    pub(crate) fn new(messages: Messages<'a, R>) -> Self {
        Self { messages, next: None }
    }
}

impl<R: Read + Seek> Iterator for Steps<'_, R> {
    type Item = Result<StepRecord, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        let first = match self.next.take().or_else(|| self.messages.next())? {
            Ok(entry) => entry,
            Err(error) => return Some(Err(error)),
        };
        let number = first.step;
        let mut step = StepRecord::default();
        step.take(first);
        loop {
            match self.messages.next() {
                Some(Ok(entry)) if entry.step == number => step.take(entry),
                other => {
                    self.next = other;
                    return Some(Ok(step));
                }
            }
        }
    }
}
