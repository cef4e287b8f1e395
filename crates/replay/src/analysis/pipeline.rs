//! A pipeline: while one batch is read and decompressed, the one before is decoded and recomputed by all threads that are
//! left, and what came of the one before that is added up.
//!
//! What comes out is in the log's order, and depends neither on the number of threads nor on how the log is cut into
//! batches: every state is recomputed by itself.

use std::io::{Read, Seek};

use agglo_record::channels::Topic;
use rayon::prelude::*;

use super::Failed;
use super::fold::Part;
use super::state::Basis;
use crate::error::{Damage, LogError};
use crate::judge::Judge;
use crate::log::Log;
use crate::messages::{Message, RawMessage, RawMessages, senseless};

/// A batch is closed when its messages have this size together [bytes]: enough work for all threads, and little beside
/// one message of a large cloud.
const BATCH: usize = 1 << 20;

/// Channels that are read; drawings and checkpoints say nothing that states do not.
const TOPICS: [Topic; 6] =
    [Topic::Diagnostics, Topic::Impacts, Topic::Particles, Topic::Energy, Topic::Clusters, Topic::Log];

/// What comes out of the log: a message with the place of its chunk [byte], or what is lost there.
enum Piece {
    Message(RawMessage, u64),
    Lost(Damage),
    /// Something is missing without a trace, or in the wrong place.
    Wrong(Damage),
    Failed(LogError),
}

/// What it came to.
pub enum Outcome {
    /// Time [s], step, and what the message came to.
    Part(f64, u64, Part),
    /// Something is lost.
    Lost(Damage),
    /// Something is missing without a trace, or in the wrong place; it is lost already.
    Wrong(Damage),
    /// The log cannot be read on.
    Failed(LogError),
}

/// Passes everything that a log holds to `take`, in its order; of recorded states each `every`-th only. Returns the
/// number of recorded states.
pub fn run<R: Read + Seek + Send>(
    log: &mut Log<R>,
    basis: &Basis,
    every: u64,
    mut take: impl FnMut(Outcome) -> Result<(), Failed>,
) -> Result<u64, Failed> {
    let size = log.size();
    let judge = match log.judge(&TOPICS) {
        Ok(judge) => judge,
        Err(error) => return take(Outcome::Failed(error)).map(|()| 0),
    };
    let messages = log.raw_messages().only(&TOPICS);
    let mut reader = Reader { messages, judge, size, every, states: 0, ended: false };
    let (mut read, mut recomputed) = (reader.batch(), Vec::new());
    while !(read.is_empty() && recomputed.is_empty() && reader.ended) {
        let (mut next, mut outcomes) = (Vec::new(), Vec::new());
        rayon::in_place_scope(|scope| {
            scope.spawn(|_| next = reader.batch());
            scope.spawn(|_| outcomes = read.into_par_iter().map(|piece| outcome(piece, basis)).collect());
            recomputed.drain(..).flatten().try_for_each(&mut take)
        })?;
        (read, recomputed) = (next, outcomes);
    }
    Ok(reader.states)
}

/// Reads a log a batch at a time.
struct Reader<'a, R> {
    messages: RawMessages<'a, R>,
    judge: Judge,
    /// Of the file [bytes].
    size: u64,
    every: u64,
    /// States so far.
    states: u64,
    ended: bool,
}

impl<R: Read + Seek> Reader<'_, R> {
    /// The next batch; empty at the end.
    fn batch(&mut self) -> Vec<Piece> {
        let (mut batch, mut bytes) = (Vec::new(), 0);
        while bytes < BATCH && batch.len() < BATCH / 64 && !self.ended {
            match self.messages.next() {
                Some(Ok(message)) => {
                    let offset = self.messages.offset();
                    let wanted = self.judge(&message, offset);
                    batch.extend(self.judge.take().into_iter().map(Piece::Wrong));
                    if wanted {
                        bytes += message.data.len();
                        batch.push(Piece::Message(message, offset));
                    }
                }
                Some(Err(LogError::Damaged(damage))) => {
                    self.judge.lose();
                    batch.push(Piece::Lost(damage));
                }
                Some(Err(other)) => batch.push(Piece::Failed(other)),
                None => {
                    self.ended = true;
                    batch.extend(self.judge.finish(self.size).into_iter().map(Piece::Wrong));
                }
            }
        }
        batch
    }

    /// Judges a message, and tells whether it is to be looked into.
    fn judge(&mut self, message: &RawMessage, offset: u64) -> bool {
        self.judge.message(message, offset);
        if message.channel.topic == Some(Topic::Log)
            && let Ok(Some(entry)) = message.decode()
        {
            self.judge.entry(&entry, offset);
        }
        if message.channel.topic != Some(Topic::Particles) {
            return true;
        }
        self.states += 1;
        (self.states - 1).is_multiple_of(self.every)
    }
}

/// Decodes a message, and recomputes what a state says; `None` of what is not asked for.
fn outcome(piece: Piece, basis: &Basis) -> Option<Outcome> {
    let (message, offset) = match piece {
        Piece::Message(message, offset) => (message, offset),
        Piece::Lost(damage) => return Some(Outcome::Lost(damage)),
        Piece::Wrong(damage) => return Some(Outcome::Wrong(damage)),
        Piece::Failed(error) => return Some(Outcome::Failed(error)),
    };
    let entry = match message.decode() {
        Ok(entry) => entry?,
        Err(malformed) => return Some(Outcome::Lost(senseless(offset, &malformed.to_string()))),
    };
    drop(message);
    if let Some(what) = basis.shape.fault(&entry) {
        return Some(Outcome::Lost(Damage { offset, what }));
    }
    let part = match entry.message {
        Message::Particles(frame) => Part::State(Box::new(basis.state(frame))),
        Message::Diagnostics(diagnostics) => Part::Diagnostics(diagnostics),
        Message::Energy(ledger, momentum) => Part::Energy(Box::new((ledger, momentum))),
        Message::Clusters(clusters) => Part::Clusters(clusters),
        Message::Impacts(impacts) => Part::Impacts(impacts),
        Message::Log(notice) => Part::Notice(notice),
        Message::Static(_) | Message::Checkpoint(_) | Message::Scene => return None,
    };
    Some(Outcome::Part(entry.t, entry.step, part))
}
