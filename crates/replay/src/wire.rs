//! Protobuf's wire format, as far as time and step can be read without decoding a message.

use agglo_record::channels::{CHANNELS, Topic};

/// Field numbers of time and step in agglo's own messages.
const OWN: (u64, u64) = (1, 2);
/// The same in foxglove's, which they extend.
const FOXGLOVE: (u64, u64) = (1000, 1001);

/// Time [s] and step of an encoded message; a field that is not there is zero. `None` where the encoding is broken.
pub fn key(topic: Topic, data: &[u8]) -> Option<(f64, u64)> {
    let own = CHANNELS[topic as usize].schema.starts_with("agglo.");
    let (time, number) = if own { OWN } else { FOXGLOVE };
    let (mut t, mut step) = (0.0, 0);
    let mut rest = data;
    while !rest.is_empty() {
        let tag = varint(&mut rest)?;
        let field = tag >> 3;
        match tag & 7 {
            0 => {
                let value = varint(&mut rest)?;
                if field == number {
                    step = value;
                }
            }
            1 => {
                let (bytes, after) = rest.split_first_chunk::<8>()?;
                if field == time {
                    t = f64::from_le_bytes(*bytes);
                }
                rest = after;
            }
            2 => {
                let length = usize::try_from(varint(&mut rest)?).ok()?;
                rest = rest.split_at_checked(length)?.1;
            }
            5 => rest = rest.split_at_checked(4)?.1,
            _ => return None,
        }
    }
    Some((t, step))
}

fn varint(rest: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, after) = rest.split_first()?;
        *rest = after;
        value |= u64::from(byte & 0x7f) << shift;
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}
