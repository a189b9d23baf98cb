//! Marginal likelihood of the hyperparameters, with the free parameters integrated out.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::kernel::{Hyperparameters, covariance, matern, squared_distance};
use super::prior::ParameterPrior;
use super::rows::{AXES, Inputs, Rows};
use crate::numeric::{gram, inverse_lower, lower_factor, product};

/// 1 σ of ln ℓ about 0: lengths of 0.05 to 20 rad lie within two of them.
const LENGTH_SPREAD: f64 = 1.5;
/// 1 σ of ln a about the logarithm of the residual's size.
const AMPLITUDE_SPREAD: f64 = 3.0;
/// Bounds of ln ℓ, ln 0.02 and ln 8.
const LENGTH_BOUNDS: (f64, f64) = (-3.912_023, 2.079_441_5);
/// Bounds of ln a, of ln σ and of ln σ_c about the logarithm of the residual's size.
const AMPLITUDE_BOUNDS: (f64, f64) = (-7.0, 2.0);
const NOISE_BOUNDS: (f64, f64) = (-4.0, 2.0);

/// Negative logarithm of the marginal likelihood and of the priors on hyperparameters, as a
/// function of their logarithms.
///
/// r = J δ + f + ε with δ ~ N(m, S), f ~ GP(0, K_f), ε ~ N(0, N): with y = r − J m, C = K_f + N and
/// K = C + J S Jᵀ it is ½ yᵀK⁻¹y + ½ ln det K. J S Jᵀ is never formed: with H = I + S½JᵀC⁻¹J S½,
/// K⁻¹ = C⁻¹ − C⁻¹J S½ H⁻¹ S½JᵀC⁻¹ and det K = det C det H.
pub(super) struct MarginalLikelihood<'a> {
    rows: &'a Rows,
    inputs: &'a Inputs,
    /// r − J m.
    target: DVector<f64>,
    /// J S½.
    scaled: DMatrix<f64>,
    /// Number of sites that err; 0 without a remainder.
    sites: usize,
    /// True where rows of one configuration may share noise.
    shares_noise: bool,
    /// Logarithm of the root mean square of a residual's length \[ln m\].
    size: f64,
}

impl<'a> MarginalLikelihood<'a> {
    /// Prepares the likelihood of these rows.
    pub fn new(
        (rows, inputs): (&'a Rows, &'a Inputs),
        prior: &ParameterPrior,
        (sites, shares_noise): (usize, bool),
        size: f64,
    ) -> Self {
        let (target, scaled) = prior.reduce(rows);
        Self { rows, inputs, target, scaled, sites, shares_noise, size: size.ln() }
    }

    /// Number of hyperparameters: amplitudes of both families, two lengths, σ, σ_c.
    pub fn len(&self) -> usize {
        let kernel = if self.sites == 0 { 0 } else { 2 * self.sites + 2 };
        kernel + 1 + usize::from(self.shares_noise)
    }

    /// Logarithms of hyperparameters to start from, with these lengths ℓᵤ and ℓᵥ.
    pub fn start(&self, lengths: [f64; 2]) -> DVector<f64> {
        let amplitudes = 2 * self.sites;
        let amplitude = self.size - 0.5 * (amplitudes.max(1) as f64).ln();
        DVector::from_fn(self.len(), |k, _| match k {
            k if k < amplitudes => amplitude,
            k if self.sites > 0 && k < amplitudes + 2 => lengths[k - amplitudes].ln(),
            k if k + 1 == self.len() && self.shares_noise => self.size + 0.3_f64.ln(),
            _ => self.size + 0.7_f64.ln(),
        })
    }

    /// Bounds of the logarithms.
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        let about = |(low, high)| (self.size + low, self.size + high);
        let bound = |k| match k {
            k if k < 2 * self.sites => about(AMPLITUDE_BOUNDS),
            k if self.sites > 0 && k < 2 * self.sites + 2 => LENGTH_BOUNDS,
            _ => about(NOISE_BOUNDS),
        };
        (0..self.len()).map(bound).collect()
    }

    /// Hyperparameters from their logarithms.
    pub fn hyperparameters(&self, logarithms: &DVector<f64>) -> Hyperparameters {
        let value = |k: usize| logarithms[k].exp();
        let noise = if self.sites == 0 { 0 } else { 2 * self.sites + 2 };
        let lengths = [0, 1].map(|k| if self.sites == 0 { 1.0 } else { value(noise - 2 + k) });
        Hyperparameters {
            single: (0..self.sites).map(value).collect(),
            joint: (self.sites..2 * self.sites).map(value).collect(),
            lengths,
            noise: value(noise),
            shared_noise: if self.shares_noise { value(noise + 1) } else { 0.0 },
        }
    }

    /// Value and gradient; `None` where the covariance is not positive definite.
    pub fn value_and_gradient(&self, logarithms: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let hyper = self.hyperparameters(logarithms);
        let mut matrix = covariance(&hyper, self.inputs, self.rows, self.rows);
        self.add_noise(&hyper, &mut matrix);
        let lower = lower_factor(matrix)?;
        let log_det_c = 2.0 * lower.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let inverse = inverse_lower(&lower);
        // C⁻¹J S½ and H.
        let whitened = product(&inverse, &self.scaled);
        let n = self.scaled.ncols();
        let outer = lower_factor(DMatrix::identity(n, n) + gram(&whitened))?;
        let log_det_h = 2.0 * outer.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let mut inverse = gram(&inverse);
        let reach = product(&inverse, &self.scaled);
        let reach = product(&reach, &inverse_lower(&outer).transpose());
        inverse -= product(&reach, &reach.transpose());
        let weights = &inverse * &self.target;
        let mut value = 0.5 * (self.target.dot(&weights) + log_det_c + log_det_h);
        // ½ tr((K⁻¹ − α αᵀ) ∂C).
        inverse.ger(-1.0, &weights, &weights, 1.0);
        let mut gradient = self.gradient(&hyper, &inverse);
        for k in 0..2 * self.sites {
            let away = (logarithms[k] - self.size) / AMPLITUDE_SPREAD;
            value += 0.5 * away * away;
            gradient[k] += away / AMPLITUDE_SPREAD;
        }
        for k in (2 * self.sites..2 * self.sites + 2).filter(|_| self.sites > 0) {
            let away = logarithms[k] / LENGTH_SPREAD;
            value += 0.5 * away * away;
            gradient[k] += away / LENGTH_SPREAD;
        }
        value.is_finite().then_some((value, gradient))
    }

    /// Adds N: σ² on the diagonal, σ_c² between rows of one configuration along each axis.
    fn add_noise(&self, hyper: &Hyperparameters, matrix: &mut DMatrix<f64>) {
        let (alone, shared) = (hyper.noise.powi(2), hyper.shared_noise.powi(2));
        for row in 0..self.rows.len() {
            for axis in 0..AXES {
                let k = AXES * row + axis;
                matrix[(k, k)] += alone * self.rows.relative_sigma[row].powi(2);
            }
        }
        if shared > 0.0 {
            self.each_shared(|first, second| matrix[(first, second)] += shared);
        }
    }

    /// Calls `visit` with each pair of coordinates that share noise, in both orders, and with each
    /// coordinate itself.
    fn each_shared(&self, mut visit: impl FnMut(usize, usize)) {
        for group in self.rows.configurations() {
            for &first in &group {
                for &second in &group {
                    for axis in 0..AXES {
                        visit(AXES * first + axis, AXES * second + axis);
                    }
                }
            }
        }
    }

    /// ½ tr(M ∂C/∂h) of a symmetric M for each logarithm h.
    fn gradient(&self, hyper: &Hyperparameters, weight: &DMatrix<f64>) -> DVector<f64> {
        let (sites, n) = (self.sites, self.rows.len());
        let mut gradient = DVector::zeros(self.len());
        let noise = self.len() - 1 - usize::from(self.shares_noise);
        for row in 0..n {
            let ratio = (hyper.noise * self.rows.relative_sigma[row]).powi(2);
            for k in AXES * row..AXES * (row + 1) {
                gradient[noise] += ratio * weight[(k, k)];
            }
        }
        if self.shares_noise {
            let mut sum = 0.0;
            self.each_shared(|first, second| sum += weight[(first, second)]);
            gradient[noise + 1] = hyper.shared_noise.powi(2) * sum;
        }
        if sites == 0 {
            return gradient;
        }
        let [single, joint] = hyper.lengths.map(|length| length.powi(-2));
        let squares = |values: &[f64]| values.iter().map(|a| a * a).collect::<Vec<f64>>();
        let (of_single, of_joint) = (squares(&hyper.single), squares(&hyper.joint));
        let column = |second: usize| {
            let mut out = vec![0.0; 2 * sites + 2];
            let mut carried = vec![0.0; sites];
            let mut correlations = vec![(0.0, 0.0); sites];
            for first in 0..=second {
                let factor = if first == second { 0.5 } else { 1.0 };
                let (left, right) = (self.rows.inputs_of(first), self.rows.inputs_of(second));
                let mut sum = 0.0;
                for (input, (left, right)) in left.iter().zip(right).enumerate() {
                    let squared = squared_distance(self.inputs.angles[input], left - right);
                    sum += squared;
                    if let Some(site) = self.inputs.site_of[input] {
                        correlations[site] = matern(squared * single);
                    }
                }
                let (all, slope) = matern(sum * joint);
                carried.fill(0.0);
                for b in 0..AXES {
                    for a in 0..AXES {
                        let entry = weight[(AXES * first + a, AXES * second + b)];
                        let pair = self.rows.sites_of(AXES * first + a).iter();
                        let pair = pair.zip(self.rows.sites_of(AXES * second + b));
                        for (out, (left, right)) in carried.iter_mut().zip(pair) {
                            *out += entry * left * right;
                        }
                    }
                }
                for site in 0..sites {
                    let (scale, single) = (factor * carried[site], correlations[site]);
                    out[site] += 2.0 * of_single[site] * scale * single.0;
                    out[sites + site] += 2.0 * of_joint[site] * scale * all;
                    out[2 * sites] += of_single[site] * scale * single.1;
                    out[2 * sites + 1] += of_joint[site] * scale * slope;
                }
            }
            out
        };
        let columns: Vec<Vec<f64>> = (0..n).into_par_iter().map(column).collect();
        for column in columns {
            column.iter().enumerate().for_each(|(k, value)| gradient[k] += value);
        }
        gradient
    }
}
