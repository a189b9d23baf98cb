//! What the paper printed: the nominal arm of tables 1 and 2, and table 3.

use super::kinematics::Mdh;
use crate::problem::Problem;

/// Parameters nearer to those of the table than this are the same [m, rad].
const SAME: f64 = 1e-9;

/// Nominal α°, a m, θ°, d m, β° of each joint, with the α₂ of table 1              [Chen2021,
/// tables 1, 2]
pub const NOMINAL: [[f64; 5]; 4] = [
    [0.0, 0.0, 0.0, 0.10, 0.0],
    [-90.0, 0.0, 0.0, -0.10, 0.0],
    [0.0, 1.95, 0.0, -0.10, 0.0],
    [0.0, 1.75, 0.0, -0.10, 0.0],
];

/// Identified errors, α°, a m, θ°, d m, β° of each joint                                 [Chen2021,
/// table 2]
pub const ERRORS: [[f64; 5]; 4] = [
    [0.019, 0.0, -0.008, -0.003, 0.304],
    [-0.004, -0.002, 0.304, 0.016, 0.007],
    [-0.001, 0.024, 0.189, 0.005, 0.0],
    [-0.019, 0.016, -0.790, 0.008, 0.005],
];

/// Errors of 50 poses \[mm\]: along x, y, z, and their length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// Largest of each.
    pub max: [f64; 4],
    /// Mean of each.
    pub mean: [f64; 4],
}

/// Of the nominal arm
/// [Chen2021, table 3]
pub const BEFORE: Published =
    Published { max: [20.91, 22.72, 39.54, 48.9644], mean: [6.1646, 13.3304, 21.9786, 27.2506] };
/// Of the arm as identified by the paper, elasticity considered                     [Chen2021,
/// table 3]
pub const WITH_ELASTICITY: Published =
    Published { max: [2.5783, 3.4383, 4.3451, 5.5416], mean: [0.6845, 0.9578, 1.5093, 2.1358] };
/// Of the arm as identified by the paper, elasticity ignored                          [Chen2021,
/// table 3]
pub const IGNORING_IT: Published =
    Published { max: [7.8739, 4.1964, 5.9496, 6.4815], mean: [1.1303, 1.7519, 2.6873, 3.9673] };

/// Whether a problem declares the paper's arm: the nominal geometry of tables 1 and 2, by either
/// sign of α₂.
pub fn is_its_arm(problem: &Problem) -> bool {
    let alike = |(joint, [alpha, a, theta, d, beta]): (&crate::problem::Joint, &[f64; 5])| {
        let own = Mdh::nominal(joint);
        let angle = |own: f64, printed: f64| (own.abs() - printed.to_radians().abs()).abs() < SAME;
        angle(own.alpha, *alpha)
            && angle(own.theta, *theta)
            && angle(own.beta, *beta)
            && (own.a - a).abs() < SAME
            && (own.d - d).abs() < SAME
    };
    problem.joints.len() == NOMINAL.len() && problem.joints.iter().zip(&NOMINAL).all(alike)
}
