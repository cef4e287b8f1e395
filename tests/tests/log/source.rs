//! Particles of a scene that stand in a CSV file or in another log.

use std::path::PathBuf;

use agglo_core::Scene;
use agglo_core::scene::{ParticleSource, Problem};
use agglo_replay::csv::export;
use agglo_replay::export::At;
use agglo_replay::{Log, resolve_particles};

use crate::story::{EVERYTHING, Kind, NOTHING, log};

/// A folder of its own for a test, removed when it ends.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("agglo-source-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, content: &[u8]) {
        std::fs::write(self.0.join(name), content).unwrap();
    }

    fn resolve(&self, particles: &str, thermal: bool) -> Result<Scene, Problem> {
        let thermal = if thermal { r#", "thermal": {"heat_capacity": 1.0}"# } else { "" };
        let text = format!(r#"{{"duration": 1.0, "particles": {particles}{thermal}}}"#);
        let mut scene = Scene::parse(&text, &[]).unwrap();
        resolve_particles(&mut scene, &self.0).map(|_| scene)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn a_log_and_its_export_give_the_same_particles() {
    let folder = Folder::new("same");
    let bytes = log(&EVERYTHING, 6);
    let mut csv = Vec::new();
    export(&mut Log::new(std::io::Cursor::new(&bytes)).unwrap(), At::Time(0.004), &mut csv).unwrap();
    folder.write("a.mcap", &bytes);
    folder.write("a.csv", &csv);
    let from_log = folder.resolve(r#"{"log": {"path": "a.mcap", "time": 0.0045}}"#, true).unwrap();
    let from_csv = folder.resolve(r#"{"file": {"path": "a.csv"}}"#, true).unwrap();
    assert_eq!(from_log, from_csv);
    let ParticleSource::List(list) = &from_log.particles else { panic!("resolved into a list") };
    assert_eq!(list.len(), 5);
    assert_eq!(list[3].position, <[f64; 3]>::from(EVERYTHING.story(6)[4].state.position.get(3)));
}

#[test]
fn what_cannot_be_used_is_named_with_its_pointer() {
    let folder = Folder::new("wrong");
    folder.write("cold.csv", b"x,y,z,radius,mass\n0,0,0,1,1\n");
    folder.write("bad.csv", b"x,y,z,radius,mass\n0,0,zero,1,1\n");
    let kind = Kind { n: 200, record: r#""compression": "none""#, ..NOTHING };
    let bytes = log(&kind, 300);
    folder.write("cut.mcap", &bytes[..bytes.len() / 2]);
    let refused = |particles: &str, thermal: bool| folder.resolve(particles, thermal).expect_err(particles);

    let missing = refused(r#"{"file": {"path": "none.csv"}}"#, false);
    assert_eq!(missing.pointer, "/particles/file/path");
    assert!(missing.message.contains("none.csv"), "{missing}");
    let bad = refused(r#"{"file": {"path": "bad.csv"}}"#, false);
    assert!(bad.message.contains("line 2, column 3"), "{bad}");
    assert!(refused(r#"{"file": {"path": "cold.csv"}}"#, true).message.contains("temperatures"));
    assert!(folder.resolve(r#"{"file": {"path": "cold.csv"}}"#, false).is_ok());

    let text = refused(r#"{"log": {"path": "cold.csv", "time": 0}}"#, false);
    assert_eq!(text.pointer, "/particles/log/path");
    assert!(text.message.contains("not a log") && text.hint.is_some(), "{text}");
    // The state asked for may be in the part that is lost: an earlier one must not be taken for it.
    let cut = refused(r#"{"log": {"path": "cut.mcap", "time": 0.299}}"#, false);
    assert!(cut.message.contains("damaged"), "{cut}");
    assert!(folder.resolve(r#"{"log": {"path": "cut.mcap", "time": 0.01}}"#, false).is_ok());
}
