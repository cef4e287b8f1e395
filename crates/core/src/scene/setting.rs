//! Values given beside a scene's text: `--set POINTER=VALUE`.

use serde_json::Value;

use super::Problem;
use super::tree::{Kind, Member, Node, Origin, escape, tokens};
use super::words::nearest;

/// Deepest pointer of a setting; a scene has fewer levels.
const MAX_DEPTH: usize = 32;

/// A value given beside the scene's text, `--set POINTER=VALUE` on the command line.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// JSON pointer of the value that is set, such as `/solver/step/initial`.
    pub pointer: String,
    /// The value.
    pub value: Value,
}

impl Setting {
    /// Reads `POINTER=VALUE`: the pointer as `/solver/step/initial` or `solver.step.initial`, the value as JSON or,
    /// where it is none, as a string.
    ///
    /// # Errors
    /// A text without `=`, an empty pointer or one with an empty or too many parts.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let wrong = |what: &str| {
            Err(Problem::new("", format!("`--set {text}`: {what}"))
                .hint("write `--set /solver/step/initial=1e-3` or `--set solver.step.initial=1e-3`"))
        };
        let Some((pointer, value)) = text.split_once('=') else { return wrong("there is no `=`") };
        let pointer = pointer.trim();
        let pointer = if pointer.is_empty() || pointer == "/" {
            return wrong("there is no key before the `=`");
        } else if pointer.starts_with('/') {
            pointer.to_owned()
        } else {
            pointer.split('.').map(|token| format!("/{}", escape(token))).collect()
        };
        if tokens(&pointer).any(|token| token.is_empty()) {
            return wrong("a key is empty");
        }
        if tokens(&pointer).count() > MAX_DEPTH {
            return wrong("there are too many keys");
        }
        let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
        Ok(Self { pointer, value })
    }

    /// Puts the value, which came with setting number `index`, into the tree; missing objects on the way are made. `null`
    /// removes a key; only the elements of arrays have it as a value.
    pub(super) fn apply(&self, index: usize, root: &mut Node) -> Result<(), Problem> {
        let origin = Origin::Setting(index);
        let wrong = |what: String| Err(Problem::new(self.pointer.clone(), format!("{self}: {what}")));
        if !self.pointer.starts_with('/') || tokens(&self.pointer).count() > MAX_DEPTH {
            return wrong("this is not a JSON pointer of a scene".into());
        }
        if self.value == Value::Null && self.remove(root)? {
            return Ok(());
        }
        let mut node = root;
        let mut walked = String::new();
        for token in tokens(&self.pointer) {
            let parent = if walked.is_empty() { "the scene".to_owned() } else { format!("`{walked}`") };
            node = match &mut node.kind {
                Kind::Object(members) => {
                    let at = members.iter().position(|m| m.key == token).unwrap_or_else(|| {
                        members.push(Member {
                            key: token.clone(),
                            key_origin: origin.clone(),
                            value: Node { origin: origin.clone(), kind: Kind::Object(Vec::new()) },
                        });
                        members.len() - 1
                    });
                    &mut members[at].value
                }
                Kind::Array(elements) => {
                    let count = elements.len();
                    match token.parse::<usize>().ok().and_then(|k| elements.get_mut(k)) {
                        Some(element) => element,
                        None if count == 0 => return wrong(format!("{parent} is an empty array")),
                        None => {
                            return wrong(format!(
                                "{parent} is an array, whose elements are 0 to {}, not \"{token}\"",
                                count - 1
                            ));
                        }
                    }
                }
                kind => return wrong(format!("{parent} is {}, which has no members", kind.name())),
            };
            walked = format!("{walked}/{}", escape(&token));
        }
        *node = Node::from_value(&self.value, &origin);
        Ok(())
    }

    /// Removes the key at the pointer; false where no object is to hold it, which is told as for any other value.
    fn remove(&self, root: &mut Node) -> Result<bool, Problem> {
        let mut tokens: Vec<String> = tokens(&self.pointer).collect();
        let Some(key) = tokens.pop() else { return Ok(false) };
        let mut node = root;
        for token in tokens {
            let next = match &mut node.kind {
                Kind::Object(members) => members.iter_mut().find(|m| m.key == token).map(|m| &mut m.value),
                Kind::Array(elements) => token.parse::<usize>().ok().and_then(|k| elements.get_mut(k)),
                _ => return Ok(false),
            };
            match next {
                Some(next) => node = next,
                None => return Err(self.nothing_to_remove(&token, &[])),
            }
        }
        let Kind::Object(members) = &mut node.kind else { return Ok(false) };
        let keys: Vec<String> = members.iter().map(|m| m.key.clone()).collect();
        members.retain(|m| m.key != key);
        if members.len() < keys.len() { Ok(true) } else { Err(self.nothing_to_remove(&key, &keys)) }
    }

    /// Nothing there: rather a misspelt key than nothing to do.
    fn nothing_to_remove(&self, key: &str, keys: &[String]) -> Problem {
        let problem = Problem::new(self.pointer.clone(), format!("{self}: there is no key \"{key}\" to remove"));
        let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
        match nearest(key, &keys) {
            Some(meant) => problem.hint(format!("did you mean \"{meant}\"?")),
            None => problem.hint("null removes a key of the scene"),
        }
    }
}

impl std::fmt::Display for Setting {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`--set {}={}`", self.pointer, self.value)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tree::parse;
    use super::*;

    #[test]
    fn both_notations_mean_the_same() {
        let a = Setting::parse("/solver/step/initial=1e-3").unwrap();
        assert_eq!(a, Setting::parse("solver.step.initial=1e-3").unwrap());
        assert_eq!(a.pointer, "/solver/step/initial");
        assert_eq!(a.value, serde_json::json!(1e-3));
    }

    #[test]
    fn a_value_that_is_not_json_is_a_string() {
        assert_eq!(Setting::parse("model=paper").unwrap().value, serde_json::json!("paper"));
        assert_eq!(Setting::parse("name=a=b").unwrap().value, serde_json::json!("a=b"));
    }

    #[test]
    fn malformed_settings_are_refused() {
        for text in ["duration", "=5", "/=5", "a..b=5", "/a//b=5", &format!("{}=1", "a.".repeat(40) + "a")] {
            assert!(Setting::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn settings_replace_make_and_index() {
        let mut root = parse(r#"{"a": [1, {"b": 2}], "c": 3}"#).unwrap();
        for (k, text) in ["a.1.b=5", "/d/e=[7]", "c=x", "a.0=null"].iter().enumerate() {
            Setting::parse(text).unwrap().apply(k, &mut root).unwrap();
        }
        let expected = serde_json::json!({"a": [null, {"b": 5}], "c": "x", "d": {"e": [7]}});
        assert_eq!(root.to_value(), expected);
        for text in ["c.d=1", "a.2=1", "a.x=1"] {
            assert!(Setting::parse(text).unwrap().apply(9, &mut root).is_err(), "{text}");
        }
    }

    #[test]
    fn null_removes_a_key_and_is_a_value_in_an_array() {
        let mut root = parse(r#"{"a": [1, {"b": 2, "keep": 3}], "c": {"d": 4}, "e": 5}"#).unwrap();
        for text in ["a.0=null", "a.1.b=null", "c.d=null", "e=null"] {
            Setting::parse(text).unwrap().apply(0, &mut root).unwrap();
        }
        assert_eq!(root.to_value(), serde_json::json!({"a": [null, {"keep": 3}], "c": {}}));
        for (text, says) in [
            ("a.1.kep=null", "did you mean \"keep\"?"),
            ("f=null", "no key \"f\""),
            ("f.g=null", "no key \"f\""),
            ("a.7=null", "elements are 0 to 1"),
        ] {
            let problem = Setting::parse(text).unwrap().apply(0, &mut root).unwrap_err().to_string();
            assert!(problem.contains(says), "{text}: {problem}");
        }
        assert_eq!(root.to_value(), serde_json::json!({"a": [null, {"keep": 3}], "c": {}}), "nothing is made");
    }
}
