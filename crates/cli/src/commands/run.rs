//! `agglo run`: solves a scene and records it.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use agglo_core::diagnostics::{Level, Notice};
use agglo_core::observer::ObserverError;
use agglo_core::scene::{Compression, Scene};
use agglo_core::{Ending, Flow, Observer, Outcome, RunError, Simulation, StepReport};
use agglo_record::run::INTERRUPTED;
use agglo_record::{BuildInfo, Options, RecordError, Recorded, Recorder};

use super::resume::Earlier;
use crate::args::{COMMIT, RunArgs, VERSION};
use crate::expectation::expect;
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::input::{self, LoadedScene};
use crate::interrupt::Interrupt;
use crate::live::Live;
use crate::output::{self, Kept, Output};
use crate::progress::Progress;
use crate::size;
use crate::summary::Summary;
use crate::target::Target;
use crate::terminal::Terminal;

/// Logs larger than this are announced before they are written [bytes].
const LARGE: u64 = 1 << 30;

/// Where a log is written to.
pub(super) type Writer = Box<dyn std::io::Write + Send>;

/// Runs the command.
///
/// # Errors
/// A scene or an output that cannot be used, before anything is written; later a step that cannot be completed or a
/// full disk, with what was recorded until then kept.
pub fn run(args: &RunArgs, terminal: &Terminal) -> CommandResult {
    let (loaded, mut earlier) = match (&args.resume, &args.scene) {
        (Some(old), _) => Earlier::open(old, &args.set, terminal).map(|(loaded, earlier)| (loaded, Some(earlier)))?,
        (None, Some(scene)) => (input::load(scene, &args.set)?, None),
        (None, None) => return Err(Failure::Input(Message::new("there is no scene to run"))),
    };
    let success = earlier.as_ref().map_or_else(|| loaded.success(terminal), |earlier| earlier.success);
    let target = log_target(args, &loaded)?;
    for written in args.summary.iter().chain(&target) {
        output::differs(written, args.scene.as_ref().and_then(Target::path))?;
        output::differs(written, args.resume.as_deref())?;
        output::check(written, args.overwrite)?;
    }
    let interrupt = Interrupt::install()?;
    let mut simulation = Simulation::new(&loaded.scene).map_err(|error| loaded.failure(error.problems))?;
    if interrupt.asked() {
        return Ok(Success::Interrupted);
    }
    let live = args.live.as_deref().map(|address| Live::start(address, &loaded.scene, terminal)).transpose()?;
    let mut log = match &target {
        Some(target) => {
            let output = Output::open_binary(target, args.overwrite)?;
            announce(&loaded, &simulation, &output, args.max_log, terminal)?;
            Some(Log { recorder: recorder(&loaded, &output, args.max_log, live.as_ref())?, output })
        }
        None => None,
    };
    // Without a log, what is watched is encoded all the same.
    let mut unrecorded = if log.is_none() && live.is_some() { Some(unrecorded(&loaded.scene)?) } else { None };
    if let (Some(live), Some(recorder)) = (&live, &mut unrecorded) {
        recorder.tap(live.tap());
    }
    let started = Instant::now();
    let mut progress = Progress::new(terminal, loaded.scene.duration);
    if let (Some(earlier), Some(log)) = (&mut earlier, &mut log) {
        let watch = |t, step| {
            progress.carried(t, step);
            !interrupt.asked()
        };
        if !earlier.carry(&loaded, &mut simulation, &mut log.recorder, log.output.name(), watch)? {
            terminal.note("interrupted before the earlier log was carried over; nothing was written");
            return Ok(Success::Interrupted);
        }
    }
    let recorder = log.as_mut().map(|log| &mut log.recorder).or(unrecorded.as_mut());
    let mut watcher = Watcher { recorder, progress, interrupt: &interrupt, terminal };
    let result = simulation.run(&mut watcher);
    watcher.progress.finish();
    let ran = Ran { wall: started.elapsed(), result, success, loaded: &loaded, simulation: &simulation, terminal };
    let concluded = ran.conclude(log, args);
    // After the log is whole: who watches may be slow.
    drop(unrecorded);
    if let Some(live) = live {
        live.finish();
    }
    concluded
}

/// A recorder whose log goes nowhere.
fn unrecorded(scene: &Scene) -> Result<Recorder<Writer>, Failure> {
    let mut scene = scene.clone();
    scene.record.compression = Compression::None;
    let build = BuildInfo { version: VERSION.to_owned(), commit: COMMIT.to_owned() };
    let created = Recorder::create(Box::new(std::io::sink()) as Writer, &scene, &build, Options::default());
    created.map_err(|error| log_failure("of nothing", &error))
}

/// The log's place, unless there is none.
fn log_target(args: &RunArgs, loaded: &LoadedScene) -> Result<Option<Target>, Failure> {
    if args.no_log {
        return Ok(None);
    }
    let target = args.output.clone().unwrap_or_else(|| {
        let mut name = PathBuf::from(&loaded.stem).into_os_string();
        name.push(".mcap");
        Target::Path(name.into())
    });
    if args.summary.as_ref() == Some(&target) {
        let text = match target.path() {
            Some(path) => format!("log and summary would both be written to {}", path.display()),
            None => "log and summary would both be written to standard output".to_owned(),
        };
        return Err(Failure::Input(Message::new(text).hint("name a file for one of them")));
    }
    Ok(Some(target))
}

/// Says how large the log will be when it will be large, and refuses what cannot fit.
fn announce(
    loaded: &LoadedScene,
    simulation: &Simulation,
    output: &Output,
    max_log: Option<u64>,
    terminal: &Terminal,
) -> Result<(), Failure> {
    let expectation = expect(&loaded.scene, simulation.particles());
    let (expected, least) = (expectation.expected.total, expectation.least_log);
    let name = output.name();
    let free = output.folder().and_then(|folder| fs4::available_space(folder).ok());
    let smaller = "record less often (`record.every_steps`), in f32 (`record.precision`), or run with --no-log";
    for (room, whose) in [(max_log, "--max-log allows"), (free, "the disk has")] {
        let Some(room) = room else { continue };
        if least > room {
            let (least, room) = (size::human(least), size::human(room));
            let text = format!("the log {name} would take at least {least} and {whose} {room}");
            return Err(Failure::Input(Message::new(text).file(name).hint(smaller)));
        }
        if expected > room {
            let (expected, room) = (size::human(expected), size::human(room));
            let text = format!("the log {name} may take {expected} and {whose} {room}");
            terminal.warning(&Message::new(text).file(name).hint(smaller));
        }
    }
    let text = format!("the log {name} will take about {}", size::human(expected));
    if expected > LARGE {
        terminal.note(text)
    } else {
        terminal.detail(text)
    }
    Ok(())
}

fn recorder(
    loaded: &LoadedScene,
    output: &Output,
    max_log: Option<u64>,
    live: Option<&Live>,
) -> Result<Recorder<Writer>, Failure> {
    let build = BuildInfo { version: VERSION.to_owned(), commit: COMMIT.to_owned() };
    let options = Options { max_bytes: max_log };
    let writer = output.writer().map_err(|error| Failure::write(output.name(), &error))?;
    let failed = |error| log_failure(output.name(), &error);
    let mut recorder = Recorder::create(writer, &loaded.scene, &build, options).map_err(failed)?;
    if let Some(live) = live {
        recorder.tap(live.tap());
    }
    recorder.on_own_thread().map_err(failed)
}

/// A log being written, and the file it goes to.
struct Log {
    recorder: Recorder<Writer>,
    output: Output,
}

/// Shows every step to the recorder, the progress bar and whoever reads notices.
struct Watcher<'a> {
    recorder: Option<&'a mut Recorder<Writer>>,
    progress: Progress,
    interrupt: &'a Interrupt,
    terminal: &'a Terminal,
}

impl Observer for Watcher<'_> {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        if let Some(recorder) = &mut self.recorder {
            recorder.step(report)?;
        }
        self.progress.step(report);
        for notice in report.notices {
            self.progress.aside(|| say(self.terminal, notice));
        }
        if self.interrupt.asked() { Ok(Flow::Stop) } else { Ok(Flow::Continue) }
    }

    fn wants_samples(&self) -> bool {
        self.recorder.is_some()
    }

    fn wants_checkpoints(&self) -> bool {
        self.recorder.is_some()
    }
}

fn say(terminal: &Terminal, notice: &Notice) {
    match notice.level {
        Level::Info => terminal.detail(notice.message.as_str()),
        Level::Warning | Level::Error => terminal.warning(&Message::new(notice.message.as_str())),
    }
}

/// A run that is over.
struct Ran<'a> {
    wall: Duration,
    result: Result<Outcome, RunError>,
    /// How a run that reaches its end succeeds.
    success: Success,
    loaded: &'a LoadedScene,
    simulation: &'a Simulation,
    terminal: &'a Terminal,
}

impl Ran<'_> {
    /// Finishes the log, says what the run came to, and where the log is.
    fn conclude(self, log: Option<Log>, args: &RunArgs) -> CommandResult {
        match &self.result {
            Ok(outcome) => {
                let ending = match outcome.ending {
                    Ending::Finished => None,
                    Ending::Stopped => Some((Level::Warning, INTERRUPTED.to_owned())),
                };
                let stopped = ending.is_some();
                let log = log.map(|log| self.close(log, ending)).transpose()?;
                let bytes = log.as_ref().map(|(recorded, _)| recorded.bytes);
                let summary = Summary::new(&self.loaded.scene, self.simulation, outcome, self.wall, bytes);
                let text = summary.text(log.as_ref().map(|(_, name)| name.as_str()));
                self.terminal.text(&format!("{} at {text}", if stopped { "interrupted" } else { "finished" }));
                if let Some(target) = &args.summary {
                    output::write_all(target, args.overwrite, summary.json().as_bytes())?;
                }
                Ok(if stopped { Success::Interrupted } else { self.success })
            }
            Err(RunError::Observer(error)) => Err(self.recording_failed(error, log)),
            Err(error) => {
                let failure = Failure::Failed(Message::new(error.to_string()).file(&self.loaded.file));
                Err(self.close_failed(log, failure, error.to_string()))
            }
        }
    }

    /// Finishes the log of a run that failed; the failure comes back, after anything that went wrong on top of it.
    fn close_failed(&self, log: Option<Log>, failure: Failure, reason: String) -> Failure {
        let Some(log) = log else { return failure };
        match self.close(log, Some((Level::Error, reason))) {
            Ok((_, name)) => self.terminal.note(format!("the log up to here is {name}")),
            Err(second) => self.terminal.failure(&second),
        }
        failure
    }

    /// Completes a log and gives it its name; returns what was recorded and that name. A run that ended early says why
    /// in its log.
    fn close(&self, log: Log, early: Option<(Level, String)>) -> Result<(Recorded, String), Failure> {
        let Log { mut recorder, output } = log;
        let name = output.name().to_owned();
        let ended_early = early.is_some();
        let noted = early.map_or(Ok(()), |(level, reason)| recorder.note(level, reason));
        let recorded = match noted.and_then(|()| recorder.finish()) {
            Ok(recorded) => recorded,
            Err(error) => {
                let failure = log_failure(output.name(), &error);
                self.keep(output, false)?;
                return Err(failure);
            }
        };
        if ended_early {
            let kept = self.keep(output, true)?;
            return Ok((recorded, kept.unwrap_or(name)));
        }
        output.finish()?;
        Ok((recorded, name))
    }

    /// Keeps a log that is not what was asked for; returns its name where that is another one.
    fn keep(&self, output: Output, whole: bool) -> Result<Option<String>, Failure> {
        let name = output.name().to_owned();
        let Kept::Beside(path) = output.keep(whole)? else { return Ok(None) };
        let kept = path.display().to_string();
        self.terminal.note(if whole {
            format!("{name} is left as it was")
        } else {
            format!("{kept} holds what could be written; `agglo info {kept}` says what of it is whole")
        });
        Ok(Some(kept))
    }

    /// A log that reached its limit is finished; one that could not be written is kept as it is.
    fn recording_failed(&self, error: &ObserverError, log: Option<Log>) -> Failure {
        let (Some(log), Some(error)) = (log, error.downcast_ref::<RecordError>()) else {
            return Failure::Failed(Message::new(error.to_string()));
        };
        let failure = log_failure(log.output.name(), error);
        if matches!(error, RecordError::TooLarge { .. }) {
            return self.close_failed(Some(log), failure, error.to_string());
        }
        // Nothing is worth keeping where nothing went out.
        if log.recorder.bytes_written() > 0
            && let Err(second) = self.keep(log.output, false)
        {
            self.terminal.failure(&second);
        }
        failure
    }
}

pub(super) fn log_failure(name: &str, error: &RecordError) -> Failure {
    match error {
        RecordError::Write(error) => Failure::write(name, error),
        other => Failure::Failed(Message::new(other.to_string()).file(name)),
    }
}
