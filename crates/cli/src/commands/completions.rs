//! `agglo completions`: a shell's completion script, generated from the command line's definition.

use clap::CommandFactory;

use crate::args::{Cli, CompletionsArgs};
use crate::failure::{CommandResult, Success};
use crate::output;
use crate::target::Target;

/// Runs the command.
///
/// # Errors
/// Standard output that cannot be written.
pub fn completions(args: &CompletionsArgs) -> CommandResult {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "agglo", &mut script);
    output::write_all(&Target::Standard, false, &script)?;
    Ok(Success::Done)
}
