//! A write that fails stops the run with an error, wherever it happens.

use std::io::{Error, ErrorKind, Write};

use agglo_core::diagnostics::Level;
use agglo_core::observer::Observer;
use agglo_record::{Options, RecordError, Recorder};

use crate::story::{EVERYTHING, Kind, build, log, record, record_apart};

/// A disk with room for so many bytes.
struct Disk(usize);

impl Write for Disk {
    fn write(&mut self, data: &[u8]) -> std::io::Result<usize> {
        if self.0 == 0 {
            return Err(Error::from(ErrorKind::StorageFull));
        }
        let taken = data.len().min(self.0);
        self.0 -= taken;
        Ok(taken)
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_disk_that_fills_up_at_any_byte_is_an_error() {
    let kind = Kind { n: 100, record: r#""compression": "none""#, ..EVERYTHING };
    let story = kind.story(100);
    let size = log(&kind, 100).len();
    assert!(size > 1 << 20, "more than one chunk: {size}");
    for room in (0..size).step_by(size / 200).chain(size - 40..size) {
        for error in [record(&kind, &story, Disk(room)), record_apart(&kind, &story, Disk(room))] {
            let error = error.expect_err("the disk was too small");
            assert_eq!(error.io_kind(), Some(ErrorKind::StorageFull), "{room} bytes: {error}");
            assert!(error.to_string().contains("no space"), "{error}");
        }
    }
    assert!(record(&kind, &story, Disk(size)).is_ok());
    assert!(record_apart(&kind, &story, Disk(size)).is_ok());
}

#[test]
fn after_a_failure_nothing_looks_like_success() {
    let kind = EVERYTHING;
    let particles = kind.particles();
    let story = kind.story(1);
    let mut recorder = Recorder::create(Disk(100), &kind.scene(), &build(), Options::default()).unwrap();
    let first = recorder.step(&story[0].report(&particles)).unwrap_err();
    assert!(first.to_string().contains("no space"), "{first}");
    assert!(recorder.step(&story[1].report(&particles)).unwrap_err().to_string().contains("no space"));
    assert!(matches!(recorder.note(Level::Error, "ended"), Err(RecordError::AfterFailure(_))));
    assert!(matches!(recorder.finish(), Err(RecordError::AfterFailure(_))));
}

#[test]
#[cfg(target_os = "linux")]
fn the_full_device_is_an_error() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let error = record(&EVERYTHING, &EVERYTHING.story(3), full).unwrap_err();
    assert_eq!(error.io_kind(), Some(ErrorKind::StorageFull));
}

#[test]
fn a_closed_pipe_can_be_told_from_other_failures() {
    struct Closed;
    impl Write for Closed {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(ErrorKind::BrokenPipe.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let error = record(&EVERYTHING, &EVERYTHING.story(3), Closed).unwrap_err();
    assert_eq!(error.io_kind(), Some(ErrorKind::BrokenPipe));
}

#[test]
fn a_log_beyond_its_limit_ends_the_run_and_is_still_whole() {
    let kind = Kind { n: 100, record: r#""compression": "none""#, ..EVERYTHING };
    let particles = kind.particles();
    let mut bytes = Vec::new();
    let limit = 2_000_000;
    let options = Options { max_bytes: Some(limit) };
    let mut recorder = Recorder::create(&mut bytes, &kind.scene(), &build(), options).unwrap();
    let mut ended = None;
    for told in kind.story(1000) {
        if let Err(error) = recorder.step(&told.report(&particles)) {
            ended = Some((told.step, error.to_string()));
            break;
        }
    }
    let (step, error) = ended.expect("the limit was passed");
    assert!(error.contains("2000000"), "{error}");
    recorder.note(Level::Error, error).unwrap();
    let recorded = recorder.finish().unwrap();
    // One chunk, its index and the summary beyond the limit at most.
    assert!(recorded.bytes < limit + 2_000_000, "{}", recorded.bytes);
    let mut log = agglo_replay::Log::new(std::io::Cursor::new(bytes)).unwrap();
    let info = log.check().unwrap().info;
    assert!(info.is_whole());
    assert_eq!(info.steps, step);
}

#[test]
fn a_report_that_does_not_fit_the_scene_is_refused() {
    let kind = EVERYTHING;
    let particles = kind.particles();
    let story = kind.story(0);
    let refused = |change: fn(&mut crate::story::Told)| {
        let mut told = story[0].clone();
        change(&mut told);
        let mut recorder = Recorder::create(Vec::new(), &kind.scene(), &build(), Options::default()).unwrap();
        recorder.step(&told.report(&particles)).unwrap_err().to_string()
    };
    assert!(refused(|told| told.state.temperature = None).contains("temperatures"));
    assert!(refused(|told| told.state.position.push([0.0; 3])).contains("particles"));
    assert!(refused(|told| told.sample.as_mut().unwrap().clusters = None).contains("clusters"));
}

#[test]
fn particles_must_be_read_before_recording() {
    let text = r#"{"duration": 1.0, "particles": {"file": {"path": "a.csv"}}}"#;
    let scene = agglo_core::Scene::parse(text, &[]).unwrap();
    assert!(matches!(Recorder::create(Vec::new(), &scene, &build(), Options::default()), Err(RecordError::Unresolved)));
}
