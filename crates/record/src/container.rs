//! The MCAP file being written.

use std::collections::BTreeMap;
use std::io::Write;

use agglo_core::scene::{Compression, Scene};
use mcap::records::MessageHeader;

use crate::channels::{CHANNELS, Effects, Topic, present};
use crate::encoder::Encoded;
use crate::error::RecordError;
use crate::layout::layout;
use crate::recorder::Tap;
use crate::run::{self, RunInfo};
use crate::sink::Sink;

/// Level of zstd: a second level costs twice the time and saves less than 1 % on mantissas.
const ZSTD_LEVEL: u32 = 1;

/// What has gone into a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Totals {
    /// Messages on all channels.
    pub messages: u64,
    /// Recorded states.
    pub frames: u64,
}

/// The file, its channels, and who sees what goes in.
pub struct Container<W: Write> {
    writer: mcap::Writer<Sink<W>>,
    ids: [Option<u16>; CHANNELS.len()],
    counts: [u32; CHANNELS.len()],
    messages: u64,
    pub tap: Option<Tap>,
}

impl<W: Write> Container<W> {
    /// Starts a file: metadata, the scene as resolved, the viewer layout, schemas and channels that the scene has.
    pub fn create(
        sink: Sink<W>,
        scene: &Scene,
        scene_json: &str,
        effects: &Effects,
        run: &RunInfo,
    ) -> Result<Self, RecordError> {
        let options = write_options(scene.record.compression, &run.build.version);
        let mut writer = mcap::Writer::with_options(sink, options)?;
        writer.write_metadata(&mcap::records::Metadata { name: run::RECORD.to_owned(), metadata: run.to_map() })?;
        for (name, text) in [(run::SCENE, scene_json), (run::LAYOUT, &layout(scene))] {
            writer.attach(&mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.to_owned(),
                media_type: "application/json".to_owned(),
                data: text.as_bytes().into(),
            })?;
        }
        let mut ids = [None; CHANNELS.len()];
        for channel in present(effects) {
            let schema = writer.add_schema(channel.schema, "protobuf", channel.descriptor)?;
            ids[channel.topic as usize] =
                Some(writer.add_channel(schema, channel.name, "protobuf", &BTreeMap::new())?);
        }
        Ok(Self { writer, ids, counts: [0; CHANNELS.len()], messages: 0, tap: None })
    }

    /// Writes a message into the current chunk.
    pub fn send(&mut self, message: Encoded<'_>) -> Result<(), RecordError> {
        let Encoded { topic, log_time, data } = message;
        let Some(channel_id) = self.ids[topic as usize] else {
            let name = CHANNELS[topic as usize].name;
            return Err(RecordError::Mismatch(format!("a message for {name}, which this scene does not have")));
        };
        let count = &mut self.counts[topic as usize];
        let header = MessageHeader { channel_id, sequence: *count, log_time, publish_time: log_time };
        *count = count.wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)?;
        self.messages += 1;
        if let Some(tap) = &mut self.tap {
            tap(message);
        }
        Ok(())
    }

    /// Closes the current chunk and hands it to the output.
    pub fn flush(&mut self) -> Result<(), RecordError> {
        Ok(self.writer.flush()?)
    }

    /// Completes the file: the last chunk, the index, the end mark.
    pub fn finish(&mut self) -> Result<Totals, RecordError> {
        self.writer.finish()?;
        Ok(Totals { messages: self.messages, frames: self.counts[Topic::Particles as usize].into() })
    }
}

/// Options that make the same bytes of the same messages: no threads, no clock, and chunks that are closed by us.
/// `version` is that of agglo.
#[must_use]
pub fn write_options(compression: Compression, version: &str) -> mcap::WriteOptions {
    let (compression, level) = match compression {
        Compression::Zstd => (Some(mcap::Compression::Zstd), ZSTD_LEVEL),
        Compression::Lz4 => (Some(mcap::Compression::Lz4), 0),
        Compression::None => (None, 0),
    };
    mcap::WriteOptions::new()
        .compression(compression)
        .compression_level(level)
        .compression_threads(0)
        .chunk_size(None)
        .disable_seeking(true)
        .library(format!("agglo {version}"))
}
