//! States of a log for other programs: CSV, extended XYZ, VTK's PolyData, Parquet.

mod extxyz;
#[cfg(feature = "parquet")]
pub mod parquet;
pub mod vtp;

use std::io::{Read, Seek};

use agglo_core::state::Particles;
use agglo_record::cloud::Frame;

use crate::error::{Damage, LogError, NoState};
use crate::log::Log;
use crate::messages::{Entry, Message};

pub use extxyz::ExtendedXyz;

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

/// Passes states of a log, with what never changes about the particles, to `write`, which returns the number of rows that
/// it made of one. Of a damaged log, `all` passes what is whole and reports the rest.
///
/// # Errors
/// A log that cannot be read, no state at the time asked for, and what `write` says.
pub fn states<R: Read + Seek>(
    log: &mut Log<R>,
    at: At,
    mut write: impl FnMut(&Frame, &Particles) -> Result<u64, ExportError>,
) -> Result<Exported, ExportError> {
    let particles = log.particles()?;
    let mut done = Exported::default();
    let mut take = |frame: &Frame, done: &mut Exported| -> Result<(), ExportError> {
        done.rows += write(frame, &particles)?;
        done.frames += 1;
        Ok(())
    };
    match at {
        At::Time(t) => {
            let (frame, beyond) = log.frame_near(t)?;
            done.ends_before = beyond.then_some(frame.t);
            take(&frame, &mut done)?;
        }
        At::End => {
            done.damage = log.damage().to_vec();
            take(&log.last_frame()?, &mut done)?;
        }
        At::All => {
            // All of the file is read anyway.
            done.damage = log.file_damage()?;
            for message in log.judged()? {
                match message {
                    Ok((_, Some(Entry { message: Message::Particles(frame), .. }))) => take(&frame, &mut done)?,
                    Ok(_) => {}
                    Err(LogError::Damaged(damage)) => done.damage.push(damage),
                    Err(other) => return Err(other.into()),
                }
            }
            if done.frames == 0 {
                return Err(LogError::NoState(NoState { time: f64::INFINITY, first: None }).into());
            }
        }
    }
    Ok(done)
}

#[cfg(test)]
mod tests {
    use super::At;

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
