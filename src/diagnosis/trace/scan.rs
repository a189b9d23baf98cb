//! Every candidate tried against what a fit leaves.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::library::Library;
use super::linear::{Gain, Linear, Score};
use crate::effect;
use crate::problem::Effect;

/// The candidates with what the residual says about each.
pub(crate) struct Scan<'a, 'l> {
    library: &'l Library<'a>,
    pub linear: Linear,
    /// The candidates tried.
    pub effects: Vec<Effect>,
    scores: Vec<Score>,
    /// Members of each candidate's family: how often chance has a try at it.
    members: Vec<usize>,
}

/// A candidate with its gain.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tried {
    /// Index in the scan's list.
    pub index: usize,
    pub gain: Gain,
    /// The information criterion with 2 ln(members of the family) for the search in it; negative is better than nothing.
    pub criterion: f64,
}

impl<'a, 'l> Scan<'a, 'l> {
    /// Tries `effects` against the fit that `linear` describes.
    pub fn new(library: &'l Library<'a>, linear: Linear, effects: Vec<Effect>) -> Self {
        let scores = effects.par_iter().map(|effect| linear.score(&library.columns(effect))).collect();
        let family = |effect: &Effect| effects.iter().filter(|other| effect::name(other) == effect::name(effect)).count();
        let members = effects.iter().map(family).collect();
        Self { library, linear, effects, scores, members }
    }

    /// Candidates that the fit does not absorb, best first.
    pub fn ranking(&self) -> Vec<Tried> {
        let tried = |(index, score)| {
            let gain = self.linear.gain(score)?;
            let search = 2.0 * (self.members[index] as f64).ln();
            Some(Tried { index, gain, criterion: gain.criterion + search })
        };
        let mut all: Vec<Tried> = self.scores.iter().enumerate().filter_map(tried).collect();
        all.sort_by(|a, b| a.criterion.total_cmp(&b.criterion));
        all
    }

    /// Candidates that the fit absorbs, so that nothing is left to show them.
    pub fn absorbed(&self) -> Vec<&Effect> {
        let gone = |(effect, score)| self.linear.gain(score).is_none().then_some(effect);
        self.effects.iter().zip(&self.scores).filter_map(gone).collect()
    }

    /// p of the best of so many tries: the Holm correction of a ranking's first entry [Holm 1979].
    pub fn corrected(&self, tried: &Tried) -> f64 {
        (tried.gain.p * self.effects.len() as f64).min(1.0)
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
        let (a, b) = (self.linear.directions(&self.columns(one)), self.linear.directions(&self.columns(other)));
        let cosines = a.tr_mul(&b).singular_values();
        cosines.iter().copied().reduce(f64::min).map(|cosine| cosine.clamp(0.0, 1.0).acos())
    }
}
