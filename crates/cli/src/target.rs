//! Where data comes from or goes to: a file, or a standard stream where the path is `-`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// A file or a standard stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// Standard input or output.
    Standard,
    /// A file.
    Path(PathBuf),
}

impl Target {
    /// The path, unless it is a standard stream.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Standard => None,
            Self::Path(path) => Some(path),
        }
    }
}

impl From<OsString> for Target {
    fn from(text: OsString) -> Self {
        if text == "-" { Self::Standard } else { Self::Path(text.into()) }
    }
}
