//! Fleet: prior of an arm from the estimates of several arms of its type.
//!
//! Arm i has deviations θᵢ ~ N(μ, T) with T diagonal: mean μ and spread τ of each parameter. Its
//! estimate is divided by its declared prior, which leaves the likelihood of its rows: information
//! matrix Λᵢ and vector hᵢ. μ has the declared prior N(0, s²). τ² has a scaled inverse χ² prior
//! with ν = ½ degree of freedom about s², or without a declared s about the mean variance of the
//! arms' estimates. This prior dominates if few arms inform on τ, so τ is a prior of the next arm
//! and no measured spread. μ and τ are found by expectation maximisation [Gelman et al. 2013, §15]:
//!
//! mᵢ = (Λᵢ + T⁻¹)⁻¹ (hᵢ + T⁻¹ μ),   Vᵢ = (Λᵢ + T⁻¹)⁻¹,   τ² = (Σ (mᵢ − μ)² + Vᵢ + ν s²) / (n + ν)

use std::collections::BTreeMap;
use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::error::PriorError;
use crate::fit::SavedEstimate;

/// Degrees of freedom ν of the prior of each variance τ².
const PRIOR_FREEDOM: f64 = 0.5;
/// Maximum number of steps of expectation maximisation.
const MAX_STEPS: usize = 500;
/// Maximum number of steps of expectation maximisation without one arm, from the result with it.
const STEPS_WITHOUT_ONE: usize = 40;
/// Largest relative change of any variance τ² in one step at which the expectation maximisation has
/// converged.
const CONVERGENCE_TOLERANCE: f64 = 1e-4;
/// Prior 1 σ of the mean μ of a parameter without a declared prior, SI or of the logarithm.
const WIDE_SIGMA: f64 = 1.0;
/// Probability with which any arm of a fleet is called unlike the others although all are alike.
const FALSE_UNLIKE_PROBABILITY: f64 = 0.01;
/// Smallest information of an arm's rows on a parameter, relative to that of the fleet, at which
/// the arm is compared in this parameter.
const MIN_LEARNED: f64 = 0.05;
/// Minimum number of arms of a fleet.
pub(super) const MIN_ARMS: usize = 3;
/// Last parts of the names of parameters whose deviation is ln(value / nominal).
const RELATIVE_FIELDS: [&str; 6] = ["stiffness", "EA", "EI", "EIy", "EIz", "GJ"];
/// First parts of the names of parameters of the measurement setup, which are no parameters of the
/// arm.
const SETUP_PREFIXES: [&str; 7] =
    ["base", "tool", "point", "anchor", "surface", "camera", "marker"];

/// Mean and spread of the parameters of arms of one type.
#[derive(Debug, Clone)]
pub struct Fleet {
    /// Name of the problem.
    pub problem: String,
    /// Digest of each part of the declared arm.
    pub arm_parts: BTreeMap<String, String>,
    /// Parameters that have a variance in the estimates of all arms.
    pub parameters: Vec<FleetParameter>,
    /// Names of parameters of the arm that are left out, because they have a variance in some
    /// estimates only.
    pub left_out: Vec<String>,
    /// Arms of the fleet, each compared with the others.
    pub arms: Vec<FleetArm>,
}

/// Parameter of the arms of a fleet; deviations from nominal, SI, or logarithms of stiffnesses.
#[derive(Debug, Clone)]
pub struct FleetParameter {
    pub name: String,
    /// Symbol of the SI unit of its value.
    pub unit: String,
    /// Nominal value, SI.
    pub nominal: f64,
    /// Mean of the deviations over the arms.
    pub mean: f64,
    /// Standard error of the mean.
    pub mean_error: f64,
    /// Standard deviation of the deviation of the next arm about the mean.
    pub spread: f64,
    /// Declared 1 σ; `None` without a prior.
    pub declared: Option<f64>,
}

/// Arm of a fleet, compared with the others.
#[derive(Debug, Clone)]
pub struct FleetArm {
    pub file: PathBuf,
    /// Name of the parameter that deviates most from the prediction by the other arms, and its
    /// signed deviation in standard deviations; `None` if the arm's rows inform on no parameter.
    pub most: Option<(String, f64)>,
    /// True if the deviation is improbable for an arm like the others.
    pub is_unlike: bool,
}

/// Likelihood of the rows of one arm, as a function of the parameters of the fleet.
struct Likelihood {
    /// Information matrix Λ.
    information: DMatrix<f64>,
    /// Vector h = Λ × (maximum-likelihood estimate).
    vector: DVector<f64>,
    /// Variance of each parameter's estimate, the declared prior included.
    variance: DVector<f64>,
}

/// Priors of mean and spread of each parameter.
struct DataSheet {
    /// Prior variance of the mean μ.
    mean: DVector<f64>,
    /// Variance s² about which τ² has its prior.
    spread: DVector<f64>,
}

impl DataSheet {
    /// Creates the priors from the declared variances. A parameter without one gets a wide prior of
    /// the mean, and the mean variance of the arms' estimates as s².
    fn new(declared: &[Option<f64>], likelihoods: &[Likelihood]) -> Self {
        let count = likelihoods.len().max(1) as f64;
        let of_estimates =
            |k: usize| likelihoods.iter().map(|arm| arm.variance[k]).sum::<f64>() / count;
        let of = |other: &dyn Fn(usize) -> f64| {
            DVector::from_fn(declared.len(), |k, _| {
                declared[k].map_or_else(|| other(k), |sigma| sigma * sigma)
            })
        };
        Self { mean: of(&|_| WIDE_SIGMA * WIDE_SIGMA), spread: of(&of_estimates) }
    }
}

/// Distribution of each parameter over the arms of a fleet.
struct FleetDistribution {
    /// Mean μ of each parameter.
    mean: DVector<f64>,
    /// Variance τ² of each parameter.
    variance: DVector<f64>,
    /// Variance of the error of each mean.
    mean_variance: DVector<f64>,
}

/// Returns true if the deviation of the parameter with this name is a logarithm.
fn is_relative(name: &str) -> bool {
    RELATIVE_FIELDS.contains(&name.rsplit('.').next().unwrap_or_default())
}

/// Returns true for a parameter of the arm, false for one of the measurement setup.
fn is_of_arm(name: &str) -> bool {
    !SETUP_PREFIXES.contains(&name.split(['.', '[']).next().unwrap_or_default())
}

/// Finds mean and spread of the parameters of several arms, from their estimates.
///
/// Bases, tools and fixtures are left out. So are parameters that have no variance in some
/// estimate, for example because they rest on a bound.
///
/// # Errors
/// Returns an error if there are fewer than three arms, if they differ in their declaration, if two
/// estimates share fitted rows, or if one has the prior of a fleet.
pub fn fleet(estimates: &[SavedEstimate]) -> Result<Fleet, PriorError> {
    let Some(first) = estimates.first().filter(|_| estimates.len() >= MIN_ARMS) else {
        return Err(PriorError::FewArms { arms: estimates.len(), least: MIN_ARMS });
    };
    for (number, estimate) in estimates.iter().enumerate() {
        let file = || estimate.file.clone();
        if let Some(part) = first.differing_part(estimate) {
            let (other, part) = (first.file.clone(), part.name);
            return Err(PriorError::OtherType { file: file(), other, part });
        }
        if estimate.posterior.includes_fleet {
            return Err(PriorError::HasFleetPrior { file: file() });
        }
        let rows = &estimate.posterior.fitted_rows;
        for other in &estimates[..number] {
            let shared = other.posterior.fitted_rows.intersection(rows).count();
            if shared > 0 {
                let other = other.file.clone();
                return Err(PriorError::SameRows { file: file(), other, rows: shared });
            }
        }
    }
    let (names, left_out) = with_variance(estimates);
    if names.is_empty() {
        return Err(PriorError::NoCovariance { file: first.file.clone() });
    }
    let declared_of = |name: &&str| {
        first.entries().find(|(other, ..)| other == name).and_then(|(_, _, sigma)| sigma)
    };
    let declared: Vec<Option<f64>> = names.iter().map(declared_of).collect();
    let likelihoods = estimates
        .iter()
        .map(|estimate| likelihood(estimate, &names, &declared))
        .collect::<Result<Vec<_>, _>>()?;
    let sheet = DataSheet::new(&declared, &likelihoods);
    let every: Vec<&Likelihood> = likelihoods.iter().collect();
    let start = (DVector::zeros(names.len()), sheet.mean.clone());
    let model = maximised(&every, &sheet, start, MAX_STEPS);
    let parameters = names.iter().enumerate().map(|(k, name)| FleetParameter {
        name: (*name).to_owned(),
        unit: first.unit_of(name).unwrap_or_default().to_owned(),
        nominal: first.nominal_of(name).unwrap_or_default(),
        mean: model.mean[k],
        mean_error: model.mean_variance[k].sqrt(),
        spread: model.variance[k].sqrt(),
        declared: declared[k],
    });
    let limit = {
        let tests = (names.len() * estimates.len()) as f64;
        Normal::standard().inverse_cdf(1.0 - 0.5 * FALSE_UNLIKE_PROBABILITY / tests)
    };
    let arms = estimates.iter().enumerate().map(|(arm, estimate)| {
        let others: Vec<&Likelihood> =
            every.iter().enumerate().filter(|(k, _)| *k != arm).map(|(_, other)| *other).collect();
        let start = (model.mean.clone(), model.variance.clone());
        let without = maximised(&others, &sheet, start, STEPS_WITHOUT_ONE);
        let most = most_different(&likelihoods[arm], &without);
        FleetArm {
            file: estimate.file.clone(),
            is_unlike: most.is_some_and(|(_, sigmas)| sigmas.abs() > limit),
            most: most.map(|(k, sigmas)| (names[k].to_owned(), sigmas)),
        }
    });
    Ok(Fleet {
        problem: first.problem_name().to_owned(),
        arm_parts: first.arm_parts.clone(),
        parameters: parameters.collect(),
        left_out,
        arms: arms.collect(),
    })
}

/// Returns the names of the arm's parameters that have a variance in every estimate, and the names
/// of those that have one in some estimates only.
fn with_variance(estimates: &[SavedEstimate]) -> (Vec<&str>, Vec<String>) {
    let has_variance = |estimate: &SavedEstimate, name: &str| {
        let place = estimate.entries().position(|(other, ..)| other == name);
        place.is_some_and(|k| estimate.posterior.covariance[(k, k)] > 0.0)
    };
    let mut names: Vec<&str> = Vec::new();
    for (name, ..) in estimates.iter().flat_map(SavedEstimate::entries) {
        if is_of_arm(name) && !names.contains(&name) {
            names.push(name);
        }
    }
    names.retain(|name| estimates.iter().any(|estimate| has_variance(estimate, name)));
    let (kept, left_out): (Vec<&str>, Vec<&str>) = names
        .into_iter()
        .partition(|name| estimates.iter().all(|estimate| has_variance(estimate, name)));
    (kept, left_out.into_iter().map(str::to_owned).collect())
}

/// Returns the likelihood of the rows of an arm as a function of the parameters `names`: the
/// posterior divided by the declared prior.
fn likelihood(
    estimate: &SavedEstimate,
    names: &[&str],
    declared: &[Option<f64>],
) -> Result<Likelihood, PriorError> {
    let place = |name: &&str| estimate.entries().position(|(other, ..)| other == *name);
    let places: Option<Vec<usize>> = names.iter().map(place).collect();
    let places = places.ok_or(PriorError::NoCovariance { file: estimate.file.clone() })?;
    let values: Vec<f64> = estimate.entries().map(|(_, value, _)| value).collect();
    let nominal = |name: &str| estimate.nominal_of(name).unwrap_or_default();
    let deviation = |i: usize| {
        let (value, nominal) = (values[places[i]], nominal(names[i]));
        if is_relative(names[i]) { (value / nominal).ln() } else { value - nominal }
    };
    let slope =
        |i: usize| if is_relative(names[i]) { values[places[i]].abs().recip() } else { 1.0 };
    let n = names.len();
    let covariance = DMatrix::from_fn(n, n, |i, j| {
        estimate.posterior.covariance[(places[i], places[j])] * slope(i) * slope(j)
    });
    let scale = covariance.diagonal().map(f64::sqrt);
    let correlation = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (scale[i] * scale[j]));
    let inverse = correlation
        .cholesky()
        .map(|factor| factor.inverse())
        .ok_or(PriorError::NoCovariance { file: estimate.file.clone() })?;
    let total = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] / (scale[i] * scale[j]));
    let vector = &total * DVector::from_fn(n, |i, _| deviation(i));
    let prior = |i: usize| declared[i].map_or(0.0, |sigma| sigma.powi(-2));
    let mut scaled = DMatrix::from_fn(n, n, |i, j| {
        let entry = total[(i, j)] - if i == j { prior(i) } else { 0.0 };
        entry * scale[i] * scale[j]
    });
    // Rounding must not make the information negative.
    let eigen = scaled.clone().symmetric_eigen();
    let positive = eigen.eigenvalues.map(|value| value.max(0.0));
    scaled =
        &eigen.eigenvectors * DMatrix::from_diagonal(&positive) * eigen.eigenvectors.transpose();
    let information = DMatrix::from_fn(n, n, |i, j| scaled[(i, j)] / (scale[i] * scale[j]));
    Ok(Likelihood { information, vector, variance: covariance.diagonal() })
}

/// Returns posterior mean and covariance of the deviations of one arm, given mean and variance of
/// the fleet; `None` if the covariance is not positive definite.
fn conditioned(
    arm: &Likelihood,
    mean: &DVector<f64>,
    variance: &DVector<f64>,
) -> Option<(DVector<f64>, DMatrix<f64>)> {
    let n = mean.len();
    // In units of the spread: (I + τ Λ τ) z = τ (h − Λ μ).
    let spread = variance.map(f64::sqrt);
    let matrix = DMatrix::from_fn(n, n, |i, j| {
        spread[i] * arm.information[(i, j)] * spread[j] + f64::from(u8::from(i == j))
    });
    let pull = (&arm.vector - &arm.information * mean).component_mul(&spread);
    let factor = matrix.cholesky()?;
    let moved = factor.solve(&pull).component_mul(&spread);
    let inverse = factor.inverse();
    let covariance = DMatrix::from_fn(n, n, |i, j| spread[i] * inverse[(i, j)] * spread[j]);
    Some((mean + moved, covariance))
}

/// Finds mean and spread by expectation maximisation, starting from a mean and a variance.
fn maximised(
    arms: &[&Likelihood],
    sheet: &DataSheet,
    (mut mean, mut variance): (DVector<f64>, DVector<f64>),
    max_steps: usize,
) -> FleetDistribution {
    let (n, count) = (mean.len(), arms.len() as f64);
    let mut mean_variance = DVector::zeros(n);
    for _ in 0..max_steps {
        let found: Vec<_> =
            arms.iter().filter_map(|arm| conditioned(arm, &mean, &variance)).collect();
        // Posterior mean of μ, given the deviations of the arms.
        let mut sum = DVector::zeros(n);
        let mut inside = DVector::zeros(n);
        for (arm_mean, covariance) in &found {
            sum += arm_mean;
            inside += covariance.diagonal();
        }
        let mut next = DVector::zeros(n);
        for k in 0..n {
            let precision = count / variance[k] + sheet.mean[k].recip();
            next[k] = sum[k] / variance[k] / precision;
            // Arms whose rows hardly inform on the parameter hardly inform on its mean.
            let informed = (count - inside[k] / variance[k]).max(0.0);
            mean_variance[k] = (informed / variance[k] + sheet.mean[k].recip()).recip();
        }
        let mut change = 0.0_f64;
        for k in 0..n {
            let around: f64 = found.iter().map(|(arm, _)| (arm[k] - next[k]).powi(2)).sum();
            let now =
                (around + inside[k] + PRIOR_FREEDOM * sheet.spread[k]) / (count + PRIOR_FREEDOM);
            change = change.max((now / variance[k] - 1.0).abs());
            variance[k] = now;
        }
        mean = next;
        if change < CONVERGENCE_TOLERANCE {
            break;
        }
    }
    FleetDistribution { mean, variance, mean_variance }
}

/// Returns the index of the parameter in which the rows of an arm differ most from the fleet, and
/// the signed difference in standard deviations; `None` if the rows inform on no parameter.
fn most_different(arm: &Likelihood, fleet: &FleetDistribution) -> Option<(usize, f64)> {
    let prior = &fleet.variance + &fleet.mean_variance;
    let (mean, covariance) = conditioned(arm, &fleet.mean, &prior)?;
    let differences = (0..mean.len()).filter_map(|k| {
        let learned = covariance[(k, k)].recip() - prior[k].recip();
        if learned * prior[k] < MIN_LEARNED {
            return None;
        }
        let data = (mean[k] / covariance[(k, k)] - fleet.mean[k] / prior[k]) / learned;
        Some((k, (data - fleet.mean[k]) / (learned.recip() + prior[k]).sqrt()))
    });
    differences.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}
