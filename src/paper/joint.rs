//! Torsion of the joints by the moments about their axes, eq. 8-11 of the paper.

use nalgebra::Vector6;

use super::form::{Misprint, Reading};
use super::kinematics::Mdh;
use super::loads::JointLoads;

/// Returns the torsion angle Δφ \[rad\] of joint `k` (counted from 0) with flexibility l/(`GI_p`) =
/// 1/stiffness [rad/(N·m)].
///
/// Δφ = `M_V` l/(`GI_p`) − `M_F` l/(`GI_p`) [Chen2021, eq. 8-10]
///
/// The moments `M_V` and `M_F` about the joint axis come from weights and hoists; `loads.hoists`
/// is −`M_F`. Joint 1 rotates about the vertical, so that its moments and Δφ are 0 (eq. 11).
///
/// Printed differently (`JointTwoLength`): l₃ instead of the length of joint 2. The paper does not
/// define that length. With |d|, along which its joints are built, the printed form multiplies by
/// |d₃/d₂|, which is 1 for the nominal arm.
pub fn torsion(
    k: usize,
    loads: &JointLoads,
    flexibility: f64,
    links: &[Mdh],
    reading: &Reading,
) -> f64 {
    let mut angle = flexibility * (loads.weights + loads.hoists);
    if k == 1
        && reading.keeps(Misprint::JointTwoLength)
        && let [_, second, third, ..] = links
        && second.d != 0.0
        && third.d != 0.0
    {
        angle *= (third.d / second.d).abs();
    }
    angle
}

/// Returns the differential motion `d_Ji` of frame i by a torsion `angle` Δφ \[rad\] of its joint,
/// in the axes of frame i: translation \[m\], then rotation \[rad\].
///
/// `d_Ji` = Δφ [0 0 0 −sβ 0 cβ]ᵀ, the motion by Δθ, third column of eq. 31; for β = 0 it is [0 0 0
/// 0 0 Δφ]ᵀ [Chen2021, eq. 8-11].
///
/// Printed differently (`JointAxis`): [0 0 0 0 0 Δφ]ᵀ for any β, although in eq. 1 the joint
/// rotates before Ry(β).
pub fn motion(angle: f64, link: &Mdh, reading: &Reading) -> Vector6<f64> {
    let (sin, cos) =
        if reading.keeps(Misprint::JointAxis) { (0.0, 1.0) } else { link.beta.sin_cos() };
    Vector6::new(0.0, 0.0, 0.0, -sin, 0.0, cos) * angle
}
