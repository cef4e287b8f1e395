//! The published JSON Schema is current, and a validator of others agrees with our checks.

use agglo_core::scene::{check_value, json_schema};
use serde_json::Value;

use crate::generated::mutations;
use crate::{broken_scenes, directory, shipped_scenes};

#[test]
fn the_schema_file_is_current() {
    let path = directory("schemas/scene.schema.json");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let expected = serde_json::to_string_pretty(&json_schema()).unwrap() + "\n";
    assert!(text == expected, "schemas/scene.schema.json is not what the types say");
}

#[test]
fn the_schema_is_a_schema() {
    jsonschema::meta::validate(&json_schema()).unwrap();
}

/// Our checks of single values accept and refuse exactly what a validator of others does with the published schema.
#[test]
fn another_validator_agrees() {
    let validator = jsonschema::validator_for(&json_schema()).unwrap();
    let (mut valid, mut invalid) = (0, 0);
    let mut compare = |name: &str, value: &Value| {
        let ours = check_value(value);
        assert_eq!(ours.is_empty(), validator.is_valid(value), "{name}: {ours:?}");
        if ours.is_empty() { valid += 1 } else { invalid += 1 }
    };
    for (name, text) in shipped_scenes().into_iter().chain(broken_scenes()) {
        // Broken syntax and numbers beyond doubles are no values that a validator could see.
        let strict: String = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
        if let Ok(value) = serde_json::from_str(&strict) {
            compare(&name, &value);
        }
    }
    for (name, text) in shipped_scenes() {
        for mutation in mutations(&serde_json::from_str(&text).unwrap()) {
            compare(&format!("{name}: {}", mutation.what), &mutation.scene);
        }
    }
    // Both sides of the comparison must have been exercised.
    assert!(valid > 100 && invalid > 1000, "{valid} valid, {invalid} invalid");
}
