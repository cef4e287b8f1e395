//! A recorder on a thread of its own: the same log, the same failures, and the solver waits for a slow output.

use std::io::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use agglo_core::observer::Observer;
use agglo_record::{Options, Recorder};

use crate::story::{EVERYTHING, Kind, build, log, record_apart};

/// Bytes that outlive their writer, which waits while someone else holds them.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(data)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Messages smaller than a batch, and larger.
const KINDS: [(Kind, u64); 2] = [(EVERYTHING, 3000), (Kind { n: 5000, ..EVERYTHING }, 40)];

#[test]
fn it_writes_the_same_log() {
    for (kind, steps) in KINDS {
        let shared = Shared::default();
        let recorded = record_apart(&kind, &kind.story(steps), shared.clone()).unwrap();
        let bytes = std::mem::take(&mut *shared.0.lock().unwrap());
        assert_eq!(recorded.bytes, bytes.len() as u64);
        assert!(bytes == log(&kind, steps), "{steps} steps of {} particles", kind.n);
    }
}

#[test]
fn a_recorder_that_is_dropped_has_written_what_it_was_given() {
    let (kind, shared) = (EVERYTHING, Shared::default());
    let (particles, story) = (kind.particles(), kind.story(30));
    let recorder = Recorder::create(shared.clone(), &kind.scene(), &build(), Options::default()).unwrap();
    let mut recorder = recorder.on_own_thread().unwrap();
    for told in &story {
        recorder.step(&told.report(&particles)).unwrap();
    }
    drop(recorder);
    let bytes = std::mem::take(&mut *shared.0.lock().unwrap());
    let info = agglo_replay::Log::new(std::io::Cursor::new(bytes)).unwrap().check().unwrap().info;
    assert_eq!(info.steps, story.last().unwrap().step);
}

/// An output that stands still is waited for; the log is none the worse.
#[test]
fn no_more_than_a_few_batches_are_held() {
    let (kind, steps) = KINDS[1];
    let story = kind.story(steps);
    let (shared, given) = (Shared::default(), Arc::new(AtomicUsize::new(0)));
    let solver = std::thread::spawn({
        let (shared, given, story) = (shared.clone(), Arc::clone(&given), story.clone());
        move || {
            let particles = kind.particles();
            let recorder = Recorder::create(shared.clone(), &kind.scene(), &build(), Options::default()).unwrap();
            let mut recorder = recorder.on_own_thread().unwrap();
            for told in &story {
                recorder.step(&told.report(&particles)).unwrap();
                given.fetch_add(1, Ordering::SeqCst);
            }
        }
    });
    // The first step leaves at once.
    while given.load(Ordering::SeqCst) == 0 {
        std::thread::yield_now();
    }
    let held = shared.0.lock().unwrap();
    let mut seen = usize::MAX;
    while seen != given.load(Ordering::SeqCst) {
        seen = given.load(Ordering::SeqCst);
        std::thread::sleep(Duration::from_millis(300));
    }
    // Three batches of a step each, and a chunk of a few.
    assert!(seen < story.len() / 2, "{seen} of {} steps were taken", story.len());
    drop(held);
    solver.join().unwrap();
    let bytes = shared.0.lock().unwrap();
    let info = agglo_replay::Log::new(std::io::Cursor::new(&bytes[..])).unwrap().check().unwrap().info;
    assert_eq!(info.steps, story.last().unwrap().step);
}
