//! The index at the end of a log: believed only if its checksum holds.

use std::io::{Read, Seek, SeekFrom};

use mcap::sans_io::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};

use crate::container::Fault;

/// Footer record and end mark: opcode, length, start of the summary, start of its offsets, checksum, magic.
const TAIL: u64 = 1 + 8 + 8 + 8 + 4 + 8;

/// The index of a log.
pub struct Index {
    /// Where it begins [byte]; the data end just before.
    pub start: u64,
    pub summary: mcap::Summary,
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
    if start < magic || start > tail_start {
        return Err(lost("the footer points outside the file"));
    }
    // The checksum covers the summary and the footer up to the checksum itself.
    // Zero stands for a checksum that was not taken.
    if stored != 0 && checksum(reader, start, tail_start + 25)? != stored {
        return Err(lost("its checksum does not hold"));
    }
    let mut events = SummaryReader::new_with_options(
        SummaryReaderOptions::default().with_file_size(size).with_record_length_limit((size - start) as usize),
    );
    while let Some(event) = events.next_event() {
        match event.map_err(|e| Fault::Lost(e.to_string()))? {
            SummaryReadEvent::SeekRequest(to) => {
                let at = reader.seek(to)?;
                events.notify_seeked(at);
            }
            SummaryReadEvent::ReadRequest(wanted) => {
                let read = reader.read(events.insert(wanted))?;
                events.notify_read(read);
            }
        }
    }
    let summary = events.finish().ok_or_else(|| lost("there is none"))?;
    Ok(Index { start, summary })
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
