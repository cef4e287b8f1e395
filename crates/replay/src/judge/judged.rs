//! The messages of a log, decoded, and what is wrong with them in its place.

use std::collections::VecDeque;
use std::io::{Read, Seek};

use agglo_record::channels::Topic;

use super::{ALL, Judge};
use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::{Entry, RawMessage, RawMessages, senseless};

/// Iterates over the messages of a log, decoded; of channels that this version does not know, as they stand there. What
/// is lost, and what [`Judge`] finds, comes up as [`LogError::Damaged`]; messages that make no sense are left out.
pub struct Judged<'a, R> {
    raw: RawMessages<'a, R>,
    judge: Judge,
    size: u64,
    over: bool,
    waiting: VecDeque<Damage>,
}

impl<R: Read + Seek> Log<R> {
    /// All messages, judged.
    ///
    /// # Errors
    /// A device that fails.
    pub(crate) fn judged(&mut self) -> Result<Judged<'_, R>, LogError> {
        let (judge, size) = (self.judge(&ALL)?, self.size());
        Ok(Judged { raw: self.raw_messages(), judge, size, over: false, waiting: VecDeque::new() })
    }

    /// The messages of some channels, judged as far as these tell.
    ///
    /// # Errors
    /// A device that fails.
    pub(crate) fn judged_only(&mut self, topics: &[Topic]) -> Result<Judged<'_, R>, LogError> {
        let (judge, size) = (self.judge(topics)?, self.size());
        Ok(Judged { raw: self.raw_messages().only(topics), judge, size, over: false, waiting: VecDeque::new() })
    }
}

impl<R: Read + Seek> Judged<'_, R> {
    /// Whether nothing is wrong so far.
    pub fn is_content(&self) -> bool {
        self.waiting.is_empty() && self.judge.is_content()
    }

    /// What is wrong so far and has not come up.
    pub fn stop(self) -> Vec<Damage> {
        self.waiting.into_iter().chain(self.judge.stop()).collect()
    }

    /// As [`Judge::lost`].
    pub fn lost(&self) -> Option<(f64, f64)> {
        self.judge.lost()
    }

    /// Where the chunk that is being read begins [byte].
    pub fn offset(&self) -> u64 {
        self.raw.offset()
    }

    /// Judges a message; `None` where it makes no sense.
    fn examine(&mut self, message: RawMessage) -> Option<(RawMessage, Option<Entry>)> {
        let offset = self.raw.offset();
        let judge = &mut self.judge;
        judge.message(&message, offset);
        let entry = match message.decode() {
            Ok(None) => return Some((message, None)),
            Ok(Some(entry)) => entry,
            Err(malformed) => {
                judge.lose();
                judge.fault(offset, || senseless(offset, &malformed.to_string()).what);
                return None;
            }
        };
        judge.entry(&entry, offset).then_some((message, Some(entry)))
    }
}

impl<R: Read + Seek> Iterator for Judged<'_, R> {
    /// A message as it stands in the log, and what it says.
    type Item = Result<(RawMessage, Option<Entry>), LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            if let Some(damage) = self.waiting.pop_front() {
                return Some(Err(LogError::Damaged(damage)));
            }
            if self.over {
                return None;
            }
            match self.raw.next() {
                Some(Ok(message)) => {
                    let examined = self.examine(message);
                    self.waiting.extend(self.judge.take());
                    if examined.is_some() {
                        return examined.map(Ok);
                    }
                }
                Some(Err(LogError::Damaged(damage))) => {
                    self.judge.lose();
                    self.waiting.push_back(damage);
                }
                Some(Err(other)) => {
                    self.over = true;
                    return Some(Err(other));
                }
                None => {
                    self.over = true;
                    self.waiting.extend(self.judge.finish(self.size));
                }
            }
        }
    }
}
