//! Builder of measurements, to which the rows of tables are appended.

use std::path::PathBuf;

use nalgebra::{UnitQuaternion, Vector3};

use super::columns::{Column, Columns, is_filled};
use super::labels::{LabelsBuilder, PoseNames, stems};
use super::observed::Observed;
use super::orientation::Cells;
use super::role::{POSITION, Role, is_declared};
use super::table::{Table, shortened};
use super::{CommandColumn, Labels, Measurements, NestReading, narrow};
use crate::error::{InputError, InputErrorKind, TableErrorKind};
use crate::observation::{Content, Needs, kinds};
use crate::problem::{JointSource, Problem, RotationKind};
use crate::quantity::Unit;

/// Measurements to which rows are appended.
pub(super) struct RowsBuilder {
    measurements: Measurements,
    session: LabelsBuilder,
    target: LabelsBuilder,
    /// Names of the poses.
    poses: PoseNames,
    /// True if configurations are encoder readings, false if they are commands.
    uses_readings: bool,
    /// True if rows may measure quantities other than positions.
    has_other_kinds: bool,
    /// True if rows name one of several declared targets.
    names_targets: bool,
    /// Convention of the orientation angles rx, ry and rz.
    rotation: RotationKind,
    /// Names of the files without extension, which may replace a column.
    stems: Vec<String>,
    /// Columns of the first file with their names.
    columns: Vec<(Column, String)>,
    /// Number of these columns that stand in the first file itself.
    columns_before: usize,
    /// Joint table that is joined to the first file, with the other columns.
    joint_table: Option<PathBuf>,
}

impl RowsBuilder {
    pub fn new(files: &[PathBuf], table: &Table, columns: &Columns, problem: &Problem) -> Self {
        let list = |role| columns.has(role).then(Vec::new);
        let names_targets = !problem.targets.is_empty();
        let mut others = kinds().filter(|kind| !kind.declared_by.is_empty());
        let has_other_kinds = others.any(|kind| is_declared(kind, problem));
        let has = |is_it: fn(Role) -> bool| columns.read.iter().any(|column| is_it(column.role));
        let approach = has(|role| matches!(role, Role::Approach(_)));
        let velocities = has(|role| matches!(role, Role::Velocity(_)));
        let measurements = Measurements {
            files: files.to_vec(),
            joints: problem.joints.len(),
            other_configurations: has_both_joint_sources(columns).then(Vec::new),
            position_measured: true,
            position_unit: columns
                .read
                .iter()
                .find(|column| column.role == POSITION[0])
                .map(|column| (column.to_si)(1.0)),
            orientations: (columns.orientations() != (false, false)).then(Vec::new),
            sigma: if has_other_kinds { Some(Vec::new()) } else { list(Role::Sigma) },
            payload: list(Role::Payload),
            hoist: list(Role::Hoist),
            temperature: list(Role::Temperature),
            time_measured: columns.has(Role::Time),
            approach: approach.then(Vec::new),
            velocities: velocities.then(Vec::new),
            target: (names_targets || columns.has(Role::Target)).then(Labels::default),
            marked_held_out: columns.marked.map(|_| Vec::new()),
            has_decimal_commas: table.style.decimal_comma && table.style.delimiter != ',',
            command_columns: columns
                .read
                .iter()
                .filter_map(|column| command(column, table))
                .collect(),
            ..Measurements::default()
        };
        let poses = PoseNames::new(columns.has(Role::Pose));
        let columns = columns
            .read
            .iter()
            .map(|column| (*column, columns.name_of(column).to_owned()))
            .collect();
        let (session, target) = (LabelsBuilder::default(), LabelsBuilder::default());
        Self {
            measurements,
            session,
            target,
            poses,
            uses_readings: problem.data.joints == JointSource::Read,
            has_other_kinds,
            names_targets,
            rotation: problem.data.dialect.rotation,
            stems: stems(files),
            columns,
            columns_before: table.columns_before(),
            joint_table: table.appended_columns().map(|(file, _)| file.to_owned()),
        }
    }

    /// Returns the number of rows so far, including those of fixed points.
    pub fn row_count(&self) -> usize {
        self.measurements.len() + self.measurements.nests.len()
    }

    /// Returns the number of rows of the arm so far.
    pub fn arm_row_count(&self) -> usize {
        self.measurements.len()
    }

    /// Returns the name of a file without extension.
    pub fn file_stem(&self, file: usize) -> &str {
        self.stems.get(file).map_or("", String::as_str)
    }

    /// Checks that a file has the same columns as the first one. The column `pose` is optional. If
    /// rows may measure quantities other than positions, the columns of measured quantities, of
    /// their σ and of targets are optional, too.
    pub fn check_same_columns(&self, table: &Table, columns: &Columns) -> Result<(), InputError> {
        let differ = |name: &str, has| {
            let first = self.measurements.files.first().cloned().unwrap_or_default();
            let is_of_joint_table = |(column, known): &(Column, String)| {
                known == name && column.place >= self.columns_before
            };
            let joint_table = self.joint_table.as_ref().filter(|_| has);
            let joint_table = joint_table.filter(|_| self.columns.iter().any(is_of_joint_table));
            let other = joint_table.cloned().unwrap_or(first);
            Err(table.column(name).error(TableErrorKind::ColumnsDiffer { other, has }))
        };
        let of_observed = |role: Role| {
            role.is_observed()
                || role == Role::Sigma
                || (role == Role::Target && self.names_targets)
        };
        let is_optional =
            |role: Role| role == Role::Pose || (self.has_other_kinds && of_observed(role));
        for (column, name) in self.columns.iter().filter(|(column, _)| !is_optional(column.role)) {
            if !columns.has(column.role) {
                return differ(name, true);
            }
        }
        for column in columns.read.iter().filter(|column| !is_optional(column.role)) {
            if !self.columns.iter().any(|(known, _)| known.role == column.role) {
                return differ(table.name_of(column.place), false);
            }
        }
        Ok(())
    }

    /// Appends the current row, which measures a fixed point called `name`; `file` is the index of
    /// the file.
    pub fn push_nest(
        &mut self,
        file: usize,
        name: &str,
        table: &Table,
        columns: &Columns,
    ) -> Result<(), InputError> {
        let mut reading = NestReading {
            origin: place_of_row(file, table.line()),
            name: name.to_owned(),
            position: Vector3::zeros(),
            time: None,
            after: self.measurements.len(),
            session: columns
                .file
                .filter(|role| *role == Role::Session)
                .and(self.stems.get(file))
                .cloned()
                .unwrap_or_default(),
            sigma: None,
        };
        for column in &columns.read {
            if let Some(axis) = POSITION.iter().position(|role| *role == column.role) {
                let value = (column.to_si)(table.number(column.place)?);
                set(reading.position.as_mut_slice(), axis, value);
            }
            match column.role {
                Role::Time => reading.time = Some(table.time(column.place, column.to_si)?),
                Role::Session => table.text(column.place)?.clone_into(&mut reading.session),
                Role::Sigma => reading.sigma = Some(above_zero(table, column)?),
                _ => {}
            }
        }
        self.measurements.nests.push(reading);
        Ok(())
    }

    /// Appends a row for one observation of the current row of a table; `file` is the index of the
    /// file.
    pub fn push(
        &mut self,
        file: usize,
        table: &Table,
        columns: &Columns,
        observed: &Observed,
    ) -> Result<(), InputError> {
        let Observed { observation, measured } = *observed;
        let (kind, mut numbers) = (observation.description(), Vector3::zeros());
        let measurements = &mut self.measurements;
        let joints = measurements.joints;
        let row = measurements.len();
        measurements.origin.push(place_of_row(file, table.line()));
        measurements.configurations.resize((row + 1) * joints, 0.0);
        if let Some(other) = &mut measurements.other_configurations {
            other.resize((row + 1) * joints, 0.0);
        }
        let of_joints = [&mut measurements.approach, &mut measurements.velocities];
        for column in of_joints.into_iter().flatten() {
            column.resize((row + 1) * joints, 0.0);
        }
        if !measurements.time_measured {
            measurements.time.push(row as f64);
        }
        let (mut pose, mut turned) = (None, Cells::default());
        for column in columns
            .read
            .iter()
            .filter(|column| observation.is_position() || !column.role.is_orientation())
        {
            let number = || table.number(column.place).map(column.to_si);
            match column.role {
                Role::Joint(joint) | Role::Reading(joint) => {
                    let value = number()?;
                    if self.uses_readings == column.role.is_reading() {
                        set(&mut measurements.configurations, row * joints + joint, value);
                    } else if let Some(other) = &mut measurements.other_configurations {
                        set(other, row * joints + joint, value);
                    }
                }
                Role::Field(name) => {
                    let mut fields = kind.measured_fields().enumerate();
                    let field = fields.find(|(_, field)| field.name == name);
                    if let Some((axis, field)) = field.filter(|(_, field)| {
                        (field.required && measured) || is_filled(table, column.place)
                    }) {
                        let value = if POSITION.contains(&column.role) {
                            table.measured_number(column.place).map(column.to_si)?
                        } else {
                            number()?
                        };
                        if matches!(field.content, Content::Positive(_)) && value <= 0.0 {
                            let kind = InputErrorKind::NotPositive { value };
                            return Err(table.cell_error(column.place, kind));
                        }
                        set(numbers.as_mut_slice(), axis, value);
                    }
                }
                Role::Sigma
                    if self.has_other_kinds
                        && (kind.unit != Unit::Length || !is_filled(table, column.place)) => {}
                Role::Sigma => push(&mut measurements.sigma, above_zero(table, column)?),
                Role::Payload => push(&mut measurements.payload, not_negative(table, column)?),
                Role::Hoist => push(&mut measurements.hoist, number()?),
                Role::Temperature => push(&mut measurements.temperature, number()?),
                Role::Time => measurements.time.push(table.time(column.place, column.to_si)?),
                Role::Approach(joint) => {
                    let direction = direction(table, column)?;
                    if let Some(approach) = &mut measurements.approach {
                        set(approach, row * joints + joint, direction);
                    }
                }
                Role::Velocity(joint) => {
                    let velocity = number()?;
                    if let Some(velocities) = &mut measurements.velocities {
                        set(velocities, row * joints + joint, velocity);
                    }
                }
                Role::Orientation(axis) => set(turned.angles.as_mut_slice(), axis, number()?),
                Role::Quaternion(axis) => set(&mut turned.quaternion, axis, number()?),
                // Columns are sorted by role, so covariates have the order of the problem.
                Role::Covariate(_) => measurements.covariates.push(number()?),
                Role::Split => _ = is_validation(table, column.place)?,
                Role::Session => self.session.push(table.name(column.place)?),
                // A row may lack a target if its kind needs none. The name was checked before.
                Role::Target if self.names_targets && kind.needs != Needs::Target => {
                    self.target.push(table.text(column.place)?);
                }
                Role::Target => self.target.push(table.name(column.place)?),
                Role::Nest => {}
                Role::Pose => pose = Some(table.text(column.place)?),
            }
        }
        match columns.file {
            Some(Role::Session) => {
                self.session.push(self.stems.get(file).map_or("", String::as_str));
            }
            Some(Role::Target) => self.target.push(self.stems.get(file).map_or("", String::as_str)),
            _ => {}
        }
        if measurements.target.is_some() && self.target.labels.of_row.len() == row {
            self.target.push("");
        }
        if let (Some(marked), Some(place)) = (&mut measurements.marked_held_out, columns.marked) {
            marked.push(is_validation(table, place)?);
        }
        measurements.positions.push(numbers);
        measurements.position_measured &= measured;
        if self.has_other_kinds {
            measurements.observations.push(observation);
            measurements.sigma.iter_mut().for_each(|column| column.resize(row + 1, f64::NAN));
        }
        if let Some(orientations) = &mut measurements.orientations {
            orientations.push(match columns.orientations() {
                _ if !observation.is_position() => UnitQuaternion::identity(),
                (true, _) => turned.of_angles(self.rotation),
                _ => turned
                    .of_quaternion()
                    .ok_or_else(|| table.error(TableErrorKind::NotAQuaternion))?,
            });
        }
        self.poses.push(pose);
        Ok(())
    }

    /// Returns the measurements and the columns of the first file.
    pub fn finish(self) -> (Measurements, Vec<(Column, String)>) {
        let Self { mut measurements, session, target, poses, columns, .. } = self;
        (measurements.pose, measurements.pose_names) = poses.finish();
        measurements.session = session.labels;
        if measurements.session.names.is_empty() {
            let of_row = vec![0; measurements.len()];
            measurements.session = Labels { names: vec![String::new()], of_row };
        }
        measurements.target = measurements.target.map(|_| target.labels);
        (measurements, columns)
    }
}

/// Returns the index of a row's file and its line there, as [`Measurements`] stores them.
pub(super) fn place_of_row(file: usize, line: usize) -> (u32, u32) {
    (narrow(file), narrow(line))
}

/// Sets the element at index `place` of a list if it exists; an empty list stays empty.
fn set(list: &mut [f64], place: usize, value: f64) {
    if let Some(element) = list.get_mut(place) {
        *element = value;
    }
}

/// Appends a value to a column, if it exists.
fn push(list: &mut Option<Vec<f64>>, value: f64) {
    if let Some(list) = list {
        list.push(value);
    }
}

/// Returns true if a table has both commands and encoder readings of the joints.
fn has_both_joint_sources(columns: &Columns) -> bool {
    let count = |reading: bool| {
        let of_joint = |column: &&Column| matches!(column.role, Role::Joint(_) | Role::Reading(_));
        let joints = columns.read.iter().filter(of_joint);
        joints.filter(|column| column.role.is_reading() == reading).count()
    };
    count(true) > 0 && count(true) == count(false)
}

/// Returns the description of a column of commands, or `None` for another column.
fn command(column: &Column, table: &Table) -> Option<CommandColumn> {
    let Role::Joint(joint) = column.role else { return None };
    Some(CommandColumn {
        joint,
        name: table.name_of(column.place).to_owned(),
        unit: (column.to_si)(1.0),
    })
}

/// Reads a number from the current row's cell of `column`, which must be above zero; returns it in
/// SI units.
fn above_zero(table: &Table, column: &Column) -> Result<f64, InputError> {
    let value = table.number(column.place)?;
    // A tiny length in millimetres may underflow to 0 in metres.
    let converted = (column.to_si)(value);
    if converted > 0.0 {
        Ok(converted)
    } else {
        Err(table.cell_error(column.place, InputErrorKind::NotPositive { value }))
    }
}

/// Reads a number from the current row's cell of `column`, which must not be negative; returns it
/// in SI units.
fn not_negative(table: &Table, column: &Column) -> Result<f64, InputError> {
    let value = table.number(column.place)?;
    if value < 0.0 {
        Err(table.cell_error(column.place, InputErrorKind::Negative { value }))
    } else {
        Ok((column.to_si)(value))
    }
}

/// Reads a direction of approach from the current row's cell of `column`: −1, 0 or +1.
pub(super) fn direction(table: &Table, column: &Column) -> Result<f64, InputError> {
    let word = table.non_empty_text(column.place)?;
    if word.chars().all(char::is_alphabetic) {
        let kind = TableErrorKind::DirectionInWords { value: shortened(word) };
        return Err(table.cell_error(column.place, kind));
    }
    let value = table.number(column.place)?;
    if [-1.0, 0.0, 1.0].contains(&value) {
        Ok(value)
    } else {
        Err(table.cell_error(column.place, TableErrorKind::NotADirection { value }))
    }
}

/// Returns true if the current row's cell in the column with index `place` is the word
/// `validation`, and false if it is `identification`; other words are errors.
fn is_validation(table: &Table, place: usize) -> Result<bool, InputError> {
    let word = table.non_empty_text(place).map_err(|error| match *error.kind {
        InputErrorKind::Table(TableErrorKind::EmptyCell) => {
            let write = "identification, or validation to hold the row out";
            table.cell_error(place, TableErrorKind::EmptyWord { write })
        }
        _ => error,
    })?;
    match word {
        "validation" => Ok(true),
        "identification" => Ok(false),
        word => {
            let meant = match word.to_lowercase().as_str() {
                "validation" | "valid" | "val" | "test" | "held_out" | "held-out" | "holdout" => {
                    Some("validation")
                }
                "identification" | "ident" | "train" | "training" | "fit" => Some("identification"),
                _ => None,
            };
            let is_session = table.name_of(place) == "session";
            let kind = TableErrorKind::UnknownSplit { word: shortened(word), meant, is_session };
            Err(table.cell_error(place, kind))
        }
    }
}
