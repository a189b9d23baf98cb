//! Result of the command `identify`: estimate.json.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::value::{RawValue, to_raw_value};

use super::document::json_rows;
use super::prior::PriorUse;
use super::remainder::{self, Remainder};
use super::summary::{Errors, KindErrors, in_mm_deg_px};
use super::trust::Trust;
use crate::fit::{
    self, ActiveConstraint, Estimate, Finding, Identification, InfluentialRows, Noise,
    OrientationErrors, Outlier, PointSpread, ShadowPrice,
};
use crate::least_squares::solver::AtBound;
use crate::least_squares::{Identifiability, UnidentifiableCombination};
use crate::observation::kind_named;
use crate::problem::Problem;
use crate::quantity::Unit;
use crate::remainder::{BoundTest, Fitted};

/// Identified arm. Values are in SI units unless the key names another unit.
#[derive(Debug, Serialize, JsonSchema)]
pub struct IdentificationResult {
    pub problem: String,
    /// SHA-256 digest of all declarations on which predictions depend.
    pub arm_digest: String,
    /// Digest of each part of the declared arm, by the name of the part.
    pub arm_parts: BTreeMap<String, String>,
    pub strategy: &'static str,
    pub solver: &'static str,
    /// Reason for which `auto` chose the solver; null if the user named it.
    pub solver_reason: Option<&'static str>,
    pub termination: &'static str,
    /// True if no finding is an error.
    pub trusted: bool,
    pub(crate) verdict: Trust,
    pub iterations: u64,
    pub alternation: Option<Alternation>,
    pub seconds: f64,
    /// Errors of the nominal arm, with base and tool fitted if they are free.
    pub registered: Errors,
    #[serde(flatten)]
    pub fitted: Errors,
    /// Errors of each kind of rows, if there are several.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<KindErrors>,
    /// Spread of the predicted target at each touched point, by the point's name.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub spread: BTreeMap<String, SpreadChange>,
    pub reduced_chi2: Option<f64>,
    /// Time of the first pose.
    pub first_time_s: f64,
    /// Time of the first pose of each named session, where the elapsed time of time-dependent
    /// effects is zero.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub session_times_s: BTreeMap<String, f64>,
    /// True if the rows have directions of approach.
    pub has_approach: bool,
    /// Standard deviation (1 σ) of a coordinate, estimated from the residuals of this or of the
    /// earlier fit. Null if the problem declares σ, or without degrees of freedom.
    pub estimated_sigma_mm: Option<f64>,
    /// Interval that contains `reduced_chi2` with probability 0.999 if the residual is only noise.
    pub chance: Option<(f64, f64)>,
    pub noise_factor: f64,
    /// Standard deviation (1 σ) of a coordinate that the fit assumed; null unless the rows measure
    /// lengths.
    pub sigma_taken_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_taken_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_taken_px: Option<f64>,
    pub rank: usize,
    #[serde(flatten)]
    pub conditioning: Conditioning,
    pub orientation: Option<Orientation>,
    pub parameters: Vec<Parameter>,
    pub unidentified: Vec<Combination>,
    /// Combinations that the data determine too weakly to be estimated.
    pub weak: Vec<Combination>,
    /// Posterior covariance of all free parameters, in the order of `parameters`. If predictions
    /// have no uncertainty, entries of a parameter without a standard error are null.
    #[schemars(with = "Vec<Vec<Option<f64>>>")]
    pub covariance: Vec<Box<RawValue>>,
    pub correlations: Vec<Correlation>,
    pub active_constraints: Vec<Constraint>,
    pub outliers: Vec<OutlierRow>,
    pub misfit_carried_by: Option<InfluentialRowSet>,
    pub cautions: Vec<String>,
    /// Findings of the checks of the fit.
    #[schemars(with = "Vec<FindingKeys>")]
    pub findings: Vec<Finding>,
    /// Comparison with the earlier estimate that was the prior; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub prior: Option<PriorUse>,
    /// Digest of each fitted row. A later identification with this estimate as prior leaves these
    /// rows out.
    #[schemars(with = "Vec<String>")]
    pub fitted_rows: Option<Box<RawValue>>,
    /// Measurement files, as the command named them; absent if the rows are of no files.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub measurement_files: Vec<String>,
    /// Remainder that corrects the predictions and errors of the identified arm; null without one.
    pub remainder: Option<Remainder>,
    /// Uncertainty of predictions without a remainder, in the form of remainder.json.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<serde_json::Value>")]
    pub prediction: Option<Box<RawValue>>,
}

/// Finding of a check of the fit.
#[derive(JsonSchema)]
#[schemars(rename = "Finding")]
#[expect(dead_code, reason = "stands for the serialised finding in schemas")]
pub(super) struct FindingKeys {
    /// Stable code; docs/findings.md explains each.
    code: String,
    /// `error`, `warning` or `note`.
    severity: String,
    /// Numbers and words of the finding, SI units.
    numbers: BTreeMap<String, serde_json::Value>,
    text: String,
    remedy: String,
}

/// Convergence of the sequential strategy, which alternates between stages.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Alternation {
    pub sweeps: u64,
    /// Factor by which one sweep without acceleration multiplies the error near the optimum.
    pub contraction: Option<f64>,
}

/// Condition number and observability indices.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Conditioning {
    pub condition_number: f64,
    /// Observability indices O1 to O5 [Sun & Hollerbach 2008].
    pub observability: BTreeMap<&'static str, f64>,
}

impl Conditioning {
    /// Summarises an identifiability analysis: its condition number, and the observability indices
    /// of the analysed parameters. `coordinates` is the number of measured coordinates.
    pub(super) fn new(found: &Identifiability, coordinates: usize) -> Self {
        let names = ["O1", "O2", "O3", "O4", "O5"];
        let observability = names.into_iter().zip(found.observability(coordinates)).collect();
        Self { condition_number: found.condition_number(), observability }
    }
}

/// Free parameter with its estimate.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Parameter {
    pub name: String,
    pub unit: Cow<'static, str>,
    pub nominal: f64,
    pub estimate: f64,
    pub std_error: Option<f64>,
    /// Bound on which the estimate rests, `lower` or `upper`.
    pub at_bound: Option<&'static str>,
    pub shadow_price: Option<Price>,
    /// Identified share, 0 to 1: part of the value that the data determine.
    pub identified: f64,
    pub fitted: bool,
    /// Standard deviation of the declared prior of the deviation, SI or of the logarithm; null
    /// without a prior.
    pub prior_sigma: Option<f64>,
}

/// Shadow price of an active limit.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Price {
    /// Lagrange multiplier of the limit.
    pub multiplier: f64,
    /// Decrease of the root mean square position residual if the limit is moved outwards by one
    /// step of the size `per`.
    pub rms_mm: f64,
    pub per: Cow<'static, str>,
}

/// Linear combination of parameters with its singular value.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Combination {
    /// Coefficient of each parameter in the combination, by the parameter's name.
    pub combination: BTreeMap<String, f64>,
    pub singular_value: f64,
}

impl Combination {
    /// Lists combinations of parameters; `name` returns the name of the parameter with an index.
    pub(super) fn all(
        combinations: &[UnidentifiableCombination],
        name: impl Fn(usize) -> String,
    ) -> Vec<Self> {
        let entry = |combination: &UnidentifiableCombination| Self {
            combination: combination.weights.iter().map(|&(k, weight)| (name(k), weight)).collect(),
            singular_value: combination.singular_value,
        };
        combinations.iter().map(entry).collect()
    }
}

/// Correlated pair of parameters.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Correlation {
    pub parameters: [String; 2],
    pub correlation: f64,
}

/// Constraint on whose limit the estimates rest.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Constraint {
    pub constraint: String,
    /// Active limit, `at_least` or `at_most`.
    pub side: &'static str,
    pub line: Option<usize>,
    pub shadow_price: Price,
}

/// Row whose residual is too large to be noise.
#[derive(Debug, Serialize, JsonSchema)]
pub struct OutlierRow {
    pub file: String,
    pub line: Option<usize>,
    /// Number of the row, from 1 over all files.
    pub pose_row: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_mm: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_px: Option<f64>,
    /// Length of the whitened residual, as a multiple of the typical scatter of all rows (their
    /// median, but at least the declared σ).
    pub sigmas: f64,
}

/// Influential rows: a few rows whose removal removes most of the misfit.
#[derive(Debug, Serialize, JsonSchema)]
pub struct InfluentialRowSet {
    pub rows: Vec<OutlierRow>,
    pub reduced_chi2_without: Option<f64>,
}

/// Errors of orientation, if it is fitted.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Orientation {
    pub registered: Errors,
    #[serde(flatten)]
    pub fitted: Errors,
    pub sigma_taken_deg: f64,
}

/// Spread of the predicted target about its mean over the rows at one point. `mean_mm` is the mean
/// distance from that mean.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Spread {
    pub mean_mm: f64,
    /// Unit vector along the largest spread, measuring frame.
    pub along: [f64; 3],
    /// Share of the squared spread along that direction, 0 to 1.
    pub share: f64,
}

impl Spread {
    /// Converts the spread of the target at a point from m to mm.
    pub(super) fn new(spread: &PointSpread) -> Self {
        Self { mean_mm: spread.mean * 1e3, along: spread.along.into(), share: spread.share }
    }
}

/// Spread of the target at a point with the registered nominal arm and with the identified arm.
#[derive(Debug, Serialize, JsonSchema)]
pub struct SpreadChange {
    pub n: usize,
    pub held_out: bool,
    pub registered_mm: f64,
    #[serde(flatten)]
    pub fitted: Spread,
}

impl IdentificationResult {
    /// Collects the result of a fit.
    pub fn new(problem: &Problem, found: &Identification) -> Self {
        let identifiability = found.identifiability();
        let unit = found.fitted.identification.unit();
        let (sigma_taken_mm, sigma_taken_deg, sigma_taken_px) =
            in_mm_deg_px(unit, found.sigma_taken);
        let name = |k: usize| found.unknowns[k].clone();
        let spread = |(before, after, held_out): &(PointSpread, PointSpread, bool)| {
            let change = SpreadChange {
                n: before.n,
                held_out: *held_out,
                registered_mm: before.mean * 1e3,
                fitted: Spread::new(after),
            };
            (before.point.clone(), change)
        };
        let correlations = found.strong_correlations().into_iter();
        Self {
            problem: problem.name.clone(),
            arm_digest: problem.digest(),
            arm_parts: problem.digest_parts(),
            strategy: found.strategy.as_str(),
            solver: found.solver.as_str(),
            solver_reason: found.solver_reason,
            termination: found.termination.as_str(),
            trusted: found.is_trusted(),
            verdict: Trust::of(found, false),
            iterations: found.iterations,
            alternation: found.alternation.map(|fit::Alternation { sweeps, contraction }| {
                Alternation { sweeps: sweeps as u64, contraction }
            }),
            seconds: found.seconds,
            registered: Errors::of(&found.registered),
            fitted: Errors::of(&found.fitted),
            kinds: KindErrors::all(&found.kinds),
            spread: found.spreads.iter().map(spread).collect(),
            reduced_chi2: found.reduced_chi2,
            first_time_s: found.start_times.first,
            session_times_s: found.start_times.sessions.clone(),
            has_approach: found.has_approach,
            estimated_sigma_mm: match found.noise {
                Noise::Declared => found.prior.as_ref().and_then(|prior| prior.estimated_sigma),
                Noise::Unknown => None,
                Noise::Estimated(sigma) => Some(sigma),
            }
            .map(|sigma| sigma * 1e3),
            chance: found.chance,
            noise_factor: found.noise_factor
                * found.prior.as_ref().map_or(1.0, |prior| prior.variance_ratio),
            sigma_taken_mm,
            sigma_taken_deg,
            sigma_taken_px,
            rank: identifiability.rank,
            conditioning: Conditioning::new(identifiability, found.coordinates),
            orientation: found.orientation.as_ref().map(Orientation::new),
            parameters: found.estimates.iter().map(Parameter::new).collect(),
            unidentified: Combination::all(&identifiability.unidentifiable, name),
            weak: Combination::all(&found.weak, name),
            covariance: covariance(found),
            correlations: correlations
                .map(|(a, b, correlation)| Correlation { parameters: [a, b], correlation })
                .collect(),
            active_constraints: found.active_constraints.iter().map(Constraint::new).collect(),
            outliers: found.outliers.iter().map(OutlierRow::new).collect(),
            misfit_carried_by: found.influential_rows.as_ref().map(InfluentialRowSet::new),
            cautions: found.reasons_to_ask(),
            findings: found.findings.clone(),
            prior: found.prior.as_ref().map(PriorUse::new),
            fitted_rows: to_raw_value(&found.fitted_rows).ok(),
            measurement_files: Vec::new(),
            remainder: None,
            prediction: None,
        }
    }

    /// Returns the result with the names of the measurement files.
    #[must_use]
    pub fn with_files(self, files: &[PathBuf]) -> Self {
        let measurement_files = files.iter().map(|file| file.display().to_string()).collect();
        Self { measurement_files, ..self }
    }

    /// Returns the result with what predictions need: posterior covariance, uncertainty, and the
    /// remainder if one was accepted, which also corrects the errors of the identified arm.
    #[must_use]
    #[doc(hidden)]
    pub fn with_predictions(self, found: &Identification, fitted: &Fitted) -> Self {
        let corrected = fitted.residuals.as_ref();
        let exceeds_bounds = fitted.held_out_test.as_ref().is_some_and(BoundTest::is_contradicted);
        Self {
            fitted: corrected.map_or(self.fitted, |corrected| Errors::of(&corrected.errors)),
            // With a prior, the covariance of the fit itself contains all earlier rows.
            covariance: if found.prior.is_some() {
                self.covariance
            } else {
                covariance_of_predictions(found)
                    .unwrap_or_else(|| remainder::covariance(found, fitted))
            },
            verdict: Trust::of(found, exceeds_bounds),
            remainder: Remainder::new(found, fitted),
            prediction: remainder::prediction(fitted),
            ..self
        }
    }
}

impl Parameter {
    fn new(estimate: &Estimate) -> Self {
        Self {
            name: estimate.name.clone(),
            unit: estimate.unit.symbol(),
            nominal: estimate.nominal,
            estimate: estimate.estimate,
            std_error: estimate.std_error,
            at_bound: estimate.at_bound.map(|bound| side(bound, ["lower", "upper"])),
            shadow_price: estimate.shadow_price.map(|price| Price::new(price, estimate.unit)),
            identified: estimate.identified,
            fitted: estimate.fitted,
            prior_sigma: estimate.prior_sigma,
        }
    }
}

impl Price {
    fn new(price: ShadowPrice, unit: Unit) -> Self {
        let (rms_mm, per) = price.in_mm(unit);
        Self { multiplier: price.multiplier, rms_mm, per }
    }
}

impl Constraint {
    fn new(active: &ActiveConstraint) -> Self {
        Self {
            constraint: active.words.clone(),
            side: side(active.side, ["at_least", "at_most"]),
            line: active.location.line,
            shadow_price: Price::new(active.shadow_price, active.unit),
        }
    }
}

impl OutlierRow {
    fn new(outlier: &Outlier) -> Self {
        let (error_mm, error_deg, error_px) =
            in_mm_deg_px(kind_named(outlier.kind).unit, outlier.error.norm());
        Self {
            file: outlier.location.file.display().to_string(),
            line: outlier.location.line,
            pose_row: outlier.row + 1,
            error_mm,
            error_deg,
            error_px,
            sigmas: outlier.distance,
        }
    }
}

impl InfluentialRowSet {
    /// Converts influential rows to a result.
    pub(super) fn new(influential: &InfluentialRows) -> Self {
        Self {
            rows: influential.rows.iter().map(OutlierRow::new).collect(),
            reduced_chi2_without: influential.reduced_chi2,
        }
    }
}

impl Orientation {
    fn new(errors: &OrientationErrors) -> Self {
        Self {
            registered: Errors::of_angles(&errors.registered),
            fitted: Errors::of_angles(&errors.fitted),
            sigma_taken_deg: errors.sigma_taken.to_degrees(),
        }
    }
}

/// Returns the rows of the covariance of the fit, with 0 for parameters that were not fitted or
/// rest on a bound. `None` if a fitted parameter has no standard error.
fn covariance_of_predictions(found: &Identification) -> Option<Vec<Box<RawValue>>> {
    let is_free = |k: usize| found.estimates[k].fitted && found.estimates[k].at_bound.is_none();
    let n = found.estimates.len();
    let is_known = (0..n).filter(|k| is_free(*k)).all(|k| found.estimates[k].std_error.is_some());
    let entry = |j: usize, k: usize| {
        if is_free(j) && is_free(k) { found.covariance.entry(j, k).unwrap_or(0.0) } else { 0.0 }
    };
    is_known.then(|| json_rows(n, entry))
}

/// Returns the word for the active side of a bound.
fn side(bound: AtBound, [lower, upper]: [&'static str; 2]) -> &'static str {
    if bound == AtBound::Lower { lower } else { upper }
}

/// Returns the rows of the estimates' covariance matrix \[product of their SI units\], each as one
/// line of JSON text. Entries of parameters without a standard error are null.
fn covariance(found: &Identification) -> Vec<Box<RawValue>> {
    let n = found.estimates.len();
    let has_error = |k: usize| found.estimates[k].std_error.is_some();
    let entry =
        |j: usize, k: usize| found.covariance.entry(j, k).filter(|_| has_error(j) && has_error(k));
    json_rows(n, entry)
}
