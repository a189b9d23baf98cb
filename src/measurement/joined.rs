//! Join of a table of measured positions with a table of joint coordinates.

use std::collections::HashMap;
use std::path::PathBuf;

use csv::ByteRecord;

use super::cell_style::CellStyle;
use super::mapped::Names;
use super::table::{Table, shortened};
use super::time::shown;
use crate::error::{InputError, InputErrorKind, Location, TableErrorKind, Warning, WarningKind};
use crate::problem::{Dialect, JoinRule, JointLog, Problem};
use crate::quantity::Unit;

/// Maximum number of rows without a partner that a warning lists.
const MAX_LISTED_ROWS: usize = 10;

/// Rows of the joint table, with the keys by which they are paired with rows of positions.
pub(super) struct JoinedLog {
    rule: JoinRule,
    location: Location,
    header: Vec<String>,
    /// File and line of the header.
    header_place: (PathBuf, usize),
    /// Names of the joint table's columns in flexcal's vocabulary.
    names: Vec<String>,
    style: CellStyle,
    rows: Vec<LogRow>,
    of_name: HashMap<String, usize>,
    /// Row indices in the order of their times, for a join by time.
    by_time: Vec<usize>,
    /// Indices of the joint table's columns that are appended to the current table of positions.
    appended: Vec<usize>,
    /// Column of the key in the current table, and its conversion to seconds.
    key: Option<Key>,
    /// Number of rows requested so far, for a join by order.
    requested: usize,
    unpaired: Vec<Location>,
    paired: usize,
    decoding_warnings: Vec<Warning>,
    /// Time from each row without a partner to the nearest row of the log \[s\]; empty unless
    /// joined by time.
    gaps: Vec<f64>,
    /// First name of a position without a partner, for a join by name.
    unpaired_name: Option<String>,
    /// Earliest and latest time of a position \[s\], for a join by time.
    times: [f64; 2],
}

/// Column that pairs rows, and its conversion to seconds if it holds times.
#[derive(Clone, Copy)]
struct Key {
    place: usize,
    to_si: fn(f64) -> f64,
}

struct LogRow {
    file: PathBuf,
    line: usize,
    cells: ByteRecord,
    time: f64,
    is_used: bool,
}

impl JoinedLog {
    /// Reads the joint table that the problem declares.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, its columns differ from those of the first, the
    /// key column is missing, or a name occurs twice.
    pub fn read(log: &JointLog, problem: &Problem) -> Result<Self, InputError> {
        let dialect = &problem.data.dialect;
        let mut joined = Self {
            rule: log.by,
            location: log.location.clone(),
            header: Vec::new(),
            header_place: (PathBuf::new(), 1),
            names: Vec::new(),
            style: CellStyle { delimiter: ',', decimal_comma: false },
            rows: Vec::new(),
            of_name: HashMap::new(),
            by_time: Vec::new(),
            appended: Vec::new(),
            key: None,
            requested: 0,
            unpaired: Vec::new(),
            paired: 0,
            decoding_warnings: Vec::new(),
            gaps: Vec::new(),
            unpaired_name: None,
            times: [f64::INFINITY, f64::NEG_INFINITY],
        };
        for file in &log.files {
            let kind = InputErrorKind::DataFileMissing { path: file.clone() };
            let missing = || log.location.clone().error(kind);
            joined.read_file(Table::open(file, dialect, missing)?, dialect)?;
        }
        let mut by_time: Vec<usize> = (0..joined.rows.len()).collect();
        let time = |row: &usize| joined.rows.get(*row).map_or(f64::NAN, |row| row.time);
        by_time.sort_by(|a, b| time(a).total_cmp(&time(b)));
        joined.by_time = by_time;
        if joined.rows.is_empty() {
            return Err(log.location.clone().error(TableErrorKind::NoDataFiles));
        }
        Ok(joined)
    }

    fn read_file(&mut self, mut table: Table, dialect: &Dialect) -> Result<(), InputError> {
        if self.header.is_empty() {
            self.header.clone_from(&table.header);
            self.header_place = table.header_place();
            let names = Names::map_present(&table, dialect);
            self.names = names.into_iter().map(str::to_owned).collect();
            self.style = table.style();
        } else if self.header != table.header {
            let first = self.rows.first().map(|row| row.file.clone()).unwrap_or_default();
            let different = |name: &&String| !self.header.contains(*name);
            let name = table.header.iter().find(different);
            let kind = TableErrorKind::ColumnsDiffer { other: first, has: false };
            return Err(table.column(name.map_or("", String::as_str)).error(kind));
        }
        let key = self.find_key(&table, &self.names)?;
        while table.next_row()? {
            let mut time = f64::NAN;
            match (self.rule, key) {
                (JoinRule::Time { .. }, Some(key)) => time = table.time(key.place, key.to_si)?,
                (JoinRule::Name, Some(key)) => {
                    let name = table.name(key.place)?.to_owned();
                    if let Some(&first) = self.of_name.get(&name) {
                        let line = self.rows.get(first).map_or(0, |row| row.line);
                        let kind = TableErrorKind::RepeatedPose { name, line };
                        return Err(table.cell_error(key.place, kind));
                    }
                    self.of_name.insert(name, self.rows.len());
                }
                _ => {}
            }
            let (file, line, cells) = (table.file.clone(), table.line(), table.cells().clone());
            self.rows.push(LogRow { file, line, cells, time, is_used: false });
        }
        self.decoding_warnings.extend(table.decoding_warning());
        Ok(())
    }

    /// Returns the column by which rows are paired; `None` for a join by order.
    fn find_key(&self, table: &Table, names: &[String]) -> Result<Option<Key>, InputError> {
        let place = |wanted: &str| names.iter().position(|name| name == wanted);
        let (key, write) = match self.rule {
            JoinRule::Order => return Ok(None),
            JoinRule::Name => {
                let named = place("pose").or_else(|| place("name"));
                (named.map(|place| Key { place, to_si: std::convert::identity }), "pose or name")
            }
            JoinRule::Time { .. } => {
                let with_unit = Unit::Time.suffixes().iter().find_map(|suffix| {
                    let place = place(&format!("time_{}", suffix.name))?;
                    Some(Key { place, to_si: suffix.to_si })
                });
                let date = || place("time").map(|place| Key { place, to_si: |_| f64::NAN });
                (with_unit.or_else(date), "time_s or time")
            }
        };
        let unknown = names.iter().filter(|name| !name.is_empty()).cloned().collect();
        let kind = TableErrorKind::MissingColumn { write: write.to_owned(), near: None, unknown };
        key.map(Some).ok_or_else(|| table.column(write).error(kind))
    }

    /// Prepares a table of positions: appends the columns that only the joint table has.
    ///
    /// # Errors
    /// Returns an error if the table lacks the key column.
    pub fn extend(&mut self, table: &mut Table, dialect: &Dialect) -> Result<(), InputError> {
        let names: Vec<String> =
            Names::map_present(table, dialect).into_iter().map(str::to_owned).collect();
        self.key = self.find_key(table, &names)?;
        let is_new = |place: &usize| {
            let (name, header) = (self.names.get(*place), self.header.get(*place));
            name.is_some_and(|name| !names.contains(name))
                && header.is_some_and(|header| !table.header.contains(header))
        };
        self.appended = (0..self.header.len()).filter(is_new).collect();
        let headers = self.appended.iter().filter_map(|&place| self.header.get(place).cloned());
        table.extend_header(headers.collect(), self.style, self.header_place.clone());
        Ok(())
    }

    /// Appends the cells of the paired joint row to the current row of positions; returns false if
    /// there is none.
    ///
    /// # Errors
    /// Returns an error if the key cell of the row is empty or invalid.
    pub fn complete(&mut self, table: &mut Table) -> Result<bool, InputError> {
        let partner = match (self.rule, self.key) {
            (JoinRule::Name, Some(key)) => {
                let name = table.name(key.place)?;
                let partner = self.of_name.get(name).copied();
                if partner.is_none() {
                    self.unpaired_name.get_or_insert_with(|| name.to_owned());
                }
                partner
            }
            (JoinRule::Time { tolerance }, Some(key)) => {
                let time = table.time(key.place, key.to_si)?;
                self.times = [self.times[0].min(time), self.times[1].max(time)];
                let nearest = self.nearest(time);
                self.gaps.extend(nearest.map(|(_, gap)| gap).filter(|gap| *gap > tolerance));
                nearest.filter(|(_, gap)| *gap <= tolerance).map(|(row, _)| row)
            }
            _ => Some(self.requested).filter(|&row| row < self.rows.len()),
        };
        self.requested += 1;
        let Some(row) = partner.and_then(|partner| self.rows.get_mut(partner)) else {
            self.unpaired.push(Location::file(&table.file).at_line(table.line()));
            return Ok(false);
        };
        row.is_used = true;
        self.paired += 1;
        let cells = self.appended.iter().map(|&place| row.cells.get(place).unwrap_or_default());
        table.append_cells(cells, (&row.file, row.line));
        Ok(true)
    }

    /// Returns the index of the joint row nearest to a time \[s\], and the time between them \[s\].
    fn nearest(&self, time: f64) -> Option<(usize, f64)> {
        let time_of = |&row: &usize| self.rows.get(row).map_or(f64::NAN, |row| row.time);
        let after = self.by_time.partition_point(|row| time_of(row) < time);
        let around = [after.checked_sub(1), Some(after)].into_iter().flatten();
        let candidates = around.filter_map(|place| self.by_time.get(place));
        let distance = |row: &usize| (time_of(row) - time).abs();
        candidates
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .map(|row| (*row, distance(row)))
    }

    /// Returns, in words, the usual time between a row without a partner and the nearest row of the
    /// log; `None` if the tables are not joined by time.
    fn gap(&self) -> Option<String> {
        let mut gaps = self.gaps.clone();
        gaps.sort_by(f64::total_cmp);
        let median = gaps.get(gaps.len() / 2)?;
        Some(format!("{median:.1} s"))
    }

    /// Shows the keys of both tables, to find why no row has a partner: one name of each, or the
    /// ranges of their times; `None` for a join by order.
    fn keys(&self) -> Option<[String; 2]> {
        if let Some(name) = &self.unpaired_name {
            let log = self.of_name.iter().min_by_key(|(_, row)| **row)?.0;
            return Some([name, log].map(|name| format!("\"{}\"", shortened(name))));
        }
        let time =
            |row: Option<&usize>| row.and_then(|&row| self.rows.get(row)).map(|row| row.time);
        let log = [time(self.by_time.first())?, time(self.by_time.last())?];
        let range = |[first, last]: [f64; 2]| format!("{} to {}", shown(first), shown(last));
        (self.times[0] <= self.times[1]).then(|| [range(self.times), range(log)])
    }

    /// Returns the files of the joint table.
    pub fn files(&self) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.rows.iter().map(|row| row.file.clone()).collect();
        files.dedup();
        files
    }

    /// Returns warnings about rows without a partner. A joint table that is joined by time usually
    /// has more rows than there are positions, so its unused rows are not reported.
    ///
    /// # Errors
    /// Returns an error if no row has a partner.
    pub fn warnings(&self) -> Result<Vec<Warning>, InputError> {
        if self.paired == 0 && self.requested > 0 {
            return Err(self
                .location
                .clone()
                .error(TableErrorKind::NothingJoined { gap: self.gap(), keys: self.keys() }));
        }
        let unused = self.rows.iter().filter(|row| !row.is_used);
        let unused: Vec<Location> = match self.rule {
            JoinRule::Time { .. } => Vec::new(),
            _ => unused.map(|row| Location::file(&row.file).at_line(row.line)).collect(),
        };
        let warning = |rows: &[Location], gap: Option<String>| {
            let location = rows.first()?.clone();
            let listed = rows.iter().skip(1).take(MAX_LISTED_ROWS).map(ToString::to_string);
            let others = listed.collect();
            let kind = WarningKind::WithoutPartner { rows: rows.len(), others, gap };
            Some(Warning { location, kind })
        };
        let unpaired =
            [warning(&self.unpaired, self.gap()), warning(&unused, None)].into_iter().flatten();
        Ok(self.decoding_warnings.iter().cloned().chain(unpaired).collect())
    }
}
