//! Derivatives of an orientation, from those of points: where the ends of the target's axes go, so
//! turns the target.

use nalgebra::Vector3;

use super::parts::{Base, Inner, Target};
use super::pose::MeasuredOrientation;
use super::rows::Rows;
use crate::least_squares::Block;
use crate::problem::PoseView;
use crate::spatial::{Frame, inverse_right_jacobian, rotation_between};

/// Rows of the derivatives of the target and of the ends of its three axes, 1 m long.
pub(super) const PROBE_ROWS: usize = 12;

/// Where an orientation is differentiated.
pub(super) struct About<'a> {
    /// The pose as it was commanded, and as the joints take it.
    pub setup: (&'a PoseView<'a>, &'a PoseView<'a>),
    pub base: &'a Base,
    pub target: &'a Target,
    /// The frame that carries it, measuring frame.
    pub last: &'a Frame<f64>,
}

/// Writes the whitened residual log(R Rₚᵀ) / σ and its derivatives into three rows of a block of
/// zeros.
///
/// With eₖ the axes of Rₚ and deₖ what a parameter does to them, Rₚ turns by ω = ½ Σ eₖ × deₖ, and
/// the residual r changes by −J⁻¹(r) ω  ([`inverse_right_jacobian`]).
pub(super) fn write(
    inner: &mut Inner,
    probe: &mut Block,
    about: &About,
    orientation: &MeasuredOrientation,
    (block, row): (&mut Block, usize),
) {
    let About { setup: (commanded, setup), base, target, last } = *about;
    // What the last pose left there may be of another base.
    for column in 0..probe.parameters() {
        probe.column_mut(column).fill(0.0);
    }
    let ends = target.axes.map(|axis| target.position + axis);
    for (k, point) in std::iter::once(&target.position).chain(&ends).enumerate() {
        let mut rows = Rows { block: probe, row: 3 * k, scale: 1.0 };
        // The position has found its equilibrium.
        if inner.write(commanded, setup, base, (target.carrier, point), &mut rows).is_none() {
            return;
        }
        for (column, derivative) in base.turned(&last.point(point)) {
            rows.put(column, &derivative);
        }
    }
    let axes = target.axes.map(|axis| last.vector(&axis));
    let error =
        orientation.axes().map_or(Vector3::zeros(), |measured| rotation_between(&axes, &measured));
    let slope = inverse_right_jacobian(&error) / -orientation.sigma;
    let mut put = |column: usize, turned: [Vector3<f64>; 3]| {
        let turn: Vector3<f64> =
            axes.iter().zip(&turned).map(|(axis, turned)| axis.cross(turned) * 0.5).sum();
        block.column_mut(column)[row..row + 3].copy_from_slice((slope * turn).as_slice());
    };
    for column in 0..probe.parameters() {
        let own = probe.column(column);
        let point = |k: usize| Vector3::new(own[3 * k], own[3 * k + 1], own[3 * k + 2]);
        put(column, [1, 2, 3].map(|k| point(k) - point(0)));
    }
    for (column, turned) in target.turned() {
        put(column, turned.map(|axis| last.vector(&axis)));
    }
    let last_column = block.parameters();
    block.column_mut(last_column)[row..row + 3]
        .copy_from_slice((error / orientation.sigma).as_slice());
}
