//! A comparison as Markdown, for the summary of a CI job.

use std::fmt::Write;

use agglo_replay::diff::{Report, Verdict, setting_text};

use super::{Names, json};
use crate::numbers::{counted, short};

/// Fields that are listed.
const SHOWN: usize = 40;

/// A section with tables.
pub fn report(names: Names<'_>, report: &Report) -> String {
    let mut text = format!("### agglo diff: {}\n\n", json::verdict(&report.verdict));
    _ = writeln!(
        text,
        "{} against {}, profile `{}`, {} steps compared.\n",
        code(names.a),
        code(names.b),
        report.profile.name(),
        report.compared_steps
    );
    if let Verdict::Incomparable(why) = &report.verdict {
        _ = writeln!(text, "Not comparable: {}\n", escape(why));
    }
    if let Some(first) = &report.first {
        let (channel, what) = (escape(&first.channel), escape(&first.what));
        _ = writeln!(text, "First difference at {}, {channel}: {what}\n", first.place());
    }
    if let Some(cause) = &report.cause {
        _ = writeln!(text, "Just before the states part: {}\n", escape(&cause.to_string()));
    }
    if report.damaged() {
        text += "A part of the logs is lost; what is whole was compared.\n\n";
    }
    if !report.settings.is_empty() {
        text += "| setting | a | b | decides |\n|---|---|---|---|\n";
        for setting in &report.settings {
            let (name, kind) = (code(&setting.name), setting.kind.name());
            let (a, b) = (code(&setting_text(&setting.a)), code(&setting_text(&setting.b)));
            _ = writeln!(text, "| {name} | {a} | {b} | {kind} |");
        }
        text.push('\n');
    }
    for found in &report.structure {
        let channel = if found.channel.is_empty() { "steps".to_owned() } else { code(&found.channel) };
        _ = writeln!(text, "- {channel}: {} ({})", escape(&found.what), counted(found.count, "time"));
    }
    let differing: Vec<_> = report.fields.iter().filter(|field| field.at.is_some() || !field.passed).collect();
    if !differing.is_empty() {
        text += "\n| field | max abs | max rel | rms | passed |\n|---|---|---|---|---|\n";
        for field in differing.iter().take(SHOWN) {
            let name = code(&format!("{}.{}", field.channel, field.field));
            let (abs, rel, rms) = (short(field.max_abs), short(field.max_rel), short(field.rms()));
            _ = writeln!(text, "| {name} | {abs} | {rel} | {rms} | {} |", if field.passed { "yes" } else { "no" });
        }
        if differing.len() > SHOWN {
            _ = writeln!(text, "\n{} more fields differ.", differing.len() - SHOWN);
        }
    }
    if let Some(statistics) = &report.statistics {
        text +=
            "\n| curve | from (s) | to (s) | value | expected | allowed ± | passed |\n|---|---|---|---|---|---|---|\n";
        for judgement in statistics.judgements.iter().take(SHOWN) {
            let (from, to) = (short(judgement.span.0), short(judgement.span.1));
            let (value, mean, allowed) = (short(judgement.value), short(judgement.mean), short(judgement.allowed));
            let passed = if judgement.passed { "yes" } else { "no" };
            _ = writeln!(text, "| {} | {from} | {to} | {value} | {mean} | {allowed} | {passed} |", judgement.curve);
        }
    }
    for what in &report.not_compared {
        _ = writeln!(text, "\nNot compared: {}", escape(what));
    }
    if !report.drawn.is_empty() {
        _ = writeln!(text, "\nNot compared, for they are drawn from the states: {}", code(&report.drawn.join(", ")));
    }
    if !report.ignored.is_empty() {
        _ = writeln!(text, "\nIgnored by name: {}", code(&report.ignored.join(", ")));
    }
    text
}

/// Text that Markdown and HTML take for text.
fn escape(text: &str) -> String {
    let mut escaped = String::new();
    for c in text.chars() {
        match c {
            '<' => escaped += "&lt;",
            '>' => escaped += "&gt;",
            '&' => escaped += "&amp;",
            '\n' | '\r' => escaped.push(' '),
            '|' | '`' | '*' | '_' | '[' | ']' | '\\' | '#' => {
                escaped.push('\\');
                escaped.push(c);
            }
            _ => escaped.push(c),
        }
    }
    escaped
}

/// Text as code; backticks and bars would end it.
fn code(text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    format!("`{}`", text.replace(['`', '\n', '\r'], " ").replace('|', "\\|"))
}
