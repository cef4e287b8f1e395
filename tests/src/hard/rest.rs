//! Infinitely many impacts, and what rests after them.

use super::{Answer, HardCase, Scheme, Solved, ball, balls, last_velocities, worse};
use serde_json::{Value, json};

const G: f64 = 9.81;

fn first_order(scheme: Scheme) -> bool {
    scheme == Scheme::Consistent("backward-euler")
}

/// A ball above a floor.
fn on_a_floor(height: f64, duration: f64, dt: f64, e: impl Into<Value>) -> Value {
    let mut value = balls(&[ball([0.0, 0.0, height], [0.0; 3])], duration, dt, e);
    value["domain"] = json!({ "walls": [{ "point": [0, 0, 0], "normal": [0, 0, 1] }] });
    value["external"] = json!({ "gravity": [0.0, 0.0, -G] });
    value
}

pub const COLLAPSE_OF_THREE: HardCase = HardCase {
    name: "collapse_of_three",
    case: "three equal balls in line, (v, 0, 0) with gaps, e = 0.02 and 0.06 below 7 - 4 sqrt(3), e = 0.09 above",
    right: "below: infinitely many impacts, then they move as one; above: they part",
    solve: collapse_of_three,
};

fn collapse_of_three(scheme: Scheme) -> Solved {
    let mut error: f64 = 0.0;
    let mut words = Vec::new();
    for (e, together) in [(0.02, true), (0.06, true), (0.09, false)] {
        let list =
            [ball([0.0; 3], [1.0, 0.0, 0.0]), ball([0.13, 0.0, 0.0], [0.0; 3]), ball([0.25, 0.0, 0.0], [0.0; 3])];
        let (steps, outcome) = scheme.record(&balls(&list, 2.0, 0.1, e))?;
        let v = last_velocities(&steps);
        let spread = v[2].x - v[0].x;
        let momentum = (v.iter().map(|v| v.x).sum::<f64>() - 1.0).abs();
        let wrong = if together { spread.abs() } else { f64::from(u8::from(spread <= 1e-4)) };
        error = worse(error, worse(wrong, momentum));
        words.push(format!("e = {e}: {spread:.1e} m/s apart after {} impacts", outcome.counters.impacts));
    }
    Ok(Answer::found(words.join("; "), error, 1e-12))
}

pub const BALL_TO_REST: HardCase = HardCase {
    name: "ball_to_rest",
    case: "a ball dropped from 1 m on a floor, e = 0.8, steps of 10 ms",
    right: "peak k at h e^(2k), at rest after sqrt(2h/g) (1 + e)/(1 - e)",
    solve: ball_to_rest,
};

fn ball_to_rest(scheme: Scheme) -> Solved {
    let (h, e, dt) = (1.0, 0.8_f64, 1e-2);
    let (steps, _) = scheme.record(&on_a_floor(0.05 + h, 5.0, dt, e))?;
    let impacts: Vec<_> = steps.iter().flat_map(|step| step.impacts.iter()).collect();
    let mut error: f64 = 0.0;
    for (k, impact) in impacts.iter().enumerate().take(12) {
        // Peak k + 1 from the speed after impact k.
        let peak = impact.gap_rate_after.powi(2) / (2.0 * G);
        error = worse(error, (peak / (h * e.powi(2 * (k as i32 + 1))) - 1.0).abs());
    }
    let zeno = f64::sqrt(2.0 * h / G) * (1.0 + e) / (1.0 - e);
    let last = impacts.last().map_or(f64::NAN, |impact| impact.time);
    // The bounce that would end within a step is the last; all that follow would take 1/(1 - e) as long.
    let early = zeno - last;
    if !(early >= 0.0 && early <= dt / (1.0 - e)) {
        error = f64::NAN;
    }
    let end = &steps[steps.len() - 1].state;
    error = worse(error, worse((end.position.z[0] - 0.05).abs(), end.velocity.z[0].abs()));
    let measured = format!("peaks off by {error:.1e}, at rest from {last:.3} s on (the series ends at {zeno:.3} s)");
    // A scheme of first order under gravity is off by g dt/(2 v) per bounce.
    let bound = if first_order(scheme) { 0.2 } else { 1e-9 };
    Ok(Answer::found(measured, error, bound))
}

pub const SLOW_DECAY: HardCase = HardCase {
    name: "slow_decay",
    case: "the same with e = 1 - u/v*: more and more impacts, no last one",
    right: "amplitudes decay by the law; at rest below contact.rest_speed, logged",
    solve: slow_decay,
};

fn slow_decay(scheme: Scheme) -> Solved {
    let mut value = on_a_floor(0.3, 60.0, 1e-2, json!({ "e0": 1.0, "v_star": 10.0 }));
    value["contact"]["rest_speed"] = json!(0.04);
    let mut speeds: Vec<f64> = Vec::new();
    let mut told = false;
    let outcome = scheme.run(&value, |report| {
        speeds.extend(report.impacts.iter().map(|impact| -impact.gap_rate_before));
        told |= report.notices.iter().any(|notice| notice.message.contains("resting"));
    })?;
    let off = |pair: &[f64]| (pair[1] / ((1.0 - pair[0] / 10.0) * pair[0]) - 1.0).abs();
    let mut error = speeds.windows(2).map(off).fold(0.0, worse);
    let rising = speeds.windows(2).filter(|pair| pair[1] >= pair[0]).count();
    // A scheme of first order gives what rests the speed g dt/2.
    let (bound, still) = if first_order(scheme) { (2.0, (G * 1e-2_f64).powi(2)) } else { (1e-9, 1e-20) };
    if rising > 0 || !told || outcome.sample.ledger.kinetic > still {
        error = f64::NAN;
    }
    let measured =
        format!("{} impacts, the last at {:.3} m/s", speeds.len(), speeds.last().copied().unwrap_or(f64::NAN));
    Ok(Answer::found(measured, error, bound))
}

/// What a contact at rest did in a long run.
struct Rested {
    gap: f64,
    kinetic: f64,
    reheated: f64,
    warmed: f64,
}

/// Runs attracted particles to rest; from `settled` [s] on, nothing may happen any more.
fn rests(
    scheme: Scheme,
    mut value: Value,
    settled: f64,
    gap: impl Fn(&agglo_core::state::State) -> f64,
) -> Result<Rested, String> {
    value["near_field"] = json!({ "attraction": { "strength": 0.2, "exponent": 1.0 } });
    for particle in value["particles"]["list"].as_array_mut().into_iter().flatten() {
        particle["temperature"] = json!(300.0);
    }
    value["thermal"] = json!({ "heat_capacity": 1000.0, "reaction": { "energy_per_area": 1e6, "force_scale": 1e3 } });
    value["contact"]["duration"] = json!({ "seconds": 1e-3 });
    value["record"] = json!({ "every_steps": 1000 });
    let mut rested = Rested { gap: 0.0, kinetic: 0.0, reheated: 0.0, warmed: 0.0 };
    let mut heat = None;
    scheme.run(&value, |report| {
        let Some(sample) = report.sample.filter(|_| report.time >= settled) else { return };
        rested.gap = worse(rested.gap, gap(report.state));
        let momentum: f64 = sample.momentum.linear.iter().map(|p| p * p).sum();
        let drift = 0.5 * momentum / report.particles.mass.iter().sum::<f64>();
        rested.kinetic = worse(rested.kinetic, sample.ledger.kinetic - drift);
        rested.warmed = sample.ledger.totals.reaction_heat;
        rested.reheated = rested.warmed - *heat.get_or_insert(rested.warmed);
    })?;
    Ok(rested)
}

/// Implicit schemes leave the gap to their iteration (1e-9 m), one of first order a speed of a dt/2 to what rests; what a cluster
/// turns with after impacts of second order, 1e-9 of the energy that falling together sets free, is no creep.
fn judged(scheme: Scheme, rested: &Rested) -> Answer {
    let gap = if scheme == Scheme::Consistent("velocity-verlet") { 1e-13 } else { 1e-9 };
    let kinetic = if first_order(scheme) { 1e-4 } else { 1e-10 };
    let reheated = if rested.reheated == 0.0 { 0.0 } else { f64::INFINITY };
    let error = [rested.gap / gap, rested.kinetic / kinetic, reheated];
    let measured = format!(
        "gap {:.1e} m, kinetic energy {:.1e} J, {:.1e} J of heat released while at rest",
        rested.gap, rested.kinetic, rested.reheated
    );
    Answer::found(measured, error.into_iter().fold(0.0, worse), 1.0)
}

pub const ATTRACTED_PAIR: HardCase = HardCase {
    name: "attracted_pair",
    case: "an attracted pair bounces to rest, 1e5 steps",
    right: "at rest on the contact; no creep, no reheating",
    solve: attracted_pair,
};

fn attracted_pair(scheme: Scheme) -> Solved {
    let value = balls(&[ball([0.0; 3], [0.0; 3]), ball([0.13, 0.0, 0.0], [0.0; 3])], 100.0, 1e-3, 0.5);
    let gap = |state: &agglo_core::state::State| ((state.position.get(1) - state.position.get(0)).norm() - 0.1).abs();
    Ok(judged(scheme, &rests(scheme, value, 5.0, gap)?))
}

pub const RESTING_CLUSTER: HardCase = HardCase {
    name: "resting_cluster",
    case: "four attracted balls fall into a cluster and rest there, 1e5 steps",
    right: "all at rest, touching; no creep, no reheating",
    solve: resting_cluster,
};

fn resting_cluster(scheme: Scheme) -> Solved {
    // A tetrahedron, not quite regular, a fifth wider than touching.
    let list = [
        ball([0.0, 0.0, 0.0], [0.0; 3]),
        ball([0.12, 0.0, 0.0], [0.0; 3]),
        ball([0.062, 0.104, 0.0], [0.0; 3]),
        ball([0.06, 0.035, 0.099], [0.0; 3]),
    ];
    let value = balls(&list, 100.0, 1e-3, 0.3);
    let gap = |state: &agglo_core::state::State| {
        let pairs = (0..4).flat_map(|i| (i + 1..4).map(move |j| (i, j)));
        let gap = |(i, j)| ((state.position.get(j) - state.position.get(i)).norm() - 0.1_f64).abs();
        pairs.map(gap).fold(0.0, worse)
    };
    Ok(judged(scheme, &rests(scheme, value, 20.0, gap)?))
}

pub const ORBIT_WITH_FRICTION: HardCase = HardCase {
    name: "orbit_with_friction",
    case: "a touching pair on orbit, sliding with friction",
    right: "m_eff v_t' = -mu_d (F - m_eff v_t^2/(b_i + b_j))",
    solve: orbit_with_friction,
};

fn orbit_with_friction(scheme: Scheme) -> Solved {
    let (mu, force, m_eff, s, v0, end) = (0.2, 3.0, 0.5, 0.1, 0.5, 0.1);
    // v' = -(mu/m_eff) (F - m_eff v^2/s) has the solution c tanh(artanh(v0/c) - mu c t/s), c^2 = F s/m_eff.
    let c = f64::sqrt(force * s / m_eff);
    let expected = c * ((v0 / c).atanh() - mu * c * end / s).tanh();
    let list = [ball([0.0; 3], [0.0, -0.5 * v0, 0.0]), ball([s, 0.0, 0.0], [0.0, 0.5 * v0, 0.0])];
    let mut value = balls(&list, end, 1e-3, 0.5);
    value["contact"]["friction"] = json!({ "static": mu, "dynamic": mu });
    value["near_field"] = json!({ "attraction": { "strength": force, "exponent": 0.0 } });
    let (steps, _) = scheme.record(&value)?;
    let v = last_velocities(&steps);
    let r = &steps[steps.len() - 1].state.position;
    let gap = ((r.get(1) - r.get(0)).norm() - s).abs();
    let error = ((v[1] - v[0]).norm() / expected - 1.0).abs();
    let bound = if first_order(scheme) { 1e-2 } else { 1e-4 };
    let measured = format!("sliding speed off by {error:.1e}, gap {gap:.1e} m");
    Ok(Answer::found(measured, worse(error, gap / 1e-13 * bound), bound))
}
