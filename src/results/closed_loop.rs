//! Result of the command `loop`: loop.json.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::value::{RawValue, to_raw_value};

use super::alternative::AlternativeEffect;
use super::claims::{Claims, NOWHERE, law_name};
use super::effect::{EffectKeys, NamedEffect};
use super::hints::resembled;
use super::identification::{FindingKeys, InfluentialRowSet};
use super::parameter_value::ParameterValue;
use super::remainder::Remainder;
use super::residual_test::{ResidualTest, size_alone, size_test};
use super::summary::{Errors, KindErrors, Summary, in_mm_deg_px};
use crate::fit::{Finding, FindingCode, Identification};
use crate::problem::{Effect, Problem};
use crate::quantity::Unit;
use crate::remainder::Fitted;
use crate::residual_tests::Covariate;
use crate::select::{self, ClosedLoop, HypothesisKind, ReferenceVerdict, Status, Trace, Verdict};

/// Result of the search for missing effects.
#[derive(Debug, Serialize, JsonSchema)]
pub struct LoopResult {
    pub problem: String,
    pub verdict: Verdict,
    /// True if the search was stopped before its end; otherwise absent.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub interrupted: bool,
    pub trusted: bool,
    /// True if the residual of the last fit could be tested for structure.
    pub tested: bool,
    /// Errors of the nominal arm, with base and tool fitted if they are free.
    pub registered: Errors,
    /// Fit of the declared problem.
    pub before: Fit,
    /// Fit of the extended problem.
    pub after: Fit,
    /// Errors of a fit with only those added effects that have the status `found`.
    pub with_found: Errors,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_gain_mm: Option<Gain>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_gain_deg: Option<Gain>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub held_out_gain_px: Option<Gain>,
    /// Effects of the extended problem that were not declared.
    pub effects: Vec<FoundEffect>,
    /// Remainder that was fitted in addition to the effects; `after` includes it.
    pub remainder: Option<Remainder>,
    /// Strongest structure whose law is unknown.
    pub unexplained: Option<Structure>,
    /// Identification rows too far from the others to be noise, which were excluded from the choice
    /// of effects.
    pub set_aside: Vec<Row>,
    /// Other structure whose law is unknown, most probable first.
    pub further: Vec<Structure>,
    /// Common prior of the harmonics of all joints, one entry for each order; null if there is
    /// none.
    pub harmonic_prior: Option<Vec<OrderPrior>>,
    /// Digest of each fitted row, by which flexcal next notices a loop.json of other measurements.
    #[schemars(with = "Vec<String>")]
    pub fitted_rows: Option<Box<RawValue>>,
    /// Rounds of the search.
    pub steps: Vec<Step>,
    pub checks_before: Vec<ResidualTest>,
    pub checks_after: Vec<ResidualTest>,
    /// Findings of the checks of the last fit.
    #[schemars(with = "Vec<FindingKeys>")]
    pub findings: Vec<Finding>,
}

/// Fit of a problem.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Fit {
    #[serde(flatten)]
    pub errors: Errors,
    pub reduced_chi2: Option<f64>,
    pub misfit_carried_by: Option<InfluentialRowSet>,
    /// Errors of each kind of rows, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<KindErrors>,
}

/// Decrease of the mean error on held-out rows by all added effects together, in the unit of the
/// errors: mm, ° or px.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, JsonSchema)]
pub struct Gain {
    /// Mean error with the declared problem minus that with the added effects.
    pub mean: f64,
    /// 95 % bootstrap interval of `mean`, resampled over configurations.
    pub interval_95: [f64; 2],
}

/// Effect that the loop added to the problem.
#[derive(Debug, Serialize, JsonSchema)]
pub struct FoundEffect {
    #[serde(flatten)]
    pub effect: NamedEffect,
    pub status: Status,
    /// Claims about the cause; null if no evidence on the effect was evaluated, or if no probable
    /// hypothesis set contains it.
    pub claims: Option<Claims>,
    /// Quantities of a law that the search composed, with their ranges over the identification
    /// rows, SI units; absent for other effects.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<(String, (f64, f64))>,
    /// Physical cause that a law of the search resembles, a hint and not a claim; absent if the
    /// table of hints has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resembles: Option<String>,
    /// Share of 20 refits, each on random 80 % of the configurations, that find the effect again;
    /// null if no evidence was evaluated.
    pub stability: Option<f64>,
    /// Verdict of measurements that are independent of the fit; null if none concern the effect.
    pub witness: Option<Witness>,
    /// Probability that noise alone reduces the residual as much, corrected for the number of
    /// candidates.
    pub p_value: f64,
    pub parameters: Vec<ParameterValue>,
    /// Effects that the data cannot distinguish from the found one, most probable first.
    pub alternatives: Vec<AlternativeEffect>,
    /// Held-out errors after the first round that contains the effect and whose effects all
    /// remained. If there is no such round, those of the last fit.
    pub held_out_after: Summary,
}

/// Verdict of measurements that are independent of the fit, such as readings of fixed points.
#[derive(Debug, Clone, Serialize, JsonSchema)]
pub struct Witness {
    pub data: String,
    /// Verdict, `corroborated` or `contradicted`.
    pub says: &'static str,
}

/// Structure in the residual whose law is unknown.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Structure {
    /// Place where the error acts.
    #[serde(rename = "where")]
    pub place: String,
    pub depends_on: Vec<String>,
    /// Kind of function, for example `smooth`, `sag`, `wandering` or `limit`; name of the most
    /// probable effect if a remainder corrects the structure instead; null if only the residual
    /// tests detect the structure.
    pub law: Option<String>,
    /// Limit of the declared problem (bound or prior) that is wrong or hides a cause; null for
    /// other structure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<String>,
    pub claims: Option<Claims>,
    /// Upper limit of the probability that noise alone causes the structure.
    pub p_value: f64,
    pub held_out_with_empirical_correction: Option<Summary>,
    pub correction: Option<Correction>,
}

/// Smooth empirical correction of the structure.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Correction {
    /// Range of each input, SI units. Beyond it the correction is constant.
    pub ranges: Vec<(String, (f64, f64))>,
    /// Number of held-out rows at which an input is outside its range.
    pub held_out_beyond: usize,
    /// Rms error of identification poses, each left out of the fit in turn: first without, then
    /// with the correction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validated_rms_mm: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validated_rms_deg: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_validated_rms_px: Option<[f64; 2]>,
}

/// Row of a measurement file, by file and line.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Row {
    pub file: String,
    pub line: Option<usize>,
}

/// Prior of the harmonics of one order, the same for all joints.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct OrderPrior {
    pub order: u32,
    pub sigma_rad: f64,
}

/// Effects in the model after a round of the search, and its errors.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Step {
    #[schemars(with = "Vec<EffectKeys>")]
    pub effects: Vec<Effect>,
    #[serde(flatten)]
    pub errors: Errors,
}

impl LoopResult {
    /// Collects the result of a finished or interrupted loop.
    pub fn new(problem: &Problem, closure: &ClosedLoop) -> Self {
        let (before, held_out) = (&closure.before, &closure.after.fitted.held_out);
        let gain = {
            let in_unit = |value: f64| held_out.in_unit(value);
            let select::Interval { value, low, high } = closure.gain;
            Gain { mean: in_unit(value), interval_95: [in_unit(low), in_unit(high)] }
        };
        let gain_in = |unit: Unit| (held_out.unit() == unit).then_some(gain);
        let mut structures = closure.unexplained.iter().map(|left| Structure::new(left, before));
        let prior = closure.harmonic_prior.as_ref().map(|prior| {
            let order = |&(order, sigma_rad): &(u32, f64)| OrderPrior { order, sigma_rad };
            prior.by_order.iter().map(order).collect()
        });
        Self {
            problem: problem.name.clone(),
            verdict: closure.verdict,
            interrupted: closure.interrupted,
            trusted: closure.after.is_trusted(),
            tested: closure.residual_tests.is_testable(),
            registered: Errors::of(&before.fit.registered),
            before: Fit::new(&before.fit),
            after: Fit::new(&closure.after),
            with_found: Errors::of(&closure.with_found),
            held_out_gain_mm: gain_in(Unit::Length),
            held_out_gain_deg: gain_in(Unit::Angle),
            held_out_gain_px: gain_in(Unit::Pixel),
            effects: closure.effects.iter().map(|found| FoundEffect::new(found, before)).collect(),
            remainder: None,
            unexplained: structures.next(),
            further: structures.collect(),
            set_aside: closure.set_aside.iter().map(Row::new).collect(),
            harmonic_prior: prior,
            fitted_rows: to_raw_value(&closure.before.fit.fitted_rows).ok(),
            steps: closure
                .rounds
                .iter()
                .map(|round| Step::new(round, closure.after.fitted.is_left_out))
                .collect(),
            checks_before: ResidualTest::all(&before.residual_tests),
            checks_after: ResidualTest::all(&closure.residual_tests),
            findings: closure.after.findings.clone(),
        }
    }

    /// Returns true if held-out rows, or rows that a robust loss sets aside, contradict the last
    /// fit.
    #[doc(hidden)]
    pub fn is_contradicted(&self) -> bool {
        let codes = [FindingCode::HeldOutBeyondPrediction, FindingCode::RowsSetAside];
        self.findings.iter().any(|finding| codes.contains(&finding.code))
    }

    /// Returns the result with the remainder, if one was accepted in addition to the effects. The
    /// errors of `after` are then those with the remainder.
    #[doc(hidden)]
    #[must_use]
    pub fn with_remainder(mut self, closure: &ClosedLoop, fitted: &Fitted) -> Self {
        if let Some(corrected) = &fitted.residuals {
            self.after.errors = Errors::of(&corrected.errors);
        }
        self.remainder = Remainder::new(&closure.after, fitted);
        self
    }

    /// Iterates over the effects with the given status.
    pub(crate) fn with_status(&self, status: Status) -> impl Iterator<Item = &FoundEffect> {
        self.effects.iter().filter(move |found| found.status == status)
    }

    /// Iterates over all structure in the residual whose law is unknown, most probable first.
    pub(crate) fn structures(&self) -> impl Iterator<Item = &Structure> {
        self.unexplained.iter().chain(&self.further)
    }

    /// Returns true if at least one law is probable but not certain, every cause has a probable or a
    /// certain law, and the residual with them looks like noise.
    pub(crate) fn is_probably_explained(&self) -> bool {
        let causes = || self.effects.iter().filter(|found| !found.is_only_with_others());
        let is_named =
            |found: &FoundEffect| matches!(found.status, Status::Found | Status::Probable);
        self.verdict == Verdict::Unexplained
            && (self.trusted && self.tested && !self.interrupted)
            && self.unexplained.is_none()
            && !self.is_contradicted()
            && causes().any(|found| found.status == Status::Probable)
            && causes().all(is_named)
    }

    /// Returns true if rows that stand out are all that contradicts noise alone.
    pub(crate) fn are_rows_apart(&self) -> bool {
        self.verdict == Verdict::Unexplained
            && (self.trusted && self.tested && !self.interrupted)
            && !self.set_aside.is_empty()
            && self.effects.is_empty()
            && self.unexplained.is_none()
            && !self.is_contradicted()
    }

    /// Returns true if a few rows cause most of the misfit of the declared problem, and the effects
    /// that were added do not explain them together with the other rows.
    pub(crate) fn is_misfit_of_rows(&self) -> bool {
        let is_left = self.size_test().is_none_or(|(test, chi2)| test.failed && chi2 > 1.0);
        let are_explained = !self.effects.is_empty() && self.set_aside.is_empty() && !is_left;
        self.before.misfit_carried_by.is_some() && !are_explained
    }

    /// Returns the test of the size of the residual against the declared σ, with its χ²/ν; `None`
    /// if the test could not be made.
    fn size_test(&self) -> Option<(&ResidualTest, f64)> {
        size_test(&self.checks_after)
    }

    /// Returns the ratio √(χ²/ν) of the residual to the declared σ if it is significantly above 1
    /// and no other test of structure fails. Otherwise, or if structure has a place, returns
    /// `None`.
    pub(crate) fn size_alone(&self) -> Option<f64> {
        let size = size_alone(&self.checks_after)?;
        let mut structures = self.structures().peekable();
        let is_nowhere =
            structures.peek().is_some() && structures.all(|structure| structure.place == NOWHERE);
        is_nowhere.then_some(size)
    }

    /// Returns the ratio √(χ²/ν) of the residual to the declared σ if it is significantly less than
    /// 1; `None` if it is not, or if no σ is declared.
    pub(crate) fn overstated_sigma_ratio(&self) -> Option<f64> {
        let (size, chi2) = self.size_test()?;
        let (low, _) = size.bounds?;
        (chi2 < low).then(|| chi2.max(0.0).sqrt())
    }

    /// Returns the decrease of the mean held-out error by the added effects, in the unit of its
    /// key: mm, ° or px; `None` if the file states none.
    pub(crate) fn gain(&self) -> Option<Gain> {
        self.held_out_gain_mm.or(self.held_out_gain_deg).or(self.held_out_gain_px)
    }
}

impl Fit {
    fn new(fit: &Identification) -> Self {
        Self {
            errors: Errors::of(&fit.fitted),
            reduced_chi2: fit.reduced_chi2,
            misfit_carried_by: fit.influential_rows.as_ref().map(InfluentialRowSet::new),
            kinds: KindErrors::all(&fit.kinds),
        }
    }
}

impl FoundEffect {
    fn new(found: &select::Found, trace: &Trace) -> Self {
        let named = |effect: &Effect| NamedEffect::new(effect, trace);
        let witness = |check: &select::ReferenceCheck| Witness {
            data: check.data.clone(),
            says: match check.verdict {
                ReferenceVerdict::Corroborated => "corroborated",
                ReferenceVerdict::Contradicted => "contradicted",
            },
        };
        Self {
            effect: named(&found.effect),
            status: found.status,
            claims: found.claims.as_ref().map(|claims| Claims::new(claims, trace)),
            ranges: found.ranges.iter().map(|(of, range)| (of.to_string(), *range)).collect(),
            resembles: resembled(&found.effect),
            stability: found.stability,
            witness: found.reference_check.as_ref().map(witness),
            p_value: found.p_value,
            parameters: found.estimates.iter().map(ParameterValue::new).collect(),
            alternatives: found
                .alternatives
                .iter()
                .map(|other| AlternativeEffect::new(other, found, trace))
                .collect(),
            held_out_after: Summary::of(&found.held_out_after),
        }
    }

    /// Returns true if the effect is significant without the other effects, but its law is
    /// uncertain.
    pub fn is_doubted(&self) -> bool {
        matches!(self.status, Status::Probable | Status::Located) && !self.is_only_with_others()
    }

    /// Returns true if no pose tells the effect from its most probable alternative: for this arm,
    /// they are one cause with two names.
    pub fn has_two_names(&self) -> bool {
        self.alternatives.first().is_some_and(|rival| rival.alike)
    }

    /// Returns true if the effect is significant only together with others: no evidence was
    /// evaluated for it, and alone it is not significant.
    pub fn is_only_with_others(&self) -> bool {
        self.claims.is_none() && self.status == Status::Located
    }
}

impl Structure {
    fn new(unexplained: &select::Unexplained, trace: &Trace) -> Self {
        let correction = unexplained.correction.as_ref();
        let law = unexplained.claims.as_ref().map(|claims| &claims.law.0.kind);
        Self {
            place: unexplained.site.map_or_else(|| NOWHERE.to_owned(), |site| site.to_string()),
            depends_on: unexplained.depends_on.iter().map(ToString::to_string).collect(),
            law: law.map(|law| law_name(law).to_owned()),
            limit: law.and_then(|law| match law {
                HypothesisKind::Limit(limit) => Some(limit.clone()),
                _ => None,
            }),
            claims: unexplained.claims.as_ref().map(|claims| Claims::new(claims, trace)),
            p_value: unexplained.p_value,
            held_out_with_empirical_correction: correction
                .map(|correction| Summary::of(&correction.held_out)),
            correction: correction.map(Correction::new),
        }
    }
}

impl Correction {
    fn new(correction: &select::Correction) -> Self {
        let (without, with) = correction.cross_validated;
        let unit = correction.held_out.unit();
        let [(without_mm, without_deg, without_px), (with_mm, with_deg, with_px)] =
            [without, with].map(|value| in_mm_deg_px(unit, value));
        let range = |(input, range): &(Covariate, (f64, f64))| (input.to_string(), *range);
        Self {
            ranges: correction.ranges.iter().map(range).collect(),
            held_out_beyond: correction.beyond,
            cross_validated_rms_mm: without_mm.zip(with_mm).map(Into::into),
            cross_validated_rms_deg: without_deg.zip(with_deg).map(Into::into),
            cross_validated_rms_px: without_px.zip(with_px).map(Into::into),
        }
    }
}

impl Row {
    fn new(location: &crate::error::Location) -> Self {
        Self { file: location.file.display().to_string(), line: location.line }
    }
}

impl Step {
    fn new(round: &select::Round, is_left_out: bool) -> Self {
        let select::Round { effects, identification, held_out } = round;
        let errors = Errors::new(Summary::of(identification), Summary::of(held_out), is_left_out);
        Self { effects: effects.clone(), errors }
    }
}
