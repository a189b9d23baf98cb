//! Tables of the problem file, read key by key; a key that was not read is an error, which names
//! the section where the key belongs.

use std::ops::Range;

use nalgebra::Vector3;
use toml::de::DeTable;

use super::item::{Document, Item, join};
use crate::error::{
    InputError, InputErrorKind, Location, nearest, one_typo, other_names, shortened,
};
use crate::laws::NAMES;
use crate::quantity::{Suffix, Unit};

/// Maximum number of tables `[[…]]` with one name: joints, masses of a beam, effects, constraints.
const MAX_TABLES: usize = 100;

/// Table of a problem file while it is read.
pub(crate) struct Section<'a, 'i> {
    document: &'a Document,
    path: String,
    span: Range<usize>,
    table: &'a DeTable<'i>,
    /// Keys that have been read.
    keys_read: Vec<String>,
}

impl<'a, 'i> Section<'a, 'i> {
    pub fn new(
        document: &'a Document,
        path: String,
        span: Range<usize>,
        table: &'a DeTable<'i>,
    ) -> Self {
        Self { document, path, span, table, keys_read: Vec::new() }
    }

    /// Returns the place of the section's header.
    pub fn location(&self) -> Location {
        let location = self.document.locate(self.span.clone());
        if self.path.is_empty() { location } else { location.with_key(self.path.as_str()) }
    }

    /// Returns an error about the whole section.
    pub fn error(&self, kind: impl Into<InputErrorKind>) -> InputError {
        self.location().error(kind)
    }

    /// Returns the error for a missing key; suggests a similar key that was not read.
    pub fn missing(&self, key: &str, write: impl Into<String>) -> InputError {
        let unread =
            self.entries().into_iter().map(|(key, _)| key).filter(|key| !self.was_read(key));
        let wanted = [key.to_owned()];
        let is_meant = |other: &&str| !other_names(other, &wanted).is_empty();
        let unread: Vec<&str> = unread.collect();
        let near = unread.iter().find(|other| is_meant(other)).copied();
        let near = near.or_else(|| nearest(key, unread)).map(str::to_owned);
        let kind = InputErrorKind::MissingKey { write: write.into(), near };
        self.location().with_key(join(&self.path, key)).error(kind)
    }

    fn was_read(&self, key: &str) -> bool {
        self.keys_read.iter().any(|read| read == key)
    }

    /// Returns the number of keys.
    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// Returns all keys and values in the order of the file.
    pub fn entries(&self) -> Vec<(&'a str, Item<'a, 'i>)> {
        let mut entries: Vec<_> = self.table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let item = |(key, value)| Item::of_key(self.document, &self.path, key, value);
        entries.into_iter().map(|(key, value)| (&**key.get_ref(), item((key, value)))).collect()
    }

    /// Returns the value of a key without marking the key as read.
    pub fn peek(&self, key: &str) -> Option<Item<'a, 'i>> {
        let (key, value) = self.table.get_key_value(key)?;
        Some(Item::of_key(self.document, &self.path, key, value))
    }

    /// Returns the value of an optional key.
    pub fn get(&mut self, key: &str) -> Option<Item<'a, 'i>> {
        self.keys_read.push(key.to_owned());
        self.peek(key)
    }

    /// Returns the value of a required key; `write` is the remedy in the error.
    pub fn require(&mut self, key: &str, write: &str) -> Result<Item<'a, 'i>, InputError> {
        self.get(key).ok_or_else(|| self.missing(key, write))
    }

    /// Returns an optional text.
    pub fn text(&mut self, key: &str) -> Result<Option<&'a str>, InputError> {
        self.get(key).map(|item| item.text()).transpose()
    }

    /// Returns the meaning of an optional word: `meanings[k]` if the value is `words[k]`.
    pub fn word<T: Copy>(
        &mut self,
        key: &str,
        words: &'static [&'static str],
        meanings: &[T],
    ) -> Result<Option<T>, InputError> {
        let Some(item) = self.get(key) else { return Ok(None) };
        let word = item.text()?;
        let meaning = words
            .iter()
            .zip(meanings)
            .find(|(known, _)| **known == word)
            .map(|(_, meaning)| *meaning);
        let unknown =
            || item.error(InputErrorKind::UnknownWord { word: word.to_owned(), known: words });
        meaning.ok_or_else(unknown).map(Some)
    }

    /// Returns an optional subsection.
    pub fn section(&mut self, key: &str) -> Result<Option<Self>, InputError> {
        self.get(key).map(|item| item.section()).transpose()
    }

    /// Returns the tables of `[[key]]`, empty if absent; too many are an error.
    pub fn sections(&mut self, key: &str) -> Result<Vec<Self>, InputError> {
        let Some(item) = self.get(key) else { return Ok(Vec::new()) };
        let tables = item.list("a list of tables, each with its header in double brackets")?;
        item.check_count("tables", tables.len(), MAX_TABLES)?;
        tables.iter().map(Item::section).collect()
    }

    /// Returns the value of the key `base` with one of the suffixes of `unit`, and that suffix.
    pub fn pick(
        &mut self,
        base: &str,
        unit: Unit,
    ) -> Result<Option<(Item<'a, 'i>, Suffix)>, InputError> {
        let mut found: Option<(Item<'a, 'i>, Suffix)> = None;
        let mut first_key = String::new();
        for suffix in unit.foreign_suffixes() {
            if let Some(item) = self.peek(&format!("{base}_{suffix}")) {
                let write = [unit.alternatives(base)].into_iter();
                let here = item
                    .converted(unit, suffix)
                    .map(|value| format!("here {base}_{} = {value}", unit.in_tables().suffix));
                let write = write.chain(here).collect::<Vec<_>>().join(", ");
                let (noun, suffix) = (unit.noun(), suffix.to_owned());
                return Err(item.error(InputErrorKind::WrongUnit { noun, suffix, write }));
            }
        }
        for suffix in unit.suffixes() {
            let key = format!("{base}_{}", suffix.name);
            if let Some(item) = self.get(&key) {
                if found.is_some() {
                    return Err(item.error(InputErrorKind::GivenTwice { first: first_key }));
                }
                found = Some((item, *suffix));
                first_key = key;
            }
        }
        Ok(found)
    }

    /// Returns the value of `base` like [`pick`](Self::pick). A missing suffix, or one of another
    /// unit, is an error.
    pub fn quantity(
        &mut self,
        base: &str,
        unit: Unit,
    ) -> Result<Option<(Item<'a, 'i>, Suffix)>, InputError> {
        if let Some(bare) = self.peek(base).filter(|item| !item.holds_tables()) {
            let write = unit.alternatives(base);
            return Err(bare.error(InputErrorKind::NeedsUnit { noun: unit.noun(), write }));
        }
        for suffix in Unit::all_suffixes().filter(|suffix| unit.suffix(suffix).is_none()) {
            if let Some(item) = self.peek(&format!("{base}_{suffix}")) {
                let (suffix, write) = (suffix.to_owned(), unit.alternatives(base));
                return Err(item.error(InputErrorKind::WrongUnit {
                    noun: unit.noun(),
                    suffix,
                    write,
                }));
            }
        }
        self.pick(base, unit)
    }

    /// Returns an optional number with a unit \[SI\].
    pub fn number(&mut self, base: &str, unit: Unit) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        Ok(Some((suffix.to_si)(item.number()?)))
    }

    /// Returns an optional number with a unit that is not negative \[SI\].
    pub fn non_negative_number(
        &mut self,
        base: &str,
        unit: Unit,
    ) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        let value = item.number()?;
        if value < 0.0 {
            Err(item.error(InputErrorKind::Negative { value }))
        } else {
            Ok(Some((suffix.to_si)(value)))
        }
    }

    /// Returns an optional number with a unit that is above zero \[SI\]; `zero` makes the error for
    /// other values.
    pub fn positive(
        &mut self,
        base: &str,
        unit: Unit,
        zero: fn(f64) -> InputErrorKind,
    ) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        let value = item.number()?;
        // A tiny length in millimetres may underflow to 0 in metres.
        let converted = (suffix.to_si)(value);
        if converted > 0.0 { Ok(Some(converted)) } else { Err(item.error(zero(value))) }
    }

    /// Returns an optional vector with a unit \[SI\].
    pub fn vector(&mut self, base: &str, unit: Unit) -> Result<Option<Vector3<f64>>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        Ok(Some(item.vector()?.map(suffix.to_si)))
    }

    /// Returns a required vector with a unit \[SI\].
    pub fn require_vector(&mut self, base: &str, unit: Unit) -> Result<Vector3<f64>, InputError> {
        self.vector(base, unit)?.ok_or_else(|| self.missing(base, unit.alternatives(base)))
    }

    /// Returns an error at the first key that was not read.
    pub fn finish(&self) -> Result<(), InputError> {
        let unknown = self.entries().into_iter().find(|(key, _)| !self.was_read(key));
        match unknown {
            Some((key, item)) => Err(item.error(match self.proper_place(key) {
                Some(place) => InputErrorKind::MisplacedKey { place },
                None => InputErrorKind::UnknownKey {
                    key: shortened(key, 80),
                    meant: item.renamed(&other_names(key, &self.keys_read)),
                    known: self.keys_read.clone(),
                },
            })),
            None => Ok(()),
        }
    }
}

impl<'a, 'i> Item<'a, 'i> {
    /// Returns the value as a section; it must be a table.
    pub fn section(&self) -> Result<Section<'a, 'i>, InputError> {
        let table =
            self.value.as_table().ok_or_else(|| self.wrong_type("a table, { key = value }"))?;
        Ok(self.section_of(table))
    }

    /// Returns another table as a section with the location of this item.
    pub fn section_of(&self, table: &'a DeTable<'i>) -> Section<'a, 'i> {
        Section::new(self.document, self.key.clone(), self.span.clone(), table)
    }
}

/// Sections with some of their keys that are often written in another section.
const SECTION_KEYS: [(&str, &[&str]); 5] = [
    ("", &["gravity_m_s2", "dh", "title"]),
    (
        "data",
        &[
            "files",
            "held_out",
            "joints",
            "position_sigma_mm",
            "position_sigma_m",
            "point_sigma_mm",
            "distance_sigma_mm",
            "surface_sigma_mm",
            "tilt_sigma_deg",
            "orientation_sigma_deg",
            "reference_temperature_C",
            "columns",
            "format",
            "covariates",
        ],
    ),
    ("tool", &["target_m", "target_mm", "payload_kg", "payload_at", "payload_at_m"]),
    ("statics", &["equilibrium"]),
    ("joint", &["alpha_deg", "a_m", "a_mm", "theta_deg", "d_m", "d_mm", "min_deg", "max_deg"]),
];

/// Sections of a joint that are often written at the top level, with their headers.
const PARTS_OF_JOINTS: [(&str, &str); 4] = [
    ("body", "[[joint.body]]"),
    ("beam", "[joint.beam]"),
    ("hoist", "[joint.beam.hoist]"),
    ("mass", "[[joint.body]] or, on a beam, [[joint.beam.mass]]"),
];

/// Returns true if a key belongs to a section directly.
pub(super) fn is_key_of(section: &str, key: &str) -> bool {
    SECTION_KEYS.iter().any(|(name, keys)| *name == section && keys.contains(&key))
}

impl Section<'_, '_> {
    /// Returns the place where an unknown key belongs; `None` if it is a key of no section, or is
    /// similar to a key that is known at its place.
    fn proper_place(&self, key: &str) -> Option<String> {
        let is_top = self.path.is_empty() && self.was_read("joint");
        let part = PARTS_OF_JOINTS.iter().find(|(part, _)| is_top && *part == key);
        if let Some((part, header)) = part {
            return Some(format!(
                "a {part} belongs to a joint; write its header as {header}, below the [[joint]] \
                 that has it"
            ));
        }
        let place = proper_place(key, &self.keys_read)?;
        Some(self.place_above(key).unwrap_or(place))
    }

    /// Returns the place of a key of the section that the header of this one ends, as the line
    /// `[data.columns]` ends `[data]`; `None` for other keys, and for a table within braces.
    fn place_above(&self, key: &str) -> Option<String> {
        let names = self.path.split('.').map(|part| part.split('[').next().unwrap_or_default());
        let names: Vec<&str> = names.collect();
        let outer = names.first().filter(|outer| names.len() > 1 && is_key_of(outer, key))?;
        let before = self.document.text.get(..self.span.start)?;
        let is_header = before.rsplit('\n').next()?.trim_start().starts_with('[');
        is_header.then(|| {
            format!(
                "{key} is a key of [{outer}], which the line [{}] ends; write it above that line",
                names.join(".")
            )
        })
    }

    /// Checks that no key with another value than text belongs to the section above this one.
    pub fn check_names(&self) -> Result<(), InputError> {
        for (key, item) in self.entries() {
            if let Some(place) = self.place_above(key).filter(|_| item.value.as_str().is_none()) {
                return Err(item.error(InputErrorKind::MisplacedKey { place }));
            }
        }
        Ok(())
    }
}

/// Returns the place where an unknown key belongs; `None` if it is a key of no section, or is
/// similar to a key that is `known` at its place.
fn proper_place(key: &str, known: &[String]) -> Option<String> {
    if known.iter().any(|known| one_typo(key, known)) {
        return None;
    }
    if key.contains(['.', '*']) {
        return Some(format!(
            "{key} is a rule for parameters; write it below the line [parameters]"
        ));
    }
    if NAMES.contains(&key) {
        return Some(format!(
            "an effect stands below a line [[effect]]; write that line above {key}"
        ));
    }
    let (section, _) = SECTION_KEYS.iter().find(|(_, keys)| keys.contains(&key))?;
    // A joint with a placement or a leader has no such keys, so its section is the right one.
    if *section == "joint" && known.iter().any(|known| known == "kind") {
        return None;
    }
    Some(match *section {
        "" => format!("{key} is a key of the top level; write it above the first [section]"),
        "joint" => format!("{key} is a key of a joint; write it below its line [[joint]]"),
        "data" if ["columns", "format", "covariates"].contains(&key) => {
            format!("the section {key} is a part of [data]; write [data.{key}]")
        }
        section => format!("{key} is a key of [{section}]; write it below the line [{section}]"),
    })
}
