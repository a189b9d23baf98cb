//! Marginal likelihood of a linear model with unknown noise: the probability density of a residual,
//! given columns that may explain it.
//!
//! r = A β + ε with β ~ N(0, c² f² I) and ε ~ N(0, f² I), all in units of the declared σ. With G =
//! AᵀA = V diag(w) Vᵀ and b = Aᵀr, the coefficients are integrated out in closed form,
//!
//! S(c) = rᵀr − Σ c² (Vᵀb)² / (1 + c² w),     ln p(r | c, f) = −½ Σ ln(1 + c² w) − ν ln f − S / (2
//! f²) + const.
//!
//! The size c of the columns (their root mean square displacement in units of σ) and the noise
//! factor f are summed over a grid. c covers the range that positions can show, from a third of σ
//! to a hundred σ. ln f has a Cauchy prior about 0: a declared σ is mostly right to a tenth, but
//! may also be very wrong.

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::few_columns::{MAX_FEW, shrinkage_of_few};
use super::likelihood_table::{Jet, LikelihoodTable};
use crate::numeric::kernel::subtract_few_products;
use crate::numeric::lower_factor;

/// Largest |ln f| of the grid over the noise factor f, a factor of 33 in either direction. The step
/// of the grid is [`MAX_LN_NOISE_STEP`], or half the width 1/√(2ν) of the likelihood with ν degrees
/// of freedom if that is less.
const MAX_LN_NOISE_FACTOR: f64 = 3.5;
/// Largest step of the grid over ln f, the logarithm of the noise factor f = true σ / assumed σ.
const MAX_LN_NOISE_STEP: f64 = 0.05;
/// Smallest step of ln f on the grid, which limits the grid's size. No data set has so many degrees
/// of freedom that it needs a smaller step.
const MIN_LN_NOISE_STEP: f64 = 1e-4;

/// ln of the ratio of the largest term of a sum to a term that is neglected: e⁻⁴⁰ of the largest
/// one.
const NEGLIGIBLE_LN_ODDS: f64 = 40.0;

/// Ratio of rows to columns of L above which G = D − LᵀL is factored as a full matrix. Two factors
/// of G then take less work than two of 1 − L E⁻¹ Lᵀ.
const MIN_DENSE_RATIO: f64 = 0.8;
/// Number of rows of a symmetric product that are formed together.
const GRAM_ROWS: usize = 48;

/// Degrees of freedom ν of a residual, and the prior on its noise factor f = true σ / assumed σ:
/// Cauchy in ln f, with half-width `ln_half_width`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    /// Degrees of freedom ν of the residual.
    pub freedom: f64,
    /// Half-width of the Cauchy prior on ln f, where f = true σ / assumed σ is the noise factor.
    pub ln_half_width: f64,
    /// Smallest ln f considered. It is 0 for a declared σ, because a smaller noise would make
    /// effects significant that an instrument with that σ cannot show.
    pub min_ln_factor: f64,
}

impl Noise {
    /// Returns the grid of noise factors f.
    pub fn grid(self) -> NoiseGrid {
        let step = MAX_LN_NOISE_STEP.min(0.5 / (2.0 * self.freedom).sqrt()).max(MIN_LN_NOISE_STEP);
        let min_ln_factor = self.min_ln_factor.clamp(-MAX_LN_NOISE_FACTOR, MAX_LN_NOISE_FACTOR);
        #[expect(clippy::cast_possible_truncation, reason = "few steps")]
        let steps = (MAX_LN_NOISE_FACTOR / step).ceil() as i32;
        let at = |number: i32| {
            let ln_f = step * f64::from(number);
            (
                -(ln_f / self.ln_half_width).powi(2).ln_1p() - self.freedom * ln_f,
                0.5 * (-2.0 * ln_f).exp(),
            )
        };
        let terms = (-steps..=steps)
            .filter(|&number| step * f64::from(number) >= min_ln_factor - 1e-9)
            .map(at)
            .collect();
        let prior_range = (MAX_LN_NOISE_FACTOR / self.ln_half_width).powi(2).ln_1p();
        let table = LikelihoodTable::new(self.freedom, 0.5 * step);
        NoiseGrid { terms, freedom: self.freedom, prior_range, table }
    }
}

/// Grid over the noise factor f, in ascending order.
#[derive(Debug, Clone)]
pub(super) struct NoiseGrid {
    /// For each noise factor f of the grid: ln(prior(f) f^−ν) and 1/(2 f²), with the degrees of
    /// freedom ν.
    terms: Vec<(f64, f64)>,
    /// Degrees of freedom ν of the residual.
    freedom: f64,
    /// Difference between the largest and the smallest ln prior(f) on the grid.
    prior_range: f64,
    /// Table of the ln likelihood, integrated over the noise factor, by the sum of squares of the
    /// residual.
    table: LikelihoodTable,
}

impl NoiseGrid {
    /// Returns ln of the likelihood of a residual with sum of squares S, summed over the noise
    /// factor f, up to a constant. It is interpolated with an error below 1e-8, plus rounding.
    pub fn ln_likelihood(&self, squares: f64) -> f64 {
        self.table.value(squares, |squares| self.summed(squares))
    }

    /// Returns the sum that [`NoiseGrid::ln_likelihood`] interpolates, and its first and second
    /// derivative by S.
    ///
    /// Without the prior, the terms −ν ln f − S/(2f²) rise up to f² = S/ν and fall beyond. From
    /// there, terms are computed until they are negligible, whatever the prior.
    fn summed(&self, squares: f64) -> Jet {
        let term = |&(ln_weight, half): &(f64, f64)| ln_weight - half * squares;
        let is_before_peak = |(_, half): &(f64, f64)| 2.0 * half * squares > self.freedom;
        let peak = self.terms.partition_point(is_before_peak);
        let mut most = f64::NEG_INFINITY;
        let mut is_negligible = |entry: &(f64, f64)| {
            let value = term(entry);
            most = most.max(value);
            value < most - NEGLIGIBLE_LN_ODDS - self.prior_range
        };
        let (before, behind) = self.terms.split_at(peak);
        let end = behind.iter().position(&mut is_negligible).map_or(self.terms.len(), |k| peak + k);
        let start = before.iter().rposition(is_negligible).map_or(0, |k| k + 1);
        let terms = &self.terms[start..end];
        let ln_summed = ln_sum(terms.iter().map(term));
        // The derivatives of the sum are moments of 1/(2 f²) over the posterior of f.
        let mean_of = |value: &dyn Fn(f64) -> f64| {
            terms.iter().map(|entry| (term(entry) - ln_summed).exp() * value(entry.1)).sum::<f64>()
        };
        let mean = mean_of(&|half| half);
        [ln_summed, -mean, mean_of(&|half| (half - mean).powi(2))]
    }
}

/// Returns ln Σ exp of some terms.
pub(super) fn ln_sum(terms: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = terms.clone().fold(f64::NEG_INFINITY, f64::max);
    let sum: f64 = terms
        .map(|term| term - most)
        .filter(|term| *term > -NEGLIGIBLE_LN_ODDS)
        .map(f64::exp)
        .sum();
    if most == f64::NEG_INFINITY { most } else { most + sum.ln() }
}

/// Products of columns A with themselves and with the residual r: G = AᵀA and b = Aᵀr.
#[derive(Debug, Clone)]
pub(super) enum Normal {
    /// Full matrix G = AᵀA, shape = (k, k), and vector b = Aᵀr, length k.
    Dense { gram: DMatrix<f64>, product: DVector<f64> },
    /// Matrix G = D − LᵀL with D diagonal and L with few rows, shape = (few, k), and b. Arises for
    /// one column per pose after projection.
    LowRankCorrection { diagonal: DVector<f64>, less: DMatrix<f64>, product: DVector<f64> },
}

impl Normal {
    /// Returns b = Aᵀr.
    pub fn product(&self) -> &DVector<f64> {
        match self {
            Self::Dense { product, .. } | Self::LowRankCorrection { product, .. } => product,
        }
    }

    /// Returns the products after a set is projected out of columns and residual, given Z A =
    /// `along` (column by column) and Z r = `residual_along`.
    pub fn reduced_by(&self, along: &[f64], residual_along: &DVector<f64>) -> Self {
        let columns = self.product().len();
        let matrix = DMatrixView::from_slice(along, residual_along.len(), columns);
        match self {
            Self::Dense { gram, product } => {
                let (mut gram, mut product) = (gram.clone(), product.clone());
                if columns <= MAX_FEW {
                    subtract_few_products(gram.as_mut_slice(), along, columns);
                } else {
                    gram.gemm(-1.0, &matrix.transpose(), &matrix, 1.0);
                }
                product.gemv_tr(-1.0, &matrix, residual_along, 1.0);
                Self::Dense { gram, product }
            }
            Self::LowRankCorrection { diagonal, less, product } => {
                let mut product = product.clone();
                product.gemv_tr(-1.0, &matrix, residual_along, 1.0);
                let (few, more) = (less.nrows(), matrix.nrows());
                let mut less = less.clone().resize_vertically(few + more, 0.0);
                less.rows_mut(few, more).copy_from(&matrix);
                Self::LowRankCorrection { diagonal: diagonal.clone(), less, product }
                    .dense_if_cheaper()
            }
        }
    }

    /// Computes G as a full matrix if L has so many rows that evaluations for two sizes then take
    /// less work.
    pub fn dense_if_cheaper(self) -> Self {
        match self {
            Self::LowRankCorrection { diagonal, less, product }
                if less.nrows() as f64 > MIN_DENSE_RATIO * less.ncols() as f64 =>
            {
                let mut gram = DMatrix::from_diagonal(&diagonal);
                gram.gemm(-1.0, &less.transpose(), &less, 1.0);
                Self::Dense { gram, product }
            }
            other => other,
        }
    }

    /// Returns ½ ln det(1 + c² G) and bᵀ (1/c² + G)⁻¹ b for coefficients with prior σ c = `size`;
    /// `None` if a factor does not exist.
    fn shrinkage_terms(&self, size: f64) -> Option<(f64, f64)> {
        let precision = (size * size).recip();
        match self {
            // With 1/c² + G = L Lᵀ: det(1 + c² G) = c^2k det(L)², and the squares decrease by |L⁻¹
            // b|². Few columns are solved without allocating memory.
            Self::Dense { gram, product } if product.len() <= MAX_FEW => {
                shrinkage_of_few(gram, product, size)
            }
            Self::Dense { gram, product } => {
                let lower = lower_factor(with_prior(gram, precision))?;
                let mut whitened = product.clone();
                if !lower.solve_lower_triangular_mut(&mut whitened) {
                    return None;
                }
                Some((ln_product(&lower.diagonal(), size), whitened.norm_squared()))
            }
            Self::LowRankCorrection { diagonal, less, product } => {
                // With E = 1/c² + D and K = 1 − L E⁻¹ Lᵀ: det(E − LᵀL) = det E det K, (E − LᵀL)⁻¹ =
                // E⁻¹ + E⁻¹Lᵀ K⁻¹ L E⁻¹.
                let root = diagonal.map(|entry| (entry + precision).sqrt());
                let mut scaled = less.clone();
                scaled.column_iter_mut().zip(&root).for_each(|(mut column, root)| column /= *root);
                let along = product.component_div(&root);
                let lower = lower_factor(remainder_of_gram(&scaled))?;
                let mut correction = scaled * &along;
                if !lower.solve_lower_triangular_mut(&mut correction) {
                    return None;
                }
                let determinant = ln_product(&root, size) + ln_product(&lower.diagonal(), 1.0);
                Some((determinant, along.norm_squared() + correction.norm_squared()))
            }
        }
    }
}

/// Returns the lower half of 1 − S Sᵀ, block by block; the upper half is not complete.
fn remainder_of_gram(s: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, transposed) = (s.nrows(), s.transpose());
    let mut inner = DMatrix::identity(n, n);
    for first in (0..n).step_by(GRAM_ROWS) {
        let count = GRAM_ROWS.min(n - first);
        inner.view_mut((first, 0), (count, first + count)).gemm(
            -1.0,
            &s.rows(first, count),
            &transposed.columns(0, first + count),
            1.0,
        );
    }
    inner
}

/// Returns G + 1/c² on the diagonal, given the `precision` 1/c².
fn with_prior(gram: &DMatrix<f64>, precision: f64) -> DMatrix<f64> {
    let mut inner = gram.clone();
    for j in 0..inner.nrows() {
        inner[(j, j)] += precision;
    }
    inner
}

/// Returns ln Π c dⱼ, given c = `size` and the factors dⱼ. A few factors are multiplied at a time,
/// so that no product overflows.
fn ln_product(diagonal: &DVector<f64>, size: f64) -> f64 {
    let scaled: Vec<f64> = diagonal.iter().map(|entry| entry * size).collect();
    scaled.chunks(16).map(|some| some.iter().product::<f64>().ln()).sum()
}

/// Prior on the coefficients of a block.
#[derive(Debug, Clone, Default)]
pub(super) struct Coefficients {
    /// True for coefficients that cannot be negative; empty if there are none.
    pub never_negative: Vec<bool>,
    /// True if a single coefficient may differ from zero while the others are zero.
    pub alone: bool,
    /// Root mean square displacement, in units of σ, by the largest plausible value of each
    /// coefficient; empty if any value is plausible.
    pub largest: Vec<f64>,
}

impl Coefficients {
    /// Returns true if the coefficients act together and may have any sign and size.
    pub fn is_any(&self) -> bool {
        self.never_negative.is_empty() && self.largest.is_empty() && !self.alone
    }

    /// Returns the trial `sizes` for the coefficients with the indices `of`, each limited to the
    /// largest plausible size. `column` is the root mean square of each column.
    fn plausible(&self, sizes: &[f64], of: impl Iterator<Item = usize>, column: f64) -> Vec<f64> {
        let largest = of
            .filter_map(|j| self.largest.get(j))
            .copied()
            .reduce(f64::max)
            .unwrap_or(f64::INFINITY);
        sizes.iter().map(|size| size.min(largest / column)).collect()
    }
}

/// Returns ln p(r | block), averaged over the trial `sizes` and up to a constant, and the most
/// probable size of all columns together. `squares_and_freedom` are the sum of squares of the
/// residual and its degrees of freedom.
///
/// If each of the block's k columns may act without the others (`Coefficients::alone`), all
/// together and each alone have the same prior probability 1/(k + 1). Otherwise an effect with a
/// single column would be preferred, because its prior is narrower.
pub(super) fn ln_likelihood_of_block(
    normal: &Normal,
    squares_and_freedom: (f64, f64),
    grid: &NoiseGrid,
    (sizes, coefficients): (&[f64], &Coefficients),
) -> (f64, f64) {
    let k = coefficients.largest.len().max(1);
    // All k columns together have a root mean square of 1, so each of them has 1/√k.
    let column = (k as f64).sqrt().recip();
    let plausible = coefficients.plausible(sizes, 0..k, column);
    let (whole, size) = ln_likelihood_of_columns(
        normal,
        squares_and_freedom,
        grid,
        (&plausible, &coefficients.never_negative),
    );
    let (gram, product) = match normal {
        Normal::Dense { gram, product } if coefficients.alone && gram.ncols() > 1 => {
            (gram, product)
        }
        _ => return (whole, size),
    };
    let ln_of_column = |j: usize| {
        let single = Normal::Dense {
            gram: gram.view((j, j), (1, 1)).into_owned(),
            product: product.rows(j, 1).into_owned(),
        };
        let sign = coefficients.never_negative.get(j).copied().unwrap_or(false);
        let sizes: Vec<f64> = coefficients
            .plausible(sizes, std::iter::once(j), 1.0)
            .iter()
            .map(|size| size / column)
            .collect();
        ln_likelihood_of_columns(&single, squares_and_freedom, grid, (&sizes, &[sign])).0
    };
    let terms: Vec<f64> =
        std::iter::once(whole).chain((0..gram.ncols()).map(ln_of_column)).collect();
    (ln_sum(terms.iter().copied()) - (terms.len() as f64).ln(), size)
}

/// Returns ln p(r | columns), averaged over the trial `sizes`, and the most probable size, for all
/// columns together only.
///
/// The prior of a `never_negative` parameter is the half β ≥ 0 of its normal distribution. With the
/// estimate m and its standard error s, this changes the likelihood by the factor 2 Φ(m / s).
fn ln_likelihood_of_columns(
    normal: &Normal,
    (squares, freedom): (f64, f64),
    grid: &NoiseGrid,
    (sizes, never_negative): (&[f64], &[bool]),
) -> (f64, f64) {
    let at = |size: f64| {
        let Some((determinant, explained)) = normal.shrinkage_terms(size) else {
            return f64::NEG_INFINITY;
        };
        let remaining_squares = (squares - explained).max(0.0);
        let ln_sign_factor = match normal {
            Normal::Dense { gram, product } if never_negative.contains(&true) => {
                with_prior(gram, (size * size).recip()).cholesky().map(|factor| {
                    ln_sign_factor(
                        &factor.inverse(),
                        product,
                        (remaining_squares / freedom).sqrt().max(1.0),
                        never_negative,
                    )
                })
            }
            _ => None,
        };
        ln_sign_factor.unwrap_or(0.0) - determinant + grid.ln_likelihood(remaining_squares)
    };
    averaged(sizes, at)
}

/// Returns ln of the mean likelihood over ascending `sizes`, and the most probable size. `at`
/// returns ln of the likelihood at a size.
pub(super) fn averaged(sizes: &[f64], at: impl Fn(f64) -> f64) -> (f64, f64) {
    // Sizes ascend, and above the most probable one the likelihood falls. The loop therefore ends
    // once larger sizes add nothing to the sum.
    let mut best = (1.0, f64::NEG_INFINITY);
    let mut tried = Vec::with_capacity(sizes.len());
    for &size in sizes {
        // All trial sizes above the largest plausible one are limited to it, so they are equal.
        let same = tried.last().filter(|(last, _): &&(f64, f64)| last.to_bits() == size.to_bits());
        let ln = same.map_or_else(|| at(size), |(_, ln)| *ln);
        tried.push((size, ln));
        if ln > best.1 {
            best = (size, ln);
        } else if ln < best.1 - NEGLIGIBLE_LN_ODDS {
            break;
        }
    }
    (ln_sum(tried.iter().map(|(_, ln)| *ln)) - (sizes.len() as f64).ln(), best.0)
}

/// Returns Σ ln 2 Φ(m / s) over the coefficients that cannot be negative, with s the standard error
/// for noise of standard deviation `scatter`. Columns are derivatives of the residual, so m = − (G
/// + 1/c²)⁻¹ b, with `covariance` = (G + 1/c²)⁻¹.
fn ln_sign_factor(
    covariance: &DMatrix<f64>,
    product: &DVector<f64>,
    scatter: f64,
    never_negative: &[bool],
) -> f64 {
    let mean = -(covariance * product);
    let ln_factor = |j: usize| {
        let t = mean[j] / (scatter * covariance[(j, j)].sqrt());
        statrs::function::erf::erfc(-t / std::f64::consts::SQRT_2).max(f64::MIN_POSITIVE).ln()
    };
    (0..mean.len()).filter(|&j| never_negative.get(j) == Some(&true)).map(ln_factor).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [f64; 6] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0];

    /// Returns ln p(r | columns) − ln p(r) for r = 5 A₁ plus noise, with one or two columns
    /// (`count`).
    fn gain(count: usize, coefficients: &Coefficients) -> f64 {
        let column = |j: usize, i: usize| {
            ((12.9898 + 3.77 * j as f64) * i as f64 + 0.5).sin() * 2.0_f64.sqrt()
        };
        let columns = DMatrix::from_fn(120, count, |i, j| column(j, i) / (count as f64).sqrt());
        let residual = DVector::from_fn(120, |i, _| 5.0 * column(0, i) + column(7, i));
        let normal = Normal::Dense {
            gram: columns.transpose() * &columns,
            product: columns.transpose() * &residual,
        };
        let noise = Noise { freedom: 120.0, ln_half_width: 0.1, min_ln_factor: 0.0 };
        let (squares, grid) = (residual.norm_squared(), noise.grid());
        ln_likelihood_of_block(&normal, (squares, 120.0), &grid, (&SIZES, coefficients)).0
            - grid.ln_likelihood(squares)
    }

    #[test]
    fn what_one_of_two_columns_explains_is_not_the_other_effects_of_that_column() {
        let plausible = |count: usize| vec![f64::INFINITY; count];
        let one_column =
            gain(1, &Coefficients { largest: plausible(1), ..Coefficients::default() });
        let two_columns =
            gain(2, &Coefficients { largest: plausible(2), ..Coefficients::default() });
        let alone = gain(
            2,
            &Coefficients { largest: plausible(2), alone: true, ..Coefficients::default() },
        );
        assert!(one_column > 50.0 && one_column - two_columns > 2.0, "{one_column} {two_columns}");
        assert!((one_column - alone - 3.0_f64.ln()).abs() < 0.2, "{one_column} {alone}");
    }

    #[test]
    fn an_interpolated_likelihood_is_the_summed_one() {
        for freedom in [1.5, 12.0, 90.0, 300.0, 3000.0, 20_000.0] {
            for (ln_half_width, min_ln_factor) in
                [(0.1, f64::NEG_INFINITY), (0.1, 0.0), (0.3, -0.2), (0.01, 0.0)]
            {
                let grid = Noise { freedom, ln_half_width, min_ln_factor }.grid();
                for k in 0..4000 {
                    let squares = freedom * (-10.0 + 0.00507 * f64::from(k)).exp();
                    let (summed, tabulated) =
                        (grid.summed(squares)[0], grid.ln_likelihood(squares));
                    let error = (summed - tabulated).abs();
                    assert!(
                        error < 1e-8 * (1.0 + 1e-7 * summed.abs()),
                        "{error} at ν {freedom}, S/ν {}",
                        squares / freedom
                    );
                }
            }
        }
    }

    #[test]
    fn a_grid_is_bounded_whatever_the_degrees_of_freedom() {
        let points = |freedom: f64| {
            Noise { freedom, ln_half_width: 0.1, min_ln_factor: f64::NEG_INFINITY }
                .grid()
                .terms
                .len()
        };
        assert_eq!((points(30.0), points(1e300)), (141, 70_001));
    }

    #[test]
    fn what_needs_an_implausible_size_is_no_explanation() {
        let any = gain(1, &Coefficients::default());
        let plausible = gain(1, &Coefficients { largest: vec![5.0], ..Coefficients::default() });
        let hardly = gain(1, &Coefficients { largest: vec![0.2], ..Coefficients::default() });
        assert!(plausible > any && hardly < any - 50.0, "{any} {plausible} {hardly}");
    }
}
