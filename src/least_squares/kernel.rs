//! Dot products and updates of columns in vector registers.
//!
//! Every loop keeps independent partial sums, so that the compiler can use wide registers where the
//! processor has them. The order of each sum is fixed and products are never fused, so that results
//! do not depend on the processor.

use multiversion::multiversion;

/// Number of Householder reflectors applied together to one trailing column.
pub(super) const PANEL: usize = 4;
/// Number of independent partial sums of a dot product.
const LANES: usize = 4;
/// Sums of squares inside this range have neither overflowed nor underflowed.
const SAFE_SQUARES: std::ops::Range<f64> = 1e-280..1e280;

/// Returns the Euclidean norm without overflow or underflow.
pub(super) fn norm(vector: &[f64]) -> f64 {
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
#[inline]
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

/// Returns the four products vᵢᵀb from one pass over b.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn dots(vectors: &[&[f64]; PANEL], b: &[f64]) -> [f64; PANEL] {
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

/// Subtracts Σ sᵢ vᵢ from b in one pass over b.
#[multiversion(targets("x86_64+avx2"))]
pub(super) fn subtract(b: &mut [f64], s: &[f64; PANEL], vectors: &[&[f64]; PANEL]) {
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
