//! Candidates that explain the data better than an effect that was added.

use std::sync::Arc;

use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::neighbourhood::{LinearNeighbourhood, Linearised, Scan, tries};
use crate::problem::Effect;

/// What may stand in the place of each added effect, all others kept, in the linear neighbourhood
/// of a fit.
pub(super) struct Replacements<'f, 'a> {
    fitted: &'f Fitted,
    fit: Arc<LinearNeighbourhood>,
    scan: Scan<'a, 'f>,
}

impl<'f, 'a> Replacements<'f, 'a> {
    /// Tries `candidates`, whose places `linearised` holds.
    pub fn new(
        fitted: &'f Fitted,
        linearised: &'f Linearised<'a>,
        candidates: &[Effect],
        data: &'f Data,
    ) -> Self {
        let fit = fitted.around(data);
        let scan = Scan::new(linearised, Arc::clone(&fit), candidates.to_vec(), data.rules);
        Self { fitted, fit, scan }
    }

    /// The candidate, another time of the same shift included, that explains the data better than
    /// an effect beyond doubt.
    pub fn better_than(&self, effect: &Effect) -> Option<Effect> {
        let rules = self.scan.rules;
        let share = self.fit.share(&self.fitted.unknowns_of(effect))?;
        let everything: Vec<Effect> = self.scan.effects.iter().chain([effect]).cloned().collect();
        let (all_tries, families) = tries(&everything, &self.fitted.problem);
        let own_tries = all_tries.last().copied().unwrap_or(1.0) * families as f64;
        let own = self.fit.sums_without(&share).gain_of(
            share.part.norm_squared(),
            share.part.len(),
            rules,
        );
        let own = own.map_or(0.0, |gain| gain.criterion + 2.0 * own_tries.ln());
        let ranking = self.scan.ranking_without(&share);
        let best = ranking.iter().find(|tried| !effect.covers(&self.scan.effects[tried.index]))?;
        (best.criterion < own - rules.beyond_doubt).then(|| self.scan.effects[best.index].clone())
    }

    /// Unknowns of the fit.
    pub fn unknowns(&self) -> usize {
        self.fit.unknowns()
    }

    /// The fit with the columns of a candidate.
    pub fn with(&self, candidate: &Effect) -> LinearNeighbourhood {
        let index = self.scan.effects.iter().position(|known| known == candidate);
        index.map_or_else(
            || LinearNeighbourhood::clone(&self.fit),
            |index| self.fit.with(&self.scan.columns(index)),
        )
    }
}
