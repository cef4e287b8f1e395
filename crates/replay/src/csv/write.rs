//! From recorded states to CSV.

use std::fmt::Write as _;
use std::io::{Read, Seek, Write};

use agglo_core::state::Particles;
use agglo_record::channels::Topic;
use agglo_record::cloud::Frame;

use super::COLUMNS;
use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::Message;

/// Which states are exported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum At {
    /// The last one at or before this time [s].
    Time(f64),
    /// The last one.
    End,
    /// All of them.
    All,
}

impl std::str::FromStr for At {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "end" => Ok(Self::End),
            "all" => Ok(Self::All),
            _ => match text.parse::<f64>() {
                Ok(t) if t.is_finite() => Ok(Self::Time(t)),
                _ => Err(format!("{text:?} is not a time in seconds, `end` or `all`")),
            },
        }
    }
}

/// What was exported.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Exported {
    /// States.
    pub frames: u64,
    /// Rows, without the header.
    pub rows: u64,
    /// The time of the log's last state, where that is before the time asked for [s].
    pub ends_before: Option<f64>,
    /// Parts of the log that could not be read; what they held is missing.
    pub damage: Vec<Damage>,
}

/// An export that failed.
#[derive(Debug)]
pub enum ExportError {
    /// The log could not be read.
    Log(LogError),
    /// The output refused bytes.
    Write(std::io::Error),
}

impl std::fmt::Display for ExportError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(e) => e.fmt(f),
            Self::Write(e) => write!(f, "the export could not be written: {e}"),
        }
    }
}

impl std::error::Error for ExportError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Log(e) => Some(e),
            Self::Write(e) => Some(e),
        }
    }
}

impl From<LogError> for ExportError {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<std::io::Error> for ExportError {
    fn from(error: std::io::Error) -> Self {
        Self::Write(error)
    }
}

/// Exports states of a log as CSV. Of a damaged log, `all` exports what is whole and reports the rest.
///
/// # Errors
/// A log that cannot be read, no state at the time asked for, an output that refuses bytes.
pub fn export<R: Read + Seek>(log: &mut Log<R>, at: At, out: &mut impl Write) -> Result<Exported, ExportError> {
    let particles = log.particles()?;
    let mut done = Exported::default();
    match at {
        At::Time(t) => {
            let (frame, beyond) = log.frame_near(t)?;
            done.ends_before = beyond.then_some(frame.t);
            Table::new(&mut *out, &frame, &particles)?.write(&frame, &mut done)?;
        }
        At::End => {
            done.damage = log.damage().to_vec();
            let frame = log.last_frame()?;
            Table::new(&mut *out, &frame, &particles)?.write(&frame, &mut done)?;
        }
        At::All => {
            let mut table = None;
            for entry in log.messages().only(&[Topic::Particles]) {
                let frame = match entry {
                    Ok(entry) => match entry.message {
                        Message::Particles(frame) => frame,
                        _ => continue,
                    },
                    Err(LogError::Damaged(damage)) => {
                        done.damage.push(damage);
                        continue;
                    }
                    Err(other) => return Err(other.into()),
                };
                if table.is_none() {
                    table = Some(Table::new(&mut *out, &frame, &particles)?);
                }
                if let Some(table) = &mut table {
                    table.write(&frame, &mut done)?;
                }
            }
        }
    }
    out.flush()?;
    Ok(done)
}

/// A table that rows are written to; its columns are those of the first state.
pub struct Table<'a, W> {
    out: W,
    particles: &'a Particles,
    line: String,
}

impl<'a, W: Write> Table<'a, W> {
    /// Starts a table with its header.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn new(mut out: W, first: &Frame, particles: &'a Particles) -> Result<Self, std::io::Error> {
        let has = |column: &&&str| match **column {
            "charge" => particles.charge.is_some(),
            "temperature" => first.temperature.is_some(),
            "cluster" => first.cluster.is_some(),
            _ => true,
        };
        let header: Vec<&str> = COLUMNS.iter().filter(has).copied().collect();
        writeln!(out, "{}", header.join(","))?;
        Ok(Self { out, particles, line: String::new() })
    }

    /// Writes a state, a row per particle.
    ///
    /// # Errors
    /// An output that refuses bytes.
    pub fn write(&mut self, frame: &Frame, done: &mut Exported) -> Result<(), std::io::Error> {
        let Frame { t, step, position, velocity, temperature, cluster } = frame;
        let Particles { radius, mass, charge } = self.particles;
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
        done.frames += 1;
        done.rows += n as u64;
        Ok(())
    }
}

/// Appends the shortest text that reads back to the same number.
fn number(line: &mut String, value: f64) {
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

    #[test]
    fn times_are_numbers_end_or_all() {
        assert_eq!("0.5".parse(), Ok(At::Time(0.5)));
        assert_eq!("end".parse(), Ok(At::End));
        assert_eq!("all".parse(), Ok(At::All));
        assert_eq!("-1".parse(), Ok(At::Time(-1.0)), "which no log has; it says so itself");
        for wrong in ["", "nan", "inf", "last"] {
            assert!(wrong.parse::<At>().is_err(), "{wrong}");
        }
    }
}
