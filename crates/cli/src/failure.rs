//! What a command can come to; `main` turns it into an exit code.

use std::fmt::Display;
use std::io;
use std::path::Path;

use agglo_core::scene::Problem;

use crate::interrupt::Stopped;

/// A command that did what it was asked to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Success {
    /// All of it.
    Done,
    /// All that was possible: the input is damaged, or data was lost.
    Damaged,
    /// Up to where it was interrupted.
    Interrupted,
    /// All of it, and what was compared differs.
    Differs,
}

/// A command that did not.
#[derive(Debug)]
pub enum Failure {
    /// Bad input or usage: a sentence and a hint.
    Input(Message),
    /// Things wrong with a scene.
    Scene(Box<SceneProblems>),
    /// It ran and failed: a sentence and a hint.
    Failed(Message),
    /// The reader of standard output went away; nobody is left to tell.
    ClosedPipe,
    /// The user asked to stop, and what was begun is taken away.
    Interrupted,
}

/// What every command returns.
pub type CommandResult = Result<Success, Failure>;

/// A sentence, with what to do about it.
#[derive(Debug)]
pub struct Message {
    /// What, where, the value, the allowed range.
    pub text: String,
    /// What to do.
    pub hint: Option<String>,
    /// The file it is about.
    pub file: Option<String>,
}

impl Message {
    /// A sentence.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), hint: None, file: None }
    }

    /// The same with a hint.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// The same about a file, which the sentence need not name.
    pub fn file(mut self, file: impl Display) -> Self {
        self.file = Some(file.to_string());
        self
    }
}

/// Things wrong with a scene, and the text they are in.
#[derive(Debug)]
pub struct SceneProblems {
    /// Name of the file, `<stdin>` for standard input.
    pub file: String,
    /// The scene's text.
    pub text: String,
    /// What is wrong.
    pub problems: Vec<Problem>,
}

impl Failure {
    /// An output that could not be opened: bad usage, because nothing was done yet.
    pub fn open(path: &Path, error: &io::Error) -> Self {
        Self::Input(Message::new(format!("cannot write {}: {error}", path.display())).file(path.display()))
    }

    /// Something that could not be written; a closed pipe is told apart.
    pub fn write(name: impl Display, error: &io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            return Self::ClosedPipe;
        }
        if error.get_ref().is_some_and(|source| source.is::<Stopped>()) {
            return Self::Interrupted;
        }
        let message = Message::new(format!("cannot write {name}: {error}")).file(name);
        Self::Failed(match error.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                message.hint("free some space, or write elsewhere")
            }
            _ => message,
        })
    }
}
