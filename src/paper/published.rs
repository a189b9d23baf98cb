//! Published values of the paper: nominal arm, identified parameter errors, and position errors.

use super::kinematics::Mdh;
use crate::problem::Problem;

/// Largest difference of a declared parameter from the tabulated one that counts as equal \[m\] or
/// \[rad\]: above the rounding of conversions, below every printed digit.
const MAX_TABLE_DIFFERENCE: f64 = 1e-9;

/// Nominal α \[°\], a \[m\], θ \[°\], d \[m\], β \[°\] of each joint, with the α₂ of table 1
/// [Chen2021, tables 1, 2].
pub const NOMINAL: [[f64; 5]; 4] = [
    [0.0, 0.0, 0.0, 0.10, 0.0],
    [-90.0, 0.0, 0.0, -0.10, 0.0],
    [0.0, 1.95, 0.0, -0.10, 0.0],
    [0.0, 1.75, 0.0, -0.10, 0.0],
];

/// Deviations from nominal of α \[°\], a \[m\], θ \[°\], d \[m\], β \[°\] of each joint that the
/// paper identified [Chen2021, table 2].
pub const ERRORS: [[f64; 5]; 4] = [
    [0.019, 0.0, -0.008, -0.003, 0.304],
    [-0.004, -0.002, 0.304, 0.016, 0.007],
    [-0.001, 0.024, 0.189, 0.005, 0.0],
    [-0.019, 0.016, -0.790, 0.008, 0.005],
];

/// Position errors over the 50 verification poses \[mm\]: along x, y, z, and their length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Published {
    /// Maximum over the poses of the absolute errors along x, y, z and of the length \[mm\].
    pub max: [f64; 4],
    /// Mean over the poses of the absolute errors along x, y, z and of the length \[mm\].
    pub mean: [f64; 4],
}

/// Position errors of the nominal arm, before identification [Chen2021, table 3].
pub const BEFORE: Published =
    Published { max: [20.91, 22.72, 39.54, 48.9644], mean: [6.1646, 13.3304, 21.9786, 27.2506] };
/// Position errors of the arm as identified in the paper with elasticity [Chen2021, table 3].
pub const WITH_ELASTICITY: Published =
    Published { max: [2.5783, 3.4383, 4.3451, 5.5416], mean: [0.6845, 0.9578, 1.5093, 2.1358] };
/// Position errors of the arm as identified in the paper without elasticity [Chen2021, table 3].
pub const WITHOUT_ELASTICITY: Published =
    Published { max: [7.8739, 4.1964, 5.9496, 6.4815], mean: [1.1303, 1.7519, 2.6873, 3.9673] };

/// Returns true if a problem declares the arm of the paper: as many joints, with the nominal
/// geometry of tables 1 and 2. Angles may have either sign, since the tables disagree on that of
/// α₂.
pub fn is_published_arm(problem: &Problem) -> bool {
    let is_equal = |(joint, [alpha, a, theta, d, beta]): (&crate::problem::Joint, &[f64; 5])| {
        let declared = Mdh::nominal(joint);
        let is_equal_angle = |declared: f64, printed: f64| {
            (declared.abs() - printed.to_radians().abs()).abs() < MAX_TABLE_DIFFERENCE
        };
        is_equal_angle(declared.alpha, *alpha)
            && is_equal_angle(declared.theta, *theta)
            && is_equal_angle(declared.beta, *beta)
            && (declared.a - a).abs() < MAX_TABLE_DIFFERENCE
            && (declared.d - d).abs() < MAX_TABLE_DIFFERENCE
    };
    problem.joints.len() == NOMINAL.len() && problem.joints.iter().zip(&NOMINAL).all(is_equal)
}
