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

/// Number of fits of the search: with gravity as declared and along each axis, in both directions.
const TRIALS: usize = 7;
/// Maximum number of steps of a provisional fit. In the right direction, a few steps show the gain.
const MAX_PROVISIONAL_STEPS: u64 = 40;
/// Smallest cosine of the angle between two directions of gravity that count as one.
const SAME_DIRECTION: f64 = 0.99;
/// ln of the odds by which the final fit of a search must predict left-out poses better to exclude
/// another direction of gravity: formulas are chosen among thousands, and the direction among six.
const LN_ODDS_OF_FORMULAS: f64 = 3.0;
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
/// way against its load shows a wrong direction. Provisional fits show which directions need a
/// complete one.
pub(super) fn other_gravity(
    state: &SearchState,
    declared: &Fitted,
    end: &Fitted,
) -> Option<Finding> {
    let data = state.data;
    let is_compliance = |effect: &Effect| matches!(effect, Effect::JointCompliance { .. });
    let mut effects: Vec<Effect> = state.added(end);
    effects.retain(|effect| !effect.is_composed() && !is_compliance(effect));
    let testable = Candidates::new(&declared.problem, data).testable;
    let compliances: Vec<Effect> = testable.into_iter().filter(is_compliance).collect();
    let unknowns = end.unknowns.len() + compliances.len();
    if compliances.is_empty() || state.affordable_fits(unknowns) < TRIALS {
        return None;
    }
    effects.extend(compliances.iter().cloned());
    let with = |gravity: Vector3<f64>, provisional: bool| {
        let problem = Problem { gravity, ..state.problem(declared, &effects) };
        let options = declared.warm_started_options(state.options, true);
        let max_steps = if provisional { Some(MAX_PROVISIONAL_STEPS) } else { options.max_steps };
        declared.fit_other(problem, data, &Options { max_steps, provisional, ..options }).ok()
    };
    let ln_odds = |fitted: &Fitted, known: &Fitted| {
        let gain = LeftOutGain::new(fitted, known, data)?;
        let odds = gain.ln_odds(fitted.sigma);
        (gain.is_significant() && odds > LN_ODDS_OF_FORMULAS).then_some(odds)
    };
    let as_declared = declared.problem.gravity;
    let (provisional, known) = (with(as_declared, true)?, OnceCell::new());
    let known = || known.get_or_init(|| with(as_declared, false)).as_ref();
    let directions = (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]);
    let trials = directions.filter_map(|(axis, sign)| {
        let gravity = Vector3::ith(axis, sign * as_declared.norm());
        if gravity.dot(&as_declared) > SAME_DIRECTION * as_declared.norm_squared() {
            return None;
        }
        ln_odds(&with(gravity, true)?, &provisional)?;
        let fitted = with(gravity, false)?;
        Some((ln_odds(&fitted, known()?)?, gravity, fitted))
    });
    let (_, gravity, best) = trials.max_by(|one, other| one.0.total_cmp(&other.0))?;
    let against = LeftOutGain::new(end, &best, data)?.ln_odds(best.sigma.min(end.sigma));
    let sigmas = |effect: &Effect| {
        let estimate = best.parameters_of(effect).first().map(|&k| &best.found.estimates[k]);
        estimate.and_then(|of| Some(of.estimate / of.std_error?)).unwrap_or(0.0)
    };
    let gives_way: Vec<f64> = compliances.iter().map(sigmas).collect();
    let is_sound = gives_way.iter().all(|ratio| *ratio > -MAX_NEGATIVE_SIGMAS)
        && gives_way.iter().any(|ratio| *ratio > MIN_COMPLIANCE_SIGMAS);
    if against > LN_ODDS_OF_FORMULAS || !is_sound {
        return None;
    }
    let soft = compliances.iter().zip(&gives_way);
    let soft = soft.filter(|(_, ratio)| **ratio > MIN_COMPLIANCE_SIGMAS);
    let soft: Vec<String> =
        soft.filter_map(|(effect, _)| Some(effect.joint()?.to_string())).collect();
    let joints = if soft.len() == 1 { "joint" } else { "joints" };
    let axes: Vec<String> = gravity.iter().map(ToString::to_string).collect();
    let words = format!("gravity_m_s2 = [{}]", axes.join(", "));
    let error = |fitted: &Fitted| fitted.found.fitted.identification.rms.norm;
    let (as_read, rest) = (error(declared), error(&best));
    let text = format!(
        "the measurements fit if gravity acts along another axis of the base: with {words} and {joints} {} giving way \
         to the loads, the rms error would be {} mm; as declared it is {} mm",
        soft.join(", "),
        mm(rest, 3),
        mm(as_read, 3)
    );
    let numbers = [json!([words]), as_read.into(), rest.into()];
    let remedy = "write that in the problem if the arm is mounted so, and run flexcal loop again";
    Some(Finding { remedy: remedy.to_owned(), ..Finding::new(FindingCode::Misread, numbers, text) })
}
