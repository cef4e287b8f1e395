//! `agglo analyze`: what a log tells, recomputed from states, impacts and scene, and compared with what it says.

mod json;
mod tables;
mod text;

use std::io::{self, Write};

use agglo_replay::analysis::history::Life;
use agglo_replay::analysis::{Analysis, Failed, Options, Sink, StateRow, StepRow, chart, report};

use crate::args::AnalyzeArgs;
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::interrupt::Interrupt;
use crate::logs;
use crate::numbers::short;
use crate::output::{self, Output};
use crate::progress::Progress;
use crate::target::Target;
use crate::terminal::Terminal;
use json::Json;
use tables::Tables;

/// Runs the command. Of a damaged log, what is whole is analysed.
///
/// # Errors
/// A log that cannot be read or lacks its scene, an output that cannot be written.
pub fn analyze(args: &AnalyzeArgs, terminal: &Terminal) -> CommandResult {
    let mut log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    // Whatever cannot be written is noticed before the log is read.
    let interrupt = Interrupt::install()?;
    let outputs = Outputs::open(args)?;
    let shows_progress = terminal.draws_bar() || terminal.progress == crate::args::ProgressKind::Json;
    // Parsing a long scene once more takes a while, and is needed by the bar only.
    let duration = if shows_progress { log.scene().map_or(f64::INFINITY, |scene| scene.duration) } else { 1.0 };
    let mut rows = Rows {
        json: args.json.as_ref().map(|_| Json::new()).transpose().map_err(|error| spool(&error))?,
        tables: outputs.tables,
        progress: Progress::new(terminal, duration),
        interrupt,
        failing: None,
    };
    let result = log.analyze(&Options { every: args.every }, &mut rows);
    rows.progress.finish();
    let analysis = match result {
        Ok(analysis) => analysis,
        Err(Failed::Stopped) => return Ok(Success::Interrupted),
        Err(error) => return Err(rows.failure(args, error)),
    };
    if let Some(tables) = rows.tables {
        tables.finish()?;
    }
    if let (Some(output), Some(json)) = (outputs.json, rows.json) {
        write(output, |to| json.finish(args, &analysis, to))?;
    }
    let drawn = |error: &dyn std::fmt::Display| Failure::Failed(Message::new(format!("cannot draw: {error}")));
    if let Some(output) = outputs.plot {
        let svg = chart::overview(&analysis).map_err(|error| drawn(&error))?;
        write(output, |to| to.write_all(svg.as_bytes()))?;
    }
    if let Some(output) = outputs.report {
        let html = report::html(&analysis, &args.log.display().to_string()).map_err(|error| drawn(&error))?;
        write(output, |to| to.write_all(html.as_bytes()))?;
    }
    let piped = [&args.json, &args.plot, &args.report].into_iter().flatten().any(|to| to.path().is_none());
    if !piped {
        output::write_all(&Target::Standard, false, text::text(args, &analysis).as_bytes())?;
    }
    Ok(conclude(args, &analysis, terminal))
}

/// Says what is lost and what disagrees.
fn conclude(args: &AnalyzeArgs, analysis: &Analysis, terminal: &Terminal) -> Success {
    const GAPS_SHOWN: usize = 10;
    let name = args.log.display().to_string();
    let lost = &analysis.lost;
    logs::warn(&args.log, &lost.damage, terminal);
    let shown = if terminal.verbose { usize::MAX } else { GAPS_SHOWN };
    for gap in lost.gaps.iter().take(shown) {
        terminal.warning(&Message::new(format!("{name} is damaged: {gap}")).file(&name));
    }
    let unsaid = lost.gaps.len().saturating_sub(shown) as u64 + lost.more + lost.more_gaps;
    if unsaid > 0 {
        terminal.warning(&Message::new(format!("{name} is damaged in {unsaid} more places")).file(&name));
    }
    for (term, found) in analysis.agreement.terms() {
        let Some(first) = &found.first else { continue };
        let unit = if term.unit().is_empty() { String::new() } else { format!(" {}", term.unit()) };
        let which = first.index.map_or(String::new(), |index| match term.channel() {
            "/particles.cluster" => format!(" of particle {index}"),
            _ => format!("[{index}]"),
        });
        let text = format!(
            "{name} contradicts itself: {}{which} in {} at t = {} s, step {}, is {:?}{unit}, but {:?}{unit} comes out, {} more \
             or less than the {} allowed",
            term.name(),
            term.channel(),
            first.t,
            first.step,
            first.recorded,
            first.recomputed,
            short(first.size()),
            short(first.tolerance),
        );
        let message = Message::new(text).file(&name);
        terminal.warning(
            &message.hint(format!("`agglo replay {name} --verify` solves it again, which tells what is right")),
        );
    }
    match (analysis.agreement.agrees(), lost.is_empty()) {
        (false, _) => Success::Differs,
        (true, false) => Success::Damaged,
        (true, true) => Success::Done,
    }
}

fn spool(error: &io::Error) -> Failure {
    Failure::Failed(
        Message::new(format!("cannot write a temporary file: {error}"))
            .hint("rows wait there until the log is read; set TMPDIR to a folder with space"),
    )
}

fn write(output: Output, fill: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Failure> {
    let done = output.writer().and_then(|writer| {
        let mut writer = io::BufWriter::with_capacity(1 << 16, writer);
        fill(&mut writer)?;
        writer.flush()
    });
    done.map_err(|error| Failure::write(output.name(), &error))?;
    output.finish()
}

/// What is written to, opened before anything is read.
struct Outputs {
    json: Option<Output>,
    plot: Option<Output>,
    report: Option<Output>,
    tables: Option<Tables>,
}

impl Outputs {
    fn open(args: &AnalyzeArgs) -> Result<Self, Failure> {
        let targets: Vec<&Target> = [&args.json, &args.plot, &args.report].into_iter().flatten().collect();
        output::distinct(targets.iter().copied())?;
        for target in targets {
            output::differs(target, Some(&args.log))?;
        }
        let open =
            |target: &Option<Target>| target.as_ref().map(|target| Output::open(target, args.overwrite)).transpose();
        Ok(Self {
            json: open(&args.json)?,
            plot: open(&args.plot)?,
            report: open(&args.report)?,
            tables: args.csv.as_ref().map(|folder| Tables::open(folder, &args.log, args.overwrite)).transpose()?,
        })
    }
}

/// Takes rows as the log is read.
struct Rows {
    json: Option<Json>,
    tables: Option<Tables>,
    progress: Progress,
    interrupt: Interrupt,
    /// What could not be written.
    failing: Option<String>,
}

impl Rows {
    /// Passes a row on to all that want it.
    fn pass(
        &mut self,
        json: impl FnOnce(&mut Json) -> io::Result<()>,
        tables: impl FnOnce(&mut Tables) -> Result<(), (String, io::Error)>,
    ) -> Result<(), Failed> {
        if let Some(rows) = &mut self.json {
            json(rows)?;
        }
        if let Some(rows) = &mut self.tables
            && let Err((name, error)) = tables(rows)
        {
            self.failing = Some(name);
            return Err(error.into());
        }
        if self.interrupt.asked() { Err(Failed::Stopped) } else { Ok(()) }
    }

    fn failure(&self, args: &AnalyzeArgs, error: Failed) -> Failure {
        match (error, &self.failing) {
            (Failed::Log(error), _) => logs::failure(&args.log, &error),
            (Failed::Sink(error), Some(name)) => Failure::write(name, &error),
            (Failed::Sink(error), None) => spool(&error),
            (error, _) => {
                let name = args.log.display();
                Failure::Input(Message::new(format!("{name} cannot be analysed: {error}")).file(name))
            }
        }
    }
}

impl Sink for Rows {
    fn step(&mut self, row: &StepRow) -> Result<(), Failed> {
        self.progress.carried(row.t, row.step);
        self.pass(|json| json.step(row), |tables| tables.step(row))
    }

    fn state(&mut self, row: &StateRow) -> Result<(), Failed> {
        self.pass(|json| json.state(row), |tables| tables.state(row))
    }

    fn life(&mut self, life: &Life) -> Result<(), Failed> {
        self.pass(|json| json.life(life), |tables| tables.life(life))
    }
}
