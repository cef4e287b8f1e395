//! `agglo diff`.

use crate::args::DiffArgs;
use crate::failure::{CommandResult, Failure, Message};
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// Not built yet.
pub fn diff(args: &DiffArgs, _terminal: &Terminal) -> CommandResult {
    Err(Failure::Failed(Message::new(format!("{}: not built yet", args.a.display()))))
}
