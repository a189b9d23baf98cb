//! Reader of CSV files and tables in memory into [`Measurements`].

use std::path::{Path, PathBuf};

use super::columns::{Column, Columns};
use super::joined::JoinedLog;
use super::limits::Commands;
use super::observed;
use super::role::{POINT, Role};
use super::rows::RowsBuilder;
use super::settled::listed_together;
use super::table::Table;
use super::unmeasured::is_missing;
use super::{ColumnTable, Measurements};
use crate::error::{InputError, InputErrorKind, Location, TableErrorKind, Warning, WarningKind};
use crate::files::{same_file, was_changed};
use crate::problem::{Dialect, JoinRule, JointLog, Problem};

impl Measurements {
    /// Reads files one after the other; also returns warnings, for example about ignored columns.
    ///
    /// # Errors
    /// Returns the first error in the files, or an error if a file cannot be read.
    #[doc(hidden)]
    pub fn read(files: &[PathBuf], problem: &Problem) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_table(files, problem, Use::Measured)
    }

    /// Reads measurements that an estimate is compared with. Unlike measurements to fit, they may
    /// lack columns that `[data.columns]` names, such as times.
    ///
    /// # Errors
    /// Returns the first error in the files, or an error if a file cannot be read.
    #[doc(hidden)]
    pub fn read_to_judge(
        files: &[PathBuf],
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_table(files, problem, Use::Judged)
    }

    /// Reads poses that may still be unmeasured; missing positions are set to 0.
    ///
    /// # Errors
    /// Returns the first error in the files, or an error if a file cannot be read.
    pub fn read_poses(
        files: &[PathBuf],
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_table(files, problem, Use::Planned)
    }

    /// Reads poses to predict, which may be unmeasured. Tables without joint columns are joined
    /// with the joint table of the problem; by order only if they are the problem's own tables.
    ///
    /// # Errors
    /// Returns the first error in the files, or an error if a file cannot be read.
    #[doc(hidden)]
    pub fn read_to_predict(
        files: &[PathBuf],
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_table(files, problem, Use::Predicted)
    }

    /// Reads a table in memory; also returns warnings, for example about ignored columns.
    ///
    /// # Errors
    /// Returns the first error in the table.
    pub(crate) fn read_columns(
        table: ColumnTable,
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_column_table(table, problem, Use::Measured)
    }

    /// Reads poses from a table in memory, which may still be unmeasured; missing positions are set
    /// to 0.
    ///
    /// # Errors
    /// Returns the first error in the table.
    #[doc(hidden)]
    pub fn read_pose_columns(
        table: ColumnTable,
        problem: &Problem,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        Self::read_column_table(table, problem, Use::Planned)
    }

    /// Reads files for a purpose. If no offset of the clocks is declared, or if the joint tables are
    /// given with the files, so that the declared one is not theirs, rows are paired with the offset
    /// that is found, and a warning states it.
    fn read_table(
        files: &[PathBuf],
        problem: &Problem,
        table_use: Use,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let as_declared = Self::read_files(files, problem, table_use);
        // The log that the problem names is that of its tables, to which planned poses may be added.
        let is_declared = |file: &PathBuf| {
            problem.data.files.iter().any(|other| file == other || same_file(file, other))
        };
        let is_open = |log: &&JointLog| {
            log.is_given || log.by.has_no_offset() && files.iter().any(is_declared)
        };
        let open = problem.data.joint_log.as_ref().filter(is_open);
        let found = as_declared.as_ref().err().and_then(|error| match &*error.kind {
            InputErrorKind::Table(kind) => kind.clock_offset(),
            _ => None,
        });
        let Some((log, found)) = open.zip(found) else { return as_declared };
        let Some(by) = log.by.moved_to(found) else { return as_declared };
        let mut moved = problem.clone();
        moved.data.joint_log = Some(JointLog { by, ..log.clone() });
        let location = Location::file(log.files.first().map_or(Path::new(""), PathBuf::as_path));
        let kind = WarningKind::ClockOffsetFound { offset: found.to_string() };
        let (rows, warnings) = Self::read_files(files, &moved, table_use)?;
        let found = Warning { location, kind };
        Ok((rows, std::iter::once(found).chain(warnings).collect()))
    }

    /// Reads files for a purpose, joined as the problem declares.
    fn read_files(
        files: &[PathBuf],
        problem: &Problem,
        table_use: Use,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let mut tables = Tables::new(files, problem, table_use);
        for (index, file) in files.iter().enumerate() {
            if files.iter().take(index).any(|other| other == file || same_file(other, file)) {
                let again = TableErrorKind::RepeatedFile { path: file.clone() };
                return Err(file_error(
                    (file, files),
                    problem,
                    [again, TableErrorKind::GivenFileRepeated],
                ));
            }
            let missing = || {
                let named = InputErrorKind::DataFileMissing { path: file.clone() };
                file_error((file, files), problem, [named, InputErrorKind::GivenFileMissing])
            };
            let dialect = &problem.data.dialect;
            tables.read(index, Table::open(file, dialect, missing)?, dialect)?;
            if table_use == Use::Planned && was_changed(file) {
                let (location, kind) = (Location::file(file), WarningKind::FileChanged);
                tables.warnings.push(Warning { location, kind });
            }
        }
        tables.finish()
    }

    /// Reads a table in memory for a purpose.
    fn read_column_table(
        table: ColumnTable,
        problem: &Problem,
        table_use: Use,
    ) -> Result<(Self, Vec<Warning>), InputError> {
        let name = table.name().to_owned();
        let mut tables = Tables::new(std::slice::from_ref(&name), problem, table_use);
        let dialect =
            problem.data.dialect.in_memory(matches!(table_use, Use::Measured | Use::Judged));
        let table = Table::from_reader(&name, &dialect, Box::new(table.into_text()))?;
        tables.read(0, table, &dialect).map_err(|error| match *error.kind {
            InputErrorKind::Table(TableErrorKind::DecimalComma { value }) => {
                error.location.error(TableErrorKind::TextInMemory { value })
            }
            kind => error.location.error(kind),
        })?;
        tables.finish()
    }
}

/// Purpose for which tables are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    /// Rows that have to be measured.
    Measured,
    /// Rows that have to be measured, and may lack columns of the map that no parameter needs.
    Judged,
    /// Rows that are predicted, and compared with measurements if there are any.
    Predicted,
    /// Planned poses and targets, whose tables contain the commands.
    Planned,
}

/// Reader of several tables, one after the other.
struct Tables<'a> {
    files: &'a [PathBuf],
    problem: &'a Problem,
    /// True if the table must contain measurements.
    measured: bool,
    /// True if measured tables must have every column of `[data.columns]`.
    is_mapped_whole: bool,
    /// True if tables without joint columns are joined with the joint table of the problem.
    joins: bool,
    warnings: Vec<Warning>,
    /// Builder of the measurements; `None` before the first table.
    builder: Option<RowsBuilder>,
    /// Joint table of the problem; `None` if the tables have joint columns.
    log: Option<JoinedLog>,
}

/// Returns true if rows of other `files` than those of the problem are paired by their order with the
/// joint table that the problem names.
fn is_by_order_with_others(problem: &Problem, files: &[PathBuf]) -> bool {
    let is_kept = |log: &JointLog| log.by == JoinRule::Order && !log.is_given;
    problem.data.joint_log.as_ref().is_some_and(is_kept) && files != problem.data.files
}

impl<'a> Tables<'a> {
    fn new(files: &'a [PathBuf], problem: &'a Problem, table_use: Use) -> Self {
        let joins = match table_use {
            Use::Measured | Use::Judged => true,
            Use::Predicted => !is_by_order_with_others(problem, files),
            Use::Planned => false,
        };
        Self {
            files,
            problem,
            measured: matches!(table_use, Use::Measured | Use::Judged),
            is_mapped_whole: table_use != Use::Judged,
            joins,
            warnings: Vec::new(),
            builder: None,
            log: None,
        }
    }

    /// Reads all rows of a table in its dialect; `index` is the number of its file.
    fn read(
        &mut self,
        index: usize,
        mut table: Table,
        dialect: &Dialect,
    ) -> Result<(), InputError> {
        let joint_log = self.problem.data.joint_log.as_ref();
        if joint_log.is_some() {
            table.find_decimal_mark();
        }
        let is_joined = self.joins && !Columns::has_joints(&table, self.problem);
        let mut log = match (joint_log.filter(|_| is_joined), self.log.take()) {
            (Some(_), Some(log)) => Some(log),
            (Some(declared), None) => {
                let is_both = |file: &&PathBuf| declared.files.iter().any(|log| log == *file);
                if let Some(path) = self.files.iter().find(is_both) {
                    let kind = TableErrorKind::JoinedWithItself { path: path.clone() };
                    return Err(declared.location.clone().error(kind));
                }
                if is_by_order_with_others(self.problem, self.files) {
                    let file = declared.files.first().cloned().unwrap_or_default();
                    let kind = WarningKind::JointTableKept { file };
                    self.warnings.push(Warning { location: declared.location.clone(), kind });
                }
                Some(JoinedLog::read(declared, self.problem)?)
            }
            (None, _) => None,
        };
        if let Some(log) = &mut log {
            log.extend(&mut table, dialect)?;
        }
        let mut ignored = Vec::new();
        let mut columns = Columns::find(
            &table,
            self.problem,
            (self.measured, self.is_mapped_whole),
            &mut ignored,
        )
        .map_err(|error| match joint_log.filter(|_| self.joins && !is_joined) {
            Some(declared) => of_exchanged_tables(error, declared, &self.problem.data.dialect),
            None => error,
        })?;
        if !self.measured && !self.joins {
            columns.take_labels(&table, &mut ignored);
        }
        observed::check_target_column(&table, &columns, self.problem)?;
        if !table.next_row()? {
            let line = table.line();
            return Err(Location::file(&table.file)
                .at_line(line)
                .error(TableErrorKind::NoRowsBelowHeader));
        }
        if let Some(log) = &mut log {
            log.read_configurations(&mut table, |row| columns.configuration(row, self.problem));
            log.show_first_row(&mut table);
        }
        columns.decide_time_column(&table, &mut ignored)?;
        columns.propose_times(&table, &mut ignored);
        listed_together(&mut ignored);
        table.detach_row();
        self.warnings.append(&mut ignored);
        let rows = self
            .builder
            .get_or_insert_with(|| RowsBuilder::new(self.files, &table, &columns, self.problem));
        rows.check_same_columns(&table, &columns)?;
        let (before, mut left_out) = (rows.row_count(), LeftOut::default());
        loop {
            let is_nest = columns.nest(&table).is_some();
            let is_complete = match &mut log {
                Some(log) if !is_nest => log.complete(&mut table)?,
                _ => true,
            };
            let missing = dialect
                .missing
                .as_ref()
                .is_some_and(|missing| is_missing(missing, &table, &columns));
            if !is_complete {
                // The warnings of the joint table list rows without a partner.
            } else if missing && !columns.observes_at(&table) {
                left_out.count(&table);
            } else if let Some(name) = columns.nest(&table) {
                rows.push_nest(index, name, &table, &columns)?;
            } else {
                let in_point = (columns.file == Some(POINT)).then(|| rows.file_stem(index));
                let observations = observed::of_row(
                    &table,
                    &columns,
                    (self.problem, self.measured, missing),
                    in_point,
                )?;
                observed::check_target(
                    &table,
                    &columns,
                    (rows.file_stem(index), &observations),
                    self.problem,
                )?;
                let first = rows.arm_row_count();
                for observed in &observations {
                    rows.push(index, &table, &columns, observed)?;
                }
                if let Some(log) = &mut log {
                    log.state_measured(first..rows.arm_row_count());
                }
            }
            if !table.next_row()? {
                break;
            }
        }
        self.warnings.extend(table.text_warnings());
        if let Some(log) = &log
            && rows.row_count() == before
        {
            log.warnings()?;
        }
        self.log = log;
        if rows.row_count() == before {
            return Err(Location::file(&table.file).error(TableErrorKind::AllMissing));
        }
        self.warnings.extend(left_out.warning());
        Ok(())
    }

    /// Returns the measurements of all tables.
    fn finish(self) -> Result<(Measurements, Vec<Warning>), InputError> {
        let Self { problem, measured, mut warnings, builder, log, .. } = self;
        match builder {
            Some(builder) => {
                let (mut measurements, columns) = builder.finish();
                if measurements.is_empty() {
                    let file = measurements.files.first().cloned().unwrap_or_default();
                    return Err(Location::file(&file).error(InputErrorKind::NestsAlone));
                }
                if let Some(log) = &log {
                    warnings.extend(log.warnings()?);
                    measurements.files.extend(log.files());
                    measurements.clock_offsets = log.offsets_by_rows();
                    warnings.extend(log.add_stops(&mut measurements, problem));
                }
                measurements.require_moving_views(problem)?;
                measurements.require_pixels(problem)?;
                measurements.require_decimals(problem)?;
                observed::add_known_distances(&mut measurements, problem)?;
                let commands = commands(&columns);
                warnings.extend(measurements.many_turns(problem, &commands));
                warnings.extend(measurements.kelvins());
                let no_readings = measurements.placeholders(problem);
                let unusual = measurements.unusual_temperature();
                warnings.extend(unusual.filter(|_| no_readings.is_empty()));
                warnings.extend(no_readings);
                warnings.extend(measurements.fahrenheit(problem));
                warnings.extend(measurements.far_reference(problem));
                warnings.extend(measurements.approach_without_sign());
                let exchanged = measurements.exchanged_loads(problem);
                let in_kilograms = measurements.hoist_in_kilograms(problem);
                warnings.extend(exchanged.or(in_kilograms));
                warnings.extend(measurements.few_degrees(problem, &commands));
                warnings.extend(measurements.slides(problem, &commands));
                warnings.extend(measurements.milliseconds());
                warnings.extend(measurements.heavy_payload(problem));
                warnings.extend(measurements.missing_payload(problem));
                warnings.extend(measurements.payload_in_newtons());
                warnings.extend(measurements.short_distances(problem));
                warnings.extend(
                    measurements.session_per_row().or_else(|| measurements.sessions_alike()),
                );
                warnings.extend(measurements.target_per_row());
                warnings.extend(measurements.beyond_limits(problem, &commands));
                if measured {
                    let is_comma = problem.data.dialect.decimal_comma;
                    let zeros = if is_comma { "0;0;0" } else { "0,0,0" };
                    warnings.extend(measurements.lost_targets(zeros)?);
                    warnings.extend(measurements.same_pose_elsewhere());
                    warnings.extend(measurements.rounded_positions(problem));
                    warnings.extend(measurements.unused_sigma(problem));
                }
                warnings.extend(problem.plausibility_warnings());
                measurements.warnings.clone_from(&warnings);
                Ok((measurements, warnings))
            }
            None => Err(problem.data.files_location.clone().error(TableErrorKind::NoDataFiles)),
        }
    }
}

/// Counter of rows that were left out because they contain no measurement.
#[derive(Default)]
struct LeftOut {
    rows: usize,
    first: Option<Location>,
}

impl LeftOut {
    /// Counts the current row of a table.
    fn count(&mut self, table: &Table) {
        self.rows += 1;
        self.first.get_or_insert_with(|| Location::file(&table.file).at_line(table.line()));
    }

    /// Returns a warning, located at the first of the rows; `None` without rows.
    fn warning(self) -> Option<Warning> {
        let rows = self.rows;
        self.first.map(|location| Warning { location, kind: WarningKind::RowsMissing { rows } })
    }
}

/// Returns the error of a column that a table with joints lacks, with the remedy of exchanged tables
/// if the declared joint table has it.
fn of_exchanged_tables(error: InputError, declared: &JointLog, dialect: &Dialect) -> InputError {
    let InputError { location, kind } = error;
    let kind = match *kind {
        InputErrorKind::Table(TableErrorKind::NoSuchColumn { file, name, known, remedy }) => {
            let log = declared.files.first();
            let is_there = |log: &&PathBuf| {
                let missing = || Location::file(*log).error(TableErrorKind::NoDataFiles);
                Table::open(log, dialect, missing).is_ok_and(|log| log.header.contains(&name))
            };
            let remedy = match log.filter(is_there) {
                Some(log) => Some(format!(
                    "files and joints in [data] are exchanged: it has the joints, and {} this \
                     column",
                    log.display()
                )),
                None => remedy,
            };
            TableErrorKind::NoSuchColumn { file, name, known, remedy }.into()
        }
        kind => kind,
    };
    InputError { location, kind: Box::new(kind) }
}

/// Returns the columns of joint commands among `columns`, with their names.
fn commands(columns: &[(Column, String)]) -> Vec<Commands<'_>> {
    let joints = columns.iter().filter_map(|(column, name)| match column.role {
        Role::Joint(joint) => Some(Commands { joint, name, to_si: column.to_si }),
        _ => None,
    });
    joints.collect()
}

/// Returns the error of a data file. If the problem names the file, the error is of kind `named`
/// and located there; otherwise it is of kind `given` and located at the file.
fn file_error(
    (file, files): (&Path, &[PathBuf]),
    problem: &Problem,
    [named, given]: [impl Into<InputErrorKind>; 2],
) -> InputError {
    if problem.data.files == files {
        problem.data.files_location.clone().error(named)
    } else {
        Location::file(file).error(given)
    }
}
