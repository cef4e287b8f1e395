//! Tolerance files: what may differ by how much, and what is ignored by name.

use std::collections::{BTreeMap, BTreeSet};

use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// How far a field may differ: |a - b| <= abs + rel · scale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Tolerance {
    /// Absolute part, in the field's unit.
    #[serde(default)]
    pub abs: f64,
    /// Relative part [-].
    #[serde(default)]
    pub rel: f64,
    /// What the relative part refers to.
    #[serde(default)]
    pub scale: Scale,
    /// Whether the field is not compared at all.
    #[serde(default)]
    pub ignore: bool,
}

/// What a relative tolerance refers to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// The largest |b| of the field at that step.
    #[default]
    Max,
    /// |b| itself.
    Value,
}

/// A tolerance file.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: u32,
    #[serde(default)]
    default: Tolerance,
    #[serde(default, deserialize_with = "unique")]
    fields: BTreeMap<String, Tolerance>,
}

/// Reads a map in which no key may stand twice: the one that is passed over could be the one that was meant.
fn unique<'de, D: Deserializer<'de>>(from: D) -> Result<BTreeMap<String, Tolerance>, D::Error> {
    struct Unique;
    impl<'de> Visitor<'de> for Unique {
        type Value = BTreeMap<String, Tolerance>;

        fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            f.write_str("an object of tolerances by field")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut entries: A) -> Result<Self::Value, A::Error> {
            let mut map = BTreeMap::new();
            while let Some((name, tolerance)) = entries.next_entry::<String, Tolerance>()? {
                if map.contains_key(&name) {
                    return Err(A::Error::custom(format!("`{name}` stands there twice")));
                }
                map.insert(name, tolerance);
            }
            Ok(map)
        }
    }
    from.deserialize_map(Unique)
}

/// Tolerances of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerances {
    default: Tolerance,
    fields: BTreeMap<String, Tolerance>,
    /// Entries that have been asked for.
    used: BTreeSet<String>,
    /// Whether they come from a file.
    pub given: bool,
}

impl Tolerances {
    /// Reads a tolerance file.
    ///
    /// # Errors
    /// A sentence: no JSON of that form, another format, a negative or infinite tolerance.
    pub fn parse(text: &str) -> Result<Self, String> {
        let File { format, default, fields } = serde_json::from_str(text).map_err(|error| error.to_string())?;
        if format != 1 {
            return Err(format!("its format is {format}, and this version reads 1"));
        }
        if default.ignore {
            return Err("`default` cannot ignore: name what is not to be compared".to_owned());
        }
        for (name, tolerance) in std::iter::once((&"default".to_owned(), &default)).chain(&fields) {
            for (key, value) in [("abs", tolerance.abs), ("rel", tolerance.rel)] {
                if !(value.is_finite() && value >= 0.0) {
                    return Err(format!("{name}.{key} is {value}, not a finite number from 0 on"));
                }
            }
            if !(name == "default" || name.starts_with('/') || name.starts_with("curves.")) {
                return Err(format!("{name:?} is no field: write `/channel.field`, `/channel` or `curves.name`"));
            }
        }
        Ok(Self { default, fields, used: BTreeSet::new(), given: true })
    }

    /// Ignores a channel or field by name.
    pub fn ignore(&mut self, name: &str) {
        self.fields.insert(name.to_owned(), Tolerance { ignore: true, ..Tolerance::default() });
    }

    /// The tolerance of a field of a channel: its own, else its channel's, else the default.
    pub fn of(&mut self, channel: &str, field: &str) -> Tolerance {
        let own = if field.is_empty() { channel.to_owned() } else { format!("{channel}.{field}") };
        for name in [own.as_str(), channel] {
            if let Some((name, tolerance)) = self.fields.get_key_value(name) {
                let tolerance = *tolerance;
                if !self.used.contains(name) {
                    let name = name.clone();
                    self.used.insert(name);
                }
                return tolerance;
            }
        }
        self.default
    }

    /// Whether a whole channel is ignored: it is by name, and none of its fields is named to be compared.
    pub fn ignores(&mut self, channel: &str) -> bool {
        let field = |name: &str| name.strip_prefix(channel).is_some_and(|rest| rest.starts_with('.'));
        let compared = self.fields.iter().any(|(name, tolerance)| field(name) && !tolerance.ignore);
        self.of(channel, "").ignore && !compared
    }

    /// The default.
    #[must_use]
    pub fn default_tolerance(&self) -> Tolerance {
        self.default
    }

    /// Entries that nothing in the logs matches.
    #[must_use]
    pub fn unmatched(&self) -> Vec<String> {
        self.fields.keys().filter(|name| !self.used.contains(*name)).cloned().collect()
    }

    /// What is ignored, by name.
    #[must_use]
    pub fn ignored(&self) -> Vec<String> {
        self.fields.iter().filter(|(_, tolerance)| tolerance.ignore).map(|(name, _)| name.clone()).collect()
    }
}
