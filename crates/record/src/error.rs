//! What can go wrong while a log is written.

/// A log that could not be written. What was written before stays as it is.
#[derive(Debug)]
pub enum RecordError {
    /// The output refused bytes, for instance because the disk is full.
    Write(std::io::Error),
    /// The log could not be encoded.
    Encode(mcap::McapError),
    /// The recorder was used on after a write had failed; the text of that failure.
    AfterFailure(String),
    /// The log would grow beyond the size that was allowed.
    TooLarge {
        /// Bytes written.
        bytes: u64,
        /// Bytes allowed.
        limit: u64,
    },
    /// The scene's particles come from a file that was not read into `particles.list` before.
    Unresolved,
    /// What the solver reports does not fit the scene that the log was created for.
    Mismatch(String),
}

impl RecordError {
    /// The operating system's kind of failure, where a write failed: a full disk, a closed pipe.
    #[must_use]
    pub fn io_kind(&self) -> Option<std::io::ErrorKind> {
        match self {
            Self::Write(e) | Self::Encode(mcap::McapError::Io(e)) => Some(e.kind()),
            _ => None,
        }
    }
}

impl std::fmt::Display for RecordError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Write(e) if e.kind() == std::io::ErrorKind::StorageFull => {
                write!(f, "the log could not be written: no space is left on the disk ({e})")
            }
            Self::Write(e) => write!(f, "the log could not be written: {e}"),
            Self::Encode(e) => write!(f, "the log could not be encoded: {e}"),
            Self::AfterFailure(first) => write!(f, "nothing more can be written to the log: {first}"),
            Self::TooLarge { bytes, limit } => write!(
                f,
                "the log has {bytes} bytes, more than the {limit} allowed; record less often (record.every_steps), \
                 with record.precision f32 or without markers (record.markers 0)"
            ),
            Self::Unresolved => {
                f.write_str("particles.file and particles.log must be read into particles.list before recording")
            }
            Self::Mismatch(what) => write!(f, "the run does not fit the scene that is recorded: {what}"),
        }
    }
}

impl std::error::Error for RecordError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Write(e) => Some(e),
            Self::Encode(e) => Some(e),
            _ => None,
        }
    }
}

impl From<mcap::McapError> for RecordError {
    fn from(error: mcap::McapError) -> Self {
        match error {
            mcap::McapError::Io(e) => Self::Write(e),
            other => Self::Encode(other),
        }
    }
}
