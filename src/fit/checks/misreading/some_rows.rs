//! Misreadings of the joint columns in some rows alone.

use nalgebra::DVector;

use super::commands::of_commands;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::stages::fitting::Fitting;

/// Returns the words for the misreading of joint columns that explains the positions of `rows` best,
/// to an rms error below `limit` \[m\], with the full parameter vector `x` of the arm; `None` if none
/// does.
pub(in crate::fit) fn reading_of_rows(
    fit: &CheckedFit,
    (x, limit): (&DVector<f64>, f64),
    rows: &[usize],
) -> Option<String> {
    let Fitting { placement, model, measurements: table, .. } = *fit.fitting;
    let mut corrected = table.clone();
    let mut best = (limit, None);
    for reading in of_commands(fit.problem, table) {
        for &row in rows {
            let place = row * table.joints..(row + 1) * table.joints;
            let q = &mut corrected.configurations[place];
            q.copy_from_slice(table.configuration(row));
            reading.undo_command(q, fit.problem, table);
        }
        let rms = fit.rms(rows, &placement.position_errors(model, x, &corrected, rows));
        if rms < best.0 {
            best = (rms, Some(reading));
        }
    }
    best.1.map(|reading| format!("they fit with {reading}"))
}
