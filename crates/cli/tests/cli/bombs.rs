//! Logs that are built to take memory or time: every command refuses them, in less than 256 MiB of address space.

#![cfg(target_os = "linux")]

use std::io::Cursor;
use std::process::Stdio;

use mcap::records::op;

use super::planted::Parts;
use super::{CLOUD, Folder, Ran};

/// The most that a command may take [KiB], its code and the stacks of its threads included.
const LIMIT: &str = "262144";

/// The commands that read logs.
const COMMANDS: [&[&str]; 9] = [
    &["info", "bomb.mcap"],
    &["info", "bomb.mcap", "--check"],
    &["analyze", "bomb.mcap"],
    &["replay", "bomb.mcap"],
    &["replay", "bomb.mcap", "--verify"],
    &["diff", "bomb.mcap", "whole.mcap"],
    &["export", "bomb.mcap", "--format", "csv", "--at", "all", "-o", "-"],
    &["recover", "bomb.mcap", "-o", "recovered.mcap", "--overwrite"],
    &["run", "--resume", "bomb.mcap", "-o", "resumed.mcap", "--overwrite"],
];

fn limited(folder: &Folder, arguments: &[&str]) -> Ran {
    let agglo = folder.command(arguments);
    let mut command = std::process::Command::new("sh");
    command.arg("-c").arg(format!("ulimit -v {LIMIT} && exec \"$0\" \"$@\"")).arg(agglo.get_program());
    // Allocators reserve address space for every thread, which is no memory that is used.
    command.args(agglo.get_args()).args(["--threads", "2"]).env("MALLOC_ARENA_MAX", "1");
    command.current_dir(folder.0.path()).stdin(Stdio::null()).output().unwrap().into()
}

/// Refused, or used as far as it is whole; never a crash, and never a success.
#[track_caller]
fn survived(name: &str, folder: &Folder) {
    for command in COMMANDS {
        let ran = limited(folder, command);
        // Without its index, `info` has no reason to read the chunks; `diff` may find a difference before the damage.
        let fine = match command {
            ["info", _] => matches!(ran.code, Some(0 | 2 | 3)),
            ["diff", ..] | ["replay", _, "--verify"] => matches!(ran.code, Some(1..=3)),
            _ => matches!(ran.code, Some(2 | 3)),
        };
        assert!(fine, "{name}: {command:?} ends with {:?}: {}", ran.code, ran.stderr);
        assert!(!ran.stderr.contains("memory allocation"), "{name}: {}", ran.stderr);
    }
}

/// A message of `length` bytes, the same over and over, in a chunk of its own behind a whole log.
fn with_message(parts: &Parts, topic: &str, pattern: &[u8], length: usize, lz4: bool) -> Vec<u8> {
    let mut new = Cursor::new(Vec::new());
    let compression = if lz4 { mcap::Compression::Lz4 } else { mcap::Compression::Zstd };
    let options = mcap::WriteOptions::new().chunk_size(None).compression(Some(compression));
    let mut writer = options.create(&mut new).unwrap();
    parts.begin(&mut writer);
    parts.messages.iter().for_each(|message| Parts::add(&mut writer, message));
    writer.flush().unwrap();
    let mut bomb = parts.messages.iter().rev().find(|message| &*message.channel.name == topic).unwrap().clone();
    bomb.data = pattern.iter().copied().cycle().take(length).collect();
    Parts::add(&mut writer, &bomb);
    writer.finish().unwrap();
    drop(writer);
    new.into_inner()
}

/// Where the last chunk begins.
fn last_chunk(bytes: &[u8]) -> usize {
    let (mut at, mut found) = (8, 0);
    while at + 9 <= bytes.len() && bytes[at] != op::DATA_END {
        if bytes[at] == op::CHUNK {
            found = at;
        }
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    found
}

/// Every part of a file without checksums, as a forger would leave them.
fn without_index(mut bytes: Vec<u8>) -> Vec<u8> {
    let end = bytes.len();
    // The footer's start of the summary, and its checksum.
    bytes[end - 28..end - 8].fill(0);
    bytes
}

fn base() -> (Folder, Parts) {
    let folder = Folder::with(CLOUD);
    folder.agglo(&["run", "scene.json", "--set", "record.checkpoint_every=40", "-o", "whole.mcap"]).code(0);
    let parts = Parts::of(&folder.read("whole.mcap"));
    (folder, parts)
}

const MIB: usize = 1 << 20;

/// A log with chunks of `records` behind it, `count` times, without checksums.
fn with_chunks(parts: &Parts, records: &[u8], count: usize) -> Vec<u8> {
    let packed = zstd::bulk::compress(records, 3).unwrap();
    let mut body = [[0; 16].as_slice(), &(records.len() as u64).to_le_bytes(), &[0; 4]].concat();
    body.extend(4_u32.to_le_bytes());
    body.extend(b"zstd");
    body.extend((packed.len() as u64).to_le_bytes());
    body.extend(packed);
    // Cut off behind the chunks: the reader looks for them itself.
    let whole = parts.write();
    let end = last_chunk(&whole);
    let length = u64::from_le_bytes(whole[end + 1..end + 9].try_into().unwrap()) as usize;
    let mut bytes = whole[..end + 9 + length].to_vec();
    for _ in 0..count {
        bytes.push(op::CHUNK);
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(&body);
    }
    bytes
}

/// Every command ends, and soon: each may take seconds where it took minutes.
#[track_caller]
fn ends_soon(name: &str, folder: &Folder) {
    // The others read in the same ways.
    for command in
        COMMANDS.iter().filter(|command| matches!(command[..], ["info", _, "--check"] | ["recover" | "run", ..]))
    {
        let started = std::time::Instant::now();
        let ran = folder.agglo(command);
        let took = started.elapsed().as_secs_f64();
        assert!(matches!(ran.code, Some(0..=3)), "{name}: {command:?} ends with {:?}", ran.code);
        assert!(took < 10.0, "{name}: {command:?} takes {took} s");
    }
}

/// `diff` finds a difference or the damage, within its memory.
#[track_caller]
fn compares(folder: &Folder) {
    let ran = limited(folder, &["diff", "bomb.mcap", "whole.mcap"]);
    let fine = matches!(ran.code, Some(1 | 3)) && !ran.stderr.contains("memory allocation");
    assert!(fine, "{:?}: {}", ran.code, ran.stderr);
}

#[test]
fn what_is_built_to_keep_a_reader_busy_does_not() {
    let (folder, parts) = base();
    folder.write("bomb.mcap", with_chunks(&parts, &vec![0; 31 * MIB], 200));
    ends_soon("zeros", &folder);
    // Messages on a channel that no chunk describes.
    let message = [&[op::MESSAGE][..], &22_u64.to_le_bytes(), &[0xff; 22]].concat();
    let records: Vec<u8> = message.iter().copied().cycle().take(31 * MIB / message.len() * message.len()).collect();
    folder.write("bomb.mcap", with_chunks(&parts, &records, 200));
    ends_soon("messages", &folder);
    compares(&folder);
    // The same on one that is known: a step of more messages than a step can have.
    let one =
        [&[op::MESSAGE][..], &(22 + 11_u64).to_le_bytes(), &[1, 0], &[0; 20], &[9, 0, 0, 0, 0, 0, 0, 0, 0, 0x10, 1]]
            .concat();
    let records: Vec<u8> = one.iter().copied().cycle().take(31 * MIB / one.len() * one.len()).collect();
    folder.write("bomb.mcap", with_chunks(&parts, &records, 200));
    compares(&folder);
    // Metadata records in front of everything.
    let mut new = Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new().create(&mut new).unwrap();
    parts.begin(&mut writer);
    for k in 0..100_000 {
        let record = mcap::records::Metadata { name: format!("m{k}"), metadata: Default::default() };
        writer.write_metadata(&record).unwrap();
    }
    parts.messages.iter().for_each(|message| Parts::add(&mut writer, message));
    writer.finish().unwrap();
    drop(writer);
    folder.write("bomb.mcap", new.into_inner());
    ends_soon("metadata", &folder);
    folder.agglo(&["info", "bomb.mcap"]).code(3).says(&["more than 1000 metadata records"]);
}

#[test]
fn chunks_that_expand_are_given_no_memory() {
    let (folder, parts) = base();
    for lz4 in [false, true] {
        let honest = with_message(&parts, "/particles", &[0], 300 * MIB, lz4);
        assert!(honest.len() < 5 * MIB, "{} bytes", honest.len());
        folder.write("bomb.mcap", &honest);
        survived(if lz4 { "lz4, honest" } else { "zstd, honest" }, &folder);
        // Where the uncompressed size stands, and what it may say.
        let size = last_chunk(&honest) + 9 + 16;
        for claim in [1_u64 << 20, 30 << 20, 1 << 42, u64::MAX] {
            let mut liar = honest.clone();
            liar[size..size + 8].copy_from_slice(&claim.to_le_bytes());
            folder.write("bomb.mcap", &liar);
            survived(&format!("lz4 {lz4}, claims {claim} bytes"), &folder);
        }
        folder.write("bomb.mcap", without_index(honest));
        survived("without an index", &folder);
    }
}

#[test]
fn a_log_that_claims_billions_of_particles_is_asked_for_its_scene() {
    let (folder, mut parts) = base();
    parts.metadata.insert("n".to_owned(), "4000000000".to_owned());
    folder.write("bomb.mcap", with_message(&parts, "/particles", &[0], 300 * MIB, false));
    survived("n = 4e9", &folder);
    // The scene claims them too: its particles are not placed before the log has shown them.
    parts.metadata.insert("n".to_owned(), "100000000".to_owned());
    parts.rewrite_scene("\"count\": 100,", "\"count\": 100000000,");
    parts.rewrite_scene("\"side\": 1.0", "\"side\": 1000.0");
    folder.write("bomb.mcap", with_message(&parts, "/particles", &[0], 300 * MIB, false));
    survived("n = 1e8 in the scene too", &folder);
}

#[test]
fn messages_that_expand_when_they_are_decoded() {
    let (folder, parts) = base();
    // Zeros; parts of no bytes, of which each becomes a structure; numbers of one byte each.
    for topic in
        ["/particles", "/impacts", "/diagnostics", "/energy", "/clusters", "/checkpoint", "/particles/static", "/scene"]
    {
        for pattern in [&[0][..], &[0x1a, 0], &[0x22, 0], &[0x2a, 0], &[0x32, 0], &[0x3a, 0], &[0x08, 1]] {
            folder.write("bomb.mcap", with_message(&parts, topic, pattern, 1_400_000, false));
            let ran = limited(&folder, &["info", "bomb.mcap", "--check"]);
            assert!(matches!(ran.code, Some(0 | 3)), "{topic} {pattern:?}: {:?} {}", ran.code, ran.stderr);
            let ran = limited(&folder, &["analyze", "bomb.mcap"]);
            assert!(matches!(ran.code, Some(0..=3)), "{topic} {pattern:?}: {:?} {}", ran.code, ran.stderr);
        }
        folder.write("bomb.mcap", with_message(&parts, topic, &[0x1a, 0], 30 * MIB, false));
        survived(topic, &folder);
    }
}

#[test]
fn records_that_fill_a_huge_file() {
    let (folder, _) = base();
    let whole = folder.read("whole.mcap");
    let cut = last_chunk(&whole);
    // A file may be that long without taking any room.
    const LENGTH: u64 = 1 << 30;
    let export = |name: &str, head: &[u8]| {
        folder.write("bomb.mcap", [&whole[..cut], head].concat());
        let file = std::fs::OpenOptions::new().write(true).open(folder.path("bomb.mcap")).unwrap();
        file.set_len(cut as u64 + 9 + LENGTH).unwrap();
        let ran = limited(&folder, &["export", "bomb.mcap", "--format", "csv", "--at", "0", "-o", "-"]);
        assert!(matches!(ran.code, Some(2 | 3)), "{name}: {:?} {}", ran.code, ran.stderr);
    };
    for opcode in [op::METADATA, op::ATTACHMENT, op::MESSAGE_INDEX, op::CHANNEL] {
        export(&format!("opcode {opcode}"), &[&[opcode][..], &LENGTH.to_le_bytes()].concat());
    }
    // A chunk that is not compressed, whose head is right: times, size, no checksum, no compression, size.
    let size = (LENGTH - 40).to_le_bytes();
    export("chunk", &[&[op::CHUNK][..], &LENGTH.to_le_bytes(), &[0; 16], &size, &[0; 4], &[0; 4], &size].concat());
}

#[test]
fn an_index_that_names_a_chunk_a_thousand_times_is_not_followed() {
    let (folder, _) = base();
    let mut bytes = folder.read("whole.mcap");
    let end = bytes.len();
    let start = u64::from_le_bytes(bytes[end - 28..end - 20].try_into().unwrap()) as usize;
    // The first index of a chunk, over and over.
    let mut at = start;
    while bytes[at] != op::CHUNK_INDEX {
        at += 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
    }
    let record = bytes[at..at + 9 + u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize].to_vec();
    let tail = bytes.split_off(at);
    (0..1000).for_each(|_| bytes.extend(&record));
    bytes.extend(tail);
    let end = bytes.len();
    bytes[end - 12..end - 8].fill(0);
    folder.write("bomb.mcap", &bytes);
    survived("a thousand times", &folder);
}
