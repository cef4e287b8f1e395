//! Chunks decompressed: into no more memory than their particles need, and only where they fill it.

use std::io::Read;

use super::Fault;
use crate::records::{ChunkHead, Fields};

/// No part of a file is given more memory than this, and some for every particle [bytes]: our chunks are closed near 1 MiB,
/// those of other programs that arrange chunks anew near 8 MiB.
pub const SMALL: u64 = 32 * 1024 * 1024;

/// Chunks larger than this are looked into before they are decompressed in full [bytes]; ours hardly ever are.
const LARGE: u64 = 4 * 1024 * 1024;

/// Decompresses chunks, one after another.
#[derive(Default)]
pub struct Unpacker {
    zstd: Option<zstd::bulk::Decompressor<'static>>,
}

impl Unpacker {
    /// Appends the records of a chunk to `records`, which is empty; a chunk of more than `limit` bytes is lost.
    pub fn unpack(&mut self, head: &ChunkHead, packed: &[u8], limit: u64, records: &mut Vec<u8>) -> Result<(), Fault> {
        let lost = |why: &str| Fault::Lost(why.to_owned());
        let claimed = head.uncompressed_size;
        if claimed > limit {
            return Err(Fault::Lost(format!("it claims {claimed} bytes of records, above the limit of {limit} bytes")));
        }
        if claimed > LARGE && !begins_well(&head.compression, packed, claimed) {
            return Err(lost(super::NO_RECORD));
        }
        // The room for a large chunk is taken only once it is known to be filled.
        if claimed > SMALL {
            let found = measure(&head.compression, packed, claimed).map_err(|_| lost("it does not decompress"))?;
            if found != claimed {
                return Err(lost(&format!("it holds other than the {claimed} bytes of records that it claims")));
            }
        }
        let size = usize::try_from(claimed).map_err(|_| lost("it is too long"))?;
        records.try_reserve_exact(size).map_err(|_| lost("there is no memory for it"))?;
        match head.compression.as_str() {
            "zstd" => {
                let decompressor = match &mut self.zstd {
                    Some(decompressor) => decompressor,
                    none => none.insert(zstd::bulk::Decompressor::new()?),
                };
                // Decompresses into the room that is there and not beyond it.
                decompressor.decompress_to_buffer(packed, records).map_err(|_| lost("it does not decompress"))?;
            }
            "lz4" => {
                let decoder = lz4::Decoder::new(packed).map_err(|_| lost("it does not decompress"))?;
                let read = decoder.take(claimed + 1).read_to_end(records);
                read.map_err(|_| lost("it does not decompress"))?;
            }
            _ => records.extend_from_slice(packed),
        }
        if records.len() != size {
            return Err(Fault::Lost(format!("it holds {} bytes of records and claims {size}", records.len())));
        }
        Ok(())
    }
}

/// Whether the first records of a chunk can be some: not of kind 0, none longer than the chunk. What does not even
/// decompress is left to who decompresses all of it.
fn begins_well(compression: &str, packed: &[u8], claimed: u64) -> bool {
    let mut start = Vec::new();
    let take = |reader: &mut dyn Read, start: &mut Vec<u8>| reader.take(64 * 1024).read_to_end(start);
    let read = match compression {
        "zstd" => zstd::stream::read::Decoder::with_buffer(packed).and_then(|mut decoder| {
            // No more room than the chunk itself may have.
            decoder.window_log_max(25)?;
            take(&mut decoder, &mut start)
        }),
        "lz4" => lz4::Decoder::new(packed).and_then(|mut decoder| take(&mut decoder, &mut start)),
        _ => take(&mut &*packed, &mut start),
    };
    if read.is_err() {
        return true;
    }
    let (mut fields, mut at) = (Fields(&start), 0);
    while let (Some([opcode]), Some(length)) = (fields.bytes(1), fields.u64()) {
        at += 9;
        if *opcode == 0 || length > claimed - at {
            return false;
        }
        at += length;
        if fields.bytes(length).is_none() {
            break;
        }
    }
    true
}

/// How many bytes come out of some that are packed, up to one more than `claimed`, without keeping them.
fn measure(compression: &str, packed: &[u8], claimed: u64) -> std::io::Result<u64> {
    let count = |reader: &mut dyn Read| std::io::copy(&mut reader.take(claimed + 1), &mut std::io::sink());
    match compression {
        "zstd" => count(&mut zstd::stream::read::Decoder::with_buffer(packed)?),
        "lz4" => count(&mut lz4::Decoder::new(packed)?),
        _ => Ok(packed.len() as u64),
    }
}
