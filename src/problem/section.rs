//! A table of the problem file, read key by key; a key that nobody asked for is an error.

use std::ops::Range;

use nalgebra::Vector3;
use toml::de::DeTable;

use super::item::{Document, Item, join};
use crate::error::{InputError, InputErrorKind, Location, nearest, shortened};
use crate::quantity::{Suffix, Unit};

/// Most tables `[[…]]` of one name: joints, masses of a beam, effects, constraints.
const MOST_TABLES: usize = 100;

/// A table that is being read.
pub(crate) struct Section<'a, 'i> {
    document: &'a Document,
    path: String,
    span: Range<usize>,
    table: &'a DeTable<'i>,
    /// Keys asked for so far.
    known: Vec<String>,
}

impl<'a, 'i> Section<'a, 'i> {
    pub fn new(
        document: &'a Document,
        path: String,
        span: Range<usize>,
        table: &'a DeTable<'i>,
    ) -> Self {
        Self { document, path, span, table, known: Vec::new() }
    }

    /// Where the section begins.
    pub fn location(&self) -> Location {
        let location = self.document.locate(self.span.clone());
        if self.path.is_empty() { location } else { location.with_key(self.path.as_str()) }
    }

    /// A mistake in the section as a whole.
    pub fn error(&self, kind: InputErrorKind) -> InputError {
        self.location().error(kind)
    }

    /// The error of a key that is not there; one that nobody asked for may be meant by it.
    pub fn missing(&self, key: &str, write: impl Into<String>) -> InputError {
        let others =
            self.entries().into_iter().map(|(key, _)| key).filter(|key| !self.asked_for(key));
        let kind = InputErrorKind::MissingKey {
            write: write.into(),
            near: nearest(key, others).map(str::to_owned),
        };
        self.location().with_key(join(&self.path, key)).error(kind)
    }

    fn asked_for(&self, key: &str) -> bool {
        self.known.iter().any(|known| known == key)
    }

    /// Number of keys.
    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// Every key and its value, in the order of the file.
    pub fn entries(&self) -> Vec<(&'a str, Item<'a, 'i>)> {
        let mut entries: Vec<_> = self.table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        let item = |(key, value)| Item::of_key(self.document, &self.path, key, value);
        entries.into_iter().map(|(key, value)| (&**key.get_ref(), item((key, value)))).collect()
    }

    /// The value of a key, without taking note of it.
    pub fn peek(&self, key: &str) -> Option<Item<'a, 'i>> {
        let (key, value) = self.table.get_key_value(key)?;
        Some(Item::of_key(self.document, &self.path, key, value))
    }

    /// The value of a key that may be there.
    pub fn get(&mut self, key: &str) -> Option<Item<'a, 'i>> {
        self.known.push(key.to_owned());
        self.peek(key)
    }

    /// The value of a key that has to be there.
    pub fn require(&mut self, key: &str, write: &str) -> Result<Item<'a, 'i>, InputError> {
        self.get(key).ok_or_else(|| self.missing(key, write))
    }

    /// Text that may be there.
    pub fn text(&mut self, key: &str) -> Result<Option<&'a str>, InputError> {
        self.get(key).map(|item| item.text()).transpose()
    }

    /// One of a few words, with what each stands for.
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

    /// A subsection that may be there.
    pub fn section(&mut self, key: &str) -> Result<Option<Self>, InputError> {
        self.get(key).map(|item| item.section()).transpose()
    }

    /// The tables of `[[key]]`, none if it is not there and no more than can be meant.
    pub fn sections(&mut self, key: &str) -> Result<Vec<Self>, InputError> {
        let Some(item) = self.get(key) else { return Ok(Vec::new()) };
        let all = item.list("a list of tables, each with its header in double brackets")?;
        item.check_count("tables", all.len(), MOST_TABLES)?;
        all.iter().map(Item::section).collect()
    }

    /// The value of the key `base` with one of the suffixes of `unit`, and that suffix.
    pub fn pick(
        &mut self,
        base: &str,
        unit: Unit,
    ) -> Result<Option<(Item<'a, 'i>, Suffix)>, InputError> {
        let mut found: Option<(Item<'a, 'i>, Suffix)> = None;
        let mut first_key = String::new();
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

    /// The same, where `base` has this one unit: no suffix, or that of another unit, is an error.
    pub fn quantity(
        &mut self,
        base: &str,
        unit: Unit,
    ) -> Result<Option<(Item<'a, 'i>, Suffix)>, InputError> {
        if let Some(bare) = self.peek(base).filter(|item| !item.holds_tables()) {
            let write = unit.spelled(base);
            return Err(bare.error(InputErrorKind::NeedsUnit { noun: unit.noun(), write }));
        }
        for suffix in Unit::all_suffixes().filter(|suffix| unit.suffix(suffix).is_none()) {
            if let Some(item) = self.peek(&format!("{base}_{suffix}")) {
                let (suffix, write) = (suffix.to_owned(), unit.spelled(base));
                return Err(item.error(InputErrorKind::WrongUnit {
                    noun: unit.noun(),
                    suffix,
                    write,
                }));
            }
        }
        self.pick(base, unit)
    }

    /// A number with a unit \[SI\].
    pub fn number(&mut self, base: &str, unit: Unit) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        Ok(Some((suffix.to_si)(item.number()?)))
    }

    /// A number with a unit that is not negative \[SI\].
    pub fn not_negative(&mut self, base: &str, unit: Unit) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        let value = item.number()?;
        if value < 0.0 {
            Err(item.error(InputErrorKind::Negative { value }))
        } else {
            Ok(Some((suffix.to_si)(value)))
        }
    }

    /// A number with a unit that is above zero \[SI\]; `zero` makes the error where it is not.
    pub fn positive(
        &mut self,
        base: &str,
        unit: Unit,
        zero: fn(f64) -> InputErrorKind,
    ) -> Result<Option<f64>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        let value = item.number()?;
        // A tiny length in millimetres may become 0 in metres.
        let converted = (suffix.to_si)(value);
        if converted > 0.0 { Ok(Some(converted)) } else { Err(item.error(zero(value))) }
    }

    /// Three numbers with a unit \[SI\].
    pub fn vector(&mut self, base: &str, unit: Unit) -> Result<Option<Vector3<f64>>, InputError> {
        let Some((item, suffix)) = self.quantity(base, unit)? else { return Ok(None) };
        Ok(Some(item.vector()?.map(suffix.to_si)))
    }

    /// Three numbers with a unit that have to be there \[SI\].
    pub fn require_vector(&mut self, base: &str, unit: Unit) -> Result<Vector3<f64>, InputError> {
        self.vector(base, unit)?.ok_or_else(|| self.missing(base, unit.spelled(base)))
    }

    /// Whether the section holds a key that nobody asked for: an error at the first of them.
    pub fn finish(&self) -> Result<(), InputError> {
        let unknown = self.entries().into_iter().find(|(key, _)| !self.asked_for(key));
        match unknown {
            Some((key, item)) => Err(item.error(InputErrorKind::UnknownKey {
                key: shortened(key, 80),
                known: self.known.clone(),
            })),
            None => Ok(()),
        }
    }
}

impl<'a, 'i> Item<'a, 'i> {
    /// A table, as a section.
    pub fn section(&self) -> Result<Section<'a, 'i>, InputError> {
        let table = self.value.as_table().ok_or_else(|| self.wrong_type("a table"))?;
        Ok(self.section_of(table))
    }

    /// A section with this item's place and a table from elsewhere.
    pub fn section_of(&self, table: &'a DeTable<'i>) -> Section<'a, 'i> {
        Section::new(self.document, self.key.clone(), self.span.clone(), table)
    }
}
