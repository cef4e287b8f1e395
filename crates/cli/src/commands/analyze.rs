//! `agglo analyze`.

use crate::args::AnalyzeArgs;
use crate::failure::{CommandResult, Failure, Message};
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// Not built yet.
pub fn analyze(args: &AnalyzeArgs, _terminal: &Terminal) -> CommandResult {
    Err(Failure::Failed(Message::new(format!("{}: not built yet", args.log.display()))))
}
