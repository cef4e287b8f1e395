//! `agglo recover`.

use crate::args::RecoverArgs;
use crate::failure::{CommandResult, Failure, Message};
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// Not built yet.
pub fn recover(args: &RecoverArgs, _terminal: &Terminal) -> CommandResult {
    Err(Failure::Failed(Message::new(format!("{}: not built yet", args.log.display()))))
}
