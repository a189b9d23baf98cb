//! Derivatives of bases and targets, and of the arm between them.

use nalgebra::Vector3;
use num_dual::DualSVec64;

use super::elastic::ElasticDerivatives;
use super::rigid::RigidDerivatives;
use super::rows::Rows;
use crate::problem::{BasePose, PoseView};
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, rotation_axes};

/// Base frame with its derivatives, and the Jacobian column of each of its six coordinates.
#[derive(Clone)]
pub(super) struct BaseDerivatives {
    /// Frame of the base, expressed in the measuring frame.
    pub frame: Frame<f64>,
    /// Unit vectors along which the translation coordinates x, y and z move the base, measuring
    /// frame.
    pub directions: [Vector3<f64>; 3],
    /// Derivatives of the base's axes with respect to its rotation vector.
    rotation_slopes: [Frame<f64>; 3],
    /// Jacobian column of each parameter that rotates the base about the measuring frame's origin.
    /// The frame contains the derivative ∂R/∂x R⁻¹ of that rotation R: it maps a point to its
    /// derivative, measuring frame.
    effect_slopes: Vec<(usize, Frame<f64>)>,
    /// Jacobian columns of the base's translation and rotation vector; `None` for fixed
    /// coordinates.
    pub columns: [Option<usize>; 6],
}

/// Target with its derivatives, and the Jacobian column of each of its six coordinates.
pub(super) struct TargetDerivatives {
    /// Index of the joint whose frame carries the target.
    pub joint: usize,
    /// Position of the target in the joint's frame \[m\].
    pub position: Vector3<f64>,
    /// Unit vectors of the target's axes, joint's frame.
    pub axes: [Vector3<f64>; 3],
    /// Derivatives of the target's axes with respect to its rotation vector.
    rotation_slopes: [Frame<f64>; 3],
    /// Jacobian columns of the target's position and rotation vector; `None` for fixed coordinates.
    pub columns: [Option<usize>; 6],
}

/// Method that differentiates the arm with respect to its parameters: rigid kinematics or statics.
pub(super) enum ArmDerivatives {
    /// Derivatives of a rigid arm, one elementary motion (rotation or translation) at a time.
    Rigid(RigidDerivatives),
    /// Derivatives of an elastic arm, through the statics.
    Elastic(Box<ElasticDerivatives>),
}

impl BaseDerivatives {
    /// Creates the base at a pose in the measuring frame, with all its coordinates fixed.
    pub fn new(pose: &BasePose) -> Self {
        Self {
            frame: Frame::from_rotation_vector(pose.translation, &pose.rotation),
            directions: [Vector3::x(), Vector3::y(), Vector3::z()],
            rotation_slopes: rotation_slopes(&pose.rotation),
            effect_slopes: Vec::new(),
            columns: [None; 6],
        }
    }

    /// Returns the base rotated by the vector `turn` \[rad\] about the measuring frame's origin.
    ///
    /// `columns` are (axis, column, factor): each parameter adds factor × its value to a coordinate
    /// of `turn`.
    pub fn rotated(
        &self,
        turn: &Vector3<f64>,
        columns: impl Iterator<Item = (usize, usize, f64)>,
    ) -> Self {
        let rotation = Frame::from_rotation_vector(Vector3::zeros(), turn);
        let (slopes, inverse) = (rotation_slopes(turn), rotation.inverse());
        let column = |(axis, column, factor): (usize, usize, f64)| {
            let slope = slopes[axis].compose(&inverse);
            (column, Frame { axes: slope.axes.map(|axis| axis * factor), origin: Vector3::zeros() })
        };
        Self {
            frame: rotation.compose(&self.frame),
            directions: self.directions.map(|axis| rotation.vector(&axis)),
            rotation_slopes: self.rotation_slopes.map(|slope| rotation.compose(&slope)),
            effect_slopes: columns.map(column).collect(),
            columns: self.columns,
        }
    }

    /// Returns the column of each parameter that rotates the base, with the derivative of a point
    /// \[m\] that moves with the base, measuring frame.
    pub fn point_slopes<'b>(
        &'b self,
        point: &Vector3<f64>,
    ) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'b {
        let (in_base, point) = (self.frame.resolve(&(point - self.frame.origin)), *point);
        let rotation_vector =
            self.rotation_columns().map(move |(column, slope)| (column, slope.vector(&in_base)));
        let effects =
            self.effect_slopes.iter().map(move |(column, slope)| (*column, slope.vector(&point)));
        rotation_vector.chain(effects)
    }

    /// Returns the column of each parameter that rotates the base, with the base's rotation vector
    /// per unit of the parameter, measuring frame. It is ω = ½ Σ eₖ × deₖ for the base's axes eₖ.
    pub fn angular_velocities(&self) -> impl Iterator<Item = (usize, Vector3<f64>)> + '_ {
        let axes = &self.frame.axes;
        let rotation_vector = self.rotation_columns().map(|(column, slope)| (column, slope.axes));
        let effects = self.effect_slopes.iter();
        let effects =
            effects.map(|(column, slope)| (*column, axes.map(|axis| slope.vector(&axis))));
        rotation_vector
            .chain(effects)
            .map(|(column, slopes)| (column, angular_velocity(axes, &slopes)))
    }

    fn rotation_columns(&self) -> impl Iterator<Item = (usize, &Frame<f64>)> {
        let columns = self.columns[3..].iter().zip(&self.rotation_slopes);
        columns.filter_map(|(column, slope)| Some(((*column)?, slope)))
    }
}

impl TargetDerivatives {
    /// Creates the target at a position \[m\] and with a rotation vector \[rad\] in the frame of a
    /// joint, with all its coordinates fixed.
    pub fn new(joint: usize, position: Vector3<f64>, rotation: &Vector3<f64>) -> Self {
        Self {
            joint,
            position,
            axes: rotation_axes(rotation),
            rotation_slopes: rotation_slopes(rotation),
            columns: [None; 6],
        }
    }

    /// Returns, for each free coordinate of the target's rotation vector, its column and the
    /// derivatives of the target's axes, joint's frame.
    pub fn axis_slopes(&self) -> impl Iterator<Item = (usize, &[Vector3<f64>; 3])> {
        let columns = self.columns[3..].iter().zip(&self.rotation_slopes);
        columns.filter_map(|(column, slope)| Some(((*column)?, &slope.axes)))
    }
}

impl ArmDerivatives {
    /// Writes the derivatives of a point \[m\], given in the frame of a joint, with respect to the
    /// arm's parameters into `rows`. Returns the frame of the joint, measuring frame, or `None` if
    /// the pose has no equilibrium.
    ///
    /// `commanded` is the pose as commanded; `setup` includes the terms that add to its commands.
    #[inline]
    pub(super) fn write(
        &mut self,
        (commanded, setup): (&PoseView, &PoseView),
        base: &BaseDerivatives,
        (joint, point): (usize, &Vector3<f64>),
        rows: &mut Rows,
    ) -> Option<Frame<f64>> {
        let (setups, point) = ((commanded, setup), (joint, point));
        match self {
            Self::Rigid(rigid) => Some(rigid.write(setups, &base.frame, point, rows)),
            Self::Elastic(elastic) => elastic.write(setups, &base.frame, point, rows),
        }
    }
}

/// Returns the rotation vector per unit of a parameter, ω = ½ Σ eₖ × deₖ, for `axes` eₖ whose
/// derivatives with respect to the parameter are the `slopes` deₖ.
pub(super) fn angular_velocity(
    axes: &[Vector3<f64>; 3],
    slopes: &[Vector3<f64>; 3],
) -> Vector3<f64> {
    axes.iter().zip(slopes).map(|(axis, slope)| axis.cross(slope) * 0.5).sum()
}

/// Returns the derivatives of the axes of the rotation exp(`[w]×`) with respect to w.
fn rotation_slopes(w: &Vector3<f64>) -> [Frame<f64>; 3] {
    let seeded_w: Vector3<DualSVec64<3>> = Vector3::from_fn(|i, _| seeded(w[i], Some(i)));
    let axes = rotation_axes(&seeded_w).map(|axis| axis.map(|coordinate| gradient(&coordinate)));
    std::array::from_fn(|k| Frame {
        axes: axes.map(|axis| axis.map(|g| g[k])),
        origin: Vector3::zeros(),
    })
}
