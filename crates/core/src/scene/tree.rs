//! The value tree of a scene's text: JSON values that remember where they stand, or which setting put them there.

use std::ops::Range;

use jsonc_parser::ast;
use jsonc_parser::common::Ranged;
use serde_json::{Map, Number, Value};

use super::Problem;

/// Where a value comes from.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Origin {
    /// Byte range in the scene's text.
    Text(Range<usize>),
    /// Setting number k.
    Setting(usize),
    /// A value made in memory.
    Memory,
}

/// A JSON value with its origin.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub origin: Origin,
    pub kind: Kind,
}

/// What a value is.
#[derive(Clone, Debug)]
pub(super) enum Kind {
    Null,
    Bool(bool),
    Number(Lexeme),
    String(String),
    Array(Vec<Node>),
    Object(Vec<Member>),
}

/// A number as it was written, and the double that it means.
#[derive(Clone, Debug)]
pub(super) struct Lexeme {
    pub text: String,
    pub value: f64,
}

/// A key and its value.
#[derive(Clone, Debug)]
pub(super) struct Member {
    pub key: String,
    /// Where the key stands; a value's origin if there is no text.
    pub key_origin: Origin,
    pub value: Node,
}

/// Parses JSON with comments and trailing commas.
pub(super) fn parse(text: &str) -> Result<Node, Problem> {
    // Editors on some systems put a byte order mark in front; it is no part of the scene.
    let body = text.strip_prefix('\u{feff}').unwrap_or(text);
    let shift = text.len() - body.len();
    let options = jsonc_parser::ParseOptions {
        allow_comments: true,
        allow_trailing_commas: true,
        allow_loose_object_property_names: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    };
    match jsonc_parser::parse_to_ast(body, &jsonc_parser::CollectOptions::default(), &options) {
        Ok(parsed) => match parsed.value {
            Some(value) => Ok(from_ast(value, shift)),
            None => Err(Problem::new("", "the scene is empty").hint("`agglo init` writes a scene to start from")),
        },
        Err(error) => Err(syntax_problem(body, shift, &error)),
    }
}

/// What to say of numbers that are not finite.
const NOT_JSON: &str = "NaN and Infinity are not JSON; give a number";

fn syntax_problem(body: &str, shift: usize, error: &jsonc_parser::errors::ParseError) -> Problem {
    use jsonc_parser::errors::ParseErrorKind as E;
    let range = error.range().start..error.range().end.max(error.range().start);
    let found = body.get(range.clone()).unwrap_or_default();
    let (message, hint) = match error.kind() {
        E::UnexpectedWord if ["nan", "inf", "infinity"].contains(&found.to_lowercase().as_str()) => {
            (format!("`{found}` is not a number of a scene; numbers must be finite"), Some(NOT_JSON))
        }
        E::NonFiniteNumbersNotAllowed => {
            (format!("`{found}` is not a number of a scene; numbers must be finite"), Some(NOT_JSON))
        }
        E::UnexpectedWord => (format!("unexpected word `{found}`"), Some("text stands in double quotes")),
        E::SingleQuotedStringsNotAllowed => {
            ("single-quoted strings are not allowed".into(), Some("use double quotes: \"..\""))
        }
        E::ExpectedStringObjectProperty => {
            (format!("expected a key in double quotes, found `{found}`"), Some("keys stand in double quotes"))
        }
        E::ExpectedComma => ("expected a comma".into(), Some("members and elements are separated by commas")),
        E::UnaryPlusNumbersNotAllowed => ("a number must not begin with +".into(), Some("leave the + out")),
        E::BareDecimalPointNumbersNotAllowed => (
            "a decimal point needs digits on both sides".into(),
            Some("write 0.5 instead of .5, and 5.0 instead of 5."),
        ),
        E::HexadecimalNumbersNotAllowed => ("hexadecimal numbers are not allowed".into(), Some("write it in decimal")),
        E::NestingDepthExceeded => ("nested too deeply".into(), Some("a scene needs no more than ten levels")),
        E::MultipleRootJsonValues => {
            ("the text goes on after the scene's end".into(), Some("a scene is one object in braces"))
        }
        E::UnterminatedObject => ("this `{` is never closed".into(), None),
        E::UnterminatedArray => ("this `[` is never closed".into(), None),
        other => (lower_first(&other.to_string()), None),
    };
    Problem {
        pointer: String::new(),
        message: format!("syntax error: {message}"),
        hint: hint.map(str::to_owned),
        span: Some(range.start + shift..range.end + shift),
    }
}

fn lower_first(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or_else(String::new, |c| c.to_lowercase().chain(chars).collect())
}

/// Converts a syntax tree; its depth is bounded by the parser.
fn from_ast(value: ast::Value<'_>, shift: usize) -> Node {
    let range = value.range();
    let origin = Origin::Text(range.start + shift..range.end + shift);
    let kind = match value {
        ast::Value::NullKeyword(_) => Kind::Null,
        ast::Value::BooleanLit(literal) => Kind::Bool(literal.value),
        ast::Value::StringLit(literal) => Kind::String(literal.value.into_owned()),
        ast::Value::NumberLit(literal) => Kind::Number(Lexeme {
            text: literal.value.to_owned(),
            // The grammar of JSON numbers is a part of Rust's; should that ever end, the checks refuse the NaN.
            value: literal.value.parse().unwrap_or(f64::NAN),
        }),
        ast::Value::Array(array) => Kind::Array(array.elements.into_iter().map(|e| from_ast(e, shift)).collect()),
        ast::Value::Object(object) => Kind::Object(
            object
                .properties
                .into_iter()
                .map(|property| {
                    let key = property.name.range();
                    Member {
                        key_origin: Origin::Text(key.start + shift..key.end + shift),
                        key: property.name.into_string(),
                        value: from_ast(property.value, shift),
                    }
                })
                .collect(),
        ),
    };
    Node { origin, kind }
}

impl Node {
    /// A value from memory or a setting. Depth is bounded by serde_json where it was parsed.
    pub fn from_value(value: &Value, origin: &Origin) -> Self {
        let kind = match value {
            Value::Null => Kind::Null,
            Value::Bool(b) => Kind::Bool(*b),
            Value::Number(n) => Kind::Number(Lexeme { text: n.to_string(), value: n.as_f64().unwrap_or(f64::NAN) }),
            Value::String(s) => Kind::String(s.clone()),
            Value::Array(elements) => Kind::Array(elements.iter().map(|e| Self::from_value(e, origin)).collect()),
            Value::Object(members) => Kind::Object(
                members
                    .iter()
                    .map(|(key, value)| Member {
                        key: key.clone(),
                        key_origin: origin.clone(),
                        value: Self::from_value(value, origin),
                    })
                    .collect(),
            ),
        };
        Self { origin: origin.clone(), kind }
    }

    /// The plain value. Integral numbers become integers, so that `1e3` and `1000.0` are a count like `1000`.
    pub fn to_value(&self) -> Value {
        match &self.kind {
            Kind::Null => Value::Null,
            Kind::Bool(b) => Value::Bool(*b),
            Kind::Number(number) => number.to_value(),
            Kind::String(s) => Value::String(s.clone()),
            Kind::Array(elements) => Value::Array(elements.iter().map(Self::to_value).collect()),
            Kind::Object(members) => {
                let mut map = Map::with_capacity(members.len());
                for member in members {
                    map.insert(member.key.clone(), member.value.to_value());
                }
                Value::Object(map)
            }
        }
    }

    /// The member of an object with this key, the first of several.
    pub fn member(&self, key: &str) -> Option<&Self> {
        match &self.kind {
            Kind::Object(members) => members.iter().find(|m| m.key == key).map(|m| &m.value),
            _ => None,
        }
    }

    /// The value at a pointer, or its nearest ancestor that exists.
    pub fn nearest(&self, pointer: &str) -> &Self {
        let mut node = self;
        for token in tokens(pointer) {
            let next = match &node.kind {
                Kind::Object(_) => node.member(&token),
                Kind::Array(elements) => token.parse::<usize>().ok().and_then(|k| elements.get(k)),
                _ => None,
            };
            match next {
                Some(next) => node = next,
                None => break,
            }
        }
        node
    }
}

impl Kind {
    /// The JSON type, with an article.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Null => "null",
            Self::Bool(_) => "a boolean",
            Self::Number(_) => "a number",
            Self::String(_) => "a string",
            Self::Array(_) => "an array",
            Self::Object(_) => "an object",
        }
    }

    /// The value in a few words.
    pub fn describe(&self) -> String {
        const LONGEST: usize = 40;
        match self {
            Self::Bool(b) => b.to_string(),
            Self::Number(number) => shorten(&number.text, LONGEST),
            Self::String(s) => format!("the string {}", Value::String(shorten(s, LONGEST))),
            Self::Array(elements) => format!("an array of {}", elements.len()),
            other => other.name().to_owned(),
        }
    }
}

fn shorten(text: &str, longest: usize) -> String {
    match text.char_indices().nth(longest) {
        Some((end, _)) => format!("{}..", &text[..end]),
        None => text.to_owned(),
    }
}

impl Lexeme {
    /// Whether this is an integer, however it is written.
    pub fn is_integer(&self) -> bool {
        self.value.is_finite() && self.value.trunc() == self.value
    }

    /// Whether a number other than zero was written that a double cannot tell from zero.
    pub fn underflows(&self) -> bool {
        let mantissa = self.text.split(['e', 'E']).next().unwrap_or_default();
        self.value == 0.0 && mantissa.contains(|c: char| ('1'..='9').contains(&c))
    }

    fn to_value(&self) -> Value {
        // Beyond 2^53 a double may stand for several integers: only an exact text is one.
        const EXACT: f64 = 9_007_199_254_740_992.0;
        if let Ok(n) = self.text.parse::<u64>() {
            return Value::Number(n.into());
        }
        if self.is_integer() && self.value.abs() < EXACT && !(self.value == 0.0 && self.value.is_sign_negative()) {
            return Value::Number((self.value as i64).into());
        }
        Number::from_f64(self.value).map_or(Value::Null, Value::Number)
    }
}

/// A token of a JSON pointer, escaped.
pub(super) fn escape(key: &str) -> String {
    key.replace('~', "~0").replace('/', "~1")
}

/// The tokens of a JSON pointer, unescaped.
pub(super) fn tokens(pointer: &str) -> impl Iterator<Item = String> + '_ {
    pointer.split('/').skip(1).map(|token| token.replace("~1", "/").replace("~0", "~"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_value() {
        for (text, expected) in [
            ("1e3", "1000"),
            ("5.0", "5"),
            ("-0.0", "-0.0"),
            ("0.1", "0.1"),
            ("9007199254740993", "9007199254740993"),
            ("1e300", "1e+300"),
        ] {
            let node = parse(text).unwrap();
            assert_eq!(node.to_value().to_string(), expected, "{text}");
        }
    }

    #[test]
    fn depth_is_bounded() {
        for (open, close) in [("[", "]"), ("{\"a\":", "}")] {
            let text = format!("{}1{}", open.repeat(100_000), close.repeat(100_000));
            assert!(parse(&text).unwrap_err().message.contains("nested too deeply"));
        }
    }

    #[test]
    fn spans_count_the_byte_order_mark() {
        let text = "\u{feff}{\"a\": 17}";
        let Kind::Object(members) = parse(text).unwrap().kind else { panic!("an object") };
        let Origin::Text(span) = members[0].value.origin.clone() else { panic!("a span") };
        assert_eq!(&text[span], "17");
    }

    #[test]
    fn underflow_is_seen() {
        let lexeme = |text: &str| Lexeme { text: text.into(), value: text.parse().unwrap() };
        assert!(lexeme("1e-999").underflows());
        assert!(!lexeme("0.0e5").underflows());
        assert!(!lexeme("5e-324").underflows());
    }
}
