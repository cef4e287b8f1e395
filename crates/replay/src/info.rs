//! What is in a log: from its index, or by reading all of it.

use std::io::{Read, Seek};

use agglo_record::channels::CHANNELS;
use agglo_record::run::RunInfo;

use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::Entry;

/// A channel of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChannelInfo {
    /// Its name.
    pub name: String,
    /// Full name of its message; empty where the log does not say.
    pub schema: String,
    /// Messages on it; of a damaged log those that are whole.
    pub messages: u64,
}

/// What is in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Info {
    /// Which scene, build and model the log comes from.
    pub run: RunInfo,
    /// Size of the file [bytes].
    pub size: u64,
    /// Channels, by name.
    pub channels: Vec<ChannelInfo>,
    /// Chunks, of a damaged log those that are found.
    pub chunks: u64,
    /// Attachments: name and size of the record [bytes].
    pub attachments: Vec<(String, u64)>,
    /// Time of the first message [s]; `None` in a log without any.
    pub start: Option<f64>,
    /// Time of the last step [s]; `None` in a log without any message.
    pub end: Option<f64>,
    /// Number of the last step.
    pub steps: u64,
    /// Recorded states.
    pub frames: u64,
    /// What is lost, as far as known; see [`Checked`] for all of it.
    pub damage: Vec<Damage>,
}

impl Info {
    /// Whether nothing is known to be lost.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.damage.is_empty()
    }
}

/// What a full reading found.
#[derive(Clone, Debug, PartialEq)]
pub struct Checked {
    /// What is in the log, counted.
    pub info: Info,
    /// Messages that were read.
    pub messages: u64,
}

/// Counts while messages go by.
#[derive(Default)]
struct Count {
    messages: [u64; CHANNELS.len()],
    start: Option<f64>,
    end: Option<f64>,
    steps: u64,
}

impl Count {
    fn see(&mut self, entry: &Entry) {
        let Entry { t, step, message } = entry;
        self.messages[message.topic() as usize] += 1;
        self.start.get_or_insert(*t);
        self.end = Some(*t);
        self.steps = self.steps.max(*step);
    }
}

impl<R: Read + Seek> Log<R> {
    /// What is in the log: from its index and its first and last chunk, or, where the index is lost, by reading all.
    ///
    /// # Errors
    /// A device that fails. Damage is part of the answer.
    pub fn info(&mut self) -> Result<Info, LogError> {
        let Some(index) = &self.container.index else {
            return self.check().map(|checked| checked.info);
        };
        let mut channels: Vec<ChannelInfo> = index
            .channels
            .iter()
            .map(|(id, (name, schema))| ChannelInfo {
                name: name.clone(),
                schema: schema.clone(),
                messages: index.counts.get(id).copied().unwrap_or(0),
            })
            .collect();
        channels.sort_by(|a, b| a.name.cmp(&b.name));
        let chunks = self.container.chunks.len();
        let mut ends = Count::default();
        let mut damage = self.damage().to_vec();
        let last = chunks.saturating_sub(1).max(1)..chunks;
        for part in [0..chunks.min(1), last] {
            for entry in self.part(part) {
                match entry {
                    Ok(entry) => ends.see(&entry),
                    Err(LogError::Damaged(found)) => damage.push(found),
                    Err(other) => return Err(other),
                }
            }
        }
        Ok(self.assemble(channels, &ends, damage))
    }

    /// Reads the whole log, verifies every checksum, judges every message, and counts.
    ///
    /// # Errors
    /// A device that fails. Damage is part of the answer.
    pub fn check(&mut self) -> Result<Checked, LogError> {
        let mut damage = self.file_damage()?;
        let mut count = Count::default();
        for message in self.judged()? {
            match message {
                Ok((_, entry)) => entry.iter().for_each(|entry| count.see(entry)),
                Err(LogError::Damaged(found)) => damage.push(found),
                Err(other) => return Err(other),
            }
        }
        let described: Vec<_> = self.channels.values().filter_map(|channel| channel.topic).collect();
        let mut channels: Vec<ChannelInfo> = CHANNELS
            .iter()
            .zip(count.messages)
            .filter(|(channel, messages)| *messages > 0 || described.contains(&channel.topic))
            .map(|(channel, messages)| ChannelInfo {
                name: channel.name.to_owned(),
                schema: channel.schema.to_owned(),
                messages,
            })
            .collect();
        channels.sort_by(|a, b| a.name.cmp(&b.name));
        damage.sort_by_key(|found| found.offset);
        damage.dedup();
        let messages = count.messages.iter().sum();
        Ok(Checked { info: self.assemble(channels, &count, damage), messages })
    }

    fn assemble(&self, channels: Vec<ChannelInfo>, count: &Count, damage: Vec<Damage>) -> Info {
        let frames = channels.iter().find(|channel| channel.name == "/particles").map_or(0, |found| found.messages);
        Info {
            run: self.run().clone(),
            size: self.size(),
            chunks: self.container.chunks.len() as u64,
            attachments: self.container.attachments.iter().map(|found| (found.name.clone(), found.length)).collect(),
            start: count.start,
            end: count.end,
            steps: count.steps,
            frames,
            channels,
            damage,
        }
    }
}
