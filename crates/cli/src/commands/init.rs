//! `agglo init`: writes a scene to start from, or lists them.

use std::fmt::Write;

use agglo_core::Scene;

use crate::args::InitArgs;
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::output;
use crate::scenes::SHIPPED;
use crate::target::Target;
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// An unknown name, a file that exists or cannot be written.
pub fn init(args: &InitArgs, terminal: &Terminal) -> CommandResult {
    let Some(name) = &args.name else {
        output::write_all(&Target::Standard, false, list().as_bytes())?;
        return Ok(Success::Done);
    };
    let Some(scene) = SHIPPED.iter().find(|scene| scene.name == name.as_str()) else {
        return Err(unknown(name));
    };
    let target = args.output.clone().unwrap_or_else(|| Target::Path(format!("{name}.json").into()));
    output::write_all(&target, args.overwrite, scene.text.as_bytes())?;
    if let Some(path) = target.path() {
        terminal.text(&format!("wrote {0}; `agglo run {0}` solves it", path.display()));
    }
    Ok(Success::Done)
}

/// A line per scene: its name and the first sentence of its description.
fn list() -> String {
    let width = SHIPPED.iter().map(|scene| scene.name.len()).max().unwrap_or(0);
    let mut list = String::new();
    for shipped in SHIPPED {
        let description = Scene::parse(shipped.text, &[]).ok().and_then(|scene| scene.description).unwrap_or_default();
        let sentence = description.split_inclusive(". ").next().unwrap_or_default().trim_end();
        _ = writeln!(list, "{:width$}  {sentence}", shipped.name);
    }
    list
}

fn unknown(name: &str) -> Failure {
    let similarity = |other: &str| strsim::jaro_winkler(name, other);
    let nearest = SHIPPED.iter().map(|scene| scene.name).max_by(|a, b| similarity(a).total_cmp(&similarity(b)));
    // Below 0.8, Jaro-Winkler pairs names that no one would confuse.
    let hint = match nearest.filter(|nearest| similarity(nearest) > 0.8) {
        Some(nearest) => format!("did you mean `{nearest}`? `agglo init` lists all"),
        None => "`agglo init` lists them".to_owned(),
    };
    Failure::Input(Message::new(format!("there is no scene `{name}`")).hint(hint))
}
