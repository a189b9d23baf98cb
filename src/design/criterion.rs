//! What makes a set of poses good.

use nalgebra::{DMatrix, DVector};

use crate::model::parameter::Parameter;

/// An eigenvalue of the prior's share above this: the prior, not the data, decides the combination.
const MOSTLY_PRIOR: f64 = 0.5;

/// What a plan makes small: a size of the covariance C that a set of poses leaves, priors included.
///
/// S, D, A and E are about the arm's parameters. Bases and targets are estimated along with them
/// and are in C, but their own errors do not count.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Criterion {
    /// det C: the volume of the confidence ellipsoid. Does not depend on units.
    D,
    /// Π C_kk: the geometric mean of the standard errors. Does not depend on units.
    S,
    /// Σ C_kk / C̄_kk: the mean variance, each parameter's in units of what as many average
    /// candidates leave of it, C̄.
    A,
    /// The largest variance of any combination, in units of what as many average candidates leave
    /// of it; of the combinations that those decide more than the priors do.
    E,
    /// D_s: det of the part of C of these parameters (numbers in the model), all others estimated
    /// along with them.
    Subset(Vec<usize>),
    /// S of these parameters alone (numbers in the model), all others estimated along with them.
    Each(Vec<usize>),
}

/// A criterion made ready for one problem, in scaled unknowns.
#[derive(Debug, Clone)]
pub(super) struct Yardstick {
    /// Unknowns whose errors count, ascending.
    pub wanted: Vec<usize>,
    /// The others.
    pub rest: Vec<usize>,
    pub size: Size,
}

/// How the covariance of the wanted unknowns is summed up.
#[derive(Debug, Clone)]
pub(super) enum Size {
    /// det C_ss = det M_rr / det M, r the rest.
    Determinant,
    /// Π C_kk over the wanted unknowns.
    Product,
    /// Σ weight · C_kk over all unknowns, weight 0 for those not wanted.
    Trace(DVector<f64>),
    /// The largest eigenvalue of F C Fᵀ; F, shape = (combinations, unknowns).
    Eigenvalue(DMatrix<f64>),
}

impl Criterion {
    /// Name on the command line and in results.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::D => "D",
            Self::A => "A",
            Self::E => "E",
            Self::S => "S",
            Self::Subset(_) => "subset",
            Self::Each(_) => "S of a subset",
        }
    }

    /// Ready to measure information matrices in scaled unknowns; `average` is that of average
    /// poses, `prior` that of the priors alone.
    pub(super) fn yardstick(
        &self,
        parameters: &[Parameter],
        average: &DMatrix<f64>,
        prior: &DMatrix<f64>,
    ) -> Option<Yardstick> {
        let n = parameters.len();
        let is_wanted = |k: usize| match self {
            Self::Subset(columns) | Self::Each(columns) => columns.contains(&k),
            // Where only bases or targets are free, they are what is looked for.
            _ => {
                !parameters[k].site.is_placement()
                    || parameters.iter().all(|p| p.site.is_placement())
            }
        };
        let (wanted, rest): (Vec<usize>, Vec<usize>) = (0..n).partition(|&k| is_wanted(k));
        let size = match self {
            Self::D | Self::Subset(_) => Size::Determinant,
            Self::A => {
                let usual = average.clone().cholesky()?.inverse();
                let mut weights = DVector::zeros(n);
                for &k in &wanted {
                    weights[k] = (wanted.len() as f64 * usual[(k, k)]).recip();
                }
                Size::Trace(weights)
            }
            Self::S | Self::Each(_) => Size::Product,
            Self::E => Size::Eigenvalue(decided(average, prior, &wanted)?),
        };
        Some(Yardstick { wanted, rest, size })
    }
}

impl Yardstick {
    /// ln of the size that information M leaves, per parameter where it is a determinant or a
    /// product; infinite where M is singular.
    pub fn value(&self, information: &DMatrix<f64>) -> f64 {
        let Some(cholesky) = information.clone().cholesky() else { return f64::INFINITY };
        match &self.size {
            Size::Determinant => {
                let Some(rest) = part(information, &self.rest).cholesky() else {
                    return f64::INFINITY;
                };
                let log = |l: &DMatrix<f64>| 2.0 * l.diagonal().iter().map(|d| d.ln()).sum::<f64>();
                (log(rest.l_dirty()) - log(cholesky.l_dirty())) / self.wanted.len() as f64
            }
            Size::Product => {
                let variances = cholesky.inverse().diagonal();
                self.wanted.iter().map(|&k| variances[k].ln()).sum::<f64>()
                    / self.wanted.len() as f64
            }
            Size::Trace(weights) => cholesky.inverse().diagonal().dot(weights).ln(),
            Size::Eigenvalue(combinations) => {
                let covariance = combinations * cholesky.inverse() * combinations.transpose();
                covariance.symmetric_eigenvalues().max().ln()
            }
        }
    }
}

/// Rows and columns `keep` of a square matrix.
pub(super) fn part(matrix: &DMatrix<f64>, keep: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(keep).select_columns(keep)
}

/// Combinations F of the unknowns, uncorrelated and of variance one after average poses, that those
/// decide more than the priors do; all of them, if none is.
///
/// (C̄_ss)⁻¹ = L Lᵀ and L⁻¹ P_ss L⁻ᵀ = Q diag(prior's share) Qᵀ; rows of Qᵀ Lᵀ whose share is below
/// a half.
fn decided(average: &DMatrix<f64>, prior: &DMatrix<f64>, wanted: &[usize]) -> Option<DMatrix<f64>> {
    let covariance = part(&average.clone().cholesky()?.inverse(), wanted);
    let l = covariance.cholesky()?.inverse().cholesky()?.unpack();
    let half = l.solve_lower_triangular(&part(prior, wanted))?;
    let share = l.solve_lower_triangular(&half.transpose())?;
    let eigen = (0.5 * (&share + share.transpose())).symmetric_eigen();
    let count = eigen.eigenvalues.len();
    let mut kept: Vec<usize> =
        (0..count).filter(|&k| eigen.eigenvalues[k] < MOSTLY_PRIOR).collect();
    if kept.is_empty() {
        kept = (0..count).collect();
    }
    let rows = (&l * eigen.eigenvectors.select_columns(&kept)).transpose();
    let mut combinations = DMatrix::zeros(kept.len(), average.ncols());
    wanted.iter().enumerate().for_each(|(j, &k)| combinations.set_column(k, &rows.column(j)));
    Some(combinations)
}
