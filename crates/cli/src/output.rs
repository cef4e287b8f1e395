//! Files that appear under their name when they are complete: written beside it first, renamed at the end.

use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::failure::{Failure, Message};
use crate::target::Target;

/// An output being written.
#[derive(Debug)]
pub struct Output {
    name: String,
    sink: Sink,
}

#[derive(Debug)]
enum Sink {
    Standard,
    /// A device or a named pipe, which is written to as it is.
    Device(File),
    /// A file beside its final path.
    Beside {
        file: NamedTempFile,
        path: PathBuf,
        replace: bool,
    },
}

/// Where a file that was written ended up.
#[derive(Debug)]
pub enum Kept {
    /// Under its own name.
    AsNamed,
    /// Under another one, because a good old file has that name.
    Beside(PathBuf),
}

impl Output {
    /// Opens an output. Nothing appears under a file's name yet.
    ///
    /// # Errors
    /// A folder, a file that exists and is not to be replaced, a folder that does not exist or cannot be written to.
    pub fn open(target: &Target, replace: bool) -> Result<Self, Failure> {
        let Some(path) = target.path() else {
            return Ok(Self { name: "standard output".into(), sink: Sink::Standard });
        };
        let name = path.display().to_string();
        let sink = match std::fs::metadata(path) {
            Ok(about) if about.is_dir() => {
                let message = Message::new(format!("cannot write {name}: it is a folder")).file(&name);
                return Err(Failure::Input(message.hint("name a file in it")));
            }
            Ok(about) if !about.is_file() => {
                let file = File::options().write(true).open(path).map_err(|error| Failure::open(path, &error))?;
                Sink::Device(file)
            }
            Ok(_) if !replace => return Err(exists(&name)),
            // Replacing a file through a link keeps the link.
            Ok(_) => beside(&path.canonicalize().map_err(|error| Failure::open(path, &error))?, true)?,
            Err(error) if error.kind() == io::ErrorKind::NotFound => beside(path, replace)?,
            Err(error) => return Err(Failure::open(path, &error)),
        };
        Ok(Self { name, sink })
    }

    /// Opens an output for binary data, which a terminal is spared.
    ///
    /// # Errors
    /// As [`Output::open`], and a terminal.
    pub fn open_binary(target: &Target, replace: bool) -> Result<Self, Failure> {
        if *target == Target::Standard && io::stdout().is_terminal() {
            let message = Message::new("what is written is binary and standard output is a terminal");
            return Err(Failure::Input(message.hint("redirect it to a file or a pipe, or name a file with -o")));
        }
        Self::open(target, replace)
    }

    /// Name for messages.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The folder whose disk fills up; `None` for streams and devices.
    #[must_use]
    pub fn folder(&self) -> Option<&Path> {
        match &self.sink {
            Sink::Beside { path, .. } => Some(folder_of(path)),
            _ => None,
        }
    }

    /// A handle to write to; whoever buffers flushes it.
    ///
    /// # Errors
    /// The system has no more handles.
    pub fn writer(&self) -> io::Result<Box<dyn Write + Send>> {
        Ok(match &self.sink {
            Sink::Standard => Box::new(io::stdout()),
            Sink::Device(file) => Box::new(file.try_clone()?),
            Sink::Beside { file, .. } => Box::new(file.as_file().try_clone()?),
        })
    }

    /// Gives a complete file its name.
    ///
    /// # Errors
    /// A file of that name that appeared meanwhile and is not to be replaced; a failing disk.
    pub fn finish(self) -> Result<(), Failure> {
        self.sink.finish().map_err(|error| match error.kind() {
            io::ErrorKind::AlreadyExists => exists(&self.name),
            _ => Failure::write(&self.name, &error),
        })
    }

    /// Keeps a file that is worth having but not what was asked for: under its name only where that replaces nothing and
    /// the file is `whole`, else beside it.
    ///
    /// # Errors
    /// A failing disk.
    pub fn keep(self, whole: bool) -> Result<Kept, Failure> {
        let Sink::Beside { file, path, .. } = self.sink else { return Ok(Kept::AsNamed) };
        let (stem, ending) = parts(&path);
        let beside = (1..).map(|k| {
            let number = if k == 1 { String::new() } else { format!("-{k}") };
            path.with_file_name(format!("{stem}.incomplete{number}{ending}"))
        });
        let mut file = file;
        for candidate in whole.then(|| path.clone()).into_iter().chain(beside) {
            match file.persist_noclobber(&candidate) {
                Ok(_) if candidate == path => return Ok(Kept::AsNamed),
                Ok(_) => return Ok(Kept::Beside(candidate)),
                Err(failed) if failed.error.kind() == io::ErrorKind::AlreadyExists => file = failed.file,
                Err(failed) => {
                    let name = candidate.display().to_string();
                    // Rather a file under a strange name than none.
                    return match failed.file.keep() {
                        Ok((_, path)) => Ok(Kept::Beside(path)),
                        Err(_) => Err(Failure::write(name, &failed.error)),
                    };
                }
            }
        }
        Ok(Kept::AsNamed)
    }
}

impl Sink {
    fn finish(self) -> io::Result<()> {
        match self {
            Self::Standard => io::stdout().flush(),
            Self::Device(mut file) => file.flush(),
            Self::Beside { file, path, replace: true } => {
                // The old file goes only when the new one is safe.
                file.as_file().sync_all()?;
                Ok(file.persist(path).map(drop)?)
            }
            Self::Beside { file, path, replace: false } => Ok(file.persist_noclobber(path).map(drop)?),
        }
    }
}

/// Writes a whole text or the like.
///
/// # Errors
/// As [`Output::open`] and [`Output::finish`].
pub fn write_all(target: &Target, replace: bool, bytes: &[u8]) -> Result<(), Failure> {
    let output = Output::open(target, replace)?;
    let write = |mut writer: Box<dyn Write + Send>| writer.write_all(bytes).and_then(|()| writer.flush());
    output.writer().and_then(write).map_err(|error| Failure::write(output.name(), &error))?;
    output.finish()
}

/// Says now what [`Output::open`] would say, for an output that is opened late.
///
/// # Errors
/// As [`Output::open`].
pub fn check(target: &Target, replace: bool) -> Result<(), Failure> {
    match target.path().map(std::fs::metadata) {
        // Opening a device or a pipe may block or be seen at its other end.
        Some(Ok(about)) if !about.is_file() && !about.is_dir() => Ok(()),
        _ => Output::open(target, replace).map(drop),
    }
}

fn exists(name: &str) -> Failure {
    let message = Message::new(format!("{name} exists")).file(name);
    Failure::Input(message.hint("name another file, or replace it with --overwrite"))
}

fn beside(path: &Path, replace: bool) -> Result<Sink, Failure> {
    if path.file_name().is_none() {
        let message = Message::new(format!("cannot write {}: it does not name a file", path.display()));
        return Err(Failure::Input(message.file(path.display())));
    }
    let (stem, ending) = parts(path);
    let mut builder = tempfile::Builder::new();
    let (prefix, suffix) = (format!("{stem}."), format!("{ending}.part"));
    builder.prefix(&prefix).suffix(&suffix);
    // As any other file: readable to whom the user's umask allows, not only to the user.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let file = builder.tempfile_in(folder_of(path)).map_err(|error| {
        let folder = folder_of(path);
        if error.kind() == io::ErrorKind::NotFound && !folder.exists() {
            let folder = folder.display();
            let text = format!("cannot write {}: the folder {folder} does not exist", path.display());
            return Failure::Input(Message::new(text).file(path.display()).hint("make it, or write elsewhere"));
        }
        // The error names the temporary file, which would only puzzle.
        let source = io::Error::from(error.kind());
        Failure::open(path, &source)
    })?;
    Ok(Sink::Beside { file, path: path.to_owned(), replace })
}

/// Refuses to write over what is being read, `--overwrite` or not.
///
/// # Errors
/// The two are the same file, by whatever path or link.
pub fn differs(target: &Target, input: Option<&Path>) -> Result<(), Failure> {
    let (Some(target), Some(input)) = (target.path(), input) else { return Ok(()) };
    match (std::fs::canonicalize(target), std::fs::canonicalize(input)) {
        (Ok(target_file), Ok(input_file)) if target_file == input_file && target_file.is_file() => {
            let text = format!("{} would be written over its own input", target.display());
            Err(Failure::Input(Message::new(text).file(target.display()).hint("choose another name")))
        }
        _ => Ok(()),
    }
}

/// Refuses to write two results to the same place.
///
/// # Errors
/// Two of them are the same file, by whatever path, or both standard output.
pub fn distinct<'a>(targets: impl IntoIterator<Item = &'a Target>) -> Result<(), Failure> {
    let mut seen = Vec::new();
    for target in targets {
        let place = target.path().map(|path| {
            let folder = std::fs::canonicalize(folder_of(path)).unwrap_or_else(|_| folder_of(path).to_owned());
            std::fs::canonicalize(path).unwrap_or_else(|_| folder.join(path.file_name().unwrap_or_default()))
        });
        if seen.contains(&place) {
            let name = target.path().map_or("standard output".to_owned(), |path| path.display().to_string());
            let text = format!("two results would be written to {name}");
            return Err(Failure::Input(Message::new(text).hint("give each a name of its own")));
        }
        seen.push(place);
    }
    Ok(())
}

/// The folder that a file is in.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// File name without its ending, and the ending with its dot.
pub fn parts(path: &Path) -> (String, String) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let ending = path.extension().map(|ending| format!(".{}", ending.to_string_lossy())).unwrap_or_default();
    (stem, ending)
}
