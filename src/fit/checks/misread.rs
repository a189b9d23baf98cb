//! Check whether units, signs, order and conventions of table and problem were declared rightly.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::contradicted_entry::exchanged_targets;
use super::finding::{Finding, FindingCode};
use super::misreading::{
    MAX_CLEAR_RATIO, MAX_NOISE_SIGMAS, error_with_priors, first_of, misread_masses,
};
use super::nominal_error::is_nominal_far_off;
use super::parameter_limits::within_priors;
use super::row_kind::format_error;

/// Smallest rms residual of the fit, as a multiple of the declared σ, for which misreadings of
/// table and problem are searched.
const MIN_SIGMAS: f64 = 10.0;
/// Smallest rms residual of the fit, relative to the spread of the points, for which misreadings
/// are searched if no σ is declared.
const MIN_PART: f64 = 0.01;

/// Smallest rms residual of the fit with the deviations from priors, as a multiple of the declared σ,
/// for which wrong masses and their places are searched on an arm that gives way.
const MIN_SIGMAS_OF_MASSES: f64 = 1.7;
/// Largest share of the variance beyond the noise that a corrected mass leaves.
const MAX_EXCESS_LEFT_BY_MASS: f64 = 0.04;
/// Standard deviations of χ² of noise, relative to its mean, that a corrected mass may leave in small
/// tables, and the largest share of the variance beyond the noise that this may be.
const CHANCE_SIGMAS: f64 = 2.33;
const MAX_CHANCE_LEFT_BY_MASS: f64 = 0.1;
/// Largest rms residual of a fit with a mass corrected, as a multiple of the declared σ, with which
/// the mass explains what a fit near the noise leaves.
const MAX_SIGMAS_LEFT_BY_MASS: f64 = 1.5;
/// Largest ratio of the rms residual of the fit as read to its error with the deviations from
/// priors, at which the text states the residual.
const MAX_PLAIN_PART: f64 = 0.8;

/// Largest deviation from 1 of a ratio of motion to command, or of a scale, that an arm or an
/// instrument may have, so that the remedy also names its effect.
pub(super) const MAX_RATIO_ERROR_OF_ARM: f64 = 0.03;

/// Largest ratio of the rms residual with strategy joint to that of the fit, at which the strategy
/// causes the residual, not the reading of table or problem.
const MAX_JOINT_RATIO: f64 = 0.2;

/// Checks that no misreading of table or problem (unit, sign, order, convention) explains the
/// measurements far better.
pub(super) fn read_as_meant(fit: &CheckedFit) -> Option<Finding> {
    let kind = fit.leading();
    let rms = fit.rms_at(&kind.rows, &fit.end.x);
    if let Some(names) = exchanged_targets(fit) {
        return Some(exchanged_finding(names, rms));
    }
    let limit = match kind.declared_sigma {
        Some(sigma) => MIN_SIGMAS * kind.observation.expected_norm() * sigma,
        None => MIN_PART * kind.spread,
    };
    let is_within_priors = within_priors(fit).is_none();
    let is_near = rms <= limit && is_within_priors && !is_nominal_far_off(fit);
    // A wrong mass, which an arm that gives way hides in other parameters, is an explanation
    // only if it leaves nothing but noise.
    let is_searched = fit.has_further_fits && kind.observation.is_position();
    let noise = kind.declared_sigma.filter(|_| is_searched);
    let noise = noise.map(|sigma| kind.observation.expected_norm() * sigma);
    // With few rows, the priors give way before the residual grows.
    let error = if fit.problem.is_elastic() { error_with_priors(fit).max(rms) } else { rms };
    let most_left = noise.filter(|noise| error > MIN_SIGMAS_OF_MASSES * noise).map(|noise| {
        let excess = (error / noise).powi(2) - 1.0;
        // Of few rows, chance alone may leave more.
        let chance = CHANCE_SIGMAS * (2.0 / (3.0 * kind.rows.len() as f64)).sqrt();
        let chance = chance.min(MAX_CHANCE_LEFT_BY_MASS * excess);
        let left = (1.0 + chance.max(MAX_EXCESS_LEFT_BY_MASS * excess)).sqrt();
        left.min(MAX_SIGMAS_LEFT_BY_MASS) * noise
    });
    let of_masses;
    let explanations = if is_near {
        let most_left = most_left?;
        fit.misread_masses(most_left)
    } else if let Some(most_left) = most_left.filter(|_| fit.explanations().fitted.is_empty()) {
        of_masses = misread_masses(fit, most_left, is_within_priors);
        &of_masses
    } else {
        fit.explanations()
    };
    let best = explanations.fitted.first()?;
    let joint = fit.joint_rms(&kind);
    if let Some(joint) = joint.filter(|joint| *joint < MAX_JOINT_RATIO * rms) {
        let numbers = [rms.into(), joint.into()];
        let [joint, rest] =
            [joint, rms].map(|error| format_error(kind.observation.kind(), error, 3));
        let strategy = fit.fitting.strategy.as_str();
        let text =
            format!("strategy {strategy} leaves an rms error of {rest}, strategy joint {joint}");
        return Some(Finding::new(FindingCode::StrategyMisfit, numbers, text));
    }
    let words: Vec<String> =
        explanations.fitted.iter().map(|explanation| explanation.words.clone()).collect();
    let name = kind.observation.kind();
    let is_noise = kind.declared_sigma.is_none_or(|sigma| {
        best.rms <= MAX_NOISE_SIGMAS * kind.observation.expected_norm() * sigma
    });
    let named = first_of(&words);
    let [rest, as_read] =
        [best.rms, explanations.as_read].map(|error| format_error(name, error, 3));
    let numbers = [json!(words), explanations.as_read.into(), best.rms.into()];
    let of_arm = best.effect.as_ref().filter(|(_, size)| size.abs() < MAX_RATIO_ERROR_OF_ARM);
    let found = |text: String| {
        let finding = Finding::new(FindingCode::Misread, numbers.clone(), text);
        let Some((effect, _)) = of_arm else { return finding };
        let remedy = format!(
            "{}; if nothing is wrong there, flexcal loop adds {}",
            finding.remedy,
            effect.declaration()
        );
        finding.with_remedy(remedy)
    };
    if is_noise {
        // Parameters far beyond their priors may fit the table as it was read.
        let instead = if rms < MAX_PLAIN_PART * explanations.as_read {
            let plain = format_error(name, rms, 3);
            format!(
                "{rest}; as read it is {plain}, but only with parameters far beyond their \
                 priors"
            )
        } else {
            format!("{rest} instead of {as_read} (the better of nominal and fitted arm)")
        };
        let text = format!(
            "the measurements fit if read in another way: with {named}, the rms error would be \
             {instead}"
        );
        return Some(found(text));
    }
    let is_clear = best.rms <= MAX_CLEAR_RATIO * explanations.as_read;
    if is_clear {
        let text = format!(
            "the measurements fit better if they are read in another way: with \
             {named}, the rms error would be {rest} (as read {as_read}). That is still \
             more than the declared σ: the model lacks something, or another mistake remains"
        );
        return Some(found(text));
    }
    // Another cause may leave as much.
    let text = format!(
        "the error of {as_read} has no explanation yet; it would fall to {rest}, which is \
         still more than the declared σ, with {named}"
    );
    let finding = found(text);
    let more = finding.remedy.split_once("; ").map_or("", |(_, more)| more);
    let mut remedy = "check that and what acts alike; the model may also lack something".to_owned();
    if !more.is_empty() {
        remedy = format!("{remedy}; {more}");
    }
    Some(finding.with_remedy(remedy))
}

/// Creates the finding that the `names` of two targets are exchanged, at the rms residual `rms`
/// \[m\] of the fit.
fn exchanged_finding(names: [&str; 2], rms: f64) -> Finding {
    let [one, other] = names;
    let words = format!("targets \"{one}\" and \"{other}\" that are exchanged");
    let text = format!(
        "of the targets \"{one}\" and \"{other}\", each is fitted where the other one is declared"
    );
    let numbers = [json!([words]), rms.into(), rms.into()];
    let remedy = "exchange their names in the column target, or in [[target]]";
    Finding::new(FindingCode::Misread, numbers, text).with_remedy(remedy)
}
