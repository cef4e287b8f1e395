//! Every command in the README, run in its order in a folder that holds the shipped scenes.

use super::Folder;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn read(name: &str) -> String {
    std::fs::read_to_string(root().join(name)).unwrap()
}

/// Lines of the README's `sh` blocks.
fn commands() -> Vec<String> {
    let mut inside = false;
    let mut commands = Vec::new();
    for line in read("README.md").lines() {
        match line {
            "```sh" => inside = true,
            "```" => inside = false,
            command if inside => commands.push(command.to_owned()),
            _ => {}
        }
    }
    commands
}

#[test]
fn commands_do_what_the_readme_says() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("scenes")).unwrap();
    for entry in std::fs::read_dir(root().join("scenes")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, folder.path("scenes").join(path.file_name().unwrap())).unwrap();
    }
    let program = Path::new(env!("CARGO_BIN_EXE_agglo")).parent().unwrap();
    let path = std::env::join_paths(
        std::iter::once(program.to_owned()).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    )
    .unwrap();
    let mut run = 0;
    for command in commands() {
        if command == "cargo test --workspace" {
            continue; // This is a part of it; the test below holds CI to it.
        }
        let command = command.replace("cargo run --release -- ", "agglo ");
        assert!(command.starts_with("agglo "), "a command of another kind: {command}");
        let output = std::process::Command::new("sh")
            .args(["-c", &command])
            .current_dir(folder.path("."))
            .env("PATH", &path)
            .output()
            .unwrap();
        assert!(output.status.success(), "{command}: {}", String::from_utf8_lossy(&output.stderr));
        run += 1;
    }
    assert!(run >= 6, "only {run} commands were found");
    let files = folder.files();
    for made in
        ["clustering.mcap", "end.csv", "oscillator.json", "oscillator.mcap", "scene.schema.json", "summary.json"]
    {
        assert!(files.iter().any(|file| file == made), "{made} is not among {files:?}");
    }
}

#[test]
fn ci_runs_the_readmes_tests() {
    assert!(commands().iter().any(|command| command == "cargo test --workspace"));
    assert!(read(".ci/run").lines().any(|line| line == "cargo xtask ci"));
    assert!(read("xtask/src/checks.rs").contains(r#"Check::Cargo(&["test", "--workspace", "--locked""#));
}

#[test]
fn pages_that_the_readme_points_to_exist() {
    let readme = read("README.md");
    for target in readme.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
        if !target.starts_with("http") {
            assert!(root().join(target).exists(), "{target} does not exist");
        }
    }
}
