//! Text and page of the command `predict`.

use std::fmt::Write as _;

use super::document::{Block, Table, opening};
use super::errors::{error_label, mean_rms_max, with_unit};
use super::figures::{ACCENT, Curve, Drawing, INK, Series, WARM};
use super::remainder::{bound_sentence, contradiction};
use super::render::Story;
use super::row_kinds::unsteady_points;
use crate::fit::{ErrorSummary, Prediction, rows_of_kind};
use crate::problem::Problem;
use crate::quantity::format::{counted, mm, percent_of};
use crate::remainder::{Bounds, Compared};

/// Returns the predictions, with a figure of the errors of measured rows. `arm` describes the arm
/// that was used, and `fitted` lists the predicted rows (from 0, ascending) to which that arm was
/// fitted. `lacks_loads` is true if the table lacks a column of loads that these rows had.
pub(crate) fn prediction(
    problem: &Problem,
    arm: &str,
    prediction: &Prediction,
    (compared, fitted, lacks_loads): (Option<Compared>, &[usize], bool),
) -> Story {
    let count = prediction.positions.len();
    let single_kind = prediction.errors.as_ref().filter(|errors| errors.kinds.is_empty());
    let rows = match single_kind.map(|errors| errors.all.kind) {
        Some(kind) if kind != "position" => format!("{count} {}", rows_of_kind(kind)),
        _ => counted(count, "pose"),
    };
    let mut words = format!("{rows} predicted for {arm}");
    let lost = prediction.lost_rows().len();
    if lost > 0 {
        let _ = write!(words, "; {lost} of them have no equilibrium");
    }
    let mut blocks = opening(&problem.title, words).to_vec();
    let contradiction = compared
        .filter(|_| fitted.is_empty())
        .and_then(|compared| contradiction(compared, lacks_loads));
    blocks.extend(contradiction.clone().map(Block::Text));
    if !prediction.placed.is_empty() {
        let names = prediction.placed.join(", ");
        blocks.push(Block::lines(format!("Fitted to these rows, with the arm held: {names}")));
    }
    if let Some(errors) = &prediction.errors {
        let row = |name: &str, of: &ErrorSummary| {
            [vec![name.to_owned(), of.n.to_string()], mean_rms_max(of).to_vec()].concat()
        };
        let named = |(name, errors_of): &(String, ErrorSummary)| {
            let kind = if errors_of.kind == errors.all.kind {
                String::new()
            } else {
                format!(": {}", error_label(errors_of))
            };
            row(&format!("session {name}{kind}"), errors_of)
        };
        let mut rows = vec![row("all rows", &errors.all)];
        rows.extend(
            errors.kinds.iter().skip(1).map(|errors_of| row(error_label(errors_of), errors_of)),
        );
        rows.extend(errors.sessions.iter().map(named));
        blocks.push(Block::Table(Table::new(
            &[error_label(&errors.all), "rows", "mean", "rms", "max"],
            rows,
            &[0],
        )));
    }
    // If base or tool are fitted to these rows, a few rows do not test the bounds.
    blocks.extend(fitted_rows_sentence(prediction, fitted).map(Block::Text));
    blocks.extend(compared.filter(|_| lost == 0).map(|compared| {
        let suffices = 3 * compared.errors.len() > prediction.placed.len();
        let measured = Some(compared).filter(|_| suffices && contradiction.is_none());
        Block::lines(bound_sentence(compared.bounds, &[], measured))
    }));
    let unsteady = unsteady_points(&prediction.spreads);
    if !unsteady.is_empty() {
        blocks.push(Block::list(unsteady));
    }
    blocks
        .push(Block::figures([draw_errors(prediction, compared.map(|compared| compared.bounds))]));
    Story::new(&problem.title, "predictions", blocks)
}

/// States that the positions of all rows are true ones of the model itself, from which its readings
/// differ by `rms` \[m\] in root mean square.
pub fn true_positions_sentence(rms: f64) -> String {
    format!(
        "the positions of these rows are true positions of the model itself, such as targets of \
         commands.csv, and the predictions are readings of the instrument: they differ by {} mm rms, \
         by its declared errors alone, which verifies nothing",
        mm(rms, 3)
    )
}

/// Returns true if all predicted rows measure positions; false if they contain no measurements.
fn is_of_positions(prediction: &Prediction) -> bool {
    let errors = prediction.errors.as_ref();
    errors.is_some_and(|errors| errors.kinds.is_empty() && errors.all.kind == "position")
}

/// States to how many of the predicted rows the arm was fitted, and the error of the others if all
/// rows are of one kind; `None` if it was fitted to no row.
fn fitted_rows_sentence(prediction: &Prediction, fitted: &[usize]) -> Option<String> {
    let residuals = prediction.residuals.as_ref().filter(|_| !fitted.is_empty())?;
    let others = residuals.iter().enumerate().filter(|(row, _)| fitted.binary_search(row).is_err());
    let errors: Vec<f64> = others.map(|(_, residual)| residual.position.norm()).collect();
    let count = residuals.len() - errors.len();
    if errors.is_empty() {
        let words = "The arm was fitted to all of these rows: errors of new poses are larger.";
        return Some(words.to_owned());
    }
    let Some(of) = prediction.errors.as_ref().filter(|errors| errors.kinds.is_empty()) else {
        return Some(format!("The arm was fitted to {count} of these rows."));
    };
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    let largest = errors.iter().copied().fold(0.0, f64::max);
    let [mean, largest] = [mean, largest].map(|error| with_unit(&of.all, error));
    Some(format!(
        "The arm was fitted to {count} of these rows; the error of the {} others is {mean} in the \
         mean, {largest} at most.",
        errors.len()
    ))
}

/// Draws the error of each row against its bound, or against the number of the row if there are no
/// bounds; `None` unless all rows measure positions.
fn draw_errors(prediction: &Prediction, bounds: Option<&Bounds>) -> Option<Drawing> {
    if !is_of_positions(prediction) {
        return None;
    }
    let residuals = prediction.residuals.as_ref()?;
    let lengths = residuals.iter().map(|residual| residual.position.norm() * 1e3);
    let Some(bounds) = bounds else {
        let points = lengths.enumerate().map(|(row, length)| ((row + 1) as f64, length));
        return Series {
            names: ("prediction-errors", "Error of each row"),
            caption: "Distance between measured and predicted position of each row.".to_owned(),
            labels: ("row", "error [mm]"),
            curves: vec![Curve::new("row", INK, points).scattered()],
            ..Series::default()
        }
        .drawing();
    };
    let points = lengths.enumerate().map(|(row, length)| (bounds.bound(row) * 1e3, length));
    let (within, beyond): (Vec<_>, Vec<_>) = points.partition(|(bound, length)| length <= bound);
    let most = bounds.poses.len();
    let bound = (0..most).map(|row| bounds.bound(row) * 1e3).fold(0.0, f64::max);
    let percent = percent_of(bounds.level);
    Series {
        names: ("prediction-errors", "Error of each row against its bound"),
        caption: format!(
            "Distance between measured and predicted position of each row, and the bound that holds for it with a probability of \
             {percent} %. Dots above the line exceed their bounds."
        ),
        labels: ("bound [mm]", "error [mm]"),
        curves: vec![
            Curve::new("error = bound", ACCENT, [(0.0, 0.0), (bound, bound)]),
            Curve::new("within", INK, within).scattered(),
            Curve::new("beyond", WARM, beyond).scattered(),
        ],
        ..Series::default()
    }
    .drawing()
}
