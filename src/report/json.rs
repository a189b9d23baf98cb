//! `estimate.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::identify::{ActiveConstraint, AxisValues, ErrorSummary, Errors, Estimate, Identification, Noise, Outlier};
use crate::least_squares::solver::AtBound;
use crate::least_squares::{BlindCombination, Identifiability};
use crate::problem::Problem;

/// An error summary in millimetres.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    n: usize,
    mean_mm: Axes,
    max_mm: Axes,
    rms_mm: Axes,
}

#[derive(Debug, Serialize)]
struct Axes {
    x: f64,
    y: f64,
    z: f64,
    norm: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct Both {
    identification: Summary,
    held_out: Summary,
}

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    /// Of everything declared that predictions depend on.
    arm_digest: String,
    strategy: &'a str,
    solver: &'a str,
    solver_reason: Option<&'a str>,
    termination: &'a str,
    trusted: bool,
    iterations: u64,
    seconds: f64,
    registered: Both,
    #[serde(flatten)]
    fitted: Both,
    reduced_chi2: Option<f64>,
    /// 1 σ per coordinate where the problem declares none [mm].
    estimated_sigma_mm: Option<f64>,
    /// By how much the assumed variance was raised for the standard errors.
    noise_factor: f64,
    rank: usize,
    condition_number: f64,
    observability: Observability,
    parameters: Vec<ParameterEntry<'a>>,
    unidentified: Vec<Unidentified<'a>>,
    correlations: Vec<Correlation<'a>>,
    active_constraints: Vec<ActiveEntry<'a>>,
    outliers: Vec<OutlierEntry>,
}

#[derive(Debug, Serialize)]
#[serde(rename_all = "UPPERCASE")]
pub(super) struct Observability {
    o1: f64,
    o2: f64,
    o3: f64,
    o4: f64,
    o5: f64,
}

#[derive(Debug, Serialize)]
struct ParameterEntry<'a> {
    name: &'a str,
    unit: &'a str,
    nominal: f64,
    estimate: f64,
    std_error: Option<f64>,
    at_bound: Option<&'a str>,
    identified: f64,
    fitted: bool,
}

#[derive(Debug, Serialize)]
pub(super) struct Unidentified<'a> {
    combination: BTreeMap<&'a str, f64>,
    singular_value: f64,
}

#[derive(Debug, Serialize)]
struct Correlation<'a> {
    parameters: [&'a str; 2],
    correlation: f64,
}

#[derive(Debug, Serialize)]
struct ActiveEntry<'a> {
    constraint: &'a str,
    side: &'a str,
    line: Option<usize>,
}

impl Observability {
    pub(super) fn of(found: &Identifiability, coordinates: usize) -> Self {
        let [o1, o2, o3, o4, o5] = found.observability(coordinates);
        Self { o1, o2, o3, o4, o5 }
    }
}

impl<'a> Unidentified<'a> {
    /// Every blind combination, by the names of the unknowns.
    pub(super) fn all(found: &Identifiability, name: impl Fn(usize) -> &'a str) -> Vec<Self> {
        let entry = |blind: &BlindCombination| Unidentified {
            combination: blind.weights.iter().map(|&(k, weight)| (name(k), weight)).collect(),
            singular_value: blind.singular_value,
        };
        found.blind.iter().map(entry).collect()
    }
}

impl<'a> From<&'a ActiveConstraint> for ActiveEntry<'a> {
    fn from(active: &'a ActiveConstraint) -> Self {
        let side = match active.side {
            AtBound::Lower => "at_least",
            AtBound::Upper => "at_most",
        };
        Self { constraint: &active.words, side, line: active.location.line }
    }
}

#[derive(Debug, Serialize)]
struct OutlierEntry {
    file: String,
    line: Option<usize>,
    /// Counted from 1 over all files.
    pose_row: usize,
    error_mm: f64,
    sigmas: f64,
}

impl From<&Outlier> for OutlierEntry {
    fn from(outlier: &Outlier) -> Self {
        let Outlier { row, location, distance, error } = outlier;
        Self {
            file: location.file.display().to_string(),
            line: location.line,
            pose_row: row + 1,
            error_mm: error.norm() * 1e3,
            sigmas: *distance,
        }
    }
}

impl From<&AxisValues> for Axes {
    fn from(values: &AxisValues) -> Self {
        let AxisValues { x, y, z, norm } = values;
        Self { x: x * 1e3, y: y * 1e3, z: z * 1e3, norm: norm * 1e3 }
    }
}

impl From<&ErrorSummary> for Summary {
    fn from(summary: &ErrorSummary) -> Self {
        let ErrorSummary { n, mean, max, rms, .. } = summary;
        Self { n: *n, mean_mm: mean.into(), max_mm: max.into(), rms_mm: rms.into() }
    }
}

impl From<&Errors> for Both {
    fn from(errors: &Errors) -> Self {
        Self { identification: (&errors.identification).into(), held_out: (&errors.held_out).into() }
    }
}

impl<'a> From<&'a Estimate> for ParameterEntry<'a> {
    fn from(estimate: &'a Estimate) -> Self {
        Self {
            name: &estimate.name,
            unit: estimate.unit.symbol(),
            nominal: estimate.nominal,
            estimate: estimate.estimate,
            std_error: estimate.std_error,
            at_bound: estimate.at_bound.map(|bound| match bound {
                AtBound::Lower => "lower",
                AtBound::Upper => "upper",
            }),
            identified: estimate.identified,
            fitted: estimate.fitted,
        }
    }
}

/// The result of an identification as JSON text, ending in a line break; SI units except where a key says otherwise.
pub fn estimate_json(problem: &Problem, result: &Identification) -> String {
    let identifiability = &result.identifiability;
    let document = Document {
        problem: &problem.name,
        arm_digest: problem.digest(),
        strategy: result.strategy.as_str(),
        solver: result.solver.as_str(),
        solver_reason: result.solver_reason,
        termination: result.termination.as_str(),
        trusted: result.is_trusted(),
        iterations: result.iterations,
        seconds: result.seconds,
        registered: (&result.registered).into(),
        fitted: (&result.fitted).into(),
        reduced_chi2: result.reduced_chi2,
        estimated_sigma_mm: match result.noise {
            Noise::Declared | Noise::Unknown => None,
            Noise::Estimated(sigma) => Some(sigma * 1e3),
        },
        noise_factor: result.noise_factor,
        rank: identifiability.rank,
        condition_number: identifiability.condition_number(),
        observability: Observability::of(identifiability, result.coordinates),
        parameters: result.estimates.iter().map(ParameterEntry::from).collect(),
        unidentified: Unidentified::all(identifiability, |k| result.unknowns[k].as_str()),
        correlations: result
            .correlations
            .iter()
            .map(|(a, b, correlation)| Correlation { parameters: [a, b], correlation: *correlation })
            .collect(),
        active_constraints: result.active_constraints.iter().map(ActiveEntry::from).collect(),
        outliers: result.outliers.iter().map(OutlierEntry::from).collect(),
    };
    to_text(&document)
}

/// JSON text that ends in a line break; text keys and numbers always serialise, numbers that are not finite as null.
pub(super) fn to_text(document: &impl Serialize) -> String {
    let mut text = serde_json::to_string_pretty(document).unwrap_or_default();
    text.push('\n');
    text
}
