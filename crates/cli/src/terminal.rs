//! Messages to people and programs, all on standard error: errors, warnings, notes; as text or a JSON object a line.
//!
//! A standard error that cannot be written to is ignored: there is nowhere left to say so.

use std::io::{IsTerminal, Write};

use agglo_core::scene::{Problem, line_column};
use agglo_replay::text::printable;
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::args::{Color, ErrorFormat, Global, ProgressKind};
use crate::failure::{Failure, Message, SceneProblems};

/// Problems of a scene that are written out; `-v` writes all.
const PROBLEMS_SHOWN: usize = 20;
/// Longest line of a scene that is shown [bytes].
const LONGEST_LINE: usize = 4096;

/// How to talk to whoever started the program.
#[derive(Clone, Copy, Debug)]
pub struct Terminal {
    /// Errors only.
    pub quiet: bool,
    /// Informative notes as well.
    pub verbose: bool,
    /// Text or JSON.
    pub errors: ErrorFormat,
    /// How progress is shown.
    pub progress: ProgressKind,
}

/// How loud a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Error,
    Warning,
    Note,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Error => "error",
            Self::Warning => "warning",
            Self::Note => "note",
        }
    }

    fn level(self) -> Level<'static> {
        match self {
            Self::Error => Level::ERROR,
            Self::Warning => Level::WARNING,
            Self::Note => Level::NOTE,
        }
    }
}

impl Terminal {
    /// As the options say; also sets when the program's output is coloured.
    #[must_use]
    pub fn new(options: &Global) -> Self {
        match options.color {
            Color::Auto => anstream::ColorChoice::Auto,
            Color::Always => anstream::ColorChoice::Always,
            Color::Never => anstream::ColorChoice::Never,
        }
        .write_global();
        Self { quiet: options.quiet, verbose: options.verbose, errors: options.errors, progress: options.progress }
    }

    /// Whether a progress bar may be drawn.
    #[must_use]
    pub fn draws_bar(&self) -> bool {
        self.progress == ProgressKind::Auto && self.people() && std::io::stderr().is_terminal()
    }

    /// Whether people read standard error: text that no program has to read may go there.
    #[must_use]
    pub fn people(&self) -> bool {
        !self.quiet && self.errors == ErrorFormat::Text
    }

    /// Says why a command failed.
    pub fn failure(&self, failure: &Failure) {
        match failure {
            Failure::Input(message) | Failure::Failed(message) => self.message(Kind::Error, message),
            Failure::Scene(scene) => self.scene(scene),
            Failure::ClosedPipe => {}
            Failure::Interrupted => self.note("interrupted; nothing was written"),
        }
    }

    /// Warns.
    pub fn warning(&self, message: &Message) {
        if !self.quiet {
            self.message(Kind::Warning, message);
        }
    }

    /// Says something worth knowing.
    pub fn note(&self, text: impl Into<String>) {
        if !self.quiet {
            self.message(Kind::Note, &Message::new(text));
        }
    }

    /// Says something that only who asks for more wants to know.
    pub fn detail(&self, text: impl Into<String>) {
        if self.verbose {
            self.message(Kind::Note, &Message::new(text));
        }
    }

    /// Writes plain lines for people.
    pub fn text(&self, text: &str) {
        if self.people() {
            write_line(&printable(text));
        }
    }

    /// Writes a JSON object on a line of its own.
    pub fn json(&self, value: &serde_json::Value) {
        write_line(&value.to_string());
    }

    fn message(&self, kind: Kind, message: &Message) {
        match self.errors {
            ErrorFormat::Json => self.json(&serde_json::json!({
                "type": kind.name(), "file": message.file, "line": null, "column": null, "pointer": null,
                "message": message.text, "hint": message.hint,
            })),
            ErrorFormat::Text => {
                let (text, hint) = (printable(&message.text), message.hint.as_deref().map(printable));
                let title = kind.level().primary_title(text);
                let group = Group::with_title(title);
                let group = match hint {
                    Some(hint) => group.element(Level::HELP.with_name("hint").message(hint)),
                    None => group,
                };
                write_line(&Renderer::styled().render(&[group]));
            }
        }
    }

    fn scene(&self, scene: &SceneProblems) {
        let shown = if self.verbose || self.errors == ErrorFormat::Json { usize::MAX } else { PROBLEMS_SHOWN };
        for problem in scene.problems.iter().take(shown) {
            match self.errors {
                ErrorFormat::Json => self.json(&problem_json(scene, problem)),
                ErrorFormat::Text => write_line(&problem_text(scene, problem)),
            }
        }
        let left = scene.problems.len().saturating_sub(shown);
        if left > 0 {
            self.message(Kind::Error, &Message::new(format!("and {left} more, which -v shows")));
        }
    }
}

fn problem_json(scene: &SceneProblems, problem: &Problem) -> serde_json::Value {
    let place = problem.span.as_ref().map(|span| line_column(&scene.text, span.start));
    serde_json::json!({
        "type": "error", "file": scene.file, "line": place.map(|p| p.0), "column": place.map(|p| p.1),
        "pointer": problem.pointer, "message": problem.message, "hint": problem.hint,
    })
}

/// A problem with the line it is in, as compilers show theirs.
fn problem_text(scene: &SceneProblems, problem: &Problem) -> String {
    let title = Level::ERROR.primary_title(printable(&problem.message));
    let mut group = Group::with_title(title);
    let file = printable(&scene.file);
    let window = problem.span.as_ref().map(|span| window(&scene.text, span));
    if let (Some(span), Some(window)) = (&problem.span, window) {
        let (line, column) = line_column(&scene.text, span.start);
        if window.len() <= LONGEST_LINE {
            let marked = span.start - window.start..span.end.min(window.end) - window.start;
            let snippet = Snippet::source(&scene.text[window]).line_start(line).path(file);
            group = group.element(snippet.annotation(AnnotationKind::Primary.span(marked)));
        } else {
            group = group.element(annotate_snippets::Origin::path(file).line(line).char_column(column));
        }
    } else {
        group = group.element(annotate_snippets::Origin::path(file));
    }
    if !problem.pointer.is_empty() {
        group = group.element(Level::NOTE.with_name("at").message(printable(&problem.pointer)));
    }
    if let Some(hint) = &problem.hint {
        group = group.element(Level::HELP.with_name("hint").message(printable(hint)));
    }
    Renderer::styled().render(&[group])
}

/// The line in which a span starts.
fn window(text: &str, span: &std::ops::Range<usize>) -> std::ops::Range<usize> {
    let start = text.get(..span.start).and_then(|before| before.rfind('\n')).map_or(0, |k| k + 1);
    let end = text.get(span.start..).and_then(|after| after.find('\n')).map_or(text.len(), |k| span.start + k);
    start..end
}

/// Writes an error when nothing else can be relied on.
pub fn last_words(text: &str) {
    write_line(&format!("error: {text}"));
}

fn write_line(text: &str) {
    let mut stream = anstream::stderr().lock();
    _ = writeln!(stream, "{text}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_problem_shows_its_line() {
        let text = "{\n  \"durration\": 5\n}".to_owned();
        let problem = Problem { span: Some(4..15), ..Problem::new("/durration", "unknown key \"durration\"") };
        let scene = SceneProblems { file: "scene.json".into(), text, problems: vec![problem.hint("\"duration\"?")] };
        let shown = anstream::adapter::strip_str(&problem_text(&scene, &scene.problems[0])).to_string();
        assert_eq!(
            shown,
            "error: unknown key \"durration\"\n --> scene.json:2:3\n  |\n2 |   \"durration\": 5\n  |   ^^^^^^^^^^^\n  |\n  = at: \
             /durration\n  = hint: \"duration\"?"
        );
        let json = problem_json(&scene, &scene.problems[0]);
        assert_eq!((&json["line"], &json["column"]), (&2.into(), &3.into()));
    }

    #[test]
    fn spans_anywhere_are_safe() {
        let text = "ä\n\n{}".to_owned();
        for start in (0..=text.len()).filter(|&k| text.is_char_boundary(k)) {
            for end in (start..=text.len() + 2).filter(|&k| k > text.len() || text.is_char_boundary(k)) {
                let problem = Problem { span: Some(start..end), ..Problem::new("", "wrong") };
                let scene = SceneProblems { file: "s".into(), text: text.clone(), problems: vec![problem] };
                assert!(problem_text(&scene, &scene.problems[0]).contains("wrong"));
            }
        }
    }
}
