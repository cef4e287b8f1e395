//! Reads a scene from a file or standard input, and says plainly when what is there is no scene.

use std::io::Read;
use std::path::{Path, PathBuf};

use agglo_core::Scene;
use agglo_core::scene::{ParticleSource, Problem, Setting, locate};

use agglo_replay::DamagedSource;

use crate::failure::{Failure, Message, SceneProblems, Success};
use crate::logs;
use crate::size;
use crate::target::Target;
use crate::terminal::Terminal;

/// Longest scene that is read [bytes]: four million particles written out take about as much.
const LONGEST_SCENE: u64 = 256 << 20;
/// First bytes of every MCAP file.
const LOG_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// A scene that was read and checked; particles that it takes from files are in it.
#[derive(Debug)]
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// The log that its particles come from, where that is damaged.
    pub damaged: Option<DamagedSource>,
    /// Name of its file, `<stdin>` for standard input.
    pub file: String,
    /// Its text.
    text: String,
    /// What was set in it.
    settings: Vec<Setting>,
    /// Name of its file without folder and ending; `stdin` for standard input.
    pub stem: PathBuf,
}

impl LoadedScene {
    /// Warns of a damaged log that particles come from; what is done with the scene is then a success of that kind.
    pub fn success(&self, terminal: &Terminal) -> Success {
        let Some(DamagedSource { path, damage }) = &self.damaged else { return Success::Done };
        logs::warn(path, damage, terminal);
        Success::Damaged
    }

    /// A failure for problems found later, shown where they are in the scene's text.
    pub fn failure(&self, mut problems: Vec<Problem>) -> Failure {
        locate(&mut problems, &self.text, &self.settings);
        Failure::Scene(Box::new(SceneProblems { file: self.file.clone(), text: self.text.clone(), problems }))
    }
}

/// Reads, checks and completes a scene.
///
/// # Errors
/// What cannot be read, and all that is wrong with the scene.
pub fn load(scene: &Target, settings: &[Setting]) -> Result<LoadedScene, Failure> {
    let (bytes, file, base, stem) = match scene {
        Target::Standard => {
            (read(std::io::stdin().lock(), "<stdin>")?, "<stdin>".into(), PathBuf::new(), "stdin".into())
        }
        Target::Path(path) => {
            let file = path.display().to_string();
            let base = path.parent().map(Path::to_owned).unwrap_or_default();
            (read_file(path, &file)?, file, base, path.file_stem().map(PathBuf::from).unwrap_or_default())
        }
    };
    let text = decode(bytes, &file)?;
    let mut scene = match Scene::parse(&text, settings) {
        Ok(scene) => scene,
        Err(problems) => return Err(Failure::Scene(Box::new(SceneProblems { file, text, problems }))),
    };
    let elsewhere = matches!(scene.particles, ParticleSource::File(_) | ParticleSource::Log(_));
    let (problems, damaged) = match agglo_replay::resolve_particles(&mut scene, &base) {
        Err(problem) => (vec![problem], None),
        // What the particles' own file lacks, such as charges, is known only now.
        Ok(damaged) if elsewhere => (scene.validate(), damaged),
        Ok(damaged) => (Vec::new(), damaged),
    };
    let loaded = LoadedScene { scene, damaged, file, text, settings: settings.to_vec(), stem };
    if problems.is_empty() { Ok(loaded) } else { Err(loaded.failure(problems)) }
}

/// The scene of a log, with what is set in it.
///
/// # Errors
/// All that is wrong with the scene.
pub fn recorded(log: &Path, text: String, settings: &[Setting]) -> Result<LoadedScene, Failure> {
    let file = format!("scene.json in {}", log.display());
    match Scene::parse(&text, settings) {
        Ok(scene) => {
            let stem = log.file_stem().map(PathBuf::from).unwrap_or_default();
            Ok(LoadedScene { scene, damaged: None, file, text, settings: settings.to_vec(), stem })
        }
        Err(problems) => Err(Failure::Scene(Box::new(SceneProblems { file, text, problems }))),
    }
}

fn read_file(path: &Path, name: &str) -> Result<Vec<u8>, Failure> {
    let unreadable = |error: &std::io::Error| {
        let message = Message::new(format!("cannot read the scene {name}: {error}")).file(name);
        Failure::Input(match error.kind() {
            std::io::ErrorKind::NotFound => message.hint("`agglo init` lists scenes to start from"),
            _ => message,
        })
    };
    let about = std::fs::metadata(path).map_err(|error| unreadable(&error))?;
    if about.is_dir() {
        let text = format!("{name} is a folder; a scene is a JSON file");
        return Err(Failure::Input(Message::new(text).file(name).hint("name a file in it")));
    }
    let file = std::fs::File::open(path).map_err(|error| unreadable(&error))?;
    if about.len() > LONGEST_SCENE {
        // A log is told apart first: it is the likeliest large file to be taken for a scene.
        let mut start = Vec::new();
        file.take(LOG_MAGIC.len() as u64).read_to_end(&mut start).map_err(|error| unreadable(&error))?;
        return Err(if start == LOG_MAGIC { log_given(name) } else { too_long(name, Some(about.len())) });
    }
    read(file, name)
}

fn read(stream: impl Read, name: &str) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    stream
        .take(LONGEST_SCENE + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Failure::Input(Message::new(format!("cannot read the scene {name}: {error}")).file(name)))?;
    if bytes.len() as u64 > LONGEST_SCENE { Err(too_long(name, None)) } else { Ok(bytes) }
}

fn decode(bytes: Vec<u8>, name: &str) -> Result<String, Failure> {
    if bytes.starts_with(LOG_MAGIC) {
        return Err(log_given(name));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..at].iter().filter(|&&byte| byte == b'\n').count() + 1;
        let byte = error.as_bytes()[at];
        let text = format!("{name} is not UTF-8 text: byte {at} (line {line}) is {byte:#04x}");
        Failure::Input(Message::new(text).file(name).hint("save the scene as UTF-8"))
    })?;
    // Some editors begin a file with a byte-order mark.
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

fn log_given(name: &str) -> Failure {
    let text = format!("{name} is a log, not a scene");
    Failure::Input(Message::new(text).file(name).hint(format!("`agglo info {name}` says what is in it")))
}

fn too_long(name: &str, bytes: Option<u64>) -> Failure {
    let limit = size::human(LONGEST_SCENE);
    let text = match bytes {
        Some(bytes) => format!("{name} has {}; a scene may have {limit}", size::human(bytes)),
        None => format!("{name} is longer than {limit}, the most a scene may have"),
    };
    let hint = "put many particles into a CSV file and name it in `particles.file`";
    Failure::Input(Message::new(text).file(name).hint(hint))
}
