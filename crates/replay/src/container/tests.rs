//! Chunks of every size: as large as they must be, and no larger.

#![allow(clippy::unwrap_used)]

use std::collections::BTreeMap;
use std::io::Cursor;

use super::*;

/// An MCAP file with one chunk, which holds one message of `length` zeros: zstd packs them 10 000-fold.
fn file(length: usize) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().chunk_size(None).create(&mut bytes).unwrap();
    let channel = writer.add_channel(0, "/particles", "", &BTreeMap::new()).unwrap();
    let header = mcap::records::MessageHeader { channel_id: channel, sequence: 0, log_time: 0, publish_time: 0 };
    writer.write_to_known_channel(&header, &vec![0; length]).unwrap();
    writer.finish().unwrap();
    drop(writer);
    bytes.into_inner()
}

/// Size of the largest record, or why the chunk is lost.
fn read(bytes: &[u8], n: u64) -> Result<usize, String> {
    let mut container = Container::open(Cursor::new(bytes)).unwrap_or_else(|error| panic!("{error}"));
    container.allow(n);
    let mut largest = 0;
    for chunk in container.chunks.clone() {
        let mut reader = container.open_chunk(chunk);
        while let Some(found) = container.next_record(&mut reader, |_, body| body.len()) {
            match found {
                Ok(length) => largest = largest.max(length),
                Err(Fault::Lost(why)) => return Err(why),
                Err(Fault::Io(error)) => panic!("{error}"),
            }
        }
    }
    Ok(largest)
}

#[test]
fn a_chunk_may_be_as_large_as_its_particles_need() {
    // A lattice at rest packs 120-fold: no ratio tells a bomb from the state of many particles.
    const LENGTH: usize = 80_000_000;
    let bytes = file(LENGTH);
    assert!(bytes.len() < 100_000);
    assert_eq!(read(&bytes, 20_000), Ok(22 + LENGTH));
    assert!(read(&bytes, 100).unwrap_err().contains("above the limit"));
    // It claims more than it holds, which many particles would allow.
    let mut liar = bytes.clone();
    let at = size_of_chunk(&bytes);
    liar[at..at + 8].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert!(read(&liar, 1 << 30).unwrap_err().contains("other than the"));
}

/// Where the uncompressed size of the first chunk stands.
fn size_of_chunk(bytes: &[u8]) -> usize {
    let mut at = mcap::MAGIC.len();
    while bytes[at] != op::CHUNK {
        at += 9 + u64::from_le_bytes(std::array::from_fn(|k| bytes[at + 1 + k])) as usize;
    }
    at + 9 + 16
}

#[test]
fn an_index_that_points_beyond_everything_is_no_overflow() {
    let mut container = Container::open(Cursor::new(file(10))).unwrap_or_else(|error| panic!("{error}"));
    for offset in [u64::MAX, u64::MAX - 9, 1 << 63, 1 << 40] {
        assert!(container.head(offset).unwrap_or_else(|error| panic!("{error}")).is_none());
    }
}
