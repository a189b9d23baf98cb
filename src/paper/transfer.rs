//! Transfer of the deflections of joints and links to the motion of the end frame, eq. 12-27 of the
//! paper.

use nalgebra::{Matrix4, Matrix6, Vector6};

use super::form::{Misprint, Reading};
use super::kinematics::{Chain, split};
use super::link::LinkTerms;
use super::loads::Loads;
use super::parameters::Parameters;
use super::{joint, parameters::Flexibility};

/// Returns the matrix that maps a differential motion Δ of a frame to U⁻¹ Δ U, the motion of a
/// frame that is located at U in it.
///
/// ```text
/// ⎡ nᵀ  (p × n)ᵀ ⎤
/// ⎢ oᵀ  (p × o)ᵀ ⎥
/// ⎢ aᵀ  (p × a)ᵀ ⎥     U = ⎡ n o a p ⎤
/// ⎢ 0      nᵀ    ⎥         ⎣ 0 0 0 1 ⎦
/// ⎢ 0      oᵀ    ⎥
/// ⎣ 0      aᵀ    ⎦                                                        [Chen2021, eq. 17, 18, 37]
/// ```
///
/// Motions [dx dy dz δx δy δz], \[m\] and \[rad\], are each in the frame that moves.
pub fn transfer(u: &Matrix4<f64>) -> Matrix6<f64> {
    let (axes, origin) = split(u);
    let mut out = Matrix6::zeros();
    for k in 0..3 {
        let axis = axes.column(k).into_owned();
        out.fixed_view_mut::<1, 3>(k, 0).copy_from(&axis.transpose());
        out.fixed_view_mut::<1, 3>(k, 3).copy_from(&origin.cross(&axis).transpose());
        out.fixed_view_mut::<1, 3>(k + 3, 3).copy_from(&axis.transpose());
    }
    out
}

/// Returns `J_Ji`, the transfer from the torsion of joint `k` (counted from 0) to the end frame,
/// with U = `U_{i+1}` [Chen2021, eq. 12-18].
///
/// dT = T₁ … `T_i` `Δ_Ji` T_{i+1} … T_n = T Δ_J gives Δ_J = `U_{i+1}`⁻¹ `Δ_Ji` `U_{i+1}` (eq. 14,
/// 15).
///
/// Printed differently (`TransferIndex`): eq. 16 has `U_i`; eq. 17 and 18 are right.
pub fn joint_transfer(chain: &Chain, k: usize, reading: &Reading) -> Matrix6<f64> {
    transfer(&chain.after[if reading.keeps(Misprint::TransferIndex) { k } else { k + 1 }])
}

/// Returns `J_Li`, the transfer from the deflection of the link before joint `k` (counted from 0)
/// to the end frame [Chen2021, eq. 20-26].
///
/// `T_i` = `T_i1` `T_i2` (eq. 20). The deflection is the motion of the tip frame, `T'_i1` = `T_i1`
/// (I + Δ), so that dT = T₁ … `T_i1` Δ `T_i2` … T_n = T Δ_L with Δ_L = (`T_i2` `U_{i+1}`)⁻¹ Δ
/// (`T_i2` `U_{i+1}`).
///
/// Printed differently (`LinkSide`): eq. 21 has `T'_i1` = (I + Δ) `T_i1`, which rotates the link
/// about its root and adds slope × length at the tip: Δ_L = `U_i`⁻¹ Δ `U_i`. With eq. 22 that is dT
/// = (V Δ V⁻¹) T, V = T₁ … T_{i−1}. This is eq. 24 in the inertial frame, as the text to eq. 26
/// says, but eq. 23 has T on the other side ([`inertial_link_transfer`] is the same motion in that
/// frame). Also printed differently (`LinkTransfer`): eq. 25 evaluates V⁻¹ Δ V; if it is kept, eq.
/// 21 has no effect.
pub fn link_transfer(chain: &Chain, k: usize, reading: &Reading) -> Matrix6<f64> {
    if reading.keeps(Misprint::LinkTransfer) {
        transfer(&chain.before[k])
    } else if reading.keeps(Misprint::LinkSide) {
        transfer(&chain.after[k])
    } else {
        transfer(&(chain.links[k].from_tip() * chain.after[k + 1]))
    }
}

/// Returns V Δ V⁻¹ with V = T₁ … T_{i−1}, as printed in eq. 24: the motion by eq. 21 of a body
/// fixed to the end frame, at the origin and in the axes of the inertial frame [Chen2021, eq. 24,
/// 26].
pub fn inertial_link_transfer(chain: &Chain, k: usize) -> Matrix6<f64> {
    let (axes, origin) = split(&chain.before[k]);
    let mut inverse = axes.transpose().to_homogeneous();
    inverse.fixed_view_mut::<3, 1>(0, 3).copy_from(&-(axes.tr_mul(&origin)));
    transfer(&inverse)
}

/// Deflections `d_f` = [`D_A` `D_B` … `d_J1` … `d_Jn`] of an arm in one pose, with the matrices
/// that transfer them to the end frame.
#[derive(Debug, Clone)]
pub struct Elastic {
    /// For each link that is a beam: index of the joint after it, `J_Li`, and its terms of eq. 4 or
    /// 6.
    links: Vec<(usize, Matrix6<f64>, LinkTerms)>,
    /// Motion `J_Ji` `d_Ji` of the end frame by each joint, divided by the joint's flexibility.
    joints: Vec<Vector6<f64>>,
    reading: Reading,
}

impl Elastic {
    /// Computes the deflections of the arm with frames `chain` under `loads`.
    pub fn new(chain: &Chain, loads: &Loads, reading: &Reading) -> Self {
        let links = loads.links.iter().enumerate().filter_map(|(k, link)| {
            Some((k, link_transfer(chain, k, reading), LinkTerms::new(link.as_ref()?, reading)))
        });
        let joints = loads.joints.iter().enumerate().map(|(k, loads)| {
            let angle = joint::torsion(k, loads, 1.0, &chain.links, reading);
            joint_transfer(chain, k, reading) * joint::motion(angle, &chain.links[k], reading)
        });
        Self { links: links.collect(), joints: joints.collect(), reading: *reading }
    }

    /// Returns the motion of the end frame by the joints, `D_fJ` = `J_J` `d_J`, end frame
    /// [Chen2021, eq. 19].
    pub fn of_joints(&self, parameters: &Parameters) -> Vector6<f64> {
        self.joints
            .iter()
            .zip(&parameters.joints)
            .map(|(motion, flexibility)| motion * *flexibility)
            .sum()
    }

    /// Returns the motion of the end frame by the link before joint `k`, end frame, one term of eq.
    /// 26.
    pub fn of_link(&self, k: usize, parameters: &Parameters) -> Vector6<f64> {
        let links = self.links.iter().filter(|(link, ..)| *link == k);
        links
            .map(|(_, transfer, terms)| {
                transfer * terms.motion(&parameters.links[k], &self.reading)
            })
            .sum()
    }

    /// Returns the motion of the end frame `D_f` = `D_fL` + `D_fJ` = `J_f` `d_f`, end frame
    /// [Chen2021, eq. 26, 27].
    pub fn motion(&self, parameters: &Parameters) -> Vector6<f64> {
        let links = self.links.iter().map(|(k, ..)| self.of_link(*k, parameters));
        self.of_joints(parameters) + links.sum::<Vector6<f64>>()
    }

    /// Returns the derivative ∂`D_f`/∂c with respect to the flexibility c = `which`, end frame.
    /// `D_f` is linear in all flexibilities.
    pub fn derivative(&self, which: Flexibility) -> Vector6<f64> {
        self.motion(&Parameters::unit(self.joints.len(), which))
    }
}
