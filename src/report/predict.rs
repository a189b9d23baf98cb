//! What `predict` says and writes, and the residuals of `identify` and `loop` as a table.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{UnitQuaternion, Vector3};

use super::document::{Block, Table};
use super::json::{Summary, object, to_text};
use super::quantity::{fixed, mm};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::identify::{ErrorSummary, ErrorsBySession, Prediction, Residual};
use crate::measurement::Measurements;
use crate::problem::Problem;

/// Columns of a predicted orientation, a rotation vector.
const PREDICTED_TURN: &str = "predicted_rx_deg,predicted_ry_deg,predicted_rz_deg";

object! {
    Document(errors: &ErrorsBySession) {
        all: Summary = Summary::of(&errors.all),
        sessions: BTreeMap<String, Summary> =
            errors.sessions.iter().map(|(name, own)| (name.clone(), Summary::of(own))).collect(),
    }
}

/// Errors of all rows and of each session as JSON text, ending in a line break.
pub fn errors_json(errors: &ErrorsBySession) -> String {
    to_text(&Document::of(errors))
}

/// Predicted positions as CSV: file and line of each row, what names it, its commands, and where the arm will be.
pub fn predictions_csv(problem: &Problem, rows: &Measurements, prediction: &Prediction) -> String {
    let (names, joints) = (RowNames::of(rows), table::commands(problem));
    let mut header = names.header();
    header.extend(joints.iter().map(|(_, name, _)| name.clone()));
    header.extend(table::names("predicted_x_mm,predicted_y_mm,predicted_z_mm"));
    header.extend(prediction.orientations.iter().flat_map(|_| table::names(PREDICTED_TURN)));
    let line = |(row, position): (usize, &Vector3<f64>)| {
        let mut cells = names.cells(row);
        cells.extend(joints.iter().map(|&(j, _, factor)| fixed(rows.configuration(row)[j] * factor, 7)));
        cells.extend(position.iter().map(|x| fixed(x * 1e3, 6)));
        cells.extend(
            prediction.orientations.iter().flat_map(|all| all[row].iter().map(|turn| fixed(turn.to_degrees(), 7))),
        );
        cells
    };
    csv(header, prediction.positions.iter().enumerate().map(line))
}

/// What an arm leaves of measurements as CSV, a row for each of theirs; `whitened` is the length of the residual in units of σ.
pub fn residuals_csv(rows: &Measurements, residuals: &[Residual]) -> String {
    let names = RowNames::of(rows);
    let mut header = names.header();
    let turned = residuals.iter().any(|residual| residual.orientation.is_some());
    header.extend(table::names("predicted_x_mm,predicted_y_mm,predicted_z_mm"));
    header.extend(turned.then(|| table::names(PREDICTED_TURN)).into_iter().flatten());
    header.extend(table::names("residual_x_mm,residual_y_mm,residual_z_mm"));
    header
        .extend(turned.then(|| table::names("residual_rx_deg,residual_ry_deg,residual_rz_deg")).into_iter().flatten());
    header.extend(table::names("whitened,outlier,held_out"));
    let line = |residual: &Residual| {
        let mut cells = names.cells(residual.row);
        let predicted = rows.positions[residual.row] - residual.position;
        let degrees = |turn: Vector3<f64>| turn.map(f64::to_degrees).iter().map(|x| fixed(*x, 7)).collect::<Vec<_>>();
        cells.extend(predicted.iter().map(|x| fixed(x * 1e3, 6)));
        if let (Some(turn), Some(measured)) = (residual.orientation, &rows.orientations) {
            let predicted = UnitQuaternion::from_scaled_axis(-turn) * measured[residual.row];
            cells.extend(degrees(predicted.scaled_axis()));
        }
        cells.extend(residual.position.iter().map(|x| fixed(x * 1e3, 6)));
        cells.extend(residual.orientation.into_iter().flat_map(degrees));
        cells.push(fixed(residual.length(), 4));
        cells.extend([residual.outlier, residual.held_out].map(|word| word.to_string()));
        cells
    };
    csv(header, residuals.iter().map(line))
}

/// What came of a prediction, in words.
pub fn prediction_text(problem: &Problem, arm: &str, prediction: &Prediction) -> String {
    let mut words = format!("{}\n{} poses predicted for {arm}", problem.title, prediction.positions.len());
    let lost = prediction.positions.iter().filter(|position| !position.iter().all(|x| x.is_finite())).count();
    if lost > 0 {
        let _ = write!(words, "; {lost} of them have no equilibrium");
    }
    let mut blocks = vec![Block::lines(words)];
    if !prediction.placed.is_empty() {
        let names = prediction.placed.join(", ");
        blocks.push(Block::lines(format!("Fitted to these rows, with the arm as it is: {names}")));
    }
    if let Some(errors) = &prediction.errors {
        let row = |name: &str, of: &ErrorSummary| {
            let values = [of.mean.norm, of.rms.norm, of.max.norm].map(|value| mm(value, 4));
            [vec![name.to_owned(), of.n.to_string()], values.to_vec()].concat()
        };
        let mut rows = vec![row("all rows", &errors.all)];
        rows.extend(errors.sessions.iter().map(|(name, own)| row(&format!("session {name}"), own)));
        blocks.push(Block::Table(Table::new(&["error, mm", "poses", "mean", "rms", "max"], rows, &[0])));
    }
    text(&blocks)
}

/// The columns by which a row is known: file, line, and the words and numbers of its table that name it.
struct RowNames<'a> {
    rows: &'a Measurements,
}

impl<'a> RowNames<'a> {
    fn of(rows: &'a Measurements) -> Self {
        Self { rows }
    }

    fn header(&self) -> Vec<String> {
        let Measurements { pose, pose_names, target, .. } = self.rows;
        let there = [
            ("pose", pose.is_some() || pose_names.is_some()),
            ("session", table::sessions(self.rows).is_some()),
            ("target", target.is_some()),
        ];
        let own = there.into_iter().filter(|(_, there)| *there).map(|(name, _)| name);
        ["file", "line"].into_iter().chain(own).map(str::to_owned).collect()
    }

    fn cells(&self, row: usize) -> Vec<String> {
        let Measurements { pose, pose_names, target, .. } = self.rows;
        let place = self.rows.location(row);
        let mut cells = vec![place.file.display().to_string(), place.line.unwrap_or(0).to_string()];
        cells.extend(pose.as_ref().map(|all| all[row].to_string()));
        cells.extend(pose_names.as_ref().map(|all| table::word(all, row)));
        cells.extend(
            [table::sessions(self.rows), target.as_ref()].into_iter().flatten().map(|all| table::word(all, row)),
        );
        cells
    }
}
