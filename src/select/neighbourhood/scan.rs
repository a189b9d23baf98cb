//! Scores of all candidates against the residual of one fit.

use crate::numeric::parallel;
use crate::select::settings::MAX_NEGATIVE_ERRORS;
use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::DMatrix;

use super::linear::LinearNeighbourhood;
use super::linearised::{EffectTerms, Linearised};
use super::score::{Gain, Score, Sums};
use crate::problem::{Effect, Problem};

/// All candidates with their scores against one fit.
pub(crate) struct Scan<'a, 'l> {
    linearised: &'l Linearised<'a>,
    /// Linear neighbourhood of the fit.
    pub linear: Arc<LinearNeighbourhood>,
    /// Candidates that were scored.
    pub effects: Vec<Effect>,
    effect_terms: EffectTerms,
    /// Candidates that are not scored, because a derivative with respect to them is not finite.
    pub refused: Vec<Effect>,
    scores: Vec<Score>,
    /// For each candidate, the effective number of candidates tried in its family (Bonferroni
    /// factor).
    tries: Vec<f64>,
    /// Number of families of effects, by which a p-value is multiplied after the tries in its
    /// family.
    families: usize,
    /// For each parameter of each candidate, true if it cannot be negative.
    never_negative: Vec<Vec<bool>>,
}

/// Number of candidates whose columns are projected in one matrix product.
const CANDIDATES_PER_PROJECTION: usize = 48;

/// Candidate of the scan with its gain and corrected p-value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tried {
    /// Index of the candidate in [`Scan::effects`].
    pub index: usize,
    pub gain: Gain,
    /// Change of the information criterion by the candidate, with the penalty 2 ln(tries) for the
    /// search; negative if the model is better with it.
    pub criterion: f64,
    /// Corrected p-value: p times the tries in its family times the number of families (Holm's
    /// first step, weighted).
    pub corrected: f64,
}

impl<'a, 'l> Scan<'a, 'l> {
    /// Scores `effects` against the fit with the linear neighbourhood `linear`.
    pub fn new(
        linearised: &'l Linearised<'a>,
        linear: Arc<LinearNeighbourhood>,
        effects: Vec<Effect>,
    ) -> Self {
        let effect_terms = EffectTerms::new(linearised, &effects);
        let numbers: Vec<usize> = (0..effects.len()).collect();
        let scored = |numbers: &[usize]| -> Vec<Option<Score>> {
            let columns: Vec<DMatrix<f64>> = numbers
                .iter()
                .map(|&number| linearised.columns_of(&effect_terms, number))
                .collect();
            let is_finite: Vec<bool> =
                columns.iter().map(|all| all.iter().all(|value| value.is_finite())).collect();
            let finite: Vec<DMatrix<f64>> = columns
                .into_iter()
                .zip(&is_finite)
                .filter_map(|(all, fine)| fine.then_some(all))
                .collect();
            let mut scores = linear.scores(&finite).into_iter();
            is_finite.into_iter().map(|fine| if fine { scores.next() } else { None }).collect()
        };
        let all = parallel::map_chunks(&numbers, CANDIDATES_PER_PROJECTION, scored);
        let mut refused = Vec::new();
        let (mut scored_effects, mut scores) = (Vec::new(), Vec::new());
        for (effect, score) in effects.into_iter().zip(all) {
            match score {
                Some(score) => {
                    scored_effects.push(effect);
                    scores.push(score);
                }
                None => refused.push(effect),
            }
        }
        let effect_terms = if refused.is_empty() {
            effect_terms
        } else {
            EffectTerms::new(linearised, &scored_effects)
        };
        let (tries, families) = tries(&scored_effects, linearised.problem());
        let never_negative =
            scored_effects.iter().map(|effect| linearised.never_negative(effect)).collect();
        Self {
            linearised,
            linear,
            effects: scored_effects,
            effect_terms,
            refused,
            scores,
            tries,
            families,
            never_negative,
        }
    }

    /// Returns the candidates that are detectable and physically possible, in order of the
    /// information criterion, best first.
    pub fn ranking(&self) -> Vec<Tried> {
        let sums = self.linear.sums();
        let tried = |(index, score): (usize, &Score)| {
            let gain = sums.gain(score).filter(|_| self.is_possible(index, score, sums))?;
            let tries = self.tries[index] * self.families as f64;
            let (criterion, corrected) =
                (gain.criterion + 2.0 * tries.ln(), (gain.p * tries).min(1.0));
            Some(Tried { index, gain, criterion, corrected })
        };
        let mut ranked: Vec<Tried> = self.scores.iter().enumerate().filter_map(tried).collect();
        ranked.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        ranked
    }

    /// Returns false if a parameter that cannot be negative, such as a compliance or a mass, is
    /// significantly negative.
    fn is_possible(&self, index: usize, score: &Score, sums: Sums) -> bool {
        let never_negative = &self.never_negative[index];
        if !never_negative.contains(&true) {
            return true;
        }
        let scatter = (sums.squares / sums.freedom()).sqrt();
        let is_plausible = |((value, error), never): ((f64, f64), &bool)| {
            !never || value > -MAX_NEGATIVE_ERRORS * error * scatter
        };
        score.estimates().into_iter().zip(never_negative).all(is_plausible)
    }

    /// Returns the candidates whose columns the fitted parameters can reproduce completely.
    pub fn absorbed(&self) -> Vec<&Effect> {
        let is_absorbed = |(effect, score): (_, &Score)| (score.rank() == 0).then_some(effect);
        self.effects.iter().zip(&self.scores).filter_map(is_absorbed).collect()
    }

    /// Returns the columns of a candidate, shape = (3 N, k).
    pub fn columns(&self, index: usize) -> DMatrix<f64> {
        self.linearised.columns_of(&self.effect_terms, index)
    }

    /// Returns the largest principal angle \[rad\] between two candidates, with the fitted
    /// parameters projected out; `None` if one of them adds nothing.
    pub fn angle(&self, one: usize, other: usize) -> Option<f64> {
        self.linear.angle(&self.columns(one), &self.columns(other))
    }
}

/// Returns the effective number of candidates tried within the family of each candidate, and the
/// number of families.
pub(crate) fn tries(effects: &[Effect], problem: &Problem) -> (Vec<f64>, usize) {
    let mut families: BTreeMap<&str, Vec<&Effect>> = BTreeMap::new();
    for effect in effects {
        families.entry(effect.name()).or_default().push(effect);
    }
    let tries =
        effects.iter().map(|effect| effect.tries(&families[effect.name()], problem)).collect();
    (tries, families.len())
}
