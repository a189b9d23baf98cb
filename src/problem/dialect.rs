//! Reader of `[data.columns]` and `[data.format]`: tables in the format of other programs.

use std::fmt;

use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location, TableErrorKind};

/// Maximum number of columns in a map.
const MAX_MAPPED_COLUMNS: usize = 10_000;

/// Format of a table and names of its columns, as far as they differ from flexcal's.
#[derive(Debug, Clone, Default)]
pub struct Dialect {
    /// Map from the table's column names to flexcal's.
    pub columns: Vec<ColumnRule>,
    /// Column delimiter; `None` if it is found from the header.
    pub delimiter: Option<Delimiter>,
    /// True if numbers have a decimal comma.
    pub decimal_comma: bool,
    /// Prefix of comment lines.
    pub comment: Option<String>,
    /// Marker of rows in which nothing was measured.
    pub missing: Option<Missing>,
    /// Convention of the angles rx, ry, rz.
    pub rotation: RotationKind,
}

impl Dialect {
    /// Returns the dialect for a table in memory, which has neither delimiters nor comments. If its
    /// rows are `measured`, NaN, by which data frames mark what is missing, marks a row without a
    /// measurement unless the problem names another mark.
    pub(crate) fn in_memory(&self, measured: bool) -> Self {
        let not_a_number = || measured.then(|| Missing::Word("NaN".to_owned()));
        Self {
            delimiter: Some(Delimiter::Byte(b',')),
            decimal_comma: false,
            comment: None,
            missing: self.missing.clone().or_else(not_a_number),
            ..self.clone()
        }
    }
}

/// Convention of the three angles rx, ry, rz of an orientation R.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RotationKind {
    /// Rotation vector: its direction is the axis and its length is the angle.
    #[default]
    Vector,
    /// Rotations about moving axes: R = Rx(rx) Ry(ry) Rz(rz).
    EulerXyz,
    /// Roll, pitch and yaw about fixed axes as in URDF: R = Rz(rz) Ry(ry) Rx(rx).
    RollPitchYaw,
}

/// Entry of `[data.columns]`: a column of the table and its name in flexcal.
#[derive(Debug, Clone)]
pub struct ColumnRule {
    /// Column of the table.
    pub theirs: ColumnSelector,
    /// Name of the column in flexcal.
    pub ours: String,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Selector of a table column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnSelector {
    /// Column given by its name in the header.
    Name(String),
    /// Column given by its place, counted from 1: `"#7"`.
    Place(usize),
    /// Name of the file as the value of every row: `"#file"`.
    File,
}

impl fmt::Display for ColumnSelector {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => f.write_str(name),
            Self::Place(place) => write!(f, "#{place}"),
            Self::File => f.write_str("#file"),
        }
    }
}

/// Separator between the columns of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// Separates columns by one character.
    Byte(u8),
    /// Separates columns by any run of spaces and tabs.
    Spaces,
}

/// Marker of a row in which nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Missing {
    /// Marks a missing position by three numbers, in the unit of the table.
    Position([f64; 3]),
    /// Marks a missing position by a word in one of its cells; the word may be empty.
    Word(String),
}

/// Reads both sections; returns flexcal's format if they are absent.
pub(super) fn read(data: &mut Section<'_, '_>) -> Result<Dialect, InputError> {
    let columns =
        data.section("columns")?.map_or(Ok(Vec::new()), |section| read_columns(&section))?;
    let mut dialect = Dialect { columns, ..Dialect::default() };
    let Some(mut format) = data.section("format")? else { return Ok(dialect) };
    if let Some(item) = format.get("delimiter") {
        let delimiter = match item.any_text()? {
            "tab" => Some(Delimiter::Byte(b'\t')),
            "spaces" | " " => Some(Delimiter::Spaces),
            word => match word.as_bytes() {
                [byte @ (b',' | b';' | b'|' | b'\t' | b':')] => Some(Delimiter::Byte(*byte)),
                _ => None,
            },
        };
        let unknown = || InputErrorKind::UnknownWord {
            word: item.any_text().unwrap_or_default().to_owned(),
            known: &[",", ";", "|", ":", "tab", "spaces"],
        };
        dialect.delimiter = Some(delimiter.ok_or_else(|| item.error(unknown()))?);
    }
    if let Some(comma) = format.word("decimal", &[".", ","], &[false, true])? {
        dialect.decimal_comma = comma;
        if let Some(item) = format
            .peek("decimal")
            .filter(|_| comma && dialect.delimiter == Some(Delimiter::Byte(b',')))
        {
            return Err(item.error(TableErrorKind::DecimalDelimiter));
        }
    }
    let kinds = [RotationKind::Vector, RotationKind::EulerXyz, RotationKind::RollPitchYaw];
    dialect.rotation =
        format.word("rotation", &["vector", "euler-xyz", "rpy"], &kinds)?.unwrap_or_default();
    dialect.comment = format.text("comment")?.map(str::to_owned);
    if let (Some(mark), Some(item)) = (&dialect.comment, format.peek("comment"))
        && format!("{mark}0").parse::<f64>().is_ok()
    {
        return Err(item.error(TableErrorKind::CommentOfNumbers { mark: mark.clone() }));
    }
    if let Some(item) = format.get("missing") {
        dialect.missing = Some(read_missing(item.any_text()?, dialect.decimal_comma));
    }
    format.finish()?;
    Ok(dialect)
}

fn read_columns(section: &Section<'_, '_>) -> Result<Vec<ColumnRule>, InputError> {
    section.check_names()?;
    let entries = section.entries();
    if let Some((_, item)) = entries.first() {
        item.check_count("columns", entries.len(), MAX_MAPPED_COLUMNS)?;
    }
    let rule = |(theirs, item): (&str, super::item::Item<'_, '_>)| {
        let theirs = theirs.trim();
        let place = theirs.strip_prefix('#');
        let theirs = match (place, place.and_then(|number| number.parse().ok())) {
            (Some("file"), _) => ColumnSelector::File,
            (_, Some(place)) if place > 0 => ColumnSelector::Place(place),
            _ => ColumnSelector::Name(theirs.to_owned()),
        };
        Ok(ColumnRule { theirs, ours: item.text()?.trim().to_owned(), location: item.location() })
    };
    entries.into_iter().map(rule).collect()
}

/// Parses `0,0,0` as three numbers (separated by semicolons with a decimal comma) and any other
/// text as a word.
fn read_missing(text: &str, decimal_comma: bool) -> Missing {
    let number = |cell: &str| {
        let cell = cell.trim();
        if decimal_comma { cell.replace(',', ".").parse().ok() } else { cell.parse::<f64>().ok() }
    };
    let numbers = |delimiter: char| text.split(delimiter).map(number).collect::<Option<Vec<f64>>>();
    let found = if text.contains(';') { numbers(';') } else { numbers(',') };
    match found.as_deref() {
        // Adding 0 turns −0 into 0.
        Some(&[x, y, z]) => Missing::Position([x + 0.0, y + 0.0, z + 0.0]),
        _ => Missing::Word(text.trim().to_owned()),
    }
}
