//! `agglo run --resume`: goes on with a recorded run.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use agglo_core::Simulation;
use agglo_core::scene::Setting;
use agglo_record::Recorder;
use agglo_replay::Log;
use agglo_replay::resume::{CarryError, Resumption};

use super::run::{Writer, log_failure};
use crate::args::{COMMIT, VERSION};
use crate::failure::{Failure, Message, Success};
use crate::input::{self, LoadedScene};
use crate::logs;
use crate::numbers::short;
use crate::terminal::Terminal;

/// The log of the run that goes on.
pub struct Earlier<'a> {
    path: PathBuf,
    log: Log<BufReader<File>>,
    from: Resumption,
    terminal: &'a Terminal,
    /// How the run succeeds if it reaches its end.
    pub success: Success,
}

impl<'a> Earlier<'a> {
    /// Opens a log, and finds from where its run can go on with what is set.
    ///
    /// # Errors
    /// A log that cannot be read or has no checkpoint; settings of more than the duration.
    pub fn open(path: &Path, settings: &[Setting], terminal: &'a Terminal) -> Result<(LoadedScene, Self), Failure> {
        if let Some(other) = settings.iter().find(|setting| setting.pointer != "/duration") {
            let text = format!("--resume goes on with the same run, and {} would make it another one", other.pointer);
            let hint = "set only `duration`; a run from a recorded state is a scene with `particles.log`";
            return Err(Failure::Input(Message::new(text).hint(hint)));
        }
        let mut log = logs::open(path).map_err(|error| logs::failure(path, &error))?;
        let text = log.scene_json().map_err(|error| logs::failure(path, &error))?;
        let recorded = input::recorded(path, text.clone(), &[])?.scene.duration;
        let loaded = input::recorded(path, text, settings)?;
        log.meets(&loaded.scene).map_err(|error| logs::failure(path, &error))?;
        let found = log.resumption(recorded, loaded.scene.duration).map_err(|error| logs::failure(path, &error))?;
        let (name, (found, damage)) = (path.display(), found);
        logs::warn(path, &damage, terminal);
        let Some(from) = found else {
            let text = format!("{name} has no whole checkpoint to go on from");
            return Err(Failure::Input(Message::new(text).file(name).hint("run its scene from the start")));
        };
        if !damage.is_empty() {
            let (step, time) = (from.checkpoint.step, short(from.checkpoint.time));
            let text = format!("{name} is used up to step {step} at t = {time} s; what follows is solved again");
            terminal.note(text);
        }
        let build = &log.run().build;
        if (build.version.as_str(), build.commit.as_str()) != (VERSION, COMMIT) {
            let text = format!(
                "{name} was recorded by agglo {} (commit {}) and goes on with {VERSION} (commit {COMMIT}): what is \
                 carried over may not be what this version would solve",
                build.version, build.commit
            );
            terminal.warning(&Message::new(text).file(name).hint("`agglo replay LOG --verify` says whether it is"));
        }
        let success = if damage.is_empty() { Success::Done } else { Success::Damaged };
        Ok((loaded, Self { path: path.to_owned(), log, from, terminal, success }))
    }

    /// Carries the steps up to the checkpoint over, and takes the simulation there. `watch` sees time [s] and number of
    /// every step; false from it ends this, and then false comes back.
    ///
    /// # Errors
    /// What cannot be read or written; a checkpoint that does not fit its scene.
    pub fn carry(
        &mut self,
        loaded: &LoadedScene,
        simulation: &mut Simulation,
        recorder: &mut Recorder<Writer>,
        output: &str,
        watch: impl FnMut(f64, u64) -> bool,
    ) -> Result<bool, Failure> {
        let Resumption { checkpoint, last_step, last_time, .. } = &self.from;
        let mut resumed =
            Simulation::resume(&loaded.scene, checkpoint).map_err(|error| loaded.failure(error.problems))?;
        let keep = resumed.checkpoint_due(checkpoint.step == 0);
        recorder.begin(simulation.particles(), simulation.state());
        let carried = self.log.carry(checkpoint, keep, (simulation.particles(), resumed.state()), recorder, watch);
        let done = carried.map_err(|error| match error {
            CarryError::Log(error) => logs::failure(&self.path, &error),
            CarryError::Record(error) => log_failure(output, &error),
            CarryError::Stranger(what) => {
                let name = self.path.display();
                let message = Message::new(format!("{name} is no log to go on from: {what}")).file(name);
                Failure::Input(message.hint("`agglo replay LOG --verify` says where it stops being its scene's"))
            }
        })?;
        std::mem::swap(simulation, &mut resumed);
        let (step, time) = (checkpoint.step, short(checkpoint.time));
        self.terminal.detail(format!(
            "carried over {} up to step {step} at t = {time} s; it has steps up to {last_step} at t = {} s",
            self.path.display(),
            short(*last_time)
        ));
        Ok(done)
    }
}
