//! Comparing states by time where the steps of two runs differ: the reference is interpolated to the times of the other
//! log, positions by cubic Hermite polynomials through positions and velocities, everything else linearly.

use agglo_core::domain::Domain;
use agglo_core::ledger::{Ledger, Momentum};
use agglo_core::state::Columns;
use agglo_record::channels::Topic;

use super::steps::RawStep;
use super::{First, Pass};
use crate::Frame;
use crate::messages::{Entry, Message};

/// Times that differ by less than this part of them are the same [-].
const SAME_TIME: f64 = 1e-9;

/// What is compared by time.
const TOPICS: [Topic; 2] = [Topic::Particles, Topic::Energy];

/// A state and its energies.
#[derive(Clone, Debug)]
struct Sample {
    frame: Frame,
    energy: Option<(Ledger, Momentum)>,
}

/// States of both logs that still wait for their counterparts.
#[derive(Debug, Default)]
pub struct ByTime {
    /// The last two of the reference.
    before: Option<Sample>,
    after: Option<Sample>,
    /// States of the other log that are later than any of the reference so far.
    waiting: std::collections::VecDeque<Sample>,
    /// Channels with messages that cannot be interpolated.
    left_out: Vec<String>,
    ended: [Option<f64>; 2],
}

impl ByTime {
    /// Takes a step of the log that is judged.
    pub fn a(&mut self, step: Option<&RawStep>, pass: &mut Pass<'_>) {
        let Some(step) = step else { return };
        self.leave_out(step, pass);
        if let Some(sample) = sample(step) {
            self.ended[0] = Some(step.t);
            self.waiting.push_back(sample);
            self.settle(pass);
        }
    }

    /// Takes a step of the reference.
    pub fn b(&mut self, step: Option<&RawStep>, pass: &mut Pass<'_>) {
        let Some(step) = step else { return };
        self.leave_out(step, pass);
        if let Some(sample) = sample(step) {
            self.ended[1] = Some(step.t);
            self.before = self.after.replace(sample);
            self.settle(pass);
        }
    }

    fn leave_out(&mut self, step: &RawStep, pass: &mut Pass<'_>) {
        for message in &step.messages {
            let name = &*message.channel.name;
            let compared = message.channel.topic.is_some_and(|topic| TOPICS.contains(&topic));
            if !compared
                && !self.left_out.iter().any(|known| known == name)
                && !pass.comparison.tolerances.ignores(name)
            {
                self.left_out.push(name.to_owned());
            }
        }
    }

    /// Compares what lies between the last two states of the reference.
    fn settle(&mut self, pass: &mut Pass<'_>) {
        while let (Some(first), Some(after)) = (self.waiting.front(), &self.after) {
            let t = first.frame.t;
            let slack = SAME_TIME * t.abs();
            let reference = match &self.before {
                _ if (after.frame.t - t).abs() <= slack => after.clone(),
                _ if t > after.frame.t => return,
                Some(before) if (before.frame.t - t).abs() <= slack => before.clone(),
                Some(before) if t > before.frame.t => interpolate(before, after, t, pass),
                // Before the first state of the reference.
                _ => {
                    self.waiting.pop_front();
                    continue;
                }
            };
            pass.report.compared_steps += 1;
            let Some(mut judged) = self.waiting.pop_front() else { return };
            compare(&mut judged, reference, pass);
        }
    }

    /// Says what was not compared.
    pub fn finish(self, pass: &mut Pass<'_>) {
        for name in self.left_out {
            pass.report.not_compared.push(format!("{name}: the steps differ, and it cannot be interpolated in time"));
        }
        if let [Some(a), Some(b)] = self.ended
            && (a - b).abs() > SAME_TIME * a.max(b)
        {
            let (earlier, later) = if a < b { ("first", b) } else { ("second", a) };
            let text = format!("from t = {} s to {later} s: the {earlier} log ends there", a.min(b));
            pass.report.not_compared.push(text);
        }
    }
}

fn sample(step: &RawStep) -> Option<Sample> {
    let Some(Message::Particles(frame)) = step.get(Topic::Particles) else { return None };
    let energy = match step.get(Topic::Energy) {
        Some(Message::Energy(ledger, momentum)) => Some((ledger, momentum)),
        _ => None,
    };
    Some(Sample { frame, energy })
}

fn compare(a: &mut Sample, b: Sample, pass: &mut Pass<'_>) {
    let (t, step) = (a.frame.t, a.frame.step);
    // The number of a cluster is no quantity that could be interpolated.
    a.frame.cluster.clone_from(&b.frame.cluster);
    let entry = |message: Message| Entry { t, step, message };
    let messages = |sample: Sample| {
        let energy = sample.energy.map(|(ledger, momentum)| entry(Message::Energy(ledger, momentum)));
        std::iter::once(entry(Message::Particles(sample.frame))).chain(energy).collect::<Vec<_>>()
    };
    for (a, b) in messages(a.clone()).into_iter().zip(messages(b)) {
        let channel = agglo_record::channels::CHANNELS[a.message.topic() as usize].name;
        if pass.comparison.tolerances.ignores(channel) {
            continue;
        }
        if let Some(value) = pass.comparison.entries(&a, &b) {
            let what = value.to_string();
            pass.report.first(First { t, step: Some(step), channel: channel.to_owned(), value: Some(value), what });
        }
    }
}

fn interpolate(before: &Sample, after: &Sample, t: f64, pass: &Pass<'_>) -> Sample {
    let periodic = Domain::new(pass.scene.and_then(|scene| scene.domain.as_ref())).periodic;
    let (from, to) = (&before.frame, &after.frame);
    let dt = to.t - from.t;
    let share = (t - from.t) / dt;
    let linear = |a: f64, b: f64| a + (b - a) * share;
    let n = from.position.len().min(to.position.len());
    let (mut position, mut velocity) = (Columns::zeros(n), Columns::zeros(n));
    for axis in 0..3 {
        let (r0, r1) = (from.position.axes()[axis], to.position.axes()[axis]);
        let (v0, v1) = (from.velocity.axes()[axis], to.velocity.axes()[axis]);
        let (r, v) = (&mut position.axes_mut()[axis][..], &mut velocity.axes_mut()[axis][..]);
        for k in 0..n {
            let way = periodic.minimum_image(axis, r1[k] - r0[k]);
            let (s, s2, s3) = (share, share * share, share * share * share);
            let hermite = way * (3.0 * s2 - 2.0 * s3) + dt * (v0[k] * (s3 - 2.0 * s2 + s) + v1[k] * (s3 - s2));
            r[k] = r0[k] + hermite;
            v[k] = linear(v0[k], v1[k]);
        }
    }
    let temperature = from.temperature.as_ref().zip(to.temperature.as_ref());
    let temperature = temperature.map(|(a, b)| a.iter().zip(b).map(|(&a, &b)| linear(a, b)).collect());
    let energy = before.energy.as_ref().zip(after.energy.as_ref()).map(|(a, b)| energies(a, b, &linear));
    let frame = Frame { t, step: from.step, position, velocity, temperature, cluster: from.cluster.clone() };
    Sample { frame, energy }
}

fn energies(
    (a, p): &(Ledger, Momentum),
    (b, q): &(Ledger, Momentum),
    linear: &dyn Fn(f64, f64) -> f64,
) -> (Ledger, Momentum) {
    let three = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| linear(a[k], b[k]));
    let (s, u) = (&a.totals, &b.totals);
    let totals = agglo_core::ledger::Totals {
        reaction_heat: linear(s.reaction_heat, u.reaction_heat),
        convected: linear(s.convected, u.convected),
        radiated: linear(s.radiated, u.radiated),
        impact_loss: linear(s.impact_loss, u.impact_loss),
        friction_loss: linear(s.friction_loss, u.friction_loss),
        resting_loss: linear(s.resting_loss, u.resting_loss),
        periodic_work: linear(s.periodic_work, u.periodic_work),
        outside_impulse: three(s.outside_impulse, u.outside_impulse),
    };
    let ledger = Ledger {
        kinetic: linear(a.kinetic, b.kinetic),
        near_field: linear(a.near_field, b.near_field),
        binding: linear(a.binding, b.binding),
        external: linear(a.external, b.external),
        thermal: linear(a.thermal, b.thermal),
        totals,
        residual: linear(a.residual, b.residual),
    };
    let momentum = Momentum {
        linear: three(p.linear, q.linear),
        angular: three(p.angular, q.angular),
        residual: linear(p.residual, q.residual),
    };
    (ledger, momentum)
}
