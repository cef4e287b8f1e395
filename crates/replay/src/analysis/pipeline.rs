//! A pipeline: one thread reads and decompresses, all decode and recompute, one adds up, each a batch ahead of the next.
//!
//! What comes out is in the log's order, and depends neither on the number of threads nor on how the log is cut into
//! batches: every state is recomputed by itself.

use std::io::{Read, Seek};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use agglo_record::channels::Topic;
use rayon::prelude::*;

use super::Failed;
use super::fold::Part;
use super::state::Basis;
use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::{Message, RawMessage, senseless};

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
    std::thread::scope(|scope| {
        // Rendezvous: while one batch is worked on the next is read, and no more than that is held.
        let (read_sender, read_receiver) = sync_channel(0);
        let (sender, receiver) = sync_channel(0);
        let reader = scope.spawn(move || read(log, every, &read_sender));
        scope.spawn(move || recompute(&read_receiver, basis, &sender));
        let mut outcomes = receiver.iter().flatten().flatten();
        let result = outcomes.try_for_each(&mut take);
        // The others stop when nobody listens.
        drop(receiver);
        let states = reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        result.map(|()| states)
    })
}

fn read<R: Read + Seek>(log: &mut Log<R>, every: u64, sender: &SyncSender<Vec<Piece>>) -> u64 {
    let (mut batch, mut bytes, mut states) = (Vec::new(), 0, 0);
    let size = log.size();
    let mut judge = match log.judge(&TOPICS) {
        Ok(judge) => judge,
        Err(error) => {
            _ = sender.send(vec![Piece::Failed(error)]);
            return states;
        }
    };
    let mut messages = log.raw_messages().only(&TOPICS);
    while let Some(message) = messages.next() {
        let piece = match message {
            Ok(message) => {
                judge.message(&message, messages.offset());
                if message.channel.topic == Some(Topic::Log)
                    && let Ok(Some(entry)) = message.decode()
                {
                    judge.entry(&entry, messages.offset());
                }
                batch.extend(judge.take().into_iter().map(Piece::Wrong));
                if message.channel.topic == Some(Topic::Particles) {
                    states += 1;
                    if !(states - 1_u64).is_multiple_of(every) {
                        continue;
                    }
                }
                bytes += message.data.len();
                Piece::Message(message, messages.offset())
            }
            Err(LogError::Damaged(damage)) => {
                judge.lose();
                Piece::Lost(damage)
            }
            Err(other) => Piece::Failed(other),
        };
        batch.push(piece);
        if bytes >= BATCH || batch.len() >= BATCH / 64 {
            bytes = 0;
            if sender.send(std::mem::take(&mut batch)).is_err() {
                return states;
            }
        }
    }
    batch.extend(judge.finish(size).into_iter().map(Piece::Wrong));
    // Nobody listening is for the other side to explain.
    _ = sender.send(batch);
    states
}

fn recompute(receiver: &Receiver<Vec<Piece>>, basis: &Basis, sender: &SyncSender<Vec<Option<Outcome>>>) {
    for batch in receiver {
        if sender.send(batch.into_par_iter().map(|piece| outcome(piece, basis)).collect()).is_err() {
            return;
        }
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
