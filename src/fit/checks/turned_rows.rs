//! Search for rows whose orientation is mistaken: those of other rows, or of a target that was turned.

use nalgebra::UnitQuaternion;

use super::checked_fit::CheckedFit;
use super::convention::mean_rotation;
use crate::fit::stages::fitting::Fitting;

/// Minimum number of rows on each side of a change.
const MIN_ROWS: usize = 4;

/// Returns the words for the mistake with which the measured orientations agree with those of the
/// nominal arm, registered to the positions alone, to an rms angle below `limit` \[rad\]; `None` if
/// there is none. A constant rotation of the tool is fitted.
pub(super) fn mistaken_orientations(fit: &CheckedFit, limit: f64) -> Option<String> {
    let fitting = fit.fitting;
    let table = fitting.measurements;
    let by_positions = Fitting { turn_sigma: None, ..fitting.with_declared_noise() };
    let x = by_positions.registered().ok()?;
    let every_row: Vec<usize> = (0..table.len()).collect();
    let predicted = fitting.model.orientations(&fitting.poses(&every_row), x.as_slice());
    let is_measured = |row: &usize| table.orientation(*row).is_some();
    let rows: Vec<usize> =
        fitting.split.identification.iter().copied().filter(is_measured).collect();
    // The rotations from the orientations of the arm, in the row itself or beside it, to the measured
    // ones.
    let tools = |by: isize| -> Vec<(usize, UnitQuaternion<f64>)> {
        let tool = |&row: &usize| {
            let turn = predicted.get(row.checked_add_signed(by)?)?;
            let is_known = turn.iter().all(|component| component.is_finite());
            let arm = UnitQuaternion::from_scaled_axis(*turn);
            is_known.then_some((row, arm.inverse() * table.orientation(row)?))
        };
        rows.iter().filter_map(tool).collect()
    };
    for (by, side) in [(-1, "before"), (1, "after")] {
        if spread(&tools(by)).is_some_and(|(spread, _)| spread < limit) {
            return Some(format!("each orientation belongs to the row {side}"));
        }
    }
    let tools = tools(0);
    let change = |first: usize| {
        let (before, after) = (spread(&tools[..first])?, spread(&tools[first..])?);
        Some((before.0.max(after.0), first, before.1.angle_to(&after.1)))
    };
    let changes = (MIN_ROWS..(tools.len() + 1).saturating_sub(MIN_ROWS)).filter_map(change);
    let (error, first, angle) = changes.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (error < limit).then(|| {
        format!(
            "from {} on the measured frame is turned by {:.1}°: give these rows another word in a \
             column target, or correct them",
            table.location(tools[first].0),
            angle.to_degrees()
        )
    })
}

/// Returns the root mean squared angle of rotations from their mean \[rad\], and the mean; `None` for
/// few rotations.
fn spread(rotations: &[(usize, UnitQuaternion<f64>)]) -> Option<(f64, UnitQuaternion<f64>)> {
    let rotations: Vec<UnitQuaternion<f64>> = rotations.iter().map(|of| of.1).collect();
    let mean = mean_rotation(&rotations);
    let squares: f64 = rotations.iter().map(|rotation| rotation.angle_to(&mean).powi(2)).sum();
    let count = rotations.len();
    (count >= MIN_ROWS).then(|| ((squares / count as f64).sqrt(), mean))
}
