//! Linear neighbourhood of a fit: the gain by columns that were not fitted, and the loss without
//! parameters that were.

use std::borrow::Cow;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::orthonormal::{constrained, lengthened, orthonormal, orthonormal_above};
use super::score::{Score, Sums};
use crate::numeric::{product, transposed_narrow_product};

/// Largest number of columns that are projected one basis direction at a time.
const MAX_SEQUENTIAL_COLUMNS: usize = 4;
/// Smallest remaining fraction of a column's length at which one projection suffices. Below it, a
/// second projection removes the rounding errors [Giraud, Langou & Rozložník 2005].
const MIN_PART_OF_ONE_PROJECTION: f64 = 0.1;

/// Unknowns of a fit at its end, with their priors and active constraints.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unknowns {
    /// Values of the unknowns, as deviations from nominal, SI.
    pub x: Vec<f64>,
    /// Standard deviation (1 σ) of the prior of each unknown; `None` without a prior.
    pub priors: Vec<Option<f64>>,
    /// Rows of the active constraints, shape = (constraints, unknowns). If there are fewer columns,
    /// the missing ones are 0.
    pub active: DMatrix<f64>,
}

/// Linear neighbourhood of a fit with residual r and columns A = [J; P] for N poses; each prior
/// adds a row of P below the 3 N data rows.
///
/// It is stored by an orthonormal basis Q = A T of the columns, T of shape (unknowns, rank). The
/// covariance of the unknowns is T Tᵀ, the step to their common optimum − T Qᵀr. Unknowns that
/// depend linearly on earlier columns have zero rows in T and keep their values.
#[derive(Debug)]
pub(crate) struct LinearNeighbourhood {
    /// Whitened residual at the optimum, followed by the rows of the priors.
    pub(super) residual: DVector<f64>,
    /// Orthonormal basis Q = A T of the columns A of the fitted parameters, shape = (3 N + priors,
    /// rank).
    pub(super) basis: DMatrix<f64>,
    /// Matrix T with Q = A T, shape = (unknowns, rank); T Tᵀ is the covariance of the unknowns.
    root: DMatrix<f64>,
    /// Values of the unknowns at the optimum.
    optimum: DVector<f64>,
    /// Step of the unknowns from the point at which the derivatives were computed to the optimum,
    /// length unknowns.
    step: DVector<f64>,
    /// Number of rows that belong to data.
    pub(super) rows: usize,
    /// Number of data rows that are 0, because poses measure fewer than three numbers.
    empty: usize,
    /// Sums of squares, with priors and of the data alone, and degrees of freedom of the data.
    sums: Sums,
}

/// Copies the matrices in parallel, because allocating memory takes most of the time.
impl Clone for LinearNeighbourhood {
    fn clone(&self) -> Self {
        Self {
            residual: self.residual.clone(),
            basis: lengthened(&self.basis, 0),
            root: self.root.clone(),
            optimum: self.optimum.clone(),
            step: self.step.clone(),
            ..*self
        }
    }
}

impl LinearNeighbourhood {
    /// Creates the neighbourhood from the Jacobian ∂r/∂x, shape = (3 N, n), and the residual r of a
    /// fit that ended at `unknowns`. `empty` is the number of rows that are 0, because poses
    /// measure fewer than three numbers.
    pub fn new(
        jacobian: &DMatrix<f64>,
        residual: &DVector<f64>,
        unknowns: &Unknowns,
        empty: usize,
    ) -> Self {
        Self::of(Cow::Borrowed(jacobian), residual.clone(), unknowns, empty)
    }

    /// Creates the neighbourhood like [`new`](Self::new), but reuses the memory of the Jacobian.
    pub fn in_place_of(
        jacobian: DMatrix<f64>,
        residual: DVector<f64>,
        unknowns: &Unknowns,
        empty: usize,
    ) -> Self {
        Self::of(Cow::Owned(jacobian), residual, unknowns, empty)
    }

    fn of(
        jacobian: Cow<DMatrix<f64>>,
        residual: DVector<f64>,
        unknowns: &Unknowns,
        empty: usize,
    ) -> Self {
        let (rows, n) = jacobian.shape();
        let priors = unknowns.priors.iter().enumerate();
        let columns_with_prior: Vec<(usize, f64)> =
            priors.filter_map(|(j, &sigma)| Some((j, sigma?))).collect();
        let mut long = residual.resize_vertically(rows + columns_with_prior.len(), 0.0);
        columns_with_prior
            .iter()
            .enumerate()
            .for_each(|(row, &(j, sigma))| long[rows + row] = unknowns.x[j] / sigma);
        let below: Vec<(usize, f64)> =
            columns_with_prior.iter().map(|&(j, sigma)| (j, sigma.recip())).collect();
        let (basis, root) = if unknowns.active.is_empty() {
            orthonormal_above(jacobian, &below, None)
        } else {
            constrained(&jacobian, &below, &unknowns.active.clone().resize_horizontally(n, 0.0))
        };
        let mut fit = Self {
            residual: long,
            basis,
            root,
            optimum: DVector::from_column_slice(&unknowns.x),
            step: DVector::zeros(n),
            rows,
            empty,
            sums: Sums::default(),
        };
        fit.settle(0);
        fit
    }

    /// Moves the unknowns to the optimum along the basis directions from index `first` on.
    fn settle(&mut self, first: usize) {
        let new = self.basis.columns_range(first..);
        let along = new.tr_mul(&self.residual);
        self.residual.gemv(-1.0, &new, &along, 1.0);
        let step = -(self.root.columns_range(first..) * along);
        self.optimum += &step;
        self.step += step;
        let before =
            if first == 0 { (self.rows - self.empty) as f64 } else { self.sums.data_freedom };
        let explained = new.rows(0, self.rows).norm_squared();
        self.sums = Sums::new(&self.residual, self.rows, before - explained);
    }

    /// Decomposes columns of the data. Returns their components along the basis, the new
    /// orthonormal directions that they add, and the transformation of the remaining columns to
    /// these directions.
    fn directions(&self, columns: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
        let mut remaining = columns.clone().resize_vertically(self.residual.len(), 0.0);
        let mut along = DMatrix::zeros(self.basis.ncols(), columns.ncols());
        for _ in 0..2 {
            let more = transposed_narrow_product(&self.basis, &remaining);
            remaining -= product(&self.basis, &more);
            along += more;
            if keeps_length(&remaining, &lengths) {
                break;
            }
        }
        let (new, within) = orthonormal(&remaining, Some(&lengths));
        (along, new, within)
    }

    /// Adds columns of the data, shape = (3 N, k) or as long as the basis, whose unknowns are
    /// appended. Returns the new orthonormal directions.
    pub fn add(&mut self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let (first, n, k) = (self.basis.ncols(), self.root.nrows(), columns.ncols());
        let (along, new, within) = self.directions(columns);
        let rank = new.ncols();
        self.basis = std::mem::take(&mut self.basis).resize_horizontally(first + rank, 0.0);
        self.basis.columns_range_mut(first..).copy_from(&new);
        let turned = -(&self.root * (along * &within));
        self.root = std::mem::take(&mut self.root).resize(n + k, first + rank, 0.0);
        self.root.view_mut((0, first), (n, rank)).copy_from(&turned);
        self.root.view_mut((n, first), (k, rank)).copy_from(&within);
        self.optimum = std::mem::take(&mut self.optimum).resize_vertically(n + k, 0.0);
        self.step = std::mem::take(&mut self.step).resize_vertically(n + k, 0.0);
        self.settle(first);
        new
    }

    /// Returns the neighbourhood with additional columns fitted.
    pub fn with(&self, columns: &DMatrix<f64>) -> Self {
        let mut with = self.clone();
        with.add(columns);
        with
    }

    /// Returns the neighbourhood with more columns of the data fitted, shape = (3 N, k), whose
    /// coefficients have a prior with 1 σ = `sigma` about 0.
    pub fn with_priors(&self, columns: &DMatrix<f64>, sigma: f64) -> Self {
        let (rows, k) = (self.basis.nrows(), columns.ncols());
        let mut columns = columns.clone().resize_vertically(rows + k, 0.0);
        columns.view_mut((rows, 0), (k, k)).fill_diagonal(sigma.recip());
        let mut with = Self {
            basis: lengthened(&self.basis, k),
            residual: self.residual.clone().resize_vertically(rows + k, 0.0),
            root: self.root.clone(),
            optimum: self.optimum.clone(),
            step: self.step.clone(),
            ..*self
        };
        with.add(&columns);
        with
    }

    /// Returns the sums of squares and the degrees of freedom at the optimum.
    pub fn sums(&self) -> Sums {
        self.sums
    }

    /// Returns the number of data rows, 3 N.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the data rows of Q, so that H = Q Qᵀ is the hat matrix.
    pub fn fitted(&self) -> DMatrixView<'_, f64> {
        self.basis.rows(0, self.rows)
    }

    /// Returns the data rows of Q and of the whitened residual, without copying.
    pub fn into_fitted(self) -> (DMatrix<f64>, DVector<f64>) {
        (
            self.basis.resize_vertically(self.rows, 0.0),
            self.residual.resize_vertically(self.rows, 0.0),
        )
    }

    /// Returns the step from the point of the derivatives to the optimum; unknowns of added columns
    /// are last.
    pub fn step(&self) -> &DVector<f64> {
        &self.step
    }

    /// Returns the expected degrees of freedom if the priors are true: number of rows, priors
    /// included, less the rank.
    pub fn expected_freedom(&self) -> f64 {
        (self.basis.nrows() - self.empty - self.basis.ncols()) as f64
    }

    /// Returns U and − S⁻ᵀ x for some unknowns x; `None` if the fit cannot distinguish them from
    /// others.
    ///
    /// With T_x their rows of T and T_xᵀ = U S its QR factors, only these unknowns fit the
    /// directions Q U, along which they reduce the residual by − S⁻ᵀ x.
    fn components_by(&self, unknowns: &[usize]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let rows = self.root.select_rows(unknowns).transpose();
        // U = T_xᵀ W with W = S⁻¹.
        let (turned, within) = orthonormal(&rows, None);
        let x = self.optimum.select_rows(unknowns);
        (turned.ncols() == unknowns.len()).then(|| (turned, -within.tr_mul(&x)))
    }

    /// Returns the increase of the sum of squares if some unknowns are not fitted; `None` if the
    /// fit cannot distinguish them from others.
    pub fn loss_without(&self, unknowns: &[usize]) -> Option<f64> {
        self.components_by(unknowns).map(|(_, part)| part.norm_squared())
    }

    /// Returns columns C of the data, shape = (3 N, k), with rows of zeros for the priors, and their
    /// components QᵀC along the basis.
    ///
    /// From columns of which the projection leaves little, the fitted parameters are projected out,
    /// and their components are set to 0. The projected columns have the Gram matrix CᵀC −
    /// (QᵀC)ᵀQᵀC without loss of digits. Products with other projected columns are those with C.
    pub fn with_components(&self, columns: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
        // Transposing the narrow matrix gives the fastest product.
        let mut along = (columns.transpose() * self.fitted()).transpose();
        let mut out = columns.clone().resize_vertically(self.residual.len(), 0.0);
        let is_short = |k: &usize| {
            let square = out.column(*k).norm_squared();
            let left = square - along.column(*k).norm_squared();
            left < MIN_PART_OF_ONE_PROJECTION.powi(2) * square
        };
        let short: Vec<usize> = (0..columns.ncols()).filter(is_short).collect();
        if !short.is_empty() {
            let mut remaining = out.select_columns(&short);
            remaining.gemm(-1.0, &self.basis, &along.select_columns(&short), 1.0);
            self.subtract_components(&mut remaining, self.residual.len());
            for (&k, column) in short.iter().zip(remaining.column_iter()) {
                out.set_column(k, &column);
                along.column_mut(k).fill(0.0);
            }
        }
        (out, along)
    }

    /// Returns columns of the data, shape = (3 N, k) or (3 N + priors, k), after the fitted
    /// parameters are projected out, shape = (3 N + priors, k).
    pub fn projected_out(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut remaining = columns.clone().resize_vertically(self.residual.len(), 0.0);
        self.subtract_components(&mut remaining, columns.nrows());
        let is_short = |k: &usize| {
            remaining.column(*k).norm() < MIN_PART_OF_ONE_PROJECTION * columns.column(*k).norm()
        };
        let short: Vec<usize> = (0..columns.ncols()).filter(is_short).collect();
        if !short.is_empty() {
            let mut again = remaining.select_columns(&short);
            self.subtract_components(&mut again, self.residual.len());
            short
                .iter()
                .zip(again.column_iter())
                .for_each(|(&k, column)| remaining.set_column(k, &column));
        }
        remaining
    }

    /// Subtracts from the columns `remaining` their components along the basis. Rows from `filled`
    /// on are zero.
    fn subtract_components(&self, remaining: &mut DMatrix<f64>, filled: usize) {
        if remaining.ncols() > MAX_SEQUENTIAL_COLUMNS {
            // Transposing the narrow matrix gives the fastest product.
            let along =
                (remaining.rows(0, filled).transpose() * self.basis.rows(0, filled)).transpose();
            remaining.gemm(-1.0, &self.basis, &along, 1.0);
            return;
        }
        let along = self.basis.rows(0, filled).tr_mul(&remaining.rows(0, filled));
        for (column, along) in self.basis.column_iter().zip(along.row_iter()) {
            let pairs = remaining.column_iter_mut().zip(along.iter());
            pairs.for_each(|(mut left, along)| left.axpy(-along, &column, 1.0));
        }
    }

    /// Returns the whitened residual at the optimum, followed by the rows of the priors.
    pub fn residual(&self) -> &DVector<f64> {
        &self.residual
    }

    /// Returns the score of columns that were not fitted, shape = (3 N, k).
    pub fn score(&self, columns: &DMatrix<f64>) -> Score {
        self.projected(columns, &self.basis.rows(0, self.rows).tr_mul(columns))
    }

    /// Returns the scores of several sets of columns, computed in one matrix product.
    pub fn scores(&self, sets: &[DMatrix<f64>]) -> Vec<Score> {
        if sets.is_empty() {
            return Vec::new();
        }
        let columns =
            DMatrix::from_columns(&sets.iter().flat_map(DMatrix::column_iter).collect::<Vec<_>>());
        // Transposing the narrow matrix gives the fastest product.
        let along = (columns.transpose() * self.basis.rows(0, self.rows)).transpose();
        let mut first = 0;
        let mut next = |set: &DMatrix<f64>| {
            first += set.ncols();
            self.projected(set, &along.columns(first - set.ncols(), set.ncols()).into_owned())
        };
        sets.iter().map(&mut next).collect()
    }

    /// Returns the score of columns C, given `along` = QᵀC.
    fn projected(&self, columns: &DMatrix<f64>, along: &DMatrix<f64>) -> Score {
        let gram = columns.tr_mul(columns) - along.tr_mul(along);
        let product = columns.tr_mul(&self.residual.rows(0, self.rows));
        Score {
            gram,
            product,
            lengths: columns.column_iter().map(|column| column.norm_squared()).collect(),
        }
    }

    /// Returns the largest principal angle \[rad\] between two sets of columns, with the fitted
    /// parameters projected out; `None` if one of them adds nothing to the fit.
    pub fn angle(&self, one: &DMatrix<f64>, other: &DMatrix<f64>) -> Option<f64> {
        let (a, b) = (self.directions(one).1, self.directions(other).1);
        if a.is_empty() || b.is_empty() {
            return None;
        }
        let cosines = a.tr_mul(&b).singular_values();
        cosines.iter().copied().reduce(f64::min).map(|cosine| cosine.clamp(0.0, 1.0).acos())
    }
}

/// Returns true if a projection leaves at least [`MIN_PART_OF_ONE_PROJECTION`] of the length of
/// every column.
fn keeps_length(remaining: &DMatrix<f64>, lengths: &[f64]) -> bool {
    remaining
        .column_iter()
        .zip(lengths)
        .all(|(column, length)| column.norm() >= MIN_PART_OF_ONE_PROJECTION * length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns deterministic numbers without pattern.
    fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            (12.9898 * i as f64 + 78.233 * (j + 1) as f64).sin() * 43.7 % 1.0
        })
    }

    fn fit(columns: usize) -> (DMatrix<f64>, DVector<f64>, Unknowns) {
        let x: Vec<f64> = (0..columns).map(|j| 0.1 * j as f64 - 0.2).collect();
        let priors = (0..columns).map(|j| (j == 1).then_some(0.5)).collect();
        let active = DMatrix::zeros(0, columns);
        (matrix(30, columns), matrix(30, 1).column(0).into_owned(), Unknowns { x, priors, active })
    }

    #[test]
    fn the_loss_without_unknowns_is_that_of_a_fit_without_them() {
        let (columns, residual, unknowns) = fit(5);
        let whole = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let fewer = Unknowns {
            x: unknowns.x[..3].to_vec(),
            priors: unknowns.priors[..3].to_vec(),
            active: DMatrix::zeros(0, 3),
        };
        let without =
            residual - columns.columns(3, 2) * DVector::from_column_slice(&unknowns.x[3..]);
        let without_last =
            LinearNeighbourhood::new(&columns.columns(0, 3).into_owned(), &without, &fewer, 0);
        let lost = whole.loss_without(&[3, 4]).unwrap();
        let expected = without_last.sums().squares - whole.sums().squares;
        assert!((lost - expected).abs() < 1e-10 && lost > 0.01);
        let with = without_last.with(&columns.columns(3, 2).into_owned());
        assert!((with.sums().squares - whole.sums().squares).abs() < 1e-10);
        assert!((with.optimum.rows(0, 3) - whole.optimum.rows(0, 3)).norm() < 1e-10);
    }

    #[test]
    fn further_columns_with_priors_are_fitted_as_if_they_had_been_there() {
        let (columns, residual, mut unknowns) = fit(6);
        (unknowns.x[5], unknowns.priors[5]) = (0.0, Some(0.3));
        let whole = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let first = Unknowns {
            x: unknowns.x[..5].to_vec(),
            priors: unknowns.priors[..5].to_vec(),
            active: DMatrix::zeros(0, 5),
        };
        let fit =
            LinearNeighbourhood::new(&columns.columns(0, 5).into_owned(), &residual, &first, 0);
        let with = fit.with_priors(&columns.columns(5, 1).into_owned(), 0.3);
        assert!(
            (&with.optimum - &whole.optimum).norm() < 1e-12
                && (&with.step - &whole.step).norm() < 1e-12
        );
        assert!((with.sums().squares / whole.sums().squares - 1.0).abs() < 1e-12);
        assert!((with.sums().data_freedom - whole.sums().data_freedom).abs() < 1e-12);
        let blocks: Vec<usize> = (0..10).map(|pose| pose / 2).collect();
        let [one, other] = [with, whole].map(|fit| fit.cross_validate(&blocks).unwrap());
        assert!((one / other - 1.0).abs() < 1e-12);
    }

    #[test]
    fn columns_with_components_have_the_products_of_projected_ones() {
        let (columns, residual, unknowns) = fit(4);
        let fit = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let mut tried = matrix(30, 7);
        tried.set_column(2, &(columns.column(0) + matrix(30, 6).column(5) * 1e-3));
        let (out, along) = fit.with_components(&tried);
        let projected = fit.projected_out(&tried);
        assert!(
            (projected.tr_mul(&projected) - (out.tr_mul(&out) - along.tr_mul(&along))).amax()
                < 1e-12
        );
        assert!(
            (out.column(2) - projected.column(2)).amax() < 1e-14 && along.column(2).amax() == 0.0
        );
        assert!((fit.projected_out(&out) - projected).amax() < 1e-12);
    }

    #[test]
    fn what_a_constraint_holds_together_is_one_unknown() {
        let (columns, residual, mut unknowns) = fit(4);
        unknowns.active = DMatrix::from_row_slice(1, 4, &[0.0, 0.0, 2.0, -1.0]);
        let held = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        // x₂ = t, x₃ = 2 t.
        let mut together = columns.columns(0, 3).into_owned();
        together.set_column(2, &(columns.column(2) + columns.column(3) * 2.0));
        let three = Unknowns {
            x: unknowns.x[..3].to_vec(),
            priors: unknowns.priors[..3].to_vec(),
            ..Unknowns::default()
        };
        let merged = LinearNeighbourhood::new(&together, &residual, &three, 0);
        assert!((held.sums().squares / merged.sums().squares - 1.0).abs() < 1e-12);
        let step = [merged.step[0], merged.step[1], merged.step[2], 2.0 * merged.step[2]];
        assert!((&held.step - DVector::from_row_slice(&step)).norm() < 1e-12);
    }

    #[test]
    fn what_other_columns_take_up_or_what_is_not_finite_changes_nothing() {
        let (columns, residual, unknowns) = fit(5);
        let plain = LinearNeighbourhood::new(&columns, &residual, &unknowns, 0);
        let mut odd = columns.clone().resize_horizontally(7, 0.0);
        odd.set_column(5, &(columns.column(0) * 3.0 - columns.column(2) * (1.0 + 1e-9)));
        odd[(4, 6)] = f64::NAN;
        let mut more = unknowns.clone();
        more.x.extend([0.0; 2]);
        more.priors.extend([None; 2]);
        let odd = LinearNeighbourhood::new(&odd, &residual, &more, 0);
        assert!((odd.sums().squares - plain.sums().squares).abs() < 1e-9);
        assert_eq!(odd.fitted().ncols(), 5);
        assert!(odd.loss_without(&[5]).is_none());
    }
}
