//! Fits of some rows alone, with the measurements of a table.

use super::checked_fit::CheckedFit;
use crate::fit::stages::fitting::Fitting;
use crate::measurement::{Measurements, Split};

/// Returns the rms error of the nominal arm after its registration to the `chosen` rows of
/// `measurements` alone \[m\].
pub(super) fn registration_error(
    fit: &CheckedFit,
    measurements: &Measurements,
    chosen: &[usize],
) -> Option<f64> {
    let split = Split { identification: chosen.to_vec(), held_out: Vec::new() };
    of_rows(fit, measurements, &split, |fitting| {
        let x = fitting.registered().ok()?;
        Some(fit.rms(chosen, &fitting.position_errors(chosen, &x)))
    })
}

/// Calls `evaluate` with the fit of the identification rows of `split` alone.
pub(super) fn of_rows<R>(
    fit: &CheckedFit,
    measurements: &Measurements,
    split: &Split,
    evaluate: impl FnOnce(&Fitting) -> R,
) -> R {
    let Fitting { placement, model, .. } = *fit.fitting;
    let held_out_only = placement.held_out_only(model, measurements, split);
    let declared = fit.fitting.with_declared_noise();
    let fitting = Fitting { split, measurements, turn_sigma: None, held_out_only, ..declared };
    evaluate(&fitting)
}
