//! Which states of a log are shown, in rising order of time.

use std::io::{Read, Seek};

use agglo_core::state::Particles;
use agglo_record::channels::Topic;
use agglo_replay::export::{At, states};
use agglo_replay::{Damage, Frame, Log, LogError, Message};

use crate::error::RenderError;
use crate::options::When;

/// Times that differ by less than this part of them are the same [-]: steps add up to 0.3000000000000001 s where people
/// write 0.3.
const SAME_TIME: f64 = 1e-9;

/// Multiples of a spacing between two states that are counted.
const MOST_MULTIPLES: f64 = 1e4;

/// What going through the states came to.
#[derive(Clone, Debug, Default)]
pub struct Passed {
    /// Time of the last state, where that is before a time asked for [s].
    pub ends_before: Option<(f64, f64)>,
    /// Parts of the log that could not be read.
    pub damage: Vec<Damage>,
}

/// The states that are asked for, to be gone through any number of times.
#[derive(Clone, Debug)]
pub struct Moments {
    times: Vec<f64>,
    end: bool,
    all: bool,
    spacings: Vec<f64>,
}

impl Moments {
    /// Of a list of wishes; none is the last state.
    pub fn new(at: &[When]) -> Self {
        let mut moments = Self { times: Vec::new(), end: at.is_empty(), all: false, spacings: Vec::new() };
        for when in at {
            match *when {
                When::Time(t) => moments.times.push(t),
                When::End => moments.end = true,
                When::All => moments.all = true,
                When::Every(spacing) => moments.spacings.push(spacing),
            }
        }
        moments.times.sort_by(f64::total_cmp);
        moments
    }

    /// Passes every state to `take`, and how many evenly spaced moments it stands for: 1 where spacing does not matter.
    ///
    /// # Errors
    /// A log that cannot be read, no state at a time asked for, and what `take` says.
    pub fn each<R: Read + Seek>(
        &self,
        log: &mut Log<R>,
        particles: &Particles,
        mut take: impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<Passed, RenderError> {
        let mut checked = |frame: &Frame, stands_for: u32| {
            if frame.position.len() != particles.len() {
                let text = format!("the state at {} s has {} particles instead of {}", frame.t, frame.position.len(), particles.len());
                return Err(LogError::Damaged(Damage { offset: 0, what: text }).into());
            }
            take(frame, stands_for)
        };
        if self.all || !self.spacings.is_empty() { self.stream(log, &mut checked) } else { self.pick(log, &mut checked) }
    }

    /// States at single times, found by the log's index. A damaged part loses the moments in it only.
    fn pick<R: Read + Seek>(
        &self,
        log: &mut Log<R>,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<Passed, RenderError> {
        let mut passed = Passed { damage: log.damage().to_vec(), ..Passed::default() };
        let (mut taken, mut lost) = (0, None);
        let wishes = self.times.iter().map(|&t| At::Time(t)).chain(self.end.then_some(At::End));
        for at in wishes {
            let mut result = Ok(());
            let found = states(log, at, |frame, _| {
                result = take(frame, 1);
                Ok(1)
            });
            result?;
            match found {
                Ok(exported) => {
                    taken += 1;
                    if let (At::Time(t), Some(end)) = (at, exported.ends_before) {
                        passed.ends_before = Some((t, end));
                    }
                }
                Err(agglo_replay::export::ExportError::Log(LogError::Damaged(damage))) => {
                    if !passed.damage.contains(&damage) {
                        passed.damage.push(damage.clone());
                    }
                    lost = Some(damage);
                }
                Err(other) => return Err(other.into()),
            }
        }
        match lost {
            Some(damage) if taken == 0 => Err(LogError::Damaged(damage).into()),
            _ => Ok(passed),
        }
    }

    /// States out of all of them: each is known to be the last before a time when the next one comes.
    fn stream<R: Read + Seek>(
        &self,
        log: &mut Log<R>,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<Passed, RenderError> {
        let mut passed = Passed { damage: log.file_damage()?, ..Passed::default() };
        let mut held: Option<Frame> = None;
        let mut first = None;
        for entry in log.messages().only(&[Topic::Particles]) {
            match entry {
                Ok(entry) => {
                    let Message::Particles(frame) = entry.message else { continue };
                    first.get_or_insert(frame.t);
                    if let Some(before) = held.replace(frame) {
                        let until = held.as_ref().map_or(f64::INFINITY, |frame| frame.t);
                        self.pass(&before, until, take)?;
                    }
                }
                Err(LogError::Damaged(damage)) if passed.damage.contains(&damage) => {}
                Err(LogError::Damaged(damage)) => passed.damage.push(damage),
                Err(other) => return Err(other.into()),
            }
        }
        let Some(last) = held else {
            let lost = passed.damage.into_iter().next();
            return Err(match lost {
                Some(damage) => LogError::Damaged(damage),
                None => LogError::NoState(agglo_replay::NoState { time: 0.0, first: None }),
            }
            .into());
        };
        if let (Some(first), Some(&t)) = (first, self.times.first())
            && t + SAME_TIME * t.abs() < first
        {
            return Err(LogError::NoState(agglo_replay::NoState { time: t, first: Some(first) }).into());
        }
        match self.times.last() {
            Some(&t) if t - SAME_TIME * t.abs() > last.t => passed.ends_before = Some((t, last.t)),
            _ => {}
        }
        self.pass_last(&last, take)?;
        Ok(passed)
    }

    /// Passes a state that is followed by one at `until`, if any time asked for lies between.
    fn pass(
        &self,
        frame: &Frame,
        until: f64,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        let asked = self.times.iter().any(|&t| frame.t <= t + SAME_TIME * t.abs() && t < until - SAME_TIME * until.abs());
        // Multiples of a spacing from this state's time up to, but not at, the next one's.
        let first = |t: f64, spacing: f64| (t / spacing * (1.0 - SAME_TIME)).ceil();
        let evenly = self.spacings.iter().map(|&spacing| {
            let count = first(until, spacing) - first(frame.t, spacing);
            count.clamp(0.0, MOST_MULTIPLES) as u32
        });
        let stands_for = evenly.sum::<u32>().max(u32::from(asked || self.all));
        if stands_for > 0 { take(frame, stands_for) } else { Ok(()) }
    }

    /// Passes the last state, if it or any time at or behind it is asked for.
    fn pass_last(
        &self,
        frame: &Frame,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        let asked = self.all || self.end || self.times.iter().any(|&t| frame.t <= t + SAME_TIME * t.abs());
        let evenly = self.spacings.iter().any(|&spacing| {
            let share = frame.t / spacing;
            (share - share.round()).abs() <= SAME_TIME * share.abs().max(1.0)
        });
        if asked || evenly { take(frame, 1) } else { Ok(()) }
    }
}
