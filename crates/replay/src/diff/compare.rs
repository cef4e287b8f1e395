//! Comparing the messages of one step field by field.

use std::collections::BTreeMap;

use agglo_record::channels::{CHANNELS, Topic};

use super::tolerance::{Scale, Tolerance, Tolerances};
use crate::fields::{Difference, Field, Index, Values, difference, fields};
use crate::messages::Entry;

/// What is known of a field after a comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldReport {
    /// Name of the channel.
    pub channel: String,
    /// Name of the field.
    pub field: String,
    /// Largest |a - b|; infinite where only one of two is a number.
    pub max_abs: f64,
    /// Largest |a - b| over the largest |b| of the field at the same step [-].
    pub max_rel: f64,
    /// Largest distance in units in the last place; `None` for counts and texts.
    pub max_ulp: Option<u64>,
    /// Sum of the squares of differences, and how many values were compared.
    squares: (f64, u64),
    /// Values of a message, for those messages that were the same byte for byte.
    length: u64,
    is_particle: bool,
    /// Where the largest |a - b| is: time [s], step, index.
    pub at: Option<(f64, u64, usize)>,
    /// What it may differ by.
    pub tolerance: Tolerance,
    /// Whether every value lies within that.
    pub passed: bool,
}

impl FieldReport {
    /// Root mean square of a - b over all values that were compared.
    #[must_use]
    pub fn rms(&self) -> f64 {
        let (sum, count) = self.squares;
        if count == 0 { 0.0 } else { (sum / count as f64).sqrt() }
    }

    /// Whether its index is the number of a particle.
    #[must_use]
    pub fn is_particle(&self) -> bool {
        self.is_particle
    }
}

/// What counts as the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exactness {
    /// The same bits.
    Bits,
    /// Within tolerances.
    Tolerances,
}

/// Gathers what is found field by field.
#[derive(Debug)]
pub struct Comparison {
    exactness: Exactness,
    pub tolerances: Tolerances,
    reports: BTreeMap<(usize, &'static str), FieldReport>,
    /// Messages that were the same byte for byte, by channel.
    same: [u64; CHANNELS.len()],
}

impl Comparison {
    pub fn new(exactness: Exactness, tolerances: Tolerances) -> Self {
        Self { exactness, tolerances, reports: BTreeMap::new(), same: [0; CHANNELS.len()] }
    }

    /// Takes note of a message that is the same byte for byte.
    pub fn same(&mut self, topic: Topic) {
        self.same[topic as usize] += 1;
    }

    /// Whether the fields of a channel have been listed: the entries of a tolerance file refer to them.
    pub fn knows(&self, topic: Topic) -> bool {
        self.reports.range((topic as usize, "")..).next().is_some_and(|((found, _), _)| *found == topic as usize)
    }

    /// Compares two messages of one channel. Returns the first value beyond its tolerance.
    pub fn entries(&mut self, a: &Entry, b: &Entry) -> Option<Difference> {
        let topic = b.message.topic();
        let (left, right) = (fields(a), fields(b));
        let mut first = None;
        for field in &left {
            let found = match right.iter().find(|other| other.name == field.name) {
                Some(other) => self.field(topic, (b.t, b.step), field, other),
                None => self.missing(topic, field),
            };
            first = first.or(found);
        }
        for field in right.iter().filter(|field| !left.iter().any(|other| other.name == field.name)) {
            let found = self.missing(topic, field);
            first = first.or(found);
        }
        first
    }

    fn report(&mut self, topic: Topic, field: &Field<'_>) -> &mut FieldReport {
        let channel = CHANNELS[topic as usize].name;
        let tolerances = &mut self.tolerances;
        self.reports.entry((topic as usize, field.name)).or_insert_with(|| FieldReport {
            channel: channel.to_owned(),
            field: field.name.to_owned(),
            max_abs: 0.0,
            max_rel: 0.0,
            max_ulp: matches!(field.values, Values::Real(_)).then_some(0),
            squares: (0.0, 0),
            length: field.values.len() as u64,
            is_particle: field.index == Index::Particle,
            at: None,
            tolerance: tolerances.of(channel, field.name),
            passed: true,
        })
    }

    /// A column that only one of the two has.
    fn missing(&mut self, topic: Topic, field: &Field<'_>) -> Option<Difference> {
        let report = self.report(topic, field);
        if report.tolerance.ignore {
            return None;
        }
        report.passed = false;
        Some(Difference::missing(CHANNELS[topic as usize].name, field.name))
    }

    fn field(&mut self, topic: Topic, at: (f64, u64), a: &Field<'_>, b: &Field<'_>) -> Option<Difference> {
        let exactness = self.exactness;
        let report = self.report(topic, b);
        if report.tolerance.ignore {
            return None;
        }
        let worst = match (&a.values, &b.values) {
            (Values::Real(x), Values::Real(y)) => report.reals(exactness, at, x, y),
            (Values::Integer(x), Values::Integer(y)) => report.integers(at, x, y),
            (x, y) => (x != y).then(|| (0..x.len().max(y.len())).find(|&k| x.get(k) != y.get(k)).unwrap_or(0)),
        };
        let longer = a.values.len() != b.values.len();
        let beyond = worst.or_else(|| longer.then(|| a.values.len().min(b.values.len())));
        let index = beyond?;
        report.passed = false;
        Some(difference(CHANNELS[topic as usize].name, a, b, index))
    }

    /// All fields, by channel.
    #[must_use]
    pub fn finish(self) -> Vec<FieldReport> {
        let same = self.same;
        let reports = self.reports.into_iter();
        reports
            .filter(|(_, report)| !report.tolerance.ignore)
            .map(|((topic, _), mut report)| {
                report.squares.1 += same[topic] * report.length;
                report
            })
            .collect()
    }
}

impl FieldReport {
    /// Index of the first value beyond the tolerance.
    fn reals(&mut self, exactness: Exactness, at: (f64, u64), a: &[f64], b: &[f64]) -> Option<usize> {
        let largest = b.iter().filter(|y| y.is_finite()).fold(0.0_f64, |largest, y| largest.max(y.abs()));
        let Tolerance { abs, rel, scale, .. } = self.tolerance;
        let mut first = None;
        let mut sum = 0.0;
        for (k, (&x, &y)) in a.iter().zip(b).enumerate() {
            if x.to_bits() == y.to_bits() {
                continue;
            }
            let within = match exactness {
                Exactness::Bits => false,
                Exactness::Tolerances => {
                    let scale = if scale == Scale::Max { largest } else { y.abs() };
                    x == y || (x.is_nan() && y.is_nan()) || (x - y).abs() <= abs + rel * scale
                }
            };
            let apart = (x - y).abs();
            let apart = if x == y || (x.is_nan() && y.is_nan()) {
                0.0
            } else if apart.is_nan() {
                f64::INFINITY
            } else {
                apart
            };
            sum += if apart.is_finite() { apart * apart } else { 0.0 };
            self.note(apart, largest, (at.0, at.1, k));
            self.max_ulp = self.max_ulp.map(|most| most.max(crate::fields::ulps(x, y)));
            if !within && first.is_none() {
                first = Some(k);
            }
        }
        self.squares.0 += sum;
        self.squares.1 += b.len() as u64;
        first
    }

    fn integers(&mut self, at: (f64, u64), a: &[u64], b: &[u64]) -> Option<usize> {
        let largest = b.iter().copied().max().unwrap_or(0) as f64;
        let Tolerance { abs, rel, scale, .. } = self.tolerance;
        let mut first = None;
        for (k, (&x, &y)) in a.iter().zip(b).enumerate().filter(|(_, (x, y))| x != y) {
            let apart = x.abs_diff(y) as f64;
            let scale = if scale == Scale::Max { largest } else { y as f64 };
            self.squares.0 += apart * apart;
            self.note(apart, largest, (at.0, at.1, k));
            if apart > abs + rel * scale && first.is_none() {
                first = Some(k);
            }
        }
        self.squares.1 += b.len() as u64;
        first
    }

    fn note(&mut self, apart: f64, largest: f64, at: (f64, u64, usize)) {
        if self.at.is_none() || apart > self.max_abs {
            self.max_abs = apart;
            self.at = Some(at);
        }
        if apart > 0.0 {
            let rel = if largest > 0.0 { apart / largest } else { f64::INFINITY };
            self.max_rel = self.max_rel.max(rel);
        }
    }
}
