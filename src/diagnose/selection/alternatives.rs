//! Candidates that the data cannot tell from an effect that was added.

use super::super::fitted::{Fitted, Given, Normal};
use super::super::neighbourhood::{Library, Scan, Tried, tries};
use super::super::smooth_term::SmoothTerm;
use crate::problem::Effect;

/// Candidates whose criterion is this close to that of an effect in its place are not told from it: odds of 20 to 1.
const UNTOLD: f64 = 6.0;

/// Part of what an effect explains from which on another explains as much, where structure is left: then residuals are no
/// independent noise, and small differences are no evidence.
const AS_MUCH: f64 = 0.9;

/// The effects that may stand in the place of an added one.
pub(super) struct Alternatives {
    /// Best first; of one family only the best at each place.
    pub effects: Vec<Effect>,
    /// The candidate, another time of the same shift included, that explains the data better beyond doubt.
    pub better: Option<Effect>,
}

/// What may stand in the place of each added effect, all others kept, in the linear neighbourhood of a fit.
pub(super) struct Replacements<'f, 'a> {
    fitted: &'f Fitted,
    library: &'f Library<'a>,
    smooth_terms: &'f [SmoothTerm],
    normal: Normal,
    scan: Scan<'a, 'f>,
}

impl<'f, 'a> Replacements<'f, 'a> {
    /// Tries `candidates`, whose places `library` holds, in a fit with `smooth_terms` put in.
    pub fn new(
        fitted: &'f Fitted,
        library: &'f Library<'a>,
        candidates: &[Effect],
        smooth_terms: &'f [SmoothTerm],
    ) -> Self {
        let linear = fitted.linear(library, &[], smooth_terms);
        let normal = fitted.normal(library, smooth_terms);
        Self { fitted, library, smooth_terms, normal, scan: Scan::new(library, linear, candidates.to_vec()) }
    }

    /// Those of one effect; `structured` where the fit leaves more than noise.
    pub fn of(&self, effect: &Effect, structured: bool) -> Alternatives {
        let Given { directions, part } = self.fitted.given_by(self.library, (&self.normal, self.smooth_terms), effect);
        let sums = self.scan.linear.sums_without(&directions, &part);
        let everything: Vec<Effect> = self.scan.effects.iter().chain([effect]).cloned().collect();
        let (all_tries, families) = tries(&everything);
        let own_tries = all_tries.last().copied().unwrap_or(1.0) * families as f64;
        let own = sums.gain_of(part.norm_squared(), part.len());
        let own = own.map_or(0.0, |gain| gain.criterion + 2.0 * own_tries.ln());
        let ranking = self.scan.ranking_without(&directions, &part);
        let is_other = |index: usize| !effect.covers(&self.scan.effects[index]);
        let mut effects: Vec<Effect> = Vec::new();
        let ranking: Vec<_> = ranking.into_iter().filter(|tried| is_other(tried.index)).collect();
        let as_much = if structured { AS_MUCH * part.norm_squared() } else { f64::INFINITY };
        let untold = |tried: &&Tried| tried.criterion < own + UNTOLD || tried.gain.squares > as_much;
        for tried in ranking.iter().filter(untold) {
            let candidate = &self.scan.effects[tried.index];
            let known = |other: &Effect| other.name_and_place() == candidate.name_and_place();
            // Other times of the same shift are the same effect; other orders of a harmonic are not.
            let is_own = effect.is_searched() && known(effect);
            if !effects.iter().any(known) && !is_own {
                effects.push(candidate.clone());
            }
        }
        let better = ranking.first().filter(|tried| tried.criterion < own - UNTOLD);
        let better = better.map(|tried| self.scan.effects[tried.index].clone());
        Alternatives { effects, better }
    }
}
