//! Dot products, updates of columns and Cholesky factors, written for vector registers.
//!
//! Every loop keeps independent partial sums, so that the compiler can use wide registers where the
//! processor has them. The order of each sum is fixed and products are never fused, so that results
//! do not depend on the processor.

use multiversion::multiversion;
use nalgebra::{DMatrix, RealField};

/// Number of vectors that are combined in one pass over another vector: Householder reflectors that
/// are applied together to a column, or columns that are added to one.
pub(crate) const PANEL: usize = 4;
/// Number of independent partial sums of each dot product in [`dots`]; [`dot`] has twice as many.
const LANES: usize = 4;
/// Number of independent partial sums of a dot product in [`long_dot`].
const LONG_LANES: usize = 32;
/// Range of sums of squares that have neither overflowed nor lost digits by underflow.
const SAFE_SQUARES: std::ops::Range<f64> = 1e-280..1e280;

/// Returns the Euclidean norm, also where the squares of the entries would overflow or underflow.
pub(crate) fn norm(vector: &[f64]) -> f64 {
    let squares = sum_of_squares(vector);
    if SAFE_SQUARES.contains(&squares) || squares.is_nan() {
        return squares.sqrt();
    }
    let largest = vector.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    if largest == 0.0 || largest.is_infinite() {
        return largest;
    }
    let scaled: f64 = vector.iter().map(|v| (v / largest) * (v / largest)).sum();
    largest * scaled.sqrt()
}

/// Returns vᵀv, summed in a fixed order.
pub(crate) fn sum_of_squares(vector: &[f64]) -> f64 {
    dot(vector, vector)
}

/// Returns aᵀb, with independent partial sums in a fixed order.
#[inline(always)]
#[expect(clippy::inline_always, reason = "for every kind of processor")]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, a_rest) = a.as_chunks::<{ 2 * LANES }>();
    let (b, b_rest) = b.as_chunks::<{ 2 * LANES }>();
    let mut sums = [0.0; 2 * LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..2 * LANES {
            sums[l] += a[l] * b[l];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// Returns the four dot products vᵢᵀb, computed in one pass over b.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn dots(vectors: &[&[f64]; PANEL], b: &[f64]) -> [f64; PANEL] {
    let ([v0, v1, v2, v3], [r0, r1, r2, r3]) = split(vectors);
    let (b, rest) = b.as_chunks::<LANES>();
    let mut sums = [[0.0; LANES]; PANEL];
    for ((((b, v0), v1), v2), v3) in b.iter().zip(v0).zip(v1).zip(v2).zip(v3) {
        for l in 0..LANES {
            sums[0][l] += v0[l] * b[l];
            sums[1][l] += v1[l] * b[l];
            sums[2][l] += v2[l] * b[l];
            sums[3][l] += v3[l] * b[l];
        }
    }
    let tail = |r: &[f64]| r.iter().zip(rest).map(|(v, b)| v * b).sum::<f64>();
    let tails = [tail(r0), tail(r1), tail(r2), tail(r3)];
    std::array::from_fn(|i| (sums[i][0] + sums[i][1]) + (sums[i][2] + sums[i][3]) + tails[i])
}

/// Replaces b by b − Σ sᵢ vᵢ for four vectors vᵢ, in one pass over b.
#[multiversion(targets("x86_64+avx2"))]
pub(crate) fn subtract(b: &mut [f64], s: &[f64; PANEL], vectors: &[&[f64]; PANEL]) {
    let ([v0, v1, v2, v3], [r0, r1, r2, r3]) = split(vectors);
    let (b, rest) = b.as_chunks_mut::<LANES>();
    for ((((b, v0), v1), v2), v3) in b.iter_mut().zip(v0).zip(v1).zip(v2).zip(v3) {
        for l in 0..LANES {
            b[l] -= (s[0] * v0[l] + s[1] * v1[l]) + (s[2] * v2[l] + s[3] * v3[l]);
        }
    }
    for ((((b, v0), v1), v2), v3) in rest.iter_mut().zip(r0).zip(r1).zip(r2).zip(r3) {
        *b -= (s[0] * v0 + s[1] * v1) + (s[2] * v2 + s[3] * v3);
    }
}

type Chunks<'a> = [&'a [[f64; LANES]]; PANEL];

/// Splits each of the four vectors into whole chunks of [`LANES`] values and a remainder.
#[inline(always)]
#[expect(clippy::inline_always, reason = "for every kind of processor")]
fn split<'a>(vectors: &[&'a [f64]; PANEL]) -> (Chunks<'a>, [&'a [f64]; PANEL]) {
    let parts = vectors.map(<[f64]>::as_chunks::<LANES>);
    (parts.map(|p| p.0), parts.map(|p| p.1))
}

/// Returns AᵀB by dot products, for a tall A with few columns. nalgebra would form it by axpy
/// operations on columns as short as A is narrow.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn few_transposed_times<T: RealField + Copy>(
    a: &DMatrix<T>,
    b: &DMatrix<T>,
) -> DMatrix<T> {
    let mut out = DMatrix::zeros(a.ncols(), b.ncols());
    let rows = a.nrows().max(1);
    let columns = b.as_slice().chunks_exact(rows);
    for (out, b) in out.as_mut_slice().chunks_exact_mut(a.ncols().max(1)).zip(columns) {
        for (out, a) in out.iter_mut().zip(a.as_slice().chunks_exact(rows)) {
            *out = long_dot(a, b);
        }
    }
    out
}

/// Returns the dot product aᵀb with [`LONG_LANES`] partial sums, for long vectors.
#[inline(always)]
#[expect(clippy::inline_always, reason = "for every kind of processor")]
fn long_dot<T: RealField + Copy>(a: &[T], b: &[T]) -> T {
    let (a, a_rest) = a.as_chunks::<LONG_LANES>();
    let (b, b_rest) = b.as_chunks::<LONG_LANES>();
    let mut sums = [T::zero(); LONG_LANES];
    for (a, b) in a.iter().zip(b) {
        for l in 0..LONG_LANES {
            sums[l] += a[l] * b[l];
        }
    }
    let mut width = LONG_LANES / 2;
    while width > 0 {
        for l in 0..width {
            sums[l] += sums[l + width];
        }
        width /= 2;
    }
    a_rest.iter().zip(b_rest).fold(sums[0], |sum, (a, b)| sum + *a * *b)
}

/// Replaces y by y + A x. The columns of A begin `stride` entries apart in `columns`; each is as
/// long as y.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn add_product(y: &mut [f64], (columns, stride): (&[f64], usize), x: &[f64]) {
    let rows = y.len();
    let (panels, rest) = x.as_chunks::<PANEL>();
    let column = |k: usize| &columns[k * stride..][..rows];
    for (k, x) in panels.iter().enumerate() {
        let (a, b) = (column(PANEL * k), column(PANEL * k + 1));
        let (c, d) = (column(PANEL * k + 2), column(PANEL * k + 3));
        for i in 0..rows {
            y[i] += (x[0] * a[i] + x[1] * b[i]) + (x[2] * c[i] + x[3] * d[i]);
        }
    }
    for (k, x) in rest.iter().enumerate() {
        let a = column(PANEL * panels.len() + k);
        for i in 0..rows {
            y[i] += x * a[i];
        }
    }
}

/// Replaces y by y − a s − b t.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn subtract_two(y: &mut [f64], (a, s): (&[f64], f64), (b, t): (&[f64], f64)) {
    let rows = y.len();
    let (a, b) = (&a[..rows], &b[..rows]);
    for i in 0..rows {
        y[i] -= a[i] * s + b[i] * t;
    }
}

/// Replaces the lower half of a symmetric n × n matrix, stored column by column, by its Cholesky
/// factor L. Returns false if the matrix is not positive definite. The upper half is not read.
///
/// Multiples of four earlier columns at a time are subtracted from each column.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn factor_in_place(n: usize, entries: &mut [f64]) -> bool {
    for j in 0..n {
        let (before, here) = entries.split_at_mut(j * n);
        let (rows, column) = (n - j, &mut here[j..n]);
        let mut k = 0;
        while k + PANEL <= j {
            let (a, b) = (&before[k * n + j..][..rows], &before[(k + 1) * n + j..][..rows]);
            let (c, d) = (&before[(k + 2) * n + j..][..rows], &before[(k + 3) * n + j..][..rows]);
            let s = [a[0], b[0], c[0], d[0]];
            for i in 0..rows {
                column[i] -= (s[0] * a[i] + s[1] * b[i]) + (s[2] * c[i] + s[3] * d[i]);
            }
            k += PANEL;
        }
        while k < j {
            let a = &before[k * n + j..][..rows];
            let s = a[0];
            for i in 0..rows {
                column[i] -= s * a[i];
            }
            k += 1;
        }
        let pivot = column[0];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return false;
        }
        let root = pivot.sqrt();
        column[0] = root;
        column[1..].iter_mut().for_each(|y| *y /= root);
    }
    true
}

/// Writes the inverse of the `count` rows and columns of a lower triangle from index `first` on to
/// the same place of `inverse`, which is zero there. Both matrices are stored column by column with
/// `n` rows.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn invert_lower(
    (lower, n): (&[f64], usize),
    (first, count): (usize, usize),
    inverse: &mut [f64],
) {
    for j in 0..count {
        let x = &mut inverse[(first + j) * n + first..][..count];
        x[j] = 1.0;
        for k in j..count {
            let left = &lower[(first + k) * n + first + k..][..count - k];
            let (solved, rest) = x[k..].split_at_mut(1);
            solved[0] /= left[0];
            let factor = solved[0];
            rest.iter_mut().zip(&left[1..]).for_each(|(x, entry)| *x -= factor * entry);
        }
    }
}

/// Replaces the Gram matrix G of a few columns by G − YᵀY. The columns of Y are stored one after
/// the other in `along`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(crate) fn subtract_few_products(gram: &mut [f64], along: &[f64], count: usize) {
    let rows = along.len() / count.max(1);
    for j in 0..count {
        for i in 0..=j {
            let product = dot(&along[i * rows..][..rows], &along[j * rows..][..rows]);
            gram[j * count + i] -= product;
            if i < j {
                gram[i * count + j] -= product;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_columns_are_multiplied_like_many() {
        let entry =
            |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0;
        for (rows, few, many) in [(0, 2, 3), (5, 0, 3), (31, 1, 7), (97, 6, 40)] {
            let (a, b) = (DMatrix::from_fn(rows, few, entry), DMatrix::from_fn(rows, many, entry));
            let expected = a.tr_mul(&b);
            assert!(
                rows == 0 || few == 0 || (few_transposed_times(&a, &b) - &expected).amax() < 1e-13
            );
            assert_eq!(few_transposed_times(&a, &b).shape(), expected.shape());
            let x: Vec<f64> = (0..many).map(|j| entry(3, j)).collect();
            let mut y = vec![1.0; rows];
            add_product(&mut y, (b.as_slice(), rows), &x);
            let expected = (&b * nalgebra::DVector::from_vec(x)).add_scalar(1.0);
            assert!(y.iter().zip(&expected).all(|(y, expected)| (y - expected).abs() < 1e-13));
        }
    }

    #[test]
    fn a_matrix_is_factored_or_refused() {
        for n in [0, 1, 3, 4, 9, 30] {
            let a = DMatrix::from_fn(n, n, |i, j| {
                (12.9898 * i as f64 + 78.233 * j as f64).sin() + if i == j { 4.0 } else { 0.0 }
            });
            let matrix = a.transpose() * a;
            let mut lower = matrix.clone();
            assert!(factor_in_place(n, lower.as_mut_slice()));
            lower.fill_upper_triangle(0.0, 1);
            assert!(n == 0 || (&lower * lower.transpose() - &matrix).amax() < 1e-12);
            let mut singular = matrix - DMatrix::identity(n, n) * 1e3;
            assert_eq!(factor_in_place(n, singular.as_mut_slice()), n == 0);
        }
    }
}
