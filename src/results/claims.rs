//! Hypotheses about the cause of a residual, and claims about the cause with their probabilities.

use schemars::JsonSchema;
use serde::Serialize;

use super::effect::EffectKeys;
use crate::laws::ArgumentKind;
use crate::problem::Effect;
use crate::select::{self, HypothesisKind, Trace};

/// Hypothesis about a cause: an effect with its law, or a function of unknown law at a place.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Hypothesis {
    /// Effect of the catalogue; null for a function of unknown law.
    #[schemars(with = "Option<EffectKeys>")]
    pub effect: Option<Effect>,
    /// Name of the effect, or of the kind of function such as `smooth`.
    pub law: String,
    pub description: String,
    pub place: String,
    pub depends_on: Vec<String>,
}

impl Hypothesis {
    /// Converts a hypothesis about the traced data to the names that result files use.
    pub(super) fn new(hypothesis: &select::Hypothesis, trace: &Trace) -> Self {
        Self {
            effect: hypothesis.effect().cloned(),
            law: law_name(&hypothesis.kind).to_owned(),
            description: describe(hypothesis, |effect| trace.describe(effect)),
            place: hypothesis.site.to_string(),
            depends_on: hypothesis.depends_on.iter().map(ToString::to_string).collect(),
        }
    }

    /// Returns true if both hypotheses are the same but for the searched value of a time or
    /// distance, or for the order of the factors in the formulas of a law. Waves of other orders are
    /// other causes.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        match (&self.effect, &other.effect) {
            (Some(Effect::Law(law)), Some(Effect::Law(other))) => law.has_same_terms(other),
            (Some(effect), Some(other)) if effect.searched_value().is_some_and(is_no_order) => {
                effect.is_but_for_search(other)
            }
            _ => self == other,
        }
    }

    /// Returns the key of the searched argument; `None` if there is none.
    pub(crate) fn searched_key(&self) -> Option<&'static str> {
        self.effect.as_ref()?.searched()
    }

    /// Returns the value of the searched argument; `None` if there is none.
    pub(crate) fn searched_value(&self) -> Option<f64> {
        Some(self.effect.as_ref()?.searched_value()?.1)
    }
}

/// Returns true if a searched argument is a time or distance, and not the order of a wave.
fn is_no_order((kind, _): (ArgumentKind, f64)) -> bool {
    !matches!(kind, ArgumentKind::Order | ArgumentKind::Orders)
}

/// Claim with its posterior probability.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Claim<T> {
    pub value: T,
    pub probability: f64,
}

/// Claims about a cause, from the weakest (place) to the strongest (law).
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Claims {
    /// Claim that a cause acts at the stated place.
    pub place: Claim<String>,
    /// Claim that the cause depends on exactly the stated quantities.
    pub depends_on: Claim<Vec<String>>,
    /// Claim that the cause has this law and that no function of unknown law acts at the place;
    /// null if no law is known.
    pub law: Claim<Option<String>>,
    pub description: String,
}

impl Claims {
    /// Converts claims about the traced data to the names that result files use.
    pub(super) fn new(claims: &select::Claims, trace: &Trace) -> Self {
        let select::Claims { place, depends_on, law } = claims;
        let name = law.0.effect().map(|effect| effect.name().to_owned());
        let words = depends_on.0.iter().map(ToString::to_string).collect();
        Self {
            place: Claim { value: place.0.to_string(), probability: place.1 },
            depends_on: Claim { value: words, probability: depends_on.1 },
            law: Claim { value: name, probability: law.1 },
            description: describe(&law.0, |effect| trace.describe(effect)),
        }
    }
}

/// Returns the name of a law in result files.
pub(super) fn law_name(law: &HypothesisKind) -> &str {
    match law {
        HypothesisKind::Effect(effect) => effect.name(),
        HypothesisKind::NearHarmonic(_) => "near-harmonic",
        HypothesisKind::Gear(_) => "gear",
        HypothesisKind::PerPose => "per-pose",
        HypothesisKind::Wandering => "wandering",
        HypothesisKind::Linear => "linear",
        HypothesisKind::Sag => "sag",
        HypothesisKind::Limit(_) => "limit",
        _ => "smooth",
    }
}

/// Describes a hypothesis in words; `effect_words` describes an effect.
fn describe(hypothesis: &select::Hypothesis, effect_words: impl Fn(&Effect) -> String) -> String {
    let place = at_place(&hypothesis.site.to_string());
    let inputs: Vec<String> = hypothesis.depends_on.iter().map(ToString::to_string).collect();
    let inputs = inputs.join(" and ");
    match &hypothesis.kind {
        HypothesisKind::Effect(effect) => effect_words(effect),
        HypothesisKind::NearHarmonic(1) => {
            format!(
                "an error {place} that depends on {inputs} with a period of one revolution, law \
                 unknown"
            )
        }
        HypothesisKind::NearHarmonic(order) => {
            format!(
                "an error {place} that depends on {inputs} with about {order} periods a \
                 revolution, law unknown"
            )
        }
        HypothesisKind::Gear(highest) => {
            format!("a periodic error {place} with all orders up to {highest} a turn")
        }
        HypothesisKind::PerPose => {
            format!(
                "an error {place} that varies from pose to pose and depends on no known quantity \
                 (extra noise)"
            )
        }
        HypothesisKind::Wandering => format!(
            "a random drift {place} in {inputs}, in which each reading follows the one before"
        ),
        HypothesisKind::Linear => format!(
            "an error {place} that is linear in the position, such as a scale for each axis, or \
             shear"
        ),
        HypothesisKind::Sag => {
            format!("a deflection {place} under weight that the problem does not declare")
        }
        HypothesisKind::Limit(limit) => {
            format!("a wrong limit {limit}, which is active")
        }
        _ => format!("an error {place} that is a smooth function of {inputs}, law unknown"),
    }
}

/// Place in result files of structure that only the residual tests detect.
pub(super) const NOWHERE: &str = "nowhere in particular";

/// Returns the name of a place in result files with its preposition: "at joint 2", "at the base".
pub(crate) fn at_place(place: &str) -> String {
    match place {
        NOWHERE => "at a place that is not known".to_owned(),
        joint if joint.starts_with("joint ") => format!("at {joint}"),
        other => format!("at the {other}"),
    }
}
