//! `agglo info`: what is in a log, whole or damaged.

use std::fmt::Write;

use agglo_replay::{Damage, Info, LogError, text};
use serde_json::{Value, json};

use crate::args::InfoArgs;
use crate::failure::{CommandResult, Success};
use crate::logs;
use crate::numbers::{counted, short};
use crate::output;
use crate::size;
use crate::target::Target;
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// A file that is no log or cannot be read.
pub fn info(args: &InfoArgs, terminal: &Terminal) -> CommandResult {
    let info = match read(args) {
        Ok(info) => info,
        // Too little is left to say anything else about it, but that is an answer too.
        Err(LogError::Damaged(damage)) => {
            let text = unreadable(args, &damage);
            output::write_all(&Target::Standard, false, text.as_bytes())?;
            logs::warn(&args.log, &[damage], terminal);
            return Ok(Success::Damaged);
        }
        Err(error) => return Err(logs::failure(&args.log, &error)),
    };
    let text = if args.json { format!("{:#}\n", as_json(args, &info)) } else { as_text(args, &info) };
    output::write_all(&Target::Standard, false, text.as_bytes())?;
    logs::warn(&args.log, &info.damage, terminal);
    Ok(if info.is_whole() { Success::Done } else { Success::Damaged })
}

fn read(args: &InfoArgs) -> Result<Info, LogError> {
    let mut log = logs::open(&args.log)?;
    if args.check { log.check().map(|checked| checked.info) } else { log.info() }
}

/// What is known of a log of which nothing can be read.
fn unreadable(args: &InfoArgs, damage: &Damage) -> String {
    let file = args.log.display().to_string();
    let bytes = std::fs::metadata(&args.log).map_or(0, |about| about.len());
    if args.json {
        let damage = json!([{ "offset": damage.offset, "what": damage.what }]);
        let object = json!({
            "format": 1, "file": file, "bytes": bytes, "checked": args.check, "damaged": true, "readable": false,
            "damage": damage,
        });
        return format!("{object:#}\n");
    }
    format!("{:<11} {file}, damaged, {}\n{:<11} nothing can be read\n", "log", size::human(bytes), "messages")
}

fn as_text(args: &InfoArgs, info: &Info) -> String {
    let mut page = String::new();
    let mut row = |name: &str, value: String| _ = writeln!(page, "{name:<11} {}", text::line(&value));
    let run = &info.run;
    let state = match (info.is_whole(), args.check) {
        (false, _) => format!("damaged in {}", counted(info.damage.len() as u64, "place")),
        (true, true) => "whole: all of it was read and every checksum is right".to_owned(),
        (true, false) => "whole as far as its index tells; --check reads all of it".to_owned(),
    };
    row("log", format!("{}, {}, {state}", args.log.display(), size::human(info.size)));
    let name = if run.scene_name.is_empty() { "without a name" } else { &run.scene_name };
    row("scene", format!("{name}, hash {}", run.scene_hash));
    row("run", format!("model {}, seed {}, {}", run.model, run.seed, counted(run.particles, "particle")));
    row("terms", run.terms.join(", "));
    if let (Some(start), Some(end)) = (info.start, info.end) {
        let (steps, frames) = (counted(info.steps, "step"), counted(info.frames, "recorded state"));
        row("time", format!("{} to {} s, {steps}, {frames}", short(start), short(end)));
    }
    if run.time_scale != 1.0 {
        row("time scale", format!("{} s of log time per simulated second", short(run.time_scale)));
    }
    let (major, minor) = run.log_format;
    row("written by", format!("agglo {} (commit {}), log format {major}.{minor}", run.build.version, run.build.commit));
    let attachments = info.attachments.iter().map(|(name, bytes)| format!("{name} ({})", size::human(*bytes)));
    row("attached", attachments.collect::<Vec<_>>().join(", "));
    row("chunks", info.chunks.to_string());
    let width = |of: fn(&agglo_replay::ChannelInfo) -> usize| info.channels.iter().map(of).max().unwrap_or(0);
    let (names, schemas) = (width(|channel| channel.name.len()), width(|channel| channel.schema.len()));
    for (k, channel) in info.channels.iter().enumerate() {
        let label = if k == 0 { "channels" } else { "" };
        let (name, schema) = (&channel.name, &channel.schema);
        row(label, format!("{name:names$}  {schema:schemas$}  {}", counted(channel.messages, "message")));
    }
    page
}

fn as_json(args: &InfoArgs, info: &Info) -> Value {
    let run = &info.run;
    let (major, minor) = run.log_format;
    let channels = info
        .channels
        .iter()
        .map(|channel| json!({ "topic": channel.name, "schema": channel.schema, "messages": channel.messages }));
    let attachments = info.attachments.iter().map(|(name, bytes)| json!({ "name": name, "bytes": bytes }));
    let damage = info.damage.iter().map(|damage| json!({ "offset": damage.offset, "what": damage.what }));
    json!({
        "format": 1, "file": args.log.display().to_string(), "bytes": info.size, "checked": args.check,
        "damaged": !info.is_whole(), "readable": true,
        "log_format": format!("{major}.{minor}"), "version": run.build.version, "commit": run.build.commit,
        "scene": { "name": run.scene_name, "hash": run.scene_hash }, "model": run.model, "seed": run.seed,
        "particles": run.particles, "time_scale": run.time_scale, "terms": run.terms, "start": info.start,
        "end": info.end, "steps": info.steps, "recorded_states": info.frames, "chunks": info.chunks,
        "attachments": attachments.collect::<Vec<_>>(), "channels": channels.collect::<Vec<_>>(),
        "damage": damage.collect::<Vec<_>>(),
    })
}
