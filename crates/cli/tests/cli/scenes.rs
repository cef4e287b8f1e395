//! Scenes given and refused.

use super::{CLOUD, Folder, PAIR, shipped};

/// The scene with one text replaced by another.
fn broken(from: &str, to: &str) -> Folder {
    assert!(PAIR.contains(from));
    Folder::with(&PAIR.replace(from, to))
}

#[test]
fn a_problem_is_shown_where_it_is() {
    let ran = broken("\"duration\": 0.2", "\"duration\": -1").agglo(&["check", "scene.json"]).code(2);
    let ran = ran.says(&["error: ", "--> scene.json:2:", "\"duration\": -1", "^^", "at: /duration"]);
    assert!(ran.stdout.is_empty());
    assert!(!ran.stderr.contains('\u{1b}'), "no colour in a pipe");
}

#[test]
fn colour_on_request() {
    let folder = broken("\"duration\": 0.2", "\"duration\": -1");
    let coloured = folder.agglo(&["check", "scene.json", "--color", "always"]).code(2);
    assert!(coloured.stderr.contains("\u{1b}["));
    let plain = folder.agglo(&["check", "scene.json", "--color", "never"]).code(2);
    assert!(!plain.stderr.contains('\u{1b}'));
    // Nothing is said by colour alone.
    let stripped = anstream::adapter::strip_str(&coloured.stderr).to_string();
    assert_eq!(stripped, plain.stderr);
}

#[test]
fn every_problem_is_an_object_in_json() {
    let folder = broken("\"duration\": 0.2, \"seed\": 7", "\"durration\": 0.2, \"seed\": -7");
    let ran = folder.agglo(&["run", "scene.json", "--errors", "json"]).code(2);
    let errors = ran.errors();
    assert!(errors.len() == 2, "unknown key, negative seed: {}", ran.stderr);
    for error in &errors {
        let keys: Vec<_> = error.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys, ["type", "file", "line", "column", "pointer", "message", "hint"]);
        assert_eq!((&error["type"], &error["file"]), (&"error".into(), &"scene.json".into()));
    }
    let unknown = errors.iter().find(|error| error["pointer"] == "/durration").expect("the unknown key");
    assert_eq!((&unknown["line"], &unknown["column"]), (&2.into(), &19.into()));
    assert!(unknown["hint"].as_str().unwrap().contains("duration"));
    assert_eq!(folder.files(), ["scene.json"]);
}

#[test]
fn problems_of_placement_name_the_pairs() {
    let folder = broken("[0.6, 0, 0]", "[0.05, 0, 0]");
    folder.agglo(&["run", "scene.json"]).code(2).says(&["overlap", "scene.json:5:"]);
    assert_eq!(folder.files(), ["scene.json"], "nothing was run, nothing is left");
}

#[test]
fn settings_change_a_scene() {
    let folder = Folder::with(PAIR);
    let check = |set: &str| folder.agglo(&["check", "scene.json", "--json", "--set", set]);
    assert_eq!(check("solver.step.fixed=1e-4").code(0).json()["steps"], 2000);
    assert_eq!(check("/solver/step/fixed=1e-4").code(0).json()["steps"], 2000);
    assert_eq!(check("name=other").code(0).json()["name"], "other");
    check("solver.step.fixed=-1").code(2).says(&["--set /solver/step/fixed=-1"]);
    check("solver.stepp.fixed=1").code(2).says(&["stepp"]);
}

#[test]
fn scenes_come_from_standard_input_too() {
    let folder = Folder::new();
    let ran = folder.agglo_reading(&["check", "-"], PAIR.as_bytes()).code(0);
    assert!(ran.text().contains("<stdin>"));
    folder.agglo_reading(&["check", "-"], b"{").code(2).says(&["<stdin>:1:"]);
    folder.agglo_reading(&["run", "-", "-q"], PAIR.as_bytes()).code(0);
    assert_eq!(folder.files(), ["stdin.mcap"]);
}

#[test]
fn a_byte_order_mark_and_comments_are_allowed() {
    let folder = Folder::with(&format!("\u{feff}// a pair\n{PAIR}"));
    folder.agglo(&["check", "scene.json"]).code(0);
    let folder = Folder::with(&format!("\u{feff}// a pair\n{}", PAIR.replace("0.2", "-1")));
    folder.agglo(&["check", "scene.json"]).code(2).says(&["scene.json:3:"]);
}

#[test]
fn terminals_are_safe_from_scenes() {
    let folder = broken("\"seed\"", "\"se\\u001b[2Jed\"");
    let ran = folder.agglo(&["check", "scene.json"]).code(2);
    assert!(!ran.stderr.contains('\u{1b}'), "{:?}", ran.stderr);
}

#[test]
fn init_lists_and_writes() {
    let folder = Folder::new();
    let list = folder.agglo(&["init"]).code(0);
    let names: Vec<_> = list.text().lines().map(|line| line.split_whitespace().next().unwrap()).collect();
    assert!(names.len() >= 16, "{names:?}");
    for name in &names {
        let ran = folder.agglo(&["init", name]).code(0);
        assert!(ran.stdout.is_empty());
        let file = format!("{name}.json");
        assert_eq!(folder.read(&file), std::fs::read(shipped(name)).unwrap());
        assert_eq!(folder.agglo(&["init", name, "-o", "-"]).code(0).stdout, folder.read(&file));
        folder.agglo(&["check", &file]).code(0);
        // Strict JSON, without comments or trailing commas.
        serde_json::from_slice::<serde_json::Value>(&folder.read(&file)).unwrap();
    }
    folder.agglo(&["init", "clustering"]).code(2).says(&["clustering.json exists", "--overwrite"]);
    folder.write("clustering.json", "mine");
    folder.agglo(&["init", "clustering", "--overwrite"]).code(0);
    assert_ne!(folder.read("clustering.json"), b"mine");
    folder.agglo(&["init", "clustring"]).code(2).says(&["did you mean `clustering`"]);
}

#[test]
fn check_says_what_the_paper_says() {
    let folder = Folder::with(CLOUD);
    let text = folder.agglo(&["check", "scene.json"]).code(0);
    for part in [
        "d_e        0.5 m (8), stable",
        "d*         1 m (12)",
        "d_a        0.1111 m (15), stable",
        "100 spheres",
        "/impacts",
    ] {
        assert!(text.text().contains(part), "{part:?} is not in: {}", text.text());
    }
    let json = folder.agglo(&["check", "scene.json", "--json"]).code(0).json();
    let pair = &json["pairs"][0];
    let near = |value: &serde_json::Value, expected: f64| {
        // Closed forms, to the round-off of a power.
        assert!((value.as_f64().unwrap() - expected).abs() <= 1e-14 * expected, "{value} {expected}");
    };
    near(&pair["d_e"]["distance"], 0.5);
    near(&pair["d_star"], 1.0);
    near(&pair["d_a"]["distance"], 0.25 / 2.25);
    assert_eq!((&json["steps"], &json["overlaps"]), (&100.into(), &0.into()));
}

#[test]
fn check_warns_of_bonds_shorter_than_contact() {
    let folder = Folder::with(&CLOUD.replace("\"strength\": 1.75", "\"strength\": 2.5"));
    folder.agglo(&["check", "scene.json"]).code(0).says(&["warning", "d_a", "rests in contact"]);
    let quiet = folder.agglo(&["-q", "check", "scene.json"]).code(0);
    assert_eq!(quiet.stderr, "");
}

#[test]
fn what_a_scene_lacks_is_not_mentioned() {
    let folder = Folder::with(PAIR);
    let check = folder.agglo(&["check", "scene.json"]).code(0);
    for absent in ["impact", "heat", "binding", "d_a", "/impacts", "/clusters", "domain", "external"] {
        assert!(!check.text().contains(absent), "{absent} is in: {}", check.text());
    }
}

#[test]
fn settings_that_are_nearly_right_say_what_was_meant() {
    let folder = Folder::with(PAIR);
    let check = |set: &str| folder.agglo(&["check", "scene.json", "--set", set]);
    check("solver.step.fixd=2").code(2).says(&["did you mean \"fixed\"?"]);
    check("durtion=2").code(2).says(&["did you mean \"duration\"?"]);
    check("durtion=null").code(2).says(&["no key \"durtion\" to remove", "did you mean \"duration\"?"]);
    check("duration=null").code(2).says(&["lacks the key \"duration\""]);
    let json = folder.agglo(&["check", "scene.json", "--json", "--set", "near_field=null"]).code(0).json();
    assert_eq!(json["terms"].get("near_field"), None, "{json}");
}

#[test]
fn hints_show_what_to_write() {
    let particles = "\"particles\": { \"list\": [ { \"position\": [0, 0, 0], \"radius\": 1, \"mass\": 1 } ] }";
    let folder = Folder::new();
    for (scene, hint) in [
        (format!("{particles}, \"external\": {{ \"gravity\": 9.81 }}"), "write [0, 0, -9.81]"),
        (format!("{particles}, \"domain\": {{ \"periodic\": 1 }}"), "write [1, 1, 1]"),
        ("\"particles\": [ { \"radius\": 1 } ]".to_owned(), "write { \"list\": [..] }"),
        ("\"particles\": { \"file\": \"p.csv\" }".to_owned(), "write { \"path\": \"p.csv\" }"),
        (format!("{particles}, \"seed\": NaN"), "NaN and Infinity are not JSON; give a number"),
        (format!("{particles}, \"seed\": -Infinity"), "NaN and Infinity are not JSON; give a number"),
    ] {
        folder.write("scene.json", format!("{{ \"duration\": 1, {scene} }}"));
        folder.agglo(&["check", "scene.json"]).code(2).says(&[hint]);
    }
}
