//! What the warnings about ignored columns say once the first row is known, and whether a column
//! `time` contains dates.

use super::columns::{Column, Columns};
use super::role::Role;
use super::table::{Table, shortened};
use super::time::{assumed, is_ambiguous};
use crate::error::{InputError, Location, TableErrorKind, Warning, WarningKind};
use crate::quantity::Unit;

/// Smallest number of ignored columns for which one warning lists all.
const MIN_LISTED: usize = 4;
/// Largest number of columns that it names.
const MAX_NAMED: usize = 100;

/// Replaces the warnings that columns are ignored without a similar known name by one for all of
/// them, if there are many.
pub(super) fn listed_together(ignored: &mut Vec<Warning>) {
    let is_plain = |warning: &Warning| {
        matches!(warning.kind, WarningKind::ColumnIgnored { meant: None, is_angle: false })
    };
    let plain: Vec<Warning> = ignored.iter().filter(|warning| is_plain(warning)).cloned().collect();
    let name = |warning: &Warning| {
        let key = warning.location.key.as_deref().unwrap_or_default();
        key.strip_prefix("column ").unwrap_or(key).to_owned()
    };
    if let Some(first) = plain.first().filter(|_| plain.len() >= MIN_LISTED) {
        let location = Location { key: None, ..first.location.clone() };
        let names = plain.iter().take(MAX_NAMED).map(name).collect();
        let more = plain.len().saturating_sub(MAX_NAMED);
        ignored.retain(|warning| !is_plain(warning));
        let kind = WarningKind::ColumnsIgnored { names, more };
        ignored.push(Warning { location, kind });
    }
}

impl Columns {
    /// Replaces the warnings that columns of dates are ignored by one that says how to read them as
    /// times. `ignored` are the warnings about the columns of this table.
    pub fn propose_times(&self, table: &Table, ignored: &mut Vec<Warning>) {
        if self.has(Role::Time) {
            return;
        }
        let is_read = |place: usize| self.read.iter().any(|column| column.place == place);
        let dates =
            (0..table.header.len()).filter(|&place| !is_read(place) && table.is_date(place));
        let Some(name) = dates.map(|place| table.name_of(place)).next() else { return };
        let location = table.column(name);
        let is_replaced = |warning: &Warning| {
            matches!(warning.kind, WarningKind::ColumnIgnored { .. })
                && warning.location == location
        };
        ignored.retain(|warning| !is_replaced(warning));
        let kind = WarningKind::DatesIgnored { name: shortened(name) };
        ignored.push(Warning { location, kind });
    }

    /// Keeps a column `time` without a unit if its first cell is a date and time; otherwise the
    /// column is ignored with a warning. Also warns if the order of day and month is a guess.
    ///
    /// # Errors
    /// Returns an error if `[data.columns]` maps the column to `time`, and its first cell is
    /// neither a time nor a number.
    pub fn decide_time_column(
        &mut self,
        table: &Table,
        warnings: &mut Vec<Warning>,
    ) -> Result<(), InputError> {
        let times = self.read.iter().find(|column| column.role == Role::Time);
        if let Some(place) = times.map(|column| column.place)
            && let value = table.instant(place)?
            && let Some((read, order)) = assumed(&value, table.date_order(place))
        {
            let kind = WarningKind::DateOrderAssumed { value: shortened(&value), read, order };
            warnings.push(Warning { location: table.column(table.name_of(place)), kind });
        }
        let has_times =
            |column: &Column| (column.to_si)(0.0).is_finite() || table.is_date(column.place);
        if let Some(place) =
            self.read.iter().position(|column| column.role == Role::Time && !has_times(column))
        {
            let column = self.read.remove(place);
            let (theirs, value) =
                (table.name_of(column.place), shortened(&table.instant(column.place)?));
            let is_number = value.is_empty() || table.number(column.place).is_ok();
            if is_ambiguous(&value, table.date_order(column.place)) {
                return Err(table
                    .column(theirs)
                    .at_line(table.line_of(column.place))
                    .error(TableErrorKind::AmbiguousDate { value }));
            }
            if !is_number && theirs != "time" {
                return Err(table
                    .column(theirs)
                    .at_line(table.line_of(column.place))
                    .error(TableErrorKind::NotATime { value }));
            }
            let write = Unit::Time.alternatives("time");
            let kind = if is_number {
                WarningKind::UnitIgnored { write }
            } else {
                WarningKind::NotADate { value, write }
            };
            warnings.push(Warning { location: table.column(theirs), kind });
        }
        Ok(())
    }
}
