//! A study as a Markdown page.

use std::fmt::Write;

use crate::fit::schemes;
use crate::study::Study;
use crate::table::{against, ratios};

/// The page; `picture` is the address of the diagram, where there is one.
#[must_use]
pub fn markdown(study: &Study, picture: Option<&str>) -> String {
    let name = if study.scene.is_empty() { "Speed against error" } else { &study.scene };
    let mut page = format!("# {name}\n\n{}\n\n", against(study));
    if let Some(picture) = picture {
        _ = writeln!(page, "![wall time against the error of the positions]({picture})\n");
    }
    orders(study, &mut page);
    against_paper(study, &mut page);
    tolerances(study, &mut page);
    measurements(study, &mut page);
    ensembles(study, &mut page);
    page
}

fn orders(study: &Study, page: &mut String) {
    if study.fits.is_empty() {
        return;
    }
    page.push_str("| scheme | fitted order |\n|---|---:|\n");
    for fit in &study.fits {
        _ = writeln!(page, "| {} | {:.2} |", fit.scheme, fit.order);
    }
    page.push('\n');
    if study.measurements.iter().any(|m| m.errors.impacts_found.is_some()) {
        page.push_str("Where in a step an impact falls is chance: orders fitted to a few errors say little here.\n\n");
    }
}

fn against_paper(study: &Study, page: &mut String) {
    let ratios = ratios(study);
    if ratios.is_empty() {
        return;
    }
    page.push_str("Wall time over that of the paper's scheme at equal error; * where the paper's time is extrapolated at its\nfitted order:\n\n| scheme |");
    let mut errors: Vec<f64> = ratios.iter().map(|ratio| ratio.error).collect();
    errors.sort_by(|a, b| b.total_cmp(a));
    errors.dedup();
    for error in &errors {
        _ = write!(page, " {error:.0e} |");
    }
    _ = writeln!(page, "\n|---|{}", "---:|".repeat(errors.len()));
    for scheme in schemes(&study.measurements) {
        if !ratios.iter().any(|ratio| ratio.scheme == scheme) {
            continue;
        }
        _ = write!(page, "| {scheme} |");
        for &error in &errors {
            match ratios.iter().find(|ratio| ratio.scheme == scheme && ratio.error == error) {
                Some(ratio) => {
                    _ = write!(page, " {:.1e}{} |", ratio.ratio, if ratio.extrapolated { "\\*" } else { "" });
                }
                None => page.push_str(" – |"),
            }
        }
        page.push('\n');
    }
    page.push('\n');
}

fn tolerances(study: &Study, page: &mut String) {
    let of = |scheme: &str| {
        study.measurements.iter().filter(|m| m.scheme == scheme).filter_map(|m| m.achieved).collect::<Vec<_>>()
    };
    let rows: Vec<(&str, Vec<f64>)> = schemes(&study.measurements).into_iter().map(|s| (s, of(s))).collect();
    if rows.iter().all(|row| row.1.is_empty()) {
        return;
    }
    page.push_str("Error at the end over the tolerance, from the loosest to the tightest:\n\n| scheme | achieved over requested |\n|---|---|\n");
    for (scheme, achieved) in rows.iter().filter(|row| !row.1.is_empty()) {
        let list: Vec<String> = achieved.iter().map(|a| format!("{a:.1e}")).collect();
        _ = writeln!(page, "| {scheme} | {} |", list.join(", "));
    }
    page.push('\n');
}

fn measurements(study: &Study, page: &mut String) {
    page.push_str("<details><summary>All measurements</summary>\n\n");
    page.push_str(
        "| scheme | step [s] | tolerance | wall [s] | forces | steps | rejected | position | velocity | energy |\n",
    );
    page.push_str("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
    let some = |value: Option<f64>| value.map_or("–".to_owned(), |value| format!("{value:.2e}"));
    for m in &study.measurements {
        _ = writeln!(
            page,
            "| {} | {} | {} | {:.2e} | {} | {} | {} | {:.2e} | {:.2e} | {:.2e} |",
            m.scheme,
            some(m.step),
            some(m.tolerance),
            m.wall_seconds,
            m.force_evaluations,
            m.steps,
            m.rejected,
            m.errors.position,
            m.errors.velocity,
            m.energy_residual
        );
    }
    page.push_str("\n</details>\n");
}

fn ensembles(study: &Study, page: &mut String) {
    if study.ensembles.is_empty() {
        return;
    }
    _ = writeln!(page, "\nStatistics over seeds at t = {} s, mean ± standard error:\n", study.duration);
    page.push_str("| scheme | seeds | kinetic [J] | residual | impacts | temperature [K] | clusters |\n|---|---:|---|---:|---|---|---|\n");
    for e in &study.ensembles {
        let some =
            |mean: Option<crate::Mean>| mean.map_or("–".to_owned(), |m| format!("{:.2} ± {:.2}", m.mean, m.error));
        _ = writeln!(
            page,
            "| {} | {} | {:.4e} ± {:.1e} | {:.1e} | {:.1} ± {:.1} | {} | {} |",
            e.scheme,
            e.seeds,
            e.kinetic.mean,
            e.kinetic.error,
            e.residual.mean,
            e.impacts.mean,
            e.impacts.error,
            some(e.temperature),
            some(e.clusters)
        );
    }
}
