//! `agglo recover`: a valid log of all that is whole in a damaged one.

use agglo_replay::recover::{RecoverError, recover as write};

use crate::args::RecoverArgs;
use crate::failure::{CommandResult, Failure, Message, Success};
use crate::interrupt::Interrupt;
use crate::logs;
use crate::numbers::counted;
use crate::output::{self, Output};
use crate::terminal::Terminal;

/// Runs the command.
///
/// # Errors
/// A log of which nothing can be read, an output that cannot be written.
pub fn recover(args: &RecoverArgs, terminal: &Terminal) -> CommandResult {
    let mut log = logs::open(&args.log).map_err(|error| logs::failure(&args.log, &error))?;
    output::differs(&args.output, Some(&args.log))?;
    let interrupt = Interrupt::install()?;
    let output = Output::open_binary(&args.output, args.overwrite)?;
    let name = output.name().to_owned();
    let writer = output.writer().map_err(|error| Failure::write(&name, &error))?;
    let writer = std::io::BufWriter::with_capacity(1 << 16, interrupt.guard(writer));
    let recovered = write(&mut log, writer).map_err(|error| match error {
        RecoverError::Log(error) => logs::failure(&args.log, &error),
        RecoverError::Nothing(damage) => {
            logs::warn(&args.log, &damage, terminal);
            let log = args.log.display();
            Failure::Input(Message::new(format!("{log}: not one message in it is whole")).file(log))
        }
        RecoverError::Write(error) => Failure::write(&name, &error),
    })?;
    output.finish()?;
    logs::warn(&args.log, &recovered.damage, terminal);
    let (messages, states) = (counted(recovered.messages, "message"), counted(recovered.frames, "recorded state"));
    terminal.note(format!("{name} holds {messages}, {states}"));
    Ok(if recovered.damage.is_empty() { Success::Done } else { Success::Damaged })
}
