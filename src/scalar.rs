//! Scalar type in which the formulas of the arm are written.

use nalgebra::{Const, SVector};
use num_dual::{Derivative, DualNum, DualSVec64};

/// Real or dual number, for which every formula of the arm is generic.
///
/// `f64` gives values; `num_dual::DualSVec64<N>` gives values and N derivatives at once.
pub trait Scalar: DualNum<f64> + Copy + Send + Sync {}

impl<T: DualNum<f64> + Copy + Send + Sync> Scalar for T {}

/// Returns `value` as a dual number with derivative 1 with respect to direction number `direction`,
/// 0…N − 1; without derivatives if that is `None` or at least N.
pub fn seeded<const N: usize>(value: f64, direction: Option<usize>) -> DualSVec64<N> {
    match direction {
        Some(k) if k < N => DualSVec64::new(value, Derivative::derivative_generic(Const, Const, k)),
        _ => DualSVec64::from_re(value),
    }
}

/// Returns the derivatives of a dual number with respect to its N directions.
pub fn gradient<const N: usize>(value: &DualSVec64<N>) -> SVector<f64, N> {
    value.eps.unwrap_generic(Const, Const)
}
