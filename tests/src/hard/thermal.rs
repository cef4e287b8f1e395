//! Heat, and a gas that cools.

use super::{Answer, HardCase, Scheme, Solved, ball, balls, last_velocities, worse};
use serde_json::json;
use std::f64::consts::PI;

pub const TINY_HOT_SPHERE: HardCase = HardCase {
    name: "tiny_hot_sphere",
    case: "a sphere of 1 um at 3000 K in the void, steps of 10 ms that are 20 times its time constant",
    right: "cools monotonically and stays above 0 K",
    solve: tiny_hot_sphere,
};

fn tiny_hot_sphere(scheme: Scheme) -> Solved {
    let mut falls = true;
    let mut last = 3000.0;
    let value = json!({
        "duration": 5.0,
        "particles": { "list": [{ "position": [0.0, 0.0, 0.0], "radius": 1e-6, "density": 2000.0, "temperature": 3000.0 }] },
        "thermal": { "heat_capacity": 1000.0, "radiation": { "emissivity": 1.0, "surroundings": 0.0 } },
        "solver": { "step": { "fixed": 1e-2 } }
    });
    scheme.run(&value, |report| {
        let theta = report.state.temperature.as_ref().map_or(f64::NAN, |theta| theta[0]);
        falls &= theta > 0.0 && theta <= last;
        last = theta;
    })?;
    // theta^-3 = 3000^-3 + 3 sigma a t.
    let (sigma, a) = (5.670_374_419e-8, 3.0 / (1e-6 * 2000.0 * 1000.0));
    let expected = (3000_f64.powi(-3) + 15.0 * sigma * a).powf(-1.0 / 3.0);
    let error = if falls { (last / expected - 1.0).abs() } else { f64::NAN };
    // `paper` steps implicitly at first order.
    let bound = if scheme == Scheme::Paper { 0.05 } else { 1e-10 };
    Ok(Answer::found(format!("{last:.2} K after 5 s, off by {error:.1e}"), error, bound))
}

pub const BEYOND_THETA_STAR: HardCase = HardCase {
    name: "beyond_theta_star",
    case: "an impact of particles at theta* and far beyond, with reaction heat",
    right: "e = 0: they go on together; heat stays a number",
    solve: beyond_theta_star,
};

fn beyond_theta_star(scheme: Scheme) -> Solved {
    let mut error: f64 = 0.0;
    for theta in [3000.0, 1e5] {
        let mut list = [ball([-0.3, 0.0, 0.0], [1.0, 0.0, 0.0]), ball([0.0; 3], [0.0; 3])];
        list.iter_mut().for_each(|ball| ball["temperature"] = json!(theta));
        let mut value = balls(&list, 0.5, 1e-3, json!({ "e0": 0.5, "e_min": 0.01, "theta_star": 3000.0 }));
        value["contact"]["duration"] = json!({ "seconds": 1e-5 });
        value["thermal"] =
            json!({ "heat_capacity": 1000.0, "reaction": { "energy_per_area": 8e6, "force_scale": 1.0 } });
        let (steps, _) = scheme.record(&value)?;
        let v = last_velocities(&steps);
        let end = steps[steps.len() - 1].state.temperature.as_ref().map_or(f64::NAN, |theta| theta[0]);
        let heat = 8e6 * PI * 0.05 * 0.05 / 1000.0;
        error = worse(error, worse((v[0] - v[1]).norm(), (end - theta - heat).abs() / theta));
    }
    Ok(Answer::found(format!("relative speed or heat off by {error:.1e}"), error, 1e-12))
}

pub const FREE_COOLING: HardCase = HardCase {
    name: "free_cooling",
    case: "free cooling of 1000 hard spheres, e = 0.9, volume fraction 0.0655, 20 impacts each",
    right: "Haff's law, 1/tau = (1 - e^2) omega_0/6",
    solve: free_cooling,
};

fn free_cooling(scheme: Scheme) -> Solved {
    let mut value = crate::shipped("free-cooling-gas");
    value["record"]["interval"] = json!(1.0);
    let (n, e) = (1000.0, 0.9_f64);
    let nu = n / value["particles"]["random_cube"]["side"].as_f64().unwrap_or(f64::NAN).powi(3);
    let fraction = PI / 6.0 * nu;
    let contact = (1.0 - 0.5 * fraction) / (1.0 - fraction).powi(3);
    let (mut start, mut error) = (None, 0.0_f64);
    let outcome = scheme.run(&value, |report| {
        let Some(sample) = report.sample else { return };
        let temperature = 2.0 / 3.0 * sample.ledger.kinetic / n;
        let t0 = *start.get_or_insert(temperature);
        let tau = 6.0 / ((1.0 - e * e) * 4.0 * PI.sqrt() * nu * contact * f64::sqrt(t0));
        error = worse(error, (temperature / t0 * (1.0 + report.time / tau).powi(2) - 1.0).abs());
    })?;
    let overlap = outcome.counters.max_overlap;
    let measured = format!("temperature off by {:.1} %, overlaps up to {overlap:.1e} diameters", 100.0 * error);
    // One seed: 10 000 impacts scatter by 1 %; the start is uniform, not Maxwellian.
    Ok(Answer::found(measured, worse(error, 0.05 * overlap / 1e-9), 0.05))
}
