//! Searched arguments of the added effects on all rows: times between poses that the evidence did
//! not see, and time constants, distances and orders between those that are listed.

use super::state::SearchState;
use crate::fit::IdentifyError;
use crate::problem::Effect;
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::settings::{LN_ODDS_OF_ANOTHER_ARGUMENT, MAX_SHIFT_TIMES};

/// Factors of a time constant, distance or order that are tried in its place.
const FACTORS: [f64; 10] = [0.8, 0.86, 0.91, 0.95, 0.98, 1.02, 1.05, 1.1, 1.16, 1.25];

/// Returns the fit with the searched argument of one effect exchanged for the one that explains all
/// identification rows best in the linear neighbourhood, where that is beyond doubt better; `None`
/// where no argument is.
///
/// # Errors
/// The fit fails, or the search was stopped.
pub(super) fn polished(
    state: &SearchState,
    fitted: &Fitted,
) -> Result<Option<Fitted>, IdentifyError> {
    let data = state.data;
    // On rows that the evidence saw all of, it tried these arguments itself.
    if data.rows().len() == data.evidence_rows().len() {
        return Ok(None);
    }
    let added = state.added(fitted);
    for effect in added.iter().filter(|effect| effect.is_searched()) {
        let Some(better) = better_argument(fitted, data, effect) else { continue };
        let others = added.iter().filter(|other| *other != effect);
        let effects: Vec<Effect> = others.chain([&better]).cloned().collect();
        return state.fit(fitted, &effects).map(Some);
    }
    Ok(None)
}

fn better_argument(fitted: &Fitted, data: &Data, effect: &Effect) -> Option<Effect> {
    let mut tried = nearby(data, effect);
    tried.push(effect.clone());
    let linearised = fitted.linearised_at(data, data.rows(), &tried);
    let without = fitted.neighbourhood_without(&linearised, &fitted.unknowns_of(effect));
    let scatter = fitted.around(data).sums();
    let variance = scatter.squares / scatter.freedom();
    let ln_likelihood = |effect: &Effect| {
        let gain = without.sums().gain(&without.score(&linearised.columns(effect)));
        gain.map_or(0.0, |gain| 0.5 * gain.squares / variance)
    };
    let reference = ln_likelihood(effect);
    let best = tried.into_iter().map(|effect| (ln_likelihood(&effect), effect));
    let (gain, best) = best.max_by(|a, b| a.0.total_cmp(&b.0))?;
    (gain > reference + LN_ODDS_OF_ANOTHER_ARGUMENT).then_some(best)
}

/// Returns the effect with other searched arguments: times between the poses up to the neighbouring
/// listed times, or multiples.
fn nearby(data: &Data, effect: &Effect) -> Vec<Effect> {
    let time = match effect {
        Effect::StationShift { at_time } | Effect::StationMove { at_time } => *at_time,
        _ => return FACTORS.iter().filter_map(|factor| effect.scaled(*factor)).collect(),
    };
    let all = data.times_between_poses();
    // The evidence sees every n-th row, and the list holds every m-th time.
    let thinned = data.rows().len().div_ceil(data.evidence_rows().len().max(1));
    let reach = 2 * thinned.max(all.len().div_ceil(MAX_SHIFT_TIMES));
    let place = all.partition_point(|other| *other < time);
    let near = all[place.saturating_sub(reach)..all.len().min(place + reach)].iter();
    let at = |&at_time: &f64| match effect {
        Effect::StationMove { .. } => Effect::StationMove { at_time },
        _ => Effect::StationShift { at_time },
    };
    near.map(at).filter(|other| other != effect).collect()
}
