//! Effect that expresses a misread table, with which the search begins.

use super::state::SearchState;
use crate::fit::{IdentifyError, MisreadEffect, Options};
use crate::problem::Problem;
use crate::select::candidates::Candidates;
use crate::select::evidence::{Claims, Hypothesis};
use crate::select::fitted::Fitted;
use crate::select::left_out_gain::LeftOutGain;

/// Fits the declared problem with the effect that expresses the misreading of its table, starting
/// at the size that the checks found. Returns `None` if there is no such effect, or if it does not
/// predict left-out poses significantly better.
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
    let MisreadEffect { effect, size, .. } = misread.clone();
    let candidates = Candidates::new(&declared.problem, state.data);
    if !candidates.testable.contains(&effect) {
        return Ok(None);
    }
    let names = misread.parameters(&declared.problem).into_iter();
    let start = names.map(|name| (name, size)).collect();
    let options = Options { start, influential_rows: false, ..state.options.clone() };
    state.misread = Some(misread);
    let problem = state.problem(declared, &[effect]);
    let fitted = match declared.fit_other(problem, state.data, &options) {
        Ok(fitted) => fitted,
        Err(error) if error.is_interrupted() => return Err(error),
        Err(_) => {
            state.misread = None;
            return Ok(None);
        }
    };
    let gain = LeftOutGain::new(&fitted, declared, state.data);
    if !gain.is_some_and(|gain| gain.is_significant()) {
        state.misread = None;
        return Ok(None);
    }
    state.register_new(&fitted);
    state.record(&fitted);
    Ok(Some(fitted))
}

/// Returns the claims about the effect: place, quantities and law have the probability of this
/// misreading among all possible ones.
pub(super) fn misread_claims(misread: &MisreadEffect, problem: &Problem) -> Claims {
    let law = Hypothesis::of_effect(&misread.effect, problem, (false, false));
    let p = misread.probability;
    Claims { place: (law.site, p), depends_on: (law.depends_on.clone(), p), law: (law, p) }
}
