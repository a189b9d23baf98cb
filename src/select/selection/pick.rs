//! Which effects a round adds.

use super::super::data::Data;
use super::super::neighbourhood::{Scan, Tried};
use crate::problem::Effect;

/// What a round adds.
pub(super) struct Pick {
    pub effect: Effect,
    /// Other candidates that explain the residual about as well, best first.
    pub rivals: Vec<Effect>,
}

/// The candidates that stand out of what is left, each the best after those before it: beyond
/// chance, better than nothing, and better at predicting poses that were left out.
///
/// A round ends with the first one that wants a fit of its own, if `affords_fits`: one that has
/// rivals of another family, or is not overwhelming.
pub(super) fn pick(scan: &mut Scan, data: &Data, affords_fits: bool) -> Vec<Pick> {
    let rules = data.rules;
    let mut picks: Vec<Pick> = Vec::new();
    let without = scan.linear.cross_validate(&data.block);
    while picks.len() < rules.picks {
        let ranking = scan.ranking();
        let is_alike =
            |effect: &Effect| picks.iter().any(|pick| pick.effect.remembers_like(effect));
        let stands = |tried: &&Tried| {
            tried.corrected < rules.level
                && tried.criterion < 0.0
                && !is_alike(&scan.effects[tried.index])
        };
        let mut standing = ranking.iter().filter(stands);
        // The first alone must predict poses that were left out; those after it are judged
        // together.
        let Some(best) = standing.by_ref().take(rules.validated).find(|tried| {
            let with = || scan.linear.with(&scan.columns(tried.index));
            !picks.is_empty() || improves(without, with().cross_validate(&data.block))
        }) else {
            break;
        };
        let effect = scan.effects[best.index].clone();
        let rivals = ranking.iter().filter(|tried| tried.criterion < best.criterion + rules.rival);
        let rivals: Vec<Effect> = rivals
            .filter(|tried| tried.index != best.index)
            .map(|tried| scan.effects[tried.index].clone())
            .collect();
        let is_clear = best.corrected < rules.overwhelming
            && rivals.iter().all(|rival| rival.name() == effect.name());
        let wants_fit = affords_fits && !is_clear;
        if wants_fit && !picks.is_empty() {
            break;
        }
        let index = best.index;
        picks.push(Pick { effect, rivals });
        if wants_fit {
            break;
        }
        scan.take(index);
    }
    if picks.len() > 1 && !improves(without, scan.linear.cross_validate(&data.block)) {
        picks.truncate(1);
    }
    picks
}

/// Whether poses that are left out are predicted better with what was added.
fn improves(without: Option<f64>, with: Option<f64>) -> bool {
    without.zip(with).is_none_or(|(without, with)| with < without)
}
