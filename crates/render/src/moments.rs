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

/// About the size of a log's chunk [bytes].
const CHUNK: u64 = 1 << 20;

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
#[derive(Clone, Debug, Default)]
pub struct Moments {
    /// Single times, rising, each once [s].
    times: Vec<f64>,
    end: bool,
    all: bool,
    spacings: Vec<f64>,
    /// All of the log is read, even where its index would find the states.
    thorough: bool,
}

impl Moments {
    /// Of a list of wishes; none is the last state. A number of moments is spread from the log's first state to its last.
    ///
    /// # Errors
    /// A log that cannot be read, or holds no state.
    pub fn new<R: Read + Seek>(log: &mut Log<R>, at: &[When]) -> Result<Self, RenderError> {
        let mut moments = Self { end: at.is_empty(), ..Self::default() };
        for when in at {
            match *when {
                When::Time(t) => moments.times.push(t),
                When::End => moments.end = true,
                When::All => moments.all = true,
                When::Every(spacing) => moments.spacings.push(spacing),
                When::Frames(count) => moments.times.extend(spread(log, count)?),
            }
        }
        moments.times.sort_by(f64::total_cmp);
        moments.times.dedup();
        Ok(moments)
    }

    /// From now on all of the log is read, and states that are lost are made up for by the last ones before them.
    pub fn read_all(&mut self) {
        self.thorough = true;
    }

    /// Passes every state to `take`, and how many moments of an animation it stands for, at least 1.
    ///
    /// # Errors
    /// A log that cannot be read, no state at a time asked for, and what `take` says. Damage where a state must be, until
    /// [`Moments::read_all`].
    pub fn each<R: Read + Seek>(
        &self,
        log: &mut Log<R>,
        particles: &Particles,
        mut take: impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<Passed, RenderError> {
        let mut checked = |frame: &Frame, stands_for: u32| {
            let (found, expected) = (frame.position.len(), particles.len());
            if found != expected {
                let what = format!("the state at {} s has {found} particles instead of {expected}", frame.t);
                return Err(LogError::Damaged(Damage { offset: 0, what }).into());
            }
            take(frame, stands_for)
        };
        // Every time that is looked up costs about a chunk, going through all costs the file.
        let few = self.times.len() as u64 <= log.size() / CHUNK;
        let by_index = !(self.thorough || self.all) && self.spacings.is_empty() && few;
        if by_index { self.pick(log, &mut checked) } else { self.stream(log, &mut checked) }
    }

    /// States at single times, found by the log's index.
    fn pick<R: Read + Seek>(
        &self,
        log: &mut Log<R>,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<Passed, RenderError> {
        let mut passed = Passed { damage: log.damage().to_vec(), ..Passed::default() };
        let mut held: Option<(Frame, u32)> = None;
        let wishes = self.times.iter().map(|&t| At::Time(t)).chain(self.end.then_some(At::End));
        for at in wishes {
            let mut found = None;
            let exported = states(log, at, |frame, _| {
                found = Some(frame.clone());
                Ok(1)
            })?;
            if let (At::Time(t), Some(end)) = (at, exported.ends_before) {
                passed.ends_before = Some((t, end));
            }
            // Times between two states have the same one.
            match (&mut held, found) {
                (Some((before, stands_for)), Some(frame)) if before.step == frame.step => {
                    *stands_for += u32::from(matches!(at, At::Time(_)));
                }
                (_, Some(frame)) => {
                    if let Some((before, stands_for)) = held.replace((frame, 1)) {
                        take(&before, stands_for)?;
                    }
                }
                (_, None) => {}
            }
        }
        if let Some((last, stands_for)) = held {
            take(&last, stands_for)?;
        }
        Ok(passed)
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
        let asked = self.asked(frame.t, until - SAME_TIME * until.abs());
        // Multiples of a spacing from this state's time up to, but not at, the next one's.
        let first = |t: f64, spacing: f64| (t / spacing * (1.0 - SAME_TIME)).ceil();
        let evenly = self.spacings.iter().map(|&spacing| {
            let count = first(until, spacing) - first(frame.t, spacing);
            count.clamp(0.0, MOST_MULTIPLES) as u32
        });
        let stands_for = evenly.sum::<u32>().max(asked).max(u32::from(self.all));
        if stands_for > 0 { take(frame, stands_for) } else { Ok(()) }
    }

    /// Passes the last state, if it or any time at or behind it is asked for.
    fn pass_last(
        &self,
        frame: &Frame,
        take: &mut impl FnMut(&Frame, u32) -> Result<(), RenderError>,
    ) -> Result<(), RenderError> {
        let asked = self.asked(frame.t, f64::INFINITY);
        let evenly = self.spacings.iter().any(|&spacing| {
            let share = frame.t / spacing;
            (share - share.round()).abs() <= SAME_TIME * share.abs().max(1.0)
        });
        let stands_for = asked.max(u32::from(evenly || self.all || self.end));
        if stands_for > 0 { take(frame, stands_for) } else { Ok(()) }
    }

    /// How many of the single times are from a state's time up to another time [s].
    fn asked(&self, from: f64, until: f64) -> u32 {
        let before = self.times.partition_point(|&t| t + SAME_TIME * t.abs() < from);
        let until = self.times.partition_point(|&t| t < until);
        until.saturating_sub(before) as u32
    }
}

/// Times evenly spaced from the first state to the last one [s]; a single one is that of the last.
fn spread<R: Read + Seek>(log: &mut Log<R>, count: u32) -> Result<Vec<f64>, RenderError> {
    let end = last(log)?.t;
    let start = first(log)?.map_or(end, |frame| frame.t);
    let between = (0..count.saturating_sub(1)).map(|k| start + (end - start) * f64::from(k) / f64::from(count - 1));
    Ok(between.chain([end]).collect())
}

/// The first state that is whole.
pub fn first<R: Read + Seek>(log: &mut Log<R>) -> Result<Option<Frame>, RenderError> {
    let mut first = None;
    whole(log, |frame| {
        first = Some(frame);
        false
    })?;
    Ok(first)
}

/// The last state that is whole.
fn last<R: Read + Seek>(log: &mut Log<R>) -> Result<Frame, RenderError> {
    let damage = match log.last_frame() {
        Err(LogError::Damaged(damage)) => damage,
        other => return Ok(other?),
    };
    let mut last = None;
    whole(log, |frame| {
        last = Some(frame);
        true
    })?;
    last.ok_or_else(|| LogError::Damaged(damage).into())
}

/// Passes states that are whole to `take`, until it returns false.
fn whole<R: Read + Seek>(log: &mut Log<R>, mut take: impl FnMut(Frame) -> bool) -> Result<(), RenderError> {
    for entry in log.messages().only(&[Topic::Particles]) {
        match entry {
            Ok(entry) => {
                if let Message::Particles(frame) = entry.message
                    && !take(frame)
                {
                    break;
                }
            }
            Err(LogError::Damaged(_)) => {}
            Err(other) => return Err(other.into()),
        }
    }
    Ok(())
}
