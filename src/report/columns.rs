//! Tables about rows of measurements, column by column: what CSV files and the Python package have
//! in common.

use std::collections::BTreeSet;

use nalgebra::{UnitQuaternion, Vector3};

use super::quantity::fixed;
use super::table;
use crate::files::csv;
use crate::fit::Residual;
use crate::measurement::{Labels, Measurements};
use crate::observation::{Kind, Observation};
use crate::problem::Problem;
use crate::quantity::Unit;

/// The cells of a column.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Column {
    /// Words, empty where a row has none.
    Words(Labels),
    /// Whole numbers.
    Counts(Vec<usize>),
    /// Numbers, NaN where a row has none, and their decimals in a text: as many as they need where
    /// nothing is said.
    Numbers(Vec<f64>, Option<usize>),
    /// True or false.
    Flags(Vec<bool>),
}

impl Column {
    /// The cell of a row as text.
    fn cell(&self, row: usize) -> String {
        match self {
            Self::Words(labels) => table::word(labels, row),
            Self::Counts(values) => values[row].to_string(),
            Self::Numbers(values, None) => values[row].to_string(),
            Self::Numbers(values, Some(decimals)) => fixed(values[row], *decimals),
            Self::Flags(values) => values[row].to_string(),
        }
    }
}

/// Columns with their names.
pub type Columns = Vec<(String, Column)>;

/// Columns of `rows` rows as CSV.
pub(super) fn to_csv(columns: &Columns, rows: usize) -> String {
    let header = columns.iter().map(|(name, _)| name.clone()).collect();
    csv(header, (0..rows).map(|row| columns.iter().map(|(_, column)| column.cell(row)).collect()))
}

/// What names the rows `picked`: file, line, and the words and numbers of their table that do.
pub(super) fn names(problem: &Problem, rows: &Measurements, picked: &[usize]) -> Columns {
    let of_row = |of: &dyn Fn(usize) -> usize| picked.iter().map(|&row| of(row)).collect();
    let labels = |all: &Labels| {
        Column::Words(Labels { names: all.names.clone(), of_row: of_row(&|row| all.of_row[row]) })
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
        ("session", table::sessions(rows)),
        ("target", rows.target.as_ref()),
    ];
    for (name, all) in words {
        if let Some(all) = all {
            add(name, labels(all));
        }
    }
    // What contacts speak of, a column for each word that names some.
    let fixture = |row: usize| problem.fixtures.get(rows.observation(row).fixture()?);
    let mut known = Vec::new();
    for word in (0..rows.len()).filter_map(fixture).map(|own| own.kind.word()) {
        if !known.contains(&word) {
            known.push(word);
        }
    }
    for word in known {
        let named = |row: usize| {
            fixture(row).filter(|own| own.kind.word() == word).map_or("", |own| own.name.as_str())
        };
        add(word, Column::Words(picked.iter().map(|&row| named(row)).collect()));
    }
    columns
}

/// A word for what is predicted or left, that of a residual, and its rotation vector.
type Part<'a> =
    (&'static str, fn(&Residual) -> Vector3<f64>, &'a dyn Fn(&Residual) -> Option<Vector3<f64>>);

/// What an arm leaves of measurements, a row for each residual: what names it; predicted and left,
/// in mm and ° and the columns of what some row measures; the length of what is left in units of σ,
/// whether it is an outlier, and held out.
pub fn residual_columns(problem: &Problem, rows: &Measurements, residuals: &[Residual]) -> Columns {
    let picked: Vec<usize> = residuals.iter().map(|residual| residual.row).collect();
    let mut columns = names(problem, rows, &picked);
    let turned = residuals.iter().any(|residual| residual.orientation.is_some());
    let kinds = kinds_of(rows);
    let predicted_turn = |own: &Residual| {
        let (turn, measured) = own.orientation.zip(rows.orientations.as_ref())?;
        Some((UnitQuaternion::from_scaled_axis(-turn) * measured[own.row]).scaled_axis())
    };
    let both: [Part; 2] = [
        ("predicted", |own| own.predicted, &predicted_turn),
        ("residual", |own| own.position, &|own: &Residual| own.orientation),
    ];
    let mut add = |name: String, decimals, cell: &dyn Fn(&Residual) -> f64| {
        columns.push((name, Column::Numbers(residuals.iter().map(cell).collect(), Some(decimals))));
    };
    for (word, value, turn) in both {
        for kind in &kinds {
            let (group, axes) = kind.residuals;
            let is_angle = kind.unit == Unit::Angle;
            let (unit, factor) =
                if is_angle { ("deg", 180.0 / std::f64::consts::PI) } else { ("mm", 1e3) };
            for (k, axis) in axes.iter().enumerate() {
                let is_own =
                    |own: &Residual| rows.observation(own.row).description().residuals.0 == group;
                let cell =
                    |own: &Residual| if is_own(own) { value(own)[k] * factor } else { f64::NAN };
                add(format!("{word}_{axis}_{unit}"), 6, &cell);
            }
        }
        for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate().filter(|_| turned) {
            add(format!("{word}_{axis}_deg"), 7, &|own| {
                turn(own).map_or(f64::NAN, |turn| turn[k].to_degrees())
            });
        }
    }
    add("whitened".to_owned(), 4, &Residual::length);
    columns.push((
        "outlier".to_owned(),
        Column::Flags(residuals.iter().map(|own| own.outlier).collect()),
    ));
    columns.push((
        "held_out".to_owned(),
        Column::Flags(residuals.iter().map(|own| own.held_out).collect()),
    ));
    columns
}

/// The same as CSV.
pub fn residuals_csv(problem: &Problem, rows: &Measurements, residuals: &[Residual]) -> String {
    to_csv(&residual_columns(problem, rows, residuals), residuals.len())
}

/// Returns the kinds of rows in a table, one for each group of residual columns.
fn kinds_of(rows: &Measurements) -> Vec<&'static Kind> {
    let mut kinds: Vec<&Kind> = rows.kinds().into_iter().map(Observation::description).collect();
    let mut groups = BTreeSet::new();
    kinds.retain(|kind| groups.insert(kind.residuals.0));
    if kinds.is_empty() { vec![Observation::Position.description()] } else { kinds }
}
