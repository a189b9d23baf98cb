//! From deflections of joints and links to the motion of the end frame, eq. 12-27.

use nalgebra::{Matrix4, Matrix6, Vector6};

use super::form::{Misprint, Reading};
use super::kinematics::{Chain, split};
use super::link::LinkTerms;
use super::loads::Loads;
use super::parameters::Parameters;
use super::{joint, parameters::Flexibility};

/// The matrix that carries a differential motion Δ of a frame to U⁻¹ Δ U, the motion of a frame
/// that it sees at U.
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
/// Motions [dx dy dz δx δy δz], \[m\] and \[rad\], each in its own frame.
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

/// `J_Ji`: from the torsion of joint `k` (counted from 0) to the end frame, with U = `U_{i+1}`
/// [Chen2021, eq. 12-18]
///
/// dT = T₁ … `T_i` `Δ_Ji` T_{i+1} … T_n = T Δ_J gives Δ_J = `U_{i+1}`⁻¹ `Δ_Ji` `U_{i+1}` (eq. 14,
/// 15).
///
/// Printed differently: `TransferIndex`, eq. 16 has `U_i`; eq. 17 and 18 are right.
pub fn joint_transfer(chain: &Chain, k: usize, reading: &Reading) -> Matrix6<f64> {
    transfer(&chain.after[if reading.keeps(Misprint::TransferIndex) { k } else { k + 1 }])
}

/// `J_Li`: from the deflection of the link before joint `k` (counted from 0) to the end frame
/// [Chen2021, eq. 20-26]
///
/// `T_i` = `T_i1` `T_i2` (eq. 20). The deflection is the motion of the tip frame, `T'_i1` = `T_i1`
/// (I + Δ), so that dT = T₁ … `T_i1` Δ `T_i2` … T_n = T Δ_L with Δ_L = (`T_i2` `U_{i+1}`)⁻¹ Δ
/// (`T_i2` `U_{i+1}`).
///
/// Printed differently: `LinkSide`, eq. 21 has `T'_i1` = (I + Δ) `T_i1`, which turns the link about
/// its root and adds slope × length at the tip: Δ_L = `U_i`⁻¹ Δ `U_i`. With eq. 22 that is dT = (V
/// Δ V⁻¹) T, V = T₁ … T_{i−1}: eq. 24, in the inertial frame, as the text to eq. 26 says, where eq.
/// 23 has T on the other side ([`inertial_link_transfer`] is the same motion in that frame).
/// `LinkTransfer`: eq. 25 evaluates V⁻¹ Δ V instead; where it is kept, eq. 21 no longer matters.
pub fn link_transfer(chain: &Chain, k: usize, reading: &Reading) -> Matrix6<f64> {
    if reading.keeps(Misprint::LinkTransfer) {
        transfer(&chain.before[k])
    } else if reading.keeps(Misprint::LinkSide) {
        transfer(&chain.after[k])
    } else {
        transfer(&(chain.links[k].from_tip() * chain.after[k + 1]))
    }
}

/// V Δ V⁻¹ with V = T₁ … T_{i−1}, as eq. 24 stands: the motion by eq. 21 of what is fixed to the
/// end frame, seen at the origin of the inertial frame and in its axes
/// [Chen2021, eq. 24, 26]
pub fn inertial_link_transfer(chain: &Chain, k: usize) -> Matrix6<f64> {
    let (axes, origin) = split(&chain.before[k]);
    let mut inverse = axes.transpose().to_homogeneous();
    inverse.fixed_view_mut::<3, 1>(0, 3).copy_from(&-(axes.tr_mul(&origin)));
    transfer(&inverse)
}

/// Deflections of a pose: `d_f` = [`D_A` `D_B` … `d_J1` … `d_Jn`] and what carries each to the end
/// frame.
#[derive(Debug, Clone)]
pub struct Elastic {
    /// For each link that is a beam: its joint, `J_Li` and the terms of eq. 4 or 6.
    links: Vec<(usize, Matrix6<f64>, LinkTerms)>,
    /// For each joint: `J_Ji` `d_Ji` of unit flexibility.
    joints: Vec<Vector6<f64>>,
    reading: Reading,
}

impl Elastic {
    /// Of the rigid arm at a configuration under its loads.
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

    /// `D_fJ` = `J_J` `d_J`, motion of the end frame by the joints, end frame           [Chen2021,
    /// eq. 19]
    pub fn of_joints(&self, parameters: &Parameters) -> Vector6<f64> {
        self.joints
            .iter()
            .zip(&parameters.joints)
            .map(|(motion, flexibility)| motion * *flexibility)
            .sum()
    }

    /// Motion of the end frame by the link before joint `k` alone, end frame: one term of eq. 26.
    pub fn of_link(&self, k: usize, parameters: &Parameters) -> Vector6<f64> {
        let own = self.links.iter().filter(|(link, ..)| *link == k);
        own.map(|(_, carry, terms)| carry * terms.motion(&parameters.links[k], &self.reading)).sum()
    }

    /// `D_f` = `D_fL` + `D_fJ` = `J_f` `d_f`, motion of the end frame, end frame        [Chen2021,
    /// eq. 26, 27]
    pub fn motion(&self, parameters: &Parameters) -> Vector6<f64> {
        let links = self.links.iter().map(|(k, ..)| self.of_link(*k, parameters));
        self.of_joints(parameters) + links.sum::<Vector6<f64>>()
    }

    /// ∂`D_f`/∂c for the flexibility c = `which`; `D_f` is linear in all of them.
    pub fn derivative(&self, which: Flexibility) -> Vector6<f64> {
        self.motion(&Parameters::unit(self.joints.len(), which))
    }
}
