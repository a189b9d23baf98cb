//! Result of the command `trace`: trace.json.

use schemars::JsonSchema;
use serde::Serialize;

use super::claims::{Claims, Hypothesis};
use super::effect::{EffectKeys, NamedEffect, Untestable, joined};
use super::identification::FindingKeys;
use super::residual_test::{ResidualTest, size_alone};
use super::summary::{Errors, in_mm_deg_px};
use crate::fit::{ErrorSummary, Finding};
use crate::problem::{Effect, Problem};
use crate::select::{self, Trace};

/// Smallest probability of a hypothesis set that is written to trace.json.
const MIN_WRITTEN_PROBABILITY: f64 = 0.01;

/// Effects that the residual of a fit points to.
#[derive(Debug, Serialize, JsonSchema)]
pub struct TraceResult {
    pub problem: String,
    pub trusted: bool,
    #[serde(flatten)]
    pub errors: Errors,
    pub reduced_chi2: Option<f64>,
    /// True if the residual tests detect structure that an effect could explain.
    pub structured: bool,
    pub checks: Vec<ResidualTest>,
    /// Number of candidates tried, where each order and each time constant is one candidate.
    pub tried: usize,
    /// Largest corrected p-value at which a candidate is significant.
    pub level: f64,
    /// Candidate effects, best first.
    pub ranking: Vec<Candidate>,
    /// Sets of hypotheses that may explain the residual together, most probable first. The empty
    /// set means noise alone.
    pub explanations: Vec<HypothesisSet>,
    /// Claims about each cause in the most probable set.
    pub claims: Vec<Claims>,
    pub untestable: Vec<Untestable>,
    /// Effects that the fitted parameters can reproduce completely, so that they cannot be
    /// detected.
    #[schemars(with = "Vec<EffectKeys>")]
    pub absorbed: Vec<Effect>,
    /// Findings of the checks of the fit.
    #[schemars(with = "Vec<FindingKeys>")]
    pub findings: Vec<Finding>,
}

/// Candidate effect in the ranking.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Candidate {
    #[serde(flatten)]
    pub effect: NamedEffect,
    /// Probability that noise alone reduces the residual as much, corrected for the number of
    /// candidates.
    pub p_value: f64,
    pub f: f64,
    /// Degrees of freedom of the numerator of the F statistic `f`.
    pub freedom: usize,
    /// Expected decrease of the root mean square error of the identification poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_gain_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_gain_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub expected_gain_px: Option<f64>,
    /// Decrease of the root mean square error of poses, each left out of the fit in turn; null if
    /// it was not computed.
    pub cross_validated_gain_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validated_gain_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validated_gain_px: Option<f64>,
    /// Effects that the measured poses hardly distinguish from the candidate.
    pub alike: Vec<Confounded>,
    /// Pose that would distinguish the effect from the first effect of `alike`.
    pub told_apart: Option<SeparatingPose>,
}

/// Effect that the measured poses hardly distinguish from a candidate.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Confounded {
    #[serde(flatten)]
    pub effect: NamedEffect,
    /// Largest principal angle between the displacements by the two effects: 0 if they are equal,
    /// 90 if they are orthogonal.
    pub angle_deg: f64,
}

/// Pose at which the predictions with two effects differ most.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SeparatingPose {
    #[schemars(with = "EffectKeys")]
    pub from: Effect,
    /// Configuration at which the effects differ \[rad\] or \[m\].
    pub q: Vec<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    pub payload_kg: Option<f64>,
    #[serde(rename = "hoist_N")]
    pub hoist: Option<f64>,
    #[serde(rename = "temperature_C")]
    pub temperature: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference_px: Option<f64>,
}

/// Set of hypotheses that explain the residual together, with its probability.
#[derive(Debug, Serialize, JsonSchema)]
pub struct HypothesisSet {
    pub probability: f64,
    pub hypotheses: Vec<Hypothesis>,
}

impl TraceResult {
    /// Collects the result of a trace.
    pub fn new(problem: &Problem, trace: &Trace) -> Self {
        let errors = &trace.fit.fitted.identification;
        let evidence = trace.evidence.as_ref();
        let sets = evidence.map_or(&[][..], |evidence| &evidence.sets);
        let set = |set: &select::HypothesisSet| HypothesisSet {
            probability: set.probability,
            hypotheses: set
                .hypotheses
                .iter()
                .map(|hypothesis| Hypothesis::new(hypothesis, trace))
                .collect(),
        };
        let absorbed = joined(trace.absorbed.iter().cloned().map(|effect| (effect, ())));
        Self {
            problem: problem.name.clone(),
            trusted: trace.fit.is_trusted(),
            errors: Errors::of(&trace.fit.fitted),
            reduced_chi2: trace.fit.reduced_chi2,
            structured: trace.residual_tests.is_structured(),
            checks: ResidualTest::all(&trace.residual_tests),
            tried: trace.tried,
            level: trace.level,
            ranking: trace
                .ranking
                .iter()
                .map(|ranked| Candidate::new(ranked, trace, errors))
                .collect(),
            explanations: sets
                .iter()
                .filter(|set| set.probability > MIN_WRITTEN_PROBABILITY)
                .map(set)
                .collect(),
            claims: evidence.map_or_else(Vec::new, |evidence| {
                let claims = |hypothesis| Claims::new(&evidence.claims(hypothesis), trace);
                evidence.best().iter().map(claims).collect()
            }),
            untestable: Untestable::all(&trace.untestable),
            absorbed: absorbed.into_iter().map(|(effect, ())| effect).collect(),
            findings: trace.fit.findings.clone(),
        }
    }
}

impl TraceResult {
    /// Returns the ratio √(χ²/ν) of the residual to the declared σ if it is significantly above 1
    /// and no other test of structure fails.
    pub(crate) fn size_alone(&self) -> Option<f64> {
        size_alone(&self.checks)
    }

    /// Returns true if at least one test of structure could be made.
    pub(crate) fn is_testable(&self) -> bool {
        self.checks.iter().any(|test| test.structure && test.statistic.is_some())
    }

    /// Returns the best candidate if it is significant.
    pub(crate) fn significant(&self) -> Option<&Candidate> {
        self.ranking.first().filter(|candidate| candidate.p_value < self.level)
    }
}

impl SeparatingPose {
    /// Returns the distance between the predictions by the two effects, in the unit of its key: mm,
    /// ° or px; `None` if no key is present.
    pub fn difference(&self) -> Option<f64> {
        self.difference_mm.or(self.difference_deg).or(self.difference_px)
    }
}

impl Candidate {
    /// Returns the expected decrease of the rms error, in the unit of its key: mm, ° or px; `None`
    /// if no key is present.
    pub fn expected_gain(&self) -> Option<f64> {
        self.expected_gain_mm.or(self.expected_gain_deg).or(self.expected_gain_px)
    }

    /// Returns the decrease of the rms error of poses left out in turn, in the unit of its key: mm,
    /// ° or px; `None` if it was not computed.
    pub fn cross_validated_gain(&self) -> Option<f64> {
        let angle = self.cross_validated_gain_deg;
        self.cross_validated_gain_mm.or(angle).or(self.cross_validated_gain_px)
    }

    fn new(ranked: &select::Ranked, trace: &Trace, errors: &ErrorSummary) -> Self {
        let in_mm_deg_px = |value: f64| in_mm_deg_px(errors.unit(), value);
        let (expected_gain_mm, expected_gain_deg, expected_gain_px) = in_mm_deg_px(ranked.gain);
        let (cross_validated_gain_mm, cross_validated_gain_deg, cross_validated_gain_px) =
            ranked.cross_validated.map_or((None, None, None), in_mm_deg_px);
        let alike = |(effect, angle): &(Effect, f64)| Confounded {
            effect: NamedEffect::new(effect, trace),
            angle_deg: angle.to_degrees(),
        };
        let told_apart = |pose: &select::SeparatingPose| {
            let (difference_mm, difference_deg, difference_px) = in_mm_deg_px(pose.difference);
            SeparatingPose {
                from: pose.other.clone(),
                q: pose.configuration.clone(),
                target: pose.target.clone(),
                payload_kg: pose.payload,
                hoist: pose.hoist,
                temperature: pose.temperature,
                difference_mm,
                difference_deg,
                difference_px,
            }
        };
        Self {
            effect: NamedEffect::new(&ranked.effect, trace),
            p_value: ranked.p_value,
            f: ranked.f.0,
            freedom: ranked.f.1,
            expected_gain_mm,
            expected_gain_deg,
            expected_gain_px,
            cross_validated_gain_mm,
            cross_validated_gain_deg,
            cross_validated_gain_px,
            alike: ranked.alike.iter().map(alike).collect(),
            told_apart: ranked.separating_pose.as_ref().map(told_apart),
        }
    }
}
