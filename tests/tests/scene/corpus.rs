//! Every scene in `broken/` is refused with exactly the problems that its first lines expect.
//!
//! A line `// expect: POINTER | part of the message or hint | LINE:COLUMN` stands for one problem; the column counts
//! characters, and the place is `-` for a problem of the whole text. `// set: POINTER=VALUE` is a setting.

use agglo_core::placement::place;
use agglo_core::scene::{Problem, Scene, Setting, line_column, locate};

use crate::{broken_scenes, directory};

struct Expected<'a> {
    pointer: &'a str,
    part: &'a str,
    at: &'a str,
}

fn expectations(text: &str) -> Vec<Expected<'_>> {
    let lines = text.lines().filter_map(|line| line.trim_start_matches('\u{feff}').strip_prefix("// expect: "));
    lines
        .map(|line| {
            let parts: Vec<&str> = line.split(" | ").map(str::trim).collect();
            let [pointer, part, at] = parts[..] else { panic!("three parts, not `{line}`") };
            Expected { pointer: if pointer == "-" { "" } else { pointer }, part, at }
        })
        .collect()
}

pub fn settings(text: &str) -> Vec<Setting> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("// set: "));
    lines.map(|line| Setting::parse(line).expect("a setting")).collect()
}

/// All problems of a text, those of placing the particles included.
fn problems(text: &str, settings: &[Setting]) -> Vec<Problem> {
    match Scene::parse(text, settings) {
        Err(problems) => problems,
        Ok(scene) => match place(&scene) {
            Err(error) => {
                let mut problems = error.problems;
                locate(&mut problems, text, settings);
                problems
            }
            Ok(_) => Vec::new(),
        },
    }
}

#[test]
fn every_broken_scene_says_what_is_wrong() {
    let mut failures = String::new();
    let scenes = broken_scenes();
    for (name, text) in &scenes {
        let mut found = problems(text, &settings(text));
        let listing: String = found
            .iter()
            .map(|p| {
                let at = p.span.as_ref().map_or((0, 0), |span| line_column(text, span.start));
                format!("\n    {}:{} {p}", at.0, at.1)
            })
            .collect();
        let expected = expectations(text);
        assert!(!expected.is_empty(), "{name} expects nothing");
        for Expected { pointer, part, at } in expected {
            let hit = found.iter().position(|p| {
                let place = p.span.as_ref().map(|span| line_column(text, span.start));
                let place = place.map_or("-".to_owned(), |(line, column)| format!("{line}:{column}"));
                p.pointer == pointer && p.to_string().contains(part) && place == at
            });
            match hit {
                Some(k) => drop(found.remove(k)),
                None => failures += &format!("\n{name}: nothing like `{pointer} | {part} | {at}` in:{listing}"),
            }
        }
        for extra in found {
            failures += &format!("\n{name}: unexpected {extra}");
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// The corpus must go on covering every kind of mistake.
#[test]
fn the_corpus_covers_every_kind() {
    let scenes = broken_scenes();
    assert!(scenes.len() >= 60, "{} scenes", scenes.len());
    for kind in ["syntax", "type", "range", "key", "missing", "cross", "geometry", "set"] {
        let count = scenes.iter().filter(|(name, _)| name.starts_with(kind)).count();
        assert!(count >= 3, "{count} scenes of kind {kind} in {}", directory("tests/broken").display());
    }
}

/// Messages name no Rust type and no serde jargon, begin without a capital, and end without a full stop.
#[test]
fn messages_are_for_users() {
    for (name, text) in broken_scenes() {
        for problem in problems(&text, &settings(&text)) {
            let message = &problem.message;
            for jargon in ["f64", "u32", "u64", "Option", "untagged", "serde", "invalid type", "expected struct"] {
                assert!(!message.contains(jargon), "{name}: {message}");
            }
            assert!(!message.ends_with('.') && !message.is_empty(), "{name}: {message}");
            assert!(
                !message.starts_with(|c: char| c.is_uppercase()) || message.starts_with("Newton"),
                "{name}: {message}"
            );
        }
    }
}
