//! Identifiability of the unknowns: rank, condition number and unidentifiable combinations.
//!
//! Columns of the Jacobian are scaled to unit norm first, so that angles, lengths and logarithms
//! can be compared.

use nalgebra::{DMatrix, DVector};

use super::inverse::regular_inverse;
use super::singular::SingularValues;
use super::tridiagonal::eigenvalues_with_components;
use crate::numeric::gram;

/// Largest scaled singular value, relative to the largest of all, that counts as zero.
///
/// Exactly redundant parameters have about 1e-15; parameters that good data distinguish have more
/// than 1e-5.
pub const UNIDENTIFIABLE_BELOW: f64 = 1e-9;
/// Largest norm of a column, relative to the largest column, that counts as zero.
const MAX_ZERO_COLUMN_NORM: f64 = 1e-14;
/// Smallest coefficient of an unknown, relative to the norm of its combination, that makes it a
/// preferred pivot of the echelon form.
const MIN_PIVOT_COEFFICIENT: f64 = 0.1;
/// Largest coefficient of a combination of unit norm that counts as a rounding error.
const MAX_ROUNDING_COEFFICIENT: f64 = 1e-6;
/// Smallest relative singular value that certifies full rank without an SVD: twice
/// [`UNIDENTIFIABLE_BELOW`], to allow for rounding.
const MIN_CERTAIN_FULL_RANK: f64 = 2.0 * UNIDENTIFIABLE_BELOW;
/// Largest trailing pivot of the pivoted QR, relative to the first pivot, whose direction is
/// certainly unidentifiable.
const MAX_CERTAIN_NULL_PIVOT: f64 = 1e-12;

/// Number of columns from which singular values are those of the normal matrix where that is
/// accurate: an SVD takes ten times as long.
const MANY_COLUMNS: usize = 600;
/// Smallest singular value, relative to the largest one, that is taken from the normal matrix. Its
/// relative error is then about 1e-6.
const MIN_ROOT_OF_EIGENVALUE: f64 = 1e-5;
/// Smallest entry on the diagonal of a triangle with unit columns up to which no column is
/// permuted.
const MIN_LEADING_PIVOT: f64 = 1e-4;

/// Identifiability of the unknowns, from the triangular factor R of the Jacobian.
#[derive(Debug, Clone, PartialEq)]
pub struct Identifiability {
    /// Singular values of the column-scaled Jacobian, largest first.
    pub singular_values: Vec<f64>,
    /// Rank of the Jacobian: number of its singular values that are not zero but for rounding.
    pub rank: usize,
    /// Combinations of unknowns that change no residual.
    pub unidentifiable: Vec<UnidentifiableCombination>,
    /// Rows G, one for each unidentifiable combination, shape = (n − rank, n) \[1 / unit of x\]. G
    /// p is the part of a step p along these combinations. The rows are orthonormal in unknowns
    /// that are scaled by their column norms.
    pub gauge: DMatrix<f64>,
    /// Share of each unknown outside the unidentifiable combinations: 1 − squared length of its
    /// projection onto them, from 0 (not identifiable) to 1 (identifiable).
    pub visible: Vec<f64>,
}

/// Parameters that can change together without changing any measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct UnidentifiableCombination {
    /// Index and coefficient of each unknown, sorted by index. Unknowns are multiplied by the norm
    /// of their Jacobian column; the coefficients then have unit norm.
    pub weights: Vec<(usize, f64)>,
    /// Norm of the column-scaled Jacobian times the unit vector of the combination: 0 if no
    /// residual changes.
    pub singular_value: f64,
}

impl Identifiability {
    /// Analyses the Jacobian with triangular factor `triangle` (n × n).
    #[doc(hidden)]
    pub fn of(triangle: &DMatrix<f64>) -> Self {
        Self::in_order(triangle, &(0..triangle.ncols()).collect::<Vec<_>>())
    }

    /// Analyses what [`of`](Self::of) does, for the unknowns in another order: unknown j of the
    /// result is column `order[j]` of `triangle`.
    pub(crate) fn in_order(triangle: &DMatrix<f64>, order: &[usize]) -> Self {
        let ScaledTriangle { matrix: scaled, scale } = ScaledTriangle::of(triangle);
        let (singular_values, rank, null) = of_many(&scaled).unwrap_or_else(|| {
            let SingularValues { values, right } = SingularValues::of(&scaled);
            let threshold = UNIDENTIFIABLE_BELOW * values.first().copied().unwrap_or(0.0);
            let rank = values.iter().filter(|&&value| value > threshold).count();
            let null = orthogonal_complement(&right.columns(0, rank).into_owned());
            (values, rank, null)
        });
        let null = null.select_columns(order);
        let scale: Vec<f64> = order.iter().map(|&column| scale[column]).collect();
        let UnidentifiableSpace { gauge, visible } = UnidentifiableSpace::of(&null, &scale);
        Self {
            singular_values,
            rank,
            unidentifiable: echelon_combinations(null, &scaled.select_columns(order)),
            gauge,
            visible,
        }
    }

    /// Returns the ratio of the largest singular value to the smallest nonzero one.
    pub(crate) fn condition_number(&self) -> f64 {
        match self.singular_values[..self.rank] {
            [largest, .., smallest] => largest / smallest,
            [] | [_] => 1.0,
        }
    }

    /// Returns the observability indices O1 to O5 over the r identifiable directions, with m =
    /// `measurements` measured coordinates.
    ///
    /// O1 = (Π σ)^(1/r) / √m, O2 = `σ_r` / `σ_1`, O3 = `σ_r`, O4 = `σ_r`² / `σ_1`,
    /// O5 = 1 / Σ 1/σ [Sun & Hollerbach 2008].
    pub(crate) fn observability(&self, measurements: usize) -> [f64; 5] {
        let used = &self.singular_values[..self.rank];
        let (Some(&largest), Some(&smallest)) = (used.first(), used.last()) else {
            return [0.0; 5];
        };
        let mean_log = used.iter().map(|value| value.ln()).sum::<f64>() / used.len() as f64;
        [
            mean_log.exp() / (measurements as f64).sqrt(),
            smallest / largest,
            smallest,
            smallest * smallest / largest,
            used.iter().map(|value| value.recip()).sum::<f64>().recip(),
        ]
    }
}

/// Unidentifiable combinations of unknowns without the singular values, which take longer to
/// compute.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct UnidentifiableSpace {
    /// Basis of the unidentifiable combinations, see [`Identifiability::gauge`].
    pub gauge: DMatrix<f64>,
    /// Identified share of each unknown, see [`Identifiability::visible`].
    pub visible: Vec<f64>,
}

impl UnidentifiableSpace {
    /// Finds the unidentifiable combinations of the Jacobian with triangular factor `triangle` (n ×
    /// n).
    ///
    /// Computes singular values only if cheaper tests do not decide. If ‖R⁻¹‖ of R with unit
    /// columns bounds every singular value away from zero, the rank is full. If pivoted QR gives R
    /// P = Q [R₁ R₂; 0 ε] with R₁ of certainly full rank and ε at rounding level, the null space is
    /// spanned by P [−R₁⁻¹R₂; 1].
    pub fn in_triangle(triangle: &DMatrix<f64>) -> Self {
        let n = triangle.ncols();
        let ScaledTriangle { matrix: scaled, scale } = ScaledTriangle::of(triangle);
        if regular_inverse(&scaled, MIN_CERTAIN_FULL_RANK).is_some() {
            return Self { gauge: DMatrix::zeros(0, n), visible: vec![1.0; n] };
        }
        if let Some(null) = certain_null_of_many(&scaled).or_else(|| certain_null(&scaled, 0)) {
            return Self::of(&null, &scale);
        }
        let Identifiability { gauge, visible, .. } = Identifiability::of(triangle);
        Self { gauge, visible }
    }

    /// Returns the gauge and the visible shares. The rows of `null` are an orthonormal basis of the
    /// null space in scaled unknowns; `scale` holds the column norms by which the unknowns are
    /// scaled.
    fn of(null: &DMatrix<f64>, scale: &[f64]) -> Self {
        let visible = (0..null.ncols())
            .map(|j| (1.0 - null.column(j).norm_squared()).clamp(0.0, 1.0))
            .collect();
        Self {
            gauge: DMatrix::from_fn(null.nrows(), null.ncols(), |i, j| null[(i, j)] * scale[j]),
            visible,
        }
    }
}

/// Triangle whose columns are scaled to unit norm, and the norms. Columns that count as zero are
/// set to zero and have scale 1.
struct ScaledTriangle {
    matrix: DMatrix<f64>,
    scale: Vec<f64>,
}

impl ScaledTriangle {
    fn of(triangle: &DMatrix<f64>) -> Self {
        let norms: Vec<f64> = triangle.column_iter().map(|column| column.norm()).collect();
        let largest = norms.iter().copied().fold(0.0, f64::max);
        let scale: Vec<f64> = norms
            .iter()
            .map(|&norm| if norm > MAX_ZERO_COLUMN_NORM * largest { norm } else { 1.0 })
            .collect();
        let mut matrix = triangle.clone();
        for (mut column, (norm, scale)) in matrix.column_iter_mut().zip(norms.iter().zip(&scale)) {
            column.scale_mut(if *norm > MAX_ZERO_COLUMN_NORM * largest {
                scale.recip()
            } else {
                0.0
            });
        }
        Self { matrix, scale }
    }
}

/// Returns singular values, rank and null space of a matrix with many columns of unit norm; `None`
/// if it has few columns, or if only an SVD decides the rank and gives the values.
///
/// The values are the roots of the eigenvalues of the normal matrix, whose errors are relative to
/// the largest one. The null space is that of [`UnidentifiableSpace::in_triangle`].
fn of_many(scaled: &DMatrix<f64>) -> Option<(Vec<f64>, usize, DMatrix<f64>)> {
    let n = scaled.ncols();
    if n < MANY_COLUMNS {
        return None;
    }
    let null = match regular_inverse(scaled, MIN_CERTAIN_FULL_RANK) {
        Some(_) => DMatrix::zeros(0, n),
        None => certain_null_of_many(scaled)?,
    };
    let rank = n - null.nrows();
    let squares = eigenvalues_with_components(gram(scaled), &DVector::zeros(n))?;
    let mut values: Vec<f64> =
        squares.into_iter().map(|(square, _)| square.max(0.0).sqrt()).collect();
    values.sort_by(|a, b| b.total_cmp(a));
    values[rank..].fill(0.0);
    (values[rank - 1] > MIN_ROOT_OF_EIGENVALUE * values[0]).then_some((values, rank, null))
}

/// Returns what [`certain_null`] returns, if the matrix has many columns. The first columns, up to
/// a small entry on the diagonal, are not permuted.
fn certain_null_of_many(scaled: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let is_regular = |&k: &usize| scaled[(k, k)].abs() > MIN_LEADING_PIVOT;
    let leading = (0..scaled.ncols()).take_while(is_regular).count();
    if scaled.ncols() < MANY_COLUMNS { None } else { certain_null(scaled, leading) }
}

/// Returns orthonormal rows that span the null space of a matrix with unit columns; `None` if
/// pivoted QR cannot decide the rank with certainty. The first `leading` columns, which must form
/// an upper triangle, are not permuted.
fn certain_null(scaled: &DMatrix<f64>, leading: usize) -> Option<DMatrix<f64>> {
    let (n, behind) = (scaled.ncols(), scaled.ncols() - leading);
    let qr = scaled.view((leading, leading), (behind, behind)).into_owned().col_piv_qr();
    let mut triangle = scaled.clone();
    qr.p().permute_columns(&mut triangle.columns_mut(leading, behind));
    triangle.view_mut((leading, leading), (behind, behind)).copy_from(&qr.r());
    let largest = triangle.diagonal().amax();
    let is_large = |&k: &usize| triangle[(k, k)].abs() > MAX_CERTAIN_NULL_PIVOT * largest;
    let rank = (0..n).take_while(is_large).count();
    let remainder = triangle.view((rank, rank), (n - rank, n - rank)).norm();
    if rank == 0
        || rank == n
        || rank < leading
        || remainder.is_nan()
        || remainder > MAX_CERTAIN_NULL_PIVOT * n as f64 * largest
    {
        return None;
    }
    let first = triangle.view((0, 0), (rank, rank)).into_owned();
    // The largest singular value of all n columns is at most √n; `regular_inverse` assumes √rank.
    let inverse = regular_inverse(&first, MIN_CERTAIN_FULL_RANK * (n as f64 / rank as f64).sqrt())?;
    let mut null = DMatrix::zeros(n, n - rank);
    null.rows_mut(0, rank)
        .copy_from(&(inverse * triangle.view((0, rank), (rank, n - rank)) * -1.0));
    null.rows_mut(rank, n - rank).fill_with_identity();
    qr.p().inv_permute_rows(&mut null.rows_mut(leading, behind));
    Some(null.qr().q().transpose())
}

/// Returns orthonormal rows that span the orthogonal complement of the columns of `basis`, which
/// must be orthonormal.
pub(super) fn orthogonal_complement(basis: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, r) = basis.shape();
    // Squared length of each unit vector outside the span of `basis` and of earlier rows: its
    // projection, whose squared length is its own diagonal entry.
    let mut outside: Vec<f64> = basis.row_iter().map(|row| 1.0 - row.norm_squared()).collect();
    let mut rows = DMatrix::zeros(n, n - r);
    for k in 0..n - r {
        let order = |&i: &usize, &j: &usize| outside[i].total_cmp(&outside[j]);
        let longest = (0..n).max_by(order).unwrap_or(0);
        let mut direction = basis * basis.row(longest).transpose() * -1.0;
        direction[longest] += 1.0;
        let earlier = rows.columns(0, k);
        direction.gemv(-1.0, &earlier, &earlier.row(longest).transpose(), 1.0);
        direction.normalize_mut();
        outside.iter_mut().zip(&direction).for_each(|(outside, value)| *outside -= value * value);
        rows.set_column(k, &direction);
    }
    rows.transpose()
}

/// Returns the unidentifiable combinations as the reduced row echelon form of `null`, whose rows
/// span the null space of `scaled`.
///
/// This basis depends only on the space and has few unknowns in each combination. Pivots are the
/// first unknowns with a relative coefficient of at least [`MIN_PIVOT_COEFFICIENT`], then those above
/// [`MAX_ROUNDING_COEFFICIENT`].
fn echelon_combinations(
    mut null: DMatrix<f64>,
    scaled: &DMatrix<f64>,
) -> Vec<UnidentifiableCombination> {
    let (rows, n) = null.shape();
    let mut row = 0;
    let mut pivots = Vec::new();
    for (least, column) in [MIN_PIVOT_COEFFICIENT, MAX_ROUNDING_COEFFICIENT]
        .into_iter()
        .flat_map(|least| (0..n).map(move |column| (least, column)))
    {
        if row == rows {
            break;
        }
        let pivot = row + null.column(column).rows_range(row..).iamax();
        let entry = null[(pivot, column)].abs();
        if entry < MAX_ROUNDING_COEFFICIENT {
            for i in row..rows {
                null[(i, column)] = 0.0;
            }
        }
        if entry < least * null.row(pivot).norm()
            || entry < MAX_ROUNDING_COEFFICIENT
            || pivots.contains(&column)
        {
            continue;
        }
        pivots.push(column);
        null.swap_rows(row, pivot);
        let divisor = null[(row, column)];
        null.row_mut(row).unscale_mut(divisor);
        for other in (0..rows).filter(|&other| other != row) {
            let factor = null[(other, column)];
            for j in 0..n {
                null[(other, j)] -= factor * null[(row, j)];
            }
        }
        row += 1;
    }
    let mut order: Vec<usize> = (0..pivots.len()).collect();
    order.sort_by_key(|&row| pivots[row]);
    let null = null.select_rows(&order);
    null.row_iter()
        .map(|combination| {
            let norm = combination.norm();
            let weights: Vec<(usize, f64)> = combination
                .iter()
                .map(|weight| weight / norm)
                .enumerate()
                .filter(|(_, weight)| weight.abs() > MAX_ROUNDING_COEFFICIENT)
                .collect();
            let mut vector = DVector::zeros(n);
            for &(j, weight) in &weights {
                vector[j] = weight;
            }
            UnidentifiableCombination { weights, singular_value: (scaled * vector).norm() }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn duplicated_and_dead_columns_are_named() {
        // The columns are a, b, a, 0 and a + b.
        let base = DMatrix::from_row_slice(4, 2, &[1.0, 0.2, 0.5, -1.0, 0.0, 2.0, 3.0, 1.0]);
        let (a, b) = (base.column(0), base.column(1));
        let jacobian = DMatrix::from_columns(&[
            a.clone_owned(),
            b.clone_owned(),
            a.clone_owned(),
            DVector::zeros(4),
            a + b,
        ]);
        let mut padded = DMatrix::zeros(5, 5);
        padded.rows_mut(0, 4).copy_from(&jacobian);
        let triangle = padded.qr().unpack_r();
        let found = Identifiability::of(&triangle);
        assert_eq!(found.rank, 2);
        let unknowns: Vec<Vec<usize>> = found
            .unidentifiable
            .iter()
            .map(|combination| combination.weights.iter().map(|w| w.0).collect())
            .collect();
        assert_eq!(unknowns, [vec![0, 2], vec![1, 2, 4], vec![3]]);
        assert!(found.unidentifiable.iter().all(
            |combination| combination.singular_value < 1e-12 && combination.weights[0].1 > 0.0
        ));
        assert!(found.visible[3] == 0.0 && found.visible[1] > 0.0);
        // The combinations are orthonormal in scaled unknowns, and they change no row.
        let norms: Vec<f64> = triangle
            .column_iter()
            .map(|c| c.norm())
            .map(|n| if n > 1e-12 { n } else { 1.0 })
            .collect();
        let unscaled = |matrix: &DMatrix<f64>| {
            DMatrix::from_fn(matrix.nrows(), 5, |i, j| matrix[(i, j)] / norms[j])
        };
        let rows = unscaled(&found.gauge);
        assert!((&rows * rows.transpose() - DMatrix::identity(3, 3)).amax() < 1e-12);
        assert!((unscaled(&triangle) * rows.transpose()).amax() < 1e-12);
        // The tests without singular values find the same space.
        let blind = UnidentifiableSpace::in_triangle(&triangle);
        assert!(certain_null(&ScaledTriangle::of(&triangle).matrix, 0).is_some());
        let recovered = unscaled(&blind.gauge);
        assert!((recovered.transpose() * &recovered - rows.transpose() * &rows).amax() < 1e-12);
        assert!(
            blind
                .visible
                .iter()
                .zip(&found.visible)
                .all(|(value, other)| (value - other).abs() < 1e-12)
        );
    }

    #[test]
    fn what_pivots_do_not_decide_is_left_to_singular_values() {
        for small in [1e-6, 1e-9, 1e-11, 1e-13] {
            let mut triangle = DMatrix::from_fn(6, 6, |i, j| {
                if i <= j { ((1 + 3 * i + 7 * j) as f64).sin() + 1.5 } else { 0.0 }
            });
            triangle[(5, 5)] = small;
            let (blind, found) =
                (UnidentifiableSpace::in_triangle(&triangle), Identifiability::of(&triangle));
            assert_eq!(blind.gauge.nrows(), 6 - found.rank, "{small}");
            assert!(
                blind
                    .visible
                    .iter()
                    .zip(&found.visible)
                    .all(|(value, other)| (value - other).abs() < 1e-9),
                "{small}"
            );
        }
    }

    #[test]
    fn condition_and_observability_are_those_of_the_singular_values() {
        // Unit columns with the cosine c have the singular values √(1 + c) and √(1 − c); the lengths
        // of the columns do not count.
        let c: f64 = 0.28;
        let columns = [5.0, 0.0, 0.02 * c, 0.02 * (1.0 - c * c).sqrt()];
        let found = Identifiability::of(&DMatrix::from_column_slice(2, 2, &columns));
        let (largest, smallest) = ((1.0 + c).sqrt(), (1.0 - c).sqrt());
        assert!((found.condition_number() - largest / smallest).abs() < 1e-12);
        let expected = [
            (largest * smallest).sqrt() / 3.0,
            smallest / largest,
            smallest,
            smallest * smallest / largest,
            1.0 / (1.0 / largest + 1.0 / smallest),
        ];
        for (index, expected) in found.observability(9).into_iter().zip(expected) {
            assert!((index - expected).abs() < 1e-12, "{index} {expected}");
        }
        let blind = Identifiability::of(&DMatrix::zeros(2, 2));
        assert!((blind.condition_number() - 1.0).abs() < 1e-15);
        assert!(blind.observability(9).iter().all(|index| index.abs() < 1e-300));
    }
}
