//! The direction of dependencies: core <- record <- replay <- study <- cli.

use std::collections::BTreeMap;
use std::process::Command;

#[test]
fn crates_depend_on_each_other_in_one_direction() {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut uses: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for package in metadata["packages"].as_array().unwrap() {
        let normal = package["dependencies"].as_array().unwrap().iter().filter(|found| found["kind"].is_null());
        uses.insert(package["name"].as_str().unwrap(), normal.map(|found| found["name"].as_str().unwrap()).collect());
    }
    let order = ["agglo-core", "agglo-record", "agglo-replay", "agglo"];
    for (k, name) in order.iter().enumerate() {
        for later in &order[k..] {
            assert!(!uses[name].contains(later), "{name} must not use {later}");
        }
    }
    for foreign in ["mcap", "prost", "csv", "clap", "indicatif", "ctrlc"] {
        assert!(!uses["agglo-core"].contains(&foreign), "the solver must not use {foreign}");
    }
}
