//! Errors by kind of rows, and spread of the target at touched points.

use super::document::{Block, Table};
use super::errors::{error_label, format_error};
use crate::fit::{ErrorSummary, Identification, PointSpread};
use crate::quantity::format::{mm, number};

/// Returns the table of errors by kind of rows, if there are several kinds, and the table of the
/// spread at touched points, if there are any.
pub(super) fn row_kind_tables<'a>(found: &Identification) -> Vec<Block<'a>> {
    let row = |kind: &str, rows: &str, before: &ErrorSummary, after: &ErrorSummary| {
        let values = [before.rms.norm, after.rms.norm].map(|value| format_error(after, value));
        [vec![kind.to_owned(), rows.to_owned(), after.n.to_string()], values.to_vec()].concat()
    };
    let mut blocks = Vec::new();
    let kinds = found.kinds.iter().flat_map(|(before, after)| {
        let kind = error_label(&after.held_out);
        [
            row(kind, "held out", &before.held_out, &after.held_out),
            row("", "identification", &before.identification, &after.identification),
        ]
    });
    let rows: Vec<Vec<String>> = kinds.collect();
    if !rows.is_empty() {
        let header = ["rms by kind of row", "", "rows", "before", "after"];
        blocks.push(Block::Table(Table::new(&header, rows, &[0, 1])));
    }
    let spreads = found.spreads.iter().map(|(before, after, held_out)| {
        let words = if *held_out { "held out" } else { "" };
        vec![
            after.point.clone(),
            words.to_owned(),
            after.n.to_string(),
            mm(before.mean, 4),
            mm(after.mean, 4),
        ]
    });
    let rows: Vec<Vec<String>> = spreads.collect();
    if !rows.is_empty() {
        let header = ["spread at points, mm", "", "rows", "before", "after"];
        let mut table = Table::new(&header, rows, &[0, 1]);
        table.notes.push(
            "mean distance of the predicted target from its mean over the rows at one point"
                .to_owned(),
        );
        table.notes.extend(unsteady_points(found.spreads.iter().map(|spread| &spread.1)));
        blocks.push(Block::Table(table));
    }
    blocks
}

/// Returns a sentence for each touched point whose spread is far larger than that of the others.
pub(super) fn unsteady_points<'a>(
    spreads: impl IntoIterator<Item = &'a PointSpread>,
) -> Vec<String> {
    let sentence = |(spread, times): (&PointSpread, f64)| {
        let [x, y, z] =
            [spread.along.x, spread.along.y, spread.along.z].map(|value| number(value, 2));
        format!(
            "the spread at {} is {} mm, {} times the median of all points, {} % of it along ({x}, {y}, {z}): its support may have moved \
             or yielded",
            spread.point,
            mm(spread.mean, 3),
            number(times, 1),
            number(100.0 * spread.share, 0),
        )
    };
    PointSpread::unsteady(spreads).into_iter().map(sentence).collect()
}
