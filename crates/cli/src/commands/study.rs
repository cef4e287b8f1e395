//! `agglo study`: speed against error.

use std::time::{Duration, Instant};

use agglo_core::scene::ParticleSource;
use agglo_study::{Failed, Plan, Study, Watcher, chart, page, study as measure, table};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use crate::args::{ProgressKind, StudyArgs};
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::input;
use crate::interrupt::Interrupt;
use crate::output::{self, Output};
use crate::target::Target;
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// A scene that cannot be read or run, no reference, an output that cannot be written.
pub fn study(args: &StudyArgs, terminal: &Terminal) -> CommandResult {
    let loaded = input::load(&args.scene.scene, &args.scene.set)?;
    // Whatever cannot be written is noticed before anything is measured.
    let outputs = Outputs::open(args)?;
    let mut plan = Plan {
        steps: args.steps.clone(),
        tolerances: args.tolerances.clone(),
        repeats: args.repeats as usize,
        budget: args.budget,
        seeds: args.seeds.into(),
        ..Plan::default()
    };
    if !args.schemes.is_empty() {
        plan.schemes.clone_from(&args.schemes);
    }
    if args.seeds > 0 && !matches!(loaded.scene.particles, ParticleSource::RandomCube(_)) {
        let text = "--seeds wants a scene whose particles are drawn: this one names each of them";
        return Err(Failure::Input(Message::new(text).hint("leave --seeds out, or use particles.random_cube")));
    }
    for list in [&mut plan.steps, &mut plan.tolerances] {
        list.sort_by(|a, b| b.total_cmp(a));
        list.dedup();
    }
    let mut progress = Progress::new(terminal)?;
    let found = measure(&loaded.scene, &plan, &mut progress);
    progress.finish();
    let found = match found {
        Ok(found) => found,
        Err(Failed::Stopped) => return Ok(Success::Interrupted),
        Err(Failed::Setup(error)) => return Err(loaded.failure(error.problems)),
        Err(Failed::Reference(error)) => {
            let hint = "a shorter duration, or a smoother scene, can be studied";
            return Err(Failure::Failed(Message::new(error.to_string()).hint(hint)));
        }
    };
    outputs.write(args, &found)?;
    if found.measurements.is_empty() && !found.stopped {
        return Err(Failure::Failed(Message::new("nothing could be measured").hint("give a larger --budget")));
    }
    if found.stopped { Ok(Success::Interrupted) } else { Ok(loaded.success(terminal)) }
}

/// What is written to, opened before anything is measured.
struct Outputs {
    json: Option<Output>,
    csv: Option<Output>,
    svg: Option<Output>,
    markdown: Option<Output>,
    /// Whether standard output is free for the table.
    table: bool,
}

impl Outputs {
    fn open(args: &StudyArgs) -> Result<Self, Failure> {
        let targets: Vec<&Target> = [&args.json, &args.csv, &args.svg, &args.markdown].into_iter().flatten().collect();
        for (k, target) in targets.iter().enumerate() {
            output::differs(target, args.scene.scene.path())?;
            if targets[..k].contains(target) {
                let name = target.path().map_or("standard output".to_owned(), |path| path.display().to_string());
                let text = format!("two results would be written to {name}");
                return Err(Failure::Input(Message::new(text).hint("give each a name of its own")));
            }
        }
        let open =
            |target: &Option<Target>| target.as_ref().map(|target| Output::open(target, args.overwrite)).transpose();
        Ok(Self {
            json: open(&args.json)?,
            csv: open(&args.csv)?,
            svg: open(&args.svg)?,
            markdown: open(&args.markdown)?,
            table: targets.iter().all(|target| target.path().is_some()),
        })
    }

    fn write(self, args: &StudyArgs, study: &Study) -> Result<(), Failure> {
        let failed = |what: &str, error: &dyn std::fmt::Display| {
            Failure::Failed(Message::new(format!("cannot write {what}: {error}")))
        };
        if let Some(output) = self.json {
            let mut text = serde_json::to_string_pretty(study).map_err(|error| failed("JSON", &error))?;
            text.push('\n');
            write(output, &text)?;
        }
        if let Some(output) = self.csv {
            write(output, &table::csv(study).map_err(|error| failed("CSV", &error))?)?;
        }
        if let Some(output) = self.svg {
            write(output, &chart::svg(study, &[]).map_err(|error| failed("the diagram", &error))?)?;
        }
        if let Some(output) = self.markdown {
            let name = args.svg.as_ref().and_then(Target::path).and_then(|path| path.file_name());
            write(output, &page::markdown(study, name.map(|name| name.to_string_lossy()).as_deref()))?;
        }
        if self.table {
            output::write_all(&Target::Standard, false, table::text(study).as_bytes())?;
        }
        Ok(())
    }
}

fn write(output: Output, text: &str) -> Result<(), Failure> {
    let done = output.writer().and_then(|mut writer| {
        writer.write_all(text.as_bytes())?;
        writer.flush()
    });
    done.map_err(|error| Failure::write(output.name(), &error))?;
    output.finish()
}

/// Cases done, on a terminal or as JSON lines; stops on Ctrl-C.
struct Progress {
    bar: Option<ProgressBar>,
    lines: bool,
    shown: Option<Instant>,
    started: Instant,
    interrupt: Interrupt,
}

impl Progress {
    fn new(terminal: &Terminal) -> Result<Self, Failure> {
        let bar = terminal.draws_bar().then(|| {
            let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
            bar.set_style(ProgressStyle::with_template("{wide_msg}").unwrap_or_else(|_| ProgressStyle::default_bar()));
            bar
        });
        let lines = terminal.progress == ProgressKind::Json;
        Ok(Self { bar, lines, shown: None, started: Instant::now(), interrupt: Interrupt::install()? })
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Watcher for Progress {
    fn next(&mut self, done: usize, planned: usize, what: &str) -> bool {
        let count = if planned == 0 { String::new() } else { format!("{} of {planned}: ", done + 1) };
        if let Some(bar) = &self.bar {
            bar.set_message(format!("{count}{what}"));
        }
        if self.lines && self.shown.is_none_or(|shown| shown.elapsed() >= Duration::from_secs(1)) {
            self.shown = Some(Instant::now());
            let line = serde_json::json!({
                "type": "progress", "done": done, "planned": planned, "what": what,
                "elapsed_seconds": self.started.elapsed().as_secs_f64(),
            });
            // A standard error that cannot be written to is ignored: there is nowhere left to say so.
            _ = std::io::Write::write_all(&mut std::io::stderr(), format!("{line}\n").as_bytes());
        }
        !self.interrupt.asked()
    }
}
