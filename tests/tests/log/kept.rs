//! Logs of released formats are kept, and stay readable: they open, analyse, verify their checksums and compare for ever.

use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use agglo_replay::diff::{Profile, Tolerances, Verdict};
use agglo_replay::recover::recover;
use agglo_replay::{Log, analysis, diff};
use serde_json::Value;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("compat").join("log-1.0").join("logs")
}

/// The logs by name, with what they came to when they were written.
pub fn kept() -> BTreeMap<String, (Vec<u8>, Value)> {
    let expected = std::fs::read(folder().join("expected.json")).unwrap();
    let expected: BTreeMap<String, Value> = serde_json::from_slice(&expected).unwrap();
    expected
        .into_iter()
        .map(|(name, said)| (name.clone(), (std::fs::read(folder().join(name)).unwrap(), said)))
        .collect()
}

fn open(bytes: &[u8]) -> Log<Cursor<&[u8]>> {
    Log::new(Cursor::new(bytes)).unwrap()
}

#[test]
fn kept_logs_open_and_say_what_they_said() {
    let logs = kept();
    assert!(logs.len() >= 5, "every kind of log is kept");
    for (name, (bytes, said)) in &logs {
        let mut log = open(bytes);
        assert!(log.check().unwrap().info.is_whole(), "{name}");
        let found = log.analyze(&analysis::Options::default(), &mut ()).unwrap();
        assert!(found.agreement.agrees() && found.lost.is_empty(), "{name}: {:?}", found.lost);
        let count = |key: &str| said[key].as_u64().unwrap();
        let counts = [("steps", found.iterations.steps), ("states", found.states), ("impacts", found.impacts)];
        let iterations = [("iterations", found.iterations.total), ("rejected", found.iterations.rejected_total())];
        for (key, value) in counts.into_iter().chain(iterations) {
            assert_eq!(value, count(key), "{name}: {key}");
        }
        let last = found.last.unwrap();
        assert_eq!(Some(last.t), said["t"].as_f64(), "{name}");
        assert_eq!(
            last.clusters.as_ref().map(|clusters| u64::from(clusters.count)),
            said["clusters"].as_u64(),
            "{name}"
        );
        let ledger = &last.ledger;
        let energies = [
            ("kinetic", ledger.kinetic),
            ("near_field", ledger.near_field),
            ("binding", ledger.binding),
            ("thermal", ledger.thermal),
        ];
        for (key, value) in energies {
            let then = said[key].as_f64().unwrap();
            // What was said was recomputed too: only the order of a sum may have changed since.
            assert!((value - then).abs() <= 1e-12 * then.abs(), "{name}: {key} is {value:?}, and was {then:?}");
        }
    }
}

#[test]
fn kept_logs_compare_and_are_recovered_whole() {
    let logs = kept();
    let compare = |a: &[u8], b: &[u8]| {
        diff::diff(&mut open(a), &mut open(b), Profile::Exact, Tolerances::default(), |_, _| ())
            .map(|report| report.verdict)
    };
    for (name, (bytes, _)) in &logs {
        assert!(matches!(compare(bytes, bytes), Ok(Verdict::Same)), "{name}");
        let mut copy = Vec::new();
        let recovered = recover(&mut open(bytes), &mut copy).unwrap();
        assert!(recovered.damage.is_empty(), "{name}: {:?}", recovered.damage);
        assert!(matches!(compare(&copy, bytes), Ok(Verdict::Same)), "{name}, recovered");
        for (other, (bytes, _)) in logs.iter().filter(|(other, _)| *other != name) {
            assert!(!matches!(compare(&copy, bytes), Ok(Verdict::Same)), "{name} is no {other}");
        }
    }
}
