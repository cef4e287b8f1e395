//! `agglo schema`: the schema of scene files, or of the log's own messages.

use agglo_core::scene::json_schema;
use agglo_record::proto::SOURCES;

use crate::args::{SchemaArgs, SchemaKind};
use crate::failure::{CommandResult, Success};
use crate::output;
use crate::target::Target;

/// Runs the command.
///
/// # Errors
/// Standard output that cannot be written.
pub fn schema(args: &SchemaArgs) -> CommandResult {
    let text = match args.of {
        SchemaKind::Scene => format!("{:#}\n", json_schema()),
        SchemaKind::Messages => {
            SOURCES.iter().map(|(name, text)| format!("// {name}\n\n{text}")).collect::<Vec<_>>().join("\n")
        }
    };
    output::write_all(&Target::Standard, false, text.as_bytes())?;
    Ok(Success::Done)
}
