//! CSV: the columns of the contract, numbers to the bit, and back.

use std::io::Cursor;

use agglo_replay::Log;
use agglo_replay::csv::{export, read_particles};
use agglo_replay::export::{At, ExportError};

use crate::story::{EVERYTHING, Kind, NOTHING, log};

fn exported(kind: &Kind, at: At) -> String {
    let mut log = Log::new(Cursor::new(log(kind, 6))).unwrap();
    let mut out = Vec::new();
    let done = export(&mut log, at, &mut out).unwrap();
    assert!(done.damage.is_empty());
    let text = String::from_utf8(out).unwrap();
    assert_eq!(text.lines().count() as u64, done.rows + 1);
    text
}

#[test]
fn columns_are_those_that_the_scene_has() {
    let header = |kind: &Kind| exported(kind, At::End).lines().next().unwrap().to_owned();
    assert_eq!(header(&EVERYTHING), "t,step,id,x,y,z,vx,vy,vz,radius,mass,charge,temperature,cluster");
    assert_eq!(header(&NOTHING), "t,step,id,x,y,z,vx,vy,vz,radius,mass");
}

#[test]
fn numbers_are_the_ones_that_were_recorded() {
    let story = EVERYTHING.story(6);
    let text = exported(&EVERYTHING, At::All);
    let rows: Vec<Vec<&str>> = text.lines().skip(1).map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 7 * 5);
    for (k, row) in rows.iter().enumerate() {
        let (told, id) = (&story[k / 5], k % 5);
        let bits = |column: usize| row[column].parse::<f64>().unwrap().to_bits();
        assert_eq!(bits(0), told.time.to_bits());
        assert_eq!((row[1], row[2]), (told.step.to_string().as_str(), id.to_string().as_str()));
        assert_eq!(bits(3), told.state.position.x[id].to_bits());
        assert_eq!(bits(8), told.state.velocity.z[id].to_bits());
        assert_eq!(bits(12), told.state.temperature.as_ref().unwrap()[id].to_bits());
        assert_eq!(row[13], (id / 2).to_string());
    }
}

#[test]
fn an_export_reads_back_as_particles() {
    let story = EVERYTHING.story(6);
    let particles = read_particles(exported(&EVERYTHING, At::All).as_bytes()).unwrap();
    assert_eq!(particles.len(), 5, "of several times the last");
    for (k, particle) in particles.iter().enumerate() {
        let state = &story[6].state;
        assert_eq!(particle.position, <[f64; 3]>::from(state.position.get(k)));
        assert_eq!(particle.velocity, <[f64; 3]>::from(state.velocity.get(k)));
        assert_eq!(particle.charge, Some(EVERYTHING.particles().charge.unwrap()[k]));
        assert_eq!(particle.temperature, Some(state.temperature.as_ref().unwrap()[k]));
    }
}

#[test]
fn a_time_picks_the_last_state_before_it() {
    let text = exported(&NOTHING, At::Time(0.0035));
    assert!(text.lines().skip(1).all(|line| line.starts_with("0.003,3,")), "{text}");
    let mut log = Log::new(Cursor::new(log(&NOTHING, 1))).unwrap();
    assert!(matches!(export(&mut log, At::Time(-1.0), &mut Vec::new()), Err(ExportError::Log(_))));
}

#[test]
fn a_damaged_log_exports_what_is_whole_and_says_what_is_not() {
    let kind = Kind { n: 100, record: r#""compression": "none""#, ..EVERYTHING };
    let bytes = log(&kind, 300);
    let mut cut = Log::new(Cursor::new(&bytes[..bytes.len() / 2])).unwrap();
    let mut out = Vec::new();
    let done = export(&mut cut, At::All, &mut out).unwrap();
    assert!(!done.damage.is_empty());
    assert!(done.frames > 50 && done.frames < 250);
}

#[test]
fn an_output_that_refuses_bytes_is_an_error() {
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let mut log = Log::new(Cursor::new(log(&NOTHING, 1))).unwrap();
    assert!(matches!(export(&mut log, At::All, &mut Full), Err(ExportError::Write(_))));
}
