//! Motion in the near field.

use super::{Answer, HardCase, Scheme, Solved, worse};
use crate::order;
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Periods of the long run, and periods after which its energy error is first looked at.
const PERIODS: f64 = 1e4;
const FIRST: f64 = 100.0;

pub const TEN_THOUSAND_PERIODS: HardCase = HardCase {
    name: "ten_thousand_periods",
    case: "two bodies on a circle in the near field, 1e4 periods, fixed step",
    right: "bounded energy error, the right period",
    solve: ten_thousand_periods,
};

/// Attraction of 1 N whatever the distance, reduced mass 1/2 kg, 1 m apart: v^2 = 2 m^2/s^2, a period of 2 pi/sqrt(2) s.
fn ten_thousand_periods(scheme: Scheme) -> Solved {
    let period = TAU / f64::sqrt(2.0);
    let per_period = if scheme.collocates() { 10.0 } else { 40.0 };
    let dt = period / per_period;
    let v = f64::sqrt(0.5);
    let particle =
        |x: f64, v: f64| json!({ "position": [x, 0.0, 0.0], "velocity": [0.0, v, 0.0], "radius": 0.05, "mass": 1.0 });
    let value = json!({
        "duration": PERIODS * period,
        "particles": { "list": [particle(-0.5, -v), particle(0.5, v)] },
        "near_field": { "attraction": { "strength": 1.0, "exponent": 0.0 } },
        "solver": { "step": { "fixed": dt }, "tolerance": { "position": 1e-12 } },
        "record": { "every_steps": 1000 }
    });
    let (mut turned, mut last) = (0.0, 0.0_f64);
    let (mut early, mut late) = (0.0_f64, 0.0_f64);
    scheme.run(&value, |report| {
        let d = report.state.position.get(1) - report.state.position.get(0);
        let angle = d.y.atan2(d.x);
        turned += (angle - last).rem_euclid(TAU);
        last = angle;
        if let Some(sample) = report.sample {
            let error = sample.ledger.residual.abs();
            late = late.max(error);
            if report.time <= FIRST * period {
                early = early.max(error);
            }
        }
    })?;
    let slow = (turned / (TAU * PERIODS) - 1.0).abs();
    // The phase of a scheme of second order is off by (omega dt)^2/24 at most; of high order it is not off at all.
    let allowed = (TAU / per_period).powi(2) / 12.0;
    // Bounded: what is seen in the first hundred periods is all there is (kinetic energy 1/2 J), or round-off.
    let grown = late / early.max(1e-9);
    let measured = format!(
        "period off by {slow:.1e}, energy error {late:.1e} J of 0.5 J at most, {early:.1e} J in the first {FIRST} periods"
    );
    Ok(Answer::found(measured, worse(slow / allowed, 0.5 * grown), 1.0))
}

pub const VIOLENT_RELEASE: HardCase = HardCase {
    name: "violent_release",
    case: "release at 0.2 d_e, exponents 6 and 12",
    right: "the speed that the energy gives",
    solve: violent_release,
};

fn violent_release(scheme: Scheme) -> Solved {
    let particle = |x: f64| json!({ "position": [x, 0.0, 0.0], "radius": 0.05, "mass": 1.0 });
    let value = json!({
        "duration": 1e-3,
        "particles": { "list": [particle(-0.1), particle(0.1)] },
        "near_field": {
            "attraction": { "strength": 1.0, "exponent": 6.0 }, "repulsion": { "strength": 1.0, "exponent": 12.0 }
        },
        "solver": { "step": { "initial": 1e-6, "min": 1e-12 } }
    });
    let (mut distance, mut speed) = (0.0, 0.0);
    scheme.run(&value, |report| {
        distance = (report.state.position.get(1) - report.state.position.get(0)).norm();
        speed = (report.state.velocity.get(1) - report.state.velocity.get(0)).norm();
    })?;
    let potential = |s: f64| s.powi(-11) / 11.0 - s.powi(-5) / 5.0;
    // m_eff = 1/2 kg.
    let expected = (4.0 * (potential(0.2) - potential(distance))).sqrt();
    let error = (speed / expected - 1.0).abs();
    let first_order = matches!(scheme, Scheme::Consistent("backward-euler"));
    Ok(Answer::found(format!("speed off by {error:.1e}"), error, if first_order { 1e-2 } else { 1e-4 }))
}

pub const CROSSINGS: HardCase = HardCase {
    name: "crossings",
    case: "30 particles, many crossings of cut-off and activation distance, where the force jumps",
    right: "the energy residual falls at the scheme's order",
    solve: crossings,
};

fn crossings(scheme: Scheme) -> Solved {
    let residual = |dt: f64| {
        let value = cloud_with_jumps(dt);
        scheme.run(&value, |_| ()).map(|outcome| {
            let ledger = outcome.sample.ledger;
            ledger.residual.abs() / ledger.kinetic
        })
    };
    let (coarse, fine) = (residual(4e-3)?, residual(2.5e-4)?);
    let seen = order(coarse, fine, 16.0);
    let expected: f64 = match scheme {
        Scheme::Paper | Scheme::Consistent("backward-euler") => 1.0,
        _ => 2.0,
    };
    let measured = format!("order {seen:.2}, residual {fine:.1e} of the kinetic energy at 2.5e-4 s");
    // Two runs of a few hundred crossings scatter; an order above the scheme's is luck and no fault. Schemes of high order are
    // at the round-off of their restarts with either step.
    let low = (expected - seen).max(0.0);
    Ok(Answer::found(measured, if scheme.collocates() { low.min(fine / 1e-8) } else { low }, 0.2))
}

fn cloud_with_jumps(dt: f64) -> Value {
    json!({
        "seed": 3, "duration": 0.5,
        "particles": { "random_cube": {
            "count": 30, "side": 1.0, "radius_ratio": 0.1, "density": 2000.0, "velocity_spread": [1.0, 1.0, 1.0] } },
        "near_field": {
            "attraction": { "strength": 5.0, "exponent": 1.0 }, "repulsion": { "strength": 0.8, "exponent": 2.0 },
            "weight": "none", "cutoff": 0.5
        },
        "binding": { "strength": 0.4, "exponent": 1.0, "range": 3.0, "weight": "none" },
        "solver": { "step": { "fixed": dt } }
    })
}
