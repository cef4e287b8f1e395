//! From recorded states to CSV.

use std::fmt::Write as _;
use std::io::{Read, Seek, Write};

use agglo_core::state::Particles;
use agglo_record::cloud::Frame;

use super::COLUMNS;
use crate::export::{At, ExportError, Exported, states};
use crate::log::Log;

/// Exports states of a log as CSV. Of a damaged log, `all` exports what is whole and reports the rest.
///
/// # Errors
/// A log that cannot be read, no state at the time asked for, an output that refuses bytes.
pub fn export<R: Read + Seek>(log: &mut Log<R>, at: At, out: &mut impl Write) -> Result<Exported, ExportError> {
    let (mut table, mut unused) = (None, Some(out));
    let done = states(log, at, |frame, particles| {
        if let Some(out) = unused.take() {
            table = Some(Table::new(out, frame, particles)?);
        }
        Ok(table.as_mut().map_or(Ok(0), |table| table.write(frame, particles))?)
    })?;
    if let Some(table) = table {
        table.out.flush()?;
    }
    Ok(done)
}

/// A table that rows are written to; its columns are those of the first state.
pub struct Table<W> {
    out: W,
    line: String,
}

impl<W: Write> Table<W> {
    /// Starts a table with its header.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn new(mut out: W, first: &Frame, particles: &Particles) -> Result<Self, std::io::Error> {
        let has = |column: &&&str| match **column {
            "charge" => particles.charge.is_some(),
            "temperature" => first.temperature.is_some(),
            "cluster" => first.cluster.is_some(),
            _ => true,
        };
        let header: Vec<&str> = COLUMNS.iter().filter(has).copied().collect();
        writeln!(out, "{}", header.join(","))?;
        Ok(Self { out, line: String::new() })
    }

    /// Writes a state, a row per particle; returns the number of rows.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn write(&mut self, frame: &Frame, particles: &Particles) -> Result<u64, std::io::Error> {
        let Frame { t, step, position, velocity, temperature, cluster } = frame;
        let Particles { radius, mass, charge } = particles;
        let n = position.len().min(radius.len());
        for k in 0..n {
            let line = &mut self.line;
            line.clear();
            number(line, *t);
            let _ = write!(line, ",{step},{k}");
            for column in position.axes().into_iter().chain(velocity.axes()).chain([&radius[..], &mass[..]]) {
                line.push(',');
                number(line, column[k]);
            }
            for column in [charge, temperature].into_iter().flatten() {
                line.push(',');
                number(line, column[k]);
            }
            if let Some(cluster) = cluster {
                let _ = write!(line, ",{}", cluster[k]);
            }
            line.push('\n');
            self.out.write_all(line.as_bytes())?;
        }
        Ok(n as u64)
    }
}

/// Appends the shortest text that reads back to the same number.
pub(crate) fn number(line: &mut String, value: f64) {
    // Writing to a String cannot fail.
    let _ = match value {
        _ if value.is_nan() => write!(line, "NaN"),
        _ if value.is_infinite() => write!(line, "{}Infinity", if value < 0.0 { "-" } else { "" }),
        _ => write!(line, "{value:?}"),
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_to_the_same_bits() {
        let mut bits = 0x9e37_79b9_7f4a_7c15_u64;
        for _ in 0..100_000 {
            // A plain generator: every exponent must come up.
            bits = bits.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let value = f64::from_bits(bits);
            let mut text = String::new();
            number(&mut text, value);
            if value.is_nan() {
                assert_eq!(text, "NaN");
            } else {
                assert_eq!(text.parse::<f64>().map(f64::to_bits), Ok(bits), "{text}");
            }
        }
    }
}
