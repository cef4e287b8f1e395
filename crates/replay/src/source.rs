//! Particles of a scene that stand in a CSV file or in another log.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use agglo_core::scene::{ListedParticle, ParticleSource, Problem, Scene};
use agglo_core::state::Particles;
use agglo_record::cloud::Frame;

use crate::csv::read_particles;
use crate::error::{Damage, LogError};
use crate::log::Log;

/// A log that particles were taken from although parts of it are lost.
#[derive(Clone, Debug, PartialEq)]
pub struct DamagedSource {
    /// The log.
    pub path: PathBuf,
    /// What is lost in it.
    pub damage: Vec<Damage>,
}

/// Turns `particles.file` and `particles.log` into `particles.list`; other sources stay as they are. Relative paths
/// start at `base`, the scene's folder. Says where the log that was read is damaged elsewhere.
///
/// # Errors
/// A file that cannot be read or used, with the JSON pointer of the path or time.
pub fn resolve_particles(scene: &mut Scene, base: &Path) -> Result<Option<DamagedSource>, Problem> {
    let mut damage = Vec::new();
    let (list, pointer, path) = match &scene.particles {
        ParticleSource::RandomCube(_) | ParticleSource::List(_) => return Ok(None),
        ParticleSource::File(source) => {
            let pointer = "/particles/file/path";
            let path = base.join(&source.path);
            let fail = |what: String| Problem::new(pointer, format!("{}: {what}", path.display()));
            let file = open(&path).map_err(|e| fail(format!("cannot be read: {e}")))?;
            let list = read_particles(BufReader::new(file)).map_err(|e| fail(e.to_string()))?;
            (list, pointer, path)
        }
        ParticleSource::Log(source) => {
            let pointer = "/particles/log/path";
            let path = base.join(&source.path);
            let (list, lost) = read_log(&path, source.time).map_err(|error| {
                let pointer = if matches!(error, LogError::NoState(_)) { "/particles/log/time" } else { pointer };
                let problem = Problem::new(pointer, format!("{}: {error}", path.display()));
                match error {
                    LogError::Damaged(_) => problem.hint("the part that is needed is lost; take an earlier time"),
                    LogError::NotALog(_) => problem.hint("a CSV file goes under particles.file"),
                    _ => problem,
                }
            })?;
            damage = lost;
            (list, pointer, path)
        }
    };
    if scene.thermal.is_some() && list.iter().any(|particle| particle.temperature.is_none()) {
        let what = format!("{}: there are no temperatures, which `thermal` needs", path.display());
        return Err(Problem::new(pointer, what).hint("add a column temperature, or leave out `thermal`"));
    }
    scene.particles = ParticleSource::List(list);
    Ok((!damage.is_empty()).then_some(DamagedSource { path, damage }))
}

fn open(path: &Path) -> Result<File, std::io::Error> {
    // Opening a folder succeeds on some systems, and fails only when it is read.
    if path.is_dir() { Err(std::io::ErrorKind::IsADirectory.into()) } else { File::open(path) }
}

fn read_log(path: &Path, time: f64) -> Result<(Vec<ListedParticle>, Vec<Damage>), LogError> {
    let mut log = Log::open(path)?;
    let Particles { radius, mass, charge } = log.particles()?;
    let Frame { t: _, step: _, position, velocity, temperature, cluster: _ } = log.frame_at(time)?;
    let n = radius.len().min(position.len());
    let list = (0..n)
        .map(|k| ListedParticle {
            position: position.get(k).into(),
            velocity: velocity.get(k).into(),
            radius: radius[k],
            density: None,
            mass: Some(mass[k]),
            temperature: temperature.as_ref().map(|theta| theta[k]),
            charge: charge.as_ref().map(|charge| charge[k]),
        })
        .collect();
    Ok((list, log.damage().to_vec()))
}
