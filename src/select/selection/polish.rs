//! Refinement of the searched arguments of added effects on all rows. Trial values are times
//! between poses that the evidence did not use, and time constants, distances and orders between
//! the listed ones.

use nalgebra::DMatrix;

use super::state::SearchState;
use crate::fit::IdentifyError;
use crate::problem::Effect;
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::neighbourhood::{Linearised, Score};
use crate::select::settings::{LN_ODDS_OF_ANOTHER_ARGUMENT, MAX_SHIFT_TIMES};

/// Maximum number of moves of one argument to the best of its neighbouring values.
const MAX_POLISHING_PASSES: usize = 8;
/// Factors by which a time constant, distance or order is multiplied for its trial values.
const TRIAL_FACTORS: [f64; 10] = [0.8, 0.86, 0.91, 0.95, 0.98, 1.02, 1.05, 1.1, 1.16, 1.25];

/// Returns the fit with refined arguments. Each searched argument is replaced by the value that
/// explains all identification rows best in the linear neighbourhood, if its odds over the present
/// value exceed [`LN_ODDS_OF_ANOTHER_ARGUMENT`]. Returns `None` if no argument changes, or if the
/// evidence already used all rows and times.
///
/// # Errors
/// Returns an error if the fit fails or the search was stopped.
pub(super) fn polished(
    state: &SearchState,
    fitted: &Fitted,
) -> Result<Option<Fitted>, IdentifyError> {
    let data = state.data;
    // If the evidence used all rows and all times between poses, it has already tried these
    // arguments.
    let saw_all = data.rows().len() == data.evidence_rows().len();
    if saw_all && data.times_between_poses().len() <= MAX_SHIFT_TIMES {
        return Ok(None);
    }
    let added = state.added(fitted);
    let searched: Vec<Effect> =
        added.iter().filter(|effect| effect.is_searched()).cloned().collect();
    if searched.is_empty() {
        return Ok(None);
    }
    // An effect with another argument acts at the same sites.
    let linearised = fitted.linearised_at(data, data.rows(), &searched);
    let polished = |effect: &Effect| {
        let of_effect = || better_argument((fitted, &linearised), data, effect);
        let better = effect.is_searched().then(of_effect);
        better.flatten().unwrap_or_else(|| effect.clone())
    };
    let effects: Vec<Effect> = added.iter().map(polished).collect();
    if effects == added { Ok(None) } else { state.fit(fitted, &effects).map(Some) }
}

/// Returns the effect with the value of its argument that explains all rows best; `None` if that is
/// not clearly better than the present value. The argument moves to the best neighbouring value at
/// most [`MAX_POLISHING_PASSES`] times. `linearised` has the columns of the effect's sites at all
/// rows.
fn better_argument(
    (fitted, linearised): (&Fitted, &Linearised),
    data: &Data,
    effect: &Effect,
) -> Option<Effect> {
    let sums = fitted.neighbourhood_at_rows(data).sums();
    let variance = sums.squares / sums.freedom();
    let fit = fitted.neighbourhood_without(linearised, &fitted.unknowns_of(effect));
    let (mut best, mut gain_of_present) = ((f64::NEG_INFINITY, effect.clone()), f64::INFINITY);
    for _ in 0..MAX_POLISHING_PASSES {
        let tried: Vec<Effect> =
            [vec![best.1.clone()], neighbouring_arguments(data, &best.1)].concat();
        let columns: Vec<DMatrix<f64>> =
            tried.iter().map(|effect| linearised.columns(effect)).collect();
        let gain = |score: &Score| fit.sums().gain(score).map_or(0.0, |gain| gain.squares);
        let gains: Vec<f64> =
            fit.scores(&columns).iter().map(|score| 0.5 * gain(score) / variance).collect();
        if best.0 == f64::NEG_INFINITY {
            (best.0, gain_of_present) = (gains[0], gains[0]);
        }
        let next = gains.into_iter().zip(tried).max_by(|a, b| a.0.total_cmp(&b.0))?;
        if next.0 <= best.0 {
            break;
        }
        best = next;
    }
    (best.0 > gain_of_present + LN_ODDS_OF_ANOTHER_ARGUMENT).then_some(best.1)
}

/// Returns the effect with neighbouring values of its argument. Times move to times between poses,
/// up to the next listed times; others are multiplied by [`TRIAL_FACTORS`].
fn neighbouring_arguments(data: &Data, effect: &Effect) -> Vec<Effect> {
    let time = match effect {
        Effect::StationShift { at_time } | Effect::StationMove { at_time } => *at_time,
        _ => {
            return TRIAL_FACTORS
                .iter()
                .filter_map(|factor| effect.with_scaled_argument(*factor))
                .collect();
        }
    };
    let times = data.times_between_poses();
    // The evidence uses every n-th row, and the list of times contains every m-th time.
    let thinned = data.rows().len().div_ceil(data.evidence_rows().len().max(1));
    let reach = 2 * thinned.max(times.len().div_ceil(MAX_SHIFT_TIMES));
    let index = times.partition_point(|other| *other < time);
    let near = times[index.saturating_sub(reach)..times.len().min(index + reach)].iter();
    let at = |&at_time: &f64| match effect {
        Effect::StationMove { .. } => Effect::StationMove { at_time },
        _ => Effect::StationShift { at_time },
    };
    near.map(at).filter(|other| other != effect).collect()
}
