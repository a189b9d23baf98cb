//! Which effects a round adds.

use super::super::data::Data;
use super::super::neighbourhood::Scan;
use crate::problem::Effect;

/// Level of a whole scan: probability that noise alone points to anything.
pub(in crate::diagnose) const LEVEL: f64 = 0.01;
/// Level above which an effect is taken out again: above that of coming in, so that no effect goes to and fro at the border.
pub(super) const LEAVING: f64 = 0.05;
/// Candidates whose criterion is this close to the best are its rivals: odds of about 150 to 1.
const RIVAL: f64 = 10.0;
/// Corrected p below which an effect without rivals needs no fit of its own before the next is looked for.
const OVERWHELMING: f64 = 1e-12;
/// Poses beyond which rivals are not fitted one by one, nor effects: the linear neighbourhood of so many decides as well.
pub(super) const MOST_REFITTED: usize = 1000;
/// Candidates, best first, that may fail the cross-validation before a round adds nothing.
const MOST_VALIDATED: usize = 8;
/// Effects that a round adds at most.
const MOST: usize = 100;

/// What a round adds.
pub(super) struct Pick {
    pub effect: Effect,
    /// Other candidates that explain the residual about as well, best first.
    pub rivals: Vec<Effect>,
}

/// The candidates that stand out of what is left, each the best after those before it: beyond chance, better than nothing,
/// and better at predicting poses that were left out.
pub(super) fn pick(scan: &mut Scan, data: &Data) -> Vec<Pick> {
    let mut picks: Vec<Pick> = Vec::new();
    let without = scan.linear.cross_validate(&data.block);
    let many = data.rows().len() > MOST_REFITTED;
    while picks.len() < MOST {
        let ranking = scan.ranking();
        let mut standing = ranking.iter().filter(|tried| tried.corrected < LEVEL && tried.criterion < 0.0);
        // The first alone must predict poses that were left out; overwhelming ones after it are judged together.
        let Some(best) = standing.by_ref().take(MOST_VALIDATED).find(|tried| {
            if !picks.is_empty() {
                return true;
            }
            let mut with = scan.linear.clone();
            with.add(&scan.columns(tried.index));
            improves(without, with.cross_validate(&data.block))
        }) else {
            break;
        };
        let rivals: Vec<Effect> = ranking
            .iter()
            .filter(|tried| tried.index != best.index && tried.criterion < best.criterion + RIVAL)
            .map(|tried| scan.effects[tried.index].clone())
            .collect();
        let p = best.corrected;
        let effect = scan.effects[best.index].clone();
        let alone = many || rivals.iter().all(|rival| rival.name() == effect.name()) && p < OVERWHELMING;
        if !picks.is_empty() && !alone {
            break;
        }
        let index = best.index;
        picks.push(Pick { effect, rivals });
        if !alone {
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
