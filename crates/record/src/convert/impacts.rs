//! Impacts to messages and back.

use agglo_core::impact::{Impact, Partner};

use super::{Malformed, components, vector};
use crate::proto::agglo::v1;

/// The impacts of a step.
#[must_use]
pub fn impacts(t: f64, step: u64, impacts: &[Impact]) -> v1::Impacts {
    v1::Impacts { t, step, events: impacts.iter().map(impact).collect() }
}

fn impact(impact: &Impact) -> v1::Impact {
    let Impact {
        time,
        particle,
        partner,
        normal,
        gap_rate_before,
        gap_rate_after,
        tangential_before,
        tangential_after,
        restitution,
        normal_impulse,
        tangential_impulse,
        slip,
        heat,
        position,
    } = *impact;
    v1::Impact {
        t: time,
        i: particle,
        partner: Some(match partner {
            Partner::Particle(j) => v1::impact::Partner::J(j),
            Partner::Wall(wall) => v1::impact::Partner::Wall(wall),
        }),
        normal: vector(normal),
        gap_rate_before,
        gap_rate_after,
        tangential_before: vector(tangential_before),
        tangential_after: vector(tangential_after),
        restitution,
        normal_impulse,
        tangential_impulse: vector(tangential_impulse),
        slip,
        heat,
        position: vector(position),
    }
}

/// The impacts of a step, read back.
///
/// # Errors
/// An impact without a partner.
pub fn read_impacts(message: v1::Impacts) -> Result<Vec<Impact>, Malformed> {
    message.events.into_iter().map(read_impact).collect()
}

fn read_impact(message: v1::Impact) -> Result<Impact, Malformed> {
    let v1::Impact {
        t,
        i,
        partner,
        normal,
        gap_rate_before,
        gap_rate_after,
        tangential_before,
        tangential_after,
        restitution,
        normal_impulse,
        tangential_impulse,
        slip,
        heat,
        position,
    } = message;
    let partner = match partner {
        Some(v1::impact::Partner::J(j)) => Partner::Particle(j),
        Some(v1::impact::Partner::Wall(wall)) => Partner::Wall(wall),
        None => return Err(Malformed(format!("the impact of particle {i} at t = {t} s hits nothing"))),
    };
    Ok(Impact {
        time: t,
        particle: i,
        partner,
        normal: components(normal),
        gap_rate_before,
        gap_rate_after,
        tangential_before: components(tangential_before),
        tangential_after: components(tangential_after),
        restitution,
        normal_impulse,
        tangential_impulse: components(tangential_impulse),
        slip,
        heat,
        position: components(position),
    })
}
