//! What can go wrong while a log is read.

use agglo_core::scene::Problem;

/// A part of a log that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// Where it begins, in bytes from the start of the file.
    pub offset: u64,
    /// What is lost, as a sentence.
    pub what: String,
}

impl std::fmt::Display for Damage {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "byte {}: {}", self.offset, self.what)
    }
}

/// No state at or before a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NoState {
    /// The time that was asked for [s].
    pub time: f64,
    /// The time of the first recorded state [s]; `None` where no state is recorded.
    pub first: Option<f64>,
}

/// A log that cannot be read, or not in full.
#[derive(Debug)]
pub enum LogError {
    /// The file could not be opened or read.
    Io(std::io::Error),
    /// The file is no MCAP file; what it looks like instead.
    NotALog(&'static str),
    /// An MCAP file that agglo did not write.
    Foreign(String),
    /// A log of a format that this version does not read.
    Version(String),
    /// A part is lost. Reading may go on behind it.
    Damaged(Damage),
    /// The log holds no state at or before the time that was asked for.
    NoState(NoState),
    /// The scene in the log does not parse; it was written by another version.
    Scene(Vec<Problem>),
}

impl LogError {
    /// Whether the file is a log of which a part is lost, rather than no readable log at all.
    #[must_use]
    pub fn is_damage(&self) -> bool {
        matches!(self, Self::Damaged(_))
    }
}

impl std::fmt::Display for LogError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Io(e) => write!(f, "cannot be read: {e}"),
            Self::NotALog(looks_like) => write!(f, "not a log (no MCAP file): {looks_like}"),
            Self::Foreign(why) => write!(f, "an MCAP file, but not a log of agglo: {why}"),
            Self::Version(why) => f.write_str(why),
            Self::Damaged(damage) => write!(f, "damaged at {damage}"),
            Self::NoState(NoState { time, first: Some(first) }) => {
                write!(f, "t = {time} s is before the first recorded state at {first} s")
            }
            Self::NoState(NoState { time: _, first: None }) => f.write_str("no state is recorded"),
            Self::Scene(problems) => {
                f.write_str("the scene in the log is not one that this version reads")?;
                problems.iter().try_for_each(|problem| write!(f, "\n{problem}"))
            }
        }
    }
}

impl std::error::Error for LogError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Io(e) => Some(e),
            _ => None,
        }
    }
}

impl From<std::io::Error> for LogError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}
