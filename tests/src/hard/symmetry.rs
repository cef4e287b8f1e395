//! What must not matter: numbers, mirrors, places, interruptions, and scenes with next to nothing in them.

use super::{Answer, HardCase, Scheme, Solved, ball};
use crate::bits;
use agglo_core::checkpoint::Checkpoint;
use agglo_core::observer::ObserverError;
use agglo_core::state::State;
use agglo_core::{Flow, Observer, Simulation, StepReport};
use serde_json::{Value, json};

/// A small cloud that attracts, binds and collides; all coordinates are multiples of 2^-20 m.
fn cloud() -> Value {
    let mut random = crate::Random(7);
    let mut list = Vec::new();
    for place in 0..27 {
        let at = |axis: u32| {
            let cell = f64::from(place / 3_i32.pow(axis) % 3);
            0.25 * cell + random_offset(place, axis)
        };
        let speed = random.vector(-1.0, 1.0);
        let mut particle = ball([at(0), at(1), at(2)], speed);
        particle["temperature"] = json!(300.0 + f64::from(place));
        list.push(particle);
    }
    json!({
        "duration": 0.3,
        "particles": { "list": list },
        "near_field": {
            "attraction": { "strength": 0.5, "exponent": 1.0 }, "repulsion": { "strength": 0.02, "exponent": 2.0 },
            "cutoff": 0.4
        },
        "binding": { "strength": 0.2, "exponent": 1.0, "range": 1.3 },
        "contact": {
            "restitution": { "e0": 0.7, "v_star": 10.0, "theta_star": 3000.0 },
            "friction": { "static": 0.3, "dynamic": 0.2 }, "duration": { "seconds": 1e-5 }
        },
        "thermal": {
            "heat_capacity": 1000.0, "radiation": { "emissivity": 0.5, "surroundings": 250.0 },
            "reaction": { "energy_per_area": 1e5, "force_scale": 100.0 }
        },
        "solver": { "step": { "fixed": 2e-3 } }
    })
}

/// Up to 0.1 m, a multiple of 2^-20 m.
fn random_offset(place: i32, axis: u32) -> f64 {
    let mut random = crate::Random(u64::from(axis) + 1000 * place as u64);
    (random.unit() * 104_858.0).floor() / 1_048_576.0
}

/// The state at the end, particle by particle: position, velocity, temperature.
fn end(scheme: Scheme, value: &Value) -> Result<Vec<[f64; 7]>, String> {
    let mut last: Option<State> = None;
    scheme.run(value, |report| last = Some(report.state.clone()))?;
    let state = last.ok_or("no state")?;
    let theta = state.temperature.as_deref().unwrap_or_default();
    Ok((0..state.position.len())
        .map(|i| {
            let (r, v) = (state.position.get(i), state.velocity.get(i));
            [r.x, r.y, r.z, v.x, v.y, v.z, theta.get(i).copied().unwrap_or_default()]
        })
        .collect())
}

/// How many particles differ in their bits, and by how much at most.
fn compared(a: &[[f64; 7]], b: &[[f64; 7]]) -> Answer {
    // -0 equals 0.
    let different = a.iter().zip(b).filter(|(a, b)| a != b).count();
    let most = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    Answer::found(format!("{different} of {} particles differ, by {most:.1e} at most", a.len()), different as f64, 0.0)
}

pub const PERMUTED: HardCase = HardCase {
    name: "permuted",
    case: "a cloud with every effect, its particles in other orders",
    right: "the same bits",
    solve: permuted,
};

fn permuted(scheme: Scheme) -> Solved {
    let value = cloud();
    let expected = end(scheme, &value)?;
    let n = expected.len();
    let mut worst = Answer::found("", -1.0, 0.0);
    for (factor, offset) in [(n - 1, n - 1), (10, 3)] {
        let order: Vec<usize> = (0..n).map(|k| (k * factor + offset) % n).collect();
        let mut other = value.clone();
        let list = &value["particles"]["list"];
        other["particles"]["list"] = order.iter().map(|&k| list[k].clone()).collect();
        let mut found = vec![[0.0; 7]; n];
        for (row, k) in end(scheme, &other)?.into_iter().zip(order) {
            found[k] = row;
        }
        worst = worse_of(worst, compared(&expected, &found));
    }
    Ok(worst)
}

fn worse_of(a: Answer, b: Answer) -> Answer {
    match (&a, &b) {
        (Answer::Found { error: first, .. }, Answer::Found { error: second, .. }) if second <= first => a,
        _ => b,
    }
}

pub const MIRRORED: HardCase = HardCase {
    name: "mirrored",
    case: "the same cloud in a mirror, along every axis",
    right: "the same bits, with the sign of that axis turned",
    solve: mirrored,
};

fn mirrored(scheme: Scheme) -> Solved {
    let value = cloud();
    let expected = end(scheme, &value)?;
    let mut worst = Answer::found("", -1.0, 0.0);
    for axis in 0..3 {
        let mut other = value.clone();
        for particle in other["particles"]["list"].as_array_mut().into_iter().flatten() {
            for key in ["position", "velocity"] {
                particle[key][axis] = json!(-particle[key][axis].as_f64().unwrap_or(f64::NAN));
            }
        }
        let mut found = end(scheme, &other)?;
        for row in &mut found {
            row[axis] = -row[axis];
            row[3 + axis] = -row[3 + axis];
        }
        worst = worse_of(worst, compared(&expected, &found));
    }
    Ok(worst)
}

pub const SHIFTED: HardCase = HardCase {
    name: "shifted",
    case: "the same cloud 2^20 m away, all coordinates multiples of 2^-20 m",
    right: "the same bits (positions to the last bit that they still have there)",
    solve: shifted,
};

fn shifted(scheme: Scheme) -> Solved {
    let far = f64::from(1 << 20);
    let value = cloud();
    let expected = end(scheme, &value)?;
    let mut other = value.clone();
    for particle in other["particles"]["list"].as_array_mut().into_iter().flatten() {
        for axis in 0..3 {
            particle["position"][axis] = json!(particle["position"][axis].as_f64().unwrap_or(f64::NAN) + far);
        }
    }
    let mut found = end(scheme, &other)?;
    let mut rounded = expected;
    for row in rounded.iter_mut().chain(&mut found) {
        for x in &mut row[..3] {
            *x = if *x >= 0.5 * far { *x - far } else { (*x + far) - far };
        }
    }
    Ok(compared(&rounded, &found))
}

/// Keeps the first checkpoint after a time, and the last state.
#[derive(Default)]
struct Halves {
    after: f64,
    checkpoint: Option<Checkpoint>,
    last: Vec<u64>,
}

impl Observer for Halves {
    fn step(&mut self, report: &StepReport<'_>) -> Result<Flow, ObserverError> {
        self.last = bits(report.state);
        if let (None, Some(checkpoint)) = (&self.checkpoint, report.checkpoint.filter(|_| report.time >= self.after)) {
            self.checkpoint = Some(checkpoint.clone());
        }
        Ok(Flow::Continue)
    }
}

pub const TWO_HALVES: HardCase = HardCase {
    name: "two_halves",
    case: "the same cloud in one run and in two halves",
    right: "the same bits",
    solve: two_halves,
};

fn two_halves(scheme: Scheme) -> Solved {
    let mut value = cloud();
    value["record"] = json!({ "checkpoint_every": 10 });
    let mut whole = Halves { after: 0.15, ..Halves::default() };
    scheme.start(&value)?.run(&mut whole).map_err(|error| error.to_string())?;
    let checkpoint = whole.checkpoint.ok_or("no checkpoint")?;
    let scene = agglo_core::Scene::parse(&scheme.scene(&value).to_string(), &[]).map_err(|_| "no scene")?;
    let mut rest = Halves { after: f64::MAX, ..Halves::default() };
    let mut simulation = Simulation::resume(&scene, &checkpoint).map_err(|error| error.to_string())?;
    simulation.run(&mut rest).map_err(|error| error.to_string())?;
    let different = whole.last.iter().zip(&rest.last).filter(|(a, b)| a != b).count();
    Ok(Answer::found(
        format!("{different} numbers differ after a checkpoint at {:.2} s", checkpoint.time),
        different as f64,
        0.0,
    ))
}

pub const ALMOST_NOTHING: HardCase = HardCase {
    name: "almost_nothing",
    case: "one particle; two; strengths, reaction and friction of zero; no neighbours",
    right: "runs to the end, straight flights stay straight",
    solve: almost_nothing,
};

fn almost_nothing(scheme: Scheme) -> Solved {
    let mut error: f64 = 0.0;
    let mut nothing = cloud();
    for pointer in [
        "/near_field/attraction/strength",
        "/near_field/repulsion/strength",
        "/binding/strength",
        "/thermal/reaction/energy_per_area",
    ] {
        if let Some(strength) = nothing.pointer_mut(pointer) {
            *strength = json!(0.0);
        }
    }
    for (count, apart) in [(1, 0.0), (2, 1e9)] {
        let mut value = nothing.clone();
        let particle = |k: usize| {
            let mut particle = ball([apart * k as f64, 0.0, 0.0], [0.0, 1.0, 0.0]);
            particle["temperature"] = json!(250.0);
            particle
        };
        value["particles"]["list"] = (0..count).map(particle).collect();
        for (k, row) in end(scheme, &value)?.iter().enumerate() {
            let expected = [apart * k as f64, 0.3, 0.0, 0.0, 1.0, 0.0, 250.0];
            error = row.iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(error, super::worse);
        }
    }
    end(scheme, &nothing)?;
    Ok(Answer::found(format!("off by {error:.1e}"), error, 1e-12))
}
