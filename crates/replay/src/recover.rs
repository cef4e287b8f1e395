//! A valid log of all that is whole in a damaged one.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Seek, Write};

use agglo_core::scene::Compression;
use agglo_record::channels::{CHANNELS, Channel as Known, Topic};
use agglo_record::run;
use mcap::records::{MessageHeader, Metadata};

use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::RawMessage;
use crate::records::Description;

/// Name of the metadata record that a recovered log has beside `run`.
pub const RECORD: &str = "recovered";

/// What was recovered.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recovered {
    /// Messages.
    pub messages: u64,
    /// Recorded states.
    pub frames: u64,
    /// What is lost.
    pub damage: Vec<Damage>,
}

/// A recovery that failed.
#[derive(Debug)]
pub enum RecoverError {
    /// The damaged log could not be read.
    Log(LogError),
    /// Not one message is whole.
    Nothing(Vec<Damage>),
    /// The output refused bytes.
    Write(std::io::Error),
}

impl std::fmt::Display for RecoverError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::Nothing(_) => f.write_str("not one message in it is whole"),
            Self::Write(error) => write!(f, "the recovered log could not be written: {error}"),
        }
    }
}

impl std::error::Error for RecoverError {}

impl From<LogError> for RecoverError {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<mcap::McapError> for RecoverError {
    fn from(error: mcap::McapError) -> Self {
        Self::Write(match error {
            mcap::McapError::Io(error) => error,
            other => std::io::Error::other(other.to_string()),
        })
    }
}

/// Writes all that is whole of a log, chunk by chunk, with a new index. Messages stay as they are; those that make no sense
/// are left out.
///
/// # Errors
/// A log of which nothing can be read, an output that refuses bytes.
pub fn recover<R: Read + Seek, W: Write>(log: &mut Log<R>, out: W) -> Result<Recovered, RecoverError> {
    let mut damage = log.file_damage()?;
    let scene = log.scene().ok();
    let mut attachments = Vec::new();
    for name in [run::SCENE, run::LAYOUT] {
        match log.attachment(name) {
            Ok(Some(data)) => attachments.push((name, data)),
            Ok(None) => {}
            Err(LogError::Damaged(lost)) => damage.push(lost),
            Err(other) => return Err(other.into()),
        }
    }
    // The hash belongs to the scene that is there: a damaged one would make a whole log look damaged.
    let mut header = log.run().clone();
    if let Some((_, scene)) = attachments.iter().find(|(name, _)| *name == run::SCENE) {
        header.scene_hash = run::hash(scene);
    }
    let compression = scene.map_or(Compression::Zstd, |scene| scene.record.compression);
    let options = agglo_record::write_options(compression, &header.build.version);
    let mut writer = mcap::Writer::with_options(mcap::write::NoSeek::new(out), options)?;
    writer.write_metadata(&Metadata { name: run::RECORD.to_owned(), metadata: header.to_map() })?;
    for (name, data) in attachments {
        writer.attach(&mcap::Attachment {
            log_time: 0,
            create_time: 0,
            name: name.to_owned(),
            media_type: "application/json".to_owned(),
            data: data.into(),
        })?;
    }
    let descriptions = log.container.index.as_ref().map(|index| index.descriptions.clone()).unwrap_or_default();
    let add = |writer: &mut _, channel: &Known| add(writer, channel, descriptions.get(channel.name));
    let described: Vec<Topic> = log.channels.values().filter_map(|channel| channel.topic).collect();
    let mut ids = [None; CHANNELS.len()];
    for channel in CHANNELS.iter().filter(|channel| described.contains(&channel.topic)) {
        ids[channel.topic as usize] = Some(add(&mut writer, channel)?);
    }
    let (mut messages, mut frames, mut unknown) = (0, 0, 0_u64);
    let mut chunk = None;
    let mut judged = log.judged()?;
    while let Some(message) = judged.next() {
        let message = match message {
            Ok((message, _)) => message,
            Err(LogError::Damaged(lost)) => {
                damage.push(lost);
                continue;
            }
            Err(other) => return Err(other.into()),
        };
        if chunk.replace(judged.offset()).is_some_and(|before| before != judged.offset()) {
            writer.flush()?;
        }
        let RawMessage { channel, sequence, log_time, publish_time, data } = message;
        let Some(topic) = channel.topic else {
            unknown += 1;
            continue;
        };
        let channel_id = match ids[topic as usize] {
            Some(id) => id,
            None => *ids[topic as usize].insert(add(&mut writer, &CHANNELS[topic as usize])?),
        };
        let header = MessageHeader { channel_id, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, &data)?;
        messages += 1;
        frames += u64::from(topic == Topic::Particles);
    }
    drop(judged);
    if unknown > 0 {
        let what = format!("{unknown} messages on channels that this version does not know are left out");
        damage.push(Damage { offset: 0, what });
    }
    damage.extend(log.damage().iter().cloned());
    damage.sort_by_key(|lost| lost.offset);
    damage.dedup();
    if messages == 0 {
        return Err(RecoverError::Nothing(damage));
    }
    if !damage.is_empty() {
        let lost = damage.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
        let metadata = BTreeMap::from([("lost".to_owned(), lost)]);
        writer.write_metadata(&Metadata { name: RECORD.to_owned(), metadata })?;
    }
    writer.finish()?;
    let mut out = writer.into_inner().into_inner();
    out.flush().map_err(RecoverError::Write)?;
    Ok(Recovered { messages, frames, damage })
}

/// Adds a channel as its log describes it, or where that is lost or ambiguous as this version would.
fn add<W: Write + Seek>(
    writer: &mut mcap::Writer<W>,
    channel: &Known,
    described: Option<&BTreeSet<Description>>,
) -> Result<u16, mcap::McapError> {
    if let Some(only) = described.filter(|all| all.len() == 1).and_then(BTreeSet::first) {
        let Description { schema, text: (encoding, text), encoding: of_messages, metadata } = only;
        let schema = writer.add_schema(schema, encoding, text)?;
        return writer.add_channel(schema, channel.name, of_messages, metadata);
    }
    let schema = writer.add_schema(channel.schema, "protobuf", channel.descriptor)?;
    writer.add_channel(schema, channel.name, "protobuf", &BTreeMap::new())
}
