//! Numbers for people: four digits, and words that agree with their number.

/// Four significant digits; powers of ten where a plain number would be long.
#[must_use]
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    // Rounded first: 9999.7 has five digits before the point when it has four.
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if (1e-3..1e6).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

/// `1 step`, `2 steps`.
#[must_use]
pub fn counted(count: u64, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// A JSON number that reads back to the same one; JSON has none for those that are not finite, which are strings.
#[must_use]
pub fn exact(value: f64) -> serde_json::Value {
    match value {
        value if value.is_finite() => value.into(),
        value if value.is_nan() => "NaN".into(),
        value if value > 0.0 => "Infinity".into(),
        _ => "-Infinity".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.25 / 2.25, "0.1111"),
            (-1234.56, "-1235"),
            (123_456.0, "123500"),
            (9999.7, "10000"),
            (1e-3, "0.001"),
            (2.999_96e-16, "3e-16"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(short(value), text);
        }
    }
}
