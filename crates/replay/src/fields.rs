//! A decoded message taken apart into named columns, and the first value in which two messages differ.
//!
//! Messages are taken apart without `..`, so that a new quantity cannot go uncompared: it does not compile.

use std::borrow::Cow;

use agglo_core::checkpoint::{Checkpoint, Counters};
use agglo_core::collocation::Carried;
use agglo_core::diagnostics::{Notice, RejectionCause, StepDiagnostics};
use agglo_core::impact::{Impact, Partner};
use agglo_core::ledger::{Ledger, Momentum, Totals};
use agglo_core::observer::Clusters;
use agglo_core::state::{Columns, Particles, State};
use serde_json::Value;

use crate::Frame;
use crate::messages::{Entry, Message};

/// The values of one quantity.
#[derive(Clone, Debug, PartialEq)]
pub enum Values<'a> {
    /// Real numbers.
    Real(Cow<'a, [f64]>),
    /// Counts and numbers of particles.
    Integer(Vec<u64>),
    /// Texts.
    Text(Vec<Cow<'a, str>>),
}

impl Values<'_> {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Integer(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The value at an index, for people and programs; null beyond the end.
    #[must_use]
    pub fn get(&self, k: usize) -> Value {
        match self {
            Self::Real(values) => values.get(k).map_or(Value::Null, |value| number(*value)),
            Self::Integer(values) => values.get(k).map_or(Value::Null, |value| (*value).into()),
            Self::Text(values) => values.get(k).map_or(Value::Null, |value| value.as_ref().into()),
        }
    }
}

/// A number that JSON can hold, or its name as a string.
#[must_use]
pub fn number(value: f64) -> Value {
    match value {
        value if value.is_finite() => value.into(),
        value if value.is_nan() => "NaN".into(),
        value if value > 0.0 => "Infinity".into(),
        _ => "-Infinity".into(),
    }
}

/// What the index of a column counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Index {
    /// Particles.
    Particle,
    /// Something else, or there is one value only.
    Other,
}

/// A quantity of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Field<'a> {
    /// Its name within the channel, such as `x`.
    pub name: &'static str,
    /// What its index counts.
    pub index: Index,
    /// Its values.
    pub values: Values<'a>,
}

/// Gathers the fields of a message.
struct Gather<'a>(Vec<Field<'a>>);

impl<'a> Gather<'a> {
    fn column(&mut self, name: &'static str, values: &'a [f64]) {
        self.0.push(Field { name, index: Index::Particle, values: Values::Real(Cow::Borrowed(values)) });
    }

    fn columns(&mut self, names: [&'static str; 3], columns: &'a Columns) {
        for (name, axis) in names.into_iter().zip(columns.axes()) {
            self.column(name, axis);
        }
    }

    fn reals(&mut self, name: &'static str, values: impl Into<Cow<'a, [f64]>>) {
        self.0.push(Field { name, index: Index::Other, values: Values::Real(values.into()) });
    }

    fn real(&mut self, name: &'static str, value: f64) {
        self.reals(name, vec![value]);
    }

    fn integers(&mut self, name: &'static str, values: Vec<u64>) {
        self.0.push(Field { name, index: Index::Other, values: Values::Integer(values) });
    }

    fn integer(&mut self, name: &'static str, value: u64) {
        self.integers(name, vec![value]);
    }

    fn text(&mut self, name: &'static str, value: impl Into<Cow<'a, str>>) {
        self.0.push(Field { name, index: Index::Other, values: Values::Text(vec![value.into()]) });
    }
}

/// The quantities of a message, always in the same order, its time first; those that the scene does not have are absent.
#[must_use]
pub fn fields(entry: &Entry) -> Vec<Field<'_>> {
    let mut to = Gather(Vec::new());
    let Entry { t, step: _, message } = entry;
    to.real("t", *t);
    match message {
        Message::Static(Particles { radius, mass, charge }) => {
            to.column("radius", radius);
            to.column("mass", mass);
            if let Some(charge) = charge {
                to.column("charge", charge);
            }
        }
        Message::Particles(Frame { t: _, step: _, position, velocity, temperature, cluster }) => {
            to.columns(["x", "y", "z"], position);
            to.columns(["vx", "vy", "vz"], velocity);
            if let Some(temperature) = temperature {
                to.column("temperature", temperature);
            }
            if let Some(cluster) = cluster {
                let values = Values::Integer(cluster.iter().map(|&number| number.into()).collect());
                to.0.push(Field { name: "cluster", index: Index::Particle, values });
            }
        }
        Message::Diagnostics(diagnostics) => step(&mut to, diagnostics),
        Message::Energy(energy, momentum) => ledger(&mut to, energy, momentum),
        Message::Clusters(Clusters { of: _, count, largest, singletons, mean_size }) => {
            to.integer("count", (*count).into());
            to.integer("largest", (*largest).into());
            to.integer("singletons", (*singletons).into());
            to.real("mean_size", *mean_size);
        }
        Message::Impacts(events) => impacts(&mut to, events),
        Message::Checkpoint(checkpoint) => self::checkpoint(&mut to, checkpoint),
        Message::Log(Notice { level, message }) => {
            to.text("level", format!("{level:?}"));
            to.text("message", message.as_str());
        }
        Message::Scene => {}
    }
    to.0
}

fn step<'a>(to: &mut Gather<'a>, diagnostics: &'a StepDiagnostics) {
    let StepDiagnostics {
        dt,
        position_errors,
        temperature_errors,
        violation,
        scaling,
        contraction,
        local_error,
        rejected,
        contacts,
        resting,
        bonds,
        rounds,
        impact_residual,
        fallbacks,
        crossings,
        pairs_evaluated,
    } = diagnostics;
    to.real("dt", *dt);
    to.integer("iterations", position_errors.len() as u64);
    to.reals("position_errors", &position_errors[..]);
    to.reals("temperature_errors", &temperature_errors[..]);
    to.real("violation", *violation);
    to.real("scaling", *scaling);
    to.real("contraction", *contraction);
    if let Some(error) = local_error {
        to.real("local_error", *error);
    }
    to.integer("rejected", rejected.len() as u64);
    let cause = |cause| match cause {
        RejectionCause::NotConverged => 1,
        RejectionCause::NotFinite => 2,
        RejectionCause::LocalError => 3,
        RejectionCause::Travel => 4,
    };
    to.integers("rejected.cause", rejected.iter().map(|attempt| cause(attempt.cause)).collect());
    to.reals("rejected.dt", rejected.iter().map(|attempt| attempt.dt).collect::<Vec<_>>());
    to.integers("rejected.iterations", rejected.iter().map(|attempt| attempt.iterations).collect());
    to.reals("rejected.violation", rejected.iter().map(|attempt| attempt.violation).collect::<Vec<_>>());
    to.integers("rejected.particle", rejected.iter().map(|attempt| attempt.particle.into()).collect());
    to.integer("contacts", *contacts);
    to.integer("resting", *resting);
    if let Some(bonds) = bonds {
        to.integer("bonds", *bonds);
    }
    to.integer("rounds", *rounds);
    if let Some(residual) = impact_residual {
        to.real("impact_residual", *residual);
    }
    for (name, count) in [("fallbacks", fallbacks), ("crossings", crossings)] {
        if let Some(count) = count {
            to.integer(name, *count);
        }
    }
    to.integer("pairs_evaluated", *pairs_evaluated);
}

fn ledger(to: &mut Gather<'_>, ledger: &Ledger, momentum: &Momentum) {
    let Ledger { kinetic, near_field, binding, external, thermal, totals: sums, residual } = ledger;
    to.real("kinetic", *kinetic);
    to.real("near_field", *near_field);
    to.real("binding", *binding);
    to.real("external", *external);
    to.real("thermal", *thermal);
    totals(to, sums);
    to.real("residual", *residual);
    let Momentum { linear, angular, residual } = momentum;
    to.reals("momentum", linear.to_vec());
    to.reals("angular_momentum", angular.to_vec());
    to.real("momentum_residual", *residual);
}

fn totals(to: &mut Gather<'_>, totals: &Totals) {
    let Totals {
        reaction_heat,
        convected,
        radiated,
        impact_loss,
        friction_loss,
        resting_loss,
        periodic_work,
        outside_impulse,
    } = totals;
    to.real("reaction_heat", *reaction_heat);
    to.real("convected", *convected);
    to.real("radiated", *radiated);
    to.real("impact_loss", *impact_loss);
    to.real("friction_loss", *friction_loss);
    to.real("resting_loss", *resting_loss);
    to.real("periodic_work", *periodic_work);
    to.reals("outside_impulse", outside_impulse.to_vec());
}

/// Stands for "hit no particle" or "hit no wall".
const NONE: u64 = u64::MAX;

fn impacts(to: &mut Gather<'_>, events: &[Impact]) {
    to.integer("events", events.len() as u64);
    let Some(Impact {
        // All of these are columns below; taken apart here so that a new one is missed by the compiler.
        time: _,
        particle: _,
        partner: _,
        normal: _,
        gap_rate_before: _,
        gap_rate_after: _,
        tangential_before: _,
        tangential_after: _,
        restitution: _,
        normal_impulse: _,
        tangential_impulse: _,
        slip: _,
        heat: _,
        position: _,
    }) = events.first()
    else {
        return;
    };
    let reals = |of: fn(&Impact) -> f64| events.iter().map(of).collect::<Vec<_>>();
    let vectors = |of: fn(&Impact) -> [f64; 3]| events.iter().flat_map(of).collect::<Vec<_>>();
    let integers = |of: fn(&Impact) -> u64| events.iter().map(of).collect::<Vec<_>>();
    to.reals("time", reals(|event| event.time));
    to.integers("i", integers(|event| event.particle.into()));
    to.integers("j", integers(|event| if let Partner::Particle(j) = event.partner { j.into() } else { NONE }));
    to.integers("wall", integers(|event| if let Partner::Wall(wall) = event.partner { wall.into() } else { NONE }));
    to.reals("normal", vectors(|event| event.normal));
    to.reals("gap_rate_before", reals(|event| event.gap_rate_before));
    to.reals("gap_rate_after", reals(|event| event.gap_rate_after));
    to.reals("tangential_before", vectors(|event| event.tangential_before));
    to.reals("tangential_after", vectors(|event| event.tangential_after));
    to.reals("restitution", reals(|event| event.restitution));
    to.reals("normal_impulse", reals(|event| event.normal_impulse));
    to.reals("tangential_impulse", vectors(|event| event.tangential_impulse));
    to.integers("slip", integers(|event| event.slip.map_or(NONE, u64::from)));
    to.reals("heat", reals(|event| event.heat));
    to.reals("position", vectors(|event| event.position));
}

fn checkpoint<'a>(to: &mut Gather<'a>, checkpoint: &'a Checkpoint) {
    let Checkpoint {
        time: _,
        time_rest,
        step: _,
        next_dt,
        state: State { position, velocity, temperature },
        acceleration,
        list_positions,
        totals: sums,
        initial_energy,
        initial_momentum: Momentum { linear, angular, residual },
        counters,
        notices_given,
        collocation,
        origin,
    } = checkpoint;
    to.real("time_rest", *time_rest);
    to.real("next_dt", *next_dt);
    to.columns(["x", "y", "z"], position);
    to.reals("origin", origin.to_vec());
    to.columns(["vx", "vy", "vz"], velocity);
    if let Some(temperature) = temperature {
        to.column("temperature", temperature);
    }
    to.columns(["acceleration.x", "acceleration.y", "acceleration.z"], acceleration);
    to.columns(["list_positions.x", "list_positions.y", "list_positions.z"], list_positions);
    totals(to, sums);
    to.real("initial_energy", *initial_energy);
    to.reals("initial_momentum", linear.to_vec());
    to.reals("initial_angular_momentum", angular.to_vec());
    to.real("initial_momentum_residual", *residual);
    let Counters {
        steps,
        iterations,
        rejected_steps,
        impacts,
        pair_evaluations,
        intervals,
        max_overlap,
        largest_momentum,
    } = counters;
    let counts = vec![*steps, *iterations, *rejected_steps, *impacts, *pair_evaluations, *intervals];
    to.integers("counters", counts);
    to.real("max_overlap", *max_overlap);
    to.real("largest_momentum", *largest_momentum);
    to.integer("notices_given", *notices_given);
    if let Some(Carried { dt, accelerations, position_rest, velocity_rest }) = collocation {
        to.real("carried.dt", *dt);
        let values = |columns: &Columns| columns.axes().concat();
        to.reals("carried.accelerations", accelerations.iter().flat_map(values).collect::<Vec<_>>());
        to.reals("carried.position_rest", values(position_rest));
        to.reals("carried.velocity_rest", values(velocity_rest));
    }
}

/// The first value that differs between two messages.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// Name of the field, with its channel, such as `/particles.x`; the channel alone where the messages are of two.
    pub field: String,
    /// Index of the value, where the field has several.
    pub index: Option<usize>,
    /// Whether that is the number of a particle.
    pub is_particle: bool,
    /// Value in the first; null where it has none.
    pub a: Value,
    /// Value in the second.
    pub b: Value,
    /// |a - b| of two numbers.
    pub abs: Option<f64>,
    /// |a - b| / max(|a|, |b|) of two numbers [-].
    pub rel: Option<f64>,
    /// Distance in units in the last place of two real numbers.
    pub ulp: Option<u64>,
}

impl Difference {
    /// A field, or where that is empty a whole channel, that one of the two does not have.
    #[must_use]
    pub fn missing(channel: &str, field: &str) -> Self {
        Self {
            field: if field.is_empty() { channel.to_owned() } else { format!("{channel}.{field}") },
            index: None,
            is_particle: false,
            a: Value::Null,
            b: Value::Null,
            abs: None,
            rel: None,
            ulp: None,
        }
    }
}

impl std::fmt::Display for Difference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.field)?;
        match self.index {
            Some(index) if self.is_particle => write!(f, " of particle {index}")?,
            Some(index) => write!(f, "[{index}]")?,
            None => {}
        }
        let text = |value: &Value| if value.is_null() { "nothing".to_owned() } else { value.to_string() };
        write!(f, " is {} and {}", text(&self.a), text(&self.b))?;
        match (self.abs, self.ulp) {
            (Some(abs), Some(ulp)) if ulp < 1 << 40 => write!(f, ", {abs:e} or {ulp} ulp apart"),
            (Some(abs), _) => write!(f, ", {abs:e} apart"),
            _ => Ok(()),
        }
    }
}

/// The first value, in the order of [`fields`], that is not the same bit for bit.
#[must_use]
pub fn first_difference(a: &Entry, b: &Entry) -> Option<Difference> {
    let channel = agglo_record::channels::CHANNELS[a.message.topic() as usize].name;
    if a.message.topic() != b.message.topic() {
        return Some(Difference::missing(channel, ""));
    }
    let (a, b) = (fields(a), fields(b));
    for (k, field) in a.iter().enumerate() {
        // A column that one of the two does not have shifts all that follow.
        let Some(other) = b.get(k).filter(|other| other.name == field.name) else {
            return Some(Difference::missing(channel, field.name));
        };
        if let Some(index) = first_index(&field.values, &other.values) {
            return Some(difference(channel, field, other, index));
        }
    }
    b.get(a.len()).map(|extra| Difference::missing(channel, extra.name))
}

/// The two values at an index.
pub(crate) fn difference(channel: &str, a: &Field<'_>, b: &Field<'_>, index: usize) -> Difference {
    let numbers = match (&a.values, &b.values) {
        (Values::Real(a), Values::Real(b)) => a.get(index).copied().zip(b.get(index).copied()),
        (Values::Integer(a), Values::Integer(b)) => a.get(index).zip(b.get(index)).map(|(&a, &b)| (a as f64, b as f64)),
        _ => None,
    };
    let reals = matches!(a.values, Values::Real(_));
    let is_particle = a.index == Index::Particle;
    let several = is_particle || a.values.len().max(b.values.len()) > 1;
    Difference {
        field: format!("{channel}.{}", a.name),
        index: several.then_some(index),
        is_particle,
        a: a.values.get(index),
        b: b.values.get(index),
        abs: numbers.map(|(a, b)| (a - b).abs()),
        rel: numbers.map(|(a, b)| relative(a, b)),
        ulp: numbers.filter(|_| reals).map(|(a, b)| ulps(a, b)),
    }
}

/// |a - b| over the larger magnitude, 0 where both are zero [-].
#[must_use]
pub fn relative(a: f64, b: f64) -> f64 {
    let scale = a.abs().max(b.abs());
    if scale > 0.0 { (a - b).abs() / scale } else { 0.0 }
}

/// How many numbers lie from a to b, counting b; -0 and 0 are one apart, and so count NaNs by their bits.
#[must_use]
pub fn ulps(a: f64, b: f64) -> u64 {
    // Numbers in their order: negative ones run backwards.
    let ordered = |x: f64| {
        let bits = x.to_bits() as i64;
        i128::from(if bits < 0 { i64::MIN - bits - 1 } else { bits })
    };
    (ordered(a) - ordered(b)).unsigned_abs() as u64
}

/// The first index at which two columns differ bit for bit.
fn first_index(a: &Values<'_>, b: &Values<'_>) -> Option<usize> {
    fn first<T>(a: &[T], b: &[T], same: impl Fn(&T, &T) -> bool) -> Option<usize> {
        let differs = a.iter().zip(b).position(|(a, b)| !same(a, b));
        differs.or_else(|| (a.len() != b.len()).then(|| a.len().min(b.len())))
    }
    match (a, b) {
        (Values::Real(a), Values::Real(b)) => first(a, b, |a, b| a.to_bits() == b.to_bits()),
        (Values::Integer(a), Values::Integer(b)) => first(a, b, |a, b| a == b),
        (Values::Text(a), Values::Text(b)) => first(a, b, |a, b| a == b),
        _ => Some(0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_in_the_last_place() {
        assert_eq!(ulps(1.0, 1.0), 0);
        assert_eq!(ulps(1.0, 1.0 + f64::EPSILON), 1);
        assert_eq!(ulps(-1.0, -1.0 - f64::EPSILON), 1);
        assert_eq!(ulps(0.0, -0.0), 1);
        assert_eq!(ulps(f64::MIN_POSITIVE, -f64::MIN_POSITIVE), 2 * (1 << 52) + 1);
        assert_eq!(ulps(f64::INFINITY, f64::MAX), 1);
        assert!(ulps(f64::NAN, 1.0) > 1 << 50 && ulps(f64::NEG_INFINITY, f64::INFINITY) > 1 << 63);
    }

    fn entry(message: Message) -> Entry {
        Entry { t: 0.0, step: 0, message }
    }

    #[test]
    fn the_first_of_several_differences_comes_first() {
        let frame = |x: f64, v: f64| {
            let mut frame = Frame { position: Columns::zeros(3), velocity: Columns::zeros(3), ..Frame::default() };
            (frame.position.x[2], frame.velocity.y[1]) = (x, v);
            entry(Message::Particles(frame))
        };
        assert_eq!(first_difference(&frame(0.0, 1.0), &frame(0.0, 1.0)), None);
        let found = first_difference(&frame(-0.0, 1.0), &frame(0.0, 2.0)).unwrap();
        assert_eq!((found.field.as_str(), found.index, found.ulp), ("/particles.x", Some(2), Some(1)));
        assert_eq!(found.to_string(), "/particles.x of particle 2 is -0.0 and 0.0, 0e0 or 1 ulp apart");
        let found = first_difference(&frame(0.0, 1.0), &frame(0.0, 2.0)).unwrap();
        assert_eq!((found.field.as_str(), found.index, found.abs), ("/particles.vy", Some(1), Some(1.0)));
    }

    #[test]
    fn a_column_that_is_missing_is_named() {
        let charged = Particles { radius: vec![1.0], mass: vec![1.0], charge: Some(vec![1.0]) };
        let plain = Particles { charge: None, ..charged.clone() };
        let found = first_difference(&entry(Message::Static(charged)), &entry(Message::Static(plain))).unwrap();
        assert_eq!(found.field, "/particles/static.charge");
    }
}
