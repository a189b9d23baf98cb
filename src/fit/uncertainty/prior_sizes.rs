//! Prior widths (σ) of the geometry, estimated from the deviations that a fit found.
//!
//! Linearised about the fit, the likelihood of the geometric deviations x is a Gaussian with
//! information A and vector b = A x̂. The prior σ of each kind of parameter are multiplied by a
//! factor r, so that the posterior is N(C b, C) with C = (A + Λ/r²)⁻¹. The logarithm of the
//! evidence is ½ bᵀC b + ½ ln|C| − Σ ln r + constant. It is largest where r² is the posterior mean
//! of x² / σ² over the parameters of the kind.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::noise_model::by_chance;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::quantity::Unit;

/// Minimum number of parameters of a kind from which their common prior width is estimated.
const MIN_COUNT: usize = 4;
/// Minimum sum of identified shares of the parameters of a kind from which their width is
/// estimated.
const MIN_DETERMINED: f64 = 3.0;
/// Smallest ratio of the larger to the smaller one of the estimated and the declared σ at which a
/// width is reported.
const MIN_RATIO: f64 = 2.0;
/// Maximum number of steps of the search for the widths.
const MAX_STEPS: usize = 500;
/// Change of every ln r in one step below which the search for the widths has converged.
const CONVERGENCE_TOLERANCE: f64 = 1e-4;

/// Prior width (σ) of one kind of geometric parameter, common to all joints, as estimated from the
/// data.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PriorSize {
    /// Pattern of the parameters as in `[parameters]`, such as `joint*.alpha`.
    pub pattern: String,
    /// Kind of quantity of the parameters that share the prior: angle or length.
    pub unit: Unit,
    /// Number of parameters that share the prior.
    pub count: usize,
    /// Declared standard deviation (1 σ) of the prior \[SI\].
    pub declared: f64,
    /// Standard deviation (1 σ) of the prior that maximises the evidence of the data \[SI\].
    pub found: f64,
}

/// Likelihood of the geometric parameters with priors, which are in units of their declared σ:
/// information matrix A and vector b = A x̂.
struct GeometryLikelihood {
    information: DMatrix<f64>,
    vector: DVector<f64>,
}

/// Parameters of one kind with one declared σ, by their indices in the [`GeometryLikelihood`].
struct Group {
    field: JointField,
    sigma: f64,
    places: Vec<usize>,
}

/// Returns the prior widths that the data contradict: the estimated width raises the evidence
/// significantly and differs from the declared one by more than a factor of [`MIN_RATIO`].
///
/// `unknowns` have the values `x` and the `covariance`, which is 0 for unknowns that are held.
/// Widths are estimated for each kind of angle or length of the joints, such as α, with enough
/// members that all have the same declared σ.
pub(in crate::fit) fn prior_sizes(
    unknowns: &[&Parameter],
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<PriorSize> {
    let geometry: Vec<(usize, JointField, f64)> = unknowns
        .iter()
        .enumerate()
        .filter_map(|(k, parameter)| match (parameter.site, parameter.sigma) {
            // A parameter with a regressor belongs to an effect, not to the geometry.
            (ParameterSite::Joint { field, .. }, Some(sigma))
                if field.is_geometry() && parameter.regressor == Regressor::Constant =>
            {
                (covariance[(k, k)] > 0.0).then_some((k, field, sigma))
            }
            _ => None,
        })
        .collect();
    let Some(likelihood) = GeometryLikelihood::of(&geometry, x, covariance) else {
        return Vec::new();
    };
    let groups = groups(&geometry);
    let (factors, determined) = likelihood.widths(&groups, None);
    let best = likelihood.evidence(&groups, &factors);
    let contradicted = |g: &usize| {
        if factors[*g].max(1.0 / factors[*g]) <= MIN_RATIO || determined[*g] < MIN_DETERMINED {
            return false;
        }
        // The evidence of the declared width of this kind is that with the best widths of the other
        // kinds.
        let declared = likelihood.evidence(&groups, &likelihood.widths(&groups, Some(*g)).0);
        best.zip(declared).is_some_and(|(best, declared)| 2.0 * (best - declared) > by_chance())
    };
    let size = |g: usize| {
        let Group { field, sigma, places } = &groups[g];
        PriorSize {
            pattern: format!("joint*.{}", field.name()),
            unit: unknowns[geometry[places[0]].0].unit(),
            count: places.len(),
            declared: *sigma,
            found: sigma * factors[g],
        }
    };
    (0..groups.len()).filter(contradicted).map(size).collect()
}

/// Returns the groups of parameters of a kind with at least [`MIN_COUNT`] members whose declared σ
/// are all equal. `geometry` holds index, kind and σ of each parameter.
fn groups(geometry: &[(usize, JointField, f64)]) -> Vec<Group> {
    let fields = JointField::GEOMETRY.into_iter().chain(JointField::PLACEMENT);
    let group = |field: JointField| {
        let places: Vec<usize> = (0..geometry.len()).filter(|&i| geometry[i].1 == field).collect();
        let sigma = geometry[*places.first()?].2;
        let is_uniform = places.iter().all(|&i| (geometry[i].2 / sigma - 1.0).abs() < 1e-9);
        (is_uniform && places.len() >= MIN_COUNT).then_some(Group { field, sigma, places })
    };
    fields.filter_map(group).collect()
}

impl GeometryLikelihood {
    /// Creates the likelihood of the geometric parameters in `geometry` (index, kind, σ) with all
    /// other unknowns integrated out; `None` if the covariance of these parameters is singular.
    fn of(
        geometry: &[(usize, JointField, f64)],
        x: &[f64],
        covariance: &DMatrix<f64>,
    ) -> Option<Self> {
        let n = geometry.len();
        let of = |i: usize, j: usize| {
            covariance[(geometry[i].0, geometry[j].0)] / (geometry[i].2 * geometry[j].2)
        };
        let posterior = DMatrix::from_fn(n, n, of).cholesky()?.inverse();
        let vector = &posterior * DVector::from_fn(n, |i, _| x[geometry[i].0] / geometry[i].2);
        let information = posterior - DMatrix::identity(n, n);
        Some(Self { information, vector })
    }

    /// Returns covariance and mean of the posterior with the σ of each group multiplied by its
    /// factor, and ½ ln|covariance|; `None` if the precision is not positive definite.
    fn posterior(
        &self,
        groups: &[Group],
        factors: &[f64],
    ) -> Option<(DMatrix<f64>, DVector<f64>, f64)> {
        let mut precision = self.information.clone();
        let mut priors = vec![1.0; precision.nrows()];
        for (group, factor) in groups.iter().zip(factors) {
            group.places.iter().for_each(|&i| priors[i] = factor.powi(-2));
        }
        priors.iter().enumerate().for_each(|(i, prior)| precision[(i, i)] += prior);
        let factored = precision.cholesky()?;
        let half: f64 = factored.l_dirty().diagonal().iter().map(|l| l.ln()).sum();
        let covariance = factored.inverse();
        let mean = &covariance * &self.vector;
        Some((covariance, mean, -half))
    }

    /// Returns the logarithm of the evidence, up to a constant, for priors whose σ are multiplied
    /// by `factors`, one for each group; `None` if the precision is not positive definite.
    fn evidence(&self, groups: &[Group], factors: &[f64]) -> Option<f64> {
        let (_, mean, half) = self.posterior(groups, factors)?;
        let priors: f64 = groups
            .iter()
            .zip(factors)
            .map(|(group, factor)| group.places.len() as f64 * factor.ln())
            .sum();
        Some(0.5 * mean.dot(&self.vector) + half - priors)
    }

    /// Returns for each group the factor r on its σ with which the evidence is largest, and the sum
    /// of the identified shares of its parameters. The group `held` keeps r = 1.
    fn widths(&self, groups: &[Group], held: Option<usize>) -> (Vec<f64>, Vec<f64>) {
        let mut factors = vec![1.0; groups.len()];
        let mut determined = vec![0.0; groups.len()];
        for _ in 0..MAX_STEPS {
            let Some((covariance, mean, _)) = self.posterior(groups, &factors) else { break };
            let mut change: f64 = 0.0;
            for (g, Group { places, .. }) in groups.iter().enumerate() {
                let square: f64 =
                    places.iter().map(|&i| mean[i].powi(2) + covariance[(i, i)]).sum();
                let spread: f64 = places.iter().map(|&i| covariance[(i, i)]).sum();
                let next =
                    if held == Some(g) { 1.0 } else { (square / places.len() as f64).sqrt() };
                determined[g] = places.len() as f64 - spread / factors[g].powi(2);
                change = change.max((next / factors[g]).ln().abs());
                factors[g] = next;
            }
            if change < CONVERGENCE_TOLERANCE {
                break;
            }
        }
        (factors, determined)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{normal, stream};

    /// Returns the findings for eight joints whose angles deviate by about `size` and are
    /// determined to 1 % of it.
    fn found(size: f64, declared: f64) -> Vec<PriorSize> {
        let mut random = stream(7, 0);
        let parameter = |joint, field: JointField| Parameter {
            name: format!("joint{}.{}", joint + 1, field.name()),
            site: ParameterSite::Joint { joint, field },
            regressor: Regressor::Constant,
            nominal: 0.0,
            sigma: Some(declared),
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
        };
        let parameters: Vec<Parameter> =
            (0..8).map(|joint| parameter(joint, JointField::Alpha)).collect();
        let x: Vec<f64> = parameters.iter().map(|_| size * normal(&mut random)).collect();
        let variance = ((0.01 * size).powi(-2) + declared.powi(-2)).recip();
        prior_sizes(
            &parameters.iter().collect::<Vec<_>>(),
            &x,
            &(DMatrix::identity(8, 8) * variance),
        )
    }

    #[test]
    fn of_two_kinds_that_data_hardly_tell_apart_neither_is_contradicted_by_the_other() {
        let mut random = stream(3, 0);
        let n = 8;
        // The data determine only the sum of two parameters of a joint. Each has the declared σ 1,
        // and the sum deviates three times as far as the priors expect.
        let geometry: Vec<(usize, JointField, f64)> = (0..2 * n)
            .map(|k| (k, if k < n { JointField::Theta } else { JointField::Beta }, 1e-3))
            .collect();
        let mut precision = DMatrix::identity(2 * n, 2 * n);
        let mut vector = DVector::zeros(2 * n);
        for k in 0..n {
            let sum = 3.0 * 2.0_f64.sqrt() * normal(&mut random);
            for (i, j) in [(k, k), (k, k + n), (k + n, k), (k + n, k + n)] {
                precision[(i, j)] += 100.0;
            }
            (vector[k], vector[k + n]) = (100.0 * sum, 100.0 * sum);
        }
        let likelihood =
            GeometryLikelihood { information: precision - DMatrix::identity(2 * n, 2 * n), vector };
        let groups = groups(&geometry);
        let best = likelihood.evidence(&groups, &likelihood.widths(&groups, None).0).unwrap();
        for g in 0..2 {
            let held = likelihood.widths(&groups, Some(g)).0;
            assert!((held[g] - 1.0).abs() < 1e-12 && held[1 - g] > 2.0, "{held:?}");
            assert!(2.0 * (best - likelihood.evidence(&groups, &held).unwrap()) < by_chance());
        }
    }

    #[test]
    fn a_prior_far_too_wide_is_told_and_one_that_fits_is_not() {
        let told = found(1e-3, 1e-2);
        assert_eq!(told.len(), 1);
        assert_eq!((told[0].pattern.as_str(), told[0].count), ("joint*.alpha", 8));
        assert!((0.5e-3..2e-3).contains(&told[0].found), "{told:?}");
        assert!(found(1e-3, 1e-3).is_empty());
        assert_eq!(found(1e-2, 1e-3).len(), 1);
    }
}
