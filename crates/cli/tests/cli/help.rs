//! Texts that are generated from definitions.

use std::fmt::Write;
use std::path::Path;

use super::Folder;

const COMMANDS: [&str; 13] = [
    "run",
    "check",
    "init",
    "info",
    "analyze",
    "replay",
    "diff",
    "export",
    "recover",
    "study",
    "schema",
    "completions",
    "man",
];

#[test]
fn help_is_as_recorded() {
    let folder = Folder::new();
    let mut help = String::new();
    for arguments in
        [&["--help"][..]].into_iter().chain(COMMANDS.each_ref().map(|c| [*c, "--help"]).iter().map(|a| &a[..]))
    {
        _ = writeln!(help, "$ agglo {}", arguments.join(" "));
        _ = writeln!(help, "{}", folder.agglo(arguments).code(0).text());
    }
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cli/help.txt");
    if std::env::var_os("AGGLO_UPDATE").is_some() {
        std::fs::write(&golden, &help).unwrap();
    }
    let recorded = std::fs::read_to_string(&golden).unwrap();
    assert!(help == recorded, "help changed; AGGLO_UPDATE=1 records it:\n{help}");
}

#[test]
fn help_lists_every_command() {
    let help = Folder::new().agglo(&["--help"]).code(0);
    for command in COMMANDS {
        assert!(help.text().contains(&format!("\n  {command} ")), "{command}");
    }
}

#[test]
fn the_version_names_the_commit_it_was_built_from() {
    let version = Folder::new().agglo(&["--version"]).code(0);
    let text = version.text().trim_end();
    let start = concat!("agglo ", env!("CARGO_PKG_VERSION"), " (commit ");
    let commit = text.strip_prefix(start).and_then(|rest| rest.strip_suffix(')')).unwrap();
    let known = commit.len() == 12 && commit.bytes().all(|b| b.is_ascii_hexdigit());
    // A package that was unpacked outside its repository does not know.
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.git").exists();
    assert!(if repository { known } else { known || commit == "unknown" }, "{text}");
}

#[test]
fn wrong_usage_is_exit_2() {
    let folder = Folder::new();
    for arguments in [
        &[][..],
        &["fly"],
        &["run"],
        &["run", "scene.json", "--no-log", "-o", "x.mcap"],
        &["run", "scene.json", "--threads", "0"],
        &["run", "scene.json", "--threads", "100000"],
        &["run", "scene.json", "--max-log", "7 parsec"],
        &["check", "scene.json", "--set", "no-equals-sign"],
        &["export", "x.mcap", "--format", "csv", "--at", "later", "-o", "-"],
        &["export", "x.mcap", "--format", "docx", "-o", "-"],
        &["schema", "everything"],
        &["init", "-o", "x.json"],
        &["-q", "-v", "init"],
    ] {
        let ran = folder.agglo(arguments).code(2);
        assert!(ran.stdout.is_empty() && !ran.stderr.is_empty(), "{arguments:?}");
    }
    let ran = folder.agglo(&["run", "--errors", "json"]).code(2);
    assert!(ran.errors()[0]["message"].as_str().unwrap().contains("<SCENE>"), "{ran:?}");
}

#[test]
fn completions_for_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let ran = folder.agglo(&["completions", shell]).code(0);
        assert!(ran.text().contains("agglo") && ran.text().contains("overwrite"), "{shell}");
    }
}

#[test]
fn a_manual_page_for_every_command() {
    let folder = Folder::new();
    folder.agglo(&["man", "pages/here"]).code(0);
    for command in COMMANDS {
        let page = String::from_utf8(folder.read(&format!("pages/here/agglo-{command}.1"))).unwrap();
        assert!(page.contains(".SH NAME") && page.contains(&format!("agglo\\-{command}")), "{page}");
    }
    folder.read("pages/here/agglo.1");
    folder.agglo(&["man", "pages/here"]).code(2).says(&["exists", "--overwrite"]);
    folder.agglo(&["man", "pages/here", "--overwrite"]).code(0);
}

#[test]
fn schemas_are_what_the_repository_holds() {
    let folder = Folder::new();
    let schema = folder.agglo(&["schema"]).code(0);
    assert_eq!(schema.json()["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(folder.agglo(&["schema", "scene"]).code(0).stdout, schema.stdout);
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../schemas");
    assert_eq!(schema.text(), std::fs::read_to_string(repository.join("scene.schema.json")).unwrap());
    let messages = folder.agglo(&["schema", "messages"]).code(0);
    for name in ["ParticleStatic", "StepDiagnostics", "EnergyLedger", "Clusters", "Impacts", "Checkpoint"] {
        assert!(messages.text().contains(&format!("message {name} {{")), "{name}");
    }
}

#[test]
fn help_is_a_command_too() {
    let folder = Folder::new();
    assert_eq!(folder.agglo(&["help"]).code(0).text(), folder.agglo(&["--help"]).code(0).text());
    assert_eq!(folder.agglo(&["help", "run"]).code(0).text(), folder.agglo(&["run", "--help"]).code(0).text());
    folder.agglo(&["help", "fly"]).code(2);
}
