//! How probable each explanation of a residual is: effects, functions whose law nobody knows, several together, or nothing.
//!
//! Every hypothesis is a block of columns in the linear neighbourhood of a fit, with everything fitted projected out. One
//! closed-form marginal likelihood ([`marginal`]) compares sets of them; the prior gives every family the same chance and every
//! further member of a set the odds of one to two and its share of its family. An effect is a law; beside it stands, in the same
//! sum, what knows no law: smooth functions of the same covariates at the same part, functions of two covariates, harmonics whose
//! height and phase change, another value in every pose. So a law is probable only where it is better than what needs none.

mod columns;
mod hypothesis;
mod marginal;
mod search;

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidates::Candidates;
use super::covariate::Covariate;
use super::data::Data;
use super::fitted::Fitted;
use crate::identify::Noise;
use crate::model::parameter::{JointField, Parameter, Slot};
use crate::problem::Effect;
use columns::{Columns, slots};
pub use hypothesis::{Hypothesis, Law, Part};
use search::{Block, Target, search};

/// Probability below which an explanation is not kept: thousands of them add up to nothing.
const NEGLIGIBLE: f64 = 1e-10;
/// Hypotheses that may be at work together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Which; none: what is left is noise.
    pub hypotheses: Vec<Hypothesis>,
    /// Its probability among all explanations that were looked at.
    pub probability: f64,
}

/// All explanations of a residual that were looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Most probable first.
    pub explanations: Vec<Explanation>,
}

/// What is claimed of a hypothesis, from the least to the most.
#[derive(Debug, Clone, PartialEq)]
pub struct Claims {
    /// Where, and the probability that something acts there.
    pub place: (Part, f64),
    /// On what it depends, and the probability that what acts there depends on that.
    pub depends_on: (Vec<Covariate>, f64),
    /// The hypothesis, and the probability that its law is at work there and no function that knows none.
    pub law: (Hypothesis, f64),
}

impl Evidence {
    /// The most probable explanation.
    pub fn best(&self) -> &[Hypothesis] {
        self.explanations.first().map_or(&[], |best| &best.hypotheses)
    }

    /// Probability that some hypothesis of a kind is at work.
    pub fn probability(&self, of: impl Fn(&Hypothesis) -> bool) -> f64 {
        let holds = |explanation: &&Explanation| explanation.hypotheses.iter().any(&of);
        self.explanations.iter().filter(holds).map(|explanation| explanation.probability).sum()
    }

    /// What is claimed of a hypothesis.
    pub fn claims(&self, of: &Hypothesis) -> Claims {
        let place = self.probability(|other| other.part == of.part);
        let depends_on = self.probability(|other| other.part == of.part && other.depends_on == of.depends_on);
        let has_law = |explanation: &&Explanation| {
            let unknown = |other: &Hypothesis| other.part == of.part && other.effect().is_none();
            explanation.hypotheses.iter().any(|other| other.law == of.law && other.part == of.part)
                && (of.effect().is_none() || !explanation.hypotheses.iter().any(unknown))
        };
        let law = self.explanations.iter().filter(has_law).map(|explanation| explanation.probability).sum();
        Claims { place: (of.part, place), depends_on: (of.depends_on.clone(), depends_on), law: (of.clone(), law) }
    }
}

/// Weighs what may explain the residual of a fit.
///
/// `None` where the residual is not a finite number, as that of a pose without equilibrium.
pub(super) fn weigh(fitted: &Fitted, data: &Data) -> Option<Evidence> {
    let rows = data.thinned(data.rules.weighed_poses);
    let candidates = Candidates::of(&fitted.problem, data).testable;
    // What the model has already as a constant is a fitted column.
    let taken = |slot: &Slot| {
        let own = |parameter: &&Parameter| parameter.slot == *slot && parameter.driver.is_constant();
        !is_added(*slot) && fitted.model.parameters.iter().find(own).is_some()
    };
    let slots: Vec<Slot> = slots(&fitted.problem).into_iter().filter(|slot| !taken(slot)).collect();
    let linearised = fitted.linearised_with(data, &rows, &candidates, &slots);
    let neighbourhood = fitted.neighbourhood(&linearised, &[]);
    if !neighbourhood.residual().iter().all(|value| value.is_finite()) {
        return None;
    }
    let effects: Vec<(Effect, DMatrix<f64>)> =
        candidates.into_iter().map(|effect| (effect.clone(), linearised.columns(&effect))).collect();
    let all = Columns::all(&fitted.problem, &linearised, (data.measurements.time_measured, data.rules), &effects);
    let (hypotheses, blocks): (Vec<Hypothesis>, Vec<Block>) = all
        .into_par_iter()
        .map(|candidate| {
            let columns = neighbourhood.left_of(&candidate.columns);
            let block = Block::new(columns, neighbourhood.residual(), candidate.ln_prior, candidate.never_negative);
            (candidate.hypothesis, block)
        })
        .unzip();
    let target = Target {
        residual: neighbourhood.residual().clone(),
        noise: marginal::Noise {
            freedom: neighbourhood.sums().freedom(),
            trust: if fitted.found.noise == Noise::Declared {
                data.rules.trust_declared
            } else {
                data.rules.trust_estimated
            },
        },
    };
    let mut explanations: Vec<Explanation> = Vec::new();
    for (members, probability) in search(&blocks, &target, data.rules).into_iter().filter(|(_, p)| *p > NEGLIGIBLE) {
        let own: Vec<&Hypothesis> = members.into_iter().map(|member| &hypotheses[member]).collect();
        // Functions of one covariate that change over other lengths are one hypothesis.
        let is_same = |other: &&mut Explanation| {
            let others = &other.hypotheses;
            others.len() == own.len()
                && own.iter().all(|own| others.iter().any(|other| own.says(other)))
                && others.iter().all(|other| own.iter().any(|own| own.says(other)))
        };
        match explanations.iter_mut().find(is_same) {
            Some(known) => known.probability += probability,
            None => {
                explanations.push(Explanation { hypotheses: own.into_iter().cloned().collect(), probability });
            }
        }
    }
    explanations.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Some(Evidence { explanations })
}

/// Whether a probe at a slot adds to what the arm declares there.
fn is_added(slot: Slot) -> bool {
    match slot {
        Slot::Joint { field, .. } => JointField::GEOMETRY.contains(&field),
        Slot::Shift { .. } => true,
        _ => false,
    }
}
