//! Structure that no effect of the catalogue explains: where it is, what it depends on, and what a smooth correction gains.

use nalgebra::{DVector, Vector3};
use rayon::prelude::*;

use super::covariate::{Covariate, Place};
use super::data::Data;
use super::fitted::{Fitted, with_smooth_terms};
use super::neighbourhood::{Gain, Library, Linear, tries};
use super::residual_tests::Findings;
use super::smooth_term::SmoothTerm;
use crate::identify::ErrorSummary;
use crate::model::Pose;
use crate::model::parameter::{JointField, Quantity, Slot};
use crate::problem::Effect;
use crate::quantity::Unit;

/// By how much a smooth function must be the better explanation to replace effects that depend on the same: odds of 20 to 1.
const BETTER: f64 = 6.0;

/// A correction without a cause is worth stating where it takes poses that were left out to this part of their rms error.
const WORTHWHILE: f64 = 0.95;
/// Poses that are enough to find a place.
const ENOUGH: usize = 1000;
/// Splines whose places and quantities are looked at for single bumps and steps.
const PROMISING: usize = 12;
/// Bumps and steps whose shape is fitted.
const REFINED: usize = 4;

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
    /// Root mean squared error of identification poses left out in turn, before and with the correction [m].
    pub cross_validated: (f64, f64),
    /// Error on held-out poses with the correction.
    pub held_out: ErrorSummary,
    /// The quantity and the correction of the place there [rad] or [m].
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
    /// Of the coordinate [rad] or [m].
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
    linear: &Linear,
    library: &Library,
    smooth_terms: &[SmoothTerm],
    wanted: impl Fn(&SmoothTerm) -> bool,
) -> Option<Tried> {
    // Half of the chance for splines, half for single bumps and steps; an equal part for each place and quantity.
    let mut places: Vec<(Slot, Quantity)> = Vec::new();
    for smooth_term in smooth_terms {
        if !places.contains(&(smooth_term.slot, smooth_term.of)) {
            places.push((smooth_term.slot, smooth_term.of));
        }
    }
    let score = |smooth_term: &SmoothTerm| linear.score(&smooth_term.columns(library));
    let tried = |smooth_term: SmoothTerm| {
        let gain = linear.sums().gain(&score(&smooth_term))?;
        let (squares, freedom) = (gain.squares, gain.freedom + smooth_term.fitted);
        let gain = linear.sums().gain_of(squares, freedom)?;
        let count = 2.0 * (places.len() * smooth_term.tries) as f64;
        let (criterion, corrected) = (gain.criterion + 2.0 * count.ln(), (gain.p * count).min(1.0));
        Some(Tried { smooth_term, gain, criterion, corrected })
    };
    // Splines everywhere; single bumps and steps where splines find most.
    let wanted: Vec<&SmoothTerm> = smooth_terms.iter().filter(|smooth_term| wanted(smooth_term)).collect();
    let (single, splines): (Vec<&SmoothTerm>, Vec<&SmoothTerm>) = wanted.iter().partition(|g| g.functions.len() == 1);
    let mut all: Vec<Tried> = splines.into_par_iter().filter_map(|smooth_term| tried(smooth_term.clone())).collect();
    all.sort_by(|a, b| a.gain.criterion.total_cmp(&b.gain.criterion));
    let near: Vec<(Slot, Quantity)> =
        all.iter().take(PROMISING).map(|t| (t.smooth_term.slot, t.smooth_term.of)).collect();
    let promising = |smooth_term: &&&SmoothTerm| near.is_empty() || near.contains(&(smooth_term.slot, smooth_term.of));
    let single: Vec<&SmoothTerm> = single.iter().filter(promising).copied().collect();
    all.extend(single.into_par_iter().filter_map(|smooth_term| tried(smooth_term.clone())).collect::<Vec<_>>());
    all.sort_by(|a, b| a.gain.criterion.total_cmp(&b.gain.criterion));
    let shapes: Vec<SmoothTerm> =
        all.iter().map(|tried| &tried.smooth_term).filter(|g| g.functions.len() == 1).take(REFINED).cloned().collect();
    let squares = |smooth_term: &SmoothTerm| linear.sums().gain(&score(smooth_term)).map_or(0.0, |gain| gain.squares);
    all.extend(shapes.into_iter().filter_map(|shape| tried(shape.refined(squares))));
    all.into_iter().min_by(|a, b| a.criterion.total_cmp(&b.criterion))
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
    let library = fitted.library(data, &[], &smooth_terms);
    let everything: Vec<Effect> = candidates.iter().cloned().chain(added.iter().flat_map(Effect::parts)).collect();
    let (all_tries, families) = tries(&everything);
    let search = |effect: &Effect| {
        let parts = effect.parts().into_iter();
        parts
            .map(|part| {
                let known = everything.iter().position(|other| *other == part);
                2.0 * (known.map_or(1.0, |index| all_tries[index]) * families as f64).ln()
            })
            .sum::<f64>()
    };
    let mut places: Vec<(usize, usize)> = added.iter().filter_map(Effect::function_of).collect();
    places.sort_unstable();
    places.dedup();
    for (joint, from) in places {
        let (own, rest): (Vec<Effect>, Vec<Effect>) =
            added.iter().cloned().partition(|effect| effect.function_of() == Some((joint, from)));
        let parameters: Vec<usize> = own.iter().flat_map(|effect| fitted.parameters_of(effect)).collect();
        let linear = fitted.linear(&library, &parameters, &[]);
        let explained = linear.sums().gain(&linear.score(&fitted.columns(&library, &parameters)));
        let explained = explained.map_or(0.0, |gain| gain.criterion + own.iter().map(search).sum::<f64>());
        let here = |smooth_term: &SmoothTerm| {
            let coordinate = matches!(smooth_term.slot, Slot::Joint { joint: own, field: JointField::Theta | JointField::D }
                if own + 1 == joint);
            coordinate && smooth_term.of == Quantity::Command(from - 1)
        };
        if let Some(tried) = best(&linear, &library, &smooth_terms, here)
            && tried.criterion + BETTER < explained
        {
            return Some((tried.smooth_term, rest));
        }
    }
    None
}

/// The strongest structure that is left, if it is beyond chance.
pub(super) fn strongest(fitted: &Fitted, data: &Data, level: f64) -> Option<SmoothTerm> {
    let smooth_terms = SmoothTerm::all(&fitted.problem, data);
    let library = fitted.library_of(data, &data.thinned(ENOUGH), &[], &smooth_terms);
    let tried = best(&fitted.linear(&library, &[], &[]), &library, &smooth_terms, |_| true)?;
    (tried.corrected < level && tried.criterion < 0.0).then_some(tried.smooth_term)
}

/// What is known of structure at a smooth term, or of the strongest one where `known` is none; `level` is that of chance.
pub(super) fn localise(fitted: &Fitted, data: &Data, known: Option<&SmoothTerm>, level: f64) -> Option<Unexplained> {
    let smooth_terms = SmoothTerm::all(&fitted.problem, data);
    let library = fitted.library_of(data, &data.thinned(ENOUGH), &[], &smooth_terms);
    let linear = fitted.linear(&library, &[], &[]);
    let tried = match known {
        None => best(&linear, &library, &smooth_terms, |_| true),
        Some(known) => best(&linear, &library, &smooth_terms, |smooth_term| {
            smooth_term.slot == known.slot && smooth_term.of == known.of
        }),
    }?;
    if tried.corrected >= level || tried.criterion >= 0.0 {
        return None;
    }
    let Tried { smooth_term, corrected, gain, .. } = tried;
    debug_assert!(gain.freedom > 0);
    let library = fitted.library(data, &[], std::slice::from_ref(&smooth_term));
    let linear = fitted.linear(&library, &[], &[]);
    let mut with = linear.clone();
    with.add(&smooth_term.columns(&library));
    let coordinates = linear.rows() as f64;
    let rms = |squares: f64| (3.0 * squares / coordinates).sqrt() * fitted.sigma;
    let validated = linear.cross_validate(&data.block).zip(with.cross_validate(&data.block));
    let correction = validated
        .map(|(without, with)| (rms(without), rms(with)))
        .filter(|(without, with)| *with < WORTHWHILE * without)
        .map(|validated| correct(fitted, data, &smooth_term, validated));
    let depends_on = vec![Covariate::of(smooth_term.of, data.measurements.time_measured)];
    Some(Unexplained { place: smooth_term.place(), depends_on, p_value: corrected, correction })
}

/// Structure that the checks see and no place or quantity shows.
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

/// Fits the correction together with all parameters, in the linear neighbourhood, and applies it to the held-out poses.
fn correct(fitted: &Fitted, data: &Data, smooth_term: &SmoothTerm, cross_validated: (f64, f64)) -> Correction {
    let smooth_terms = std::slice::from_ref(smooth_term);
    let library = fitted.library(data, &[], smooth_terms);
    let step = fitted.normal(&library, smooth_terms).step;
    let coefficients = step.rows(step.len() - smooth_term.functions.len(), smooth_term.functions.len());
    let held_out = fitted.library_of(data, &data.split.held_out, &[], smooth_terms);
    let change = with_smooth_terms(&held_out, smooth_terms) * &step;
    let mut errors = fitted.errors(data, &data.split.held_out);
    let mut beyond = 0;
    for (k, (pose, error)) in held_out.poses().iter().zip(&mut errors).enumerate() {
        if smooth_term.reaches(&pose.setup) {
            *error += Vector3::from_fn(|axis, _| change[3 * k + axis]) * pose.sigma;
        } else {
            beyond += 1;
        }
    }
    Correction {
        covariate: Covariate::of(smooth_term.of, data.measurements.time_measured),
        slot: smooth_term.slot,
        unit: smooth_term.slot.unit(),
        range: smooth_term.range,
        beyond,
        cross_validated,
        held_out: ErrorSummary::of(&errors),
        curve: smooth_term.curve(coefficients.as_slice()),
        points: partial_residuals(data, &library, smooth_term, (&step, coefficients.as_slice())),
    }
}

/// The partial residual of every identification pose, after the `step` of all parameters, the term's own coefficients last.
fn partial_residuals(
    data: &Data,
    library: &Library,
    smooth_term: &SmoothTerm,
    (step, coefficients): (&DVector<f64>, &[f64]),
) -> Vec<PartialResidual> {
    let Some(column) = library.place(smooth_term.slot) else { return Vec::new() };
    let left = library.residual() + with_smooth_terms(library, std::slice::from_ref(smooth_term)) * step;
    let point = |(k, pose): (usize, &Pose)| {
        // Both are in σ; r = measured − predicted, so that the lever is −∂r/∂(coordinate).
        let (lever, left) = (-column.fixed_rows::<3>(3 * k), left.fixed_rows::<3>(3 * k));
        let covariate = smooth_term.of.value(&pose.setup);
        let value = smooth_term.at(coefficients, covariate) + lever.dot(&left) / lever.norm_squared();
        PartialResidual { row: data.rows()[k], covariate, value, lever: lever.norm() * pose.sigma }
    };
    library.poses().iter().enumerate().map(point).collect()
}
