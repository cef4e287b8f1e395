//! Finding the parts of a file whose index is lost, one record after another, and chunks behind what is none.

use std::io::{Read, Seek};

use mcap::records::op;

use super::{ChunkRef, Container, RECORD_HEAD};
use crate::error::{Damage, LogError};
use crate::records::{self, ChunkHead, Fields};

impl<R: Read + Seek> Container<R> {
    /// Finds the chunks of a file without an index. Returns what is lost at its end, if that is known.
    pub(super) fn scan(&mut self, mut offset: u64) -> Result<Option<Damage>, LogError> {
        loop {
            if offset == self.size {
                let what = "the log ends here, without its end mark: the run was cut off, or still goes on".to_owned();
                return Ok(Some(Damage { offset, what }));
            }
            let next = match self.head(offset)? {
                Some((op::DATA_END, 4)) => return Ok(None),
                Some((op::CHUNK, length)) => match self.chunk_head(offset, length)? {
                    Some(head) => {
                        self.chunks.push(ChunkRef { offset, length: RECORD_HEAD + length, start: head.start });
                        Some(length)
                    }
                    None => None,
                },
                // Between chunks stand their indexes; what else there is has been noted before the first one.
                Some((op::MESSAGE_INDEX, length)) => Some(length),
                Some((opcode @ (op::METADATA | op::ATTACHMENT | op::HEADER), length)) => {
                    self.note(opcode, offset, length)?;
                    Some(length)
                }
                _ => None,
            };
            match next {
                Some(length) => offset += RECORD_HEAD + length,
                // What stands here is no record; behind it there may be whole chunks.
                None => match self.next_chunk(offset + 1)? {
                    Some(found) => {
                        let what = format!("{} bytes from here are no records", found - offset);
                        self.damage.push(Damage { offset, what });
                        offset = found;
                    }
                    None => {
                        let what = format!("the {} bytes from here to the end are no whole record", self.size - offset);
                        return Ok(Some(Damage { offset, what }));
                    }
                },
            }
        }
    }

    /// The head of the chunk whose record, with a body of `length` bytes, begins at `offset`; `None` where that makes no
    /// sense.
    fn chunk_head(&mut self, offset: u64, length: u64) -> Result<Option<ChunkHead>, LogError> {
        let mut head = [0; records::CHUNK_HEAD];
        let have = length.min(records::CHUNK_HEAD as u64) as usize;
        self.read(offset + RECORD_HEAD, &mut head[..have])?;
        Ok(records::chunk(&head[..have], length))
    }

    /// Where the next record from `offset` on that can be a chunk begins.
    fn next_chunk(&mut self, mut offset: u64) -> Result<Option<u64>, LogError> {
        const WINDOW: usize = 64 * 1024;
        const LEAST: usize = RECORD_HEAD as usize + records::CHUNK_HEAD;
        let mut window = vec![0; WINDOW + LEAST];
        while offset < self.size {
            let have = (self.size - offset).min(window.len() as u64) as usize;
            self.read(offset, &mut window[..have])?;
            for (k, _) in window[..have.min(WINDOW)].iter().enumerate().filter(|(_, byte)| **byte == op::CHUNK) {
                let mut fields = Fields(&window[k + 1..have]);
                let here = offset + k as u64;
                let fits = |length: &u64| self.size.checked_sub(here + RECORD_HEAD).is_some_and(|left| *length <= left);
                let Some(length) = fields.u64().filter(fits) else { continue };
                let body = &fields.0[..fields.0.len().min(records::CHUNK_HEAD)];
                if records::chunk(body, length).is_some() {
                    return Ok(Some(here));
                }
            }
            offset += WINDOW as u64;
        }
        Ok(None)
    }
}
