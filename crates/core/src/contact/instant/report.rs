//! What impulses leave behind: reaction heat, and what is said of an impact.

use super::{Instant, Joint, Moment};
use crate::impact::Impact;
use nalgebra::Vector3;

impl Instant {
    /// Reaction heat at the impulse of contact k, given to its particles [J].
    pub(super) fn react(
        &mut self,
        k: usize,
        moment: &Moment<'_>,
        heat: impl Fn(&crate::thermal::reaction::ReactionHeat, f64, f64) -> f64,
    ) -> f64 {
        self.react_with(k, moment, self.joints[k].impulse, heat)
    }

    pub(super) fn react_with(
        &mut self,
        k: usize,
        moment: &Moment<'_>,
        impulse: f64,
        heat: impl Fn(&crate::thermal::reaction::ReactionHeat, f64, f64) -> f64,
    ) -> f64 {
        let Some(reaction) = &moment.law.reaction else { return 0.0 };
        let Joint { i, j, radius, .. } = self.joints[k];
        // The duration only turns the impulse into the mean force of the reaction law.
        let heat = heat(reaction, impulse / moment.law.duration(0.0), radius);
        for row in [Some(i), j].into_iter().flatten() {
            self.bodies[row].theta += heat / self.bodies[row].capacity;
        }
        heat
    }

    pub(super) fn report(
        &self,
        k: usize,
        moment: &Moment<'_>,
        (u, after, e): (f64, f64, f64),
        slide: Vector3<f64>,
        slip: Option<bool>,
        heat: f64,
    ) -> Impact {
        let joint = &self.joints[k];
        Impact {
            time: moment.time,
            particle: joint.touch.i as u32,
            partner: joint.touch.partner,
            normal: joint.normal.into(),
            gap_rate_before: -u,
            gap_rate_after: after,
            tangential_before: slide.into(),
            tangential_after: self.sliding(k).into(),
            restitution: e,
            normal_impulse: joint.impulse,
            tangential_impulse: joint.tangential.into(),
            slip,
            heat,
            position: joint.position.into(),
        }
    }
}
