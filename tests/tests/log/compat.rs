//! Field numbers are never reused: the messages of every released log format can still be read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use agglo_record::channels::CHANNELS;
use prost::Message;
use prost_types::{DescriptorProto, FileDescriptorSet};

/// Name, number, label and type of every field: `message.number` to the rest.
fn fields(bytes: &[u8]) -> BTreeMap<String, String> {
    fn walk(prefix: &str, message: &DescriptorProto, fields: &mut BTreeMap<String, String>) {
        let name = format!("{prefix}.{}", message.name());
        for field in &message.field {
            let text = format!("{} {:?} {:?} {}", field.name(), field.label(), field.r#type(), field.type_name());
            fields.insert(format!("{name}.{}", field.number()), text);
        }
        for choice in &message.enum_type {
            for value in &choice.value {
                fields.insert(format!("{name}.{}.{}", choice.name(), value.number()), value.name().to_owned());
            }
        }
        message.nested_type.iter().for_each(|nested| walk(&name, nested, fields));
    }
    let mut found = BTreeMap::new();
    for file in FileDescriptorSet::decode(bytes).unwrap().file {
        file.message_type.iter().for_each(|message| walk(file.package(), message, &mut found));
    }
    found
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("compat").join("log-1.0")
}

#[test]
fn no_field_of_format_1_0_has_changed() {
    for channel in &CHANNELS {
        let path = folder().join(format!("{}.bin", channel.schema));
        let released = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let now = fields(channel.descriptor);
        for (number, field) in fields(&released) {
            assert_eq!(now.get(&number), Some(&field), "field {number} of format 1.0");
        }
    }
}

#[test]
fn descriptors_describe_the_message_of_their_channel() {
    for channel in &CHANNELS {
        let (package, name) = channel.schema.rsplit_once('.').unwrap();
        let set = FileDescriptorSet::decode(channel.descriptor).unwrap();
        let found = set.file.iter().filter(|file| file.package() == package);
        assert!(found.flat_map(|file| &file.message_type).any(|message| message.name() == name), "{}", channel.schema);
        // Readers add the files one by one, so imports must come first.
        for (k, file) in set.file.iter().enumerate() {
            for import in &file.dependency {
                assert!(set.file[..k].iter().any(|before| before.name() == import), "{import} before {}", file.name());
            }
        }
        // Every message says when it is from.
        let fields = fields(channel.descriptor);
        let carries = |field: &str| {
            fields.iter().any(|(number, text)| {
                number.strip_prefix(channel.schema).is_some_and(|rest| rest[1..].parse::<u32>().is_ok())
                    && text.split(' ').next() == Some(field)
            })
        };
        assert!(carries("t") && carries("step"), "{} without t and step", channel.schema);
    }
}

#[test]
fn every_field_of_ours_names_its_unit() {
    for (path, text) in agglo_record::proto::SOURCES.iter().filter(|(path, _)| path.starts_with("agglo/")) {
        let lines: Vec<&str> = text.lines().map(str::trim).collect();
        for (k, line) in lines.iter().enumerate() {
            let scalar = ["double ", "uint32 ", "uint64 ", "optional ", "repeated double", "repeated uint32"];
            // `Vector3` takes the unit of its own field; other messages have units on their fields.
            if !(scalar.iter().any(|start| line.starts_with(start)) || line.starts_with("Vector3 ")) {
                continue;
            }
            let comment: Vec<&str> =
                lines[..k].iter().rev().take_while(|line| line.starts_with("//")).copied().collect();
            assert!(comment.iter().any(|line| line.contains('[')), "{path}: {line} has no unit");
        }
    }
}
