//! `[data.columns]` and `[data.format]`: tables as other programs write them.

use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};

/// Most columns of a map.
const MOST_COLUMNS: usize = 10_000;

/// How tables are written and what their columns are called, where that is not as flexcal writes
/// them.
#[derive(Debug, Clone, Default)]
pub struct Dialect {
    /// What columns stand for, by their names in the table.
    pub columns: Vec<ColumnRule>,
    /// What sets columns apart; `None`: found from the header.
    pub delimiter: Option<Delimiter>,
    /// Whether numbers have a decimal comma.
    pub decimal_comma: bool,
    /// With what lines begin that say nothing.
    pub comment: Option<String>,
    /// What stands where nothing was measured.
    pub missing: Option<Missing>,
    /// What rx, ry and rz are.
    pub rotation: RotationKind,
}

impl Dialect {
    /// The same of a table in memory, whose cells need nothing to set them apart.
    pub(crate) fn in_memory(&self) -> Self {
        Self {
            delimiter: Some(Delimiter::Byte(b',')),
            decimal_comma: false,
            comment: None,
            ..self.clone()
        }
    }
}

/// What the three angles rx, ry, rz of an orientation R are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RotationKind {
    /// A rotation vector: its direction is the axis, its length the angle.
    #[default]
    Vector,
    /// R = Rx(rx) Ry(ry) Rz(rz): about axes that turn along.
    EulerXyz,
    /// R = Rz(rz) Ry(ry) Rx(rx): roll, pitch and yaw about axes that stay, as in URDF.
    RollPitchYaw,
}

/// One line of `[data.columns]`: theirs = ours.
#[derive(Debug, Clone)]
pub struct ColumnRule {
    /// Which column of the table.
    pub theirs: ColumnOf,
    /// What flexcal calls it.
    pub ours: String,
    /// For errors.
    pub location: Location,
}

/// A column of a table.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ColumnOf {
    /// By its name in the header.
    Name(String),
    /// By its place, counted from 1: `"#7"`.
    Place(usize),
    /// The name of the file, in every row: `"#file"`.
    File,
}

/// What sets columns apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// One character.
    Byte(u8),
    /// Any run of spaces and tabs.
    Spaces,
}

/// What the position of a row is where nothing was measured.
#[derive(Debug, Clone, PartialEq)]
pub enum Missing {
    /// These three numbers, in the unit of the table.
    Position([f64; 3]),
    /// One of its cells is this word; the empty one is a word too.
    Word(String),
}

/// What the two sections say; as flexcal writes where they are not there.
pub(super) fn read(data: &mut Section<'_, '_>) -> Result<Dialect, InputError> {
    let columns = data.section("columns")?.map_or(Ok(Vec::new()), |section| columns(&section))?;
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
            return Err(item.error(InputErrorKind::DecimalDelimiter));
        }
    }
    let kinds = [RotationKind::Vector, RotationKind::EulerXyz, RotationKind::RollPitchYaw];
    dialect.rotation =
        format.word("rotation", &["vector", "euler-xyz", "rpy"], &kinds)?.unwrap_or_default();
    dialect.comment = format.text("comment")?.map(str::to_owned);
    if let Some(item) = format.get("missing") {
        dialect.missing = Some(missing(item.any_text()?, dialect.decimal_comma));
    }
    format.finish()?;
    Ok(dialect)
}

fn columns(section: &Section<'_, '_>) -> Result<Vec<ColumnRule>, InputError> {
    let entries = section.entries();
    if let Some((_, item)) = entries.first() {
        item.check_count("columns", entries.len(), MOST_COLUMNS)?;
    }
    let rule = |(theirs, item): (&str, super::item::Item<'_, '_>)| {
        let theirs = theirs.trim();
        let place = theirs.strip_prefix('#');
        let theirs = match (place, place.and_then(|number| number.parse().ok())) {
            (Some("file"), _) => ColumnOf::File,
            (_, Some(place)) if place > 0 => ColumnOf::Place(place),
            _ => ColumnOf::Name(theirs.to_owned()),
        };
        Ok(ColumnRule { theirs, ours: item.text()?.trim().to_owned(), location: item.location() })
    };
    entries.into_iter().map(rule).collect()
}

/// `0,0,0` as three numbers, with semicolons where numbers have commas; anything else as a word.
fn missing(text: &str, decimal_comma: bool) -> Missing {
    let number = |cell: &str| {
        let cell = cell.trim();
        if decimal_comma { cell.replace(',', ".").parse().ok() } else { cell.parse::<f64>().ok() }
    };
    let numbers = |delimiter: char| text.split(delimiter).map(number).collect::<Option<Vec<f64>>>();
    let found = if text.contains(';') { numbers(';') } else { numbers(',') };
    match found.as_deref() {
        // Zero has no sign.
        Some(&[x, y, z]) => Missing::Position([x + 0.0, y + 0.0, z + 0.0]),
        _ => Missing::Word(text.trim().to_owned()),
    }
}
