//! A log in Rerun: converted, with the blueprint that fits its scene.

use std::ffi::OsString;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

use agglo_replay::Log;

use crate::failure::{Failure, Message};
use crate::interrupt::Interrupt;
use crate::logs;
use crate::terminal::Terminal;

/// Names Rerun's program where it is not `rerun` on the path.
const PROGRAM: &str = "AGGLO_RERUN";

/// Blueprints are for recordings of this application.
const APPLICATION: &str = "agglo";

/// Stands for the radius of the particles in a blueprint, as `viewer/rerun_blueprint.py` writes it.
const RADIUS: [u8; 4] = 0x3803_CAFE_u32.to_le_bytes();

/// Blueprints by what a scene has: temperatures, clusters.
const BLUEPRINTS: [[&[u8]; 2]; 2] = [
    [include_bytes!("../../../viewer/rerun/plain.rbl.zst"), include_bytes!("../../../viewer/rerun/clusters.rbl.zst")],
    [
        include_bytes!("../../../viewer/rerun/thermal.rbl.zst"),
        include_bytes!("../../../viewer/rerun/thermal-clusters.rbl.zst"),
    ],
];

/// Shows a log in Rerun, until that is closed.
///
/// # Errors
/// Rerun that is missing or fails; a disk without room for the converted log.
pub fn show(log: &mut Log<BufReader<File>>, path: &Path, terminal: &Terminal) -> Result<(), Failure> {
    let interrupt = Interrupt::install()?;
    let failed = |error: io::Error| Failure::Failed(Message::new(format!("cannot prepare the log for Rerun: {error}")));
    let terms = log.run().terms.clone();
    let has = |term: &str| terms.iter().any(|name| name == term);
    let radius = 0.5 * log.particles().map_err(|error| logs::failure(path, &error))?.mean_diameter();
    let arranged = blueprint(has("thermal"), has("binding") || has("clusters"), radius as f32).map_err(failed)?;

    // Gone with everything in it when Rerun is closed.
    let folder = tempfile::tempdir().map_err(failed)?;
    let parts = folder.path().join("parts");
    std::fs::create_dir(&parts).map_err(failed)?;
    let (converted, arrangement) = (parts.join("log.rrd"), parts.join("agglo.rbl"));
    // The window takes its title from this name.
    let shown = folder.path().join(path.file_stem().unwrap_or_default()).with_extension("rrd");
    std::fs::write(&arrangement, arranged).map_err(failed)?;

    terminal.note("converting the log for Rerun");
    let word = |text: &str| OsString::from(text);
    let mut convert =
        ["mcap", "convert", "--timeline-type", "duration", "--application-id", APPLICATION].map(word).to_vec();
    convert.extend([word("-o"), converted.clone().into(), path.into()]);
    // One file with the blueprint in it: given two, Rerun may take them for strangers.
    let merge =
        vec![word("rrd"), word("merge"), word("-o"), shown.clone().into(), converted.into(), arrangement.into()];
    // Without an address it would listen to the whole network.
    let show = vec![word("--bind"), word("127.0.0.1"), shown.into()];
    let program = std::env::var_os(PROGRAM).unwrap_or_else(|| "rerun".into());
    for (arguments, quiet) in [(convert, true), (merge, true), (show, false)] {
        if !call(&program, &arguments, quiet, &interrupt)? {
            terminal.note("interrupted");
            break;
        }
    }
    Ok(())
}

/// The blueprint for a kind of scene whose particles have this radius [m].
fn blueprint(thermal: bool, clusters: bool, radius: f32) -> io::Result<Vec<u8>> {
    let mut content = Vec::new();
    let packed = BLUEPRINTS[usize::from(thermal)][usize::from(clusters)];
    zstd::Decoder::new(packed)?.read_to_end(&mut content)?;
    if let Some(place) = content.windows(RADIUS.len()).position(|bytes| bytes == RADIUS) {
        content[place..place + RADIUS.len()].copy_from_slice(&radius.to_le_bytes());
    }
    Ok(content)
}

/// Runs Rerun to its end; false where Ctrl-C ended it.
fn call(program: &OsString, arguments: &[OsString], quiet: bool, interrupt: &Interrupt) -> Result<bool, Failure> {
    let output = || if quiet { Stdio::piped() } else { Stdio::inherit() };
    let ended = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(output())
        .stderr(output())
        .spawn()
        .and_then(std::process::Child::wait_with_output)
        .map_err(|error| missing(program, &error))?;
    if ended.status.success() {
        return Ok(!interrupt.asked());
    }
    if interrupt.asked() {
        return Ok(false);
    }
    let arguments = arguments.iter().map(|argument| argument.to_string_lossy()).collect::<Vec<_>>().join(" ");
    let said = String::from_utf8_lossy(&ended.stderr);
    let text = format!("`{} {arguments}` failed ({}): {}", program.display(), ended.status, said.trim());
    Err(Failure::Failed(
        Message::new(text.trim_end_matches(": ")).hint("agglo knows Rerun 0.41; open the log there by hand"),
    ))
}

fn missing(program: &OsString, error: &io::Error) -> Failure {
    let message = Message::new(format!("cannot start {}: {error}", program.display()));
    Failure::Input(message.hint(format!("`pip install rerun-sdk` brings `rerun`; {PROGRAM} may name it")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_blueprint_takes_a_radius_in_one_place() {
        for (thermal, clusters) in [(false, false), (false, true), (true, false), (true, true)] {
            let as_made = blueprint(thermal, clusters, f32::from_le_bytes(RADIUS)).unwrap();
            let count = as_made.windows(4).filter(|bytes| *bytes == RADIUS).count();
            assert_eq!(count, 1, "thermal {thermal}, clusters {clusters}");
            let made = blueprint(thermal, clusters, 0.25).unwrap();
            assert_eq!(made.len(), as_made.len());
            assert_eq!(made.iter().zip(&as_made).filter(|(a, b)| a != b).count(), 4);
            let names = |name: &str| made.windows(name.len()).any(|bytes| bytes == name.as_bytes());
            assert_eq!(names("Temperature [K]"), thermal);
            assert_eq!(names("/clusters"), clusters);
        }
    }
}
