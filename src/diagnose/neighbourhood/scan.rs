//! Every candidate tried against what a fit leaves.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::library::Library;
use super::linear::Linear;
use super::score::{Gain, Score, Sums};
use crate::problem::Effect;

/// The candidates with what the residual says about each.
pub(crate) struct Scan<'a, 'l> {
    library: &'l Library<'a>,
    pub linear: Linear,
    /// The candidates tried.
    pub effects: Vec<Effect>,
    scores: Vec<Score>,
    /// How often chance has a try at each candidate within its family.
    tries: Vec<f64>,
    /// Families that are tried.
    families: usize,
    /// For each candidate's parameters, whether they are never negative.
    never_negative: Vec<Vec<bool>>,
}

/// Candidates that are projected together.
const TOGETHER: usize = 16;
/// Standard errors below zero from which what is never negative is impossible.
const IMPOSSIBLE: f64 = 3.0;

/// A candidate with its gain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tried {
    /// Index in the scan's list.
    pub index: usize,
    pub gain: Gain,
    /// The information criterion with 2 ln(tries) for the search; negative is better than nothing.
    pub criterion: f64,
    /// p times the tries in its family and the number of families: Holm's first step with a weight for each candidate.
    pub corrected: f64,
}

impl<'a, 'l> Scan<'a, 'l> {
    /// Tries `effects` against the fit that `linear` describes.
    pub fn new(library: &'l Library<'a>, linear: Linear, effects: Vec<Effect>) -> Self {
        let scores = effects
            .par_chunks(TOGETHER)
            .flat_map(|some| linear.scores(&some.iter().map(|effect| library.columns(effect)).collect::<Vec<_>>()));
        let scores = scores.collect();
        let (tries, families) = tries(&effects);
        let never_negative = effects.iter().map(|effect| library.never_negative(effect)).collect();
        Self { library, linear, effects, scores, tries, families, never_negative }
    }

    /// Candidates that the fit does not absorb and that are possible, best first.
    pub fn ranking(&self) -> Vec<Tried> {
        self.ranked(&self.scores, self.linear.sums())
    }

    /// The ranking that there would be without some of the directions that were fitted: orthonormal,
    /// shape = (3 N + priors, k), with the part of the residual that they took off.
    pub fn ranking_without(&self, directions: &DMatrix<f64>, given: &DVector<f64>) -> Vec<Tried> {
        let data = directions.rows(0, self.linear.rows()).into_owned();
        let without =
            |(effect, score): (&Effect, &Score)| score.give_back(&self.library.columns(effect).tr_mul(&data), given);
        let scores: Vec<Score> = self.effects.par_iter().zip(&self.scores).map(without).collect();
        self.ranked(&scores, self.linear.sums_without(directions, given))
    }

    fn ranked(&self, scores: &[Score], sums: Sums) -> Vec<Tried> {
        let tried = |(index, score): (usize, &Score)| {
            let gain = sums.gain(score).filter(|_| self.is_possible(index, score, sums))?;
            let tries = self.tries[index] * self.families as f64;
            let (criterion, corrected) = (gain.criterion + 2.0 * tries.ln(), (gain.p * tries).min(1.0));
            Some(Tried { index, gain, criterion, corrected })
        };
        let mut all: Vec<Tried> = scores.iter().enumerate().filter_map(tried).collect();
        all.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        all
    }

    /// Whether a candidate is no negative compliance or mass, beyond doubt.
    fn is_possible(&self, index: usize, score: &Score, sums: Sums) -> bool {
        let never_negative = &self.never_negative[index];
        if !never_negative.contains(&true) {
            return true;
        }
        let scatter = (sums.squares / sums.freedom()).sqrt();
        let fine = |((value, error), never): ((f64, f64), &bool)| !never || value > -IMPOSSIBLE * error * scatter;
        score.estimates().into_iter().zip(never_negative).all(fine)
    }

    /// Candidates that the fit absorbs, so that nothing is left to show them.
    pub fn absorbed(&self) -> Vec<&Effect> {
        let gone = |(effect, score): (_, &Score)| (score.rank() == 0).then_some(effect);
        self.effects.iter().zip(&self.scores).filter_map(gone).collect()
    }

    /// Takes a candidate into the fit, in the linear neighbourhood.
    pub fn take(&mut self, index: usize) {
        let columns = self.library.columns(&self.effects[index]);
        let before = self.linear.clone();
        let added = self.linear.add(&columns);
        let rows = self.linear.rows();
        let data = added.rows(0, rows).into_owned();
        let given = before.along(&added);
        let library = self.library;
        let update = |(effect, score): (&Effect, &mut Score)| {
            score.take_off(&library.columns(effect).tr_mul(&data), &given);
        };
        self.effects.par_iter().zip(&mut self.scores).for_each(update);
    }

    /// Columns of a candidate, shape = (3 N, k).
    pub fn columns(&self, index: usize) -> DMatrix<f64> {
        self.library.columns(&self.effects[index])
    }

    /// Largest principal angle [rad] between what two candidates add to the fit; none where one of them adds nothing.
    pub fn angle(&self, one: usize, other: usize) -> Option<f64> {
        self.linear.angle(&self.columns(one), &self.columns(other))
    }
}

/// For each candidate how often chance has a try at it within its family, and the number of families.
pub(crate) fn tries(effects: &[Effect]) -> (Vec<f64>, usize) {
    let mut families: BTreeMap<&str, Vec<&Effect>> = BTreeMap::new();
    for effect in effects {
        families.entry(effect.name()).or_default().push(effect);
    }
    let tries = effects.iter().map(|effect| effect.tries(&families[effect.name()])).collect();
    (tries, families.len())
}
