//! What happened just before two runs part: an impact, or a pair that crossed a range.

use std::io::{Read, Seek};

use agglo_core::domain::Domain;
use agglo_core::impact::Partner;
use agglo_core::scene::Scene;
use agglo_record::channels::Topic;

use crate::Frame;
use crate::error::LogError;
use crate::log::Log;
use crate::messages::Message;

/// What happened just before.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// An impact.
    Impact {
        /// Time [s].
        t: f64,
        /// Step.
        step: u64,
        /// The particle.
        particle: u32,
        /// What it hit: a particle or, as said, a wall.
        partner: String,
    },
    /// A pair crossed the cut-off or the range of binding.
    Crossing {
        /// Time of the state after it [s].
        t: f64,
        /// Step.
        step: u64,
        /// The pair.
        pair: (usize, usize),
        /// Which range, and its length [m].
        range: (&'static str, f64),
    },
}

impl std::fmt::Display for Cause {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Impact { t, step, particle, partner } => {
                write!(f, "particle {particle} hit {partner} at t = {t} s (step {step})")
            }
            Self::Crossing { t, step, pair: (i, j), range: (name, length) } => {
                write!(f, "particles {i} and {j} crossed the {name} of {length} m before t = {t} s (step {step})")
            }
        }
    }
}

/// The last impact or crossing up to a step, of a particle or, where that had none, of any.
///
/// # Errors
/// A device that fails.
pub fn find<R: Read + Seek>(
    log: &mut Log<R>,
    scene: &Scene,
    _t: f64,
    step: u64,
    particle: Option<usize>,
) -> Result<Option<Cause>, LogError> {
    let particles = match log.particles() {
        Ok(particles) => particles,
        Err(LogError::Io(error)) => return Err(LogError::Io(error)),
        Err(_) => return Ok(None),
    };
    let (mut own, mut any) = (None, None);
    let mut frames: (Option<Frame>, Option<Frame>) = (None, None);
    for entry in log.messages().only(&[Topic::Impacts, Topic::Particles]) {
        let entry = match entry {
            Ok(entry) if entry.step > step => break,
            Ok(entry) => entry,
            Err(LogError::Damaged(_)) => continue,
            Err(other) => return Err(other),
        };
        match entry.message {
            Message::Impacts(impacts) => {
                for impact in impacts {
                    let partner = match impact.partner {
                        Partner::Particle(j) => format!("particle {j}"),
                        Partner::Wall(wall) => format!("wall {wall}"),
                    };
                    let involved = [
                        Some(impact.particle),
                        match impact.partner {
                            Partner::Particle(j) => Some(j),
                            Partner::Wall(_) => None,
                        },
                    ];
                    let cause = Cause::Impact { t: impact.time, step: entry.step, particle: impact.particle, partner };
                    if particle.is_some_and(|k| involved.contains(&Some(k as u32))) {
                        own = Some(cause.clone());
                    }
                    any = Some(cause);
                }
            }
            Message::Particles(frame) => frames = (frames.1.take(), Some(frame)),
            _ => {}
        }
    }
    let impact = own.or(any);
    let recent = |cause: &Cause| matches!(cause, Cause::Impact { step: of, .. } if of + 1 >= step);
    if let (Some(before), Some(after), false) = (&frames.0, &frames.1, impact.as_ref().is_some_and(recent)) {
        let domain = Domain::new(scene.domain.as_ref());
        if let Some(crossing) = crossing(scene, &domain, &particles.radius, before, after, particle) {
            return Ok(Some(crossing));
        }
    }
    Ok(impact)
}

/// A pair, of the particle if one is given, whose distance crossed a range between two states.
fn crossing(
    scene: &Scene,
    domain: &Domain,
    radius: &[f64],
    before: &Frame,
    after: &Frame,
    particle: Option<usize>,
) -> Option<Cause> {
    let cutoff = scene.near_field.as_ref().and_then(agglo_core::scene::NearField::cutoff_distance);
    let binding = scene.binding.as_ref().map(|binding| binding.range);
    let n = radius.len().min(before.position.len()).min(after.position.len());
    let i = particle.filter(|&i| i < n)?;
    for j in (0..n).filter(|&j| j != i) {
        let distance = |frame: &Frame| domain.periodic.separation(&frame.position, i, j).norm();
        let (from, to) = (distance(before), distance(after));
        let ranges = [("cut-off", cutoff), ("range of binding", binding.map(|range| range * (radius[i] + radius[j])))];
        for (name, length) in ranges {
            if let Some(length) = length
                && (from < length) != (to < length)
            {
                let pair = (i.min(j), i.max(j));
                return Some(Cause::Crossing { t: after.t, step: after.step, pair, range: (name, length) });
            }
        }
    }
    None
}
