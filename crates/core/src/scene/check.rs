//! Checks a value tree against the scene's JSON Schema and says what is wrong in a user's words.
//!
//! The schema is the only table of keys, types and ranges. Of JSON Schema this knows the keywords that the schema uses
//! (a test in `schema` holds it to that), and reads a unit off the brackets of a description.

use std::ops::Range;

use serde_json::Value;

use super::Problem;
use super::problem::Problems;
use super::schema::{homes, resolve};
use super::tree::{Kind, Lexeme, Member, Node, Origin, escape};
use super::units;
use super::words::{alternatives, first_sentence, in_unit, list, nearest, place, range, subject, unit};

/// Checks `node`, which stands at `pointer`, against `schema`, a part of the whole schema `root`.
pub(super) fn check(node: &Node, pointer: &str, root: &Value, schema: &Value, problems: &mut Problems) {
    Checker { root, problems }.value(node, Path::Start(pointer), schema, "");
}

/// A JSON pointer that is written out only where something is wrong.
#[derive(Clone, Copy)]
enum Path<'p> {
    Start(&'p str),
    Key(&'p Path<'p>, &'p str),
    Index(&'p Path<'p>, usize),
}

impl std::fmt::Display for Path<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Start(pointer) => f.write_str(pointer),
            Self::Key(parent, key) => write!(f, "{parent}/{}", escape(key)),
            Self::Index(parent, k) => write!(f, "{parent}/{k}"),
        }
    }
}

struct Checker<'a> {
    root: &'a Value,
    problems: &'a mut Problems,
}

impl<'a> Checker<'a> {
    /// `about` is the description of the nearest enclosing value that has one.
    fn value(&mut self, node: &Node, path: Path<'_>, schema: &'a Value, about: &'a str) {
        let own = schema.get("description").and_then(Value::as_str);
        let schema = resolve(self.root, schema);
        let about = own.or_else(|| schema.get("description").and_then(Value::as_str)).unwrap_or(about);
        if let Some(branches) = branches(schema, "oneOf") {
            if branches.iter().all(|b| b.get("const").is_some()) {
                return self.name(node, path, branches);
            }
            return self.tagged(node, path, branches, about);
        }
        if let Some(branches) = branches(schema, "anyOf") {
            return match branches.iter().find(|b| accepts(self.root, b, &node.kind)) {
                Some(branch) => self.value(node, path, branch, about),
                None => self.wrong_type(node, path, schema, about),
            };
        }
        if !accepts(self.root, schema, &node.kind) {
            return self.wrong_type(node, path, schema, about);
        }
        match &node.kind {
            Kind::Number(number) => self.number(number, path, schema, about),
            Kind::String(text) => {
                let least = schema.get("minLength").and_then(Value::as_u64).unwrap_or(0);
                if (text.chars().count() as u64) < least {
                    self.report(path, format!("{} must not be empty", subject(path)));
                }
            }
            Kind::Array(elements) => self.array(elements, path, schema, about),
            Kind::Object(members) => self.object(members, path, schema, about),
            Kind::Null | Kind::Bool(_) => {}
        }
    }

    fn report(&mut self, path: Path<'_>, message: String) {
        self.problems.push(Problem::new(path.to_string(), message));
    }

    fn wrong_type(&mut self, node: &Node, path: Path<'_>, schema: &Value, about: &str) {
        let expected = expected(self.root, schema);
        let unit = unit(about);
        let in_memory = matches!((&node.kind, &node.origin), (Kind::Null, Origin::Memory));
        let mut problem = Problem::new(
            path.to_string(),
            format!(
                "{} must be {expected}{}, not {}",
                subject(path),
                if expected.contains("number") { in_unit(unit) } else { String::new() },
                if in_memory { "NaN or infinite".into() } else { node.kind.describe() }
            ),
        );
        match &node.kind {
            // Serialising turns a number that is not finite into null.
            Kind::Null if in_memory => {}
            Kind::String(text) if expected.contains("number") => {
                if let Some(hint) = units::hint(text, unit) {
                    problem = problem.hint(hint);
                }
            }
            Kind::Null => {
                problem = problem.hint("leave the key out to do without it");
            }
            Kind::Number(number) if resolve(self.root, schema).get("maxItems").and_then(Value::as_u64) == Some(3) => {
                problem = problem.hint(format!("write {}", three(&subject(path), number)));
            }
            Kind::String(text) if has_property(self.root, schema, "path") => {
                problem = problem.hint(format!("write {{ \"path\": {} }}", Value::String(text.clone())));
            }
            _ => {}
        }
        self.problems.push(problem);
    }

    fn number(&mut self, number: &Lexeme, path: Path<'_>, schema: &Value, about: &str) {
        let integer = schema.get("type").is_some_and(|t| t == "integer");
        let what = || subject(path);
        let shown = || Kind::Number(number.clone()).describe();
        if !number.value.is_finite() {
            return self.report(
                path,
                format!("{} must be a finite number, not {}; the largest is {:e}", what(), shown(), f64::MAX),
            );
        }
        if number.underflows() {
            return self.report(
                path,
                format!("{} is {}, too small to tell from 0; the smallest is {:e}", what(), shown(), f64::MIN_POSITIVE),
            );
        }
        if integer && !number.is_integer() {
            return self.report(path, format!("{} must be an integer, not {}", what(), shown()));
        }
        let bound = |key: &str| schema.get(key).and_then(Value::as_f64);
        let value = number.value;
        let inside = bound("minimum").is_none_or(|min| value >= min)
            && bound("exclusiveMinimum").is_none_or(|min| value > min)
            && bound("maximum").is_none_or(|max| value <= max)
            && bound("exclusiveMaximum").is_none_or(|max| value < max);
        if !inside {
            let (range, unit) = (range(schema), in_unit(unit(about)));
            self.report(path, format!("{} must be {range}{unit}, not {}", what(), shown()));
        }
    }

    fn array(&mut self, elements: &[Node], path: Path<'_>, schema: &'a Value, about: &'a str) {
        let bound = |key: &str| schema.get(key).and_then(Value::as_u64);
        let (least, most) = (bound("minItems").unwrap_or(0), bound("maxItems").unwrap_or(u64::MAX));
        let count = elements.len() as u64;
        if count < least || count > most {
            let needed = if least == most { format!("{least}") } else { format!("at least {least}") };
            let noun = if least == 1 { "element" } else { "elements" };
            self.report(path, format!("{} must have {needed} {noun}, not {count}", subject(path)));
        }
        if let Some(items) = schema.get("items") {
            for (k, element) in elements.iter().enumerate() {
                self.value(element, Path::Index(&path, k), items, about);
            }
        }
    }

    fn object(&mut self, members: &[Member], path: Path<'_>, schema: &'a Value, about: &'a str) {
        let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
        self.duplicates(members, path);
        let mut missing: Vec<&str> = schema
            .get("required")
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
            .filter_map(Value::as_str)
            .filter(|key| !members.iter().any(|m| m.key == *key))
            .collect();
        // A key that is given was hardly the one meant by a misspelt one: a last guess, for settings.
        let candidates: Vec<&str> =
            properties.keys().map(String::as_str).filter(|key| !members.iter().any(|m| m.key == *key)).collect();
        for member in members {
            match properties.get(&member.key) {
                Some(property) => {
                    self.value(&member.value, Path::Key(&path, &member.key), property, about);
                }
                None => {
                    let meant = self.unknown_key(member, path, &candidates, properties.keys().map(String::as_str));
                    // A misspelt key is one problem, not two.
                    missing.retain(|key| Some(*key) != meant);
                }
            }
        }
        for key in missing {
            let about = properties.get(key).map_or("", |p| describe(self.root, p));
            let message = format!("{} lacks the key \"{key}\"", place(path));
            self.problems
                .push(Problem::new(path.to_string(), message).hint(format!("\"{key}\": {}", first_sentence(about))));
        }
    }

    fn duplicates(&mut self, members: &[Member], path: Path<'_>) {
        // Objects of a scene are small, except broken ones: those are not compared pair by pair for ever.
        for (k, member) in members.iter().enumerate().take(1000) {
            if members[..k].iter().any(|m| m.key == member.key) {
                let at = Path::Key(&path, &member.key);
                self.problems.push(Problem {
                    span: key_span(member),
                    ..Problem::new(at.to_string(), format!("duplicate key \"{}\"", member.key)).hint("keep one of them")
                });
            }
        }
    }

    /// Reports an unknown key and returns the key that was probably meant.
    fn unknown_key<'k>(
        &mut self,
        member: &Member,
        path: Path<'_>,
        candidates: &[&'k str],
        all: impl Iterator<Item = &'k str>,
    ) -> Option<&'k str> {
        let at = Path::Key(&path, &member.key);
        if self.problems.is_full() {
            self.report(at, String::new());
            return None;
        }
        let all: Vec<&str> = all.collect();
        let meant = nearest(&member.key, candidates);
        let elsewhere = homes(self.root, &member.key);
        let hint = match (meant, elsewhere.as_slice(), nearest(&member.key, &all)) {
            (Some(meant), _, _) => format!("did you mean \"{meant}\"?"),
            (None, [one], _) => format!("\"{}\" is a key of {}", member.key, place(one)),
            (None, _, Some(given)) if matches!(member.key_origin, Origin::Setting(_)) => {
                format!("did you mean \"{given}\"?")
            }
            (None, _, Some(given)) => format!("\"{given}\" is given already; leave one of them out"),
            (None, _, None) => format!("the keys here are {}", list(all.into_iter())),
        };
        self.problems.push(Problem {
            span: key_span(member),
            ..Problem::new(at.to_string(), format!("unknown key \"{}\" in {}", member.key, place(path))).hint(hint)
        });
        meant
    }

    /// One of several names.
    fn name(&mut self, node: &Node, path: Path<'_>, branches: &[Value]) {
        let names: Vec<&str> = branches.iter().filter_map(|b| b.get("const").and_then(Value::as_str)).collect();
        let found = match &node.kind {
            Kind::String(text) if names.contains(&text.as_str()) => return,
            Kind::String(text) => nearest(text, &names),
            _ => None,
        };
        let message = format!(
            "{} must be {}, not {}",
            subject(path),
            alternatives(&names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>()),
            node.kind.describe()
        );
        let problem = Problem::new(path.to_string(), message);
        self.problems.push(match found {
            Some(meant) => problem.hint(format!("did you mean \"{meant}\"?")),
            None => problem,
        });
    }

    /// An object with exactly one of several keys.
    fn tagged(&mut self, node: &Node, path: Path<'_>, branches: &'a [Value], about: &'a str) {
        let alternatives: Vec<(&str, &Value, &str)> = branches
            .iter()
            .filter_map(|branch| {
                let (key, property) = branch.get("properties")?.as_object()?.iter().next()?;
                Some((key.as_str(), property, branch.get("description").and_then(Value::as_str).unwrap_or(about)))
            })
            .collect();
        let keys: Vec<&str> = alternatives.iter().map(|a| a.0).collect();
        let Kind::Object(members) = &node.kind else {
            let message =
                format!("{} must be an object with one of the keys {}", subject(path), list(keys.iter().copied()));
            let problem = Problem::new(path.to_string(), format!("{message}, not {}", node.kind.describe()));
            self.problems.push(match node.kind {
                Kind::Array(_) if keys.contains(&"list") => problem.hint("write { \"list\": [..] }"),
                _ => problem,
            });
            return;
        };
        self.duplicates(members, path);
        let mut given = Vec::new();
        let mut misspelt = false;
        for member in members {
            match alternatives.iter().find(|a| a.0 == member.key) {
                Some((key, property, about)) => {
                    if !given.contains(key) {
                        given.push(key);
                    }
                    self.value(&member.value, Path::Key(&path, key), property, about);
                }
                None => misspelt |= self.unknown_key(member, path, &keys, keys.iter().copied()).is_some(),
            }
        }
        match given.len() {
            0 if !misspelt => {
                let message = format!("{} needs one of the keys {}", place(path), list(keys.iter().copied()));
                self.report(path, message);
            }
            0 | 1 => {}
            _ => {
                let found = list(given.into_iter());
                let message = format!("{} must have exactly one of the keys {}", place(path), list(keys.into_iter()));
                self.report(path, format!("{message}, not {found} together"));
            }
        }
    }
}

/// Three components in place of a number: gravity points down, a box has equal edges, and the rest points along x.
fn three(key: &str, number: &Lexeme) -> String {
    let text = &number.text;
    match key {
        "gravity" => format!("[0, 0, -{}]", text.trim_start_matches('-')),
        "periodic" | "velocity_spread" => format!("[{text}, {text}, {text}]"),
        _ => format!("three components, such as [{text}, 0, 0]"),
    }
}

fn has_property(root: &Value, schema: &Value, key: &str) -> bool {
    resolve(root, schema).get("properties").is_some_and(|properties| properties.get(key).is_some())
}

fn branches<'a>(schema: &'a Value, key: &str) -> Option<&'a [Value]> {
    schema.get(key).and_then(Value::as_array).map(Vec::as_slice)
}

/// The JSON types that a schema accepts.
fn types<'a>(root: &'a Value, schema: &'a Value) -> Vec<&'a str> {
    let schema = resolve(root, schema);
    for key in ["oneOf", "anyOf"] {
        if let Some(branches) = branches(schema, key) {
            return branches.iter().flat_map(|b| types(root, b)).collect();
        }
    }
    match schema.get("type") {
        Some(Value::String(one)) => vec![one],
        Some(Value::Array(several)) => several.iter().filter_map(Value::as_str).collect(),
        _ => Vec::new(),
    }
}

fn accepts(root: &Value, schema: &Value, kind: &Kind) -> bool {
    types(root, schema).iter().any(|t| {
        matches!(
            (*t, kind),
            ("null", Kind::Null)
                | ("boolean", Kind::Bool(_))
                | ("number" | "integer", Kind::Number(_))
                | ("string", Kind::String(_))
                | ("array", Kind::Array(_))
                | ("object", Kind::Object(_))
        )
    })
}

/// What a schema expects, in words.
fn expected(root: &Value, schema: &Value) -> String {
    fn collect(root: &Value, schema: &Value, words: &mut Vec<String>) {
        let schema = resolve(root, schema);
        if let Some(name) = schema.get("const").and_then(Value::as_str) {
            return words.push(format!("\"{name}\""));
        }
        for key in ["oneOf", "anyOf"] {
            for branch in branches(schema, key).into_iter().flatten() {
                collect(root, branch, words);
            }
        }
        if schema.get("oneOf").is_some() || schema.get("anyOf").is_some() {
            return;
        }
        for t in types(root, schema) {
            words.push(match (t, schema.get("maxItems").and_then(Value::as_u64)) {
                ("null", _) => "null".into(),
                ("integer", _) => "an integer".into(),
                ("array", Some(n)) => format!("an array of {n}"),
                ("array", None) => "an array".into(),
                ("object", _) => "an object".into(),
                (other, _) => format!("a {other}"),
            });
        }
    }
    let mut words = Vec::new();
    collect(root, schema, &mut words);
    alternatives(&words)
}

/// The description of a schema, or of what it refers to.
fn describe<'a>(root: &'a Value, schema: &'a Value) -> &'a str {
    let own = schema.get("description").and_then(Value::as_str);
    own.or_else(|| resolve(root, schema).get("description").and_then(Value::as_str)).unwrap_or_default()
}

fn key_span(member: &Member) -> Option<Range<usize>> {
    match &member.key_origin {
        Origin::Text(span) => Some(span.clone()),
        _ => None,
    }
}
