//! How wide the priors of an arm's geometry are, as the deviations that a fit found speak for it.
//!
//! About the fit the data say of the geometry x as much as a Gaussian with information A and vector
//! b = A x̂. With priors of σ r, r one factor for all parameters of a kind, the posterior is N(C b,
//! C), C = (A + Λ/r²)⁻¹, and the logarithm of the evidence is ½ bᵀC b + ½ ln|C| − Σ ln r but for a
//! constant. Its maximum is where r² is the mean of (E x² over σ²) of the kind.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::noise_model::by_chance;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::quantity::Unit;

/// Fewest parameters of a kind that say how large they are.
const LEAST_COUNT: usize = 4;
/// Fewest of a kind that the data decide, counted in parts.
const LEAST_DECIDED: f64 = 3.0;
/// A prior is another where its σ is so many times as large, or as small.
const TIMES: f64 = 2.0;
/// Steps of the search at most.
const MOST_STEPS: usize = 500;
/// It has settled when no ln r changes by more.
const SETTLED: f64 = 1e-4;

/// The width that the data speak for, of the prior of one kind of geometry at all joints.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PriorSize {
    /// A pattern of `[parameters]`: `joint*.alpha`.
    pub pattern: String,
    /// Kind of quantity: angle or length.
    pub unit: Unit,
    /// How many parameters it is of.
    pub count: usize,
    /// 1 σ as declared, SI.
    pub declared: f64,
    /// 1 σ of the greatest evidence, SI.
    pub found: f64,
}

/// What the data say of the geometry that has priors, in units of its declared σ.
struct Sight {
    information: DMatrix<f64>,
    vector: DVector<f64>,
}

/// A kind of parameters, and their places among those of a [`Sight`].
struct Group {
    field: JointField,
    sigma: f64,
    places: Vec<usize>,
}

/// The widths that the data contradict: those by which the evidence grows beyond what chance gives,
/// and at least [`TIMES`] off.
///
/// `unknowns` with their values x and their covariance, 0 where one is held; angles and lengths of
/// joints with one declared σ count, a kind with few of them does not.
pub(in crate::fit) fn prior_sizes(
    unknowns: &[&Parameter],
    x: &[f64],
    covariance: &DMatrix<f64>,
) -> Vec<PriorSize> {
    let seen: Vec<(usize, JointField, f64)> = unknowns
        .iter()
        .enumerate()
        .filter_map(|(k, own)| match (own.site, own.sigma) {
            // What a regressor drives is an effect's, not the geometry's.
            (ParameterSite::Joint { field, .. }, Some(sigma))
                if field.is_geometry() && own.regressor == Regressor::Constant =>
            {
                (covariance[(k, k)] > 0.0).then_some((k, field, sigma))
            }
            _ => None,
        })
        .collect();
    let Some(sight) = Sight::of(&seen, x, covariance) else { return Vec::new() };
    let groups = groups(&seen);
    let (factors, decided) = sight.widths(&groups, None);
    let best = sight.evidence(&groups, &factors);
    let contradicted = |g: &usize| {
        if factors[*g].max(1.0 / factors[*g]) <= TIMES || decided[*g] < LEAST_DECIDED {
            return false;
        }
        // The other kinds as wide as is best beside this one as declared.
        let declared = sight.evidence(&groups, &sight.widths(&groups, Some(*g)).0);
        best.zip(declared).is_some_and(|(best, declared)| 2.0 * (best - declared) > by_chance())
    };
    let size = |g: usize| {
        let Group { field, sigma, places } = &groups[g];
        PriorSize {
            pattern: format!("joint*.{}", field.name()),
            unit: unknowns[seen[places[0]].0].unit(),
            count: places.len(),
            declared: *sigma,
            found: sigma * factors[g],
        }
    };
    (0..groups.len()).filter(contradicted).map(size).collect()
}

/// The kinds of which there are enough, all of one declared σ.
fn groups(seen: &[(usize, JointField, f64)]) -> Vec<Group> {
    let fields = JointField::GEOMETRY.into_iter().chain(JointField::PLACEMENT);
    let group = |field: JointField| {
        let places: Vec<usize> = (0..seen.len()).filter(|&i| seen[i].1 == field).collect();
        let sigma = seen[*places.first()?].2;
        let alike = places.iter().all(|&i| (seen[i].2 / sigma - 1.0).abs() < 1e-9);
        (alike && places.len() >= LEAST_COUNT).then_some(Group { field, sigma, places })
    };
    fields.filter_map(group).collect()
}

impl Sight {
    /// Of some unknowns with all others integrated out; `None` where their covariance is singular.
    fn of(seen: &[(usize, JointField, f64)], x: &[f64], covariance: &DMatrix<f64>) -> Option<Self> {
        let n = seen.len();
        let of = |i: usize, j: usize| covariance[(seen[i].0, seen[j].0)] / (seen[i].2 * seen[j].2);
        let posterior = DMatrix::from_fn(n, n, of).cholesky()?.inverse();
        let vector = &posterior * DVector::from_fn(n, |i, _| x[seen[i].0] / seen[i].2);
        let information = posterior - DMatrix::identity(n, n);
        Some(Self { information, vector })
    }

    /// Covariance and mean of the posterior, and half the logarithm of the determinant of its
    /// covariance.
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

    fn evidence(&self, groups: &[Group], factors: &[f64]) -> Option<f64> {
        let (_, mean, half) = self.posterior(groups, factors)?;
        let priors: f64 = groups
            .iter()
            .zip(factors)
            .map(|(own, factor)| own.places.len() as f64 * factor.ln())
            .sum();
        Some(0.5 * mean.dot(&self.vector) + half - priors)
    }

    /// The factors of the greatest evidence, that of a kind `held` staying 1, and how many
    /// parameters of each kind the data decide.
    fn widths(&self, groups: &[Group], held: Option<usize>) -> (Vec<f64>, Vec<f64>) {
        let mut factors = vec![1.0; groups.len()];
        let mut decided = vec![0.0; groups.len()];
        for _ in 0..MOST_STEPS {
            let Some((covariance, mean, _)) = self.posterior(groups, &factors) else { break };
            let mut change: f64 = 0.0;
            for (g, Group { places, .. }) in groups.iter().enumerate() {
                let square: f64 =
                    places.iter().map(|&i| mean[i].powi(2) + covariance[(i, i)]).sum();
                let spread: f64 = places.iter().map(|&i| covariance[(i, i)]).sum();
                let next =
                    if held == Some(g) { 1.0 } else { (square / places.len() as f64).sqrt() };
                decided[g] = places.len() as f64 - spread / factors[g].powi(2);
                change = change.max((next / factors[g]).ln().abs());
                factors[g] = next;
            }
            if change < SETTLED {
                break;
            }
        }
        (factors, decided)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{normal, stream};

    /// Eight joints whose angles deviate by about `size` and are seen to 1 % of it.
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
        let all: Vec<Parameter> = (0..8).map(|joint| parameter(joint, JointField::Alpha)).collect();
        let x: Vec<f64> = all.iter().map(|_| size * normal(&mut random)).collect();
        let variance = ((0.01 * size).powi(-2) + declared.powi(-2)).recip();
        prior_sizes(&all.iter().collect::<Vec<_>>(), &x, &(DMatrix::identity(8, 8) * variance))
    }

    #[test]
    fn of_two_kinds_that_data_hardly_tell_apart_neither_is_contradicted_by_the_other() {
        let mut random = stream(3, 0);
        let n = 8;
        // Only the sum of both at a joint is seen, 1 of each kind as declared, and it deviates
        // three times as far.
        let seen: Vec<(usize, JointField, f64)> = (0..2 * n)
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
        let sight = Sight { information: precision - DMatrix::identity(2 * n, 2 * n), vector };
        let groups = groups(&seen);
        let best = sight.evidence(&groups, &sight.widths(&groups, None).0).unwrap();
        for g in 0..2 {
            let held = sight.widths(&groups, Some(g)).0;
            assert!((held[g] - 1.0).abs() < 1e-12 && held[1 - g] > 2.0, "{held:?}");
            assert!(2.0 * (best - sight.evidence(&groups, &held).unwrap()) < by_chance());
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
