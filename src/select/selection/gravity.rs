//! Gravity along another axis of the base than the problem declares, where joints that give way to
//! loads would explain what is left.

use std::cell::OnceCell;

use nalgebra::Vector3;
use serde_json::json;

use super::state::SearchState;
use crate::fit::{Finding, FindingCode, Options};
use crate::problem::{Effect, Problem};
use crate::quantity::format::mm;
use crate::select::candidates::Candidates;
use crate::select::fitted::Fitted;
use crate::select::left_out_gain::LeftOutGain;

/// Largest number of fits of the search: provisional and complete ones, with gravity as declared (also
/// without compliances that it contradicts) and along each axis in both directions.
const TRIALS: usize = 15;
/// Maximum number of steps of a provisional fit. In the right direction, a few steps show the gain.
const MAX_PROVISIONAL_STEPS: u64 = 40;
/// Smallest cosine of the angle between two directions of gravity that count as one.
const SAME_DIRECTION: f64 = 0.99;
/// Smallest ln of the odds by which another direction of gravity must predict left-out poses better
/// than the declared one.
const LN_ODDS_OF_DIRECTION: f64 = 3.0;
/// ln of the odds by which the final fit of a search must predict left-out poses better to exclude
/// another direction of gravity: ln 1000, because formulas are chosen among thousands by how well
/// they fit, and the direction among six.
const LN_ODDS_OF_FORMULAS: f64 = 6.9;
/// Smallest ratio of a joint's compliance to its standard error at which the joint gives way.
const MIN_COMPLIANCE_SIGMAS: f64 = 5.0;
/// Number of standard errors below zero at which a compliance shows that gravity acts otherwise.
const MAX_NEGATIVE_SIGMAS: f64 = 3.0;

/// Returns the finding that gravity acts along another axis of the base than declared; `None` if
/// joints that give way to it do not explain what the search leaves to formulas.
///
/// For each direction, the effects of the `end` of the search are fitted again, with a compliance
/// of every joint in place of composed laws. Left-out poses must be predicted far better than by the
/// same with the declared gravity, and not clearly worse than by the end of the search. A joint that gives
/// way against its load shows a wrong direction. With the opposite of gravity, joints do so and fit as
/// well: the declared gravity is therefore compared without the compliances of such joints.
/// Provisional fits show which directions need a complete one.
pub(super) fn other_gravity(
    state: &SearchState,
    declared: &Fitted,
    end: &Fitted,
) -> Option<Finding> {
    let data = state.data;
    let is_compliance = |effect: &Effect| matches!(effect, Effect::JointCompliance { .. });
    let mut others: Vec<Effect> = state.added(end);
    others.retain(|effect| !effect.is_composed() && !is_compliance(effect));
    let testable = Candidates::new(&declared.problem, data).testable;
    let compliances: Vec<Effect> = testable.into_iter().filter(is_compliance).collect();
    let unknowns = end.unknowns.len() + compliances.len();
    if compliances.is_empty() || state.affordable_fits(unknowns) < TRIALS {
        return None;
    }
    let with = |gravity: Vector3<f64>, compliances: &[Effect], provisional: bool| {
        let effects = [others.as_slice(), compliances].concat();
        let problem = Problem { gravity, ..state.problem(declared, &effects) };
        let options = declared.warm_started_options(state.options, true);
        let few = || options.max_steps.unwrap_or(u64::MAX).min(MAX_PROVISIONAL_STEPS);
        let max_steps = if provisional { Some(few()) } else { options.max_steps };
        declared.fit_other(problem, data, &Options { max_steps, provisional, ..options }).ok()
    };
    let as_declared = declared.problem.gravity;
    let first = with(as_declared, &compliances, true)?;
    let upwards = giving_way(&first, &compliances, -MAX_NEGATIVE_SIGMAS);
    let mut others_give_way = compliances.clone();
    others_give_way.retain(|compliance| !upwards.contains(compliance));
    let first = if upwards.is_empty() { first } else { with(as_declared, &others_give_way, true)? };
    let known = OnceCell::new();
    let known = || known.get_or_init(|| with(as_declared, &others_give_way, false)).as_ref();
    let ln_odds = |fitted: &Fitted, known: &Fitted| {
        let gain = LeftOutGain::new(fitted, known, data)?;
        gain.is_significant().then(|| gain.ln_odds(fitted.sigma))
    };
    let directions = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]);
    let trials = directions.filter_map(|(axis, sign)| {
        let gravity = Vector3::ith(axis, sign * as_declared.norm());
        if gravity.dot(&as_declared) > SAME_DIRECTION * as_declared.norm_squared() {
            return None;
        }
        let fitted = with(gravity, &compliances, true)?;
        let soft = giving_way(&fitted, &compliances, MIN_COMPLIANCE_SIGMAS);
        let is_sound = giving_way(&fitted, &compliances, -MAX_NEGATIVE_SIGMAS).is_empty();
        if soft.is_empty() || !is_sound || ln_odds(&fitted, &first)? <= LN_ODDS_OF_DIRECTION {
            return None;
        }
        // Joints that do not give way would only add to the uncertainty.
        let fitted = with(gravity, &soft, false)?;
        let odds = ln_odds(&fitted, known()?)?;
        let all_give_way = giving_way(&fitted, &soft, MIN_COMPLIANCE_SIGMAS).len() == soft.len();
        (all_give_way && odds > LN_ODDS_OF_DIRECTION).then_some((odds, gravity, fitted, soft))
    });
    let (_, gravity, best, soft) = trials.max_by(|one, other| one.0.total_cmp(&other.0))?;
    let against = LeftOutGain::new(end, &best, data)?.ln_odds(best.sigma.min(end.sigma));
    if against > LN_ODDS_OF_FORMULAS {
        return None;
    }
    let axes: Vec<String> = gravity.iter().map(ToString::to_string).collect();
    let words = format!("gravity_m_s2 = [{}]", axes.join(", "));
    let error = |fitted: &Fitted| fitted.found.fitted.identification.rms.norm;
    let (as_read, rest) = (error(known()?), error(&best));
    let is_opposite = gravity.dot(&as_declared) < -SAME_DIRECTION * as_declared.norm_squared();
    let other = if is_opposite { "the other way" } else { "along another axis of the base" };
    let as_declared = if upwards.is_empty() {
        format!("as declared it is {} mm", mm(as_read, 3))
    } else {
        format!(
            "with gravity as declared, {} would have to rise under {} load, and without that it \
             is {} mm",
            joints_in_words(&upwards),
            if upwards.len() == 1 { "its" } else { "their" },
            mm(as_read, 3)
        )
    };
    let text = format!(
        "the measurements fit if gravity acts {other}: with {words} and {} giving way to the \
         loads, the rms error would be {} mm; {as_declared}",
        joints_in_words(&soft),
        mm(rest, 3)
    );
    let numbers = [json!([words]), as_read.into(), rest.into()];
    let remedy = "write that in the problem if the arm is mounted so, and run flexcal loop again; a \
                  spring or counterweight that is not declared looks alike";
    Some(Finding { remedy: remedy.to_owned(), ..Finding::new(FindingCode::Misread, numbers, text) })
}

/// Returns those of the `compliances` whose estimate in `fitted` is more than `limit` standard errors
/// above 0, or below 0 if `limit` is negative.
fn giving_way(fitted: &Fitted, compliances: &[Effect], limit: f64) -> Vec<Effect> {
    let sigmas = |effect: &Effect| {
        let estimate = fitted.parameters_of(effect).first().map(|&k| &fitted.found.estimates[k]);
        estimate.and_then(|of| Some(of.estimate / of.std_error?)).unwrap_or(0.0)
    };
    let is_beyond = |effect: &&Effect| sigmas(effect) * limit.signum() > limit.abs();
    compliances.iter().filter(is_beyond).cloned().collect()
}

/// Returns the joints of compliances in words: "joint 2", "joints 2, 3".
fn joints_in_words(compliances: &[Effect]) -> String {
    let joints = compliances.iter().filter_map(|effect| Some(effect.joint()?.to_string()));
    let joints: Vec<String> = joints.collect();
    let noun = if joints.len() == 1 { "joint" } else { "joints" };
    format!("{noun} {}", joints.join(", "))
}
