//! What is read and written.

use super::{CLOUD, Folder, PAIR, shipped};

#[test]
fn nothing_is_overwritten_unasked() {
    let folder = Folder::with(PAIR);
    folder.write("scene.mcap", "precious");
    folder.write("s.json", "precious");
    folder.agglo(&["run", "scene.json"]).code(2).says(&["scene.mcap exists", "--overwrite"]);
    folder.agglo(&["run", "scene.json", "-o", "new.mcap", "--summary", "s.json"]).code(2).says(&["s.json exists"]);
    assert_eq!((folder.read("scene.mcap"), folder.read("s.json")), (b"precious".to_vec(), b"precious".to_vec()));
    assert_eq!(folder.files(), ["s.json", "scene.json", "scene.mcap"]);
    folder.agglo(&["run", "scene.json", "--overwrite", "--summary", "s.json"]).code(0);
    assert_ne!(folder.read("scene.mcap"), b"precious");
    assert_ne!(folder.read("s.json"), b"precious");
    folder.agglo(&["export", "scene.mcap", "--format", "csv", "-o", "x.csv"]).code(0);
    folder.agglo(&["export", "scene.mcap", "--format", "csv", "-o", "x.csv"]).code(2).says(&["x.csv exists"]);
    folder.agglo(&["export", "scene.mcap", "--format", "csv", "-o", "x.csv", "--overwrite"]).code(0);
}

#[test]
fn scenes_that_cannot_be_read() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "missing.json"]).code(2).says(&["cannot read the scene missing.json", "agglo init"]);
    std::fs::create_dir(folder.path("folder")).unwrap();
    folder.agglo(&["run", "folder"]).code(2).says(&["folder is a folder"]);
    folder.write("latin.json", b"{\n\"name\": \"\xe9t\xe9\"}");
    folder.agglo(&["check", "latin.json"]).code(2).says(&["not UTF-8", "byte 11 (line 2) is 0xe9"]);
    folder.write("empty.json", "");
    folder.agglo(&["check", "empty.json"]).code(2).says(&["empty.json"]);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    for command in ["run", "check"] {
        folder.agglo(&[command, "scene.mcap"]).code(2).says(&["scene.mcap is a log, not a scene", "agglo info"]);
    }
    let huge = std::fs::File::create(folder.path("huge.json")).unwrap();
    huge.set_len(300 << 20).unwrap();
    folder.agglo(&["run", "huge.json"]).code(2).says(&["huge.json has 315 MB; a scene may have 268 MB"]);
    if cfg!(unix) {
        folder.agglo(&["run", "/dev/zero"]).code(2).says(&["/dev/zero is longer than 268 MB"]);
    }
    assert_eq!(folder.files().len(), 6, "{:?}", folder.files());
}

#[test]
fn errors_about_files_are_json_too() {
    let folder = Folder::new();
    let errors = folder.agglo(&["run", "missing.json", "--errors", "json"]).code(2).errors();
    assert_eq!((&errors[0]["type"], &errors[0]["file"]), (&"error".into(), &"missing.json".into()));
    assert!(errors[0]["message"].as_str().unwrap().contains("cannot read") && errors[0]["line"].is_null());
}

#[test]
fn outputs_that_cannot_be_written() {
    let folder = Folder::with(PAIR);
    std::fs::create_dir(folder.path("folder")).unwrap();
    folder.agglo(&["run", "scene.json", "-o", "folder"]).code(2).says(&["folder: it is a folder"]);
    folder.agglo(&["run", "scene.json", "-o", "folder", "--overwrite"]).code(2);
    folder.agglo(&["run", "scene.json", "-o", "nowhere/x.mcap"]).code(2).says(&["the folder nowhere does not exist"]);
    folder.agglo(&["run", "scene.json", "-o", "scene.json/x.mcap"]).code(2).says(&["cannot write scene.json/x.mcap"]);
    folder.agglo(&["run", "scene.json", "--summary", "nowhere/s.json"]).code(2);
    folder.agglo(&["run", "scene.json", "-o", "-", "--summary", "-"]).code(2).says(&["both", "standard output"]);
    folder.agglo(&["run", "scene.json", "-o", "x", "--summary", "x"]).code(2).says(&["both"]);
    folder.agglo(&["init", "clustering", "-o", "folder"]).code(2);
    folder.agglo(&["man", "scene.json"]).code(2);
    assert_eq!(folder.files(), ["folder", "scene.json"]);
}

#[cfg(unix)]
#[test]
fn a_folder_without_permission() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with(PAIR);
    std::fs::create_dir(folder.path("locked")).unwrap();
    std::fs::set_permissions(folder.path("locked"), std::fs::Permissions::from_mode(0o555)).unwrap();
    // Permissions do not bind the superuser, who is told nothing and writes.
    let may_write = std::fs::write(folder.path("locked/probe"), "").is_ok();
    let expected = if may_write { 0 } else { 2 };
    folder.agglo(&["run", "scene.json", "-o", "locked/x.mcap"]).code(expected);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_plainly() {
    let folder = Folder::with(CLOUD);
    let full =
        |arguments: &[&str]| folder.agglo(arguments).code(1).says(&["/dev/full", "No space left", "free some space"]);
    full(&["run", "scene.json", "-o", "/dev/full"]);
    full(&["init", "clustering", "-o", "/dev/full"]);
    full(&["run", "scene.json", "--no-log", "--summary", "/dev/full"]);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    full(&["export", "scene.mcap", "--format", "csv", "--at", "all", "-o", "/dev/full"]);
    // Standard output may be a full disk as well.
    let output = || std::fs::File::options().write(true).open("/dev/full").unwrap();
    for arguments in [&["schema"][..], &["run", "scene.json", "-o", "-"], &["init"], &["completions", "bash"]] {
        let ran = folder.command(arguments).stdout(output()).output().unwrap();
        assert_eq!(ran.status.code(), Some(1), "{arguments:?}: {}", String::from_utf8_lossy(&ran.stderr));
    }
    assert_eq!(folder.files(), ["scene.json", "scene.mcap"]);
}

#[cfg(unix)]
#[test]
fn what_was_written_before_the_disk_was_full_is_kept() {
    let folder = Folder::with(CLOUD);
    folder.write("x.mcap", "a good old log");
    let limited = |arguments: &str| {
        let program = env!("CARGO_BIN_EXE_agglo");
        let mut command = std::process::Command::new("sh");
        command.arg("-c").arg(format!("ulimit -f 300; exec '{program}' run scene.json {arguments}"));
        let ran: super::Ran = command.current_dir(folder.path(".")).output().unwrap().into();
        ran.code(1).says(&["cannot write", "File too large", ".incomplete"])
    };
    limited("-o x.mcap --overwrite");
    limited("-o y.mcap");
    limited("-o y.mcap");
    let files = folder.files();
    assert_eq!(files, ["scene.json", "x.incomplete.mcap", "x.mcap", "y.incomplete-2.mcap", "y.incomplete.mcap"]);
    assert_eq!(folder.read("x.mcap"), b"a good old log");
    let info = folder.agglo(&["info", "y.incomplete.mcap"]).code(3);
    assert!(info.text().contains("damaged") && info.text().contains("100 particles"), "{}", info.text());
}

#[cfg(unix)]
#[test]
fn devices_are_written_to_and_not_replaced() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-o", "/dev/null"]).code(0);
    assert_eq!(folder.files(), ["scene.json"]);
}

#[cfg(unix)]
#[test]
fn a_link_to_a_log_stays_a_link() {
    let folder = Folder::with(PAIR);
    folder.write("real.mcap", "old");
    std::os::unix::fs::symlink("real.mcap", folder.path("link.mcap")).unwrap();
    folder.agglo(&["run", "scene.json", "-o", "link.mcap"]).code(2).says(&["link.mcap exists"]);
    folder.agglo(&["run", "scene.json", "-o", "link.mcap", "--overwrite"]).code(0);
    assert!(folder.path("link.mcap").is_symlink());
    assert!(folder.read("real.mcap").len() > 1000);
}

#[cfg(unix)]
#[test]
fn files_are_readable_as_any_others() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    let mode = |name: &str| std::fs::metadata(folder.path(name)).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode("scene.mcap"), mode("scene.json"), "both follow the umask");
}

/// Runs a command whose reader goes away after a few bytes.
#[cfg(unix)]
fn with_closed_pipe(folder: &Folder, arguments: &[&str]) -> super::Ran {
    use std::io::Read;
    use std::process::Stdio;
    let mut command = folder.command(arguments);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stdout = child.stdout.take().unwrap();
    stdout.read_exact(&mut [0; 8]).unwrap();
    drop(stdout);
    child.wait_with_output().unwrap().into()
}

#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_quietly() {
    let folder = Folder::with(&PAIR.replace("\"duration\": 0.2", "\"duration\": 200"));
    let ran = with_closed_pipe(&folder, &["run", "scene.json", "-o", "-"]).code(0);
    assert_eq!(ran.stderr, "");
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    let ran = with_closed_pipe(&folder, &["export", "scene.mcap", "--format", "csv", "--at", "all", "-o", "-"]).code(0);
    assert_eq!(ran.stderr, "");
    // A standard error that nobody reads is no failure either.
    let mut command = folder.command(&["run", "scene.json", "-o", "y.mcap", "--progress", "json"]);
    let mut child = command.stderr(std::process::Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn particles_come_from_files_beside_the_scene() {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "-q"]).code(0);
    folder.agglo(&["export", "scene.mcap", "--format", "csv", "-o", "end.csv"]).code(0);
    std::fs::create_dir(folder.path("sub")).unwrap();
    let (head, tail) = CLOUD.split_once("\"particles\": ").unwrap();
    let rest = &tail[tail.find("\"near_field\"").unwrap()..];
    let from = |source: &str| format!("{head}\"particles\": {source}, {rest}");
    folder.write("sub/csv.json", from(r#"{ "file": { "path": "../end.csv" } }"#));
    folder.write("sub/log.json", from(r#"{ "log": { "path": "../scene.mcap", "time": 1 } }"#));
    for name in ["csv", "log"] {
        folder.agglo(&["run", &format!("sub/{name}.json"), "-q"]).code(0);
    }
    let strip = |name: &str| {
        folder.agglo(&["export", name, "--format", "csv", "--at", "all", "-o", "-"]).code(0).text().to_owned()
    };
    assert_eq!(strip("csv.mcap"), strip("log.mcap"), "the same state, two ways in");
    // From standard input, relative paths start at the working folder.
    folder.agglo_reading(&["check", "-"], from(r#"{ "file": { "path": "end.csv" } }"#).as_bytes()).code(0);
    for (source, says) in [
        (r#"{ "file": { "path": "missing.csv" } }"#, "missing.csv"),
        (r#"{ "log": { "path": "scene.json", "time": 0 } }"#, "scene.json"),
        (r#"{ "file": { "path": "scene.mcap" } }"#, "scene.mcap"),
        (r#"{ "file": { "path": "." } }"#, "."),
    ] {
        folder.write("bad.json", from(source));
        folder.agglo(&["check", "bad.json"]).code(2).says(&[says, "at: /particles/", "bad.json:3:"]);
    }
}

#[test]
fn the_scene_may_be_anywhere() {
    let folder = Folder::new();
    folder.agglo(&["run", shipped("two-body-oscillator").to_str().unwrap(), "-q"]).code(0);
    assert_eq!(folder.files(), ["two-body-oscillator.mcap"], "the log goes to the working folder");
}

#[test]
fn an_input_is_never_overwritten_by_its_own_output() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-o", "log.mcap", "-q"]).code(0);
    let (scene, log) = (folder.read("scene.json"), folder.read("log.mcap"));
    for arguments in [
        &["run", "scene.json", "-o", "scene.json", "--overwrite"][..],
        &["run", "scene.json", "--no-log", "--summary", "./scene.json", "--overwrite"],
        &["export", "log.mcap", "--format", "csv", "-o", "log.mcap", "--overwrite"],
    ] {
        folder.agglo(arguments).code(2).says(&["over its own input"]);
    }
    assert!(scene == folder.read("scene.json") && log == folder.read("log.mcap"));
}

#[test]
fn particles_from_a_damaged_log_are_said_to_be() {
    let folder = Folder::with(PAIR);
    folder.agglo(&["run", "scene.json", "-o", "log.mcap", "-q"]).code(0);
    let log = folder.read("log.mcap");
    folder.write("cut.mcap", &log[..log.len() - 200]);
    let scene = r#"{ "duration": 0.01, "particles": { "log": { "path": "cut.mcap", "time": 0 } } }"#;
    folder.write("next.json", scene);
    folder.agglo(&["run", "next.json", "-o", "next.mcap"]).code(3).says(&["cut.mcap is damaged"]);
    folder.agglo(&["check", "next.json"]).code(3).says(&["cut.mcap is damaged"]);
    folder.write("next.json", scene.replace("cut", "log"));
    folder.agglo(&["run", "next.json", "-o", "whole.mcap"]).code(0);
}
