//! x
use crate::args::InfoArgs;
use crate::failure::{CommandResult, Success};
use crate::terminal::Terminal;
/// x
pub fn info(_: &InfoArgs, _: &Terminal) -> CommandResult {
    Ok(Success::Done)
}
