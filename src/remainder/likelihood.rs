//! Marginal likelihood of the hyperparameters: the free parameters of the arm are integrated out.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::kernel::{Hyperparameters, embedded, matern, position_covariances, squared_distances};
use super::prior::ParameterPrior;
use super::rows::{AXES, InputSource, Inputs, Rows, SiteFunctions};
use crate::numeric::parallel;
use crate::numeric::{
    gram, gram_of_lower, inverse_lower, lower_factor, product_with_lower, product_with_upper,
};

/// 1 σ of the prior of the mean of ln ℓ, about 0, in each family of correlation lengths. Two σ span
/// lengths from 0.05 to 20 rad or standard deviations of the input.
const LENGTH_SPREAD: f64 = 1.5;
/// 1 σ of the prior of each ln ℓ about the mean of its family.
const LENGTH_DIFFERENCE: f64 = 0.15;
/// 1 σ of the prior of ln a of each amplitude, about ln(root mean square length of a residual).
const AMPLITUDE_SPREAD: f64 = 3.0;
/// Bounds of ln ℓ: ln 0.02 and ln 8 rad or standard deviations of the input.
const LENGTH_BOUNDS: (f64, f64) = (-3.912_023, 2.079_441_5);
/// Bounds of ln a of each amplitude, relative to ln(root mean square length of a residual).
const AMPLITUDE_BOUNDS: (f64, f64) = (-7.0, 2.0);
/// Bounds of ln σ and ln σ_c, relative to ln(root mean square length of a residual).
pub(super) const NOISE_BOUNDS: (f64, f64) = (-4.0, 2.0);
/// Initial values of σ and σ_c in the search, as fractions of the root mean square length of a
/// residual. σ is the noise of a coordinate, σ_c the noise that the rows of one configuration
/// share.
pub(super) const NOISE_STARTS: [f64; 2] = [0.7, 0.3];

/// Negative logarithm of marginal likelihood times hyperparameter priors, as a function of the
/// logarithms of the hyperparameters.
///
/// The model is r = J δ + f + ε with δ ~ N(m, S), f ~ GP(0, K_f) and ε ~ N(0, N). With y = r − J m,
/// C = K_f + N and K = C + J S Jᵀ, the value is ½ yᵀK⁻¹y + ½ ln det K.
///
/// J S Jᵀ is never formed. With H = I + S½JᵀC⁻¹J S½, K⁻¹ = C⁻¹ − C⁻¹J S½ H⁻¹ S½JᵀC⁻¹ and det K =
/// det C det H.
pub(super) struct MarginalLikelihood<'a> {
    rows: &'a Rows,
    inputs: &'a Inputs,
    /// Vector y = r − J m: residuals at the mean of the parameters' prior.
    target: DVector<f64>,
    /// Transpose of the scaled Jacobian J S½.
    scaled_transposed: DMatrix<f64>,
    /// For each amplitude, the kind of function and the sites that it scales. All constants share
    /// one amplitude.
    amplitudes: Vec<(Function, Vec<usize>)>,
    /// Indices of the sites (joints) whose error has a function uⱼ of their own command.
    singles: Vec<usize>,
    /// True if noise that rows of one configuration share is estimated.
    shares_noise: bool,
    /// Logarithm of the root mean square length of a residual in m.
    size: f64,
    /// For each row, its squared distances to itself and to all later rows: one number per input
    /// for the first pair, then for the next one.
    distances: Vec<Vec<f64>>,
}

/// Kind of error function at a site: of its own command, of all inputs, or constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Function {
    Single,
    Joint,
    Constant,
}

/// Correlations of the error functions between one row and itself, and between it and each later
/// row; each of these is a pair.
struct PairColumn {
    /// For each pair and site j, the correlation of the function uⱼ of the site's own command, and
    /// its derivative with respect to ln ℓᵤⱼ.
    single: Vec<(f64, f64)>,
    /// Correlation of the functions vⱼ of all inputs for each pair, and its derivative with respect
    /// to −½ d². d is the distance of both rows in units of the lengths ℓᵥ.
    joint: Vec<(f64, f64)>,
}

impl<'a> MarginalLikelihood<'a> {
    /// Creates the likelihood of `rows`. `size` is the root mean square length of a residual \[m\].
    /// Returns `None` if a matrix is not positive definite because of rounding.
    pub fn new(
        (rows, inputs): (&'a Rows, &'a Inputs),
        prior: &ParameterPrior,
        shares_noise: bool,
        size: f64,
    ) -> Option<Self> {
        let with = |has: fn(&SiteFunctions) -> bool| -> Vec<usize> {
            (0..inputs.sites.len()).filter(|&site| has(&inputs.sites[site])).collect()
        };
        let singles = with(|site| site.single.is_some());
        let constants = with(|site| site.constant);
        let single = singles.iter().map(|&site| (Function::Single, vec![site]));
        let joint = with(|site| site.joint).into_iter().map(|site| (Function::Joint, vec![site]));
        let constant = (!constants.is_empty()).then_some((Function::Constant, constants));
        let amplitudes = single.chain(joint).chain(constant).collect();
        let (target, scaled) = prior.reduce(rows)?;
        let embedded = embedded(inputs, rows);
        let width = embedded.nrows();
        let of_row = |row: usize| &embedded.as_slice()[width * row..width * (row + 1)];
        let behind = |first: usize| {
            let pairs = first..rows.len();
            pairs.flat_map(|second| squared_distances(of_row(first), of_row(second))).collect()
        };
        let distances = parallel::map(rows.len(), behind);
        let (size, scaled_transposed) = (size.ln(), scaled.transpose());
        Some(Self {
            rows,
            inputs,
            target,
            scaled_transposed,
            amplitudes,
            singles,
            shares_noise,
            size,
            distances,
        })
    }

    /// Returns the number of hyperparameters: the amplitudes, the correlation lengths ℓᵤ of
    /// functions of one command and ℓᵥ of functions of all inputs, the noise σ of a coordinate and,
    /// if rows of a configuration share noise, its σ_c.
    pub fn len(&self) -> usize {
        self.input_lengths().end + 1 + usize::from(self.shares_noise)
    }

    /// Returns the indices among the hyperparameters of the correlation lengths ℓᵤ of functions of
    /// one command.
    fn single_lengths(&self) -> Range<usize> {
        self.amplitudes.len()..self.amplitudes.len() + self.singles.len()
    }

    /// Returns the indices among the hyperparameters of the correlation lengths ℓᵥ of functions of
    /// all inputs, one for each input.
    fn input_lengths(&self) -> Range<usize> {
        let first = self.single_lengths().end;
        first..first + self.inputs.angles.len()
    }

    /// Returns families of hyperparameter indices whose lengths are expected to be similar. The
    /// lengths ℓᵤ of functions of one command form one family. Of the lengths ℓᵥ of functions of
    /// all inputs, those of commands form another, and each of a condition a separate one.
    fn length_families(&self) -> Vec<Range<usize>> {
        let Range { start, end } = self.input_lengths();
        let is_command = |source: &&InputSource| matches!(source, InputSource::Command(_));
        let conditions = start + self.inputs.sources.iter().filter(is_command).count();
        let commands = [self.single_lengths(), start..conditions].into_iter();
        commands.chain((conditions..end).map(|k| k..k + 1)).collect()
    }

    /// Returns the logarithms of initial hyperparameters; `lengths` are the initial correlation
    /// lengths, ℓᵤ and ℓᵥ.
    pub fn start(&self, lengths: [f64; 2]) -> DVector<f64> {
        let amplitude = self.size - 0.5 * (self.amplitudes.len() as f64).ln();
        DVector::from_fn(self.len(), |k, _| match k {
            k if k < self.amplitudes.len() => amplitude,
            k if self.single_lengths().contains(&k) => lengths[0].ln(),
            k if self.input_lengths().contains(&k) => lengths[1].ln(),
            k => self.size + NOISE_STARTS[k - self.input_lengths().end].ln(),
        })
    }

    /// Returns lower and upper bound of the logarithm of each hyperparameter.
    pub fn bounds(&self) -> Vec<(f64, f64)> {
        let about = |(low, high)| (self.size + low, self.size + high);
        let bound = |k| match k {
            k if k < self.amplitudes.len() => about(AMPLITUDE_BOUNDS),
            k if k < self.input_lengths().end => LENGTH_BOUNDS,
            _ => about(NOISE_BOUNDS),
        };
        (0..self.len()).map(bound).collect()
    }

    /// Converts the logarithms that the search varies to hyperparameters.
    pub fn hyperparameters(&self, logarithms: &DVector<f64>) -> Hyperparameters {
        let (sites, noise) = (self.inputs.sites.len(), self.input_lengths().end);
        let mut hyper = Hyperparameters {
            single: vec![0.0; sites],
            joint: vec![0.0; sites],
            constant: vec![0.0; sites],
            single_lengths: vec![1.0; sites],
            input_lengths: self.input_lengths().map(|k| logarithms[k].exp()).collect(),
            noise: logarithms[noise].exp(),
            shared_noise: if self.shares_noise { logarithms[noise + 1].exp() } else { 0.0 },
        };
        for (k, (function, sites)) in self.amplitudes.iter().enumerate() {
            let amplitudes = match function {
                Function::Single => &mut hyper.single,
                Function::Joint => &mut hyper.joint,
                Function::Constant => &mut hyper.constant,
            };
            for &site in sites {
                amplitudes[site] = logarithms[k].exp();
            }
        }
        for (k, &site) in self.single_lengths().zip(&self.singles) {
            hyper.single_lengths[site] = logarithms[k].exp();
        }
        hyper
    }

    /// Returns the value and the gradient with respect to the logarithms; `None` if the covariance
    /// is not positive definite.
    pub fn value_and_gradient(&self, logarithms: &DVector<f64>) -> Option<(f64, DVector<f64>)> {
        let hyper = self.hyperparameters(logarithms);
        let (mut matrix, pairs) = self.covariance(&hyper);
        self.add_noise(&hyper, &mut matrix);
        let lower = lower_factor(matrix)?;
        let log_det_c = 2.0 * lower.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let inverse = inverse_lower(&lower);
        // With C⁻¹ = LᵀL and H = M Mᵀ, these are L J S½ and Z = M⁻¹(L J S½)ᵀL: K⁻¹ = LᵀL − ZᵀZ.
        let transposed = inverse.transpose();
        let whitened = product_with_upper(&self.scaled_transposed, &transposed).transpose();
        let n = whitened.ncols();
        let outer = lower_factor(DMatrix::identity(n, n) + gram(&whitened))?;
        let log_det_h = 2.0 * outer.diagonal().iter().map(|value| value.ln()).sum::<f64>();
        let z = product_with_upper(&whitened, &inverse_lower(&outer).transpose());
        let z = product_with_lower(&z.transpose(), &inverse);
        let mut inverse = gram_of_lower(&inverse);
        inverse -= gram(&z);
        let weights = &inverse * &self.target;
        let mut value = 0.5 * (self.target.dot(&weights) + log_det_c + log_det_h);
        // The gradient is ½ tr((K⁻¹ − α αᵀ) ∂C), with α = K⁻¹ y.
        inverse.ger(-1.0, &weights, &weights, 1.0);
        let mut gradient = self.gradient(&hyper, &inverse, &pairs);
        for k in 0..self.amplitudes.len() {
            let deviation = (logarithms[k] - self.size) / AMPLITUDE_SPREAD;
            value += 0.5 * deviation * deviation;
            gradient[k] += deviation / AMPLITUDE_SPREAD;
        }
        // ln ℓ ~ N(0, τ² I + s² 1 1ᵀ) within a family, by the Sherman–Morrison formula.
        for family in self.length_families() {
            let (each, common) = (LENGTH_DIFFERENCE.powi(2), LENGTH_SPREAD.powi(2));
            let share = common / (each + common * family.len() as f64);
            let sum: f64 = family.clone().map(|k| logarithms[k]).sum();
            for k in family {
                let slope = (logarithms[k] - share * sum) / each;
                value += 0.5 * logarithms[k] * slope;
                gradient[k] += slope;
            }
        }
        value.is_finite().then_some((value, gradient))
    }

    /// Returns the lower half of the covariance K_f \[m²\], and the correlations of all pairs of
    /// rows.
    fn covariance(&self, hyper: &Hyperparameters) -> (DMatrix<f64>, Vec<PairColumn>) {
        let (n, width) = (self.rows.len(), self.inputs.angles.len());
        let sites = self.inputs.sites.len();
        let scales = |lengths: &[f64]| lengths.iter().map(|l| l.powi(-2)).collect::<Vec<f64>>();
        let [single, joint] = [&hyper.single_lengths, &hyper.input_lengths].map(|l| scales(l));
        let mut matrix = DMatrix::zeros(AXES * n, AXES * n);
        let column = |(first, out): (usize, &mut [f64])| {
            let count = n - first;
            let mut pairs = PairColumn {
                single: vec![(0.0, 0.0); sites * count],
                joint: Vec::with_capacity(count),
            };
            let mut covariances = vec![0.0; sites];
            for (pair, second) in (first..n).enumerate() {
                let squared = &self.distances[first][width * pair..width * (pair + 1)];
                let sum = squared.iter().zip(&joint).map(|(squared, scale)| squared * scale).sum();
                let shared = matern(sum);
                pairs.joint.push(shared);
                for (site, covariance) in covariances.iter_mut().enumerate() {
                    *covariance =
                        hyper.joint[site].powi(2) * shared.0 + hyper.constant[site].powi(2);
                    if let Some(input) = self.inputs.sites[site].single {
                        let scaled = squared[input] * single[site];
                        let (correlation, slope) = matern(scaled);
                        pairs.single[sites * pair + site] = (correlation, slope * scaled);
                        *covariance += hyper.single[site].powi(2) * correlation;
                    }
                }
                position_covariances(
                    &covariances,
                    (self.rows, second),
                    (self.rows, first),
                    |a, b, value| {
                        out[b * AXES * n + AXES * second + a] = value;
                    },
                );
            }
            pairs
        };
        let columns = matrix.as_mut_slice().par_chunks_mut(AXES * AXES * n).enumerate();
        let pairs = columns.map(column).collect();
        (matrix, pairs)
    }

    /// Adds the noise covariance N to `matrix`: σ² on the diagonal, and σ_c² between rows of one
    /// configuration along the same axis.
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

    /// Calls `visit` with the row and column indices of all entries of the noise covariance that
    /// may differ from 0.
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

    /// Returns ½ tr(M ∂C/∂h) for each hyperparameter's logarithm h, with the symmetric matrix M =
    /// `weight`.
    fn gradient(
        &self,
        hyper: &Hyperparameters,
        weight: &DMatrix<f64>,
        pairs: &[PairColumn],
    ) -> DVector<f64> {
        let (n, width) = (self.rows.len(), self.inputs.angles.len());
        let sites = self.inputs.sites.len();
        let mut gradient = DVector::zeros(self.len());
        let noise = self.input_lengths().end;
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
        // Each column sums over its pairs, before factors that all pairs share. There are sums for
        // each site (single, joint and constant functions, single lengths) and for each input
        // (joint lengths).
        let column = |first: usize| {
            let mut out = vec![0.0; 4 * sites + width];
            let mut carried = vec![0.0; sites];
            for (pair, second) in (first..n).enumerate() {
                let factor = if first == second { 0.5 } else { 1.0 };
                carried.fill(0.0);
                for b in 0..AXES {
                    for a in 0..AXES {
                        let entry = factor * weight[(AXES * second + a, AXES * first + b)];
                        let columns = self.rows.sites_of(AXES * second + a).iter();
                        let columns = columns.zip(self.rows.sites_of(AXES * first + b));
                        for (out, (left, right)) in carried.iter_mut().zip(columns) {
                            *out += entry * left * right;
                        }
                    }
                }
                let (correlation, slope) = pairs[first].joint[pair];
                let mut whole = 0.0;
                for site in 0..sites {
                    let single = pairs[first].single[sites * pair + site];
                    out[site] += carried[site] * single.0;
                    out[sites + site] += carried[site] * correlation;
                    out[2 * sites + site] += carried[site];
                    out[3 * sites + site] += carried[site] * single.1;
                    whole += hyper.joint[site].powi(2) * carried[site];
                }
                let squared = &self.distances[first][width * pair..width * (pair + 1)];
                for (out, squared) in out[4 * sites..].iter_mut().zip(squared) {
                    *out += whole * slope * squared;
                }
            }
            out
        };
        let columns: Vec<Vec<f64>> = parallel::map(n, column);
        let mut sums = vec![0.0; 4 * sites + width];
        for column in columns {
            column.iter().zip(&mut sums).for_each(|(value, sum)| *sum += value);
        }
        for (k, (function, of)) in self.amplitudes.iter().enumerate() {
            let (family, amplitudes) = match function {
                Function::Single => (0, &hyper.single),
                Function::Joint => (1, &hyper.joint),
                Function::Constant => (2, &hyper.constant),
            };
            let slope =
                |&site: &usize| 2.0 * amplitudes[site].powi(2) * sums[family * sites + site];
            gradient[k] = of.iter().map(slope).sum();
        }
        for (k, &site) in self.single_lengths().zip(&self.singles) {
            gradient[k] = hyper.single[site].powi(2) * sums[3 * sites + site];
        }
        for (input, k) in self.input_lengths().enumerate() {
            gradient[k] = hyper.input_lengths[input].powi(-2) * sums[4 * sites + input];
        }
        gradient
    }
}
