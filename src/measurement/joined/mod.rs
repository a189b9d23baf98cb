//! Join of a table of measured positions with a table of joint coordinates.

#[deny(clippy::indexing_slicing)]
mod on_the_way;

use std::collections::HashMap;
use std::path::PathBuf;

use super::appended::{JointRow, JointTableFormat};
use super::clocks::{
    ClockShift, Stops, best_shift, clock_jump, median_step, moving_arm, nearest, rounded_up,
    shifts_by_rows,
};
use super::instants::is_clock;
use super::join_key::{Key, name_column, time_key};
use super::joined_row::LogRow;
use super::key_column::find_key;
use super::mapped::Names;
use super::paired_times::{TimedPair, are_whole_minutes, order_contradicted};
use super::spelling::{misplaced, quoted, same_but_for_spelling, usual_difference};
use super::table::{Table, shortened};
use super::time::shown;
use crate::error::{ClockOffset, InputError, Location, TableErrorKind, Warning, WarningKind};
use crate::problem::{Dialect, JoinRule, JointLog, Problem};
use crate::quantity::format::two_digits;

/// Maximum number of measured rows without a partner that a warning lists.
const MAX_LISTED_ROWS: usize = 10;
/// Median time between paired rows above which the pairing is suspect \[s\]. The clocks may then
/// differ, so their offset is searched.
const MAX_PLAUSIBLE_MEDIAN_GAP: f64 = 0.5;
/// Smallest number of measured rows with which the pairing as a whole is checked.
const MIN_CHECKED_ROWS: usize = 4;
/// Number of measured rows of which one may have another partner with the clocks moved.
const MIN_ROWS_PER_ODD_PARTNER: usize = 20;

/// Rows of the joint table, with the keys by which they are paired with measured rows.
#[derive(Default)]
pub(super) struct JoinedLog {
    rule: JoinRule,
    /// Place of the declaration in the problem.
    location: Location,
    header: Vec<String>,
    /// Format of the first file; `None` before it has been read.
    format: Option<JointTableFormat>,
    /// Names of the joint table's columns in flexcal's vocabulary.
    names: Vec<String>,
    rows: Vec<LogRow>,
    /// Index of the row with each name, for a join by name.
    of_name: HashMap<String, usize>,
    /// Error of each name that several rows have, for measured rows that ask for it.
    repeated: HashMap<String, InputError>,
    /// Row indices in the order of their times, for a join by time.
    by_time: Vec<usize>,
    /// Times of the rows in ascending order, on the clock of the measurements \[s\].
    log_times: Vec<f64>,
    /// Times in which the arm stands.
    stops: Stops,
    /// Column in the current table by which rows are paired; `None` for a join by order.
    key: Option<Key>,
    /// Partner of the current measured row, by its index.
    partner: Option<usize>,
    /// Measured rows of each row that has some, by its index.
    measured: HashMap<usize, Vec<usize>>,
    /// Number of measured rows for which a partner has been searched.
    requested: usize,
    /// Places of the measured rows without a partner.
    unpaired: Vec<Location>,
    /// Number of measured rows with a partner.
    paired: usize,
    text_warnings: Vec<Warning>,
    /// Names of the measured rows without a partner, for a join by name.
    unpaired_names: Vec<String>,
    /// Column of names in the current table and in the joint table, for a join by order.
    name_columns: Option<(usize, usize)>,
    /// Names of the measured and of the joint row of each pair by order whose names differ.
    unlike_pairs: Vec<[String; 2]>,
    /// Times of the measured rows \[s\], for a join by time.
    times: Vec<f64>,
    /// Column of the times in the current table of measurements; `None` without such a column or for
    /// a join by name.
    clock: Option<Key>,
    /// Times of the pairs that are not joined by name.
    timed_pairs: Vec<TimedPair>,
}

impl JoinedLog {
    /// Reads the joint table that the problem declares.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, its columns differ from those of the first, the
    /// key column is missing.
    pub fn read(log: &JointLog, problem: &Problem) -> Result<Self, InputError> {
        let dialect = &problem.data.dialect;
        let mut joined = Self { rule: log.by, location: log.location.clone(), ..Self::default() };
        for file in &log.files {
            joined.read_file(Table::open(file, dialect, || log.missing(file))?, dialect)?;
        }
        let mut by_time: Vec<usize> = (0..joined.rows.len()).collect();
        let time = |row: &usize| joined.rows.get(*row).map_or(f64::NAN, |row| row.time);
        by_time.sort_by(|a, b| time(a).total_cmp(&time(b)));
        joined.log_times = by_time.iter().map(time).collect();
        let key = time_key(&joined.names).map(|key| key.place);
        let timed = by_time.iter().filter_map(|&row| joined.rows.get(row));
        joined.stops =
            Stops::of(timed.map(|row| (row.time, &row.source.cells)), &joined.names, key);
        joined.by_time = by_time;
        if joined.rows.is_empty() {
            return Err(log.location.clone().error(TableErrorKind::NoDataFiles));
        }
        Ok(joined)
    }

    /// Reads the rows of one file of the joint table.
    fn read_file(&mut self, mut table: Table, dialect: &Dialect) -> Result<(), InputError> {
        table.find_decimal_mark();
        if self.header.is_empty() {
            self.header.clone_from(&table.header);
            self.format = Some(table.joint_table_format());
            let names = Names::map_present(&table, dialect);
            self.names = names.into_iter().map(str::to_owned).collect();
        } else if self.header != table.header {
            let first = self.rows.first().map(|row| row.source.file.clone()).unwrap_or_default();
            let different = |name: &&String| !self.header.contains(*name);
            let name = table.header.iter().find(different);
            let kind = TableErrorKind::ColumnsDiffer { other: first, has: false };
            return Err(table.column(name.map_or("", String::as_str)).error(kind));
        }
        let key = find_key(self.rule, &table, (&self.names, dialect))?;
        let clock = time_key(&self.names).filter(|_| self.rule == JoinRule::Order);
        while table.next_row()? {
            let mut time = f64::NAN;
            match (self.rule, key) {
                (JoinRule::Time { .. }, Some(key)) => {
                    let (_, offset) = self.rule.times().unwrap_or_default();
                    time = table.time(key.place, key.to_si)? + offset;
                }
                (JoinRule::Name, Some(key)) => {
                    let name = table.name(key.place)?.to_owned();
                    if let Some(&first) = self.of_name.get(&name) {
                        let line = self.rows.get(first).map_or(0, |row| row.source.line);
                        let timed = time_key(&self.names).is_some();
                        let kind = TableErrorKind::RepeatedPose { name: name.clone(), line, timed };
                        self.repeated.entry(name).or_insert(table.cell_error(key.place, kind));
                    } else {
                        self.of_name.insert(name, self.rows.len());
                    }
                }
                _ => {
                    let of_row = clock.and_then(|key| table.time(key.place, key.to_si).ok());
                    time = of_row.unwrap_or(f64::NAN);
                }
            }
            let (file, line, cells) = (table.file.clone(), table.line(), table.cells().clone());
            let source = JointRow { file, line, cells };
            self.rows.push(LogRow { source, time, uses: 0, configuration: Vec::new() });
        }
        self.text_warnings.extend(table.text_warnings());
        Ok(())
    }

    /// Appends to a table of measured rows the columns that only the joint table has.
    ///
    /// # Errors
    /// Returns an error if the table lacks the key column.
    pub fn extend(&mut self, table: &mut Table, dialect: &Dialect) -> Result<(), InputError> {
        let names: Vec<String> =
            Names::map_present(table, dialect).into_iter().map(str::to_owned).collect();
        self.key = find_key(self.rule, table, (&names, dialect))?;
        self.clock = time_key(&names).filter(|_| self.rule != JoinRule::Name);
        if self.rule == JoinRule::Order {
            self.name_columns = name_column(&names).zip(name_column(&self.names));
        }
        let is_new = |place: &usize| {
            let (name, header) = (self.names.get(*place), self.header.get(*place));
            let is_key =
                |name: &String| matches!(self.rule, JoinRule::Time { .. }) && is_clock(name);
            name.is_some_and(|name| !names.contains(name) && !is_key(name))
                && header.is_some_and(|header| !table.header.contains(header))
        };
        let places: Vec<usize> = (0..self.header.len()).filter(is_new).collect();
        let headers: Vec<String> =
            places.iter().filter_map(|&place| self.header.get(place).cloned()).collect();
        if let Some(format) = self.format.clone() {
            table.append_columns(headers.into_iter(), places, format);
        }
        Ok(())
    }

    /// Appends the cells of the first joint row to the current row of a table, so that the format
    /// of the appended columns can be found before rows are paired.
    pub fn show_first_row(&self, table: &mut Table) {
        if let Some(row) = self.rows.first() {
            table.append_row(&row.source);
        }
    }

    /// Appends the cells of the paired joint row to the current measured row; returns false if it
    /// has no partner.
    ///
    /// # Errors
    /// Returns an error if the key cell of the row is empty or invalid, or if several joint rows have
    /// its name.
    pub fn complete(&mut self, table: &mut Table) -> Result<bool, InputError> {
        self.partner = match (self.rule, self.key) {
            (JoinRule::Name, Some(key)) => {
                let name = table.name(key.place)?;
                if let Some(error) = self.repeated.remove(name) {
                    return Err(error);
                }
                let partner = self.of_name.get(name).copied();
                if partner.is_none() {
                    self.unpaired_names.push(name.to_owned());
                }
                partner
            }
            (JoinRule::Time { .. }, Some(key)) => {
                let (tolerance, _) = self.rule.times().unwrap_or_default();
                let time = table.time(key.place, key.to_si)?;
                self.times.push(time);
                nearest(&self.log_times, time)
                    .filter(|(_, gap)| *gap <= tolerance)
                    .and_then(|(place, _)| self.by_time.get(place).copied())
            }
            _ => Some(self.requested).filter(|&row| row < self.rows.len()),
        };
        self.requested += 1;
        let Some(row) = self.partner.and_then(|partner| self.rows.get_mut(partner)) else {
            self.unpaired.push(Location::file(&table.file).at_line(table.line()));
            return Ok(false);
        };
        row.uses += 1;
        self.paired += 1;
        if let Some((place, of_log)) = self.name_columns
            && let Ok(name) = table.text(place)
        {
            let other = String::from_utf8_lossy(row.source.cells.get(of_log).unwrap_or_default());
            if !name.is_empty() && name != other.trim() {
                self.unlike_pairs.push([name.to_owned(), other.trim().to_owned()]);
            }
        }
        if let Some(clock) = self.clock
            && let Ok(measured) = table.time(clock.place, clock.to_si)
        {
            let place = Location::file(&table.file).at_line(table.line());
            let log_place = row.place();
            self.timed_pairs.push(TimedPair { measured, logged: row.time, place, log_place });
        }
        table.append_row(&row.source);
        Ok(true)
    }

    /// Returns the times between measured rows and the nearest row of the log, in ascending order
    /// \[s\]. If `is_unpaired` is true, the measured rows are those without a partner, else those
    /// with one. Empty unless the tables are joined by time.
    fn gaps(&self, is_unpaired: bool) -> Vec<f64> {
        let Some((tolerance, _)) = self.rule.times() else { return Vec::new() };
        let gap = |time: &f64| nearest(&self.log_times, *time).map(|(_, gap)| gap);
        let mut gaps: Vec<f64> = self.times.iter().filter_map(gap).collect();
        gaps.retain(|gap| (*gap > tolerance) == is_unpaired);
        gaps.sort_by(f64::total_cmp);
        gaps
    }

    /// Returns, in words, the median time between a measured row without a partner and the nearest
    /// row of the log; `None` if there is no such row, or if the tables are not joined by time.
    fn gap(&self) -> Option<String> {
        let gaps = self.gaps(true);
        Some(format!("{:.1} s", gaps.get(gaps.len() / 2)?))
    }

    /// Returns the tolerance with which all measured rows have a partner, if it is at most twice that
    /// of the problem.
    fn sufficient_tolerance(&self) -> Option<String> {
        let (tolerance, _) = self.rule.times()?;
        let most = self.gaps(true).last().copied()?;
        (most <= 2.0 * tolerance).then(|| rounded_up(most))
    }

    /// Returns the error that the tolerance is smaller than the usual time between partners. `None`
    /// unless nearly all rows without a partner are far nearer to a row of the log than its rows to
    /// each other, which other clocks would hardly give.
    fn small_tolerance(&self) -> Option<TableErrorKind> {
        let gaps = self.gaps(true);
        let (usual, most) = (*gaps.get(gaps.len() / 2)?, *gaps.get(gaps.len() * 9 / 10)?);
        let step = median_step(&self.log_times)?;
        (gaps.len() >= MIN_CHECKED_ROWS && 10.0 * most < step).then(|| {
            TableErrorKind::ToleranceTooSmall {
                left: self.unpaired.len(),
                rows: self.requested,
                gap: format!("{} s", two_digits(usual, 3)),
                step: format!("{} s", two_digits(step, 3)),
                tolerance: rounded_up(2.0 * most),
            }
        })
    }

    /// Returns the shift of the log with which the rows of both tables pair best, with the offset of
    /// the clocks that gives it; `None` if the tables are not joined by time or no shift is certain.
    fn shift(&self) -> Option<(ClockShift, ClockOffset)> {
        let (tolerance, offset) = self.rule.times()?;
        let shift = best_shift(&self.times, (&self.log_times, &self.stops))?;
        let needs_more = shift.gap > tolerance;
        let found = ClockOffset {
            seconds: ((offset + shift.seconds) * 1e3).round() / 1e3,
            tolerance: needs_more.then(|| rounded_up(shift.gap).parse().ok()).flatten(),
            is_clear: shift.is_clear(&self.times, (&self.log_times, &self.stops)),
        };
        Some((shift, found))
    }

    /// Returns for each number of rows, by which positions may come after their configurations, the
    /// value of `offset_s` that pairs them so \[s\].
    pub fn offsets_by_rows(&self) -> Vec<(i8, f64)> {
        let Some((tolerance, offset)) = self.rule.times() else { return Vec::new() };
        let shifts = shifts_by_rows(&self.times, &self.log_times, tolerance);
        shifts.into_iter().map(|(by, shift)| (by, offset + shift)).collect()
    }

    /// Returns true if a shift gives more than the odd measured row a partner of another stop.
    fn changes_partners(&self, shift: ClockShift) -> bool {
        let partner = |time: f64| self.stops.nearest(time);
        let is_changed = |time: &&f64| partner(**time) != partner(**time - shift.seconds);
        self.times.iter().filter(is_changed).count() > self.times.len() / MIN_ROWS_PER_ODD_PARTNER
    }

    /// Returns the row of the log that is the partner of most measured rows because its time is the
    /// first or the last of the log.
    fn common_partner(&self) -> Option<&LogRow> {
        let ends = [self.by_time.first(), self.by_time.last()].into_iter().flatten();
        ends.filter_map(|&row| self.rows.get(row))
            .find(|row| self.log_times.len() > 1 && 2 * row.uses > self.requested)
    }

    /// Checks the pairing as a whole.
    ///
    /// # Errors
    /// Returns an error if no measured row has a partner, or if names or times show that most rows
    /// are paired wrongly or not at all. It also returns an error if most rows have the same,
    /// distant partner, or if tables that are joined by order differ in their numbers of rows.
    fn check_pairing(&self) -> Result<(), InputError> {
        let error = |kind: TableErrorKind| Err(self.location.clone().error(kind));
        let (left, rows, logged) = (self.unpaired.len(), self.requested, self.rows.len());
        let shift = self.shift();
        let offset = shift.map(|(_, offset)| offset);
        // An instrument may also measure between poses.
        let used = self.rows.iter().filter(|row| row.uses > 0).count();
        let are_most_left = 2 * left > rows && 2 * used < logged;
        if are_most_left
            && let Some((difference, pair)) =
                usual_difference(&self.unpaired_names, self.unused_names())
        {
            let pair = quoted(pair);
            return error(TableErrorKind::NamesWrittenOtherwise { left, rows, difference, pair });
        }
        if are_most_left
            && shift.as_ref().is_none_or(|(shift, _)| shift.gap > MAX_PLAUSIBLE_MEDIAN_GAP)
            && let Some(table) = self.table_without_seconds()
        {
            return error(TableErrorKind::SecondsLost { table });
        }
        if let Some(error_kind) = self.small_tolerance().filter(|_| are_most_left) {
            return error(error_kind);
        }
        if self.paired == 0 && self.requested > 0 {
            let (gap, keys) = (self.gap(), self.keys());
            return error(TableErrorKind::NothingJoined { gap, keys, offset });
        }
        if self.rule == JoinRule::Order && logged != rows {
            return error(TableErrorKind::OtherRowsToPair { logged, rows });
        }
        if rows < MIN_CHECKED_ROWS {
            return Ok(());
        }
        if let Some(pair) = misplaced(&self.unlike_pairs, rows) {
            return error(TableErrorKind::OrderContradicted { pair: quoted(pair) });
        }
        if !matches!(self.rule, JoinRule::Time { .. }) {
            return Ok(());
        }
        if are_most_left {
            let (keys, gap) = (self.keys().map(Box::new), self.gap());
            return error(TableErrorKind::MostUnpaired { left, rows, gap, keys, offset });
        }
        let gaps = self.gaps(false);
        let usual = gaps.get(gaps.len() / 2).copied().unwrap_or(0.0);
        let is_of_stops = shift.is_some_and(|(shift, _)| shift.is_of_stops);
        if usual <= MAX_PLAUSIBLE_MEDIAN_GAP && 4 * left <= rows && !is_of_stops {
            return Ok(());
        }
        if let Some(row) = self.common_partner() {
            let partner = row.place().to_string();
            let keys = self.keys().map(Box::new);
            let same = row.uses;
            return error(TableErrorKind::CommonPartner { same, rows, partner, keys, offset });
        }
        match shift {
            Some((shift, offset)) if self.changes_partners(shift) => {
                let gap = format!("{usual:.1} s");
                error(TableErrorKind::ClocksDiffer { gap, offset })
            }
            _ => Ok(()),
        }
    }

    /// Returns the name of the table whose times are whole minutes while those of the other are
    /// not. `None` if there is no such table, or if the tables are not joined by time.
    fn table_without_seconds(&self) -> Option<&'static str> {
        let (_, offset) = self.rule.times()?;
        if self.times.len().min(self.log_times.len()) < MIN_CHECKED_ROWS {
            return None;
        }
        let measured = are_whole_minutes(self.times.iter().copied());
        match (measured, are_whole_minutes(self.log_times.iter().map(|time| time - offset))) {
            (true, false) => Some("measurements"),
            (false, true) => Some("joint table"),
            _ => None,
        }
    }

    /// Returns the names of the joint table that are no partner.
    fn unused_names(&self) -> Vec<&str> {
        let uses = |row: &usize| self.rows.get(*row).map(|row| row.uses);
        let unused = self.of_name.iter().filter(|(_, row)| uses(row) == Some(0));
        unused.map(|(name, _)| &**name).collect()
    }

    /// Returns examples of the keys of both tables for a message: one name of each, or the ranges
    /// of their times; `None` for a join by order.
    fn keys(&self) -> Option<[String; 2]> {
        if let Some(name) = self.unpaired_names.first() {
            let log = self.of_name.iter().min_by_key(|(_, row)| **row)?.0;
            return Some([name, log].map(|name| format!("\"{}\"", shortened(name))));
        }
        let time = |row: Option<&usize>| self.rows.get(*row?).map(|row| row.time);
        let log = [time(self.by_time.first())?, time(self.by_time.last())?];
        let range = |[first, last]: [f64; 2]| format!("{} to {}", shown(first), shown(last));
        let first = self.times.iter().copied().reduce(f64::min)?;
        let last = self.times.iter().copied().reduce(f64::max)?;
        Some([range([first, last]), range(log)])
    }

    /// Returns the files of the joint table.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.rows.iter().map(|row| row.source.file.clone()).collect();
        files.dedup();
        files
    }

    /// Returns warnings about rows without a partner. A joint table that is joined by time usually
    /// has more rows than were measured, so its unused rows are not reported.
    ///
    /// # Errors
    /// Returns an error if no row has a partner, or if the pairing as a whole is implausible.
    pub fn warnings(&self) -> Result<Vec<Warning>, InputError> {
        self.check_pairing()?;
        let is_unused = |row: &&LogRow| row.uses == 0 && self.rule == JoinRule::Name;
        let unused = self.rows.iter().filter(is_unused);
        let unused: Vec<_> = unused.map(LogRow::place).collect();
        // Measured rows are listed, because they are lost; unused joint rows are only counted.
        let pairs = same_but_for_spelling(&self.unpaired_names, self.unused_names());
        let alike = pairs.first().map(|&pair| (pairs.len(), quoted(pair)));
        let warning = |rows: &[Location], gap: Option<String>, listed: usize| {
            let others = rows.iter().skip(1).take(listed).map(ToString::to_string).collect();
            let alike = alike.clone().filter(|_| listed > 0);
            let (location, tolerance) = (rows.first()?.clone(), self.sufficient_tolerance());
            let rows = rows.len();
            let kind = WarningKind::WithoutPartner { rows, others, gap, tolerance, alike };
            Some(Warning { location, kind })
        };
        let unpaired =
            [warning(&self.unpaired, self.gap(), MAX_LISTED_ROWS), warning(&unused, None, 0)];
        let jump = clock_jump(self.rule, (&self.times, &self.log_times), self.unpaired.first());
        let others = unpaired.into_iter().flatten();
        let by_order = if self.rule == JoinRule::Order { &*self.timed_pairs } else { &[] };
        let others = others.chain(jump.or_else(|| order_contradicted(by_order)));
        let shift =
            || self.shift().map(|(shift, offset)| (shift.seconds, format!("{:?}", offset.seconds)));
        let others = others.chain(moving_arm((&self.timed_pairs, &self.stops), shift));
        Ok(self.text_warnings.iter().cloned().chain(others).collect())
    }
}
