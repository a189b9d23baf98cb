//! Effects that may act instead of one that a loop found.

use schemars::JsonSchema;
use serde::Serialize;

use super::effect::NamedEffect;
use super::parameter_value::ParameterValue;
use crate::problem::Effect;
use crate::select::{Found, Trace};

/// Largest |ln odds| by the poses alone at which they do not tell two effects apart. Odds below
/// three are worth no more than a bare mention [Kass and Raftery 1995].
const MAX_UNDECIDED_LN_ODDS: f64 = 1.1;

/// Effect that may act instead of a found one.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "Alternative")]
pub struct AlternativeEffect {
    #[serde(flatten)]
    pub effect: NamedEffect,
    /// Probability that this effect acts instead of the found one.
    pub probability: f64,
    /// ln of the odds of the found effect over this one by how well fits with each predict poses
    /// that are left out, whatever is probable before any pose is measured. Absent if this effect
    /// was not fitted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ln_odds_of_poses: Option<f64>,
    /// True if no pose within the measured ranges tells this effect from the found one: for this
    /// arm, they are one cause with two names. Absent otherwise.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub alike: bool,
    /// Parameters of this effect, fitted instead of the found one; absent if it was not fitted.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parameters: Vec<ParameterValue>,
}

impl AlternativeEffect {
    /// Describes an alternative of `found` with its probability.
    pub(super) fn new((effect, probability): &(Effect, f64), found: &Found, trace: &Trace) -> Self {
        let fitted = found.compared.iter().find(|fitted| fitted.effect == *effect);
        let estimates = fitted.map_or(&[][..], |fitted| fitted.estimates.as_slice());
        Self {
            effect: NamedEffect::new(effect, trace),
            probability: *probability,
            ln_odds_of_poses: fitted.map(|fitted| fitted.ln_odds),
            alike: fitted.is_some_and(|fitted| fitted.is_alike),
            parameters: estimates.iter().map(ParameterValue::new).collect(),
        }
    }

    /// Returns true if poses that are left out do not tell this effect from the found one.
    pub(crate) fn is_undecided(&self) -> bool {
        self.ln_odds_of_poses.is_some_and(|odds| odds.abs() < MAX_UNDECIDED_LN_ODDS)
    }
}
