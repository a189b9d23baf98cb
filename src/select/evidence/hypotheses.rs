//! All hypotheses about the residual of a fit, with their columns at some poses.

use nalgebra::{DMatrix, DVector};

use super::block::Design;
use super::candidate::{Candidate, joint_and_order, scaled_to_equal_length};
use super::columns::{Columns, candidate_of};
use super::families::{Families, OtherHypotheses, ln_family, share};
use super::functions::{SampledCovariate, Shape};
use super::hypothesis::{Hypothesis, HypothesisKind, HypothesisSet};
use super::limits::limits;
use super::marginal::Coefficients;
use super::sites::hypothesis_sites;
use crate::model::parameter::ParameterSite;
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;
use crate::select::candidates::Candidates;
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::grammar;
use crate::select::neighbourhood::{Linearised, tries};

/// Fit linearised at some rows, with all hypotheses about its residual.
pub(in crate::select) struct Hypotheses<'a> {
    pub linearised: Linearised<'a>,
    /// Effects that the search added earlier. They are removed from the fit and evaluated as
    /// hypotheses, term by term.
    pub added: Vec<Effect>,
    /// Indices of the parameters of the `added` effects among the columns of the fit.
    pub unknowns: Vec<usize>,
    /// Candidates with the columns of all hypotheses.
    pub(super) candidates: Vec<Candidate>,
    /// Number of poses, the first ones, on which evidence is evaluated.
    pub(super) evidence_poses: usize,
    /// ln of the prior probability of a family of effects.
    pub(super) ln_family: f64,
    /// Covariates on which functions without a law depend.
    covariates: Vec<SampledCovariate>,
    /// Two flags: directions of approach are recorded; times are recorded.
    coverage: (bool, bool),
    /// Candidate times at which the instrument may have moved.
    pub(super) times: Vec<f64>,
    /// Properties of the other hypotheses on which the prior probability of an effect depends.
    pub(super) others: OtherHypotheses,
}

/// Effect with the columns of its parameters.
type WithColumns = (Effect, DMatrix<f64>);

/// Splits effects with their columns into waves, composed laws and station moves, and all others.
/// The former are not listed as candidates, because their argument or formula is searched.
fn split_unlisted(all: impl Iterator<Item = WithColumns>) -> (Vec<WithColumns>, Vec<WithColumns>) {
    all.partition(|(effect, _)| {
        joint_and_order(effect).is_some()
            || effect.is_composed()
            || matches!(effect, Effect::StationMove { .. })
    })
}

/// Returns the effects `added`, each with the columns of the fit with its indices `unknowns`. The
/// columns of a law's inner parameters are left out, because only its coefficients are removed from
/// the fit.
fn columns_of_added<'a>(
    linearised: &'a Linearised,
    (added, unknowns): (&'a [Effect], &'a [Vec<usize>]),
) -> impl Iterator<Item = WithColumns> + 'a {
    added.iter().zip(unknowns).map(|(part, unknowns)| {
        let inner = if let Effect::Law(law) = part { law.parameters().len() } else { 0 };
        let count = unknowns.len().saturating_sub(inner);
        (part.clone(), linearised.fitted().select_columns(&unknowns[..count]))
    })
}

impl<'a> Hypotheses<'a> {
    /// Creates the hypotheses about the residual that the fit without the effects `added` leaves.
    /// Evidence is evaluated on the first `evidence_poses` of the `rows`.
    pub fn new(
        fitted: &'a Fitted,
        data: &Data<'a>,
        added: &[Effect],
        rows: &[usize],
        evidence_poses: usize,
    ) -> Self {
        let candidates = Candidates::new(&fitted.problem, data).testable;
        let added: Vec<Effect> = added.iter().flat_map(Effect::parts).collect();
        let columns_of_part: Vec<Vec<usize>> =
            added.iter().map(|part| fitted.unknowns_of(part)).collect();
        let unknowns = columns_of_part.concat();
        let linearised =
            fitted.linearised_with(data, rows, &candidates, &hypothesis_sites(&fitted.problem));
        let (unlisted, listed_added) =
            split_unlisted(columns_of_added(&linearised, (&added, &columns_of_part)));
        let new =
            candidates.into_iter().map(|effect| (effect.clone(), linearised.columns(&effect)));
        let effects: Vec<WithColumns> = listed_added.into_iter().chain(new).collect();
        let listed = Self::listed(fitted, data, linearised, evidence_poses, (&effects, None));
        let mut hypotheses = Self { added, unknowns, times: data.shift_times(), ..listed };
        hypotheses.add_unlisted(unlisted, &fitted.problem);
        hypotheses.candidates.extend(limits(
            fitted,
            &hypotheses.linearised,
            evidence_poses,
            hypotheses.ln_family,
        ));
        hypotheses
    }

    /// Creates the hypotheses of listed effects with their columns, and those without a law; if
    /// `only` is given, only the functions of these hypotheses.
    fn listed(
        fitted: &Fitted,
        data: &Data,
        linearised: Linearised<'a>,
        evidence_poses: usize,
        (effects, only): (&[WithColumns], Option<&[Hypothesis]>),
    ) -> Self {
        let coverage = coverage(&linearised, data);
        let (candidates, covariates, ln_family, others) = Columns::all(
            &fitted.problem,
            &linearised,
            (coverage, data.admits_common_prior, evidence_poses),
            effects,
            only,
        );
        Self {
            linearised,
            added: Vec::new(),
            unknowns: Vec::new(),
            candidates,
            evidence_poses,
            ln_family,
            covariates,
            coverage,
            times: Vec::new(),
            others,
        }
    }

    /// Adds the candidates of effects that are not listed.
    fn add_unlisted(&mut self, unlisted: Vec<WithColumns>, problem: &Problem) {
        let candidate_of_effect =
            |(effect, columns)| self.candidate_of_effect(&effect, columns, problem);
        let candidates: Vec<Candidate> =
            unlisted.into_iter().filter_map(candidate_of_effect).collect();
        self.candidates.extend(candidates);
    }

    /// Returns the candidate for an effect that is not listed, such as a wave or a station move,
    /// with the given `columns`. Returns `None` if the effect displaces no pose.
    pub(super) fn candidate_of_effect(
        &self,
        effect: &Effect,
        columns: DMatrix<f64>,
        problem: &Problem,
    ) -> Option<Candidate> {
        let (design, largest) =
            scaled_to_equal_length(columns, &effect.terms(problem), self.evidence_poses)?;
        let coefficients = Coefficients { largest, ..Coefficients::default() };
        let family = self
            .candidates
            .iter()
            .filter_map(|candidate| candidate.hypothesis.effect())
            .filter(|member| member.name() == effect.name());
        let tries = match effect {
            Effect::StationMove { .. } => self.times.len().max(1) as f64,
            _ => effect.tries(&family.collect::<Vec<_>>(), problem),
        };
        let ln_prior = grammar::ln_prior(effect, problem)
            .map_or_else(|| self.ln_family - tries.ln(), |ln_prior| self.ln_family + ln_prior);
        let hypothesis = Hypothesis::of_effect(effect, problem, self.coverage);
        Some(Candidate { hypothesis, variant: 0, design, ln_prior, coefficients })
    }

    /// Creates only the functions of the hypothesis `of`, about the residual of the fit with all
    /// its effects.
    pub fn only(
        fitted: &'a Fitted,
        data: &Data<'a>,
        rows: &[usize],
        evidence_poses: usize,
        of: &Hypothesis,
    ) -> Self {
        let linearised =
            fitted.linearised_with(data, rows, &[], &hypothesis_sites(&fitted.problem));
        let only = Some(std::slice::from_ref(of));
        Self::listed(fitted, data, linearised, evidence_poses, (&[], only))
    }

    /// Creates the hypotheses of the effects `added` and of some `functions` without a law alone,
    /// with the prior probabilities that they have among all hypotheses. The families of functions,
    /// and the effects that displace no pose, are those at another fit, `others`. Returns `None` if
    /// an effect is a wave, which needs the columns of other waves, or a function a wrong limit.
    pub(super) fn of_set(
        fitted: &'a Fitted,
        data: &Data<'a>,
        (added, functions, others): (&[Effect], &[Hypothesis], &OtherHypotheses),
        rows: &[usize],
    ) -> Option<Self> {
        let problem = &fitted.problem;
        let added: Vec<Effect> = added.iter().flat_map(Effect::parts).collect();
        let is_limit = |of: &Hypothesis| matches!(of.kind, HypothesisKind::Limit(_));
        if added.iter().any(|effect| joint_and_order(effect).is_some())
            || functions.iter().any(is_limit)
        {
            return None;
        }
        let columns_of_part: Vec<Vec<usize>> =
            added.iter().map(|part| fitted.unknowns_of(part)).collect();
        let sites = if functions.is_empty() { Vec::new() } else { hypothesis_sites(problem) };
        let linearised = fitted.linearised_with(data, rows, &[], &sites);
        let (unlisted, listed_added) =
            split_unlisted(columns_of_added(&linearised, (&added, &columns_of_part)));
        let (coverage, evidence_poses) = (coverage(&linearised, data), rows.len());
        let mut listed: Vec<Effect> =
            listed_added.iter().map(|(effect, _)| effect.clone()).collect();
        listed.extend(Candidates::new(problem, data).testable);
        let (tries, _) = tries(&listed, problem);
        let mut families = Families::default();
        let (mut added_candidates, mut shares) = (Vec::new(), Vec::new());
        let mut listed_added = listed_added.into_iter();
        for (effect, tries) in listed.iter().zip(tries) {
            let share = share(effect, tries, problem);
            let is_seen = match listed_added.next() {
                Some((_, columns)) => {
                    let candidate =
                        candidate_of(effect, columns, problem, (coverage, evidence_poses));
                    let is_seen = candidate.is_some();
                    shares.extend(candidate.is_some().then_some(share));
                    added_candidates.extend(candidate);
                    is_seen
                }
                None => !others.unseen.contains(effect),
            };
            if is_seen {
                families.add(effect.name(), share, Some(effect));
            }
        }
        for (name, shares) in &others.functions {
            families.add(name, *shares, None);
        }
        let total_weight = families.weight();
        for (candidate, share) in added_candidates.iter_mut().zip(shares) {
            let name = candidate.hypothesis.effect().map_or("", Effect::name);
            candidate.ln_prior = families.ln_prior(name, share, total_weight);
        }
        if !functions.is_empty() {
            let measured = (coverage, data.admits_common_prior, evidence_poses);
            let of = (functions, &families);
            added_candidates.extend(Columns::functions(problem, &linearised, measured, of));
        }
        let mut hypotheses = Self {
            linearised,
            unknowns: columns_of_part.concat(),
            added,
            candidates: added_candidates,
            evidence_poses,
            ln_family: ln_family(total_weight),
            covariates: Vec::new(),
            coverage,
            times: data.shift_times(),
            others: others.clone(),
        };
        hypotheses.add_unlisted(unlisted, problem);
        Some(hypotheses)
    }

    /// Returns the candidate for a member of a set, with the variant that the set contains; `None`
    /// if there is none.
    pub(super) fn candidate(
        &self,
        explanation: &HypothesisSet,
        hypothesis: &Hypothesis,
    ) -> Option<&Candidate> {
        let mut members = explanation.hypotheses.iter().zip(&explanation.functions);
        let (_, &(variant, _)) = members.find(|(member, _)| *member == hypothesis)?;
        self.candidates
            .iter()
            .find(|candidate| candidate.variant == variant && candidate.hypothesis == *hypothesis)
    }

    /// Returns the columns, at all poses, of a function that a set contains, shape = (3 N, k). They
    /// are those of the smooth function, or the column of the single `shape` if one is given.
    pub fn form(
        &self,
        explanation: &HypothesisSet,
        hypothesis: &Hypothesis,
        (shape, evidence_poses): (Option<Shape>, usize),
    ) -> Option<DMatrix<f64>> {
        let Some(shape) = shape else {
            return Some(self.candidate(explanation, hypothesis)?.design.columns().into_owned());
        };
        let (_, candidate) = self.shaped(hypothesis, evidence_poses, &[shape]).pop()?;
        Some(candidate.design.columns().into_owned())
    }

    /// Returns candidates with a single bump or step each that may replace a function of one
    /// covariate at one coordinate; none for other hypotheses. All trial shapes together are as
    /// probable a priori as the function.
    pub(super) fn shaped(
        &self,
        hypothesis: &Hypothesis,
        evidence_poses: usize,
        shapes: &[Shape],
    ) -> Vec<(Shape, Candidate)> {
        let Some((.., values, lever)) = self.coordinate(hypothesis) else { return Vec::new() };
        let Some(sampled) =
            SampledCovariate::new(Covariate::Position, values.to_vec(), evidence_poses)
        else {
            return Vec::new();
        };
        let ln_prior = -(Shape::all().len() as f64).ln();
        let candidate_of_shape = |shape: &Shape| {
            let mut columns = DMatrix::from_columns(std::slice::from_ref(&lever));
            for (pose, at) in sampled.scaled.iter().enumerate() {
                columns.rows_mut(3 * pose, 3).scale_mut(shape.value(*at));
            }
            let design = Design::Dense(columns).scaled(evidence_poses)?;
            let (hypothesis, coefficients) = (hypothesis.clone(), Coefficients::default());
            Some((*shape, Candidate { hypothesis, variant: 0, design, ln_prior, coefficients }))
        };
        shapes.iter().filter_map(candidate_of_shape).collect()
    }

    /// Returns a covariate with its values in every pose; `None` if the table does not record it,
    /// or if it does not vary.
    pub(super) fn sampled(&self, covariate: &Covariate) -> Option<&SampledCovariate> {
        self.covariates.iter().find(|sampled| sampled.covariate == *covariate)
    }

    /// Returns the covariates on which a hypothesis depends.
    fn covariates(&self, hypothesis: &Hypothesis) -> impl Iterator<Item = &SampledCovariate> {
        self.covariates.iter().filter(|sampled| hypothesis.depends_on.contains(&sampled.covariate))
    }

    /// Returns the covariates of a hypothesis with their ranges over the poses of the evidence.
    pub fn ranges(&self, hypothesis: &Hypothesis) -> Vec<(Covariate, (f64, f64))> {
        self.covariates(hypothesis)
            .map(|sampled| (sampled.covariate.clone(), sampled.range))
            .collect()
    }

    /// Returns, for each pose from index `first` on, true if all covariates of the hypothesis are
    /// within their ranges over the poses of the evidence.
    pub fn is_in_range(&self, hypothesis: &Hypothesis, first: usize) -> Vec<bool> {
        let within = |sampled: &SampledCovariate, pose: usize| {
            (sampled.range.0..=sampled.range.1).contains(&sampled.values[pose])
        };
        let poses = self.linearised.poses().len();
        (first..poses)
            .map(|pose| self.covariates(hypothesis).all(|sampled| within(sampled, pose)))
            .collect()
    }

    /// Returns covariate, site, values and lever of the hypothesis if it is a function of one
    /// covariate at one joint coordinate; `None` otherwise.
    pub fn coordinate(
        &self,
        hypothesis: &Hypothesis,
    ) -> Option<(Covariate, ParameterSite, &[f64], DVector<f64>)> {
        let site =
            hypothesis.coordinate.filter(|site| matches!(site, ParameterSite::Joint { .. }))?;
        let mut covariates = self.covariates(hypothesis);
        let (only, None) = (covariates.next()?, covariates.next()) else { return None };
        Some((only.covariate.clone(), site, &only.values, self.linearised.column_at(site)?))
    }
}

/// Returns two flags: true if some poses record directions of approach, and true if times are
/// recorded.
fn coverage(linearised: &Linearised, data: &Data) -> (bool, bool) {
    let has_approach = linearised.poses().iter().any(|pose| pose.setup.approach.is_some());
    (has_approach, data.measurements.time_measured)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::fit::Options;
    use crate::measurement::Dataset;
    use crate::select::SelectionRules;

    #[test]
    fn no_two_functions_of_a_hypothesis_have_one_number() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/honest");
        let problem = Problem::read(&folder.join("six.toml")).unwrap();
        let (data, _) = Dataset::read_files(&[folder.join("six-4.csv")], &problem).unwrap();
        let rules = SelectionRules::DEFAULT;
        let data = Data::new(&problem, &data, &rules);
        let fitted = Fitted::new(problem.clone(), &data, &Options::default()).unwrap();
        let rows = data.evidence_rows();
        let hypotheses = Hypotheses::new(&fitted, &data, &[], &rows, rows.len());
        let of_load = |candidate: &&Candidate| {
            candidate.hypothesis.effect().is_none()
                && candidate.hypothesis.depends_on == [Covariate::Load]
        };
        assert!(hypotheses.candidates.iter().filter(of_load).count() > 20);
        for (k, candidate) in hypotheses.candidates.iter().enumerate() {
            let is_same = |other: &Candidate| {
                other.variant == candidate.variant && other.hypothesis == candidate.hypothesis
            };
            let first = hypotheses.candidates.iter().position(is_same);
            assert_eq!(first, Some(k), "{:?} {}", candidate.hypothesis, candidate.variant);
        }
    }
}
