//! The scene format: types, text to types, and the checks that a type cannot express.

mod types;

pub use types::*;

/// One thing wrong with a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// JSON pointer of the offending value, such as `/solver/step/initial`; empty for the whole text.
    pub pointer: String,
    /// A sentence with the value and the allowed range.
    pub message: String,
    /// What to do, if that is known.
    pub hint: Option<String>,
    /// Byte range in the scene's text, where it came from a text.
    pub span: Option<std::ops::Range<usize>>,
}

impl Problem {
    /// A problem at a pointer.
    #[must_use]
    pub fn new(pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), message: message.into(), hint: None, span: None }
    }

    /// The same, with a hint.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", if self.pointer.is_empty() { "/" } else { &self.pointer }, self.message)?;
        if let Some(hint) = &self.hint {
            write!(f, " (hint: {hint})")?;
        }
        Ok(())
    }
}
