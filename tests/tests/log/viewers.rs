//! Other readers: the Python packages `mcap` and `mcap-protobuf-support` decode every message of a log.

use std::io::Write;
use std::path::Path;
use std::process::Command;

use crate::story::{EVERYTHING, NOTHING, log};

/// Set to 1 where the Python packages must be there, as in CI; elsewhere the check is passed over, aloud.
const REQUIRED: &str = "AGGLO_REQUIRE_PYTHON";

#[test]
fn python_decodes_every_channel() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("viewers").join("mcap_check.py");
    let python = std::env::var("AGGLO_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let probe = Command::new(&python).args(["-c", "import mcap_protobuf, mcap"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        let how = format!("{python} -m pip install -r tests/viewers/requirements.txt");
        assert!(std::env::var(REQUIRED).as_deref() != Ok("1"), "the Python packages are missing: {how}");
        // `eprintln!` of a test that passes is not shown; this is.
        let said = writeln!(std::io::stderr(), "SKIPPED python_decodes_every_channel: packages are missing ({how})");
        return said.unwrap();
    }
    for (name, kind) in [("everything", EVERYTHING), ("nothing", NOTHING)] {
        let path = std::env::temp_dir().join(format!("agglo-viewers-{name}-{}.mcap", std::process::id()));
        std::fs::write(&path, log(&kind, 40)).unwrap();
        let output = Command::new(&python).arg(&script).arg(&path).output().unwrap();
        let _ = std::fs::remove_file(&path);
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        assert!(output.status.success(), "{name}:\n{out}{err}");
        assert!(out.contains("41 states"), "{out}");
    }
}
