//! `agglo export`: writes the particles of a log for other programs.

use std::io::BufWriter;

use agglo_replay::csv::{self, At, ExportError};

use crate::args::{ExportArgs, ExportFormat};
use crate::failure::{CommandResult, Failure, Success};
use crate::logs;
use crate::numbers::counted;
use crate::output::{self, Output};
use crate::terminal::Terminal;

/// Bytes gathered before they are written: a table has many short lines.
const BUFFER: usize = 1 << 16;

/// Runs the command. Of a damaged log, what is whole is exported.
///
/// # Errors
/// A log that cannot be read, no state at the time asked for, an output that cannot be written.
pub fn export(args: &ExportArgs, terminal: &Terminal) -> CommandResult {
    let mut log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    output::differs(&args.output, Some(&args.log))?;
    let output = Output::open(&args.output, args.overwrite)?;
    let writer = output.writer().map_err(|error| Failure::write(output.name(), &error))?;
    let mut writer = BufWriter::with_capacity(BUFFER, writer);
    let exported = match args.format {
        ExportFormat::Csv => csv::export(&mut log, args.at, &mut writer),
    };
    let exported = exported.map_err(|error| match error {
        ExportError::Log(error) => logs::failure(&args.log, &error),
        ExportError::Write(error) => Failure::write(output.name(), &error),
    })?;
    drop(writer);
    let name = output.name().to_owned();
    output.finish()?;
    let (states, rows) = (counted(exported.frames, "state"), counted(exported.rows, "row"));
    terminal.detail(format!("wrote {states} in {rows} to {name}"));
    if let (At::Time(time), Some(end)) = (args.at, exported.ends_before) {
        let text = format!("{} ends at t = {end} s, before {time} s; that state was written", args.log.display());
        terminal.note(text);
    }
    // What was asked for may be whole in a log that is not.
    let damage = if exported.damage.is_empty() { log.damage() } else { &exported.damage };
    logs::warn(&args.log, damage, terminal);
    Ok(if damage.is_empty() { Success::Done } else { Success::Damaged })
}
