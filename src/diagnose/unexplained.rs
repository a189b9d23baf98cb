//! Structure that no effect of the catalogue explains: where it is, what it depends on, and what a smooth correction gains.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::data::Data;
use super::fitted::{Fitted, with_generics};
use super::generic::Generic;
use super::neighbourhood::{Gain, Linear, tries};
use super::residual_tests::Findings;
use crate::identify::ErrorSummary;
use crate::model::effect;
use crate::model::parameter::{JointField, Quantity, Slot};
use crate::problem::Effect;

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
    /// `joint 2`, `link before joint 3`, or `nowhere in particular`.
    pub place: String,
    /// `q2`, `temperature`, …: what it depends on.
    pub depends_on: Vec<String>,
    /// Probability that it is chance, corrected for the places and quantities tried.
    pub p_value: f64,
    /// What an empirical correction gains; `None` where it takes less than 5 % off the error of poses that were left out.
    pub correction: Option<Correction>,
}

/// A smooth correction of one place's error as a function of one quantity.
#[derive(Debug, Clone)]
pub struct Correction {
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
}

/// A generic with its gain.
pub(super) struct Tried {
    pub generic: Generic,
    pub gain: Gain,
    /// The criterion with 2 ln(places and quantities tried).
    pub criterion: f64,
    /// p times their number.
    pub corrected: f64,
}

/// The best of some generics against a fit.
pub(super) fn best(
    linear: &Linear,
    library: &super::neighbourhood::Library,
    generics: &[Generic],
    wanted: impl Fn(&Generic) -> bool,
) -> Option<Tried> {
    // Half of the chance for splines, half for single bumps and steps; an equal part for each place and quantity.
    let mut places: Vec<(Slot, Quantity)> = Vec::new();
    for generic in generics {
        if !places.contains(&(generic.slot, generic.of)) {
            places.push((generic.slot, generic.of));
        }
    }
    let score = |generic: &Generic| linear.score(&generic.columns(library));
    let tried = |generic: Generic| {
        let gain = linear.sums().gain(&score(&generic))?;
        let (squares, freedom) = (gain.squares, gain.freedom + generic.fitted);
        let gain = linear.sums().gain_of(squares, freedom)?;
        let count = 2.0 * (places.len() * generic.tries) as f64;
        let (criterion, corrected) = (gain.criterion + 2.0 * count.ln(), (gain.p * count).min(1.0));
        Some(Tried { generic, gain, criterion, corrected })
    };
    // Splines everywhere; single bumps and steps where splines find most.
    let wanted: Vec<&Generic> = generics.iter().filter(|generic| wanted(generic)).collect();
    let (single, splines): (Vec<&Generic>, Vec<&Generic>) = wanted.iter().partition(|g| g.functions.len() == 1);
    let mut all: Vec<Tried> = splines.into_par_iter().filter_map(|generic| tried(generic.clone())).collect();
    all.sort_by(|a, b| a.gain.criterion.total_cmp(&b.gain.criterion));
    let near: Vec<(Slot, Quantity)> = all.iter().take(PROMISING).map(|t| (t.generic.slot, t.generic.of)).collect();
    let promising = |generic: &&&Generic| near.is_empty() || near.contains(&(generic.slot, generic.of));
    let single: Vec<&Generic> = single.iter().filter(promising).copied().collect();
    all.extend(single.into_par_iter().filter_map(|generic| tried(generic.clone())).collect::<Vec<_>>());
    all.sort_by(|a, b| a.gain.criterion.total_cmp(&b.gain.criterion));
    let shapes: Vec<Generic> =
        all.iter().map(|tried| &tried.generic).filter(|g| g.functions.len() == 1).take(REFINED).cloned().collect();
    let squares = |generic: &Generic| linear.sums().gain(&score(generic)).map_or(0.0, |gain| gain.squares);
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
) -> Option<(Generic, Vec<Effect>)> {
    let generics = Generic::all(&fitted.problem, data);
    let library = fitted.library(data, &[], &generics);
    let everything: Vec<Effect> =
        candidates.iter().cloned().chain(added.iter().flat_map(super::candidates::parts)).collect();
    let (all_tries, families) = tries(&everything);
    let search = |effect: &Effect| {
        let parts = super::candidates::parts(effect).into_iter();
        parts
            .map(|part| {
                let known = everything.iter().position(|other| *other == part);
                2.0 * (known.map_or(1.0, |index| all_tries[index]) * families as f64).ln()
            })
            .sum::<f64>()
    };
    let mut places: Vec<(usize, usize)> = added.iter().filter_map(function_of).collect();
    places.sort_unstable();
    places.dedup();
    for (joint, from) in places {
        let (own, rest): (Vec<Effect>, Vec<Effect>) =
            added.iter().cloned().partition(|effect| function_of(effect) == Some((joint, from)));
        let parameters: Vec<usize> = own.iter().flat_map(|effect| fitted.parameters_of(effect)).collect();
        let linear = fitted.linear(&library, &parameters, &[]);
        let explained = linear.sums().gain(&linear.score(&fitted.columns(&library, &parameters)));
        let explained = explained.map_or(0.0, |gain| gain.criterion + own.iter().map(search).sum::<f64>());
        let here = |generic: &Generic| {
            let coordinate = matches!(generic.slot, Slot::Joint { joint: own, field: JointField::Theta | JointField::D }
                if own + 1 == joint);
            coordinate && generic.of == Quantity::Command(from - 1)
        };
        if let Some(tried) = best(&linear, &library, &generics, here)
            && tried.criterion + BETTER < explained
        {
            return Some((tried.generic, rest));
        }
    }
    None
}

/// The joint at which an effect is a function of a command alone, and the joint commanded, both from 1.
fn function_of(effect: &Effect) -> Option<(usize, usize)> {
    match effect {
        Effect::JointHarmonic { joint, .. } | Effect::GearRatio { joint } => Some((*joint, *joint)),
        Effect::JointCoupling { joint, from } => Some((*joint, *from)),
        _ => None,
    }
}

/// The strongest structure that is left, if it is beyond chance.
pub(super) fn strongest(fitted: &Fitted, data: &Data, level: f64) -> Option<Generic> {
    let generics = Generic::all(&fitted.problem, data);
    let library = fitted.library_of(data, &data.thinned(ENOUGH), &[], &generics);
    let tried = best(&fitted.linear(&library, &[], &[]), &library, &generics, |_| true)?;
    (tried.corrected < level && tried.criterion < 0.0).then_some(tried.generic)
}

/// What is known of structure at a generic, or of the strongest one where `known` is none; `level` is that of chance.
pub(super) fn localise(fitted: &Fitted, data: &Data, known: Option<&Generic>, level: f64) -> Option<Unexplained> {
    let generics = Generic::all(&fitted.problem, data);
    let library = fitted.library_of(data, &data.thinned(ENOUGH), &[], &generics);
    let linear = fitted.linear(&library, &[], &[]);
    let tried = match known {
        None => best(&linear, &library, &generics, |_| true),
        Some(known) => {
            best(&linear, &library, &generics, |generic| generic.slot == known.slot && generic.of == known.of)
        }
    }?;
    if tried.corrected >= level || tried.criterion >= 0.0 {
        return None;
    }
    let Tried { generic, corrected, gain, .. } = tried;
    debug_assert!(gain.freedom > 0);
    let library = fitted.library(data, &[], std::slice::from_ref(&generic));
    let linear = fitted.linear(&library, &[], &[]);
    let mut with = linear.clone();
    with.add(&generic.columns(&library));
    let coordinates = linear.rows() as f64;
    let rms = |squares: f64| (3.0 * squares / coordinates).sqrt() * fitted.sigma;
    let validated = linear.cross_validate(&data.block).zip(with.cross_validate(&data.block));
    let correction = validated
        .map(|(without, with)| (rms(without), rms(with)))
        .filter(|(without, with)| *with < WORTHWHILE * without)
        .map(|validated| correct(fitted, data, &generic, validated));
    let depends_on = match generic.of {
        // Without a column for it, the order of the rows stands for time.
        Quantity::Elapsed if !data.measurements.time_measured => "row".to_owned(),
        _ => generic.depends_on(),
    };
    Some(Unexplained { place: generic.place(), depends_on: vec![depends_on], p_value: corrected, correction })
}

/// Structure that the checks see and no place or quantity shows.
pub(super) fn nowhere(findings: &Findings) -> Option<Unexplained> {
    if !findings.is_structured() {
        return None;
    }
    let strongest = findings.strongest()?;
    Some(Unexplained {
        place: "nowhere in particular".to_owned(),
        depends_on: strongest.about().map(str::to_owned).into_iter().collect(),
        p_value: strongest.outcome.as_ref().map_or(1.0, |outcome| outcome.p_value),
        correction: None,
    })
}

/// Fits the correction together with all parameters, in the linear neighbourhood, and applies it to the held-out poses.
fn correct(fitted: &Fitted, data: &Data, generic: &Generic, cross_validated: (f64, f64)) -> Correction {
    let generics = std::slice::from_ref(generic);
    let library = fitted.library(data, &[], generics);
    let step = fitted.normal(&library, generics).step;
    let held_out = fitted.library_of(data, &data.split.held_out, &[], generics);
    let change = with_generics(&held_out, generics) * &step;
    let mut errors = fitted.errors(data, &data.split.held_out);
    let mut beyond = 0;
    for (k, (pose, error)) in held_out.poses().iter().zip(&mut errors).enumerate() {
        if generic.reaches(&pose.setup) {
            *error += Vector3::from_fn(|axis, _| change[3 * k + axis]) * pose.sigma;
        } else {
            beyond += 1;
        }
    }
    let count = generic.functions.len();
    let functions = step.rows(step.len() - count, count);
    Correction {
        range: generic.range,
        beyond,
        cross_validated,
        held_out: ErrorSummary::of(&errors),
        curve: generic.curve(functions.as_slice()),
    }
}

/// Name of an effect with its place, for people.
pub(super) fn named(effect: &Effect) -> String {
    let place = effect::place(effect);
    if place.is_empty() { effect::name(effect).to_owned() } else { format!("{} {place}", effect::name(effect)) }
}
