//! The program `agglo`: reads scenes, runs and records them, and looks into the logs.
//!
//! Data goes to standard output, messages and progress to standard error. This file is the only place where what a
//! command came to becomes an exit code.

mod args;
mod commands;
mod expectation;
mod failure;
mod input;
mod interrupt;
#[cfg_attr(not(feature = "live"), path = "live/without.rs")]
mod live;
mod logs;
mod numbers;
mod output;
mod progress;
mod scenes;
mod size;
mod summary;
mod target;
mod terminal;
mod terms;

use std::process::ExitCode;

use agglo_core::simd::Level;
use clap::Parser;
use clap::error::ErrorKind;

use args::{Cli, Command, ErrorFormat, Global, InstructionSet};
use failure::{CommandResult, Failure, Message, Success};
use terminal::Terminal;

fn main() -> ExitCode {
    report_bugs();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    let terminal = Terminal::new(&cli.global);
    let result = threads(&cli.global)
        .and_then(|()| instructions(cli.global.simd))
        .and_then(|()| dispatch(&cli.command, &terminal));
    if let Err(failure) = &result {
        terminal.failure(failure);
    }
    exit_code(&result)
}

fn dispatch(command: &Command, terminal: &Terminal) -> CommandResult {
    match command {
        Command::Run(args) => commands::run::run(args, terminal),
        Command::Check(args) => commands::check::check(args, terminal),
        Command::Init(args) => commands::init::init(args, terminal),
        Command::Info(args) => commands::info::info(args, terminal),
        Command::Analyze(args) => commands::analyze::analyze(args, terminal),
        Command::Replay(args) => commands::replay::replay(args, terminal),
        Command::Diff(args) => commands::diff::diff(args, terminal),
        Command::Recover(args) => commands::recover::recover(args, terminal),
        Command::Render(args) => commands::render::render(args, terminal),
        Command::Export(args) => commands::export::export(args, terminal),
        Command::Study(args) => commands::study::study(args, terminal),
        Command::View(args) => commands::view::view(args, terminal),
        Command::Schema(args) => commands::schema::schema(args),
        Command::Completions(args) => commands::completions::completions(args),
        Command::Man(args) => commands::man::man(args, terminal),
    }
}

/// 0 done · 1 ran and failed, or differs · 2 bad input or usage · 3 done, but the input is damaged · 130 interrupted; a panic, which
/// is a bug, gives 101.
fn exit_code(result: &CommandResult) -> ExitCode {
    ExitCode::from(match result {
        Ok(Success::Done) | Err(Failure::ClosedPipe) => 0,
        Ok(Success::Damaged) => 3,
        Ok(Success::Interrupted) | Err(Failure::Interrupted) => interrupt::EXIT_CODE,
        Ok(Success::Differs) | Err(Failure::Failed(_)) => 1,
        Err(Failure::Input(_) | Failure::Scene(_)) => 2,
    })
}

/// Says what is wrong with the command line, or prints the help that was asked for.
fn usage(error: &clap::Error) -> ExitCode {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        return match error.print() {
            // A closed pipe is no failure; anything else is, but there may be nobody to tell.
            Err(failed) if failed.kind() != std::io::ErrorKind::BrokenPipe => ExitCode::from(1),
            _ => ExitCode::SUCCESS,
        };
    }
    // The command line could not be read, so its wish for JSON is looked for by hand.
    let arguments: Vec<_> = std::env::args_os().collect();
    let json = arguments.iter().any(|a| a == "--errors=json")
        || arguments.windows(2).any(|pair| pair[0] == "--errors" && pair[1] == "json");
    if json {
        let text = error.render().to_string();
        let text = text.strip_prefix("error: ").unwrap_or(&text);
        let global = Global { errors: ErrorFormat::Json, ..Global::default() };
        Terminal::new(&global).failure(&Failure::Input(Message::new(text.trim_end())));
    } else {
        _ = error.print();
    }
    ExitCode::from(2)
}

/// Sets the number of threads for the whole program.
fn threads(options: &Global) -> Result<(), Failure> {
    let Some(threads) = options.threads else { return Ok(()) };
    rayon::ThreadPoolBuilder::new().num_threads(threads.into()).build_global().map_err(|error| {
        Failure::Input(
            Message::new(format!("cannot start {threads} threads: {error}")).hint("give a smaller --threads"),
        )
    })
}

/// Limits the instruction sets for the whole program.
fn instructions(set: InstructionSet) -> Result<(), Failure> {
    let (level, name) = match set {
        InstructionSet::Auto => return Ok(()),
        InstructionSet::Avx512 => (Level::Avx512, "AVX-512"),
        InstructionSet::Avx2 => (Level::Avx2, "AVX2"),
        InstructionSet::Portable => (Level::Portable, "portable code"),
    };
    if !level.available() {
        let message = Message::new(format!("this machine does not have {name}"));
        return Err(Failure::Input(message.hint("leave --simd out: results do not depend on it")));
    }
    agglo_core::simd::limit(level);
    Ok(())
}

/// A panic is a bug in this program; the message says so before the usual one.
fn report_bugs() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |about| {
        let version = args::VERSION;
        terminal::last_words(&format!(
            "this is a bug in agglo {version} ({}); please report it with the scene and the lines that follow",
            args::COMMIT
        ));
        usual(about);
    }));
}
