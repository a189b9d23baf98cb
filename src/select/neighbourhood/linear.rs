//! A fit in its linear neighbourhood: what its residual can still give to columns that were not
//! fitted, and what each fitted parameter gives it.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::orthonormal::{held, lengthened, orthonormal, orthonormal_above};
use super::score::{Score, Sums};
use crate::numeric::{gram, inverse_factor, product, transposed_narrow_product};

/// Minimum part of a direction's length² outside a block of poses for the other poses to determine
/// it.
const MIN_DETERMINED_ELSEWHERE: f64 = 1e-6;

/// Maximum number of columns that are projected out by one direction of the basis after the other.
const MAX_SEQUENTIAL_COLUMNS: usize = 4;
/// Part of a column from which on one projection leaves only rounding along a basis. For less, two
/// are enough [Giraud, Langou & Rozložník 2005].
const MIN_PART_OF_ONE_PROJECTION: f64 = 0.1;

/// The unknowns of a fit as it ended.
#[derive(Debug, Clone, Default)]
pub(crate) struct Unknowns {
    /// Values, as deviations from nominal.
    pub x: Vec<f64>,
    /// 1 σ of their priors.
    pub priors: Vec<Option<f64>>,
    /// Rows of the constraints that hold them, shape = (constraints, unknowns); may be narrower,
    /// the rest being 0.
    pub active: DMatrix<f64>,
}

/// Residual r and fitted columns A = [J; P] of N poses, with a row P for each prior below the
/// data's 3 N.
///
/// All is kept in an orthonormal basis Q = A T of what was fitted, T of shape (unknowns, rank): the
/// covariance of the unknowns is T Tᵀ, the step to their common optimum − T Qᵀr. Unknowns that
/// columns before them take up wholly have no part in T and stay where they are.
#[derive(Debug)]
pub(crate) struct LinearNeighbourhood {
    /// Returns the whitened residual at the optimum, priors below.
    residual: DVector<f64>,
    /// Q, shape = (3 N + priors, rank).
    basis: DMatrix<f64>,
    /// Matrix T, shape = (unknowns, rank).
    root: DMatrix<f64>,
    /// Values of the unknowns at the optimum.
    optimum: DVector<f64>,
    /// From where the derivatives were taken to the optimum.
    step: DVector<f64>,
    /// Number of rows that are data.
    rows: usize,
    /// Number of these rows that are 0 because nothing is measured there.
    empty: usize,
    /// Sums of squares, with priors and of the data alone, and degrees of freedom of the data.
    sums: Sums,
}

/// Clones on every core: most of the time is that of new memory.
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
    /// fit that ended at the unknowns given; `empty` rows are 0 since poses measure fewer numbers
    /// than three.
    pub fn new(
        jacobian: &DMatrix<f64>,
        residual: &DVector<f64>,
        unknowns: &Unknowns,
        empty: usize,
    ) -> Self {
        Self::of(Cow::Borrowed(jacobian), residual.clone(), unknowns, empty)
    }

    /// Creates the neighbourhood in the memory of a Jacobian that nobody else needs.
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
        let known: Vec<(usize, f64)> = priors.filter_map(|(j, &sigma)| Some((j, sigma?))).collect();
        let mut long = residual.resize_vertically(rows + known.len(), 0.0);
        known
            .iter()
            .enumerate()
            .for_each(|(row, &(j, sigma))| long[rows + row] = unknowns.x[j] / sigma);
        let below: Vec<(usize, f64)> = known.iter().map(|&(j, sigma)| (j, sigma.recip())).collect();
        let (basis, root) = if unknowns.active.is_empty() {
            orthonormal_above(jacobian, &below, None)
        } else {
            held(&jacobian, &below, &unknowns.active.clone().resize_horizontally(n, 0.0))
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

    /// Fits the directions of the basis from `first` on.
    fn settle(&mut self, first: usize) {
        let new = self.basis.columns_range(first..);
        let along = new.tr_mul(&self.residual);
        self.residual.gemv(-1.0, &new, &along, 1.0);
        let step = -(self.root.columns_range(first..) * along);
        self.optimum += &step;
        self.step += step;
        let before =
            if first == 0 { (self.rows - self.empty) as f64 } else { self.sums.data_freedom };
        let taken = new.rows(0, self.rows).norm_squared();
        self.sums = Sums::of(&self.residual, self.rows, before - taken);
    }

    /// Returns three matrices for columns of the data: their components along the basis, the
    /// orthonormal directions that they add, and these directions in terms of what the basis leaves
    /// of the columns.
    fn directions(&self, columns: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>, DMatrix<f64>) {
        let lengths: Vec<f64> = columns.column_iter().map(|column| column.norm()).collect();
        let mut left = columns.clone().resize_vertically(self.residual.len(), 0.0);
        let mut along = DMatrix::zeros(self.basis.ncols(), columns.ncols());
        for _ in 0..2 {
            let more = transposed_narrow_product(&self.basis, &left);
            left -= product(&self.basis, &more);
            along += more;
            if most_is_left(&left, &lengths) {
                break;
            }
        }
        let (new, within) = orthonormal(&left, Some(&lengths));
        (along, new, within)
    }

    /// Adds columns of the data, shape = (3 N, k) or as long as the basis, with unknowns behind the
    /// others; returns the new orthonormal directions.
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

    /// Returns the fit with further columns.
    pub fn with(&self, columns: &DMatrix<f64>) -> Self {
        let mut with = self.clone();
        with.add(columns);
        with
    }

    /// Returns the fit with further columns of the data, shape = (3 N, k), whose coefficients have
    /// a prior of 1 σ about 0.
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

    /// Returns the sums of squares and degrees of freedom.
    pub fn sums(&self) -> Sums {
        self.sums
    }

    /// Returns the number of data rows, 3 N.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns Q, the data's rows of the orthonormal factor: H = Q Qᵀ.
    pub fn fitted(&self) -> DMatrix<f64> {
        self.basis.rows(0, self.rows).into_owned()
    }

    /// Returns Q and the whitened residuals of the data without a copy.
    pub fn into_fitted(self) -> (DMatrix<f64>, DVector<f64>) {
        (
            self.basis.resize_vertically(self.rows, 0.0),
            self.residual.resize_vertically(self.rows, 0.0),
        )
    }

    /// Returns the step from the point of the derivatives to the optimum, unknowns of added columns
    /// last.
    pub fn step(&self) -> &DVector<f64> {
        &self.step
    }

    /// Returns the expected degrees of freedom if the priors are true: rows, priors included, less
    /// rank.
    pub fn expected_freedom(&self) -> f64 {
        (self.basis.nrows() - self.empty - self.basis.ncols()) as f64
    }

    /// Returns U and − S⁻ᵀ x of some unknowns x; `None` where the fit does not tell them from others.
    ///
    /// With T_x their rows of T and T_xᵀ = U S its QR factors, only these unknowns fit the directions
    /// Q U, and take − S⁻ᵀ x off the residual along them.
    fn share_within(&self, unknowns: &[usize]) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let rows = self.root.select_rows(unknowns).transpose();
        // U = T_xᵀ W with W = S⁻¹.
        let (turned, within) = orthonormal(&rows, None);
        let x = self.optimum.select_rows(unknowns);
        (turned.ncols() == unknowns.len()).then(|| (turned, -within.tr_mul(&x)))
    }

    /// Returns the increase of the sum of squares without some unknowns; `None` where the fit does
    /// not tell them from others.
    pub fn loss_without(&self, unknowns: &[usize]) -> Option<f64> {
        self.share_within(unknowns).map(|(_, part)| part.norm_squared())
    }

    /// Returns columns of the data, shape = (3 N, k), with everything fitted projected out, shape =
    /// (3 N + priors, k).
    pub fn left_of(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut left = columns.clone().resize_vertically(self.residual.len(), 0.0);
        // Below the data there is nothing at first.
        self.take_off(&mut left, self.rows);
        let is_short = |k: &usize| {
            left.column(*k).norm() < MIN_PART_OF_ONE_PROJECTION * columns.column(*k).norm()
        };
        let short: Vec<usize> = (0..columns.ncols()).filter(is_short).collect();
        if !short.is_empty() {
            let mut again = left.select_columns(&short);
            self.take_off(&mut again, self.residual.len());
            short
                .iter()
                .zip(again.column_iter())
                .for_each(|(&k, column)| left.set_column(k, &column));
        }
        left
    }

    /// Subtracts from columns their components along the basis; their rows from `filled` on are
    /// zero.
    fn take_off(&self, left: &mut DMatrix<f64>, filled: usize) {
        if left.ncols() > MAX_SEQUENTIAL_COLUMNS {
            // The narrow side is transposed: this is the product that is fast.
            let along = (left.rows(0, filled).transpose() * self.basis.rows(0, filled)).transpose();
            left.gemm(-1.0, &self.basis, &along, 1.0);
            return;
        }
        let along = self.basis.rows(0, filled).tr_mul(&left.rows(0, filled));
        for (column, along) in self.basis.column_iter().zip(along.row_iter()) {
            let pairs = left.column_iter_mut().zip(along.iter());
            pairs.for_each(|(mut left, along)| left.axpy(-along, &column, 1.0));
        }
    }

    /// Whitened residual at the optimum, priors below.
    pub fn residual(&self) -> &DVector<f64> {
        &self.residual
    }

    /// Returns the score of columns, shape = (3 N, k).
    pub fn score(&self, columns: &DMatrix<f64>) -> Score {
        self.projected(columns, &self.basis.rows(0, self.rows).tr_mul(columns))
    }

    /// Returns the scores of several sets of columns, multiplied together.
    pub fn scores(&self, sets: &[DMatrix<f64>]) -> Vec<Score> {
        if sets.is_empty() {
            return Vec::new();
        }
        let columns =
            DMatrix::from_columns(&sets.iter().flat_map(DMatrix::column_iter).collect::<Vec<_>>());
        // The narrow side is transposed: this is the product that is fast.
        let along = (columns.transpose() * self.basis.rows(0, self.rows)).transpose();
        let mut first = 0;
        let mut next = |set: &DMatrix<f64>| {
            first += set.ncols();
            self.projected(set, &along.columns(first - set.ncols(), set.ncols()).into_owned())
        };
        sets.iter().map(&mut next).collect()
    }

    /// Returns the score of columns that have Qᵀ C along what was fitted.
    fn projected(&self, columns: &DMatrix<f64>, along: &DMatrix<f64>) -> Score {
        let gram = columns.tr_mul(columns) - along.tr_mul(along);
        let product = columns.tr_mul(&self.residual.rows(0, self.rows));
        Score {
            gram,
            product,
            lengths: columns.column_iter().map(|column| column.norm_squared()).collect(),
        }
    }

    /// Returns the largest principal angle \[rad\] between what two sets of columns add to the fit;
    /// `None` where one of them adds nothing.
    pub fn angle(&self, one: &DMatrix<f64>, other: &DMatrix<f64>) -> Option<f64> {
        let (a, b) = (self.directions(one).1, self.directions(other).1);
        if a.is_empty() || b.is_empty() {
            return None;
        }
        let cosines = a.tr_mul(&b).singular_values();
        cosines.iter().copied().reduce(f64::min).map(|cosine| cosine.clamp(0.0, 1.0).acos())
    }

    /// Returns the sum of squared residuals of poses that are left out, block by block, from the
    /// fit without them.
    ///
    /// `block` holds the block of each pose. A left-out residual is (I − H_bb)⁻¹ r_b, by Woodbury's
    /// identity r_b + Q_b (I − Q_bᵀQ_b)⁻¹ Q_bᵀ r_b. A direction that a block alone decides is left
    /// as it was fitted.
    pub fn cross_validate(&self, block: &[usize]) -> Option<f64> {
        self.left_out_squares(block).map(|sums| sums.iter().sum())
    }

    /// Returns that sum for each block.
    pub fn left_out_squares(&self, block: &[usize]) -> Option<Vec<f64>> {
        let blocks = block.iter().max().map_or(0, |last| last + 1);
        let n = self.basis.ncols();
        let left_out = |number: usize| {
            let rows: Vec<usize> = (0..self.rows).filter(|row| block[row / 3] == number).collect();
            let (basis, residual) =
                (self.basis.select_rows(&rows), self.residual.select_rows(&rows));
            let inner = DMatrix::identity(n, n) - gram(&basis);
            let step = decided(inner, &basis.tr_mul(&residual));
            (residual + basis * step).norm_squared()
        };
        let sums: Vec<f64> = (0..blocks).into_par_iter().map(left_out).collect();
        sums.iter().all(|sum| sum.is_finite()).then_some(sums)
    }
}

/// Returns true if at least `MIN_PART_OF_ONE_PROJECTION` of the length of every column is left.
fn most_is_left(left: &DMatrix<f64>, lengths: &[f64]) -> bool {
    left.column_iter()
        .zip(lengths)
        .all(|(column, length)| column.norm() >= MIN_PART_OF_ONE_PROJECTION * length)
}

/// Solves with a symmetric matrix of eigenvalues from 0 to 1; the solution is zero along
/// eigenvalues near 0.
fn decided(matrix: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    if let Some(root) = inverse_factor(&matrix)
        && root.diagonal().iter().all(|value| (value * value).recip() > MIN_DETERMINED_ELSEWHERE)
    {
        return root.tr_mul(&(&root * right));
    }
    let eigen = matrix.symmetric_eigen();
    let inverted = eigen
        .eigenvalues
        .map(|value| if value > MIN_DETERMINED_ELSEWHERE { value.recip() } else { 0.0 });
    &eigen.eigenvectors * eigen.eigenvectors.tr_mul(right).component_mul(&inverted)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Deterministic numbers without pattern.
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
        let rest =
            LinearNeighbourhood::new(&columns.columns(0, 3).into_owned(), &without, &fewer, 0);
        let lost = whole.loss_without(&[3, 4]).unwrap();
        let expected = rest.sums().squares - whole.sums().squares;
        assert!((lost - expected).abs() < 1e-10 && lost > 0.01);
        let with = rest.with(&columns.columns(3, 2).into_owned());
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
        let one = LinearNeighbourhood::new(&together, &residual, &three, 0);
        assert!((held.sums().squares / one.sums().squares - 1.0).abs() < 1e-12);
        let step = [one.step[0], one.step[1], one.step[2], 2.0 * one.step[2]];
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
