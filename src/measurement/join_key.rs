//! Columns by which the rows of two tables are paired.

use super::headerless::{holds_numbers, no_header};
use super::mapped::reversed;
use super::meaning::is_numbered_or_position;
use super::table::Table;
use super::time::date_time;
use crate::error::{InputError, TableErrorKind};
use crate::problem::{Dialect, JoinRule};

/// Column that pairs rows, and its conversion to seconds if it holds times.
#[derive(Clone, Copy)]
pub(super) struct Key {
    /// Index of the column.
    pub place: usize,
    /// Conversion of the cells to seconds.
    pub to_si: fn(f64) -> f64,
}

/// Returns the index of the column with names of poses, `pose` or else `name`.
pub(super) fn name_column(names: &[String]) -> Option<usize> {
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    place("pose").or_else(|| place("name"))
}

/// Conversion of a number to its SI unit.
type ToSi = fn(f64) -> f64;

/// Units of columns with times, each with its conversion to seconds. Controllers log milliseconds.
pub(super) const TIME_UNITS: [(&str, ToSi); 2] = [("s", |x| x), ("ms", |x| x / 1000.0)];

/// Returns the column with times: one with a unit, else `time`, whose cells must be dates.
pub(super) fn time_key(names: &[String]) -> Option<Key> {
    let place = |wanted: &str| names.iter().position(|name| name == wanted);
    let with_unit = TIME_UNITS.iter().find_map(|(unit, to_si)| {
        Some(Key { place: place(&format!("time_{unit}"))?, to_si: *to_si })
    });
    with_unit.or_else(|| place("time").map(|place| Key { place, to_si: |_| f64::NAN }))
}

/// Returns true for the name of a column with times.
pub(super) fn is_time(name: &str) -> bool {
    let has_unit = |unit: &str| TIME_UNITS.iter().any(|(known, _)| *known == unit);
    name == "time" || name.strip_prefix("time_").is_some_and(has_unit)
}

/// Returns the column of a table, whose columns have the `names`, by which a rule pairs rows; `None`
/// for a join by order.
///
/// # Errors
/// Returns an error if there is none, or a rule of the map is written the wrong way round.
pub(super) fn find_key(
    rule: JoinRule,
    table: &Table,
    (names, dialect): (&[String], &Dialect),
) -> Result<Option<Key>, InputError> {
    if let Some(error) = dialect.columns.iter().find_map(|rule| reversed(rule, table)) {
        return Err(error);
    }
    let is_by_time = matches!(rule, JoinRule::Time { .. });
    let (key, write) = match rule {
        JoinRule::Order => return Ok(None),
        JoinRule::Name => {
            let place = name_column(names);
            (place.map(|place| Key { place, to_si: std::convert::identity }), "pose or name")
        }
        JoinRule::Time { .. } => (time_key(names), "time_s or time"),
    };
    let first_row = table.beginning.first_row();
    let is_instant = |place: usize| {
        let cell = first_row.get(place).map_or("", String::as_str);
        date_time(cell, table.date_order).is_some()
    };
    let is_unknown = |(_, (ours, theirs)): &(usize, (&String, &String))| {
        ours == theirs && !ours.is_empty() && !is_numbered_or_position(ours)
    };
    let mut unknown: Vec<(usize, (&String, &String))> =
        names.iter().zip(&table.header).enumerate().filter(is_unknown).collect();
    // The first one is the example of a column that may be meant.
    unknown.sort_by_key(|(place, _)| !(is_by_time && is_instant(*place)));
    let unknown = unknown.into_iter().map(|(_, (name, _))| name.clone()).collect();
    let kind = if holds_numbers(&table.header) {
        no_header(&table.header)
    } else {
        TableErrorKind::MissingColumn { write: write.to_owned(), near: None, unknown }
    };
    key.map(Some).ok_or_else(|| table.column(write).error(kind))
}
