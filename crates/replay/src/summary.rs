//! The index at the end of a log: believed only if its checksum holds.

use std::io::{Read, Seek, SeekFrom};

use std::collections::{BTreeMap, BTreeSet};

use mcap::records::op;

use crate::container::{ChunkRef, Fault};
use crate::records::{self, Description, Fields};

/// Footer record and end mark: opcode, length, start of the summary, start of its offsets, checksum, magic.
const TAIL: u64 = 1 + 8 + 8 + 8 + 4 + 8;

/// An index may be this long whatever the size of its log [bytes].
const LONGEST: u64 = 16 * 1024 * 1024;

/// The index of a log.
pub struct Index {
    /// Where it begins [byte]; the data end just before.
    pub start: u64,
    /// All chunks, in the order of the file.
    pub chunks: Vec<ChunkRef>,
    /// Topic and name of the schema of every channel, by its number.
    pub channels: BTreeMap<u16, (String, String)>,
    /// How the messages of every topic are to be read: one way each, but for logs that other programs put together.
    pub descriptions: BTreeMap<String, BTreeSet<Description>>,
    /// Messages of every channel.
    pub counts: BTreeMap<u16, u64>,
    /// Where metadata records and attachments begin.
    pub others: Vec<u64>,
}

/// Reads the index of a file of `size` bytes, after verifying its checksum.
///
/// # Errors
/// [`Fault::Lost`] with a sentence where it is missing, cut off or damaged.
pub fn read<R: Read + Seek>(reader: &mut R, size: u64) -> Result<Index, Fault> {
    let lost = |what: &str| Fault::Lost(what.to_owned());
    let magic = mcap::MAGIC.len() as u64;
    let tail_start = size.checked_sub(TAIL).filter(|start| *start >= magic).ok_or_else(|| lost("it ends too early"))?;
    let mut tail = [0; TAIL as usize];
    reader.seek(SeekFrom::Start(tail_start))?;
    reader.read_exact(&mut tail)?;
    if tail[TAIL as usize - mcap::MAGIC.len()..] != *mcap::MAGIC {
        return Err(lost("the end mark is missing"));
    }
    let word = |at: usize| u64::from_le_bytes(std::array::from_fn(|k| tail[at + k]));
    let (opcode, length, start) = (tail[0], word(1), word(9));
    let stored = u32::from_le_bytes(std::array::from_fn(|k| tail[25 + k]));
    if opcode != mcap::records::op::FOOTER || length != 20 {
        return Err(lost("the footer is damaged"));
    }
    if start == 0 {
        return Err(lost("there is none"));
    }
    if start < magic || start > tail_start {
        return Err(lost("the footer points outside the file"));
    }
    // A chunk has an entry of some hundred bytes and stands for thousands.
    if tail_start - start > LONGEST.max(size / 64) {
        return Err(lost("it is too long"));
    }
    // The checksum covers the summary and the footer up to the checksum itself.
    // Zero stands for a checksum that was not taken.
    if stored != 0 && checksum(reader, start, tail_start + 25)? != stored {
        return Err(lost("its checksum does not hold"));
    }
    let mut bytes = vec![0; usize::try_from(tail_start - start).map_err(|_| lost("it is too long"))?];
    reader.seek(SeekFrom::Start(start))?;
    reader.read_exact(&mut bytes)?;
    parse(start, &bytes).ok_or_else(|| lost("a record in it makes no sense"))
}

fn parse(start: u64, bytes: &[u8]) -> Option<Index> {
    let (mut chunks, mut others, mut counts) = (Vec::new(), Vec::new(), BTreeMap::new());
    let (mut schemas, mut channels) = (BTreeMap::new(), BTreeMap::new());
    let mut fields = Fields(bytes);
    while !fields.0.is_empty() {
        let opcode = *fields.bytes(1)?.first()?;
        let length = fields.u64()?;
        let body = fields.bytes(length)?;
        let mut record = Fields(body);
        match opcode {
            op::SCHEMA => {
                let (id, schema) = records::schema(body)?;
                schemas.insert(id, schema);
            }
            op::CHANNEL => {
                let (id, schema, topic) = records::channel(body)?;
                channels.insert(id, (topic.to_owned(), schema, records::encoding(body)?));
            }
            op::CHUNK_INDEX => {
                let (start, _end) = (record.u64()?, record.u64()?);
                chunks.push(ChunkRef { offset: record.u64()?, length: record.u64()?, start });
            }
            op::ATTACHMENT_INDEX | op::METADATA_INDEX => others.push(record.u64()?),
            op::STATISTICS => {
                // Messages, schemas, channels, attachments, metadata, chunks, first and last time.
                record.bytes(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8)?;
                let length = record.u32()?;
                let mut map = Fields(record.bytes(length.into())?);
                while !map.0.is_empty() {
                    counts.insert(map.u16()?, map.u64()?);
                }
            }
            _ => {}
        }
    }
    chunks.sort_by_key(|chunk: &ChunkRef| chunk.offset);
    // Chunks that overlap, or stand there twice, would be read over and over.
    if chunks.windows(2).any(|pair| pair[0].offset.saturating_add(pair[0].length) > pair[1].offset) {
        return None;
    }
    let mut index = Index { start, chunks, channels: BTreeMap::new(), descriptions: BTreeMap::new(), counts, others };
    for (id, (topic, schema, (encoding, metadata))) in channels {
        let schema = schemas.get(&schema).cloned().unwrap_or_default();
        index.channels.insert(id, (topic.clone(), schema.schema.clone()));
        index.descriptions.entry(topic).or_default().insert(Description { encoding, metadata, ..schema });
    }
    Some(index)
}

/// CRC-32 of the bytes from `start` to `end`.
pub fn checksum<R: Read + Seek>(reader: &mut R, start: u64, end: u64) -> Result<u32, std::io::Error> {
    let mut hasher = crc32fast::Hasher::new();
    let mut buffer = vec![0; 64 * 1024];
    let mut left = end.saturating_sub(start);
    reader.seek(SeekFrom::Start(start))?;
    while left > 0 {
        let wanted = left.min(buffer.len() as u64) as usize;
        reader.read_exact(&mut buffer[..wanted])?;
        hasher.update(&buffer[..wanted]);
        left -= wanted as u64;
    }
    Ok(hasher.finalize())
}
