//! Linear fits with known structure in their residuals.

use flexcal::residual_tests::{
    Covariate, CovariateValues, FitResidual, ResidualTest, ResidualTests, Test, test_residual,
};
use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal, StudentT};
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF as _};

/// Linear fit with 3 N data, p unknowns and strong leverage.
pub struct Linear {
    pub jacobian: DMatrix<f64>,
    /// Standard deviation of each unknown's prior.
    pub prior: Option<f64>,
    pub fitted: DMatrix<f64>,
    pub covariates: Vec<CovariateValues>,
    pub time: Vec<f64>,
    pub session: Vec<usize>,
    pub setup: Vec<usize>,
    pub sigma_is_declared: bool,
    /// Random generator of the noise.
    pub random: ChaCha8Rng,
}

impl Linear {
    /// Creates columns that are smooth in the covariates; rows of some poses are many times larger
    /// than others.
    pub fn new(poses: usize, unknowns: usize, prior: Option<f64>, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let joints = 6;
        let angles: Vec<Vec<f64>> = (0..joints)
            .map(|_| (0..poses).map(|_| random.random_range(-1.5..1.5)).collect())
            .collect();
        let reach: Vec<f64> = (0..poses).map(|_| (0.7 * normal(&mut random)).exp()).collect();
        let mut jacobian = DMatrix::zeros(3 * poses, unknowns);
        for j in 0..unknowns {
            let waves: [[f64; 6]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| 0.8 * normal(&mut random)));
            let phases: [f64; 3] = std::array::from_fn(|_| random.random_range(0.0..6.3));
            for pose in 0..poses {
                for axis in 0..3 {
                    let phase: f64 =
                        (0..joints).map(|k| waves[axis][k] * angles[k][pose]).sum::<f64>()
                            + phases[axis];
                    jacobian[(3 * pose + axis, j)] = phase.sin() * reach[pose];
                }
            }
        }
        let fitted = factor(&jacobian, prior);
        let mut covariates: Vec<CovariateValues> = angles
            .into_iter()
            .enumerate()
            .map(|(k, values)| CovariateValues { covariate: Covariate::Command(k), values })
            .collect();
        let payload = (0..poses).map(|_| f64::from(random.random_range(0..3_u8))).collect();
        covariates.push(CovariateValues { covariate: Covariate::Payload, values: payload });
        covariates.push(CovariateValues { covariate: Covariate::Approach(1), values: reach });
        let time: Vec<f64> = (0..poses).map(|pose| pose as f64).collect();
        covariates.push(CovariateValues { covariate: Covariate::Time, values: time.clone() });
        let (session, setup) = (vec![0; poses], (0..poses).collect());
        Self {
            jacobian,
            prior,
            fitted,
            covariates,
            time,
            session,
            setup,
            sigma_is_declared: true,
            random,
        }
    }

    pub fn poses(&self) -> usize {
        self.time.len()
    }

    pub fn noise(&mut self) -> DVector<f64> {
        DVector::from_fn(3 * self.poses(), |_, _| normal(&mut self.random))
    }

    /// Returns the residual of data; with priors, true unknowns are drawn from them.
    pub fn leaves(&mut self, mut data: DVector<f64>) -> DVector<f64> {
        let p = self.jacobian.ncols();
        if let Some(sigma) = self.prior {
            let truth = DVector::from_fn(p, |_, _| sigma * normal(&mut self.random));
            data += &self.jacobian * truth;
        }
        let taken = self.fitted.tr_mul(&data);
        data - &self.fitted * taken
    }

    pub fn check(&self, residual: &DVector<f64>) -> ResidualTests {
        test_residual(&self.fit(residual), 0.01, 7)
    }

    pub fn fit<'a>(&'a self, residual: &'a DVector<f64>) -> FitResidual<'a> {
        FitResidual {
            coordinates: &[],
            residual,
            fitted: &self.fitted,
            sigma_is_declared: self.sigma_is_declared,
            time: &self.time,
            session: &self.session,
            setup: &self.setup,
            covariates: &self.covariates,
        }
    }

    pub fn covariate(&self, of: &Covariate) -> &[f64] {
        &self.covariates.iter().find(|known| known.covariate == *of).unwrap().values
    }

    /// Adds a displacement that is a function of the pose.
    pub fn displace(data: &mut DVector<f64>, by: impl Fn(usize) -> Vector3<f64>) {
        for pose in 0..data.len() / 3 {
            let mut at = data.fixed_rows_mut::<3>(3 * pose);
            at += by(pose);
        }
    }
}

pub fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Returns the data rows of Q of [J; prior rows].
pub fn factor(jacobian: &DMatrix<f64>, prior: Option<f64>) -> DMatrix<f64> {
    let (rows, p) = jacobian.shape();
    let mut stack = DMatrix::zeros(rows + if prior.is_some() { p } else { 0 }, p);
    stack.rows_mut(0, rows).copy_from(jacobian);
    if let Some(sigma) = prior {
        stack.rows_mut(rows, p).fill_diagonal(sigma.recip());
    }
    stack.qr().q().rows(0, rows).into_owned()
}

pub fn noise_only(
    poses: usize,
    unknowns: usize,
    prior: Option<f64>,
) -> impl Fn(u64) -> (Linear, DVector<f64>) + Sync {
    move |seed| {
        let mut linear = Linear::new(poses, unknowns, prior, 1000 + seed);
        let noise = linear.noise();
        let residual = linear.leaves(noise);
        (linear, residual)
    }
}

/// Creates noise from Student's t with 3 degrees of freedom, σ not declared.
pub fn heavy_tails(poses: usize, unknowns: usize) -> impl Fn(u64) -> (Linear, DVector<f64>) + Sync {
    move |seed| {
        let mut linear = Linear::new(poses, unknowns, None, 2000 + seed);
        linear.sigma_is_declared = false;
        let t = StudentT::new(3.0).unwrap();
        let noise = DVector::from_fn(3 * poses, |_, _| t.sample(&mut linear.random));
        let residual = linear.leaves(noise);
        (linear, residual)
    }
}

/// Creates noise twice as large at every other pose, σ not declared.
pub fn uneven(seed: u64) -> (Linear, DVector<f64>) {
    let mut linear = Linear::new(28, 32, None, 3000 + seed);
    linear.sigma_is_declared = false;
    let mut noise = linear.noise();
    noise
        .iter_mut()
        .enumerate()
        .filter(|(row, _)| row / 3 % 2 == 0)
        .for_each(|(_, value)| *value *= 2.0);
    let residual = linear.leaves(noise);
    (linear, residual)
}

/// Tests a smooth function of one covariate with an amplitude of `size` σ of noise.
pub fn driven(poses: usize, unknowns: usize, size: f64, seed: u64) -> ResidualTests {
    let mut linear = Linear::new(poses, unknowns, None, 4000 + seed);
    linear.sigma_is_declared = false;
    let mut data = linear.noise();
    let covariate = linear.covariate(&Covariate::Command(1)).to_vec();
    Linear::displace(&mut data, |pose| {
        size * (2.0 * covariate[pose]).sin() * Vector3::new(1.0, 0.5, -1.0)
    });
    let residual = linear.leaves(data);
    linear.check(&residual)
}

pub fn find<'a>(findings: &'a ResidualTests, test: &Test) -> &'a ResidualTest {
    findings.tests.iter().find(|check| check.test == *test).unwrap()
}

pub fn outliers(findings: &ResidualTests) -> &ResidualTest {
    findings.tests.iter().find(|check| check.name() == "outliers").unwrap()
}

/// Returns the number of `problems` with an event of probability `rate` that is exceeded once in
/// about 10 000 tests.
pub fn at_most(problems: u64, rate: f64) -> usize {
    let binomial = Binomial::new(rate, problems).unwrap();
    usize::try_from(binomial.inverse_cdf(1.0 - 1e-4)).unwrap()
}

/// Counts the problems for which `holds` is true.
pub fn count(problems: u64, holds: impl Fn(u64) -> bool + Sync) -> usize {
    (0..problems).into_par_iter().filter(|&seed| holds(seed)).count()
}
