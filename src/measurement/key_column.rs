//! Search of the column by which the rows of a table are paired with those of the joint table.

use super::headerless::{holds_numbers, no_header};
use super::join_key::{Key, name_column, time_key};
use super::mapped::reversed;
use super::meaning::is_numbered_or_position;
use super::table::Table;
use super::time::date_time;
use crate::error::{InputError, TableErrorKind};
use crate::problem::{Dialect, JoinRule};

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
