//! Sizes in bytes: `500MB` to a number, and a number to `500 MB`.

/// Units, decimal ones for people and binary ones on request.
const UNITS: [(&str, u64); 10] = [
    ("", 1),
    ("b", 1),
    ("kb", 1_000),
    ("mb", 1_000_000),
    ("gb", 1_000_000_000),
    ("tb", 1_000_000_000_000),
    ("kib", 1 << 10),
    ("mib", 1 << 20),
    ("gib", 1 << 30),
    ("tib", 1 << 40),
];

/// Reads a size such as `1048576`, `500MB`, `1.5 GiB`; in bytes.
///
/// # Errors
/// A sentence on what is allowed.
pub fn parse(text: &str) -> Result<u64, String> {
    let trimmed = text.trim();
    let split = trimmed.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(trimmed.len());
    let (number, unit) = trimmed.split_at(split);
    let unit = unit.to_ascii_lowercase();
    let scale = UNITS.iter().find(|(name, _)| *name == unit).map(|(_, scale)| *scale);
    match (number.trim().parse::<f64>(), scale) {
        (Ok(number), Some(scale)) if number >= 0.0 && number * (scale as f64) < u64::MAX as f64 => {
            Ok((number * scale as f64) as u64)
        }
        _ => Err("give a number of bytes, or one with kB, MB, GB, TB, KiB, MiB, GiB or TiB, such as 500MB".to_owned()),
    }
}

/// Writes a size for people, with three digits.
#[must_use]
pub fn human(bytes: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB", "PB", "EB"];
    let mut value = bytes as f64;
    let mut unit = 0;
    while value >= 999.5 && unit + 1 < units.len() {
        value /= 1000.0;
        unit += 1;
    }
    let digits = if unit == 0 || value >= 99.95 {
        0
    } else if value >= 9.995 {
        1
    } else {
        2
    };
    format!("{value:.digits$} {}", units[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_read_and_written() {
        for (text, bytes) in [("0", 0), ("1024", 1024), ("500MB", 500_000_000), ("1.5 GiB", 3 << 29), ("2kb", 2000)] {
            assert_eq!(parse(text), Ok(bytes), "{text}");
        }
        for text in ["", "MB", "-1", "1 parsec", "nan", "inf", "1e30", "1 MB MB"] {
            assert!(parse(text).is_err(), "{text}");
        }
        for (bytes, text) in [
            (0, "0 B"),
            (999, "999 B"),
            (1000, "1.00 kB"),
            (9_995, "10.0 kB"),
            (99_949, "99.9 kB"),
            (999_499, "999 kB"),
            (999_500, "1.00 MB"),
            (u64::MAX, "18.4 EB"),
        ] {
            assert_eq!(human(bytes), text);
        }
    }
}
