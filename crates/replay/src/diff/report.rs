//! What a comparison came to.

use super::compare::FieldReport;
use super::{Cause, Rate, Setting, Statistics};
use crate::error::Damage;
use crate::fields::Difference;

/// How logs are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Profile {
    /// Bit for bit.
    Exact,
    /// Field by field, within tolerances.
    State,
    /// Curves in time, for chaotic runs.
    Statistics,
}

impl Profile {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::State => "state",
            Self::Statistics => "statistics",
        }
    }
}

/// What came of a comparison.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The same as far as was asked.
    Same,
    /// Something differs, or could not be compared.
    Differ,
    /// The two cannot be compared; why.
    Incomparable(String),
}

/// Something that only one of the logs has, or has elsewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Structure {
    /// Name of the channel; empty where it concerns steps as a whole.
    pub channel: String,
    /// What, as a sentence.
    pub what: String,
    /// How often.
    pub count: u64,
    /// Time of the first [s].
    pub t: f64,
    /// Step of the first.
    pub step: u64,
}

/// The first difference.
#[derive(Clone, Debug, PartialEq)]
pub struct First {
    /// Time [s].
    pub t: f64,
    /// Step; `None` of a curve, which has none.
    pub step: Option<u64>,
    /// Name of the channel; empty where it concerns a step as a whole.
    pub channel: String,
    /// The value that differs; `None` where a message or step is missing.
    pub value: Option<Difference>,
    /// What differs, as a sentence.
    pub what: String,
}

impl First {
    /// Its time and, where it has one, its step.
    #[must_use]
    pub fn place(&self) -> String {
        let step = self.step.map(|step| format!(", step {step}")).unwrap_or_default();
        format!("t = {} s{step}", self.t)
    }
}

/// A comparison.
#[derive(Debug)]
pub struct Report {
    /// How the logs were compared.
    pub profile: Profile,
    /// What came of it.
    pub verdict: Verdict,
    /// What is lost of the first log.
    pub damage_a: Vec<Damage>,
    /// What is lost of the second.
    pub damage_b: Vec<Damage>,
    /// What differs in header and scene.
    pub settings: Vec<Setting>,
    /// Steps that were compared.
    pub compared_steps: u64,
    /// From when on states were compared by time, because the steps differ [s].
    pub by_time_from: Option<f64>,
    /// The first difference.
    pub first: Option<First>,
    /// What happened just before the states parted.
    pub cause: Option<Cause>,
    /// Every field that was compared.
    pub fields: Vec<FieldReport>,
    /// What only one log has.
    pub structure: Vec<Structure>,
    /// What was not compared, and is not ignored by name.
    pub not_compared: Vec<String>,
    /// What is ignored by name.
    pub ignored: Vec<String>,
    /// What the profile does not compare because it is drawn from what is compared, by name.
    pub drawn: Vec<String>,
    /// How fast the two part.
    pub growth: Option<Rate>,
    /// Curves against a band.
    pub statistics: Option<Statistics>,
}

impl Report {
    pub(super) fn new(profile: Profile) -> Self {
        Self {
            profile,
            verdict: Verdict::Same,
            damage_a: Vec::new(),
            damage_b: Vec::new(),
            settings: Vec::new(),
            compared_steps: 0,
            by_time_from: None,
            first: None,
            cause: None,
            fields: Vec::new(),
            structure: Vec::new(),
            not_compared: Vec::new(),
            ignored: Vec::new(),
            drawn: Vec::new(),
            growth: None,
            statistics: None,
        }
    }

    /// Whether a part of either log is lost.
    #[must_use]
    pub fn damaged(&self) -> bool {
        !(self.damage_a.is_empty() && self.damage_b.is_empty())
    }

    /// The report of logs that could not even be read.
    #[must_use]
    pub fn unreadable(profile: Profile, why: String) -> Self {
        Self::new(profile).incomparable(why)
    }

    pub(super) fn incomparable(mut self, why: impl Into<String>) -> Self {
        self.verdict = Verdict::Incomparable(why.into());
        self
    }

    pub(super) fn structure(&mut self, channel: &str, what: &str, (t, step): (f64, u64)) {
        let known = self.structure.iter_mut().find(|known| known.channel == channel && known.what == what);
        match known {
            Some(known) => known.count += 1,
            None => {
                let (channel, what) = (channel.to_owned(), what.to_owned());
                self.structure.push(Structure { channel: channel.clone(), what: what.clone(), count: 1, t, step });
                self.first(First { t, step: Some(step), channel, value: None, what });
            }
        }
    }

    pub(super) fn first(&mut self, first: First) {
        self.first.get_or_insert(first);
    }
}
