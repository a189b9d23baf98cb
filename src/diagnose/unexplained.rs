//! Structure that no effect of the catalogue explains: where it is, what it depends on, and what a smooth correction gains.

use nalgebra::DVector;
use rayon::prelude::*;

use super::covariate::{Covariate, Place};
use super::data::Data;
use super::fitted::Fitted;
use super::neighbourhood::{Gain, LinearNeighbourhood, Linearised, tries};
use super::residual_tests::Findings;
use super::rules::SelectionRules;
use super::smooth_term::SmoothTerm;
use crate::identify::ErrorSummary;
use crate::model::Pose;
use crate::model::parameter::{JointField, Quantity, Slot};
use crate::problem::Effect;
use crate::quantity::Unit;

/// Structure that is left.
#[derive(Debug, Clone)]
pub struct Unexplained {
    /// Where it is.
    pub place: Place,
    /// What it depends on.
    pub depends_on: Vec<Covariate>,
    /// Probability that it is chance, corrected for the places and quantities tried.
    pub p_value: f64,
    /// What an empirical correction gains; `None` where it takes less than 5 % off the error of poses that were left out.
    pub correction: Option<Correction>,
}

/// A smooth correction of one place's error as a function of one quantity.
#[derive(Debug, Clone)]
pub struct Correction {
    /// What it is a function of.
    pub covariate: Covariate,
    /// Coordinate of the arm that it is added to.
    pub slot: Slot,
    /// Unit of that coordinate: an angle or a length.
    pub unit: Unit,
    /// Range of the quantity that the identification poses cover, in its unit: nothing is corrected beyond it.
    pub range: (f64, f64),
    /// Held-out poses beyond it, which stay uncorrected.
    pub beyond: usize,
    /// Root mean squared error of identification poses left out in turn, before and with the correction \[m\].
    pub cross_validated: (f64, f64),
    /// Error on held-out poses with the correction.
    pub held_out: ErrorSummary,
    /// The quantity and the correction of the place there \[rad\] or \[m\].
    pub curve: Vec<(f64, f64)>,
    /// Partial residuals of the identification poses, in the order of the rows.
    pub points: Vec<PartialResidual>,
}

/// What one pose alone says about a coordinate: the correction there and what the corrected fit leaves along the lever.
///
/// f(x) + l·r / |l|²   with the pose's lever l = ∂p/∂(coordinate) and its residual r once everything is fitted anew.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartialResidual {
    /// Row of the measurements, counted from 0.
    pub row: usize,
    /// Value of the covariate, in its unit.
    pub covariate: f64,
    /// Of the coordinate \[rad\] or \[m\].
    pub value: f64,
    /// |l| [m/rad] or [m/m]: poses where it is small say little.
    pub lever: f64,
}

/// A smooth term with its gain.
pub(super) struct Tried {
    pub smooth_term: SmoothTerm,
    pub gain: Gain,
    /// The criterion with 2 ln(places and quantities tried).
    pub criterion: f64,
    /// p times their number.
    pub corrected: f64,
}

/// The best of some smooth terms against a fit.
pub(super) fn best(
    fit: &LinearNeighbourhood,
    linearised: &Linearised,
    smooth_terms: &[SmoothTerm],
    rules: &SelectionRules,
    wanted: impl Fn(&SmoothTerm) -> bool,
) -> Option<Tried> {
    // Half of the chance for splines, half for single bumps and steps; an equal part for each place and quantity.
    let mut places: Vec<(Slot, Quantity)> = Vec::new();
    for term in smooth_terms {
        if !places.contains(&(term.slot, term.of)) {
            places.push((term.slot, term.of));
        }
    }
    let gain = |term: &SmoothTerm| fit.sums().gain(&fit.score(&term.columns(linearised)), rules);
    let tried = |smooth_term: &SmoothTerm| {
        let gain = gain(smooth_term)?;
        let gain = fit.sums().gain_of(gain.squares, gain.freedom + smooth_term.fitted, rules)?;
        let count = 2.0 * (places.len() * smooth_term.tries) as f64;
        let (criterion, corrected) = (gain.criterion + 2.0 * count.ln(), (gain.p * count).min(1.0));
        Some(Tried { smooth_term: smooth_term.clone(), gain, criterion, corrected })
    };
    let sorted = |mut all: Vec<Tried>| {
        all.sort_by(|a, b| a.gain.criterion.total_cmp(&b.gain.criterion));
        all
    };
    // Splines everywhere; single bumps and steps where splines find most.
    let wanted: Vec<&SmoothTerm> = smooth_terms.iter().filter(|term| wanted(term)).collect();
    let (single, splines): (Vec<&SmoothTerm>, Vec<&SmoothTerm>) = wanted.iter().partition(|term| term.is_single());
    let mut all: Vec<Tried> = sorted(splines.into_par_iter().filter_map(tried).collect());
    let near: Vec<(Slot, Quantity)> =
        all.iter().take(rules.promising).map(|t| (t.smooth_term.slot, t.smooth_term.of)).collect();
    let promising = |term: &SmoothTerm| near.is_empty() || near.contains(&(term.slot, term.of));
    let single: Vec<&SmoothTerm> = single.into_iter().filter(|term| promising(term)).collect();
    all.extend(single.into_par_iter().filter_map(tried).collect::<Vec<_>>());
    all = sorted(all);
    let shapes = all.iter().map(|tried| &tried.smooth_term).filter(|term| term.is_single()).take(rules.refined);
    let refined =
        |shape: &SmoothTerm| tried(&shape.clone().refined(rules, |term| gain(term).map_or(0.0, |gain| gain.squares)));
    let refined: Vec<Tried> = shapes.filter_map(refined).collect();
    all.into_iter().chain(refined).min_by(|a, b| a.criterion.total_cmp(&b.criterion))
}

/// Added effects that are functions of one joint's command at one joint, where a smooth function is the better explanation:
/// the function, and the effects that remain.
pub(super) fn withdraw(
    fitted: &Fitted,
    data: &Data,
    added: &[Effect],
    candidates: &[Effect],
) -> Option<(SmoothTerm, Vec<Effect>)> {
    let smooth_terms = SmoothTerm::all(&fitted.problem, data);
    let linearised = fitted.linearised(data, &[], &smooth_terms);
    let everything: Vec<Effect> = candidates.iter().cloned().chain(added.iter().flat_map(Effect::parts)).collect();
    let (all_tries, families) = tries(&everything);
    let search_of_part = |part: Effect| {
        let known = everything.iter().position(|other| *other == part);
        2.0 * (known.map_or(1.0, |index| all_tries[index]) * families as f64).ln()
    };
    let search = |effect: &Effect| effect.parts().into_iter().map(search_of_part).sum::<f64>();
    let mut places: Vec<(usize, usize)> = added.iter().filter_map(Effect::function_of).collect();
    places.sort_unstable();
    places.dedup();
    for (joint, from) in places {
        let (own, rest): (Vec<Effect>, Vec<Effect>) =
            added.iter().cloned().partition(|effect| effect.function_of() == Some((joint, from)));
        let unknowns: Vec<usize> = own.iter().flat_map(|effect| fitted.unknowns_of(effect)).collect();
        let fit = fitted.neighbourhood_without(&linearised, &unknowns, &[]);
        let explained = fit.sums().gain(&fit.score(&linearised.fitted().select_columns(&unknowns)), data.rules);
        let explained = explained.map_or(0.0, |gain| gain.criterion + own.iter().map(search).sum::<f64>());
        let here = |term: &SmoothTerm| {
            let is_coordinate = matches!(term.slot, Slot::Joint { joint: own, field: JointField::Theta | JointField::D }
                if own + 1 == joint);
            is_coordinate && term.of == Quantity::Command(from - 1)
        };
        if let Some(tried) = best(&fit, &linearised, &smooth_terms, data.rules, here)
            && tried.criterion + data.rules.beyond_doubt < explained
        {
            return Some((tried.smooth_term, rest));
        }
    }
    None
}

/// The strongest structure that is left, at the place and of the quantity of `known` if there is one; none where it is not
/// beyond chance.
pub(super) fn strongest(fitted: &Fitted, data: &Data, known: Option<&SmoothTerm>) -> Option<Tried> {
    let smooth_terms = SmoothTerm::all(&fitted.problem, data);
    let linearised = fitted.linearised_at(data, &data.thinned(data.rules.placing_poses), &[], &smooth_terms);
    let is_wanted = |term: &SmoothTerm| known.is_none_or(|known| (term.slot, term.of) == (known.slot, known.of));
    let tried = best(&fitted.neighbourhood(&linearised, &[]), &linearised, &smooth_terms, data.rules, is_wanted)?;
    (tried.corrected < data.rules.level && tried.criterion < 0.0).then_some(tried)
}

/// What is known of the strongest structure that is left, as in [`strongest`].
pub(super) fn localise(fitted: &Fitted, data: &Data, known: Option<&SmoothTerm>) -> Option<Unexplained> {
    let Tried { smooth_term, corrected, .. } = strongest(fitted, data, known)?;
    let linearised = fitted.linearised(data, &[], std::slice::from_ref(&smooth_term));
    let fit = fitted.neighbourhood(&linearised, &[]);
    let with = fit.with(&smooth_term.columns(&linearised));
    let rms = |squares: f64| (3.0 * squares / fit.rows() as f64).sqrt() * fitted.sigma;
    let validated = fit.cross_validate(&data.block).zip(with.cross_validate(&data.block));
    let correction = validated
        .map(|(without, with)| (rms(without), rms(with)))
        .filter(|(without, with)| *with < data.rules.worthwhile * without)
        .map(|validated| correct(fitted, data, (&smooth_term, &linearised, &with), validated));
    let depends_on = vec![Covariate::of(smooth_term.of, data.measurements.time_measured)];
    Some(Unexplained { place: smooth_term.place(), depends_on, p_value: corrected, correction })
}

/// Structure that the residual tests see and no place or quantity shows.
pub(super) fn nowhere(findings: &Findings) -> Option<Unexplained> {
    if !findings.is_structured() {
        return None;
    }
    let strongest = findings.strongest()?;
    Some(Unexplained {
        place: Place::Nowhere,
        depends_on: strongest.about().into_iter().collect(),
        p_value: strongest.outcome.as_ref().map_or(1.0, |outcome| outcome.p_value),
        correction: None,
    })
}

/// The correction that the neighbourhood `with` its columns has, applied to the held-out poses.
fn correct(
    fitted: &Fitted,
    data: &Data,
    (smooth_term, linearised, with): (&SmoothTerm, &Linearised, &LinearNeighbourhood),
    cross_validated: (f64, f64),
) -> Correction {
    let step = with.step();
    let count = smooth_term.functions.len();
    let (parameters, coefficients) = (step.rows(0, step.len() - count), step.rows_range(step.len() - count..));
    let change = |at: &Linearised| at.fitted() * parameters + smooth_term.columns(at) * coefficients;
    let held_out = fitted.linearised_at(data, &data.split.held_out, &[], std::slice::from_ref(smooth_term));
    let moved = change(&held_out);
    let mut errors = fitted.errors(data, &data.split.held_out);
    let mut beyond = 0;
    for (k, (pose, error)) in held_out.poses().iter().zip(&mut errors).enumerate() {
        if smooth_term.reaches(&pose.setup) {
            *error += moved.fixed_rows::<3>(3 * k) * pose.sigma;
        } else {
            beyond += 1;
        }
    }
    let left = linearised.residual() + change(linearised);
    let lever = linearised.place(smooth_term.slot).unwrap_or_else(|| DVector::zeros(left.len()));
    let point = |(k, pose): (usize, &Pose)| {
        // Both in σ; r = measured − predicted, so that the lever is −∂r/∂(coordinate).
        let (lever, left) = (-lever.fixed_rows::<3>(3 * k), left.fixed_rows::<3>(3 * k));
        let covariate = smooth_term.of.value(&pose.setup);
        let value = smooth_term.at(coefficients.as_slice(), covariate) + lever.dot(&left) / lever.norm_squared();
        PartialResidual { row: data.rows()[k], covariate, value, lever: lever.norm() * pose.sigma }
    };
    Correction {
        covariate: Covariate::of(smooth_term.of, data.measurements.time_measured),
        slot: smooth_term.slot,
        unit: smooth_term.slot.unit(),
        range: smooth_term.range,
        beyond,
        cross_validated,
        held_out: ErrorSummary::of(&errors),
        curve: smooth_term.curve(coefficients.as_slice()),
        points: linearised.poses().iter().enumerate().map(point).collect(),
    }
}
