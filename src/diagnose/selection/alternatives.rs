//! Candidates that the data cannot tell from an effect that was added.

use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::neighbourhood::{LinearNeighbourhood, Linearised, Scan, Tried, tries};
use super::super::smooth_term::SmoothTerm;
use crate::problem::Effect;

/// The effects that may stand in the place of an added one.
#[derive(Default)]
pub(super) struct Alternatives {
    /// Best first; of one family only the best at each place.
    pub effects: Vec<Effect>,
    /// The candidate, another time of the same shift included, that explains the data better beyond doubt.
    pub better: Option<Effect>,
}

/// What may stand in the place of each added effect, all others kept, in the linear neighbourhood of a fit.
pub(super) struct Replacements<'f, 'a> {
    fitted: &'f Fitted,
    fit: LinearNeighbourhood,
    scan: Scan<'a, 'f>,
}

impl<'f, 'a> Replacements<'f, 'a> {
    /// Tries `candidates`, whose places `linearised` holds, in a fit with `smooth_terms` taken in.
    pub fn new(
        fitted: &'f Fitted,
        linearised: &'f Linearised<'a>,
        (candidates, smooth_terms): (&[Effect], &[SmoothTerm]),
        data: &'f Data,
    ) -> Self {
        let fit = fitted.neighbourhood(linearised, smooth_terms);
        Self { fitted, scan: Scan::new(linearised, fit.clone(), candidates.to_vec(), data.rules), fit }
    }

    /// Those of one effect; `structured` where the fit leaves more than noise.
    pub fn of(&self, effect: &Effect, structured: bool) -> Alternatives {
        let rules = self.scan.rules;
        let Some(share) = self.fit.share(&self.fitted.unknowns_of(effect)) else { return Alternatives::default() };
        let everything: Vec<Effect> = self.scan.effects.iter().chain([effect]).cloned().collect();
        let (all_tries, families) = tries(&everything);
        let own_tries = all_tries.last().copied().unwrap_or(1.0) * families as f64;
        let explained = share.part.norm_squared();
        let own = self.fit.sums_without(&share).gain_of(explained, share.part.len(), rules);
        let own = own.map_or(0.0, |gain| gain.criterion + 2.0 * own_tries.ln());
        let is_other = |tried: &Tried| !effect.covers(&self.scan.effects[tried.index]);
        let ranking: Vec<Tried> = self.scan.ranking_without(&share).into_iter().filter(is_other).collect();
        let as_much = if structured { rules.as_much * explained } else { f64::INFINITY };
        let untold = |tried: &&Tried| tried.criterion < own + rules.beyond_doubt || tried.gain.squares > as_much;
        let mut effects: Vec<Effect> = Vec::new();
        for tried in ranking.iter().filter(untold) {
            let candidate = &self.scan.effects[tried.index];
            let known = |other: &Effect| other.name_and_place() == candidate.name_and_place();
            // Other times of the same shift are the same effect; other orders of a harmonic are not.
            let is_own = effect.is_searched() && known(effect);
            if !effects.iter().any(known) && !is_own {
                effects.push(candidate.clone());
            }
        }
        let better = ranking.first().filter(|tried| tried.criterion < own - rules.beyond_doubt);
        let better = better.map(|tried| self.scan.effects[tried.index].clone());
        Alternatives { effects, better }
    }
}
