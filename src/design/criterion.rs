//! Optimality criteria of experimental design.

use nalgebra::{DMatrix, DVector};

/// Smallest share of the prior in the information on a combination of unknowns at which the prior,
/// not the data, determines the combination.
const PRIOR_DOMINATED: f64 = 0.5;

/// Optimality criterion: a size, to be minimised, of the covariance C of the parameters (priors
/// included).
///
/// D, S, A and E measure the errors of the parameters of the arm. Bases and targets are estimated
/// together with them, but their errors are not measured.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Criterion {
    /// Determinant of C over the arm's parameters; its square root is proportional to the volume of
    /// their confidence ellipsoid. Units do not change the choice of poses.
    D,
    /// Product Π C_kk of the n variances; its 2n-th root is the geometric mean of the standard
    /// errors. Units do not change the choice of poses.
    S,
    /// Sum Σ C_kk / C̄_kk of the variances relative to those of C̄, the covariance after as many
    /// average candidates.
    A,
    /// Largest variance of a combination of parameters relative to its variance after as many
    /// average candidates. Only combinations count that these determine more than the priors do.
    E,
    /// Mean variance of predicted positions in the workspace, with a smooth misfit of the joints
    /// among the unknowns (I-optimality). [Atkinson, Donev & Tobias 2007, ch. 10]
    I,
    /// Determinant of the block of C of these parameters (indices in the model), with all others
    /// estimated (D_s).
    Subset(Vec<usize>),
    /// Product of C_kk over these parameters (indices in the model), with all others estimated.
    Each(Vec<usize>),
}

/// Criterion for one problem, in scaled unknowns.
#[derive(Debug, Clone)]
pub(super) struct ScaledCriterion {
    /// Indices of the unknowns whose errors are measured, in ascending order.
    pub wanted: Vec<usize>,
    /// Indices of the unknowns that are estimated but whose accuracy does not count.
    pub nuisance: Vec<usize>,
    pub measure: Measure,
}

/// Scalar measure of the covariance of the wanted unknowns.
#[derive(Debug, Clone)]
pub(super) enum Measure {
    /// Determinant det C_ss = det M_rr / det M, with r the nuisance unknowns.
    Determinant,
    /// Product Π C_kk of the variances of the wanted unknowns, with their covariance C.
    Product,
    /// Weighted sum Σ w_k C_kk over all unknowns; w_k = 0 for nuisance unknowns.
    Trace(DVector<f64>),
    /// Trace tr(C M) with the weight matrix M of all unknowns.
    Mean(DMatrix<f64>),
    /// Largest eigenvalue of F C Fᵀ; F has shape = (combinations, unknowns).
    Eigenvalue(DMatrix<f64>),
}

impl Criterion {
    /// Returns the name on the command line and in results.
    #[doc(hidden)]
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::D => "D",
            Self::A => "A",
            Self::E => "E",
            Self::S => "S",
            Self::I => "I",
            Self::Subset(_) => "subset",
            Self::Each(_) => "S of a subset",
        }
    }

    /// Prepares the criterion for information matrices in scaled unknowns. `average` is the
    /// information of average poses, `prior` that of the priors alone. `placements` is true for
    /// unknowns of bases and targets. `goal` is the matrix M of the criterion I. Returns `None` if
    /// `average` is singular for A or E, or if I lacks its goal.
    pub(super) fn scaled(
        &self,
        placements: &[bool],
        (average, prior): (&DMatrix<f64>, &DMatrix<f64>),
        goal: Option<DMatrix<f64>>,
    ) -> Option<ScaledCriterion> {
        let n = placements.len();
        let is_wanted = |k: usize| match self {
            Self::Subset(columns) | Self::Each(columns) => columns.contains(&k),
            // If only bases or targets are free, their errors are measured.
            _ => !placements[k] || placements.iter().all(|placement| *placement),
        };
        let (wanted, nuisance): (Vec<usize>, Vec<usize>) = (0..n).partition(|&k| is_wanted(k));
        let measure = match self {
            Self::D | Self::Subset(_) => Measure::Determinant,
            Self::A => {
                let covariance = average.clone().cholesky()?.inverse();
                let mut weights = DVector::zeros(n);
                for &k in &wanted {
                    weights[k] = (wanted.len() as f64 * covariance[(k, k)]).recip();
                }
                Measure::Trace(weights)
            }
            Self::S | Self::Each(_) => Measure::Product,
            Self::I => Measure::Mean(goal?),
            Self::E => Measure::Eigenvalue(data_determined(average, prior, &wanted)?),
        };
        Some(ScaledCriterion { wanted, nuisance, measure })
    }
}

impl ScaledCriterion {
    /// Returns the logarithm of the measure for an information matrix; infinite if the matrix is
    /// singular. The logarithm of a determinant or product is divided by the number of wanted
    /// unknowns.
    pub fn value(&self, information: &DMatrix<f64>) -> f64 {
        let Some(cholesky) = information.clone().cholesky() else { return f64::INFINITY };
        match &self.measure {
            Measure::Determinant => {
                let Some(nuisance) = block(information, &self.nuisance).cholesky() else {
                    return f64::INFINITY;
                };
                let log = |l: &DMatrix<f64>| 2.0 * l.diagonal().iter().map(|d| d.ln()).sum::<f64>();
                (log(nuisance.l_dirty()) - log(cholesky.l_dirty())) / self.wanted.len() as f64
            }
            Measure::Product => {
                let variances = cholesky.inverse().diagonal();
                self.wanted.iter().map(|&k| variances[k].ln()).sum::<f64>()
                    / self.wanted.len() as f64
            }
            Measure::Trace(weights) => cholesky.inverse().diagonal().dot(weights).ln(),
            Measure::Mean(goal) => cholesky.inverse().dot(goal).ln(),
            Measure::Eigenvalue(combinations) => {
                let covariance = combinations * cholesky.inverse() * combinations.transpose();
                covariance.symmetric_eigenvalues().max().ln()
            }
        }
    }
}

/// Returns the rows and columns `keep` of a square matrix.
pub(super) fn block(matrix: &DMatrix<f64>, keep: &[usize]) -> DMatrix<f64> {
    matrix.select_rows(keep).select_columns(keep)
}

/// Returns the combinations F of the unknowns that average poses determine more than the priors do,
/// shape = (combinations, unknowns); all combinations if there are none. After average poses they
/// are uncorrelated with unit variance. `None` if the information of average poses is singular.
///
/// (C̄_ss)⁻¹ = L Lᵀ and L⁻¹ P_ss L⁻ᵀ = Q diag(share of the prior) Qᵀ; F consists of the rows of Qᵀ
/// Lᵀ with a share below one half.
fn data_determined(
    average: &DMatrix<f64>,
    prior: &DMatrix<f64>,
    wanted: &[usize],
) -> Option<DMatrix<f64>> {
    let covariance = block(&average.clone().cholesky()?.inverse(), wanted);
    let l = covariance.cholesky()?.inverse().cholesky()?.unpack();
    let half = l.solve_lower_triangular(&block(prior, wanted))?;
    let share = l.solve_lower_triangular(&half.transpose())?;
    let eigen = (0.5 * (&share + share.transpose())).symmetric_eigen();
    let count = eigen.eigenvalues.len();
    let mut selected: Vec<usize> =
        (0..count).filter(|&k| eigen.eigenvalues[k] < PRIOR_DOMINATED).collect();
    if selected.is_empty() {
        selected = (0..count).collect();
    }
    let rows = (&l * eigen.eigenvectors.select_columns(&selected)).transpose();
    let mut combinations = DMatrix::zeros(selected.len(), average.ncols());
    wanted.iter().enumerate().for_each(|(j, &k)| combinations.set_column(k, &rows.column(j)));
    Some(combinations)
}
