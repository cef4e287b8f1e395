//! Which messages a step must have, as the recorder decides it.

use agglo_record::channels::{CHANNELS, Topic};
use agglo_record::run::log_time;

use super::{Judge, Plan, Seen, Step};

impl Judge {
    /// What a step must have, of what is shown.
    pub(super) fn due(&mut self, step: &Step) -> Seen {
        let start = step.number == 0;
        let recorded =
            [Topic::Particles, Topic::Energy, Topic::Clusters].iter().any(|topic| step.seen[*topic as usize]);
        let mut due = [false; CHANNELS.len()];
        due[Topic::ParticlesStatic as usize] = start;
        due[Topic::Diagnostics as usize] = !start;
        let state = recorded || start || self.recording_due(step);
        let Some(plan) = &self.plan else {
            due[Topic::Particles as usize] = recorded;
            due[Topic::Energy as usize] = recorded;
            return self.of_shown(due);
        };
        for topic in [Topic::Particles, Topic::Energy, Topic::Clusters] {
            due[topic as usize] = state;
        }
        due[Topic::Checkpoint as usize] = step.number.is_multiple_of(plan.record.checkpoint_every);
        if step.seen[Topic::Particles as usize] {
            let interval = (log_time(step.t, self.time_scale) as f64 * 1e-9 * plan.record.markers).floor() as u64;
            // After a loss, when the last one was drawn is not known.
            due[Topic::Scene as usize] = match self.drawn {
                None => start,
                Some(drawn) => interval > drawn && !self.excused,
            };
            if step.seen[Topic::Scene as usize] {
                self.drawn = Some(interval);
            }
        }
        for (due, present) in due.iter_mut().zip(plan.present) {
            *due &= present;
        }
        self.of_shown(due)
    }

    fn of_shown(&self, mut due: Seen) -> Seen {
        due.iter_mut().zip(self.shown).for_each(|(due, shown)| *due &= shown);
        due
    }

    /// Whether the scene's cadence records a step, or it is the last one.
    fn recording_due(&self, step: &Step) -> bool {
        let Some(Plan { record, duration, .. }) = &self.plan else { return false };
        let before = self.before.map_or(0.0, |(_, t, _)| t);
        if step.t >= *duration {
            return true;
        }
        match record.interval {
            Some(interval) => {
                let reached = |t: f64| (t / interval + 1e-9).floor() as u64;
                reached(step.t) > reached(before) && self.before.is_some_and(|(of, ..)| of + 1 == step.number)
            }
            None => step.number.is_multiple_of(record.every_steps.unwrap_or(1)),
        }
    }
}
