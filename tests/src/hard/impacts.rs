//! Impacts of few bodies, with closed forms.

use super::{Answer, HardCase, Scheme, Solved, ball, balls, last_velocities, worse};
use nalgebra::Vector3;
use serde_json::{Value, json};

pub const HEAD_ON: HardCase = HardCase {
    name: "head_on",
    case: "head-on impacts, e = 0.5, equal masses and 1 : 1e6",
    right: "Newton's law and the centre of mass",
    solve: head_on,
};

fn head_on(scheme: Scheme) -> Solved {
    let mut error: f64 = 0.0;
    for ratio in [1.0, 1e-6, 1e6] {
        let mut list = [ball([-0.5, 0.0, 0.0], [2.0, 0.0, 0.0]), ball([0.5, 0.0, 0.0], [-1.0, 0.0, 0.0])];
        list[1]["mass"] = json!(ratio);
        let (steps, _) = scheme.record(&balls(&list, 1.0, 1e-3, 0.5))?;
        let v = last_velocities(&steps);
        let centre = (2.0 - ratio) / (1.0 + ratio);
        let apart = 0.5 * 3.0;
        let expected = [centre - ratio / (1.0 + ratio) * apart, centre + apart / (1.0 + ratio)];
        error = worse(error, worse((v[0].x - expected[0]).abs(), (v[1].x - expected[1]).abs()));
    }
    Ok(Answer::found(format!("velocities off by {error:.1e} m/s"), error, 1e-12))
}

pub const OBLIQUE: HardCase = HardCase {
    name: "oblique",
    case: "oblique impact with friction, below and above the static limit",
    right: "sticks iff |v_t| <= mu_s (1 + e) v_n, else loses mu_d (1 + e) v_n",
    solve: oblique,
};

fn oblique(scheme: Scheme) -> Solved {
    let (e, mu_s, mu_d) = (0.5, 0.4, 0.2);
    let mut error: f64 = 0.0;
    for tangential in [0.3, 0.59, 0.61, 3.0] {
        // Aimed so that they touch with the normal along x.
        let time = 0.4;
        let list = [
            ball([-0.1 - time, -time * tangential, 0.0], [1.0, tangential, 0.0]),
            ball([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ];
        let mut value = balls(&list, 0.8, 1e-3, e);
        value["contact"]["friction"] = json!({ "static": mu_s, "dynamic": mu_d });
        let (steps, _) = scheme.record(&value)?;
        let v = last_velocities(&steps);
        let after = (v[0] - v[1]).dot(&Vector3::y());
        let limit = mu_s * (1.0 + e);
        let expected = if tangential <= limit { 0.0 } else { tangential - mu_d * (1.0 + e) };
        error = worse(error, (after - expected).abs());
    }
    Ok(Answer::found(format!("sliding speed off by {error:.1e} m/s"), error, 1e-10))
}

pub const FASTER_THAN_A_DIAMETER: HardCase = HardCase {
    name: "faster_than_a_diameter",
    case: "a pair that crosses 100 diameters in a step, head-on, off-centre and grazing at 0.999 diameters",
    right: "hit, at the right time and angle",
    solve: faster_than_a_diameter,
};

fn faster_than_a_diameter(scheme: Scheme) -> Solved {
    let (speed, mut error, mut missed) = (100.0, 0.0_f64, 0);
    for offset in [0.0, 0.5, 0.999] {
        let list = [ball([-1.0, 0.0, 0.0], [speed, 0.0, 0.0]), ball([0.7, offset * 0.1, 0.0], [0.0; 3])];
        let (steps, outcome) = scheme.record(&balls(&list, 0.1, 0.1, 0.8))?;
        missed += u32::from(outcome.counters.impacts == 0);
        let normal = Vector3::new(f64::sqrt(1.0 - offset * offset), offset, 0.0);
        let expected = normal * (0.5 * 1.8 * speed * normal.x);
        error = worse(error, (last_velocities(&steps)[1] - expected).norm() / speed);
    }
    Ok(Answer::found(format!("{missed} of 3 missed, velocity off by {error:.1e} of the speed"), error, 1e-12))
}

pub const BREAK_SHOT: HardCase = HardCase {
    name: "break_shot",
    case: "break shot at two balls at +-30 degrees, e = 1",
    right: "striker -0.2 v, the others 0.693 v",
    solve: break_shot,
};

fn break_shot(scheme: Scheme) -> Solved {
    let (s, c) = (0.5, f64::sqrt(0.75));
    let list = [
        ball([-0.03 - c * 0.1, 0.0, 0.0], [1.0, 0.0, 0.0]),
        ball([0.0, s * 0.1, 0.0], [0.0; 3]),
        ball([0.0, -s * 0.1, 0.0], [0.0; 3]),
    ];
    let mut value = balls(&list, 0.1, 1e-2, 1.0);
    value["contact"]["rest_speed"] = json!(0.0);
    let (steps, _) = scheme.record(&value)?;
    let v = last_velocities(&steps);
    let others = 2.0 * 3_f64.sqrt() / 5.0;
    let error = v[1..].iter().fold((v[0].x + 0.2).abs(), |error, v| worse(error, (v.norm() - others).abs()));
    let energy: f64 = v.iter().map(|v| v.norm_squared()).sum();
    let measured = format!("striker {:.3} v, others {:.3} v, energy {energy:.3} times", v[0].x, v[1].norm());
    Ok(Answer::found(measured, error, 1e-13))
}

pub const CRADLE: HardCase = HardCase {
    name: "cradle",
    case: "cradle of five, e = 1, touching or 1e-6 m apart, in three numberings",
    right: "(0, 0, 0, 0, v)",
    solve: cradle,
};

fn cradle(scheme: Scheme) -> Solved {
    let mut error: f64 = 0.0;
    for gap in [0.0, 1e-6] {
        for numbers in [[0, 1, 2, 3, 4], [4, 3, 2, 1, 0], [2, 0, 4, 1, 3]] {
            let place = |k: usize| {
                let x = k as f64 * (0.1 + gap) - if k == 0 { 0.05 } else { 0.0 };
                ball([x, 0.0, 0.0], [if k == 0 { 1.0 } else { 0.0 }, 0.0, 0.0])
            };
            let list: Vec<Value> = numbers.iter().map(|&k| place(k)).collect();
            let (steps, _) = scheme.record(&balls(&list, 0.2, 1e-2, 1.0))?;
            for (v, k) in last_velocities(&steps).iter().zip(numbers) {
                error = worse(error, (v.x - if k == 4 { 1.0 } else { 0.0 }).abs());
            }
        }
    }
    Ok(Answer::found(format!("velocities off by {error:.1e} v"), error, 1e-12))
}

pub const OVERLAP: HardCase = HardCase {
    name: "overlap",
    case: "overlapping or coincident particles at the start",
    right: "an error that names the pair",
    solve: overlap,
};

fn overlap(scheme: Scheme) -> Solved {
    let mut unnamed = 0;
    let mut said = String::new();
    for distance in [0.09, 0.0] {
        let list = [ball([0.0; 3], [0.0; 3]), ball([1.0, 0.0, 0.0], [0.0; 3]), ball([distance, 0.0, 0.0], [0.0; 3])];
        match scheme.start(&balls(&list, 1.0, 1e-2, 0.5)) {
            Ok(_) => unnamed += 1,
            Err(text) => {
                unnamed += u32::from(!text.contains('0') || !text.contains('2'));
                said = text;
            }
        }
    }
    Ok(Answer::found(format!("\"{said}\""), f64::from(unnamed), 0.0))
}
