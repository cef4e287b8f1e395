//! Runs that are watched while they solve.

use super::Folder;
#[cfg(feature = "live")]
use super::python;

#[cfg(not(feature = "live"))]
#[test]
fn without_the_feature_it_says_how_to_get_it() {
    let folder = Folder::new();
    folder.agglo(&["init", "clustering"]).code(0);
    folder.agglo(&["run", "clustering.json", "--live"]).code(2).says(&["built without --live", "--features live"]);
    assert_eq!(folder.files(), ["clustering.json"], "nothing was written");
}

/// A port that was free just now.
#[cfg(feature = "live")]
fn free_port() -> u16 {
    std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

#[cfg(feature = "live")]
#[test]
fn viewers_see_a_run_in_order_and_change_nothing() {
    let Some(python) = python("viewers_see_a_run_in_order_and_change_nothing", "websockets, google.protobuf") else {
        return;
    };
    let folder = Folder::new();
    folder.agglo(&["init", "clustering"]).code(0);
    // Long enough for viewers to come and go: a second or two.
    let run = ["run", "clustering.json", "--set", "duration=60", "--set", "record.checkpoint_every=100000"];
    let port = free_port();
    let script = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/viewers/live_check.py");
    let mut check = std::process::Command::new(python);
    // It waits for the run: its viewers are there from the first steps on.
    let check = check.arg(script).arg(port.to_string());
    let check = check.stdout(std::process::Stdio::piped()).stderr(std::process::Stdio::piped()).spawn().unwrap();
    let live = format!("--live=127.0.0.1:{port}");
    let ran = folder.agglo(&[&run[..], &["-o", "live.mcap", &live]].concat()).code(0);
    ran.says(&[&format!("live at ws://127.0.0.1:{port}")]);
    let check = check.wait_with_output().unwrap();
    let (out, err) = (String::from_utf8_lossy(&check.stdout), String::from_utf8_lossy(&check.stderr));
    assert!(check.status.success(), "{out}{err}");

    folder.agglo(&[&run[..], &["-o", "plain.mcap"]].concat()).code(0);
    assert!(folder.read("live.mcap") == folder.read("plain.mcap"), "watching a run changes its log");
}

#[cfg(feature = "live")]
#[test]
fn it_is_on_loopback_unless_asked_and_warns_then() {
    let folder = Folder::new();
    folder.agglo(&["init", "two-body-oscillator"]).code(0);
    let run = ["run", "two-body-oscillator.json", "--no-log", "--set", "duration=0.1"];
    let quiet = folder.agglo(&[&run[..], &["--live=127.0.0.1:0"]].concat()).code(0);
    assert!(!quiet.stderr.contains("warning: whoever"), "{}", quiet.stderr);
    folder.agglo(&[&run[..], &["--live=0.0.0.0:0"]].concat()).code(0).says(&["whoever can reach ws://0.0.0.0:"]);
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let live = format!("--live={}", taken.local_addr().unwrap().port());
    folder.agglo(&[&run[..], &[&live]].concat()).code(2).says(&["cannot serve viewers", "takes a free port"]);
    folder.agglo(&[&run[..], &["--live=nonsense:port"]].concat()).code(2).says(&["no address"]);
}
