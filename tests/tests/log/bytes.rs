//! The same run gives the same bytes, wherever they go, and nothing of the machine is in them.

use std::io::Write;

use crate::story::{EVERYTHING, Kind, NOTHING, log, record};

#[test]
fn two_runs_give_the_same_bytes() {
    for kind in [EVERYTHING, NOTHING, Kind { record: r#""compression": "lz4""#, ..EVERYTHING }] {
        assert!(log(&kind, 30) == log(&kind, 30));
    }
}

/// Accepts a few bytes at a time, as a pipe may, and cannot seek.
struct Trickle(Vec<u8>, usize);

impl Write for Trickle {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        self.1 = self.1 % 97 + 1;
        let taken = data.len().min(self.1);
        self.0.extend_from_slice(&data[..taken]);
        Ok(taken)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_pipe_gets_the_same_bytes_as_a_file() {
    let kind = Kind { n: 300, ..EVERYTHING };
    let mut pipe = Trickle(Vec::new(), 0);
    record(&kind, &kind.story(100), &mut pipe).unwrap();
    assert!(pipe.0 == log(&kind, 100));
}

/// Notes how much has come before each flush.
#[derive(Default)]
struct Flushes(Vec<u8>, Vec<usize>);

impl Write for Flushes {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        self.0.write(data)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        self.1.push(self.0.len());
        Ok(())
    }
}

#[test]
fn what_has_been_flushed_can_be_read_after_a_kill() {
    // Two particles: 1000 steps are far below the size at which a chunk is closed.
    let kind = Kind { n: 2, contact: false, domain: false, ..EVERYTHING };
    let mut out = Flushes::default();
    record(&kind, &kind.story(2500), &mut out).unwrap();
    let at: Vec<u64> = out
        .1
        .iter()
        .map(|length| {
            let mut log = agglo_replay::Log::new(std::io::Cursor::new(&out.0[..*length])).unwrap();
            log.check().unwrap().info.frames
        })
        .collect();
    // The start at once, then a chunk every 1000 steps, then the rest.
    assert_eq!(at, [1, 1001, 2001, 2501]);
}

#[test]
fn no_trace_of_the_machine_is_in_a_log() {
    let bytes = log(&Kind { record: r#""compression": "none""#, ..EVERYTHING }, 5);
    let mut traces = vec![env!("CARGO_MANIFEST_DIR").to_owned()];
    for name in ["HOME", "HOSTNAME", "USER", "CARGO_TARGET_DIR"] {
        // Short values such as "/" stand in any file.
        traces.extend(std::env::var(name).ok().filter(|value| value.len() > 4));
    }
    for trace in traces {
        assert!(!bytes.windows(trace.len()).any(|part| part == trace.as_bytes()), "{trace} is in the log");
    }
}
