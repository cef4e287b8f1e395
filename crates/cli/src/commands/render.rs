//! `agglo render`: pictures of a log's states.

use std::io::{BufWriter, Write};
use std::time::{Duration, Instant};

use agglo_render::options::{Format, Options, Quantity, View, When};
use agglo_render::{Drawn, RenderError, draw};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::args::{Background, ProgressKind, RenderArgs, RenderFormat, RenderQuantity};
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::interrupt::Interrupt;
use crate::logs;
use crate::numbers::counted;
use crate::output::{self, Output};
use crate::terminal::Terminal;

/// Bytes gathered before they are written.
const BUFFER: usize = 1 << 16;
/// Time between JSON lines on progress.
const LINE: Duration = Duration::from_secs(1);

/// Runs the command. Of a damaged log, what is whole is drawn.
///
/// # Errors
/// A log that cannot be read, no state at a time asked for, something asked for that the log does not have, an output
/// that cannot be written.
pub fn render(args: &RenderArgs, terminal: &Terminal) -> CommandResult {
    let options = options(args)?;
    let mut log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    output::differs(&args.output, Some(&args.log))?;
    let output = Output::open_binary(&args.output, args.overwrite)?;
    let name = output.name().to_owned();
    let writer = output.writer().map_err(|error| Failure::write(&name, &error))?;
    let mut writer = BufWriter::with_capacity(BUFFER, writer);
    let interrupt = Interrupt::install()?;
    let mut progress = Progress::new(terminal);
    let drawn = draw(&mut log, &options, &mut writer, &mut |done, all| {
        progress.show(done, all);
        !interrupt.asked()
    });
    let flushed = drawn.and_then(|drawn| Ok(writer.flush().map(|()| drawn)?));
    progress.finish();
    let drawn = match flushed {
        Ok(drawn) => drawn,
        Err(RenderError::Stopped) => {
            terminal.note(format!("interrupted; {name} is not written"));
            return Ok(Success::Interrupted);
        }
        Err(error) => return Err(failure(args, &name, error)),
    };
    drop(writer);
    output.finish()?;
    say(args, &drawn, terminal);
    logs::warn(&args.log, &drawn.damage, terminal);
    Ok(if drawn.damage.is_empty() { Success::Done } else { Success::Damaged })
}

/// What is worth knowing about a picture that does not show in it.
fn say(args: &RenderArgs, drawn: &Drawn, terminal: &Terminal) {
    let log = args.log.display().to_string();
    if let Some((time, end)) = drawn.ends_before {
        terminal.note(format!("{log} ends at t = {end} s, before {time} s; that state was drawn"));
    }
    if drawn.lost > 0 {
        let text = format!("{} without a finite place or radius not drawn", counted(drawn.lost as u64, "particle"));
        terminal.warning(&Message::new(text).file(&log).hint("`agglo analyze` says more about such a log"));
    }
    if drawn.valueless > 0 {
        let text = format!("{} whose value is no number drawn in white", counted(drawn.valueless as u64, "particle"));
        terminal.warning(&Message::new(text).file(&log).hint("`agglo analyze` says more about such a log"));
    }
    if drawn.followed && drawn.moments > 1 {
        terminal.detail("the camera goes along with the centre of mass; --still keeps it where it is");
    }
}

fn failure(args: &RenderArgs, name: &str, error: RenderError) -> Failure {
    let log = args.log.display();
    match error {
        RenderError::Log(error) => logs::failure(&args.log, &error),
        RenderError::Write(error) => Failure::write(name, &error),
        RenderError::Asked { text, hint } => {
            Failure::Input(Message::new(format!("{log}: {text}")).hint(hint).file(log))
        }
        RenderError::Stopped => Failure::Failed(Message::new("stopped")),
    }
}

fn options(args: &RenderArgs) -> Result<Options, Failure> {
    Ok(Options {
        at: args.frames.map_or_else(|| args.at.clone(), |count| vec![When::Frames(count)]),
        format: format(args)?,
        size: args.size,
        columns: args.columns,
        color: args.color_by.map(|quantity| match quantity {
            RenderQuantity::Temperature => Quantity::Temperature,
            RenderQuantity::Speed => Quantity::Speed,
            RenderQuantity::Cluster => Quantity::Cluster,
            RenderQuantity::Charge => Quantity::Charge,
            RenderQuantity::None => Quantity::None,
        }),
        range: args.range,
        view: match (args.camera, args.target, args.view) {
            (Some(eye), Some(target), _) => View::Placed { eye, target },
            (_, _, Some([azimuth, elevation])) => View::From { azimuth, elevation },
            _ => View::default(),
        },
        zoom: args.zoom,
        magnified: args.magnify,
        orthographic: args.orthographic,
        still: args.still,
        cluster: args.cluster,
        frames_per_second: args.fps,
        dark: args.background == Background::Dark,
        title: !args.no_title,
        legend: !args.no_legend,
        indexed: args.indexed,
    })
}

/// The format that is asked for, else that of the file's ending.
fn format(args: &RenderArgs) -> Result<Format, Failure> {
    let ending = args.output.path().and_then(|path| path.extension()).map(|ending| ending.to_ascii_lowercase());
    match (args.format, ending.as_ref().and_then(|ending| ending.to_str())) {
        (Some(RenderFormat::Png), _) | (None, Some("png")) => Ok(Format::Png),
        (Some(RenderFormat::Apng), _) | (None, Some("apng")) => Ok(Format::Apng),
        (Some(RenderFormat::Gif), _) | (None, Some("gif")) => Ok(Format::Gif),
        (None, None) if args.output.path().is_none() => Ok(Format::Png),
        (None, _) => {
            let text = match args.output.path() {
                Some(path) => format!("the name {} does not say which kind of picture it is to be", path.display()),
                None => "which kind of picture is it to be?".to_owned(),
            };
            Err(Failure::Input(Message::new(text).hint("end it in .png, .apng or .gif, or give --format")))
        }
    }
}

/// Shows how many moments are drawn.
struct Progress {
    bar: Option<ProgressBar>,
    lines: Option<Terminal>,
    started: Instant,
    shown: Option<Instant>,
}

impl Progress {
    fn new(terminal: &Terminal) -> Self {
        let bar = terminal.draws_bar().then(|| {
            let style = ProgressStyle::with_template("{bar:12} {pos} of {len} pictures  {eta} left");
            let bar = ProgressBar::with_draw_target(Some(0), ProgressDrawTarget::stderr());
            bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        let lines = (terminal.progress == ProgressKind::Json).then_some(*terminal);
        Self { bar, lines, started: Instant::now(), shown: None }
    }

    fn show(&mut self, done: usize, all: usize) {
        if let Some(bar) = self.bar.as_ref().filter(|_| all > 1) {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        }
        if all == 0 {
            return;
        }
        let due = self.shown.is_none_or(|shown| shown.elapsed() >= LINE) || done == all;
        if let Some(terminal) = self.lines.filter(|_| due) {
            self.shown = Some(Instant::now());
            let elapsed = self.started.elapsed().as_secs_f64();
            let remaining = (done > 0).then(|| elapsed * (all - done.min(all)) as f64 / done as f64);
            terminal.json(&serde_json::json!({
                "type": "progress", "pictures": done, "of": all, "elapsed_seconds": elapsed, "remaining_seconds": remaining,
            }));
        }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
