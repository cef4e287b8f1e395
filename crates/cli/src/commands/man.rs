//! `agglo man`: manual pages, generated from the command line's definition.

use std::io;

use clap::{Command, CommandFactory};

use crate::args::{Cli, ManArgs};
use crate::failure::{CommandResult, Failure, Success};
use crate::output;
use crate::target::Target;
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// A folder that cannot be made, pages that exist or cannot be written.
pub fn man(args: &ManArgs, terminal: &Terminal) -> CommandResult {
    let pages = pages().map_err(|error| Failure::write("the manual pages", &error))?;
    std::fs::create_dir_all(&args.dir).map_err(|error| Failure::open(&args.dir, &error))?;
    let targets: Vec<_> = pages.iter().map(|(name, _)| Target::Path(args.dir.join(name))).collect();
    // All or none: a page that exists is noticed before the first is written.
    targets.iter().try_for_each(|target| output::check(target, args.overwrite))?;
    for (target, (_, page)) in targets.iter().zip(&pages) {
        output::write_all(target, args.overwrite, page)?;
    }
    terminal.text(&format!("wrote {} manual pages to {}", pages.len(), args.dir.display()));
    Ok(Success::Done)
}

/// File names and contents.
fn pages() -> io::Result<Vec<(String, Vec<u8>)>> {
    // `agglo help` prints what the pages say.
    let mut root = Cli::command().disable_help_subcommand(true);
    root.build();
    let mut pages = vec![("agglo.1".to_owned(), page(root.clone())?)];
    for command in root.get_subcommands() {
        let name = format!("agglo-{}", command.get_name());
        let page = page(command.clone().name(name.clone()).display_name(name.clone()))?;
        pages.push((format!("{name}.1"), page));
    }
    Ok(pages)
}

fn page(command: Command) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page)?;
    Ok(page)
}
