//! `agglo study`: its outputs, what it refuses, what a program reads of it.

use super::Folder;

/// A little work: two schemes, three steps.
const LITTLE: [&str; 9] = [
    "study",
    "scene.json",
    "--set=duration=0.5",
    "--set=solver={}",
    "--schemes=paper,velocity-verlet",
    "--steps=0.01,0.005,0.0025",
    "--repeats=1",
    "--progress=never",
    "--budget=20",
];

/// A pair in a smooth field.
const FIELD: &str = r#"{ "name": "pair", "duration": 2, "particles": { "list": [
    { "position": [0, 0, 0], "radius": 0.05, "mass": 1.5, "velocity": [0.1, 0.2, 0] },
    { "position": [0.5, 0, 0.4], "radius": 0.05, "mass": 0.5 } ] },
    "near_field": { "attraction": { "strength": 0.5, "exponent": 1 }, "repulsion": { "strength": 0.25, "exponent": 2 } } }"#;

#[test]
fn a_table_and_files() {
    let folder = Folder::with(FIELD);
    let ran = folder.agglo(&LITTLE).code(0);
    assert!(ran.text().contains("velocity-verlet") && ran.text().contains("order of paper"), "{}", ran.text());
    assert!(ran.stderr.is_empty(), "{}", ran.stderr);
    let files = [&LITTLE[..], &["--json=-", "--csv=s.csv", "--svg=s.svg", "--markdown=s.md"]].concat();
    let study = folder.agglo(&files).code(0).json();
    assert_eq!(study["measurements"].as_array().unwrap().len(), 6);
    assert_eq!((&study["whole"], &study["until"]), (&true.into(), &0.5.into()));
    let read = |name: &str| std::fs::read_to_string(folder.path(name)).unwrap();
    assert_eq!(read("s.csv").lines().count(), 7);
    assert!(read("s.svg").starts_with("<svg") && read("s.md").contains("](s.svg)"));
    folder.agglo(&files).code(2).says(&["s.csv", "--overwrite"]);
    folder.agglo(&[&files[..], &["--overwrite"]].concat()).code(0);
}

#[test]
fn progress_as_json_lines() {
    let folder = Folder::with(FIELD);
    let arguments: Vec<&str> =
        LITTLE.iter().map(|a| if *a == "--progress=never" { "--progress=json" } else { a }).collect();
    let ran = folder.agglo(&arguments).code(0);
    assert_eq!(ran.errors()[0]["type"], "progress");
}

#[test]
fn what_is_refused() {
    let folder = Folder::with(FIELD);
    folder
        .agglo(&["study", "scene.json", "--schemes=euler"])
        .code(2)
        .says(&["no scheme is called `euler`", "gauss-radau"]);
    folder.agglo(&["study", "scene.json", "--steps=0"]).code(2).says(&["above zero"]);
    folder.agglo(&["study", "scene.json", "--seeds=3"]).code(2).says(&["--seeds", "random_cube"]);
    folder.agglo(&["study", "scene.json", "--json=-", "--csv=-"]).code(2).says(&["standard output"]);
    folder.agglo(&["study", "none.json"]).code(2).says(&["none.json"]);
    // Two spheres that overlap cannot be set up; the message points into the scene.
    let set = "--set=particles.list.1.position=[0,0,0.01]";
    folder.agglo(&["study", "scene.json", set]).code(2).says(&["overlap"]);
    let nothing = [&LITTLE[..8], &["--budget=1e-9"]].concat();
    folder.agglo(&nothing).code(1).says(&["--budget"]);
}
