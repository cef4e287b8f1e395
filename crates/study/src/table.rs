//! A study as text for people and as CSV.

use std::fmt::Write;

use crate::study::Study;

/// What to compare a scheme with.
const PAPER: &str = "paper";
/// Errors at which times are compared [mean diameters].
pub(crate) const COMPARED: [f64; 3] = [1e-4, 1e-6, 1e-8];

/// The table of a study, with a line on what errors are measured against and the orders found.
#[must_use]
pub fn text(study: &Study) -> String {
    let mut out = format!("{}\n\n", against(study));
    let temperature = study.measurements.iter().any(|m| m.errors.temperature.is_some());
    let impacts = study.measurements.iter().any(|m| m.errors.impacts_found.is_some());
    let mut head = format!(
        "{:<24} {:>9} {:>9} {:>10} {:>9} {:>9} {:>8} {:>10} {:>10} {:>10}",
        "scheme", "step", "tolerance", "wall s", "forces", "steps", "rejected", "position", "velocity", "energy"
    );
    if temperature {
        head += &format!(" {:>11}", "temperature");
    }
    if impacts {
        head += &format!(" {:>11} {:>7}", "impact time", "found");
    }
    out += &head;
    out.push('\n');
    for m in &study.measurements {
        let control = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2e}"));
        let mut line = format!(
            "{:<24} {:>9} {:>9} {:>10.2e} {:>9} {:>9} {:>8} {:>10.2e} {:>10.2e} {:>10.2e}",
            m.scheme,
            control(m.step),
            control(m.tolerance),
            m.wall_seconds,
            m.force_evaluations,
            m.steps,
            m.rejected,
            m.errors.position,
            m.errors.velocity,
            m.energy_residual
        );
        if temperature {
            line += &format!(" {:>11}", control(m.errors.temperature));
        }
        if impacts {
            let found = m.errors.impacts_found.map_or("-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
            line += &format!(" {:>11} {found:>7}", control(m.errors.impact_time));
        }
        out += line.trim_end();
        out.push('\n');
    }
    out += "\npositions: root mean square over the mean diameter; velocities: over their own; energy: residual over the \
            kinetic or near-field energy\n";
    for fit in &study.fits {
        _ = writeln!(out, "order of {}: {:.2}", fit.scheme, fit.order);
    }
    for row in compared(study) {
        _ = writeln!(out, "{row}");
    }
    if !study.ensembles.is_empty() {
        _ = writeln!(out, "\nstatistics over seeds at t = {} s, mean ± standard error", study.duration);
        for e in &study.ensembles {
            let mut line = format!(
                "{:<24} kinetic {:.4e} ± {:.1e} J, residual {:.1e}, impacts {:.1} ± {:.1}",
                e.scheme, e.kinetic.mean, e.kinetic.error, e.residual.mean, e.impacts.mean, e.impacts.error
            );
            if let Some(theta) = e.temperature {
                line += &format!(", temperature {:.2} ± {:.2} K", theta.mean, theta.error);
            }
            if let Some(clusters) = e.clusters {
                line += &format!(", clusters {:.2} ± {:.2}", clusters.mean, clusters.error);
            }
            out += &line;
            out.push('\n');
        }
    }
    for skipped in &study.skipped {
        let control = match (skipped.step, skipped.tolerance) {
            (Some(step), _) => format!("step {step:.2e} s"),
            (_, tolerance) => format!("tolerance {:.0e}", tolerance.unwrap_or_default()),
        };
        _ = writeln!(out, "not measured: {}, {control}: {}", skipped.scheme, skipped.reason);
    }
    out
}

/// What errors are measured against, in a sentence or two.
pub(crate) fn against(study: &Study) -> String {
    let name = if study.scene.is_empty() { "a scene without a name" } else { &study.scene };
    let mut text = format!(
        "{name}, {} particles: errors at t = {} s against Gauss-Radau collocation of order 15 (tolerance 1e-13), which is known \
         to {:.1e} mean diameters.",
        study.particles, study.until, study.uncertainty
    );
    if study.rests {
        text += &format!(
            " The scene lasts {} s; soon after {} s a contact comes to rest, which schemes of high order do not solve.",
            study.duration, study.until
        );
    } else if !study.whole {
        text += &format!(
            " The scene lasts {} s, but two references part after {} s: from there on single runs have no error, only \
             statistics over seeds mean something.",
            study.duration, study.until
        );
    }
    text
}

/// Wall times against the paper's scheme at equal errors, a line per scheme and error.
pub(crate) fn compared(study: &Study) -> Vec<String> {
    ratios(study)
        .into_iter()
        .map(|r| {
            let note = if r.extrapolated { " (the paper's time extrapolated at its fitted order)" } else { "" };
            format!("{} at an error of {:.0e}: {:.1e} of the paper's wall time{note}", r.scheme, r.error, r.ratio)
        })
        .collect()
}

/// Least order at which the paper's scheme is extrapolated [-]; its own is 1.
const LEAST_ORDER: f64 = 0.9;

/// Wall time of a scheme over that of the paper's, at equal errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratio {
    /// Scheme.
    pub scheme: String,
    /// Error of the positions [mean diameters].
    pub error: f64,
    /// Its wall time [s].
    pub seconds: f64,
    /// Over the paper's [-].
    pub ratio: f64,
    /// Whether the paper's time was extrapolated at its fitted order.
    pub extrapolated: bool,
}

/// All that can be compared.
#[must_use]
pub fn ratios(study: &Study) -> Vec<Ratio> {
    let seconds = |name: &str, error: f64| crate::fit::seconds_at(name, error, &study.measurements);
    // What does not converge at its order is not extrapolated.
    let fit = study.fits.iter().find(|fit| fit.scheme == PAPER && fit.order >= LEAST_ORDER);
    let mut ratios = Vec::new();
    for scheme in crate::fit::schemes(&study.measurements).into_iter().filter(|name| *name != PAPER) {
        for error in COMPARED {
            let measured = seconds(PAPER, error);
            let paper = measured.or_else(|| fit.map(|fit| fit.seconds(error)));
            if let (Some(own), Some(paper)) = (seconds(scheme, error), paper) {
                ratios.push(Ratio {
                    scheme: scheme.to_owned(),
                    error,
                    seconds: own,
                    ratio: own / paper,
                    extrapolated: measured.is_none(),
                });
            }
        }
    }
    ratios
}

/// The measurements as CSV; absent values are empty.
///
/// # Errors
/// None that a string could give; the writer's own.
pub fn csv(study: &Study) -> Result<String, csv::Error> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record([
        "scheme",
        "step_s",
        "tolerance",
        "wall_s",
        "force_evaluations",
        "steps",
        "sweeps",
        "rejected",
        "position_error",
        "velocity_error",
        "temperature_error_K",
        "impact_time_error_s",
        "impacts_found",
        "energy_residual",
        "achieved_over_tolerance",
    ])?;
    let optional = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:?}"));
    for m in &study.measurements {
        writer.write_record([
            m.scheme.clone(),
            optional(m.step),
            optional(m.tolerance),
            optional(Some(m.wall_seconds)),
            m.force_evaluations.to_string(),
            m.steps.to_string(),
            m.sweeps.to_string(),
            m.rejected.to_string(),
            optional(Some(m.errors.position)),
            optional(Some(m.errors.velocity)),
            optional(m.errors.temperature),
            optional(m.errors.impact_time),
            optional(m.errors.impacts_found),
            optional(Some(m.energy_residual)),
            optional(m.achieved),
        ])?;
    }
    let bytes = writer.into_inner().map_err(|error| error.into_error())?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}
