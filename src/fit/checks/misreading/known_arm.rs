//! Search for misreadings of a table of an arm that is known.

use nalgebra::DVector;

use super::candidates::candidates;
use super::first_of;
use super::reversed::MAX_REVERSED;
use super::search::{MAX_CLEAR_RATIO, MAX_RATIO_TO_BEST};
use super::{Kind, Misreading};
use crate::fit::Placement;
use crate::measurement::Measurements;
use crate::model::Model;
use crate::numeric::{parallel, root_mean, spaced};
use crate::problem::Problem;

/// Maximum number of rows, evenly spaced, that are predicted with each misreading.
const MAX_PREDICTED_ROWS: usize = 12;
/// Minimum number of different configurations from which a misreading is named.
const MIN_CONFIGURATIONS: usize = 4;

/// Returns the misreadings of a `table` of positions with which an arm predicts them far better, and
/// the rms error of all positions that the best one leaves \[m\]. The arm has the full parameter
/// vector `x`. `None` if no misreading leaves less than [`MAX_CLEAR_RATIO`] of the error, or if the
/// table has fewer than [`MIN_CONFIGURATIONS`].
///
/// Misreadings that leave out rows are not tried, because these rows may be the ones that are off.
pub(crate) fn misread_table(
    problem: &Problem,
    (model, x): (&Model, &DVector<f64>),
    table: &Measurements,
) -> Option<(String, f64)> {
    let placement = Placement::of(table);
    let of_positions: Vec<usize> =
        (0..table.len()).filter(|&row| table.observation(row).is_position()).collect();
    if table.select(&of_positions).configurations(problem).1 < MIN_CONFIGURATIONS {
        return None;
    }
    let chosen = spaced(of_positions.clone(), MAX_PREDICTED_ROWS);
    let error = |misreading: &Misreading, chosen: &[usize]| {
        let rows = misreading.undone(table, chosen, table.joints);
        let of_rows = Placement::of(&rows);
        if of_rows.bases != placement.bases || of_rows.targets != placement.targets {
            return None;
        }
        let every_row: Vec<usize> = (0..rows.len()).collect();
        let residuals = model.residuals(of_rows.poses(&rows, &every_row, 1.0), x);
        let rms = root_mean(residuals.iter().map(nalgebra::Matrix::norm_squared));
        rms.is_finite().then(|| (misreading.clone(), rms))
    };
    let as_read = |chosen: &[usize]| Some(error(&Misreading::none(), chosen)?.1);
    // The estimate contradicts misreadings of the problem, and small zero offsets are changes.
    let is_of_table = |misreading: &Misreading| {
        let is_left_out =
            matches!(misreading.kind, Kind::Zero(..) | Kind::Mirrored | Kind::Shifted(..));
        !is_left_out && !misreading.concerns_problem()
    };
    let mut tested = candidates(problem, table);
    tested.retain(is_of_table);
    tested.extend(Misreading::all_mirrored());
    let sets = 1..1_u64 << table.joints.min(MAX_REVERSED);
    let sets = sets.filter(|joints| joints.count_ones() > 1);
    tested.extend(sets.map(Misreading::reversed));
    let near = |errors: Vec<Option<(Misreading, f64)>>, as_read: f64| {
        let mut errors: Vec<(Misreading, f64)> = errors.into_iter().flatten().collect();
        errors.sort_by(|a, b| a.1.total_cmp(&b.1));
        let best = errors.first().map_or(0.0, |found| found.1);
        let limit = (MAX_CLEAR_RATIO * as_read).min(MAX_RATIO_TO_BEST * best);
        errors.retain(|(_, rms)| *rms <= limit);
        errors
    };
    let errors = parallel::map_items(&tested, |misreading| error(misreading, &chosen));
    // The few rows only choose the misreadings that are tried with all.
    let chosen = near(errors, as_read(&chosen)?).into_iter();
    let errors = chosen.map(|(misreading, _)| error(&misreading, &of_positions)).collect();
    let explaining = near(errors, as_read(&of_positions)?);
    let best = explaining.first()?.1;
    let words = |misreading: &Misreading| {
        let words = misreading.described(None);
        let may_be_of_arm = matches!(
            misreading.kind,
            Kind::Ratio(_) | Kind::Coupled | Kind::Screw | Kind::Reversed(_)
        );
        if may_be_of_arm { format!("{words} (or the arm has changed so)") } else { words }
    };
    let named: Vec<String> = explaining.iter().map(|(misreading, _)| words(misreading)).collect();
    Some((first_of(&named), best))
}
