//! Tables with a line for each row of the measurements, as columns for CSV files and the Python
//! package.

use std::collections::BTreeSet;

use nalgebra::{UnitQuaternion, Vector3};

use super::commanded::{commanded_joints, label, sessions};
use crate::files::csv;
use crate::fit::Residual;
use crate::measurement::{Labels, Measurements};
use crate::observation::{Content, Kind, Observation};
use crate::problem::Problem;
use crate::problem::fixture::reference_cells;
use crate::quantity::TableUnit;
use crate::quantity::format::fixed;

/// Values of a column of a table, one for each row.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Column {
    /// Texts, empty for rows without one.
    Words(Labels),
    /// Non-negative integers of the rows.
    Counts(Vec<usize>),
    /// Numbers, NaN for rows without one, and the number of decimals in CSV files. With `None`, a
    /// number is written with as many digits as read back as the same number.
    Numbers(Vec<f64>, Option<usize>),
    /// Truth values of the rows.
    Flags(Vec<bool>),
}

impl Column {
    /// Returns the cell of a row as text; `row` counts from 0.
    pub(super) fn cell(&self, row: usize) -> String {
        match self {
            Self::Words(labels) => label(labels, row),
            Self::Counts(values) => values[row].to_string(),
            Self::Numbers(values, None) => values[row].to_string(),
            Self::Numbers(values, Some(decimals)) => fixed(values[row], *decimals),
            Self::Flags(values) => values[row].to_string(),
        }
    }
}

/// Number of decimals of measured commands in mm and °.
pub(super) const COMMAND_DECIMALS: usize = 7;

/// Columns and their names, in the order of the table.
pub type Columns = Vec<(String, Column)>;

/// Formats columns as CSV; `rows` is their length.
pub(super) fn to_csv(columns: &Columns, rows: usize) -> String {
    let header = columns.iter().map(|(name, _)| name.clone()).collect();
    csv(header, (0..rows).map(|row| columns.iter().map(|(_, column)| column.cell(row)).collect()))
}

/// Returns the columns that identify the rows with the indices `picked`: file, line, pose, session,
/// target and fixtures.
pub(super) fn identifying_columns(
    problem: &Problem,
    rows: &Measurements,
    picked: &[usize],
) -> Columns {
    let of_row = |of: &dyn Fn(usize) -> usize| picked.iter().map(|&row| of(row)).collect();
    let labels = |labels_of_rows: &Labels| {
        Column::Words(Labels {
            names: labels_of_rows.names.clone(),
            of_row: of_row(&|row| labels_of_rows.of_row[row]),
        })
    };
    let files: Labels = rows.files.iter().map(|file| file.display().to_string()).collect();
    let file = Labels {
        of_row: of_row(&|row| files.of_row[rows.origin[row].0 as usize]),
        names: files.names.clone(),
    };
    let line = of_row(&|row| rows.location(row).line.unwrap_or(0));
    let mut columns =
        vec![("file".to_owned(), Column::Words(file)), ("line".to_owned(), Column::Counts(line))];
    let mut add = |name: &str, column| columns.push((name.to_owned(), column));
    if let Some(pose) = &rows.pose {
        add("pose", Column::Numbers(picked.iter().map(|&row| pose[row]).collect(), None));
    }
    let words = [
        ("pose", rows.pose_names.as_ref()),
        ("session", sessions(rows)),
        ("target", rows.target.as_ref()),
    ];
    for (name, labels_of_rows) in words {
        if let Some(labels_of_rows) = labels_of_rows {
            add(name, labels(labels_of_rows));
        }
    }
    // Columns that name the fixtures against which rows are measured, in the order in which the
    // rows first use them.
    let mut fixture_columns = Vec::new();
    for observation in (0..rows.len()).map(|row| rows.observation(row)) {
        let references = observation.references().map(|(field, _)| field);
        for field in references.filter(|field| field.content != Content::Frame) {
            if !fixture_columns.contains(&field.name) {
                fixture_columns.push(field.name);
            }
        }
    }
    for name in fixture_columns {
        let cells = picked.iter().map(|&row| reference_cell(problem, rows, (row, name)));
        add(name, Column::Words(cells.collect()));
    }
    columns
}

/// Returns what a row names in the column `name` of fixtures; empty if nothing.
pub(super) fn reference_cell(
    problem: &Problem,
    rows: &Measurements,
    (row, name): (usize, &str),
) -> String {
    let mut cells = reference_cells(problem, rows.observation(row));
    cells.find(|(field, _)| field.name == name).map(|(_, cell)| cell).unwrap_or_default()
}

/// Group of columns about predictions or residuals: the prefix of the column names, and functions
/// that return the vector \[SI\] and the rotation vector \[rad\] of a row. The latter is `None`
/// without an orientation.
type ColumnGroup<'a> =
    (&'static str, fn(&Residual) -> Vector3<f64>, &'a dyn Fn(&Residual) -> Option<Vector3<f64>>);

/// Returns the table of residuals. Its columns identify the row and contain the commands, predicted
/// values and residuals of every kind of rows in mm, ° or px. The last columns are `whitened`
/// (length of the residual in units of σ), `outlier` and `held_out`.
pub fn residual_columns(problem: &Problem, rows: &Measurements, residuals: &[Residual]) -> Columns {
    let picked: Vec<usize> = residuals.iter().map(|residual| residual.row).collect();
    let mut columns = identifying_columns(problem, rows, &picked);
    let has_orientations = residuals.iter().any(|residual| residual.orientation.is_some());
    let kinds = kinds_of(rows);
    let predicted_turn = |residual: &Residual| {
        let (turn, measured) = residual.orientation.zip(rows.orientations.as_ref())?;
        Some((UnitQuaternion::from_scaled_axis(-turn) * measured[residual.row]).scaled_axis())
    };
    let groups: [ColumnGroup; 2] = [
        ("predicted", |residual| residual.predicted, &predicted_turn),
        ("residual", |residual| residual.position, &|residual: &Residual| residual.orientation),
    ];
    let column = |name: String, decimals, cell: &dyn Fn(&Residual) -> f64| {
        (name, Column::Numbers(residuals.iter().map(cell).collect(), Some(decimals)))
    };
    for joint in commanded_joints(problem) {
        // A distance between two points is measured without the arm.
        let cell = |residual: &Residual| {
            let is_of_arm = rows.observation(residual.row).is_of_arm();
            let command = rows.configuration(residual.row)[joint.joint] * joint.factor();
            if is_of_arm { command } else { f64::NAN }
        };
        columns.push(column(joint.column(), COMMAND_DECIMALS, &cell));
    }
    for (prefix, value, turn) in groups {
        let numbers: Vec<(usize, Vector3<f64>)> =
            residuals.iter().map(|residual| (residual.row, value(residual))).collect();
        columns.extend(kind_columns(rows, &kinds, (prefix, 6), &numbers));
        for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate().filter(|_| has_orientations) {
            columns.push(column(format!("{prefix}_{axis}_deg"), 7, &|residual| {
                turn(residual).map_or(f64::NAN, |turn| turn[k].to_degrees())
            }));
        }
    }
    columns.push(column("whitened".to_owned(), 4, &Residual::length));
    columns.push((
        "outlier".to_owned(),
        Column::Flags(residuals.iter().map(|residual| residual.outlier).collect()),
    ));
    columns.push((
        "held_out".to_owned(),
        Column::Flags(residuals.iter().map(|residual| residual.held_out).collect()),
    ));
    columns
}

/// Returns the table of residuals as CSV.
pub fn residuals_csv(problem: &Problem, rows: &Measurements, residuals: &[Residual]) -> String {
    to_csv(&residual_columns(problem, rows, residuals), residuals.len())
}

/// Returns the columns `<prefix>_<axis>_<unit>` of all kinds of rows that do not measure a
/// position. `numbers` has a vector for each row \[SI or px\]; in the columns of other kinds the
/// cells of the row are empty.
pub(super) fn columns_of_kinds(
    rows: &Measurements,
    prefix: &str,
    decimals: usize,
    numbers: &[Vector3<f64>],
) -> Columns {
    let mut kinds = kinds_of(rows);
    kinds.retain(|kind| kind.residuals != Observation::Position.description().residuals);
    let numbers: Vec<(usize, Vector3<f64>)> = numbers.iter().copied().enumerate().collect();
    kind_columns(rows, &kinds, (prefix, decimals), &numbers)
}

/// Returns the columns `<prefix>_<axis>_<unit>` of some kinds of rows. `numbers` holds indices of
/// rows, each with its vector \[SI or px\]; in the columns of other kinds its cells are NaN.
fn kind_columns(
    rows: &Measurements,
    kinds: &[&Kind],
    (prefix, decimals): (&str, usize),
    numbers: &[(usize, Vector3<f64>)],
) -> Columns {
    let mut columns = Columns::new();
    for kind in kinds {
        let (group, axes) = kind.residuals;
        let TableUnit { factor, suffix, .. } = kind.unit.in_tables();
        for (k, axis) in axes.iter().enumerate() {
            let cell = |(row, numbers): &(usize, Vector3<f64>)| {
                let is_of_kind = rows.observation(*row).description().residuals.0 == group;
                if is_of_kind { numbers[k] * factor } else { f64::NAN }
            };
            let cells = numbers.iter().map(cell).collect();
            let name = format!("{prefix}_{axis}_{suffix}");
            columns.push((name, Column::Numbers(cells, Some(decimals))));
        }
    }
    columns
}

/// Returns the kinds of rows in a table, one for each group of residual columns; positions for a
/// table without rows.
fn kinds_of(rows: &Measurements) -> Vec<&'static Kind> {
    let mut kinds: Vec<&Kind> = rows.kinds().into_iter().map(Observation::description).collect();
    let mut groups = BTreeSet::new();
    kinds.retain(|kind| groups.insert(kind.residuals.0));
    if kinds.is_empty() { vec![Observation::Position.description()] } else { kinds }
}
