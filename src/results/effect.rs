//! Effects in result files: names, arguments and descriptions.

use schemars::JsonSchema;
use serde::Serialize;

use crate::problem::Effect;
use crate::select::Trace;

/// Effect with its arguments, in the form of problem.toml: `{"effect": "gear-ratio", "joint": 3}`.
#[derive(JsonSchema)]
#[schemars(rename = "Effect")]
#[expect(dead_code, reason = "stands for the serialised effect in schemas")]
pub(super) struct EffectKeys {
    /// Name in problem.toml; its arguments are additional keys.
    effect: String,
}

/// Effect with a description in words.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct NamedEffect {
    #[serde(flatten)]
    #[schemars(with = "EffectKeys")]
    pub effect: Effect,
    /// Description of the effect in words.
    pub description: String,
    /// Line that declares the effect in an `[[effect]]` of problem.toml.
    pub declaration: String,
}

impl NamedEffect {
    /// Describes an effect in words that suit the recorded quantities of the traced data.
    pub fn new(effect: &Effect, trace: &Trace) -> Self {
        Self {
            description: trace.describe(effect),
            declaration: effect.declaration(),
            effect: effect.clone(),
        }
    }
}

/// Effect whose presence the data cannot show, with the reason.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Untestable {
    #[serde(flatten)]
    #[schemars(with = "EffectKeys")]
    pub effect: Effect,
    pub reason: &'static str,
}

impl Untestable {
    /// Lists effects with the reason why the data cannot show them. Parts of one effect, such as
    /// harmonics of a joint, form one entry if they share a reason.
    pub(super) fn all(effects: &[(Effect, &'static str)]) -> Vec<Self> {
        let entry = |(effect, reason)| Self { effect, reason };
        joined(effects.iter().cloned()).into_iter().map(entry).collect()
    }
}

/// Merges effects that are parts of one, such as the harmonics of a joint, if they share a reason.
/// A merged effect stands at the place of its first part.
pub(crate) fn joined<R: Copy + PartialEq>(
    effects: impl IntoIterator<Item = (Effect, R)>,
) -> Vec<(Effect, R)> {
    let mut groups: Vec<(Effect, R)> = Vec::new();
    for (effect, reason) in effects {
        let joins = |(group, why): &mut (Effect, R)| {
            let union = group.joined(&effect).filter(|_| *why == reason);
            union.map(|union| *group = union).is_some()
        };
        if !groups.iter_mut().any(joins) {
            groups.push((effect, reason));
        }
    }
    groups
}
