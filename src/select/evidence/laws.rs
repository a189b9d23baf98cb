//! Laws of the grammar, searched where probable sets hold something at the coordinate of a joint.

use std::collections::BTreeSet;
use std::sync::PoisonError;

use nalgebra::{DMatrix, DVector};

use super::blocks::blocks;
use super::candidate::Candidate;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use super::products::{Products, ReducedProblem};
use super::search::{Weighted, reduced_by};
use super::waves::is_free;
use crate::laws::expression::Vocabulary;
use crate::laws::{Law, LawSite};
use crate::model::parameter::ParameterSite;
use crate::problem::{Effect, Problem};
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::grammar::{MAX_POSES, Noise, Proposal, Quantities, WhitenedSite, proposals};

/// Smallest probability of a set at which laws are searched in place of its members.
const MIN_SET_PROBABILITY: f64 = 0.05;
/// Maximum number of pairs of a joint and a set for which laws are searched.
const MAX_SEARCHED: usize = 2;

/// Returns formulas that may replace the members of probable sets at one joint.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    products: &Products,
    (fitted, data, left_out): (&Fitted, &Data, &[usize]),
) -> Vec<Candidate> {
    let problem = &fitted.problem;
    let mut laws: Vec<Candidate> = Vec::new();
    for (joint, rest) in places(hypotheses, weighted, products) {
        if products.target.stop.is_requested() {
            break;
        }
        let fitted_effects = fitted.effects().iter().map(Effect::name_and_place).collect();
        let key = (joint, member_names(hypotheses, &rest), left_out.to_vec(), fitted_effects);
        let known = || data.proposed.lock().unwrap_or_else(PoisonError::into_inner);
        let proposed = known().get(&key).cloned();
        let proposed = proposed.unwrap_or_else(|| {
            let search = Search { hypotheses, fitted, data, left_out, joint };
            // A class that contains a law of the fit is represented by that law.
            let new = search.proposals(&rest, products).into_iter().filter(|law| !law.is_present);
            let new: Vec<Effect> =
                new.filter_map(|proposal| effect(problem, joint, &proposal)).collect();
            known().insert(key, new.clone());
            new
        });
        for effect in proposed {
            let is_known = |candidate: &Candidate| {
                candidate.hypothesis.effect().is_some_and(|known| known.is_same_as(&effect))
            };
            let is_known = hypotheses.all.iter().chain(&laws).any(is_known);
            if !is_known && is_free(&effect, problem) {
                let columns = coefficients(&effect, hypotheses, problem);
                laws.extend(hypotheses.entered(&effect, columns, problem));
            }
        }
    }
    laws
}

/// Returns the columns of the coefficients of a law, without those of the parameters inside its
/// formulas.
fn coefficients(effect: &Effect, hypotheses: &Hypotheses, problem: &Problem) -> DMatrix<f64> {
    let columns = hypotheses.linearised.columns(effect);
    let count = match effect {
        Effect::Law(law) => columns.ncols().saturating_sub(law.parameters().len()),
        _ => effect.terms(problem).len(),
    };
    columns.columns(0, count).into_owned()
}

/// Returns the names of the `members`, which key the cache of laws.
fn member_names(hypotheses: &Hypotheses, members: &[usize]) -> Vec<String> {
    let name = |&member: &usize| {
        let hypothesis = &hypotheses.all[member].hypothesis;
        hypothesis.effect().map_or_else(
            || format!("{} {:?} {:?}", hypothesis.site, hypothesis.kind, hypothesis.depends_on),
            Effect::name_and_place,
        )
    };
    let mut names: Vec<String> = members.iter().map(name).collect();
    names.sort();
    names
}

/// Returns a proposed formula at a joint, counted from 0, as an effect; `None` if the formula is
/// not valid.
fn effect(problem: &Problem, joint: usize, proposal: &Proposal) -> Option<Effect> {
    let (slides, covariates) = (problem.slides(), problem.covariate_names());
    let vocabulary =
        Vocabulary { slides: &slides, covariates: &covariates, ..Vocabulary::default() };
    let written = &proposal.law;
    let site = LawSite::of_joint(joint + 1);
    let parameters = written.parameters.clone();
    let law = Law::new(&written.name, site, &written.formulas, None, parameters, &vocabulary);
    Some(Effect::Law(law.ok()?.described(proposal.ln_prior)))
}

/// Returns the joint, counted from 0, at whose command coordinate or about whose axis a hypothesis
/// acts; `None` for others.
fn joint_of(hypothesis: &Hypothesis, problem: &Problem) -> Option<usize> {
    let Site::Joint(joint) = hypothesis.site else { return None };
    let is_there = match &hypothesis.kind {
        HypothesisKind::Effect(effect) => effect.acts_at_joint(),
        HypothesisKind::Gear(_) | HypothesisKind::Limit(_) => false,
        _ => hypothesis.coordinate == Some(ParameterSite::coordinate(problem, joint + 1)),
    };
    is_there.then_some(joint)
}

/// Returns the joints, counted from 0, at which laws are searched, each with the other members of a
/// probable set.
fn places(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    products: &Products,
) -> BTreeSet<(usize, Vec<usize>)> {
    let problem = hypotheses.linearised.problem();
    let of = |member: usize| joint_of(&hypotheses.all[member].hypothesis, problem);
    let mut found: BTreeSet<(usize, Vec<usize>)> = BTreeSet::new();
    let likely = weighted
        .iter()
        .filter(|set| set.probability > MIN_SET_PROBABILITY && !products.has_gear(&set.members));
    for set in likely {
        for joint in set.members.iter().filter_map(|&member| of(member)) {
            let mut rest: Vec<usize> =
                set.members.iter().copied().filter(|&member| of(member) != Some(joint)).collect();
            rest.sort_unstable();
            if found.len() < MAX_SEARCHED {
                found.insert((joint, rest));
            }
        }
    }
    found
}

/// Search for formulas at one joint.
struct Search<'s, 'h, 'd> {
    hypotheses: &'s Hypotheses<'h>,
    fitted: &'s Fitted,
    data: &'s Data<'d>,
    left_out: &'s [usize],
    joint: usize,
}

impl Search<'_, '_, '_> {
    /// Returns the formulas that best explain the residual that the members `rest` leave.
    fn proposals(&self, rest: &[usize], products: &Products) -> Vec<Proposal> {
        let poses = self.hypotheses.linearised.poses();
        let kept: Vec<usize> =
            (0..poses.len()).filter(|pose| !self.left_out.contains(pose)).collect();
        let kept: Vec<usize> = if kept.len() > MAX_POSES {
            (0..MAX_POSES).map(|k| kept[k * kept.len() / MAX_POSES]).collect()
        } else {
            kept
        };
        let dropped: Vec<usize> = (0..poses.len()).filter(|pose| !kept.contains(pose)).collect();
        if dropped.len() == self.left_out.len() {
            let left = reduced_by(rest, products);
            return left.map_or_else(Vec::new, |left| self.proposals_after(&left, products, &kept));
        }
        let members: Vec<&Candidate> =
            rest.iter().map(|&member| &self.hypotheses.all[member]).collect();
        let Some((blocks, target)) =
            blocks(self.fitted, self.data, self.hypotheses, &members, &dropped)
        else {
            return Vec::new();
        };
        let products = Products::new(&blocks, &target);
        let all: Vec<usize> = (0..blocks.len()).collect();
        let left = reduced_by(&all, &products);
        left.map_or_else(Vec::new, |left| self.proposals_after(&left, &products, &kept))
    }

    fn proposals_after(
        &self,
        left: &ReducedProblem,
        products: &Products,
        kept: &[usize],
    ) -> Vec<Proposal> {
        let Self { hypotheses, fitted, data, joint, .. } = *self;
        let problem = &fitted.problem;
        let linearised = &hypotheses.linearised;
        let Some(lever) = linearised.place(ParameterSite::coordinate(problem, joint + 1)) else {
            return Vec::new();
        };
        let (less, product) = along_lever(left, products, &lever);
        let at = |pose: &usize| lever.rows(3 * pose, 3);
        let site = WhitenedSite {
            diagonal: DVector::from_iterator(
                kept.len(),
                kept.iter().map(|pose| at(pose).norm_squared()),
            ),
            less: less.select_columns(kept),
            product: product.select_rows(kept),
        };
        let noise = Noise::new(left.squares, products.target.noise.freedom, |squares| {
            products.over_noise(squares)
        });
        let all = linearised.poses();
        let poses: Vec<_> = kept.iter().map(|&pose| &all[pose]).collect();
        let known = Quantities::new(problem, &poses, data.measurements.time_measured);
        // The functions of present laws, from their columns along the lever.
        let is_present = |k: &usize| {
            let hypothesis = &hypotheses.all[*k].hypothesis;
            hypothesis.site == Site::Joint(joint)
                && matches!(hypothesis.effect(), Some(Effect::Law(law)) if law.description().is_some())
        };
        let present: Vec<usize> = (0..hypotheses.all.len()).filter(is_present).collect();
        let functions = |&k: &usize| {
            let columns = hypotheses.all[k].design.columns();
            let function = |column: nalgebra::DVectorView<f64>| {
                let value = |pose: &usize| {
                    let lever = at(pose);
                    column.rows(3 * pose, 3).dot(&lever) / lever.norm_squared().max(1e-300)
                };
                DVector::from_iterator(kept.len(), kept.iter().map(value))
            };
            columns.column_iter().map(|column| function(column.as_view())).collect()
        };
        let functions: Vec<Vec<DVector<f64>>> = present.iter().map(functions).collect();
        proposals(&known, joint, (&site, &noise), &functions)
    }
}

/// Returns B and p of columns along one lever l, one column for each pose, with the fitted
/// parameters and a set projected out. The products of the columns are diag(|l|²) − BᵀB; p are
/// their products with the residual.
fn along_lever(
    left: &ReducedProblem,
    products: &Products,
    lever: &DVector<f64>,
) -> (DMatrix<f64>, DVector<f64>) {
    let (fitted, reach, residual) = (products.target.fit.fitted(), left.reach(), left.residual());
    let rows = [fitted.ncols(), reach.nrows()];
    let poses = lever.len() / 3;
    let mut less = DMatrix::zeros(rows[0] + rows[1], poses);
    let mut product = DVector::zeros(poses);
    for pose in 0..poses {
        let lever = lever.rows(3 * pose, 3);
        let mut column = less.column_mut(pose);
        column.rows_mut(0, rows[0]).gemv_tr(1.0, &fitted.rows(3 * pose, 3), &lever, 0.0);
        let mut below = column.rows_mut(rows[0], rows[1]);
        below.gemv(1.0, &reach.columns(3 * pose, 3), &lever, 0.0);
        product[pose] = lever.dot(&residual.rows(3 * pose, 3));
    }
    (less, product)
}
