//! The JSON Schema of scene files, generated from the types.

use std::sync::OnceLock;

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use serde_json::Value;

use super::Scene;

/// The schema, made once.
pub(super) fn schema() -> &'static Value {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    SCHEMA.get_or_init(|| {
        let settings = SchemaSettings::draft2020_12().with_transform(RecursiveTransform(forbid_null));
        let mut schema = settings.into_generator().into_root_schema_for::<Scene>();
        schema.insert("title".into(), "agglo scene".into());
        schema.to_value()
    })
}

/// An effect is absent where its key is absent; `null` is no second way to say so.
fn forbid_null(schema: &mut Schema) {
    let Some(properties) = schema.get_mut("properties").and_then(Value::as_object_mut) else { return };
    for property in properties.values_mut().filter_map(Value::as_object_mut) {
        if let Some(Value::Array(types)) = property.get_mut("type") {
            types.retain(|t| t != "null");
            if let [only] = types.as_slice() {
                let only = only.clone();
                property.insert("type".into(), only);
            }
        }
        let Some(Value::Array(branches)) = property.get_mut("anyOf") else { continue };
        branches.retain(|branch| branch.get("type").is_none_or(|t| t != "null"));
        if let [Value::Object(only)] = branches.as_slice() {
            let only = only.clone();
            property.shift_remove("anyOf");
            for (key, value) in only {
                property.entry(key).or_insert(value);
            }
        }
    }
}

/// The JSON Schema of scene files, generated from the types.
#[must_use]
pub fn json_schema() -> Value {
    schema().clone()
}

/// Follows a `$ref` to the schema it names; other schemas are returned as they are.
pub(super) fn resolve<'a>(root: &'a Value, schema: &'a Value) -> &'a Value {
    let mut schema = schema;
    while let Some(target) = schema.get("$ref").and_then(Value::as_str) {
        match target.strip_prefix("#/$defs/").and_then(|name| root.get("$defs")?.get(name)) {
            Some(next) => schema = next,
            None => break,
        }
    }
    schema
}

/// Pointers of all objects of a scene that have a key of this name.
pub(super) fn homes(root: &Value, key: &str) -> Vec<String> {
    fn walk(root: &Value, schema: &Value, key: &str, pointer: &str, depth: usize, found: &mut Vec<String>) {
        let schema = resolve(root, schema);
        // The format has no recursive type; the bound only says so to the machine.
        if depth > 16 {
            return;
        }
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            for (name, property) in properties {
                if name == key && !found.iter().any(|f| f == pointer) {
                    found.push(pointer.to_owned());
                }
                walk(root, property, key, &format!("{pointer}/{name}"), depth + 1, found);
            }
        }
        for branches in ["oneOf", "anyOf"] {
            for branch in schema.get(branches).and_then(Value::as_array).into_iter().flatten() {
                walk(root, branch, key, pointer, depth + 1, found);
            }
        }
        if let Some(items) = schema.get("items") {
            walk(root, items, key, &format!("{pointer}/0"), depth + 1, found);
        }
    }
    let mut found = Vec::new();
    walk(root, root, key, "", 0, &mut found);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every keyword that a schema may have must be one that the checks know, or an annotation.
    #[test]
    fn no_keyword_goes_unchecked() {
        const CHECKED: [&str; 15] = [
            "$ref",
            "oneOf",
            "anyOf",
            "const",
            "type",
            "properties",
            "required",
            "additionalProperties",
            "items",
            "minItems",
            "maxItems",
            "minLength",
            "minimum",
            "maximum",
            "exclusiveMinimum",
        ];
        const ALSO_CHECKED: [&str; 1] = ["exclusiveMaximum"];
        const ANNOTATIONS: [&str; 7] = ["$schema", "$defs", "title", "description", "default", "format", "writeOnly"];
        fn walk(schema: &Value) {
            let object = schema.as_object().expect("a schema is an object");
            for (keyword, value) in object {
                let known = CHECKED.iter().chain(&ALSO_CHECKED).chain(&ANNOTATIONS).any(|k| k == keyword);
                assert!(known, "unknown keyword {keyword} in {schema}");
                match (keyword.as_str(), value) {
                    ("properties" | "$defs", Value::Object(children)) => children.values().for_each(walk),
                    ("oneOf" | "anyOf", Value::Array(children)) => children.iter().for_each(walk),
                    ("items", child) => walk(child),
                    ("additionalProperties", flag) => assert_eq!(flag, false),
                    _ => {}
                }
            }
            if object.contains_key("$ref") {
                // Following a reference must lose no constraint that stands beside it.
                assert!(object.keys().all(|k| k == "$ref" || ANNOTATIONS.contains(&k.as_str())), "{schema}");
            }
            if object.get("type").is_some_and(|t| t == "object") {
                assert_eq!(object.get("additionalProperties"), Some(&Value::Bool(false)), "{schema}");
            }
            if object.get("type").is_some_and(|t| t == "integer") {
                assert!(object.contains_key("maximum"), "an integer needs a maximum that its type can hold: {schema}");
            }
        }
        walk(schema());
    }

    /// The one `null` of the format is an open direction of the periodic box.
    #[test]
    fn null_is_an_open_direction_only() {
        let text = schema().to_string();
        assert_eq!(text.matches("\"null\"").count(), 1);
    }

    #[test]
    fn keys_are_found_where_they_belong() {
        assert_eq!(homes(schema(), "radiation"), ["/thermal"]);
        assert_eq!(homes(schema(), "duration"), ["", "/contact"]);
        assert_eq!(homes(schema(), "nonsense"), Vec::<String>::new());
    }
}
