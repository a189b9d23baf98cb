//! Motion of the end frame by errors of the geometric parameters, eq. 28-38 of the paper.

use nalgebra::{DMatrix, Matrix6, SMatrix, matrix};

use super::form::{Misprint, Reading};
use super::kinematics::{Chain, Mdh};
use super::transfer::transfer;

/// Returns the matrix from `e_i` = [Δα Δa Δθ Δd Δβ] to the differential motion [dx dy dz δx δy δz]
/// of frame i, in frame i.
///
/// ```text
/// ⎡ −d sθ cβ   cθ cβ    0   −sβ  0 ⎤
/// ⎢ −d cθ     −sθ       0    0   0 ⎥
/// ⎢ −d sθ sβ   cθ sβ    0    cβ  0 ⎥
/// ⎢  cθ cβ      0     −sβ    0   0 ⎥
/// ⎢ −sθ         0       0    0   1 ⎥
/// ⎣  cθ sβ      0      cβ    0   0 ⎦                                            [Chen2021, eq. 30, 31]
/// ```
///
/// It is exact for `dT_i` = `T_i` `Δ_i`; see [`error_transfer`] for the form of eq. 28.
pub fn error_matrix(link: &Mdh) -> SMatrix<f64, 6, 5> {
    let (st, ct) = link.theta.sin_cos();
    let (sb, cb) = link.beta.sin_cos();
    let d = link.d;
    matrix![
        -d * st * cb, ct * cb, 0.0, -sb, 0.0;
        -d * ct, -st, 0.0, 0.0, 0.0;
        -d * st * sb, ct * sb, 0.0, cb, 0.0;
        ct * cb, 0.0, -sb, 0.0, 0.0;
        -st, 0.0, 0.0, 0.0, 1.0;
        ct * sb, 0.0, cb, 0.0, 0.0
    ]
}

/// Returns the matrix from the motion of frame i (joint `k`, counted from 0) to that of the end
/// frame.
///
/// dT = Σ T₁ … `T_i` `Δ_i` T_{i+1} … T_n = T Σ `U_{i+1}`⁻¹ `Δ_i` `U_{i+1}`          [Chen2021, eq.
/// 32-37]
///
/// Printed differently (`GeometricSide`): eq. 28 and 29 have `dT_i` = `Δ_i` `T_i`, which gives
/// `U_i`⁻¹ `Δ_i` `U_i`. Eq. 31 and eq. 33-37 hold for `T_i` `Δ_i`.
pub fn error_transfer(chain: &Chain, k: usize, reading: &Reading) -> Matrix6<f64> {
    transfer(&chain.after[if reading.keeps(Misprint::GeometricSide) { k } else { k + 1 }])
}

/// Returns `J_g` = [`J_g1` … `J_gn`], shape = (6, 5n), with `D_g` = `J_g` e, the motion of the end
/// frame in the end frame [Chen2021, eq. 38].
pub fn jacobian(chain: &Chain, reading: &Reading) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(6, 5 * chain.links.len());
    for (k, link) in chain.links.iter().enumerate() {
        out.fixed_view_mut::<6, 5>(0, 5 * k)
            .copy_from(&(error_transfer(chain, k, reading) * error_matrix(link)));
    }
    out
}
