//! Orders fitted to measured errors.

use serde::Serialize;

use crate::measure::Measurement;

/// Errors above this are no longer in the asymptotic range [mean diameters].
const LARGEST: f64 = 0.02;
/// Errors must exceed the reference's own uncertainty, or round-off, by this factor.
const ABOVE_NOISE: f64 = 20.0;
/// Distance of three errors from a power law, as a natural logarithm and root mean square, up to which they tell its order [-].
const SCATTER: f64 = 0.2;
/// Round-off of positions after many steps [mean diameters].
const ROUND_OFF: f64 = 1e-13;

/// A power law fitted to one series of measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fit {
    /// Scheme.
    pub scheme: String,
    /// Order: error like the step to this power, from the finest three errors of the asymptotic range, or all where those scatter.
    pub order: f64,
    /// Wall time per step [s].
    pub seconds_per_step: f64,
    /// An error [mean diameters] and the step at which it was found [s].
    pub anchor: (f64, f64),
    /// Time studied [s].
    pub until: f64,
}

impl Fit {
    /// Wall time that an error would take by the fitted law [s].
    #[must_use]
    pub fn seconds(&self, error: f64) -> f64 {
        let step = self.anchor.1 * (error / self.anchor.0).powf(1.0 / self.order);
        self.until / step * self.seconds_per_step
    }
}

/// Fits an order to every scheme's runs with fixed steps that has three or more errors in the asymptotic range.
#[must_use]
pub fn fits(measurements: &[Measurement], uncertainty: f64, until: f64) -> Vec<Fit> {
    schemes(measurements).into_iter().filter_map(|name| fit(name, measurements, uncertainty, until)).collect()
}

/// Schemes that were measured, each once, in the order of the table.
pub(crate) fn schemes(measurements: &[Measurement]) -> Vec<&str> {
    let mut names: Vec<&str> = Vec::new();
    for measurement in measurements {
        if !names.contains(&measurement.scheme.as_str()) {
            names.push(&measurement.scheme);
        }
    }
    names
}

fn fit(name: &str, measurements: &[Measurement], uncertainty: f64, until: f64) -> Option<Fit> {
    let noise = ABOVE_NOISE * uncertainty.max(ROUND_OFF);
    let mut points: Vec<(f64, f64, f64)> = (measurements.iter())
        .filter(|m| m.scheme == name && m.errors.position < LARGEST && m.errors.position > noise)
        .filter_map(|m| m.step.map(|step| (step, m.errors.position, m.wall_seconds / m.steps as f64)))
        .collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    if points.len() < 3 {
        return None;
    }
    // Where in a step an event falls is chance: errors that scatter about a line need more of them, or have no order.
    let finest = slope(&points[..3]);
    let (order, scatter) = if finest.1 <= SCATTER { finest } else { slope(&points) };
    if scatter > 4.0 * SCATTER {
        return None;
    }
    Some(Fit {
        scheme: name.to_owned(),
        order,
        seconds_per_step: points[0].2,
        anchor: (points[0].1, points[0].0),
        until,
    })
}

/// Slope of the errors over the steps, both logarithmic, and how far from that line they are, root mean square.
fn slope(points: &[(f64, f64, f64)]) -> (f64, f64) {
    let mean = |f: &dyn Fn(&(f64, f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p.0.ln()), mean(&|p| p.1.ln()));
    let slope = mean(&|p| (p.0.ln() - x) * (p.1.ln() - y)) / mean(&|p| (p.0.ln() - x).powi(2));
    let away = mean(&|p| (p.1.ln() - y - slope * (p.0.ln() - x)).powi(2));
    (slope, away.sqrt())
}

/// Wall time at which a scheme reaches an error, interpolated on logarithmic axes between those of its measurements that
/// none beats in both time and error [s]; `None` where it does not get there.
#[must_use]
pub fn seconds_at(name: &str, error: f64, measurements: &[Measurement]) -> Option<f64> {
    let own = |m: &&Measurement| m.scheme == name && m.errors.position.is_finite();
    let mut points: Vec<(f64, f64)> =
        (measurements.iter().filter(own)).map(|m| (m.wall_seconds, m.errors.position)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::INFINITY;
    points.retain(|point| {
        point.1 < least && {
            least = point.1;
            true
        }
    });
    let k = points.iter().position(|point| point.1 <= error)?;
    let (wall, found) = points[k];
    if k == 0 || found <= 0.0 {
        return Some(wall);
    }
    let (quick, coarse) = points[k - 1];
    let share = (coarse / error).ln() / (coarse / found).ln();
    Some((quick.ln() + share * (wall / quick).ln()).exp())
}

#[cfg(test)]
mod tests {
    use super::{fits, seconds_at};
    use crate::measure::{Errors, Measurement};

    fn measured(step: f64, error: f64) -> Measurement {
        Measurement {
            scheme: "some".to_owned(),
            step: Some(step),
            tolerance: None,
            wall_seconds: 1e-6 / step,
            force_evaluations: 0,
            steps: (1.0 / step).round() as u64,
            sweeps: 0,
            rejected: 0,
            errors: Errors { position: error, ..Errors::default() },
            energy_residual: 0.0,
            achieved: None,
        }
    }

    #[test]
    fn a_power_law_is_found_again() {
        let measurements: Vec<Measurement> =
            (2..12).map(|k| 0.5_f64.powi(k)).map(|dt| measured(dt, 3.0 * dt.powi(2) + 1e-16)).collect();
        let fit = &fits(&measurements, 1e-15, 1.0)[0];
        assert!((fit.order - 2.0).abs() < 1e-9, "{fit:?}");
        // 1e-10 takes a step of (1e-10/3)^(1/2), and 1e-6 s each.
        let expected = 1e-6 / (1e-10_f64 / 3.0).sqrt();
        assert!((fit.seconds(1e-10) / expected - 1.0).abs() < 1e-3, "{} for {expected}", fit.seconds(1e-10));
        let found = seconds_at("some", 1e-4, &measurements).unwrap();
        let exact = 1e-6 / (1e-4_f64 / 3.0).sqrt();
        assert!((found / exact - 1.0).abs() < 1e-3, "{found} for {exact}");
        assert_eq!(seconds_at("some", 1e-12, &measurements), None);
    }
}
