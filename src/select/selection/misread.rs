//! Effect that expresses a misread table, with which the search begins.

use super::state::SearchState;
use crate::fit::{IdentifyError, MisreadEffect, Options};
use crate::select::candidates::Candidates;
use crate::select::fitted::Fitted;
use crate::select::left_out_gain::LeftOutGain;

/// Fits the declared problem with the effect that expresses the misreading of its table, starting
/// at the size that the checks found. Returns `None` if there is no such effect, or if poses that
/// are left out do not gain by it.
///
/// A search in the linear neighbourhood of a fit that is far off would not find such an effect.
///
/// # Errors
/// Returns an error if the fit fails or was stopped.
pub(super) fn with_misread_effect(
    state: &mut SearchState,
    declared: &Fitted,
) -> Result<Option<Fitted>, IdentifyError> {
    let Some(misread) = declared.found.misread.clone() else { return Ok(None) };
    let MisreadEffect { effect, size, .. } = &misread;
    let candidates = Candidates::new(&declared.problem, state.data);
    if !candidates.testable.contains(effect) {
        return Ok(None);
    }
    let parameters = effect.parameters(&declared.problem).into_iter();
    let start = parameters.map(|parameter| (parameter.name, *size)).collect();
    let options = Options { start, influential_rows: false, ..state.options.clone() };
    let problem = state.problem(declared, std::slice::from_ref(effect));
    let fitted = declared.next(problem, state.data, &options)?;
    let gain = LeftOutGain::new(&fitted, declared, state.data);
    if !gain.is_some_and(|gain| gain.is_significant()) {
        return Ok(None);
    }
    state.misread = Some(misread);
    state.is_new(&fitted);
    state.record(&fitted);
    Ok(Some(fitted))
}
