//! Marginal likelihood of the hyperparameters: the free parameters of the arm are integrated out.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::kernel::{Hyperparameters, embedded, squared_distances};
use super::pairs::{Levers, PairColumn, add_products, sum_of_products};
use super::prior::ParameterPrior;
use super::rows::{AXES, InputSource, Inputs, Rows, SiteFunctions};
use crate::numeric::kernel::add_product;
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
/// Largest root mean square motion by 1 σ of a parameter, relative to the root mean square length of
/// a residual, at which the prior of the parameter is narrow.
const MAX_NARROW_MOTION: f64 = 10.0;
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
/// Of J S Jᵀ, only the part of parameters whose prior allows small motions is formed and added to C.
/// That of the others would take digits from C. With their columns in J and H = I + S½JᵀC⁻¹J S½,
/// K⁻¹ = C⁻¹ − C⁻¹J S½ H⁻¹ S½JᵀC⁻¹ and det K = det C det H.
pub(super) struct MarginalLikelihood<'a> {
    rows: &'a Rows,
    inputs: &'a Inputs,
    /// Vector y = r − J m: residuals at the mean of the parameters' prior.
    target: DVector<f64>,
    /// Transpose of the scaled Jacobian J S½ of the parameters with a wide prior.
    scaled_transposed: DMatrix<f64>,
    /// Covariance J S Jᵀ by the parameters with a narrow prior (see [`MAX_NARROW_MOTION`]).
    by_parameters: DMatrix<f64>,
    /// For each amplitude, the kind of function and the sites that it scales. All constants share
    /// one amplitude.
    amplitudes: Vec<(Function, Vec<usize>)>,
    /// Indices of the sites (joints) whose error has a function uⱼ of their own command.
    singles: Vec<usize>,
    /// True if noise that rows of one configuration share is estimated.
    shares_noise: bool,
    /// Logarithm of the root mean square length of a residual in m.
    size: f64,
    /// For each row, its squared distances to itself and to all later rows: one number per pair for
    /// the first input, then for the next one.
    distances: Vec<Vec<f64>>,
    levers: Levers,
}

/// Kind of error function at a site: of its own command, of all inputs, or constant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Function {
    Single,
    Joint,
    Constant,
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
            let count = rows.len() - first;
            let mut distances = vec![0.0; width / 2 * count];
            for pair in 0..count {
                let squares = squared_distances(of_row(first), of_row(first + pair));
                squares.enumerate().for_each(|(k, square)| distances[k * count + pair] = square);
            }
            distances
        };
        let distances = parallel::map(rows.len(), behind);
        let most = (MAX_NARROW_MOTION * size).powi(2) * rows.len() as f64;
        let (narrow, wide): (Vec<usize>, Vec<usize>) =
            (0..scaled.ncols()).partition(|&j| scaled.column(j).norm_squared() <= most);
        let by_parameters = gram(&scaled.select_columns(&narrow).transpose());
        let (size, scaled_transposed) = (size.ln(), scaled.select_columns(&wide).transpose());
        Some(Self {
            rows,
            inputs,
            target,
            scaled_transposed,
            by_parameters,
            amplitudes,
            singles,
            shares_noise,
            size,
            distances,
            levers: Levers::new(rows),
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
        matrix += &self.by_parameters;
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
            let distances = |input: usize| &self.distances[first][input * count..][..count];
            let mut pairs = PairColumn::new(sites, count);
            let mut squared = vec![0.0; count];
            for (input, scale) in joint.iter().enumerate().take(width) {
                add_product(&mut squared, (distances(input), 0), &[*scale]);
            }
            pairs.set(sites, &squared);
            let mut covariances = vec![0.0; sites * count];
            for (site, covariance) in covariances.chunks_exact_mut(count).enumerate() {
                covariance.fill(hyper.constant[site].powi(2));
                add_product(covariance, (pairs.of(sites).0, 0), &[hyper.joint[site].powi(2)]);
                if let Some(input) = self.inputs.sites[site].single {
                    squared.fill(0.0);
                    add_product(&mut squared, (distances(input), 0), &[single[site]]);
                    pairs.set_single(site, &squared);
                    add_product(covariance, (pairs.of(site).0, 0), &[hyper.single[site].powi(2)]);
                }
            }
            let mut sums = vec![0.0; count];
            for (axis, out) in out.chunks_exact_mut(AXES * n).enumerate() {
                let of_first = self.rows.sites_of(AXES * first + axis);
                for other in 0..AXES {
                    sums.fill(0.0);
                    for (site, covariance) in covariances.chunks_exact(count).enumerate() {
                        let levers = self.levers.from(first, (other, site));
                        add_products(&mut sums, levers, covariance, of_first[site]);
                    }
                    let entries = out[AXES * first + other..].iter_mut().step_by(AXES);
                    entries.zip(&sums).for_each(|(entry, sum)| *entry = *sum);
                }
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
            let count = n - first;
            let mut out = vec![0.0; 4 * sites + width];
            let mut carried = vec![0.0; sites * count];
            let mut entries = vec![0.0; count];
            for axis in 0..AXES {
                let column = AXES * first + axis;
                let weights = &weight.as_slice()[weight.nrows() * column..][..weight.nrows()];
                for other in 0..AXES {
                    let behind = weights[AXES * first + other..].iter().step_by(AXES);
                    entries.iter_mut().zip(behind).for_each(|(entry, weight)| *entry = *weight);
                    entries[0] *= 0.5;
                    for (site, carried) in carried.chunks_exact_mut(count).enumerate() {
                        let levers = self.levers.from(first, (other, site));
                        let factor = self.rows.sites_of(column)[site];
                        add_products(carried, &entries, levers, factor);
                    }
                }
            }
            let (correlations, slopes) = pairs[first].of(sites);
            entries.fill(0.0);
            for (site, carried) in carried.chunks_exact(count).enumerate() {
                let single = pairs[first].of(site);
                out[site] = sum_of_products(carried, single.0);
                out[sites + site] = sum_of_products(carried, correlations);
                out[2 * sites + site] = carried.iter().sum();
                out[3 * sites + site] = sum_of_products(carried, single.1);
                add_products(&mut entries, carried, slopes, hyper.joint[site].powi(2));
            }
            for (input, out) in out[4 * sites..].iter_mut().enumerate() {
                let squared = &self.distances[first][input * count..][..count];
                *out = sum_of_products(&entries, squared);
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
