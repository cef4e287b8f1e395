//! `agglo export`: writes the particles of a log for other programs.

use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};

use agglo_replay::export::{At, ExportError, Exported, ExtendedXyz, states, vtp};
use agglo_replay::{Log, csv};

use crate::args::{ExportArgs, ExportFormat};
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::interrupt::Interrupt;
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
    let interrupt = Interrupt::install()?;
    let exported = match (args.format, args.at) {
        (ExportFormat::Vtp, At::All) => series(&mut log, args, &interrupt)?,
        _ => file(&mut log, args, &interrupt)?,
    };
    let (states, rows) = (counted(exported.frames, "state"), counted(exported.rows, "row"));
    let name = args.output.path().map_or_else(|| "standard output".to_owned(), |path| path.display().to_string());
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

fn failure(args: &ExportArgs, name: &str, error: ExportError) -> Failure {
    match error {
        ExportError::Log(error) => logs::failure(&args.log, &error),
        ExportError::Write(error) => Failure::write(name, &error),
    }
}

/// Everything in one file.
fn file(log: &mut Log<BufReader<File>>, args: &ExportArgs, interrupt: &Interrupt) -> Result<Exported, Failure> {
    let binary = args.format == ExportFormat::Parquet;
    let open = if binary { Output::open_binary } else { Output::open };
    let output = open(&args.output, args.overwrite)?;
    let name = output.name().to_owned();
    let writer = output.writer().map_err(|error| Failure::write(&name, &error))?;
    let mut writer = BufWriter::with_capacity(BUFFER, interrupt.guard(writer));
    let exported = match args.format {
        ExportFormat::Csv => csv::export(log, args.at, &mut writer),
        ExportFormat::Extxyz => {
            let scene = log.scene().ok();
            let mut xyz = ExtendedXyz::new(&mut writer, scene.as_ref());
            let done = states(log, args.at, |frame, particles| xyz.write(frame, particles));
            done.and_then(|done| xyz.finish().map(|()| done))
        }
        ExportFormat::Vtp => states(log, args.at, |frame, particles| vtp::write(&mut writer, frame, particles)),
        ExportFormat::Parquet => parquet(log, args, &mut writer)?,
    };
    let flushed = exported.and_then(|done| Ok(writer.flush().map(|()| done)?));
    let exported = flushed.map_err(|error| failure(args, &name, error))?;
    drop(writer);
    output.finish()?;
    Ok(exported)
}

#[cfg(feature = "parquet")]
fn parquet(
    log: &mut Log<BufReader<File>>,
    args: &ExportArgs,
    mut writer: &mut (impl Write + Send),
) -> Result<Result<Exported, ExportError>, Failure> {
    use agglo_replay::export::parquet::ParquetWriter;
    let mut file = None;
    let mut out = Some(&mut writer);
    let done = states(log, args.at, |frame, particles| {
        if let Some(out) = out.take() {
            file = Some(ParquetWriter::new(out, frame, particles)?);
        }
        file.as_mut().map_or(Ok(0), |file| file.write(frame, particles))
    });
    let finished = done.and_then(|done| file.map_or(Ok(()), ParquetWriter::finish).map(|()| done));
    Ok(finished)
}

#[cfg(not(feature = "parquet"))]
fn parquet(
    _: &mut Log<BufReader<File>>,
    _: &ExportArgs,
    _: &mut (impl Write + Send),
) -> Result<Result<Exported, ExportError>, Failure> {
    let message = Message::new("this agglo was built without Parquet");
    Err(Failure::Input(message.hint("build it with `--features parquet`, or export CSV")))
}

/// A file per state in a folder beside the collection that lists them.
fn series(log: &mut Log<BufReader<File>>, args: &ExportArgs, interrupt: &Interrupt) -> Result<Exported, Failure> {
    let Some(path) = args.output.path().filter(|path| path.extension().is_some_and(|ending| ending == "pvd")) else {
        let message = Message::new("all states as VTP are many files: a .pvd and a folder beside it");
        return Err(Failure::Input(message.hint("write `-o NAME.pvd`, or choose one state with --at")));
    };
    let folder = path.with_extension("");
    let shown = folder.display().to_string();
    if folder.symlink_metadata().is_ok() && !args.overwrite {
        let message = Message::new(format!("{shown} exists, where the files of the states belong")).file(&shown);
        return Err(Failure::Input(message.hint("name another file, or replace it with --overwrite")));
    }
    let output = Output::open(&args.output, args.overwrite)?;
    let failed = |error: &std::io::Error| Failure::write(&shown, error);
    // The files appear under their names when all of them are complete.
    let parent = output::folder_of(path);
    let beside =
        tempfile::Builder::new().prefix("states.").suffix(".part").tempdir_in(parent).map_err(|e| failed(&e))?;
    let (stem, _) = output::parts(path);
    let mut files: Vec<(f64, String)> = Vec::new();
    let exported = states(log, At::All, |frame, particles| {
        let name = format!("{stem}_{:08}.vtp", frame.step);
        let mut file = BufWriter::with_capacity(BUFFER, interrupt.guard(File::create(beside.path().join(&name))?));
        let rows = vtp::write(&mut file, frame, particles)?;
        files.push((frame.t, format!("{stem}/{name}")));
        Ok(rows)
    });
    let exported = exported.map_err(|error| failure(args, &shown, error))?;
    let writer = output.writer().map_err(|error| Failure::write(output.name(), &error))?;
    vtp::write_collection(BufWriter::new(writer), &files).map_err(|error| failure(args, output.name(), error))?;
    replace(beside, &folder).map_err(|error| failed(&error))?;
    output.finish()?;
    Ok(exported)
}

/// Gives a folder its name; what has that name goes only then.
fn replace(new: tempfile::TempDir, folder: &Path) -> Result<(), std::io::Error> {
    open_to_all(new.path())?;
    let old: Option<PathBuf> = match folder.symlink_metadata() {
        Ok(_) => {
            let aside = new.path().with_extension("old");
            std::fs::rename(folder, &aside)?;
            Some(aside)
        }
        Err(_) => None,
    };
    std::fs::rename(new.keep(), folder)?;
    match old {
        Some(old) if old.is_dir() => std::fs::remove_dir_all(old),
        Some(old) => std::fs::remove_file(old),
        None => Ok(()),
    }
}

/// Temporary folders are the user's own; these are as readable as any other.
fn open_to_all(folder: &Path) -> Result<(), std::io::Error> {
    #[cfg(unix)]
    std::fs::set_permissions(folder, std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
    Ok(())
}
