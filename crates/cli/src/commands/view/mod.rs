//! `agglo view`: shows a log in a viewer.

mod rerun;
#[cfg(feature = "view")]
mod server;
#[cfg(feature = "view")]
mod site;

#[cfg(feature = "view")]
use server::serve;
#[cfg(not(feature = "view"))]
use {agglo_replay::Log, std::fs::File, std::io::BufReader};

use crate::args::ViewArgs;
#[cfg(not(feature = "view"))]
use crate::failure::Failure;
use crate::failure::{CommandResult, Message, Success};
use crate::logs;
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// A log that cannot be read, a port that cannot be had, a viewer that is missing or fails.
pub fn view(args: &ViewArgs, terminal: &Terminal) -> CommandResult {
    let mut log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    let damage = log.damage().to_vec();
    logs::warn(&args.log, &damage, terminal);
    let success = if damage.is_empty() { Success::Done } else { Success::Damaged };
    if !damage.is_empty() {
        let name = args.log.display();
        let text = format!("viewers refuse a damaged log, or show less of it than there is in {name}");
        terminal.warning(&Message::new(text).hint(format!("`agglo recover {name} -o NEW` makes a whole one")));
    }
    let shown = if args.rerun { rerun::show(&mut log, &args.log, terminal) } else { serve(&mut log, args, terminal) };
    shown.map(|()| success)
}

/// Says how to get what serves logs.
#[cfg(not(feature = "view"))]
fn serve(_: &mut Log<BufReader<File>>, _: &ViewArgs, _: &Terminal) -> Result<(), Failure> {
    Err(Failure::Input(
        Message::new("this agglo was built without the cargo feature `view`, which serves logs")
            .hint("`cargo install --path crates/cli` builds one with it; the log opens in viewers by hand as well"),
    ))
}
