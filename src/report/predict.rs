//! Text of the command `predict`.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::errors::{measure, sizes};
use super::remainder::bounded;
use super::render::text;
use super::row_kinds::unsteady;
use crate::fit::{ErrorSummary, Prediction};
use crate::problem::Problem;
use crate::quantity::format::counted;
use crate::remainder::Bounds;

/// Returns the predictions as text; `arm` describes the arm that was used.
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
    blocks.extend(bounds.map(|bounds| Block::lines(bounded(bounds, residuals))));
    let unsteady = unsteady(&prediction.spreads);
    if !unsteady.is_empty() {
        blocks.push(Block::list(unsteady));
    }
    text(&blocks)
}
