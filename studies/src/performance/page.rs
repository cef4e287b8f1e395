//! The page: a table for every case.

use std::fmt::Write as _;

use super::{Row, Section};

/// `docs/performance.md` of what was found, on a date and a machine.
pub fn page(sections: &[Section], date: &str, machine: &str) -> String {
    let mut text = format!(
        "# Performance\n\n\
         Made by `cargo run --release -p agglo-studies --bin performance` ({date}, agglo {}, {machine}). Medians; in brackets \
         the smallest and the largest. Ratios compare runs that alternated; only they mean something on a machine that \
         others use too. How to run it, and with which peers, is said by `--help`.\n",
        env!("CARGO_PKG_VERSION")
    );
    for section in sections {
        _ = write!(text, "\n## {}\n\n{}\n", section.title, section.about.trim_end());
        if section.rows.is_empty() {
            continue;
        }
        if let Some((name, _)) = &section.figure {
            _ = write!(text, "\n![{}](performance/{name}.svg)\n", section.title);
        }
        text.push_str("\n| what | median (spread) | held against | |\n|---|---|---|---|\n");
        for row in &section.rows {
            text.push_str(&line(row));
        }
    }
    text
}

fn line(row: &Row) -> String {
    let number = |x: f64| if x.abs() >= 100.0 || x == 0.0 { format!("{x:.0}") } else { significant(x) };
    let unit = if row.unit == "-" { String::new() } else { format!(" {}", row.unit) };
    let value = format!("{}{unit} ({} – {})", number(row.value), number(row.spread.0), number(row.spread.1));
    let (limit, verdict) = match &row.limit {
        Some((name, limit)) => {
            let verdict = if row.value <= *limit { "reached" } else { "**missed**" };
            (format!("{name}: ≤ {}{unit}", number(*limit)), verdict)
        }
        None => (String::new(), ""),
    };
    format!("| {} | {value} | {limit} | {verdict} |\n", row.what)
}

/// Three digits.
fn significant(x: f64) -> String {
    if x.abs() < 1e-3 {
        return format!("{x:.1e}");
    }
    let digits = (2 - x.abs().log10().floor() as i32).max(0) as usize;
    format!("{x:.digits$}")
}
