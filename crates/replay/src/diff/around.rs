//! What stands around the messages of two logs, compared by its bytes: attachments, metadata, descriptions of channels.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Read, Seek};

use agglo_record::run;

use crate::error::LogError;
use crate::log::Log;
use crate::recover;

/// Keys of the metadata that say which program wrote the log, or follow from how the scene is written down: they are
/// compared elsewhere.
const ELSEWHERE: [&str; 4] = ["log_format", "agglo_version", "agglo_commit", "scene_hash"];

/// What differs: the name of an attachment, metadata record or channel, and how. `scenes_agree`: whether the scenes do, but
/// for how logs are packed; where they do not, that says it all about the metadata.
///
/// # Errors
/// A device that fails. What is damaged is not compared here.
pub fn differences<R: Read + Seek>(
    a: &mut Log<R>,
    b: &mut Log<R>,
    scenes_agree: bool,
) -> Result<Vec<(String, String)>, LogError> {
    let mut found = attachments(a, b)?;
    for name in names(&a.container.metadata, &b.container.metadata) {
        let (left, right) = (a.container.metadata.get(&name), b.container.metadata.get(&name));
        match (left, right) {
            // It tells of the file that was mended.
            _ if name == recover::RECORD => {}
            (Some(left), Some(right)) if name == run::RECORD => {
                let keys = names(left, right).into_iter().filter(|key| !ELSEWHERE.contains(&key.as_str()));
                let differing = keys.filter(|key| left.get(key) != right.get(key));
                found.extend(
                    differing
                        .filter(|_| scenes_agree)
                        .map(|key| (name.clone(), format!("the metadata differ in {key}"))),
                );
            }
            (Some(left), Some(right)) if left != right => found.push((name, "the metadata record differs".to_owned())),
            (Some(_), Some(_)) => {}
            (left, _) => found.push((name, format!("{} does not have the metadata record", lacking(left.is_some())))),
        }
    }
    if let (Some(left), Some(right)) = (&a.container.index, &b.container.index) {
        let (left, right) = (&left.descriptions, &right.descriptions);
        for (channel, description) in left {
            if right.get(channel).is_some_and(|other| other != description) {
                found.push((channel.clone(), "the channel has another schema or encoding".to_owned()));
            }
        }
    }
    Ok(found)
}

fn attachments<R: Read + Seek>(a: &mut Log<R>, b: &mut Log<R>) -> Result<Vec<(String, String)>, LogError> {
    let count = |log: &Log<R>| {
        let mut count = BTreeMap::new();
        log.container.attachments.iter().for_each(|found| *count.entry(found.name.clone()).or_insert(0_u64) += 1);
        count
    };
    let (left, right) = (count(a), count(b));
    let mut found = Vec::new();
    for name in names(&left, &right) {
        let (first, second) = (left.get(&name), right.get(&name));
        let what = match (first, second) {
            // Compared value by value.
            _ if name == run::SCENE => continue,
            (Some(first), Some(second)) if first != second => {
                "the logs have the attachment another number of times".to_owned()
            }
            (Some(_), Some(_)) => {
                let contents = [a.attachment(&name), b.attachment(&name)].map(|content| match content {
                    Err(LogError::Damaged(_)) => Ok(None),
                    other => other,
                });
                match contents {
                    [Ok(Some(first)), Ok(Some(second))] if first != second => "the attachment differs".to_owned(),
                    [Err(error), _] | [_, Err(error)] => return Err(error),
                    _ => continue,
                }
            }
            (first, _) => format!("{} does not have the attachment", lacking(first.is_some())),
        };
        found.push((name, what));
    }
    Ok(found)
}

fn lacking(first_has_it: bool) -> &'static str {
    if first_has_it { "the second log" } else { "the first log" }
}

/// The keys of both.
fn names<T>(a: &BTreeMap<String, T>, b: &BTreeMap<String, T>) -> BTreeSet<String> {
    a.keys().chain(b.keys()).cloned().collect()
}
