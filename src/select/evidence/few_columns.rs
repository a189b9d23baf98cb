//! Terms of the marginal likelihood of a few columns, computed without allocating memory.

use nalgebra::{DMatrix, DVector};

/// Largest number of columns whose Gram matrix is factored on the stack.
pub(super) const MAX_FEW: usize = 8;

/// Returns ½ ln det(1 + c² G) and bᵀ (1/c² + G)⁻¹ b for at most [`MAX_FEW`] columns, with G = `gram`,
/// b = `product` and c = `size`; `None` if 1/c² + G is not positive definite.
///
/// With 1/c² + G = L Lᵀ: det(1 + c² G) = c^2k det(L)², and the second term is |L⁻¹ b|².
pub(super) fn shrinkage_of_few(
    gram: &DMatrix<f64>,
    product: &DVector<f64>,
    size: f64,
) -> Option<(f64, f64)> {
    let precision = (size * size).recip();
    let mut lower = [[0.0; MAX_FEW]; MAX_FEW];
    let mut whitened = [0.0; MAX_FEW];
    let (mut determinant, mut squares) = (1.0, 0.0);
    for i in 0..product.len() {
        for j in 0..i {
            let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            lower[i][j] = (gram[(i, j)] - known) / lower[j][j];
        }
        let known: f64 = lower[i][..i].iter().map(|entry| entry * entry).sum();
        let pivot = (gram[(i, i)] + precision - known).sqrt();
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        lower[i][i] = pivot;
        let known: f64 = (0..i).map(|k| lower[i][k] * whitened[k]).sum();
        whitened[i] = (product[i] - known) / pivot;
        determinant *= pivot * size;
        squares += whitened[i] * whitened[i];
    }
    Some((determinant.ln(), squares))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_columns_shrink_as_the_formula_says() {
        for k in 1..=MAX_FEW {
            let columns =
                DMatrix::from_fn(12, k, |i, j| ((1 + 3 * i + 7 * j + i * j) as f64).sin());
            let gram = columns.tr_mul(&columns);
            let product = DVector::from_fn(k, |i, _| (i as f64 + 0.5).cos());
            for size in [0.3, 30.0] {
                let (determinant, squares) = shrinkage_of_few(&gram, &product, size).unwrap();
                let identity = DMatrix::identity(k, k);
                let expected = 0.5 * (&identity + &gram * (size * size)).determinant().ln();
                assert!((determinant - expected).abs() < 1e-12, "{k}");
                let with_prior = &gram + identity / (size * size);
                let expected = product.dot(&with_prior.lu().solve(&product).unwrap());
                assert!((squares / expected - 1.0).abs() < 1e-10, "{k}");
            }
            let singular = DMatrix::from_diagonal_element(k, k, -1.0);
            assert_eq!(shrinkage_of_few(&singular, &product, 10.0), None);
        }
    }
}
