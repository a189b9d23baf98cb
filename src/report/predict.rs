//! Text and table of `predict`.

use std::fmt::Write as _;

use super::around::unsteady;
use super::columns::{self, Column};
use super::document::{Block, Table};
use super::errors::{measure, sizes};
use super::quantity::counted;
use super::remainder::{bounded, uncertainty};
use super::render::text;
use super::table;
use crate::fit::{ErrorSummary, Prediction};
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::remainder::Bounds;

/// Returns predictions as CSV: columns that name the row, commands, and the predicted pose.
pub fn predictions_csv(
    problem: &Problem,
    rows: &Measurements,
    prediction: &Prediction,
    bounds: Option<&Bounds>,
) -> String {
    let all: Vec<usize> = (0..prediction.positions.len()).collect();
    let mut columns = columns::names(problem, rows, &all);
    let mut add = |name: String, decimals, of: &dyn Fn(usize) -> f64| {
        columns.push((
            name,
            Column::Numbers(all.iter().map(|&row| of(row)).collect(), Some(decimals)),
        ));
    };
    for joint in table::commands(problem) {
        add(joint.column(), 7, &|row| rows.configuration(row)[joint.joint] * joint.factor());
    }
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        add(format!("predicted_{axis}_mm"), 6, &|row| prediction.positions[row][k] * 1e3);
    }
    if let Some(turns) = &prediction.orientations {
        for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate() {
            add(format!("predicted_{axis}_deg"), 7, &|row| turns[row][k].to_degrees());
        }
    }
    columns.extend(bounds.into_iter().flat_map(uncertainty));
    columns::to_csv(&columns, all.len())
}

/// Returns the prediction for an arm as text.
pub fn prediction_text(
    problem: &Problem,
    arm: &str,
    prediction: &Prediction,
    bounds: Option<&Bounds>,
) -> String {
    let mut words = format!(
        "{}\n{} predicted for {arm}",
        problem.title,
        counted(prediction.positions.len(), "pose")
    );
    let lost = prediction
        .positions
        .iter()
        .filter(|position| !position.iter().all(|x| x.is_finite()))
        .count();
    if lost > 0 {
        let _ = write!(words, "; {lost} of them have no equilibrium");
    }
    let mut blocks = vec![Block::lines(words)];
    if !prediction.placed.is_empty() {
        let names = prediction.placed.join(", ");
        blocks.push(Block::lines(format!("Fitted to these rows, with the arm held: {names}")));
    }
    if let Some(errors) = &prediction.errors {
        let row = |name: &str, of: &ErrorSummary| {
            [vec![name.to_owned(), of.n.to_string()], sizes(of).to_vec()].concat()
        };
        let named = |(name, errors_of): &(String, ErrorSummary)| {
            let kind = if errors_of.kind == errors.all.kind {
                String::new()
            } else {
                format!(": {}", measure(errors_of))
            };
            row(&format!("session {name}{kind}"), errors_of)
        };
        let mut rows = vec![row("all rows", &errors.all)];
        rows.extend(
            errors.kinds.iter().skip(1).map(|errors_of| row(measure(errors_of), errors_of)),
        );
        rows.extend(errors.sessions.iter().map(named));
        blocks.push(Block::Table(Table::new(
            &[measure(&errors.all), "rows", "mean", "rms", "max"],
            rows,
            &[0],
        )));
    }
    let residuals = prediction.residuals.as_deref();
    blocks.extend(bounds.map(|own| Block::lines(bounded(own, residuals))));
    let unsteady = unsteady(&prediction.spreads);
    if !unsteady.is_empty() {
        blocks.push(Block::list(unsteady));
    }
    text(&blocks)
}
