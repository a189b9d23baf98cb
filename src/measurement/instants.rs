//! Times in the cells of a table, as numbers, as dates, and as a date and a time of day in two columns.

use std::borrow::Cow;

use super::join_key::is_time;
use super::table::{Table, shortened};
use super::time::{DateOrder, date_part, date_time, is_ambiguous, number_as_time};
use crate::error::{InputError, TableErrorKind};
use crate::problem::{ColumnSelector, Dialect};

/// Name of a column of dates in flexcal's vocabulary.
const DATE: &str = "date";
/// Names of columns of dates, in lower case, that other programs write.
const DATES: [&str; 3] = [DATE, "datum", "fecha"];
/// Names of columns with the time of day beside them, in lower case.
const TIMES_OF_DAY: [&str; 5] = ["time", "uhrzeit", "zeit", "hora", "time of day"];

/// Returns true for the name of a column with times or with dates.
pub(super) fn is_clock(name: &str) -> bool {
    is_time(name) || name == DATE
}

/// Returns a date and a time of day as one text. Spreadsheets may write midnight behind a date.
fn joined(date: &str, time: &str) -> String {
    format!("{} {time}", date_part(date).trim_end())
}

impl Table {
    /// Finds the order of day and month: by the columns of times and dates if there are any, else by
    /// all. Where it stays unknown, decimal commas make the day likely to stand first.
    pub(super) fn find_date_order(&mut self, dialect: &Dialect) {
        let rows = self.beginning.rows();
        let is_ruled = |place: usize, name: &String| {
            let is_here = |theirs: &ColumnSelector| match theirs {
                ColumnSelector::Name(theirs) => theirs == name,
                ColumnSelector::Place(number) => *number == place + 1,
                ColumnSelector::File => false,
            };
            dialect.columns.iter().any(|rule| is_clock(&rule.ours) && is_here(&rule.theirs))
        };
        let is_clock = |(place, name): &(usize, &String)| {
            let lower = name.to_lowercase();
            let is_named = |names: &[&str]| names.contains(&lower.as_str());
            is_clock(name) || is_named(&DATES) || is_named(&TIMES_OF_DAY) || is_ruled(*place, name)
        };
        let clocks: Vec<usize> =
            self.header.iter().enumerate().filter(is_clock).map(|(place, _)| place).collect();
        let cells = rows.iter().flat_map(|row| row.iter().enumerate());
        let is_chosen = |place: usize| clocks.is_empty() || clocks.contains(&place);
        let chosen = cells.filter(|(place, _)| is_chosen(*place)).map(|(_, cell)| cell.as_str());
        let may_be_day_first = dialect.decimal_comma && self.style.delimiter != ',';
        self.date_order = match DateOrder::of(chosen.collect::<Vec<_>>().join(" ").as_bytes()) {
            DateOrder::Unknown if may_be_day_first && self.beginning.has_decimal_commas() => {
                DateOrder::LikelyDayFirst
            }
            order => order,
        };
    }

    /// Finds a column of dates and one with the time of day, by the rules of `[data.columns]` or by
    /// their names and first cells. A column of the time of day without a rule is called `time`.
    pub(super) fn find_date_columns(&mut self, dialect: &Dialect) {
        let named = |names: &[&str]| {
            self.header.iter().position(|name| names.contains(&&*name.to_lowercase()))
        };
        let ruled = |is_meant: &dyn Fn(&str) -> bool| {
            dialect.columns.iter().filter(|rule| is_meant(&rule.ours)).find_map(|rule| match &rule
                .theirs
            {
                ColumnSelector::Name(theirs) => self.header.iter().position(|name| name == theirs),
                ColumnSelector::Place(number) => {
                    Some(number - 1).filter(|place| *place < self.header.len())
                }
                ColumnSelector::File => None,
            })
        };
        let by_rule = ruled(&is_time);
        let date_by_rule = ruled(&|ours| ours == DATE);
        let are_ruled = by_rule.is_some() && date_by_rule.is_some();
        let date = date_by_rule.or_else(|| named(&DATES));
        let Some(columns @ [date, time]) =
            date.zip(by_rule.or_else(|| named(&TIMES_OF_DAY))).map(|(date, time)| [date, time])
        else {
            return;
        };
        let row = self.beginning.first_row();
        let cell = |place: usize| row.get(place).map_or("", String::as_str);
        let is_instant = |text: &str| {
            date_time(text, self.date_order).is_some() || is_ambiguous(text, self.date_order)
        };
        let text = joined(cell(date), cell(time));
        let is_other_clock = |place: usize, name: &String| place != time && is_time(name);
        let mut names = self.header.iter().enumerate();
        // If rules name both columns, a cell that is no time is an error in its row.
        if !(are_ruled || is_instant(&text))
            || is_instant(cell(time))
            || by_rule.is_none() && names.any(|(place, name)| is_other_clock(place, name))
        {
            return;
        }
        self.date_columns = Some(columns);
        if by_rule.is_none()
            && let Some(name) = self.header.get_mut(time)
        {
            "time".clone_into(name);
        }
    }

    /// Returns the column of dates and the cell of the date that belong to a column with the time of
    /// day; `None` for other columns.
    fn date_of(&self, place: usize) -> Option<&[u8]> {
        let (cells, place, [date, time]) = match self.appended_at(place) {
            Some((appended, place)) => {
                (&appended.row.as_ref()?.cells, place, appended.format.date_columns?)
            }
            None => (&self.record, place, self.date_columns?),
        };
        cells.get(date).filter(|_| place == time)
    }

    /// Returns true for a column of dates that is read with the time of day in another column.
    pub(super) fn is_read_as_date(&self, place: usize) -> bool {
        let (place, columns) = match self.appended_at(place) {
            Some((appended, place)) => (place, appended.format.date_columns),
            None => (place, self.date_columns),
        };
        columns.is_some_and(|[date, _]| date == place)
    }

    /// Returns a cell of the current row with a time as text, and before a time of day the date of
    /// another column.
    pub(super) fn instant(&self, place: usize) -> Result<Cow<'_, str>, InputError> {
        let word = self.text(place)?;
        let date = self.date_of(place).filter(|_| !word.is_empty()).map(String::from_utf8_lossy);
        match date.as_deref().map(str::trim) {
            Some("") => Err(self.cell_error(place, TableErrorKind::DateMissing)),
            Some(date) => Ok(Cow::Owned(joined(date, word))),
            None => Ok(Cow::Borrowed(word)),
        }
    }

    /// Returns a cell of the current row as a time \[s\]: a number, converted by `to_si`, or a date
    /// and time as seconds since 1970.
    pub fn time(&self, place: usize, to_si: fn(f64) -> f64) -> Result<f64, InputError> {
        let word = self.instant(place)?;
        let not_a_time = || {
            let value = shortened(&word);
            match number_as_time(&word) {
                Some(meant) => TableErrorKind::NumberAsTime { value, meant },
                None => TableErrorKind::NotATime { value },
            }
        };
        match date_time(&word, self.date_order(place)) {
            Some(seconds) => Ok(seconds),
            None if word.is_empty() => self.number(place),
            None if is_ambiguous(&word, self.date_order(place)) => {
                let kind = TableErrorKind::AmbiguousDate { value: shortened(&word) };
                Err(self.cell_error(place, kind))
            }
            None if word.bytes().filter(|byte| b"-:T/".contains(byte)).count() > 1
                || !word.is_ascii() =>
            {
                Err(self.cell_error(place, not_a_time()))
            }
            None => match self.number(place).map(to_si) {
                Ok(seconds) if !seconds.is_finite() => Err(self.cell_error(place, not_a_time())),
                other => other,
            },
        }
    }

    /// Returns true if the text of a cell is a date and time.
    pub fn is_instant(&self, cell: &str) -> bool {
        date_time(cell, self.date_order).is_some()
    }

    /// Returns true if a cell of the current row is a date and time.
    pub fn is_date(&self, place: usize) -> bool {
        self.instant(place).is_ok_and(|word| date_time(&word, self.date_order(place)).is_some())
    }
}
