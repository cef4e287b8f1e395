//! Two logs, step by step.

use std::io::{Read, Seek};
use std::sync::Arc;

use agglo_record::channels::Topic;

use crate::error::{Damage, LogError};
use crate::messages::{Message, RawMessage, RawMessages};

/// Messages that a step may have: one on each channel, and what it has to say.
const MOST: usize = 1000;

/// The messages of one step as they stand in a log.
#[derive(Clone, Debug, Default)]
pub struct RawStep {
    /// Time [s].
    pub t: f64,
    /// Number of the step.
    pub step: u64,
    /// Its messages, in their order.
    pub messages: Vec<RawMessage>,
}

impl RawStep {
    /// The decoded message of a channel; `None` where the step has none, or one that makes no sense.
    pub fn get(&self, topic: Topic) -> Option<Message> {
        let found = self.messages.iter().find(|message| message.channel.topic == Some(topic))?;
        Some(found.decode().ok()??.message)
    }
}

/// The steps of a log.
pub struct RawSteps<'a, R> {
    messages: RawMessages<'a, R>,
    next: Option<RawMessage>,
    /// What is lost.
    pub damage: Vec<Damage>,
    /// Whether something was lost between the last step that was given out and the one before.
    pub gap: bool,
    pending_gap: bool,
    last: Option<u64>,
    /// The first step that stands behind a later one: time [s], number, and the channel of its first message.
    pub unordered: Option<((f64, u64), Arc<str>)>,
}

impl<'a, R: Read + Seek> RawSteps<'a, R> {
    pub fn new(messages: RawMessages<'a, R>) -> Self {
        let (next, damage) = (None, Vec::new());
        Self { messages, next, damage, gap: false, pending_gap: false, last: None, unordered: None }
    }

    fn message(&mut self) -> Result<Option<RawMessage>, LogError> {
        if let Some(message) = self.next.take() {
            return Ok(Some(message));
        }
        loop {
            match self.messages.next() {
                Some(Ok(message)) => return Ok(Some(message)),
                Some(Err(LogError::Damaged(lost))) => {
                    self.damage.push(lost);
                    self.pending_gap = true;
                }
                Some(Err(other)) => return Err(other),
                None => return Ok(None),
            }
        }
    }

    /// The next step. A message whose step cannot be read, as of channels that this version does not know, belongs to
    /// the step before.
    pub fn step(&mut self) -> Result<Option<RawStep>, LogError> {
        let Some(first) = self.message()? else {
            self.gap = std::mem::take(&mut self.pending_gap);
            return Ok(None);
        };
        self.gap = std::mem::take(&mut self.pending_gap);
        let (t, step) = first.key().unwrap_or((0.0, self.last.unwrap_or(0)));
        if self.last.is_some_and(|last| step <= last) {
            self.unordered.get_or_insert(((t, step), Arc::clone(&first.channel.name)));
        }
        self.last = Some(step);
        let mut left = self.messages.largest_chunk().saturating_sub(first.data.len());
        let mut found = RawStep { t, step, messages: vec![first] };
        let mut too_many = false;
        while let Some(message) = self.message()? {
            if self.pending_gap || message.key().is_some_and(|(_, of)| of != step) {
                self.next = Some(message);
                break;
            }
            match left.checked_sub(message.data.len()).filter(|_| found.messages.len() < MOST) {
                Some(rest) if !too_many => {
                    left = rest;
                    found.messages.push(message);
                }
                _ if !too_many => {
                    too_many = true;
                    let what =
                        format!("step {step} has more messages than a step can have: those from here on are lost");
                    self.damage.push(Damage { offset: self.messages.offset(), what });
                }
                _ => {}
            }
        }
        Ok(Some(found))
    }
}
