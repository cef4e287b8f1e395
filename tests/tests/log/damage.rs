//! No input makes the reader panic, no damage goes unseen, and what is whole is read.

use std::io::Cursor;

use agglo_replay::diff::{Profile, Tolerances, Verdict};
use agglo_replay::recover::recover;
use agglo_replay::{Damage, Log, LogError, Message, analysis, diff, export};

use crate::kept::kept;
use crate::story::{EVERYTHING, Kind, NOTHING, Numbers, log};
use crate::verify::rewrite;

/// What a full reading of some bytes finds: the steps whose states are whole, and what is lost.
fn read(bytes: &[u8]) -> Result<(Vec<u64>, Vec<Damage>), LogError> {
    let mut log = Log::new(Cursor::new(bytes))?;
    let mut frames = Vec::new();
    for entry in log.messages() {
        if let Ok(entry) = entry
            && let Message::Particles(_) = entry.message
        {
            frames.push(entry.step);
        }
    }
    let checked = log.check()?;
    let _ = log.info()?;
    let _ = log.particles();
    let _ = log.last_frame();
    let _ = log.scene();
    Ok((frames, checked.info.damage))
}

/// A log of a few kilobytes with several chunks: every byte of it can be tried.
fn small() -> Vec<u8> {
    let kind = Kind { n: 1, record: r#""compression": "zstd""#, ..NOTHING };
    log(&kind, 4)
}

#[test]
fn a_log_cut_off_at_any_byte_is_reported_and_read_as_far_as_it_goes() {
    let whole = small();
    let (all, damage) = read(&whole).unwrap();
    assert_eq!((all.len(), damage.len()), (5, 0));
    let mut most = 0;
    for length in 0..whole.len() {
        match read(&whole[..length]) {
            Ok((frames, damage)) => {
                assert!(!damage.is_empty(), "cut off at {length} of {}, and not noticed", whole.len());
                assert_eq!(frames, all[..frames.len()], "the first states, in order");
                // More bytes never lose what fewer had.
                assert!(frames.len() >= most);
                most = frames.len();
            }
            Err(LogError::Damaged(_) | LogError::NotALog(_)) => assert_eq!(most, 0),
            Err(other) => panic!("cut off at {length}: {other}"),
        }
    }
    assert_eq!(most, all.len(), "without its index a log is still read in full");
}

#[test]
fn a_flipped_bit_anywhere_is_seen() {
    let whole = small();
    let (all, _) = read(&whole).unwrap();
    for place in 0..whole.len() {
        // All eight bits of a byte take the same path; one of them, another for every place.
        let mut bytes = whole.clone();
        bytes[place] ^= 1 << (place % 8);
        match read(&bytes) {
            Ok((frames, damage)) => {
                assert!(!damage.is_empty(), "bit {} of byte {place} flipped, and not noticed", place % 8);
                assert!(frames.iter().all(|step| all.contains(step)));
            }
            // The mark at the start, or the record that says whose log it is.
            Err(_) => assert!(place < 1500, "byte {place} is behind the metadata"),
        }
    }
}

#[test]
fn a_damaged_chunk_loses_its_own_states_only() {
    let kind = Kind { n: 200, record: r#""compression": "none""#, ..EVERYTHING };
    let whole = log(&kind, 300);
    let (all, _) = read(&whole).unwrap();
    let mut bytes = whole.clone();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    let (frames, damage) = read(&bytes).unwrap();
    let lost = all.len() - frames.len();
    assert!(lost > 0 && lost < all.len() / 2, "{lost} of {} states", all.len());
    assert_eq!(frames.last(), all.last(), "what is behind the damage is read");
    assert!(damage.iter().any(|found| found.what.contains("is lost")), "{damage:?}");

    // The iterator itself reports the loss in its place, so that `?` cannot pass over it.
    let mut log = Log::new(Cursor::new(&bytes)).unwrap();
    assert_eq!(log.messages().filter(Result::is_err).count(), 1);
    let t = frames.len() as f64; // beyond the end
    assert_eq!(log.frame_at(t).unwrap().step, 300);
}

#[test]
fn a_cut_off_log_does_not_pass_an_early_state_for_a_late_one() {
    let kind = Kind { n: 200, record: r#""compression": "none""#, ..EVERYTHING };
    let whole = log(&kind, 300);
    let mut log = Log::new(Cursor::new(&whole[..whole.len() / 2])).unwrap();
    let last = log.last_frame().unwrap();
    assert!(last.step > 50 && last.step < 250);
    assert_eq!(log.frame_at(last.t).unwrap().step, last.step);
    assert!(log.frame_at(0.299).unwrap_err().is_damage());
}

/// Everything that reads logs, on bytes that were `whole`: none may panic, and that something changed is said by all that
/// read the whole of it.
fn read_in_every_way(bytes: &[u8], whole: &[u8]) {
    let changed = bytes != whole;
    let Ok((_, damage)) = read(bytes) else { return };
    assert!(!changed || !damage.is_empty(), "a changed log is whole");
    let mut log = Log::new(Cursor::new(bytes)).unwrap();
    if let Ok(analysis) = log.analyze(&analysis::Options::default(), &mut ()) {
        assert!(!changed || !analysis.lost.is_empty(), "the analysis of a changed log loses nothing: {damage:?}");
    }
    if let Ok(recovered) = recover(&mut log, std::io::sink()) {
        assert!(!changed || !recovered.damage.is_empty(), "all of a changed log is recovered");
    }
    let _ = log.verify(0.0, |_| true);
    let _ = export::states(&mut log, export::At::All, |_, _| Ok(0));
    let _ = log.steps().count();
    let mut original = Log::new(Cursor::new(whole)).unwrap();
    if let Ok(report) = diff::diff(&mut log, &mut original, Profile::Exact, Tolerances::default(), |_, _| ()) {
        assert!(!changed || report.damaged() || report.verdict != Verdict::Same, "a changed log is the same");
    }
}

/// How many logs are mangled, and where the random numbers begin: `AGGLO_MUTATIONS=1000000 AGGLO_MUTATION_SEED=8` looks
/// longer, and elsewhere. Where a panic says nothing of it, this is what was mangled.
fn mutations() -> (u32, Numbers) {
    let number = |name: &str, usual: u64| std::env::var(name).map_or(usual, |text| text.parse().expect("a number"));
    (number("AGGLO_MUTATIONS", 3000) as u32, Numbers::new(number("AGGLO_MUTATION_SEED", 7)))
}

/// The logs that are mangled: one of every kind that is kept, and one of which every byte counts.
fn corpus() -> Vec<Vec<u8>> {
    let mut logs: Vec<Vec<u8>> = kept().into_values().map(|(bytes, _)| bytes).collect();
    logs.push(small());
    logs
}

#[test]
fn mangled_logs_never_make_it_panic() {
    let corpus = corpus();
    let (count, mut numbers) = mutations();
    let mut upto = |n: usize| (numbers.next().abs() * n as f64) as usize;
    for k in 0..count {
        // The small one is quickest, and mangled most.
        let whole = if k % 20 == 0 { &corpus[upto(corpus.len())] } else { &corpus[corpus.len() - 1] };
        let mut bytes = whole.clone();
        for _ in 0..=upto(6) {
            let (place, value) = (upto(bytes.len()), upto(256) as u8);
            match upto(4) {
                0 => bytes[place] = value,
                1 => bytes.truncate(place.max(8)),
                2 => bytes.splice(place..place, [value; 9]).for_each(drop),
                // Eight bytes of ones: a length or offset beyond everything.
                _ => bytes.iter_mut().skip(place).take(8).for_each(|byte| *byte = 0xff),
            }
        }
        read_in_every_way(&bytes, whole);
    }
}

#[test]
fn mangled_messages_under_right_checksums_never_make_it_panic() {
    let corpus = corpus();
    let (count, mut numbers) = mutations();
    let mut upto = |n: usize| (numbers.next().abs() * n as f64) as usize;
    for _ in 0..count / 10 {
        let whole = &corpus[upto(corpus.len())];
        let messages = Log::new(Cursor::new(whole)).unwrap().raw_messages().count();
        let (mut at, chosen) = (0, upto(messages));
        let bytes = rewrite(whole, |mut message| {
            at += 1;
            let length = message.data.len().max(1);
            for _ in 0..if at == chosen + 1 { 1 + upto(4) } else { 0 } {
                let (place, value) = (upto(length), upto(256) as u8);
                match upto(4) {
                    0 => message.data.truncate(place),
                    1 => message.data.extend_from_within(..place.min(message.data.len())),
                    2 => message.data.iter_mut().skip(place).take(8).for_each(|byte| *byte = 0xff),
                    _ => message.data.iter_mut().skip(place).take(1).for_each(|byte| *byte = value),
                }
            }
            vec![message]
        });
        // What they say is not judged here: only that nothing panics, and that going on from any checkpoint ends.
        let mut log = Log::new(Cursor::new(&bytes[..])).unwrap();
        let _ = (read(&bytes), log.analyze(&analysis::Options::default(), &mut ()));
        let _ = (log.verify(0.0, |_| false), log.verify(1e9, |_| false), log.resumption(1.0, 1.0));
        let _ = export::states(&mut log, export::At::All, |_, _| Ok(0));
        let _ = recover(&mut log, std::io::sink());
        let mut original = Log::new(Cursor::new(&whole[..])).unwrap();
        for profile in [Profile::Exact, Profile::State] {
            let _ = diff::diff(&mut log, &mut original, profile, Tolerances::default(), |_, _| ());
        }
    }
}

#[test]
fn other_files_are_told_apart() {
    let message = |bytes: &[u8]| Log::new(Cursor::new(bytes)).unwrap_err().to_string();
    assert!(message(b"").contains("it is empty"));
    assert!(message(br#"{"duration": 1.0}"#).contains("a scene perhaps"));
    assert!(message(b"t,step,id,x,y,z\n").contains("a CSV file perhaps"));
    assert!(message(b"\x7fELF\x02\x01\x01\x00\x00").contains("no MCAP file"));

    let mut foreign = Vec::new();
    let mut writer = mcap::Writer::new(Cursor::new(&mut foreign)).unwrap();
    writer.add_channel(0, "/other", "json", &std::collections::BTreeMap::new()).unwrap();
    writer.finish().unwrap();
    drop(writer);
    assert!(matches!(Log::new(Cursor::new(&foreign)), Err(LogError::Foreign(_))));
    assert!(message(&foreign).contains("not a log of agglo"));

    let folder = Log::open(env!("CARGO_MANIFEST_DIR")).unwrap_err();
    assert!(matches!(folder, LogError::Io(_)), "{folder}");
}

#[test]
fn a_chunk_that_claims_terabytes_gets_no_memory() {
    let mut bytes = log(&Kind { n: 1, ..NOTHING }, 4);
    let mut reader = Log::new(Cursor::new(bytes.clone())).unwrap();
    assert!(reader.check().unwrap().info.is_whole());
    // Opcode of a chunk, its length; start, end, then the uncompressed size.
    let chunk = (0..bytes.len() - 9)
        .find(|&k| bytes[k] == 6 && bytes[k + 4..k + 9] == [0; 5] && bytes[k + 9..k + 25] == [0; 16])
        .expect("the first chunk, all of it at time 0");
    bytes[chunk + 25..chunk + 33].copy_from_slice(&(1_u64 << 42).to_le_bytes());
    let (_, damage) = read(&bytes).unwrap();
    assert!(damage.iter().any(|found| found.what.contains("limit")), "{damage:?}");
}
