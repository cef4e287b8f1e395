//! The file below the messages: records, chunks and attachments, read piece by piece and never beyond the file's size.

use std::collections::BTreeMap;
use std::io::{Read, Seek, SeekFrom};

use mcap::records::{Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use crate::error::{Damage, LogError};
use crate::summary::{self, Index};

/// Opcode and length of a record [bytes].
const RECORD_HEAD: u64 = 1 + 8;

/// A chunk may claim this much uncompressed data whatever its size in the file [bytes]: chunks are closed near 1 MiB.
const SMALL_CHUNK: u64 = 64 * 1024 * 1024;

/// Larger chunks hold a single step of very many particles, whose mantissas do not compress by such a factor. A claim
/// beyond it is damage, and is not given memory.
const LARGEST_RATIO: u64 = 64;

/// A part that cannot be read: lost, or the device fails.
pub enum Fault {
    Lost(String),
    Io(std::io::Error),
}

impl From<std::io::Error> for Fault {
    fn from(error: std::io::Error) -> Self {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            Self::Lost("the file ends too early".to_owned())
        } else {
            Self::Io(error)
        }
    }
}

impl Fault {
    /// The fault as an error about a part that begins at `offset`.
    pub fn at(self, offset: u64, part: &str) -> LogError {
        match self {
            Self::Lost(why) => LogError::Damaged(Damage { offset, what: format!("{part}: {why}") }),
            Self::Io(error) => LogError::Io(error),
        }
    }
}

/// A chunk in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkRef {
    /// Where its record begins [byte].
    pub offset: u64,
    /// Length of its record, head included [bytes].
    pub length: u64,
    /// Log time of its first message [ns].
    pub start: u64,
}

/// An attachment in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachmentRef {
    pub name: String,
    pub offset: u64,
    pub length: u64,
}

/// An MCAP file, its parts located.
pub struct Container<R> {
    reader: R,
    pub size: u64,
    /// Metadata records by name.
    pub metadata: BTreeMap<String, BTreeMap<String, String>>,
    pub attachments: Vec<AttachmentRef>,
    pub chunks: Vec<ChunkRef>,
    /// The index at the end, where it is whole.
    pub index: Option<Index>,
    /// What is known to be lost.
    pub damage: Vec<Damage>,
    /// Offsets of metadata records and attachments that have been seen.
    noted: Vec<u64>,
}

impl<R: Read + Seek> Container<R> {
    /// Locates the parts of a file.
    ///
    /// # Errors
    /// A device that fails, a file that is no MCAP file. Damage is no error here: see [`Container::damage`].
    pub fn open(mut reader: R) -> Result<Self, LogError> {
        let size = reader.seek(SeekFrom::End(0))?;
        check_magic(&mut reader, size)?;
        let mut container = Self {
            reader,
            size,
            metadata: BTreeMap::new(),
            attachments: Vec::new(),
            chunks: Vec::new(),
            index: None,
            damage: Vec::new(),
            noted: Vec::new(),
        };
        let data = container.prologue()?;
        match summary::read(&mut container.reader, size) {
            Ok(index) => container.follow(index)?,
            Err(Fault::Io(error)) => return Err(error.into()),
            Err(Fault::Lost(why)) => {
                let lost = container.scan(data)?;
                container.damage.push(lost.unwrap_or(Damage {
                    offset: size,
                    what: format!("the index at the end cannot be read: {why}; all data before it are there"),
                }));
            }
        }
        Ok(container)
    }

    /// Reads what stands before the first chunk, and returns where that is.
    fn prologue(&mut self) -> Result<u64, LogError> {
        let mut offset = mcap::MAGIC.len() as u64;
        while let Some((opcode, length)) = self.head(offset)? {
            if !matches!(opcode, op::HEADER | op::METADATA | op::ATTACHMENT) {
                break;
            }
            self.note(opcode, offset, length)?;
            offset += RECORD_HEAD + length;
        }
        Ok(offset)
    }

    /// Takes the places of all parts from the index at the end.
    fn follow(&mut self, index: Index) -> Result<(), LogError> {
        let place = |chunk: &mcap::records::ChunkIndex| ChunkRef {
            offset: chunk.chunk_start_offset,
            length: chunk.chunk_length,
            start: chunk.message_start_time,
        };
        self.chunks = index.summary.chunk_indexes.iter().map(place).collect();
        self.chunks.sort_by_key(|chunk| chunk.offset);
        // Our own logs have all of these before the first chunk; others that were mended may not.
        for offset in index.summary.metadata_indexes.iter().map(|metadata| metadata.offset) {
            if let Some((opcode, length)) = self.head(offset)? {
                self.note(opcode, offset, length)?;
            }
        }
        for offset in index.summary.attachment_indexes.iter().map(|attachment| attachment.offset) {
            if let Some((opcode, length)) = self.head(offset)? {
                self.note(opcode, offset, length)?;
            }
        }
        self.index = Some(index);
        Ok(())
    }

    /// Takes note of a metadata record or an attachment; of other records there is nothing to note.
    fn note(&mut self, opcode: u8, offset: u64, length: u64) -> Result<(), LogError> {
        if !matches!(opcode, op::METADATA | op::ATTACHMENT) || self.noted.contains(&offset) {
            return Ok(());
        }
        self.noted.push(offset);
        match self.record(offset, length) {
            Ok(Record::Metadata(record)) => drop(self.metadata.insert(record.name, record.metadata)),
            Ok(Record::Attachment { header, .. }) => {
                self.attachments.push(AttachmentRef { name: header.name, offset, length });
            }
            Ok(_) => {}
            Err(fault) => match fault.at(offset, "a metadata record or attachment") {
                LogError::Damaged(damage) => self.damage.push(damage),
                other => return Err(other),
            },
        }
        Ok(())
    }

    /// Finds the chunks of a file without an index. Returns what is lost at its end, if that is known.
    fn scan(&mut self, mut offset: u64) -> Result<Option<Damage>, LogError> {
        loop {
            if offset == self.size {
                let what = "the log ends here, without its end mark: the run was cut off".to_owned();
                return Ok(Some(Damage { offset, what }));
            }
            let Some((opcode, length)) = self.head(offset)? else {
                let what = format!("the {} bytes from here to the end are no whole record", self.size - offset);
                return Ok(Some(Damage { offset, what }));
            };
            match opcode {
                op::DATA_END => return Ok(None),
                op::CHUNK => {
                    let mut start = [0; 8];
                    self.reader.seek(SeekFrom::Start(offset + RECORD_HEAD))?;
                    // A chunk too short for its own head is found to be damaged when it is read.
                    let start = if length >= 8 { self.reader.read_exact(&mut start).map(|()| start)? } else { start };
                    let start = u64::from_le_bytes(start);
                    self.chunks.push(ChunkRef { offset, length: RECORD_HEAD + length, start });
                }
                _ => self.note(opcode, offset, length)?,
            }
            offset += RECORD_HEAD + length;
        }
    }

    /// Opcode and length of the record at `offset`; `None` where no whole record stands there.
    fn head(&mut self, offset: u64) -> Result<Option<(u8, u64)>, LogError> {
        let Some(left) = self.size.checked_sub(offset + RECORD_HEAD) else { return Ok(None) };
        let mut head = [0; RECORD_HEAD as usize];
        self.reader.seek(SeekFrom::Start(offset))?;
        self.reader.read_exact(&mut head)?;
        let length = u64::from_le_bytes(std::array::from_fn(|k| head[1 + k]));
        // Opcode 0 is no record, and a run of zeros is what some file systems leave of a file after a crash.
        Ok((head[0] != 0 && length <= left).then_some((head[0], length)))
    }

    /// The record at `offset`, its checksum verified where it has one.
    fn record(&mut self, offset: u64, length: u64) -> Result<Record<'static>, Fault> {
        // `head` has checked that the file holds this many bytes.
        let mut body = vec![0; length as usize];
        let mut opcode = [0];
        self.reader.seek(SeekFrom::Start(offset))?;
        self.reader.read_exact(&mut opcode)?;
        self.reader.seek(SeekFrom::Start(offset + RECORD_HEAD))?;
        self.reader.read_exact(&mut body)?;
        mcap::parse_record(opcode[0], &body).map(Record::into_owned).map_err(|e| Fault::Lost(e.to_string()))
    }

    /// The content of an attachment; `None` where the log has none of that name.
    ///
    /// # Errors
    /// Damage, or a device that fails.
    pub fn attachment(&mut self, name: &str) -> Result<Option<Vec<u8>>, LogError> {
        let Some(found) = self.attachments.iter().find(|attachment| attachment.name == name).cloned() else {
            return Ok(None);
        };
        match self.record(found.offset, found.length) {
            Ok(Record::Attachment { data, .. }) => Ok(Some(data.into_owned())),
            Ok(_) => Ok(None),
            Err(fault) => Err(fault.at(found.offset, &format!("the attachment {name}"))),
        }
    }

    /// Verifies the checksum over everything before the index.
    ///
    /// # Errors
    /// Damage, or a device that fails.
    pub fn check_data(&mut self) -> Result<(), LogError> {
        let Some(index) = &self.index else { return Ok(()) };
        const DATA_END: u64 = RECORD_HEAD + 4;
        let lost = |offset, what: &str| LogError::Damaged(Damage { offset, what: what.to_owned() });
        let end = index.start.saturating_sub(DATA_END);
        let mut record = [0; DATA_END as usize];
        self.reader.seek(SeekFrom::Start(end))?;
        self.reader.read_exact(&mut record)?;
        if record[0] != op::DATA_END || record[1..9] != 4_u64.to_le_bytes() {
            return Err(lost(end, "the end of the data is not marked"));
        }
        let stored = u32::from_le_bytes(std::array::from_fn(|k| record[9 + k]));
        // Zero stands for a checksum that was not taken; we always take it, programs that mend logs may not.
        if stored != 0 && summary::checksum(&mut self.reader, 0, end)? != stored {
            return Err(lost(0, "the checksum over all data does not hold"));
        }
        Ok(())
    }

    /// Starts to read a chunk.
    pub fn open_chunk(&self, chunk: ChunkRef) -> ChunkReader {
        let limit = (chunk.length.saturating_mul(LARGEST_RATIO)).max(SMALL_CHUNK);
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_validate_chunk_crcs(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(usize::try_from(limit).unwrap_or(usize::MAX));
        // A chunk that reaches beyond the file is read up to its end, and then found to be cut off.
        let end = chunk.offset.saturating_add(chunk.length).min(self.size);
        ChunkReader { events: LinearReader::new_with_options(options), next: chunk.offset, end }
    }

    /// Passes the next record of a chunk, its opcode and body, to `act`. `None` at the chunk's end. Nothing comes out of
    /// a chunk whose checksum does not hold.
    pub fn next_record<T>(
        &mut self,
        chunk: &mut ChunkReader,
        act: impl FnOnce(u8, &[u8]) -> T,
    ) -> Option<Result<T, Fault>> {
        loop {
            let wanted = match chunk.events.next_event()? {
                Err(error) => return Some(Err(Fault::Lost(error.to_string()))),
                Ok(LinearReadEvent::Record { opcode, data }) => return Some(Ok(act(opcode, data))),
                Ok(LinearReadEvent::ReadRequest(wanted)) => wanted,
            };
            if let Err(error) = self.feed(chunk, wanted) {
                return Some(Err(error.into()));
            }
        }
    }

    fn feed(&mut self, chunk: &mut ChunkReader, wanted: usize) -> Result<(), std::io::Error> {
        let left = chunk.end.saturating_sub(chunk.next);
        let wanted = wanted.min(usize::try_from(left).unwrap_or(usize::MAX));
        self.reader.seek(SeekFrom::Start(chunk.next))?;
        let read = self.reader.read(chunk.events.insert(wanted))?;
        chunk.next += read as u64;
        chunk.events.notify_read(read);
        Ok(())
    }
}

/// A chunk that is being read.
pub struct ChunkReader {
    events: LinearReader,
    next: u64,
    end: u64,
}

fn check_magic<R: Read + Seek>(reader: &mut R, size: u64) -> Result<(), LogError> {
    let mut start = [0; 8];
    let length = size.min(8) as usize;
    reader.seek(SeekFrom::Start(0))?;
    reader.read_exact(&mut start[..length])?;
    if start == *mcap::MAGIC {
        return Ok(());
    }
    let text = start[..length].iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
    Err(LogError::NotALog(match start[..length].trim_ascii_start() {
        [] => "it is empty",
        [b'{' | b'/', ..] if text => "it looks like JSON, a scene perhaps",
        [b't' | b'x' | b'i', ..] if text => "it looks like text, a CSV file perhaps",
        _ if mcap::MAGIC.starts_with(&start[..length]) => "it ends within its first eight bytes",
        _ => "it does not begin as one",
    }))
}
