//! Torsion of the joints, eq. 8-11.

use nalgebra::Vector6;

use super::form::{Misprint, Reading};
use super::kinematics::Mdh;
use super::loads::JointLoads;

/// Δφ \[rad\] of joint `k` (counted from 0) with flexibility l/(`GI_p`) = 1/stiffness [rad/(N·m)].
///
/// Δφ = `M_V` l/(`GI_p`) − `M_F` l/(`GI_p`)
/// [Chen2021, eq. 8-10]
///
/// Moments about the joint's axis from weights and hoists, the latter with their own sign here.
/// Joint 1 turns about the vertical, so that Δφ = 0 (eq. 11) follows from the moments.
///
/// Printed differently: `JointTwoLength`, l₃ for joint 2's own length. What length that is the
/// paper does not say; taken as |d|, along which its joints are built, the printed form multiplies
/// by |d₃/d₂|, which is 1 for the nominal arm.
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
        && let [_, own, next, ..] = links
        && own.d != 0.0
        && next.d != 0.0
    {
        angle *= (next.d / own.d).abs();
    }
    angle
}

/// `d_Ji`: differential motion of frame i by a torsion Δφ \[rad\] of its joint, frame i.
///
/// `d_Ji` = Δφ [0 0 0 −sβ 0 cβ]ᵀ: the motion that Δθ makes, the third column of eq. 31; for β = 0
/// that is `d_Ji` = [0 0 0 0 0 Δφ]ᵀ
/// [Chen2021, eq. 8-11]
///
/// Printed differently: `JointAxis`, [0 0 0 0 0 Δφ]ᵀ for any β, though in eq. 1 the joint turns
/// before Ry(β).
pub fn motion(angle: f64, link: &Mdh, reading: &Reading) -> Vector6<f64> {
    let (sin, cos) =
        if reading.keeps(Misprint::JointAxis) { (0.0, 1.0) } else { link.beta.sin_cos() };
    Vector6::new(0.0, 0.0, 0.0, -sin, 0.0, cos) * angle
}
