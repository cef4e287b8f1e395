//! Opening logs, and what it means when one cannot be read.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use agglo_replay::{Damage, Log, LogError};

use crate::failure::{Failure, Message};
use crate::output;
use crate::terminal::Terminal;

/// Parts of a damaged log that are named; `-v` names all.
const DAMAGE_SHOWN: usize = 10;

/// Opens a log.
///
/// # Errors
/// As [`Log::open`].
pub fn open(path: &Path) -> Result<Log<BufReader<File>>, LogError> {
    Log::open(path)
}

/// A log that cannot be used is bad input.
pub fn failure(path: &Path, error: &LogError) -> Failure {
    let name = path.display();
    let message = match error {
        LogError::Io(error) if error.kind() == std::io::ErrorKind::IsADirectory => {
            Message::new(format!("{name} is a folder; a log is a file")).hint("name a file in it")
        }
        LogError::Io(error) if error.kind() == std::io::ErrorKind::NotFound && path == Path::new("-") => {
            Message::new("a log cannot come from standard input: its index stands at its end")
                .hint("save it to a file, and name that")
        }
        LogError::Io(error) => {
            let message = Message::new(format!("cannot read the log {name}: {error}"));
            match left_behind(path).filter(|_| error.kind() == std::io::ErrorKind::NotFound) {
                Some(part) => {
                    let part = part.display();
                    message.hint(format!("a run left {part} unfinished; `agglo info {part}` says what of it is whole"))
                }
                None => message,
            }
        }
        LogError::NotALog(_) | LogError::Foreign(_) => {
            Message::new(format!("{name}: {error}")).hint("`agglo run` writes logs")
        }
        LogError::Damaged(_) => {
            Message::new(format!("{name}: {error}")).hint(format!("`agglo info {name} --check` says what is left"))
        }
        _ => Message::new(format!("{name}: {error}")),
    };
    Failure::Input(message.file(name))
}

/// The newest file that a run began to write in place of `path` and did not finish.
fn left_behind(path: &Path) -> Option<PathBuf> {
    let folder = output::folder_of(path);
    let entries = std::fs::read_dir(folder).ok()?;
    let (stem, ending) = output::parts(path);
    let (start, end) = (format!("{stem}."), format!("{ending}.part"));
    let parts = entries.flatten().filter_map(|entry| {
        let name = entry.file_name().into_string().ok()?;
        let is_part = name.len() > start.len() + end.len() && name.starts_with(&start) && name.ends_with(&end);
        is_part.then(|| (entry.metadata().and_then(|about| about.modified()).ok(), name))
    });
    let (_, name) = parts.max()?;
    // As it would be typed: without a folder that was not given.
    Some(if folder == Path::new(".") { name.into() } else { folder.join(name) })
}

/// Warns of what is lost.
pub fn warn(path: &Path, damage: &[Damage], terminal: &Terminal) {
    let shown = if terminal.verbose { usize::MAX } else { DAMAGE_SHOWN };
    let name = path.display().to_string();
    for lost in damage.iter().take(shown) {
        terminal.warning(&Message::new(format!("{name} is damaged at {lost}")).file(&name));
    }
    if damage.len() > shown {
        let text = format!("{name} is damaged in {} more places, which -v names", damage.len() - shown);
        terminal.warning(&Message::new(text).file(name));
    }
}
