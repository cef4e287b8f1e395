//! A comparison as JUnit XML: a test case per field, curve, and kind of structure.

use agglo_replay::diff::{Report, Verdict};
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::Names;
use crate::numbers::short;

/// A case, and why it failed.
struct Case {
    name: String,
    failure: Option<String>,
}

/// The document.
pub fn report(names: Names<'_>, report: &Report) -> String {
    let cases = cases(report);
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
    // Writing into memory cannot fail.
    _ = write(&mut writer, names, report, &cases);
    let mut text = String::from_utf8_lossy(&writer.into_inner()).into_owned();
    text.push('\n');
    text
}

fn cases(report: &Report) -> Vec<Case> {
    let mut cases = Vec::new();
    for field in &report.fields {
        let failure = (!field.passed).then(|| {
            let place = field
                .at
                .map_or_else(String::new, |(t, step, index)| format!(" at t = {t} s, step {step}, index {index}"));
            format!("differs by {} at most, relative {}{place}", short(field.max_abs), short(field.max_rel))
        });
        cases.push(Case { name: format!("{}.{}", field.channel, field.field), failure });
    }
    for found in &report.structure {
        let name = if found.channel.is_empty() { "steps".to_owned() } else { found.channel.clone() };
        let text = format!("{} ({} times, first at t = {} s, step {})", found.what, found.count, found.t, found.step);
        cases.push(Case { name, failure: Some(text) });
    }
    for what in &report.not_compared {
        cases.push(Case { name: "not compared".to_owned(), failure: Some(what.clone()) });
    }
    for judgement in report.statistics.iter().flat_map(|statistics| &statistics.judgements) {
        let failure = (!judgement.passed)
            .then(|| format!("{} instead of {} ± {}", judgement.value, judgement.mean, judgement.allowed));
        let (from, to) = judgement.span;
        cases.push(Case { name: format!("curves.{} from {from} to {to} s", judgement.curve), failure });
    }
    let all_pass = cases.iter().all(|case| case.failure.is_none());
    let verdict = match &report.verdict {
        Verdict::Differ if all_pass => report.first.as_ref().map(|first| first.what.clone()),
        _ => None,
    };
    cases.push(Case { name: "verdict".to_owned(), failure: verdict });
    cases
}

fn write(
    writer: &mut Writer<Vec<u8>>,
    names: Names<'_>,
    report: &Report,
    cases: &[Case],
) -> Result<(), std::io::Error> {
    writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let failures = cases.iter().filter(|case| case.failure.is_some()).count().to_string();
    let error = if let Verdict::Incomparable(why) = &report.verdict { Some(why) } else { None };
    let errors = usize::from(error.is_some()).to_string();
    let tests = cases.len().to_string();
    let suite = clean(&format!("agglo diff {} {}", names.a, names.b));
    let counts = [("tests", tests.as_str()), ("failures", failures.as_str()), ("errors", errors.as_str())];
    writer.create_element("testsuites").with_attributes(counts).write_inner_content(|writer| {
        let suite = writer.create_element("testsuite").with_attribute(("name", suite.as_str())).with_attributes(counts);
        suite.write_inner_content(|writer| {
            for case in cases {
                let name = clean(&case.name);
                let element = writer
                    .create_element("testcase")
                    .with_attributes([("classname", report.profile.name()), ("name", name.as_str())]);
                let (kind, text) = match (&case.failure, error) {
                    (Some(text), _) => ("failure", text),
                    (None, Some(why)) if case.name == "verdict" => ("error", why),
                    _ => {
                        element.write_empty()?;
                        continue;
                    }
                };
                let text = clean(text);
                element.write_inner_content(|writer| {
                    let inner = writer.create_element(kind).with_attribute(("message", text.as_str()));
                    inner.write_text_content(BytesText::new(&text)).map(drop)
                })?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

/// Text without characters that XML cannot hold.
fn clean(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c < ' ' && !matches!(c, '\t' | '\n' | '\r') || c == '\u{fffe}' || c == '\u{ffff}' {
                '\u{fffd}'
            } else {
                c
            }
        })
        .collect()
}
