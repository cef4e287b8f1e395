//! Texts from files, made safe to show: what could make a terminal or page do things is shown, not sent.

/// The text with its control characters escaped, and those that reorder or hide what stands around them; line ends stay.
#[must_use]
pub fn printable(text: &str) -> String {
    escaped(text, |c| c == '\n')
}

/// The same on one line.
#[must_use]
pub fn line(text: &str) -> String {
    escaped(text, |_| false)
}

fn escaped(text: &str, stays: fn(char) -> bool) -> String {
    text.chars()
        .flat_map(|c| {
            let harmless = stays(c) || !(c.is_control() || misleads(c));
            let escaped = (!harmless).then(|| c.escape_unicode());
            escaped.into_iter().flatten().chain(harmless.then_some(c))
        })
        .collect()
}

/// Marks, embeddings, overrides and isolates of directions; line and paragraph separators; what has no width.
fn misleads(c: char) -> bool {
    matches!(c, '\u{61c}' | '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_not_sent() {
        assert_eq!(printable("a\u{1b}[2Jb\nc\u{9b}"), "a\\u{1b}[2Jb\nc\\u{9b}");
        assert_eq!(line("a\nb\u{202e}c µθ"), "a\\u{a}b\\u{202e}c µθ");
    }
}
