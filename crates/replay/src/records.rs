//! The records of an MCAP file, taken apart with every length checked against the bytes that are there.

use std::collections::BTreeMap;

/// Reads little-endian values from the front of some bytes; `None` where they end too early.
#[derive(Clone, Copy, Debug)]
pub struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn bytes(&mut self, length: u64) -> Option<&'a [u8]> {
        let (first, rest) = self.0.split_at_checked(usize::try_from(length).ok()?)?;
        self.0 = rest;
        Some(first)
    }

    pub fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.bytes(length.into())?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()?;
        let mut inner = Fields(self.bytes(length.into())?);
        let mut map = BTreeMap::new();
        while !inner.0.is_empty() {
            let (key, value) = (inner.text()?, inner.text()?);
            map.insert(key.to_owned(), value.to_owned());
        }
        Some(map)
    }
}

/// Name and entries of a metadata record.
pub fn metadata(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut fields = Fields(body);
    let name = fields.text()?.to_owned();
    let map = fields.map()?;
    fields.0.is_empty().then_some((name, map))
}

/// An attachment.
pub struct Attachment<'a> {
    pub data: &'a [u8],
    /// Whether its checksum holds; zero stands for one that was not taken.
    pub intact: bool,
}

/// Length of what stands before the content of an attachment, at most [bytes]: names and media types of ours are short.
pub const ATTACHMENT_HEAD: u64 = 8 + 8 + 4 + 4096 + 4 + 4096 + 8;

/// The name of an attachment whose record of `length` bytes begins with `body`; the rest must be its content.
pub fn attachment_name(body: &[u8], length: u64) -> Option<&str> {
    let mut fields = Fields(body);
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let (name, _media_type) = (fields.text()?, fields.text()?);
    let content = fields.u64()?;
    let head = (body.len() - fields.0.len()) as u64;
    (head.checked_add(content)?.checked_add(4)? == length).then_some(name)
}

/// Takes an attachment apart.
pub fn attachment(body: &[u8]) -> Option<Attachment<'_>> {
    let mut fields = Fields(body);
    let (_log_time, _create_time) = (fields.u64()?, fields.u64()?);
    let (_name, _media_type) = (fields.text()?, fields.text()?);
    let length = fields.u64()?;
    let data = fields.bytes(length)?;
    let covered = body.len() - fields.0.len();
    let stored = fields.u32()?;
    let intact = stored == 0 || crc32fast::hash(body.get(..covered)?) == stored;
    fields.0.is_empty().then_some(Attachment { data, intact })
}

/// Number and topic of a channel record, and the number of its schema.
pub fn channel(body: &[u8]) -> Option<(u16, u16, &str)> {
    let mut fields = Fields(body);
    let (id, schema) = (fields.u16()?, fields.u16()?);
    Some((id, schema, fields.text()?))
}

/// How a channel's messages are to be read.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Description {
    /// Name of the schema; empty where there is none.
    pub schema: String,
    /// Encoding and text of the schema.
    pub text: (String, Vec<u8>),
    /// Encoding of the messages.
    pub encoding: String,
    /// What else is said of the channel.
    pub metadata: BTreeMap<String, String>,
}

/// Number of a schema record, and of a description what it says.
pub fn schema(body: &[u8]) -> Option<(u16, Description)> {
    let mut fields = Fields(body);
    let (id, schema, encoding) = (fields.u16()?, fields.text()?.to_owned(), fields.text()?.to_owned());
    let length = fields.u32()?;
    let data = fields.bytes(length.into())?;
    let text = (encoding, data.to_vec());
    Some((id, Description { schema, text, ..Description::default() }))
}

/// Encoding of messages and what else a channel record says.
pub fn encoding(body: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut fields = Fields(body);
    let (_id, _schema, _topic) = (fields.u16()?, fields.u16()?, fields.text()?);
    Some((fields.text()?.to_owned(), fields.map()?))
}

/// What stands before the records of a chunk.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChunkHead {
    /// Log time of its first message [ns].
    pub start: u64,
    /// Size of its records [bytes].
    pub uncompressed_size: u64,
    /// Checksum of its records; zero: not taken.
    pub crc: u32,
    /// `zstd`, `lz4` or nothing.
    pub compression: String,
    /// Where the compressed records begin in the record's body.
    pub records: usize,
}

/// Takes the head of a chunk apart; the rest of its body must be its records. `None` where that cannot be a chunk.
pub fn chunk(body: &[u8], length: u64) -> Option<ChunkHead> {
    let mut fields = Fields(body);
    let (start, end) = (fields.u64()?, fields.u64()?);
    let (uncompressed_size, crc) = (fields.u64()?, fields.u32()?);
    let compression = fields.text()?.to_owned();
    let size = fields.u64()?;
    let records = body.len() - fields.0.len();
    let known = matches!(compression.as_str(), "" | "zstd" | "lz4");
    let whole = size == length.checked_sub(records as u64)?;
    (known && whole && start <= end).then_some(ChunkHead { start, uncompressed_size, crc, compression, records })
}

/// Length of the longest head of a chunk [bytes].
pub const CHUNK_HEAD: usize = 8 + 8 + 8 + 4 + (4 + 4) + 8;
