//! A run as curves in time, averaged over a few blocks: what stays comparable when trajectories do not.

use std::io::{Read, Seek};

use agglo_core::impact::Impact;
use agglo_record::channels::Topic;

use crate::error::{Damage, LogError};
use crate::log::Log;
use crate::messages::{Entry, Message};

/// Ends of the blocks, in shares of the duration: each block is about as long as all before it, because most of what
/// happens in a cloud happens early.
pub const BLOCKS: [f64; 4] = [0.125, 0.25, 0.5, 1.0];

/// One curve, a value per block.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Its name.
    pub name: &'static str,
    /// Mean in every block or, where the name says so, the largest value up to its end; NaN where there is nothing.
    pub blocks: [f64; BLOCKS.len()],
}

/// The curves of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves {
    /// Curves, always in the same order; those that the scene does not have are absent.
    pub curves: Vec<Curve>,
    /// The last recorded time [s].
    pub end: f64,
    /// Recorded states.
    pub frames: u64,
    /// What is lost.
    pub damage: Vec<Damage>,
    /// From when to when messages may be lost or wrong [s]; infinite where the end is lost.
    pub lost: Option<(f64, f64)>,
    /// Time [s] and step of the first state with a number that is not finite, or that has no time.
    pub not_finite: Option<(f64, u64)>,
}

/// A curve of sampled values: its mean over time, linear between samples.
#[derive(Clone, Copy, Debug, Default)]
struct Sampled {
    last: Option<(f64, f64)>,
    integral: [f64; BLOCKS.len()],
    covered: [f64; BLOCKS.len()],
}

impl Sampled {
    fn add(&mut self, t: f64, value: f64, duration: f64) {
        if let Some((t0, v0)) = self.last.replace((t, value))
            && t > t0
        {
            let at = |x: f64| v0 + (value - v0) * ((x - t0) / (t - t0));
            let mut start = 0.0;
            for (k, share) in BLOCKS.iter().enumerate() {
                let end = share * duration;
                let (from, to) = (t0.max(start), t.min(end));
                if to > from {
                    self.integral[k] += 0.5 * (at(from) + at(to)) * (to - from);
                    self.covered[k] += to - from;
                }
                start = end;
            }
        }
    }

    fn blocks(&self) -> [f64; BLOCKS.len()] {
        std::array::from_fn(|k| self.integral[k] / self.covered[k])
    }
}

/// Sums over events in every block.
#[derive(Clone, Copy, Debug, Default)]
struct Events {
    steps: u64,
    iterations: f64,
    impacts: f64,
    restitution: f64,
    largest_restitution: f64,
    heat: f64,
    largest_heat: f64,
    normal: f64,
    tangential: f64,
    slips: f64,
}

impl Events {
    fn impact(&mut self, impact: &Impact) {
        self.impacts += 1.0;
        self.restitution += impact.restitution;
        self.largest_restitution = self.largest_restitution.max(impact.restitution);
        self.heat += impact.heat;
        self.largest_heat = self.largest_heat.max(impact.heat);
        self.normal += impact.normal_impulse;
        self.tangential += impact.tangential_impulse.iter().map(|p| p * p).sum::<f64>().sqrt();
        self.slips += f64::from(u8::from(impact.slip == Some(true)));
    }
}

/// Curves of quantities that are positive and spread in proportion to their size, as sums of a few large events do: they
/// are judged by their logarithms.
pub const PROPORTIONAL: [&str; 5] = ["reaction_heat", "convected", "impact_loss", "friction_loss", "impact_heat"];

/// Curves that the hottest particles decide: one pair that happens to meet early changes radiation tenfold, and takes the mean
/// restitution down with its own, so that a few references tell nothing about their tails. (The largest restitution, that of
/// cold and slow pairs, has no such tail.) They are reported and not judged.
pub const UNJUDGED: [&str; 3] = ["radiated", "max_temperature", "restitution"];

/// Curves of what is largest up to the end of a block.
const LARGEST_SO_FAR: [&str; 2] = ["largest_restitution", "largest_impact_heat"];

/// Names of the sampled curves.
const SAMPLED: [&str; 15] = [
    "kinetic",
    "near_field",
    "binding",
    "external",
    "thermal",
    "reaction_heat",
    "radiated",
    "convected",
    "impact_loss",
    "friction_loss",
    "mean_temperature",
    "max_temperature",
    "clusters",
    "largest_cluster",
    "singletons",
];

impl Curves {
    /// The curves of a log over a duration [s]; of a damaged log, of what is whole.
    ///
    /// # Errors
    /// A device that fails.
    pub fn of<R: Read + Seek>(log: &mut Log<R>, duration: f64) -> Result<Self, LogError> {
        let terms = log.run().terms.clone();
        let mut damage = log.file_damage()?;
        let mut sampled = [Sampled::default(); SAMPLED.len()];
        let mut events = [Events::default(); BLOCKS.len()];
        let (mut end, mut frames, mut not_finite) = (0.0_f64, 0, None);
        let topics = [Topic::Particles, Topic::Energy, Topic::Clusters, Topic::Diagnostics, Topic::Impacts, Topic::Log];
        let mut judged = log.judged_only(&topics)?;
        for message in &mut judged {
            let Entry { t, step, message } = match message {
                Ok((_, Some(entry))) => entry,
                Ok((_, None)) => continue,
                Err(LogError::Damaged(lost)) => {
                    damage.push(lost);
                    continue;
                }
                Err(other) => return Err(other),
            };
            let block = BLOCKS.iter().position(|share| t <= share * duration).unwrap_or(BLOCKS.len() - 1);
            let mut add = |first: usize, values: &[f64]| {
                for (k, &value) in values.iter().enumerate() {
                    sampled[first + k].add(t, value, duration);
                }
            };
            if !t.is_finite() {
                not_finite = not_finite.or(Some((t, step)));
            }
            match message {
                Message::Energy(ledger, _) => {
                    let sums = &ledger.totals;
                    add(0, &[ledger.kinetic, ledger.near_field, ledger.binding, ledger.external, ledger.thermal]);
                    add(5, &[sums.reaction_heat, sums.radiated, sums.convected, sums.impact_loss, sums.friction_loss]);
                }
                Message::Particles(frame) => {
                    (end, frames) = (t, frames + 1);
                    let columns = [&frame.position, &frame.velocity].into_iter().flat_map(|columns| columns.axes());
                    let mut values = columns.chain(frame.temperature.as_deref()).flatten();
                    if not_finite.is_none() && !values.all(|value| value.is_finite()) {
                        not_finite = Some((t, step));
                    }
                    if let Some(theta) = &frame.temperature {
                        let mean = theta.iter().sum::<f64>() / theta.len() as f64;
                        add(10, &[mean, theta.iter().copied().fold(f64::NEG_INFINITY, f64::max)]);
                    }
                }
                Message::Clusters(found) => {
                    add(12, &[found.count.into(), found.largest.into(), found.singletons.into()]);
                }
                Message::Diagnostics(step) => {
                    events[block].steps += 1;
                    events[block].iterations += step.iterations() as f64;
                }
                Message::Impacts(impacts) => impacts.iter().for_each(|impact| events[block].impact(impact)),
                _ => {}
            }
        }
        let lost = judged.lost();
        Ok(Self { curves: curves(&terms, &sampled, &events, duration), end, frames, damage, lost, not_finite })
    }

    /// Whether what is lost has a part in a curve from one time to another [s].
    pub fn lacks(&self, name: &str, (from, to): (f64, f64)) -> bool {
        // What is largest so far rests on all that came before.
        let from = if LARGEST_SO_FAR.contains(&name) { 0.0 } else { from };
        self.lost.is_some_and(|(first, last)| first < to && last > from)
    }

    /// A curve by name.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Curve> {
        self.curves.iter().find(|curve| curve.name == name)
    }
}

/// The curves that a scene of these terms has.
fn curves(
    terms: &[String],
    sampled: &[Sampled; SAMPLED.len()],
    events: &[Events; BLOCKS.len()],
    duration: f64,
) -> Vec<Curve> {
    let has = |term: &str| terms.iter().any(|name| name.starts_with(term));
    let present = |name: &str| match name {
        "kinetic" => true,
        "near_field" => has("near_field"),
        "binding" => has("binding"),
        "external" => has("external"),
        "reaction_heat" => has("thermal.reaction"),
        "radiated" => has("thermal.radiation"),
        "convected" => has("thermal.convection"),
        "impact_loss" => has("contact"),
        "friction_loss" => has("contact.friction"),
        "clusters" | "largest_cluster" | "singletons" => has("binding") || has("clusters"),
        _ => has("thermal"),
    };
    // What is largest in a block of few impacts says little: the largest so far does.
    let mut events = *events;
    for k in 1..events.len() {
        events[k].largest_restitution = events[k].largest_restitution.max(events[k - 1].largest_restitution);
        events[k].largest_heat = events[k].largest_heat.max(events[k - 1].largest_heat);
    }
    let mut found: Vec<Curve> = SAMPLED
        .iter()
        .zip(sampled)
        .filter(|(name, _)| present(name))
        .map(|(name, sampled)| Curve { name, blocks: sampled.blocks() })
        .collect();
    let mut start = 0.0;
    let lengths = BLOCKS.map(|share| {
        let length = share * duration - start;
        start = share * duration;
        length
    });
    let mut add = |name: &'static str, on: bool, of: &dyn Fn(&Events, f64) -> f64| {
        if on {
            found.push(Curve { name, blocks: std::array::from_fn(|k| of(&events[k], lengths[k])) });
        }
    };
    add("iterations_per_step", true, &|e, _| e.iterations / e.steps as f64);
    add("steps_per_second", true, &|e, length| e.steps as f64 / length);
    let contact = has("contact");
    add("impacts_per_second", contact, &|e, length| e.impacts / length);
    add("restitution", contact, &|e, _| e.restitution / e.impacts);
    add("largest_restitution", contact, &|e, _| e.largest_restitution);
    add("impact_heat", has("thermal.reaction"), &|e, _| e.heat / e.impacts);
    add("largest_impact_heat", has("thermal.reaction"), &|e, _| e.largest_heat);
    add("friction_share", has("contact.friction"), &|e, _| e.tangential / e.normal);
    add("slip_share", has("contact.friction"), &|e, _| e.slips / e.impacts);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_straight_line_over_every_block() {
        let mut line = Sampled::default();
        // Sampled at times that no block ends at; linear between, so exact.
        for k in 0..=7 {
            let t = f64::from(k) * 8.0 / 7.0;
            line.add(t, 3.0 * t + 1.0, 8.0);
        }
        for (found, middle) in line.blocks().into_iter().zip([0.5, 1.5, 3.0, 6.0]) {
            assert!((found - (3.0 * middle + 1.0)).abs() < 1e-12, "{found} in the middle {middle}");
        }
    }
}
