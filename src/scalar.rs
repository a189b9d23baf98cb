//! The scalar that the physics is generic over.

use nalgebra::{Const, SVector};
use num_dual::{Derivative, DualNum, DualSVec64};

/// A real number or a dual number: what every formula of the arm is written in.
///
/// `f64` gives values; `num_dual::DualSVec64<N>` gives values and N derivatives at once.
pub trait Scalar: DualNum<f64> + Copy + Send + Sync {}

impl<T: DualNum<f64> + Copy + Send + Sync> Scalar for T {}

/// `value` as a dual number, with a unit derivative in `direction` where that lies within the N
/// seeded ones.
pub fn seeded<const N: usize>(value: f64, direction: Option<usize>) -> DualSVec64<N> {
    match direction {
        Some(k) if k < N => DualSVec64::new(value, Derivative::derivative_generic(Const, Const, k)),
        _ => DualSVec64::from_re(value),
    }
}

/// The N derivatives that a dual number carries.
pub fn gradient<const N: usize>(value: &DualSVec64<N>) -> SVector<f64, N> {
    value.eps.unwrap_generic(Const, Const)
}
