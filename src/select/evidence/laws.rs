//! Search for laws of the grammar in place of members of probable sets: at the coordinates of
//! joints, at the tool, in the measurement, at the base and in links that warm.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::PoisonError;

use nalgebra::{DMatrix, DVector};

use super::blocks::blocks;
use super::candidate::Candidate;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use super::products::{Products, ReducedProblem};
use super::search::{EvaluatedSet, reduced_by};
use super::set::sorted;
use super::sites::{MOTIONS_BEHIND, camera_sites, tool_site};
use super::waves::is_free;
use crate::laws::expression::Vocabulary;
use crate::laws::{At, Law, LawSite};
use crate::model::parameter::{BeamField, JointField, ParameterSite};
use crate::problem::{Effect, Joint, Problem, beam_names};
use crate::residual_tests::Covariate;
use crate::select::data::Data;
use crate::select::fitted::Fitted;
use crate::select::grammar::{
    FormulaSite, MAX_POSES, Noise, Proposal, Quantities, WhitenedSite, Written, proposals,
};

/// Smallest probability of a set at which laws are searched in place of its members: at the
/// coordinate of a joint, and elsewhere.
const MIN_SET_PROBABILITIES: [f64; 2] = [0.1, 0.2];
/// Smallest probability, at a joint, of the sets in which that joint takes the place of a function
/// without a law at another site, such as a link, at which laws are searched there. A law has fewer
/// coefficients than a function, so it may be far more probable than the function at either site.
const MIN_REPLACING_PROBABILITY: f64 = 1e-4;
/// Maximum number of pairs of a joint and a set, the most probable ones, for which laws are
/// searched.
const MAX_SEARCHED: usize = 2;
/// Maximum number of laws at all sites other than joint coordinates together.
const MAX_ELSEWHERE: usize = 12;
/// Largest ln odds of the most probable law of all these sites over another law that is kept.
const MAX_LN_ODDS_ELSEWHERE: f64 = 8.0;

/// Site at which laws are searched.
#[derive(Debug, Clone, PartialEq)]
struct LawAt {
    /// Site as in files.
    name: String,
    /// Part of the arm, which determines the factors of formulas.
    place: FormulaSite,
    /// Parameter site at which the law adds its value. The lever is the derivative of the residuals
    /// there.
    lever: ParameterSite,
}

impl LawAt {
    /// Returns true if the site is the coordinate of a joint.
    fn is_coordinate(&self) -> bool {
        matches!(self.place, FormulaSite::Joint(_))
    }
}

/// Sites at which laws are searched together, and the other members of a probable set.
struct SitesToSearch {
    sites: Vec<LawAt>,
    other_members: Vec<usize>,
}

/// Returns the formulas that may replace the members of probable sets at single joints, at other
/// sites, and in links that warm.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    products: &Products,
    (fitted, data, left_out): (&Fitted, &Data, &[usize]),
) -> Vec<Candidate> {
    let problem = &fitted.problem;
    let mut laws: Vec<Candidate> = Vec::new();
    let places = places(hypotheses, evaluated_sets, products);
    let elsewhere = elsewhere(hypotheses, evaluated_sets, products);
    let links = warming_links(hypotheses, evaluated_sets, products);
    for SitesToSearch { sites, other_members: rest } in
        places.into_iter().chain(elsewhere).chain(links)
    {
        if products.residual_model.stop.is_requested() {
            break;
        }
        let fitted_effects = fitted.effects().iter().map(Effect::name_and_place).collect();
        let names = sites.iter().map(|at| at.name.as_str()).collect::<Vec<_>>().join(" ");
        let unused = left_out.iter().chain(&fitted.set_aside).copied().collect();
        let key = (names, member_names(hypotheses, &rest), unused, fitted_effects);
        let proposals = || data.proposed.lock().unwrap_or_else(PoisonError::into_inner);
        let proposed = proposals().get(&key).cloned();
        let proposed = proposed.unwrap_or_else(|| {
            let search = Search { hypotheses, fitted, data, left_out };
            let new = search.laws(&sites, &rest, products);
            proposals().insert(key, new.clone());
            new
        });
        for effect in proposed {
            let is_listed = |candidate: &Candidate| {
                candidate.hypothesis.effect().is_some_and(|other| other.is_same_as(&effect))
            };
            let is_listed = hypotheses.candidates.iter().chain(&laws).any(is_listed);
            if !is_listed && is_free(&effect, problem) {
                let columns = coefficient_columns(&effect, hypotheses, (problem, &sites));
                laws.extend(hypotheses.candidate_of_effect(&effect, columns, problem));
            }
        }
    }
    laws
}

/// Returns the columns of the coefficients of a law, without those of the parameters inside its
/// formulas.
///
/// The columns of a law at another site than a joint's coordinate are the products of the values of
/// its formulas and the lever of its site.
fn coefficient_columns(
    effect: &Effect,
    hypotheses: &Hypotheses,
    (problem, sites): (&Problem, &[LawAt]),
) -> DMatrix<f64> {
    let linearised = &hypotheses.linearised;
    let terms = effect.terms(problem);
    let Effect::Law(law) = effect else { return linearised.columns(effect) };
    let count = terms.len().saturating_sub(law.parameters().len());
    let site = law.site();
    let lever = sites
        .iter()
        .find(|at| !at.is_coordinate() && at.name == site)
        .and_then(|at| linearised.column_at(at.lever));
    let Some(lever) = lever else {
        return linearised.columns(effect).columns(0, count).into_owned();
    };
    let mut columns = DMatrix::zeros(lever.len(), count);
    for (term, mut column) in terms.iter().zip(columns.column_iter_mut()) {
        let values = term.regressor.values(linearised.poses().iter().map(|pose| &pose.setup));
        for (row, (out, lever)) in column.iter_mut().zip(lever.iter()).enumerate() {
            *out = lever * values[row / 3];
        }
    }
    columns
}

/// Returns the names of the `members`, which key the cache of laws.
fn member_names(hypotheses: &Hypotheses, members: &[usize]) -> Vec<String> {
    let name = |&member: &usize| {
        let hypothesis = &hypotheses.candidates[member].hypothesis;
        hypothesis.effect().map_or_else(
            || format!("{} {:?} {:?}", hypothesis.site, hypothesis.kind, hypothesis.depends_on),
            Effect::name_and_place,
        )
    };
    let mut names: Vec<String> = members.iter().map(name).collect();
    names.sort();
    names
}

/// Returns a proposed formula at a site as an effect; `None` if the formula is not valid.
fn effect_of_proposal(problem: &Problem, at: &LawAt, proposal: &Proposal) -> Option<Effect> {
    let (slides, covariates) = (problem.slides(), problem.covariate_names());
    let vocabulary =
        Vocabulary { slides: &slides, covariates: &covariates, ..Vocabulary::default() };
    let links = beam_names(&problem.joints);
    let site =
        LawSite::parse(&at.name, problem.joints.len(), &[], &links, &problem.cameras()).ok()?;
    let law = |written: &Written| {
        let parameters = written.parameters.clone();
        let site = site.clone();
        Law::new(&written.name, site, &written.formulas, None, parameters, &vocabulary).ok()
    };
    let rival = |(written, share): &(Written, f64)| Some((law(written)?, *share));
    let rivals = proposal.rivals.iter().filter_map(rival).collect();
    Some(Effect::Law(law(&proposal.law)?.composed(proposal.ln_prior, rivals)))
}

/// Returns the joint, counted from 0, at whose command coordinate or about whose axis a hypothesis
/// acts; `None` for other hypotheses and for periodic errors with many orders.
fn joint_of(hypothesis: &Hypothesis, problem: &Problem) -> Option<usize> {
    let Site::Joint(joint) = hypothesis.site else { return None };
    let is_there = match &hypothesis.kind {
        HypothesisKind::Effect(effect) => effect.acts_at_joint(),
        HypothesisKind::Gear(_) | HypothesisKind::Limit(_) => false,
        _ => hypothesis.coordinate == Some(ParameterSite::coordinate(problem, joint + 1)),
    };
    is_there.then_some(joint)
}

/// Returns the joints at whose coordinates laws are searched, each with the other members of a
/// probable set.
fn places(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    products: &Products,
) -> Vec<SitesToSearch> {
    let problem = hypotheses.linearised.problem();
    let of = |member: usize| joint_of(&hypotheses.candidates[member].hypothesis, problem);
    // The probabilities of sets that differ only at the joint are added.
    let mut probability_of_rest: BTreeMap<(usize, Vec<usize>), f64> = BTreeMap::new();
    for set in evaluated_sets.iter().filter(|set| !products.has_gear(&set.members)) {
        let joints: BTreeSet<usize> = set.members.iter().filter_map(|&member| of(member)).collect();
        for joint in joints {
            let other_members = sorted(&set.without(|member| of(member) == Some(joint)));
            *probability_of_rest.entry((joint, other_members)).or_default() += set.probability;
        }
    }
    let is_smooth =
        |member: &usize| hypotheses.candidates[*member].hypothesis.kind == HypothesisKind::Smooth;
    let is_elsewhere = |member: &usize| is_smooth(member) && of(*member).is_none();
    let best = evaluated_sets.first();
    let may_replace = best.is_some_and(|set| set.members.iter().any(is_elsewhere));
    let is_searched = |((_, rest), probability): &((usize, Vec<usize>), f64)| {
        let replaces = may_replace && !rest.iter().any(is_smooth);
        let least = if replaces { MIN_REPLACING_PROBABILITY } else { MIN_SET_PROBABILITIES[0] };
        *probability > least
    };
    let mut found: Vec<((usize, Vec<usize>), f64)> =
        probability_of_rest.into_iter().filter(is_searched).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
    found.truncate(MAX_SEARCHED);
    let place = |(joint, rest): (usize, Vec<usize>)| {
        let lever = ParameterSite::coordinate(problem, joint + 1);
        let at =
            LawAt { name: format!("joint{}", joint + 1), place: FormulaSite::Joint(joint), lever };
        SitesToSearch { sites: vec![at], other_members: rest }
    };
    found.into_iter().map(|(found, _)| place(found)).collect()
}

/// Returns the most probable set if laws are searched in place of its members at other sites than
/// joint coordinates.
fn searched_set<'s>(sets: &'s [EvaluatedSet], products: &Products) -> Option<&'s EvaluatedSet> {
    sets.first().filter(|set| {
        set.probability > MIN_SET_PROBABILITIES[1] && !products.has_gear(&set.members)
    })
}

/// Returns the sites other than joint coordinates at which laws are searched. The laws replace
/// those members of the most probable set that act there. The sites are tool, measurement and base,
/// small motions of a joint at which a function without a law acts, and of the frames behind that
/// joint and the one before it. Returns `None` if no member acts there.
fn elsewhere(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    products: &Products,
) -> Option<SitesToSearch> {
    let problem = hypotheses.linearised.problem();
    let set = searched_set(evaluated_sets, products)?;
    let of = |member: usize| &hypotheses.candidates[member].hypothesis;
    let is_elsewhere = |member: usize| {
        let hypothesis = of(member);
        let is_listed = match &hypothesis.kind {
            HypothesisKind::Effect(effect) => effect.is_composed() || !effect.acts_at_joint(),
            HypothesisKind::Smooth | HypothesisKind::Wandering => true,
            _ => false,
        };
        // Laws elsewhere than at a joint are no functions of the moments of the loads or of the
        // position.
        let can_be_in_formula = |covariate: &Covariate| {
            !matches!(covariate, Covariate::Load | Covariate::Position | Covariate::Velocity)
        };
        is_listed
            && hypothesis.depends_on.iter().any(can_be_in_formula)
            && joint_of(hypothesis, problem).is_none()
    };
    let members: Vec<usize> =
        set.members.iter().copied().filter(|&member| is_elsewhere(member)).collect();
    if members.is_empty() {
        return None;
    }
    let other_members = sorted(&set.without(|member| members.contains(&member)));
    let mut sites: Vec<LawAt> = Vec::new();
    let mut add = |name: String, lever: ParameterSite| {
        sites.push(LawAt { name, place: FormulaSite::Elsewhere, lever });
    };
    for (axis, letter) in ["x", "y", "z"].into_iter().enumerate() {
        add(format!("tool.{letter}"), tool_site(problem, axis));
        add(format!("measurement.{letter}"), ParameterSite::Shift { axis });
        add(format!("base.r{letter}"), ParameterSite::Turn { axis });
    }
    for (name, lever) in camera_sites(problem) {
        add(name, lever);
    }
    let mut moved: BTreeSet<usize> = BTreeSet::new();
    for hypothesis in members.iter().map(|&member| of(member)) {
        if let Some(Effect::Law(law)) = hypothesis.effect()
            && let Site::Joint(joint) = hypothesis.site
            && matches!(law.at(), At::Before(_) | At::After(_))
        {
            moved.insert(joint);
        }
        let Some(ParameterSite::Joint { joint, field }) = hypothesis.coordinate else { continue };
        let motion = match field {
            JointField::A => "x",
            JointField::D => "z",
            JointField::Alpha => "rx",
            JointField::Beta => "ry",
            _ => continue,
        };
        moved.insert(joint);
        add(format!("joint{}.{motion}", joint + 1), ParameterSite::Joint { joint, field });
    }
    // The frame behind a joint turns with it. Motions of it along and about x are those of the next
    // joint.
    let behind = moved.iter().flat_map(|&joint| [joint.checked_sub(1), Some(joint)]).flatten();
    for joint in behind.collect::<BTreeSet<usize>>() {
        for (axis, name) in MOTIONS_BEHIND {
            let lever = ParameterSite::Joint { joint, field: JointField::After(axis) };
            add(format!("joint{}.after.{name}", joint + 1), lever);
        }
    }
    Some(SitesToSearch { sites, other_members })
}

/// Returns the links at which laws are searched: every link with a beam, in place of the members of
/// the most probable set that depend on temperature and act at a joint or in a link. A joint whose
/// error depends on temperature and a link that bends have similar levers, so both are compared.
fn warming_links(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    products: &Products,
) -> Option<SitesToSearch> {
    let problem = hypotheses.linearised.problem();
    problem.data.reference_temperature?;
    let set = searched_set(evaluated_sets, products)?;
    let depends_on_temperature = |member: usize| {
        let hypothesis = &hypotheses.candidates[member].hypothesis;
        matches!(hypothesis.site, Site::Joint(_) | Site::LinkBefore(_))
            && hypothesis.depends_on.contains(&Covariate::Temperature)
    };
    let other_members = sorted(&set.without(depends_on_temperature));
    let names = ["strain", "curvature_y", "curvature_z"];
    let of_joint = |(joint, of): (usize, &Joint)| {
        let beam = of.beam.as_ref()?;
        let at = |(field, name): (BeamField, &str)| LawAt {
            name: format!("{}.{name}", beam.name),
            place: FormulaSite::Link,
            lever: ParameterSite::Beam { joint, field },
        };
        Some(BeamField::STRAINS.into_iter().zip(names).map(at).collect::<Vec<_>>())
    };
    let sites: Vec<LawAt> =
        problem.joints.iter().enumerate().filter_map(of_joint).flatten().collect();
    let replaces_some = other_members.len() < set.members.len();
    (replaces_some && !sites.is_empty()).then_some(SitesToSearch { sites, other_members })
}

/// Search for formulas that explain the residual that some members of a set leave.
struct Search<'s, 'h, 'd> {
    hypotheses: &'s Hypotheses<'h>,
    fitted: &'s Fitted,
    data: &'s Data<'d>,
    left_out: &'s [usize],
}

impl Search<'_, '_, '_> {
    /// Returns the laws at some sites that best explain the residual that `other_members` leave. A
    /// class that contains a law of the fit is represented by that law.
    fn laws(&self, sites: &[LawAt], other_members: &[usize], products: &Products) -> Vec<Effect> {
        let poses = self.hypotheses.linearised.poses();
        let kept: Vec<usize> =
            (0..poses.len()).filter(|pose| !self.left_out.contains(pose)).collect();
        let count = kept.len().min(MAX_POSES);
        let kept: Vec<usize> = (0..count).map(|k| kept[k * kept.len() / count]).collect();
        let dropped: Vec<usize> = (0..poses.len()).filter(|pose| !kept.contains(pose)).collect();
        if dropped.len() == self.left_out.len() {
            return self.best(sites, (products, other_members), &kept);
        }
        let members: Vec<&Candidate> =
            other_members.iter().map(|&member| &self.hypotheses.candidates[member]).collect();
        let Some((blocks, residual_model)) =
            blocks(self.fitted, self.data, self.hypotheses, &members, &dropped)
        else {
            return Vec::new();
        };
        let products = Products::new(&blocks, &residual_model);
        let all_blocks: Vec<usize> = (0..blocks.len()).collect();
        self.best(sites, (&products, &all_blocks), &kept)
    }

    /// Returns the best laws of all sites that the fit does not contain, those of one site in the
    /// order of their probability. Returns none if the other members of the set cannot be fitted.
    fn best(
        &self,
        sites: &[LawAt],
        (products, other_members): (&Products, &[usize]),
        kept: &[usize],
    ) -> Vec<Effect> {
        let Some(reduced) = reduced_by(other_members, products) else { return Vec::new() };
        let of_site = |at: &LawAt| {
            let proposals = self.proposals(at, (&reduced, products), kept);
            proposals.into_iter().map(|proposal| (at.clone(), proposal)).collect::<Vec<_>>()
        };
        let mut laws_at_sites: Vec<(LawAt, Proposal)> = sites.iter().flat_map(of_site).collect();
        if !sites.iter().any(LawAt::is_coordinate) {
            laws_at_sites.sort_by(|a, b| b.1.ln_posterior.total_cmp(&a.1.ln_posterior));
            let most = laws_at_sites.first().map_or(0.0, |best| best.1.ln_posterior);
            laws_at_sites.retain(|(_, law)| law.ln_posterior > most - MAX_LN_ODDS_ELSEWHERE);
            laws_at_sites.truncate(MAX_ELSEWHERE);
        }
        let new = laws_at_sites.iter().filter(|(_, proposal)| !proposal.is_present);
        new.filter_map(|(at, proposal)| effect_of_proposal(&self.fitted.problem, at, proposal))
            .collect()
    }

    /// Returns the formulas at one site that best explain the residual `left`, in the poses `kept`.
    fn proposals(
        &self,
        at: &LawAt,
        (left, products): (&ReducedProblem, &Products),
        kept: &[usize],
    ) -> Vec<Proposal> {
        let Self { hypotheses, fitted, data, .. } = *self;
        let problem = &fitted.problem;
        let linearised = &hypotheses.linearised;
        let lever = linearised.column_at(at.lever).filter(|lever| lever.norm_squared() > 0.0);
        let Some(lever) = lever else { return Vec::new() };
        let (less, product) = along_lever(left, products, (&lever, kept));
        let of_pose = |pose: &usize| lever.rows(3 * pose, 3);
        let squares = kept.iter().map(|pose| of_pose(pose).norm_squared());
        let diagonal = DVector::from_iterator(kept.len(), squares);
        let site = WhitenedSite::new(diagonal, &less, product);
        let noise = Noise::new(left.squares, products.residual_model.noise.freedom, |squares| {
            products.ln_density(squares)
        });
        let poses_of_fit = linearised.poses();
        let poses: Vec<_> = kept.iter().map(|&pose| &poses_of_fit[pose]).collect();
        let quantities = Quantities::new(problem, &poses, data.measurements.time_measured);
        // The functions of laws that the fit contains follow from their columns and the lever.
        let is_present = |k: &usize| {
            let effect = hypotheses.candidates[*k].hypothesis.effect();
            matches!(effect, Some(Effect::Law(law)) if law.composed_ln_prior().is_some() && law.site() == at.name)
        };
        let present: Vec<usize> = (0..hypotheses.candidates.len()).filter(is_present).collect();
        let functions = |&k: &usize| {
            let columns = hypotheses.candidates[k].design.columns();
            let function = |column: nalgebra::DVectorView<f64>| {
                let value = |pose: &usize| {
                    let lever = of_pose(pose);
                    column.rows(3 * pose, 3).dot(&lever) / lever.norm_squared().max(1e-300)
                };
                DVector::from_iterator(kept.len(), kept.iter().map(value))
            };
            columns.column_iter().map(|column| function(column.as_view())).collect()
        };
        let functions: Vec<Vec<DVector<f64>>> = present.iter().map(functions).collect();
        proposals(&quantities, (&at.name, at.place), (&site, &noise), &functions)
    }
}

/// Returns B and p of columns along one lever l, one column for each of the `poses`, with the
/// fitted parameters and a set projected out. The products of the columns are diag(|l|²) − BᵀB; p
/// are their products with the residual.
fn along_lever(
    reduced: &ReducedProblem,
    products: &Products,
    (lever, poses): (&DVector<f64>, &[usize]),
) -> (DMatrix<f64>, DVector<f64>) {
    let (fitted, reach, residual) =
        (products.residual_model.fit.fitted(), reduced.reach(), reduced.residual());
    let rows = [fitted.ncols(), reach.nrows()];
    let mut less = DMatrix::zeros(rows[0] + rows[1], poses.len());
    let mut product = DVector::zeros(poses.len());
    for (k, pose) in poses.iter().enumerate() {
        let lever = lever.rows(3 * pose, 3);
        let mut column = less.column_mut(k);
        column.rows_mut(0, rows[0]).gemv_tr(1.0, &fitted.rows(3 * pose, 3), &lever, 0.0);
        let mut below = column.rows_mut(rows[0], rows[1]);
        below.gemv(1.0, &reach.columns(3 * pose, 3), &lever, 0.0);
        product[k] = lever.dot(&residual.rows(3 * pose, 3));
    }
    (less, product)
}
