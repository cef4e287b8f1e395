//! Why there is no picture.

use agglo_replay::LogError;
use agglo_replay::export::ExportError;

/// A picture that could not be made.
#[derive(Debug)]
pub enum RenderError {
    /// The log could not be read, or holds no state at a time asked for.
    Log(LogError),
    /// The output refused bytes.
    Write(std::io::Error),
    /// What was asked for is not in the log, or cannot be drawn: a sentence, and what to do.
    Asked {
        /// What, and the allowed range.
        text: String,
        /// What to do.
        hint: String,
    },
    /// Whoever watches asked to stop.
    Stopped,
}

impl RenderError {
    /// Something that cannot be drawn.
    pub(crate) fn asked(text: impl Into<String>, hint: impl Into<String>) -> Self {
        Self::Asked { text: text.into(), hint: hint.into() }
    }
}

impl std::fmt::Display for RenderError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Log(error) => error.fmt(f),
            Self::Write(error) => write!(f, "the picture could not be written: {error}"),
            Self::Asked { text, hint } => write!(f, "{text}; {hint}"),
            Self::Stopped => f.write_str("stopped"),
        }
    }
}

impl std::error::Error for RenderError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::Log(error) => Some(error),
            Self::Write(error) => Some(error),
            Self::Asked { .. } | Self::Stopped => None,
        }
    }
}

impl From<LogError> for RenderError {
    fn from(error: LogError) -> Self {
        Self::Log(error)
    }
}

impl From<std::io::Error> for RenderError {
    fn from(error: std::io::Error) -> Self {
        Self::Write(error)
    }
}

impl From<ExportError> for RenderError {
    fn from(error: ExportError) -> Self {
        match error {
            ExportError::Log(error) => Self::Log(error),
            ExportError::Write(error) => Self::Write(error),
        }
    }
}
