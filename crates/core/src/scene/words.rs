//! Words for messages: lists, ranges, units, subjects, and the key that was probably meant.

use std::fmt::Display;

use serde_json::Value;

/// `"a", "b" or "c"`.
pub(super) fn alternatives(words: &[String]) -> String {
    match words {
        [] => "something else".into(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

/// `"a", "b", "c"`.
pub(super) fn list<'k>(keys: impl Iterator<Item = &'k str>) -> String {
    keys.map(|key| format!("\"{key}\"")).collect::<Vec<_>>().join(", ")
}

/// The range of a number, in words.
pub(super) fn range(schema: &Value) -> String {
    let bound = |key: &str| schema.get(key).filter(|v| v.is_number()).map(plain);
    match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum"), bound("exclusiveMaximum")) {
        (Some(min), _, Some(max), _) if min == max => min,
        (Some(min), _, Some(max), _) => format!("from {min} to {max}"),
        (Some(min), _, None, Some(max)) => format!("at least {min} and less than {max}"),
        (Some(min), _, None, None) => format!("at least {min}"),
        (None, Some(min), Some(max), _) => format!("greater than {min} and at most {max}"),
        (None, Some(min), None, Some(max)) => format!("greater than {min} and less than {max}"),
        (None, Some(min), None, None) => format!("greater than {min}"),
        (None, None, Some(max), _) => format!("at most {max}"),
        (None, None, None, Some(max)) => format!("less than {max}"),
        (None, None, None, None) => "a number".into(),
    }
}

/// A number to four digits, as one writes it.
pub(crate) fn short(value: f64) -> String {
    let rounded = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded == 0.0 || (1e-3..1e6).contains(&f64::abs(rounded)) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// A number without a needless `.0`.
pub(super) fn plain(value: &Value) -> String {
    let text = value.to_string();
    text.strip_suffix(".0").map_or_else(|| text.clone(), str::to_owned)
}

pub(super) fn first_sentence(text: &str) -> &str {
    text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.')
}

/// The unit in a description's last brackets; none for pure numbers.
pub(super) fn unit(about: &str) -> Option<&str> {
    let (_, rest) = about.rsplit_once('[')?;
    let (unit, _) = rest.split_once(']')?;
    (unit != "-").then_some(unit)
}

pub(super) fn in_unit(unit: Option<&str>) -> String {
    unit.map_or_else(String::new, |unit| format!(" [{unit}]"))
}

/// The value at a pointer as the subject of a sentence: its key, with indices.
pub(super) fn subject(path: impl Display) -> String {
    let pointer = path.to_string();
    let mut indices = String::new();
    for token in pointer.rsplit('/') {
        if token.is_empty() {
            break;
        }
        if token.bytes().all(|b| b.is_ascii_digit()) {
            indices = format!("[{token}]{indices}");
        } else {
            return format!("{}{indices}", token.replace("~1", "/").replace("~0", "~"));
        }
    }
    "the scene".into()
}

/// The object at a pointer as a place.
pub(super) fn place(path: impl Display) -> String {
    let pointer = path.to_string();
    if pointer.is_empty() { "the scene".into() } else { format!("`{pointer}`") }
}

/// The candidate most like a misspelt word, if any is like it.
pub(super) fn nearest<'k>(word: &str, candidates: &[&'k str]) -> Option<&'k str> {
    // Distances of very long words cost much and mean nothing.
    if word.len() > 64 {
        return None;
    }
    let word = word.to_lowercase().replace(['-', ' '], "_");
    let mut best: Option<(usize, &str)> = None;
    for candidate in candidates {
        let normal = candidate.to_lowercase().replace(['-', ' '], "_");
        let distance = strsim::damerau_levenshtein(&word, &normal);
        // One mistake in three letters still reads as the same word.
        let close = distance <= (normal.chars().count().max(word.chars().count()) / 3).max(1);
        // Short names of one or two letters differ in everything when they differ at all.
        let close = close && (distance == 0 || normal.len() > 2);
        if close && best.is_none_or(|(least, _)| distance < least) {
            best = Some((distance, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}
