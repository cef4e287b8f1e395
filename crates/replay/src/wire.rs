//! Protobuf's wire format, as far as time and step can be read without decoding a message.

use agglo_record::channels::{CHANNELS, Topic};

/// Field numbers of time and step in agglo's own messages.
const OWN: (u64, u64) = (1, 2);
/// The same in foxglove's, which they extend.
const FOXGLOVE: (u64, u64) = (1000, 1001);

/// A field's value; of those with a length, what is in them.
enum Value<'a> {
    Number(u64),
    Double(f64),
    Bytes(&'a [u8]),
    Other,
}

/// The next field and its value; `None` where the encoding is broken.
fn field<'a>(rest: &mut &'a [u8]) -> Option<(u64, Value<'a>)> {
    let tag = varint(rest)?;
    let value = match tag & 7 {
        0 => Value::Number(varint(rest)?),
        1 => {
            let (bytes, after) = rest.split_first_chunk::<8>()?;
            *rest = after;
            Value::Double(f64::from_le_bytes(*bytes))
        }
        2 => {
            let length = usize::try_from(varint(rest)?).ok()?;
            let (bytes, after) = rest.split_at_checked(length)?;
            *rest = after;
            Value::Bytes(bytes)
        }
        5 => {
            *rest = rest.split_at_checked(4)?.1;
            Value::Other
        }
        _ => return None,
    };
    Some((tag >> 3, value))
}

/// Time [s] and step of an encoded message; a field that is not there is zero. `None` where the encoding is broken.
pub fn key(topic: Topic, data: &[u8]) -> Option<(f64, u64)> {
    let own = CHANNELS[topic as usize].schema.starts_with("agglo.");
    let (time, number) = if own { OWN } else { FOXGLOVE };
    let (mut t, mut step) = (0.0, 0);
    let mut rest = data;
    while !rest.is_empty() {
        match field(&mut rest)? {
            (name, Value::Number(value)) if name == number => step = value,
            (name, Value::Double(value)) if name == time => t = value,
            _ => {}
        }
    }
    Some((t, step))
}

/// Whether a message has thousands of parts that are shorter than any impact or attempt: decoded, each would take a
/// hundred times its two bytes.
pub fn is_hollow(data: &[u8]) -> bool {
    const SHORT: usize = 8;
    const MANY: usize = 1000;
    let (mut rest, mut short) = (data, 0);
    while let Some((_, value)) = field(&mut rest) {
        short += usize::from(matches!(value, Value::Bytes(bytes) if bytes.len() < SHORT));
    }
    short > MANY
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
