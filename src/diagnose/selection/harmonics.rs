//! Waves of joints, once many were found: all orders, with one prior.
//!
//! Where a joint covers part of its turn, waves of neighbouring orders hardly differ there. Which of them are picked is chance;
//! they cancel where it was measured and part beyond. With every order in the model and a prior that holds all of them down,
//! what is predicted fades out where nothing was measured. The prior's σ is the one that predicts best what is left out where
//! whole parts of a joint's range are.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::candidates::joined;
use super::super::data::Data;
use super::super::fitted::{Fitted, with_smooth_terms};
use super::super::smooth_term::SmoothTerm;
use super::pick::LEAVING;
use super::retest::Retested;
use super::rounds::Rounds;
use crate::identify::IdentifyError;
use crate::model::effect;
use crate::model::parameter::{Driver, EffectParameter, rule_of};
use crate::problem::{Effect, Freedom, ParameterRule, Problem, Quantities};
use crate::quantity::Unit;

/// Coefficients from which on they have a scale of their own.
const MANY: usize = 20;
/// Orders of a joint from which on all up to the highest of them are put in.
const SEVERAL: usize = 3;
/// Parts of each joint's range that are left out in turn.
const PARTS: usize = 5;
/// Scales that are tried, as powers of two of the root mean square of what was found.
const SCALES: std::ops::RangeInclusive<i32> = -8..=2;
/// Part of a column's own square that holds what nothing sees where it is.
const HELD: f64 = 1e-10;
/// Pattern of the rule that gives all waves of joints one prior.
pub const HARMONICS: &str = "joint-harmonic.*";

/// The fit with every order of the joints whose waves are many, and 1 σ of their prior [rad]; the fit, settled, where they
/// are few or no common prior can hold them.
pub(super) fn filled(rounds: &Rounds, fitted: Fitted) -> Result<(Fitted, Option<f64>), IdentifyError> {
    let waves = waves(&fitted);
    let more: Vec<Effect> = rounds.added(&fitted).into_iter().map(|own| all_orders(own, &rounds.declared)).collect();
    let effects = more.iter().fold(rounds.declared.clone(), |all, own| joined(&all, own));
    let dense = fitted.with_effects(&effects);
    if waves.len() < MANY || !rounds.has_many_poses() || !takes_prior(&dense) {
        return Ok((rounds.settled(fitted)?, None));
    }
    let squares: f64 = waves.iter().map(|&j| fitted.found.x[fitted.unknowns[j]].powi(2)).sum();
    let found = (squares / waves.len() as f64).sqrt();
    let first = rounds.fit_few(with_scale(dense.clone(), found), &fitted)?;
    let scale = best_scale(&first, rounds.data, &rounds.smooth_terms, found);
    let mut filled = rounds.fit_whole(with_scale(dense, scale), &first)?;
    // What more waves explain need not be explained by anything else.
    loop {
        let tested = rounds.tested(&filled);
        let leaves = |tested: &&Retested| tested.p >= LEAVING && !matches!(tested.effect, Effect::JointHarmonic { .. });
        let leaving: Vec<&Effect> = tested.iter().filter(leaves).map(|tested| &tested.effect).collect();
        if leaving.is_empty() {
            return Ok((filled, Some(scale)));
        }
        let kept = rounds.added(&filled).into_iter().filter(|own| !leaving.contains(&own));
        let effects = kept.fold(rounds.declared.clone(), |all, own| joined(&all, &own));
        filled = rounds.fit_whole(filled.with_effects(&effects), &filled)?;
    }
}

fn is_wave(driver: Driver) -> bool {
    matches!(driver, Driver::Sine(..) | Driver::Cosine(..))
}

/// Places of the coefficients of waves among the unknowns.
fn waves(fitted: &Fitted) -> Vec<usize> {
    let driver = |j: usize| fitted.model.parameters[fitted.unknowns[j]].driver;
    (0..fitted.unknowns.len()).filter(|&j| is_wave(driver(j))).collect()
}

/// Whether one prior in angles can hold all waves of a problem: none is of a joint that slides, and no rule speaks of any.
fn takes_prior(problem: &Problem) -> bool {
    let takes = |own: &EffectParameter| own.unit() == Unit::Angle && rule_of(problem, own).is_none();
    effect::parameters(problem).iter().filter(|own| is_wave(own.driver)).all(takes)
}

/// Several orders of a joint that were found become all of them up to the highest but those declared.
fn all_orders(effect: Effect, declared: &[Effect]) -> Effect {
    match effect {
        Effect::JointHarmonic { joint, orders } if orders.len() >= SEVERAL => {
            let highest = orders.into_iter().max().unwrap_or(1);
            let is_known = |&order: &u32| {
                let wave = Effect::JointHarmonic { joint, orders: vec![order] };
                declared.iter().any(|known| known.covers(&wave))
            };
            Effect::JointHarmonic { joint, orders: (1..=highest).filter(|order| !is_known(order)).collect() }
        }
        other => other,
    }
}

/// The problem with a prior for all waves.
fn with_scale(mut problem: Problem, sigma: f64) -> Problem {
    problem.parameters.push(ParameterRule {
        pattern: HARMONICS.to_owned(),
        freedom: Freedom::Free {
            sigma: Quantities { angle: Some(sigma), ..Quantities::default() },
            min: Quantities::default(),
            max: Quantities::default(),
        },
        location: problem.data.location.clone(),
    });
    problem
}

/// A part of the data in sums: JᵀJ, Jᵀr, rᵀr and its number of rows.
struct Part {
    gram: DMatrix<f64>,
    product: DVector<f64>,
    squares: f64,
    rows: usize,
}

/// The scale [rad] of the prior on waves with which parts of the joints' ranges that are left out are
/// predicted best, in the linear neighbourhood of the fit.
fn best_scale(fitted: &Fitted, data: &Data, smooth_terms: &[SmoothTerm], found: f64) -> f64 {
    let waves = waves(fitted);
    let library = fitted.library(data, &[], smooth_terms);
    let (columns, residual) = (with_smooth_terms(&library, smooth_terms), library.residual());
    let part = |poses: &Vec<usize>| {
        let rows: Vec<usize> = poses.iter().flat_map(|pose| 3 * pose..3 * pose + 3).collect();
        let (j, r) = (columns.select_rows(&rows), residual.select_rows(&rows));
        Part { gram: j.transpose() * &j, product: j.tr_mul(&r), squares: r.norm_squared(), rows: rows.len() }
    };
    let whole = part(&(0..data.rows().len()).collect());
    let parts: Vec<Part> = parts_of_ranges(&fitted.problem, data).par_iter().map(part).collect();
    let n = columns.ncols();
    let at = |j: usize| fitted.unknowns.get(j).map_or(0.0, |&k| fitted.found.x[k]);
    let sigma = |j: usize| match fitted.unknowns.get(j) {
        Some(&k) => fitted.model.parameters[k].sigma,
        None => library.let_go().get(j - fitted.unknowns.len()).copied().flatten(),
    };
    let weights: Vec<f64> = (0..n).map(|j| sigma(j).map_or(0.0, |sigma| sigma.powi(-2))).collect();
    let error = |scale: f64| -> f64 {
        let mut weights = weights.clone();
        for &j in &waves {
            weights[j] = scale.powi(-2);
        }
        let left_out = |part: &Part| {
            let mut normal = &whole.gram - &part.gram;
            let mut pull = &whole.product - &part.product;
            for j in 0..n {
                normal[(j, j)] += weights[j] + HELD * whole.gram[(j, j)] + f64::MIN_POSITIVE;
                pull[j] += weights[j] * at(j);
            }
            let step = -normal.cholesky()?.solve(&pull);
            let squares = part.squares + 2.0 * part.product.dot(&step) + step.dot(&(&part.gram * &step));
            Some(part.rows as f64 * (squares / part.rows as f64).ln())
        };
        let all: Option<Vec<f64>> = parts.par_iter().map(left_out).collect();
        all.map_or(f64::INFINITY, |all| all.iter().sum())
    };
    let tried: Vec<_> = SCALES.map(|power| found * 2.0_f64.powi(power)).map(|scale| (scale, error(scale))).collect();
    tried
        .into_iter()
        .filter(|(_, error)| error.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(found, |(scale, _)| scale)
}

/// Identification poses in each part of the range of each joint that moves, as many in each.
fn parts_of_ranges(problem: &Problem, data: &Data) -> Vec<Vec<usize>> {
    let (rows, conditions) = (data.rows(), data.conditions(problem));
    let coordinate = |pose: usize, joint: usize| data.measurements.configuration(rows[pose])[joint];
    let of_joint = |joint: usize| {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|&a, &b| coordinate(a, joint).total_cmp(&coordinate(b, joint)));
        order.chunks(rows.len().div_ceil(PARTS).max(1)).map(<[usize]>::to_vec).collect::<Vec<_>>()
    };
    (0..data.measurements.joints).filter(|&joint| conditions.moves(joint)).flat_map(of_joint).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_rule_of_their_own_or_a_slide_keeps_waves_from_the_common_prior() {
        let takes = |kind: &str, rule: &str| {
            let text = format!(
                "name = 'arm'\n[[joint]]\n[[joint]]\nkind = '{kind}'\n[[effect]]\njoint-harmonic = {{ joint = 1, orders = [1, 2] }}\n\
                 [[effect]]\njoint-harmonic = {{ joint = 2, orders = [3] }}\n[parameters]\n'joint*.theta' = {{ free = true }}\n{rule}"
            );
            takes_prior(&Problem::parse(&text, Path::new("problem.toml")).unwrap())
        };
        assert!(takes("revolute", "") && takes("revolute", "'*.sin*' = { sigma_mm = 1 }"));
        assert!(!takes("prismatic", ""));
        for rule in [
            "'joint-harmonic.*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[2].*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[1].sin2' = { fixed = true }",
            "'*.cos3' = { free = true }",
        ] {
            assert!(!takes("revolute", rule), "{rule}");
        }
    }
}
