//! Reads a log and decompresses its chunks, and does nothing else: the yardstick for the speed of `analyze` and `diff`.
//!
//! `cargo run --release -p agglo-replay --example decompress -- LOG..` prints the seconds that it took.

use std::fs::File;
use std::io::{BufReader, Read};

/// Opcode of a chunk, and of the end of the data.
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

fn main() -> std::io::Result<()> {
    let started = std::time::Instant::now();
    let (mut packed, mut records) = (0, 0);
    for path in std::env::args().skip(1) {
        let mut file = BufReader::with_capacity(1 << 16, File::open(path)?);
        file.read_exact(&mut [0; 8])?;
        let mut decompressor = zstd::bulk::Decompressor::new()?;
        let (mut body, mut room) = (Vec::new(), Vec::new());
        loop {
            let mut head = [0; 9];
            file.read_exact(&mut head)?;
            if head[0] == DATA_END {
                break;
            }
            body.resize(u64::from_le_bytes(std::array::from_fn(|k| head[1 + k])) as usize, 0);
            file.read_exact(&mut body)?;
            if head[0] == CHUNK {
                // Times; then the size of the records, their checksum, the name of the compression, their packed size.
                let size = u64::from_le_bytes(std::array::from_fn(|k| body[16 + k])) as usize;
                let name = u32::from_le_bytes(std::array::from_fn(|k| body[28 + k])) as usize;
                room.clear();
                room.reserve(size);
                if name == 0 {
                    room.extend_from_slice(&body[40..]);
                } else {
                    decompressor.decompress_to_buffer(&body[40 + name..], &mut room)?;
                }
                packed += body.len();
                records += room.len();
            }
        }
    }
    println!("{:.3} s, {packed} bytes in chunks, {records} of records", started.elapsed().as_secs_f64());
    Ok(())
}
