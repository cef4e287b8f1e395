//! Annotations that GitHub shows at a job.

use agglo_replay::diff::{Report, Verdict};

use super::Names;

/// Lines for the log of a job; none where all is the same and whole.
pub fn report(names: Names<'_>, report: &Report) -> String {
    let line =
        |level: &str, text: &str| format!("::{level} file={},title=agglo diff::{}\n", property(names.a), message(text));
    match &report.verdict {
        Verdict::Incomparable(why) => line("error", &format!("not comparable with {}: {why}", names.b)),
        Verdict::Differ => {
            let what = report.first.as_ref().map_or_else(
                || report.not_compared.join("; "),
                |first| format!("first difference at {}: {}", first.place(), first.what),
            );
            line("error", &format!("differs from {}: {what}", names.b))
        }
        Verdict::Same if report.damaged() => line("warning", "the same as far as it is whole, but a part is lost"),
        Verdict::Same => String::new(),
    }
}

/// What GitHub reads as the text after `::`.
fn message(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// What GitHub reads as the value of a property.
fn property(text: &str) -> String {
    message(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_end_an_annotation_is_escaped() {
        assert_eq!(property("a,b:c%\n"), "a%2Cb%3Ac%25%0A");
        assert_eq!(message("5 % at 1:2,\n"), "5 %25 at 1:2,%0A");
    }
}
