//! What is wrong with a scene, and where.

use std::ops::Range;

use super::setting::Setting;
use super::tree::{Node, Origin};

/// One thing wrong with a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// JSON pointer of the offending value, such as `/solver/step/initial`; empty for the whole text.
    pub pointer: String,
    /// A sentence with the value and the allowed range.
    pub message: String,
    /// What to do, if that is known.
    pub hint: Option<String>,
    /// Byte range in the scene's text, where it came from a text.
    pub span: Option<Range<usize>>,
}

impl Problem {
    /// A problem at a pointer.
    #[must_use]
    pub fn new(pointer: impl Into<String>, message: impl Into<String>) -> Self {
        Self { pointer: pointer.into(), message: message.into(), hint: None, span: None }
    }

    /// The same, with a hint.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl std::fmt::Display for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}: {}", if self.pointer.is_empty() { "/" } else { &self.pointer }, self.message)?;
        if let Some(hint) = &self.hint {
            write!(f, " (hint: {hint})")?;
        }
        Ok(())
    }
}

/// Problems as they are found; a scene of a million wrong particles says so in a hundred lines.
#[derive(Debug, Default)]
pub(crate) struct Problems {
    list: Vec<Problem>,
    more: usize,
}

impl Problems {
    const LIMIT: usize = 100;

    /// Adds a problem, or only counts it once there are many.
    pub fn push(&mut self, problem: Problem) {
        if self.is_full() {
            self.more += 1;
        } else {
            self.list.push(problem);
        }
    }

    /// Whether further problems will only be counted, and finding words for them is wasted.
    pub fn is_full(&self) -> bool {
        self.list.len() >= Self::LIMIT
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// All problems, in the order found.
    pub fn finish(mut self) -> Vec<Problem> {
        if self.more > 0 {
            let problems = if self.more == 1 { "problem is" } else { "problems are" };
            self.list.push(Problem::new("", format!("{} more {problems} not listed", self.more)));
        }
        self.list
    }
}

/// Says for every problem where in the text, or in which setting, its value stands, and sorts by place.
pub(super) fn locate(problems: &mut [Problem], text: &str, root: &Node, settings: &[Setting]) {
    for problem in problems.iter_mut() {
        if problem.span.is_none() {
            match &root.nearest(&problem.pointer).origin {
                Origin::Text(span) => problem.span = Some(span.clone()),
                Origin::Setting(index) => {
                    if let Some(setting) = settings.get(*index) {
                        problem.message = format!("{} (from {setting})", problem.message);
                    }
                }
                Origin::Memory => {}
            }
        }
        // A value of many lines is marked at its first character.
        if let Some(span) = &mut problem.span
            && text.get(span.clone()).is_some_and(|part| part.contains('\n'))
        {
            let width = text[span.start..].chars().next().map_or(0, char::len_utf8);
            span.end = span.start + width;
        }
    }
    problems.sort_by_key(|problem| problem.span.as_ref().map_or(usize::MAX, |span| span.start));
}

/// Line and column, both from 1 and the column in characters, of a byte offset in a text.
#[must_use]
pub fn line_column(text: &str, offset: usize) -> (usize, usize) {
    let mut end = offset.min(text.len());
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    let before = text[..end].strip_prefix('\u{feff}').unwrap_or(&text[..end]);
    let line_start = before.rfind('\n').map_or(0, |k| k + 1);
    (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters() {
        let text = "µm\nab\r\nç";
        assert_eq!(line_column(text, 0), (1, 1));
        assert_eq!(line_column(text, 2), (1, 2));
        assert_eq!(line_column(text, 1), (1, 1), "inside a character");
        assert_eq!(line_column(text, 4), (2, 1));
        assert_eq!(line_column(text, 999), (3, 2));
    }

    #[test]
    fn many_problems_are_counted() {
        let mut problems = Problems::default();
        for k in 0..250 {
            problems.push(Problem::new("", k.to_string()));
        }
        let list = problems.finish();
        assert_eq!(list.len(), 101);
        assert_eq!(list[100].message, "150 more problems are not listed");
    }
}
