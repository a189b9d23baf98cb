//! Derivatives of an orientation, computed from those of points: the motions of the ends of the
//! target's axes give its rotation.

use nalgebra::Vector3;

use super::derivatives::{ArmDerivatives, BaseDerivatives, TargetDerivatives, angular_velocity};
use super::pose::MeasuredOrientation;
use super::rows::{Rows, clear_block};
use crate::least_squares::Block;
use crate::problem::PoseView;
use crate::spatial::{Frame, inverse_right_jacobian, rotation_between};

/// Number of rows for the derivatives of four points: the target and the ends of its three axes, 1
/// m long.
pub(super) const ROWS_OF_FOUR_POINTS: usize = 12;

/// Pose, base and target at which an orientation is differentiated.
pub(super) struct OrientedPose<'a> {
    /// Pose as commanded, and pose with the terms that add to its commands.
    pub setups: (&'a PoseView<'a>, &'a PoseView<'a>),
    /// Base of the arm.
    pub base: &'a BaseDerivatives,
    /// Target whose orientation is measured.
    pub target: &'a TargetDerivatives,
    /// Frame that carries the target, measuring frame.
    pub frame: &'a Frame<f64>,
}

/// Writes the whitened residual log(R Rₚᵀ) / σ of measured R and predicted Rₚ and its derivatives
/// into three rows of a block of zeros.
///
/// With eₖ the axes of Rₚ and deₖ their derivatives, Rₚ rotates by ω = ½ Σ eₖ × deₖ, and the
/// residual r changes by −J⁻¹(r) ω ([`inverse_right_jacobian`]).
pub(super) fn write(
    arm: &mut ArmDerivatives,
    points: &mut Block,
    place: &OrientedPose,
    orientation: &MeasuredOrientation,
    (block, row): (&mut Block, usize),
) {
    let OrientedPose { setups, base, target, frame } = *place;
    clear_block(points);
    let ends = target.axes.map(|axis| target.position + axis);
    for (k, point) in std::iter::once(&target.position).chain(&ends).enumerate() {
        let mut rows = Rows { block: points, row: 3 * k, scale: 1.0 };
        // The equilibrium exists, because the position of the same row was predicted before.
        if arm.write(setups, base, (target.joint, point), &mut rows).is_none() {
            return;
        }
        for (column, slope) in base.point_slopes(&frame.point(point)) {
            rows.put(column, &slope);
        }
    }
    let axes = target.axes.map(|axis| frame.vector(&axis));
    let error =
        orientation.axes().map_or(Vector3::zeros(), |measured| rotation_between(&axes, &measured));
    let slope = inverse_right_jacobian(&error) / -orientation.sigma;
    let mut put = |column: usize, slopes: [Vector3<f64>; 3]| {
        let velocity = angular_velocity(&axes, &slopes);
        block.column_mut(column)[row..row + 3].copy_from_slice((slope * velocity).as_slice());
    };
    for column in 0..points.parameters() {
        let column_of_points = points.column(column);
        let point = |k: usize| Vector3::from_column_slice(&column_of_points[3 * k..3 * k + 3]);
        put(column, [1, 2, 3].map(|k| point(k) - point(0)));
    }
    for (column, slopes) in target.axis_slopes() {
        put(column, slopes.map(|axis| frame.vector(&axis)));
    }
    let last_column = block.parameters();
    block.column_mut(last_column)[row..row + 3]
        .copy_from_slice((error / orientation.sigma).as_slice());
}
