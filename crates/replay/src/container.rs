//! The file below the messages: records, chunks and attachments, read piece by piece and never beyond the file's size.

mod scan;
mod unpack;

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Seek, SeekFrom};

use mcap::records::op;

use self::unpack::{SMALL, Unpacker};
use crate::error::{Damage, LogError};
use crate::records::{self, Fields};
use crate::summary::{self, Index};

/// Opcode and length of a record [bytes].
const RECORD_HEAD: u64 = 1 + 8;

/// A chunk that holds a single step of very many particles may be larger by this for each of them [bytes]; states take 68,
/// and the impacts of a step some hundred.
const PARTICLE: u64 = 4 * 1024;

/// Metadata records and attachments that a log may have: ours have three, recovered ones one more.
const MOST_NOTED: usize = 1000;

/// Bytes of records that a log may claim for each of its own, and beside its largest part. A lattice at rest packs 120-fold; what is
/// built to keep a reader busy, 4000-fold.
const PACKED: u64 = 512;
const UNPACKED: u64 = 64 * 1024 * 1024;

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
    noted: BTreeSet<u64>,
    /// Chunks whose claims have been counted, and these together [bytes].
    granted: (BTreeSet<u64>, u64),
    /// Where the reader stands, if that is known [byte].
    place: Option<u64>,
    /// A chunk as it stands in the file; memory that is used again.
    packed: Vec<u8>,
    /// Records of a chunk; memory that is used again.
    spare: Vec<u8>,
    unpacker: Unpacker,
    /// Memory that a part may be given [bytes].
    limit: u64,
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
            noted: BTreeSet::new(),
            granted: (BTreeSet::new(), 0),
            place: None,
            packed: Vec::new(),
            spare: Vec::new(),
            unpacker: Unpacker::default(),
            limit: SMALL,
        };
        let data = container.prologue()?;
        container.place = None;
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

    /// Allows parts as large as a run of `n` particles may need.
    pub fn allow(&mut self, n: u64) {
        self.limit = SMALL.saturating_add(n.saturating_mul(PARTICLE));
    }

    /// The largest message that makes sense [bytes]: chunks of ours are closed behind a step at 1 MiB.
    pub fn largest_message(&self) -> usize {
        usize::try_from(self.limit - SMALL + (1 << 20)).unwrap_or(usize::MAX)
    }

    /// The largest chunk that makes sense [bytes].
    pub fn largest_chunk(&self) -> usize {
        usize::try_from(self.limit).unwrap_or(usize::MAX)
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
        self.chunks.clone_from(&index.chunks);
        // Our own logs have all of these before the first chunk; others that were mended may not.
        for &offset in &index.others {
            if !self.noted.contains(&offset)
                && let Some((opcode, length)) = self.head(offset)?
            {
                self.note(opcode, offset, length)?;
            }
        }
        self.index = Some(index);
        Ok(())
    }

    /// Takes note of a metadata record or an attachment; of other records there is nothing to note.
    fn note(&mut self, opcode: u8, offset: u64, length: u64) -> Result<(), LogError> {
        if !matches!(opcode, op::METADATA | op::ATTACHMENT) || !self.noted.insert(offset) {
            return Ok(());
        }
        if self.noted.len() > MOST_NOTED {
            if self.noted.len() == MOST_NOTED + 1 {
                let what = format!(
                    "more than {MOST_NOTED} metadata records and attachments: those from here on are passed over"
                );
                self.damage.push(Damage { offset, what });
            }
            return Ok(());
        }
        // Of an attachment, its content is read when it is asked for.
        let wanted = if opcode == op::METADATA { length } else { length.min(records::ATTACHMENT_HEAD) };
        let body = match self.body(offset, wanted) {
            Ok(body) => body,
            Err(Fault::Io(error)) => return Err(error.into()),
            Err(Fault::Lost(_)) => Vec::new(),
        };
        let known = match opcode {
            op::METADATA => records::metadata(&body).map(|(name, map)| drop(self.metadata.insert(name, map))),
            _ => records::attachment_name(&body, length).map(|name| {
                self.attachments.push(AttachmentRef { name: name.to_owned(), offset, length });
            }),
        };
        if known.is_none() {
            let what = "a metadata record or attachment makes no sense".to_owned();
            self.damage.push(Damage { offset, what });
        }
        Ok(())
    }

    /// Opcode and length of the record at `offset`; `None` where no whole record stands there.
    fn head(&mut self, offset: u64) -> Result<Option<(u8, u64)>, LogError> {
        let end = offset.checked_add(RECORD_HEAD);
        let Some(left) = end.and_then(|end| self.size.checked_sub(end)) else { return Ok(None) };
        let mut head = [0; RECORD_HEAD as usize];
        self.read(offset, &mut head)?;
        let length = u64::from_le_bytes(std::array::from_fn(|k| head[1 + k]));
        // Opcode 0 is no record, and a run of zeros is what some file systems leave of a file after a crash.
        Ok((head[0] != 0 && length <= left).then_some((head[0], length)))
    }

    /// The body of the record at `offset`.
    fn body(&mut self, offset: u64, length: u64) -> Result<Vec<u8>, Fault> {
        // `head` has checked that the file holds this many bytes.
        if length > self.limit {
            return Err(Fault::Lost(format!("its {length} bytes are above the limit of {} bytes", self.limit)));
        }
        let mut body = vec![0; usize::try_from(length).map_err(|_| Fault::Lost("it is too long".to_owned()))?];
        self.read(offset + RECORD_HEAD, &mut body)?;
        Ok(body)
    }

    /// The content of an attachment; `None` where the log has none of that name.
    ///
    /// # Errors
    /// Damage, or a device that fails.
    pub fn attachment(&mut self, name: &str) -> Result<Option<Vec<u8>>, LogError> {
        let Some(found) = self.attachments.iter().find(|attachment| attachment.name == name).cloned() else {
            return Ok(None);
        };
        let part = format!("the attachment {name}");
        let body = self.body(found.offset, found.length).map_err(|fault| fault.at(found.offset, &part))?;
        match records::attachment(&body) {
            Some(attachment) if attachment.intact => Ok(Some(attachment.data.to_vec())),
            _ => Err(Fault::Lost("its checksum does not hold".to_owned()).at(found.offset, &part)),
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
        self.place = None;
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
    pub fn open_chunk(&mut self, chunk: ChunkRef) -> ChunkReader {
        ChunkReader { chunk, records: None, at: 0 }
    }

    /// Passes the next record of a chunk, its opcode and body, to `act`. `None` at the chunk's end. Nothing comes out of
    /// a chunk whose checksum does not hold; after a fault nothing more comes.
    pub fn next_record<T>(
        &mut self,
        chunk: &mut ChunkReader,
        act: impl FnOnce(u8, &[u8]) -> T,
    ) -> Option<Result<T, Fault>> {
        if chunk.records.is_none() {
            match self.load(chunk.chunk) {
                Ok(records) => chunk.records = Some(records),
                Err(fault) => return Some(Err(fault)),
            }
        }
        let records = chunk.records.as_deref().unwrap_or_default();
        let mut fields = Fields(records.get(chunk.at..).unwrap_or_default());
        if fields.0.is_empty() {
            // The memory is used again for the next chunk.
            self.spare = chunk.records.take().unwrap_or_default();
            chunk.at = 0;
            return None;
        }
        let head = (fields.bytes(1), fields.u64());
        let body =
            if let (Some([opcode]), Some(length)) = head { fields.bytes(length).map(|b| (*opcode, b)) } else { None };
        let Some((opcode, body)) = body else {
            return Some(Err(Fault::Lost("a record in it ends beyond it".to_owned())));
        };
        if opcode == 0 {
            return Some(Err(Fault::Lost(NO_RECORD.to_owned())));
        }
        chunk.at = records.len() - fields.0.len();
        Some(Ok(act(opcode, body)))
    }

    /// Fills a buffer with what stands at `offset`. What follows the last reading closely is read on, not sought:
    /// seeking throws away what is buffered.
    fn read(&mut self, offset: u64, buffer: &mut [u8]) -> std::io::Result<()> {
        const CLOSE: u64 = 4096;
        let ahead = self.place.take().and_then(|place| offset.checked_sub(place));
        match ahead.filter(|ahead| *ahead <= CLOSE) {
            Some(ahead) => {
                let mut skipped = [0; CLOSE as usize];
                self.reader.read_exact(&mut skipped[..ahead as usize])?;
            }
            None => drop(self.reader.seek(SeekFrom::Start(offset))?),
        }
        self.reader.read_exact(buffer)?;
        self.place = Some(offset + buffer.len() as u64);
        Ok(())
    }

    /// Counts what a chunk claims to hold; all of them together may claim so many times the size of the file.
    fn grant(&mut self, offset: u64, claimed: u64) -> Result<(), Fault> {
        let (known, total) = &mut self.granted;
        // One that is too large by itself is refused as such.
        if known.contains(&offset) || claimed > self.limit {
            return Ok(());
        }
        let most = self.size.saturating_mul(PACKED).saturating_add(UNPACKED).saturating_add(self.limit);
        match total.checked_add(claimed).filter(|total| *total <= most) {
            Some(with) => *total = with,
            None => {
                let what = format!(
                    "with the chunks before it the log claims more than the {most} bytes of records that its size allows"
                );
                return Err(Fault::Lost(what));
            }
        }
        known.insert(offset);
        Ok(())
    }

    /// The records of a chunk, their checksum verified.
    fn load(&mut self, chunk: ChunkRef) -> Result<Vec<u8>, Fault> {
        let lost = |why: &str| Fault::Lost(why.to_owned());
        let head = self.head(chunk.offset).map_err(|error| match error {
            LogError::Io(error) => Fault::Io(error),
            other => Fault::Lost(other.to_string()),
        })?;
        let (opcode, length) = head.ok_or_else(|| lost("it ends beyond the file"))?;
        if opcode != op::CHUNK || length + RECORD_HEAD != chunk.length {
            return Err(lost("the index points to something else"));
        }
        // What does not compress takes a little more room packed.
        if length > self.limit + self.limit / 64 {
            return Err(Fault::Lost(format!("its {length} bytes are above the limit of {} bytes", self.limit)));
        }
        let length = usize::try_from(length).map_err(|_| lost("it is too long"))?;
        let mut packed = std::mem::take(&mut self.packed);
        packed.resize(length, 0);
        let read = self.read(chunk.offset + RECORD_HEAD, &mut packed);
        self.packed = packed;
        read?;
        let head = records::chunk(&self.packed, length as u64).ok_or_else(|| lost("its head makes no sense"))?;
        self.grant(chunk.offset, head.uncompressed_size)?;
        let mut records = std::mem::take(&mut self.spare);
        records.clear();
        self.unpacker.unpack(&head, &self.packed[head.records..], self.limit, &mut records)?;
        if head.crc != 0 && crc32fast::hash(&records) != head.crc {
            return Err(lost("its checksum does not hold"));
        }
        Ok(records)
    }
}

/// What is said of a chunk in which a record is of kind 0, which MCAP has not.
const NO_RECORD: &str = "what it holds are no records";

/// A chunk that is being read.
pub struct ChunkReader {
    chunk: ChunkRef,
    /// Its records, once they have been read.
    records: Option<Vec<u8>>,
    /// Where the next one begins.
    at: usize,
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

#[cfg(test)]
mod tests;
