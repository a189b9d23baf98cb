//! The marginal likelihood of a linear model with unknown noise: how probable a residual is under some columns.
//!
//! r = A β + ε with β ~ N(0, c² f² I) and ε ~ N(0, f² I), all in units of the declared σ. With G = AᵀA = V diag(w) Vᵀ and
//! b = Aᵀr the coefficients are integrated out in closed form,
//!
//! S(c) = rᵀr − Σ c² (Vᵀb)² / (1 + c² w),     ln p(r | c, f) = −½ Σ ln(1 + c² w) − ν ln f − S / (2 f²) + const,
//!
//! and the size c of the columns (their root mean square displacement in units of σ) and the factor f of the noise are summed
//! over a grid. c runs over what positions can show, from a third of σ to a hundred of it; ln f has a Cauchy
//! distribution about 0: mostly a declared σ is right to a tenth, and where it is not, it may be far off.

use nalgebra::{DMatrix, DVector};

/// ln f is summed from −3.5 to 3.5, a factor of thirty either way, in this many steps either side: closer together than the
/// likelihood of some 2000 degrees of freedom is wide, 1/√(2ν).
const STEPS: i32 = 70;
const REACH: f64 = 3.5;

/// Degrees of freedom ν of a residual and the half width of the distribution of ln f.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    pub freedom: f64,
    pub trust: f64,
    /// The least ln f: that of a declared σ, for what is smaller is no effect that such an instrument can show.
    pub least: f64,
}

impl Noise {
    /// For each factor f of the grid ln of its prior and of f^−ν, and 1 / (2 f²).
    pub fn grid(self) -> Vec<(f64, f64)> {
        let at = |step: i32| {
            let ln_f = REACH * f64::from(step) / f64::from(STEPS);
            (-(ln_f / self.trust).powi(2).ln_1p() - self.freedom * ln_f, 0.5 * (-2.0 * ln_f).exp())
        };
        let is_enough = |step: &i32| REACH * f64::from(*step) >= f64::from(STEPS) * self.least.min(REACH) - 1e-9;
        (-STEPS..=STEPS).filter(is_enough).map(at).collect()
    }
}

/// ln of the likelihood of ν squares of sum S, summed over the noise factor f; up to a constant.
pub(super) fn over_noise(squares: f64, grid: &[(f64, f64)]) -> f64 {
    ln_sum(grid.iter().map(|(ln_weight, half)| ln_weight - half * squares))
}

/// ln Σ exp.
pub(super) fn ln_sum(terms: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = terms.clone().fold(f64::NEG_INFINITY, f64::max);
    // What is e⁴⁰ times less probable adds nothing.
    let sum: f64 = terms.map(|term| term - most).filter(|term| *term > -40.0).map(f64::exp).sum();
    if most == f64::NEG_INFINITY { most } else { most + sum.ln() }
}

/// A block of columns, G = AᵀA and b = Aᵀr, against a residual of squares S: ln p(r | block) summed over sizes, and the most
/// probable of its sizes.
///
/// Of a parameter that is `never_negative` the prior is the half β ≥ 0 of its normal distribution: with the estimate m and its
/// standard error s the likelihood changes by 2 Φ(m / s).
pub(super) fn of_block(
    gram: &DMatrix<f64>,
    product: &DVector<f64>,
    (squares, freedom): (f64, f64),
    grid: &[(f64, f64)],
    (sizes, never_negative): (&[f64], &[bool]),
) -> (f64, f64) {
    let at = |size: f64| {
        // 1/c² + G = L Lᵀ: det(1 + c² G) = c^2k det(L)², taken off are |L⁻¹ b|².
        let precision = (size * size).recip();
        let mut inner = gram.clone();
        for j in 0..inner.nrows() {
            inner[(j, j)] += precision;
        }
        let Some(factor) = inner.cholesky() else { return f64::NEG_INFINITY };
        let lower = factor.l_dirty();
        let mut taken = product.clone();
        if !lower.solve_lower_triangular_mut(&mut taken) {
            return f64::NEG_INFINITY;
        }
        // ½ ln det, a few factors at a time before their product runs out of range.
        let diagonal: Vec<f64> = (0..lower.nrows()).map(|j| lower[(j, j)] * size).collect();
        let determinant: f64 = diagonal.chunks(16).map(|some| some.iter().product::<f64>().ln()).sum();
        let left = (squares - taken.norm_squared()).max(0.0);
        let signs = if never_negative.contains(&true) {
            signs(&factor.inverse(), product, (left / freedom).sqrt().max(1.0), never_negative)
        } else {
            0.0
        };
        signs - determinant + over_noise(left, grid)
    };
    let tried: Vec<(f64, f64)> = sizes.iter().map(|&size| (size, at(size))).collect();
    let best = tried.iter().copied().fold((1.0, f64::NEG_INFINITY), |a, b| if b.1 > a.1 { b } else { a });
    (ln_sum(tried.iter().map(|(_, ln)| *ln)) - (sizes.len() as f64).ln(), best.0)
}

/// Σ ln 2 Φ(m / s) over the parameters that are never negative; columns are derivatives of the residual, so m = − (G + 1/c²)⁻¹ b.
fn signs(covariance: &DMatrix<f64>, product: &DVector<f64>, scatter: f64, never_negative: &[bool]) -> f64 {
    let mean = -(covariance * product);
    let one = |j: usize| {
        let t = mean[j] / (scatter * covariance[(j, j)].sqrt());
        statrs::function::erf::erfc(-t / std::f64::consts::SQRT_2).max(f64::MIN_POSITIVE).ln()
    };
    (0..mean.len()).filter(|&j| never_negative.get(j) == Some(&true)).map(one).sum()
}
