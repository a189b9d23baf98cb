//! Candidates that the data cannot tell from an effect that was added.

use super::super::candidates::covers;
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::generic::Generic;
use super::super::trace::{Scan, tries};
use super::super::tracing::named_place;
use crate::problem::Effect;

/// Candidates whose criterion is this close to that of an effect in its place are not told from it: odds of 20 to 1.
const UNTOLD: f64 = 6.0;
/// Poses that are enough to tell.
const ENOUGH: usize = 1000;

/// The effects that may stand in the place of an added one.
pub(super) struct Alternatives {
    /// Best first; of one family only the best at each place.
    pub effects: Vec<Effect>,
    /// Whether the best of them explains the data better, beyond doubt.
    pub better: bool,
}

/// What may stand in the place of `effect`, all other effects kept.
pub(super) fn alternatives(
    fitted: &Fitted,
    data: &Data,
    effect: &Effect,
    candidates: &[Effect],
    generics: &[Generic],
) -> Alternatives {
    let library = fitted.library_of(data, &data.thinned(ENOUGH), candidates, generics);
    let parameters = fitted.parameters_of(effect);
    let linear = fitted.linear(&library, &parameters, generics);
    let others: Vec<Effect> = candidates.iter().filter(|other| !covers(effect, other)).cloned().collect();
    let everything: Vec<Effect> = others.iter().chain([effect]).cloned().collect();
    let (all_tries, families) = tries(&everything);
    let own_tries = all_tries.last().copied().unwrap_or(1.0) * families as f64;
    let own = linear.gain(&linear.score(&fitted.columns(&library, &parameters)));
    let own = own.map_or(0.0, |gain| gain.criterion + 2.0 * own_tries.ln());
    let scan = Scan::new(&library, linear, others);
    let ranking = scan.ranking();
    let mut effects: Vec<Effect> = Vec::new();
    for tried in ranking.iter().take_while(|tried| tried.criterion < own + UNTOLD) {
        let candidate = &scan.effects[tried.index];
        let known = |other: &Effect| named_place(other) == named_place(candidate);
        // Other times of the same shift are the same effect; other orders of a harmonic are not.
        let is_own = matches!(effect, Effect::StationShift { .. }) && known(effect);
        if !effects.iter().any(known) && !is_own {
            effects.push(candidate.clone());
        }
    }
    let better = ranking.first().is_some_and(|tried| tried.criterion < own - UNTOLD);
    Alternatives { effects, better }
}
