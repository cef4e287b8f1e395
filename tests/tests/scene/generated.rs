//! Every shipped scene, broken at every pointer in every way: refused at the right pointer, or right after all.

use agglo_core::scene::{Scene, check_value, line_column};
use serde_json::{Map, Value, json};

use crate::shipped_scenes;

/// What a mutation must lead to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// A problem at this very pointer, or below it.
    Refused,
    /// A problem at the parent of this pointer, whose message names the key.
    Missing,
    /// A problem at this pointer that calls its key unknown.
    Unknown,
    /// Depends on the place, such as 1e300 where any finite number is allowed: no more than no panic, and a problem that
    /// points at a part of the scene, if there is one.
    Either,
}

/// A scene with one thing changed.
pub struct Mutation {
    pub what: String,
    pub pointer: String,
    pub scene: Value,
    pub verdict: Verdict,
}

/// Keys that may be left out.
const OPTIONAL: [&str; 39] = [
    "format",
    "name",
    "description",
    "model",
    "seed",
    "near_field",
    "binding",
    "contact",
    "thermal",
    "clusters",
    "external",
    "domain",
    "solver",
    "record",
    "temperature",
    "velocity_mean",
    "velocity_spread",
    "charge",
    "velocity",
    "weight",
    "cutoff",
    "attraction",
    "repulsion",
    "e_min",
    "v_star",
    "theta_star",
    "friction",
    "duration",
    "rest_speed",
    "radiation",
    "convection",
    "reaction",
    "gravity",
    "periodic",
    "walls",
    "integrator",
    "step",
    "tolerance",
    "max_iterations",
];

fn pointers(value: &Value, at: &str, found: &mut Vec<String>) {
    if !at.is_empty() {
        found.push(at.to_owned());
    }
    match value {
        Value::Object(members) => members.iter().for_each(|(key, v)| pointers(v, &format!("{at}/{key}"), found)),
        Value::Array(elements) => {
            elements.iter().enumerate().for_each(|(k, v)| pointers(v, &format!("{at}/{k}"), found))
        }
        _ => {}
    }
}

fn split(pointer: &str) -> (&str, &str) {
    pointer.rsplit_once('/').expect("a pointer")
}

/// All mutations of a scene, always in the same order.
pub fn mutations(scene: &Value) -> Vec<Mutation> {
    let mut all = Vec::new();
    let mut found = Vec::new();
    pointers(scene, "", &mut found);
    for pointer in found {
        let old = scene.pointer(&pointer).expect("a pointer of the scene");
        let (parent, key) = split(&pointer);
        let mut push = |what: &str, verdict, pointer: &str, change: &dyn Fn(&mut Value)| {
            let mut scene = scene.clone();
            change(&mut scene);
            all.push(Mutation { what: format!("{pointer} {what}"), pointer: pointer.to_owned(), scene, verdict });
        };
        let replace = |value: Value| {
            let pointer = pointer.clone();
            move |scene: &mut Value| *scene.pointer_mut(&pointer).expect("the pointer") = value.clone()
        };
        // Wrong types. No value of a scene is a boolean; an object never stands for an array or a scalar.
        push("a boolean", Verdict::Refused, &pointer, &replace(json!(true)));
        push(
            "null",
            if parent == "/domain/periodic" { Verdict::Either } else { Verdict::Refused },
            &pointer,
            &replace(Value::Null),
        );
        push("an array of arrays", Verdict::Refused, &pointer, &replace(json!([[[]]])));
        push("an odd object", Verdict::Refused, &pointer, &replace(json!({"odd": {}})));
        match old {
            Value::Number(_) => {
                push("a quoted number", Verdict::Refused, &pointer, &replace(json!("1 um")));
                for extreme in
                    [json!(-1), json!(0), json!(-1e300), json!(1e300), json!(1e-300), json!(0.5), json!(u64::MAX)]
                {
                    push(&format!("= {extreme}"), Verdict::Either, &pointer, &replace(extreme));
                }
            }
            Value::String(text) if ["name", "description"].contains(&key) => {
                push("another text", Verdict::Either, &pointer, &replace(json!(format!("{text}\u{0}\"\\\u{1F600}"))));
                push("a number", Verdict::Refused, &pointer, &replace(json!(5)));
            }
            Value::String(text) => {
                push("a misspelt name", Verdict::Refused, &pointer, &replace(json!(format!("{text}x"))));
                push("an empty name", Verdict::Refused, &pointer, &replace(json!("")));
            }
            Value::Object(_) => {
                push(
                    "a number",
                    if key == "restitution" { Verdict::Either } else { Verdict::Refused },
                    &pointer,
                    &replace(json!(7)),
                );
                let below = format!("{pointer}/zzyzx");
                push("a key more", Verdict::Unknown, &below, &|scene| {
                    scene
                        .pointer_mut(&pointer)
                        .and_then(Value::as_object_mut)
                        .expect("an object")
                        .insert("zzyzx".into(), json!(1));
                });
            }
            Value::Array(elements) => {
                push(
                    "a number",
                    if key == "charge" { Verdict::Either } else { Verdict::Refused },
                    &pointer,
                    &replace(json!(7)),
                );
                push(
                    "empty",
                    if key == "walls" { Verdict::Either } else { Verdict::Refused },
                    &pointer,
                    &replace(json!([])),
                );
                let mut longer = elements.clone();
                longer.push(elements[0].clone());
                let open = ["list", "walls", "charge"].contains(&key);
                push(
                    "one longer",
                    if open { Verdict::Either } else { Verdict::Refused },
                    &pointer,
                    &replace(longer.into()),
                );
            }
            _ => {}
        }
        if scene.pointer(parent).is_some_and(Value::is_object) || parent.is_empty() {
            let remove = |scene: &mut Value| -> Option<Value> {
                let members = if parent.is_empty() { Some(scene) } else { scene.pointer_mut(parent) };
                members.and_then(Value::as_object_mut)?.shift_remove(key)
            };
            let top_duration = pointer == "/duration";
            let optional =
                OPTIONAL.contains(&key) && !top_duration || parent.starts_with("/solver") || parent == "/record";
            push("deleted", if optional { Verdict::Either } else { Verdict::Missing }, &pointer, &|scene| {
                drop(remove(scene))
            });
            let misspelt = format!("{parent}/{key}qq");
            push("misspelt", Verdict::Unknown, &misspelt, &|scene| {
                let value = remove(scene).expect("the value");
                let members = if parent.is_empty() { Some(scene) } else { scene.pointer_mut(parent) };
                members.and_then(Value::as_object_mut).expect("an object").insert(format!("{key}qq"), value);
            });
        }
    }
    all.push(Mutation {
        what: "a key more".into(),
        pointer: "/zzyzx".into(),
        scene: {
            let mut members: Map<String, Value> = scene.as_object().expect("an object").clone();
            members.insert("zzyzx".into(), Value::Null);
            members.into()
        },
        verdict: Verdict::Unknown,
    });
    all
}

#[test]
fn broken_at_every_pointer_every_scene_is_refused_at_that_pointer() {
    let mut tried = 0;
    for (name, text) in shipped_scenes() {
        let scene: Value = serde_json::from_str(&text).unwrap();
        for Mutation { what, pointer, scene, verdict } in mutations(&scene) {
            tried += 1;
            let text = serde_json::to_string_pretty(&scene).unwrap();
            let problems = Scene::parse(&text, &[]).err().unwrap_or_default();
            let (parent, key) = split(&pointer);
            let hit = match verdict {
                Verdict::Refused => problems.iter().any(|p| {
                    p.pointer == pointer || p.pointer.strip_prefix(&pointer).is_some_and(|rest| rest.starts_with('/'))
                }),
                Verdict::Missing => problems.iter().any(|p| {
                    p.pointer == parent
                        && (p.to_string().contains(&format!("\"{key}\"")) || p.message.contains("neither"))
                }),
                Verdict::Unknown => problems.iter().any(|p| p.pointer == pointer && p.message.contains("unknown key")),
                Verdict::Either => true,
            };
            assert!(hit, "{name}: {what}: {problems:?}");
            let structural = !check_value(&scene).is_empty();
            for problem in problems {
                // A value that is wrong by itself makes no problem elsewhere: at most its parent lacks a key.
                let near = problem.pointer == parent || problem.pointer.starts_with(&pointer);
                assert!(near || !structural, "{name}: {what}: {problem}");
                // Whatever is found, it stands somewhere in the text.
                let span = problem.span.clone().unwrap_or_else(|| panic!("{name}: {what}: no place for {problem}"));
                assert!(text.get(span.clone()).is_some_and(|part| !part.is_empty()), "{name}: {what}: {problem}");
                let (line, column) = line_column(&text, span.start);
                assert!(line <= text.lines().count() && column > 0);
            }
        }
    }
    assert!(tried > 5000, "{tried}");
}

/// Texts cut off at every byte and with every byte changed: an error or a scene, never a panic.
#[test]
fn damaged_texts_never_panic() {
    let (_, text) = shipped_scenes().swap_remove(0);
    for end in 0..text.len() {
        if let Some(part) = text.get(..end) {
            let problems = Scene::parse(part, &[]).err().unwrap_or_default();
            assert!(!problems.is_empty() || part.trim_end() == text.trim_end(), "cut at {end}");
        }
    }
    for at in 0..text.len() {
        for with in [b'"', b'{', b'}', b'[', b',', b'\\', b'-', b'9', b'e', 0] {
            let mut bytes = text.clone().into_bytes();
            bytes[at] = with;
            let Ok(damaged) = String::from_utf8(bytes) else { continue };
            for problem in Scene::parse(&damaged, &[]).err().unwrap_or_default() {
                assert!(damaged.get(problem.span.unwrap_or(0..0)).is_some(), "{} at {at}", problem.message);
            }
        }
    }
}
