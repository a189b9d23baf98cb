//! What a linearised model is made of: bases, targets, and the arm between them.

use nalgebra::Vector3;
use num_dual::DualSVec64;

use super::elastic::Elastic;
use super::rigid::Rigid;
use super::rows::Rows;
use crate::problem::{BasePose, PoseView};
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, rotation_axes};

/// A base frame, how its rotation turns with its rotation vector, and the columns of its six
/// coordinates.
#[derive(Clone)]
pub(super) struct Base {
    pub frame: Frame<f64>,
    /// Where the coordinates of its translation move it, measuring frame.
    pub along: [Vector3<f64>; 3],
    /// What turns it besides, about the measuring frame's origin: columns, and what they do to a
    /// point.
    turns: Vec<(usize, Frame<f64>)>,
    turning: [Frame<f64>; 3],
    pub columns: [Option<usize>; 6],
}

/// A target, and the columns of its six coordinates.
pub(super) struct Target {
    /// Index of the joint whose frame carries it.
    pub carrier: usize,
    pub position: Vector3<f64>,
    /// Its axes in that frame, and how they turn with its rotation vector.
    pub axes: [Vector3<f64>; 3],
    turning: [Frame<f64>; 3],
    pub columns: [Option<usize>; 6],
}

/// How the arm's own parameters are differentiated.
pub(super) enum Inner {
    /// Motion by motion.
    Rigid(Rigid),
    /// Through the statics.
    Elastic(Box<Elastic>),
}

impl Base {
    /// At a pose in the measuring frame; no coordinate has a column yet.
    pub fn new(pose: &BasePose) -> Self {
        Self {
            frame: Frame::from_rotation_vector(pose.translation, &pose.rotation),
            along: [Vector3::x(), Vector3::y(), Vector3::z()],
            turns: Vec::new(),
            turning: turning(&pose.rotation),
            columns: [None; 6],
        }
    }

    /// The same turned by a rotation vector \[rad\] about the measuring frame's origin, with
    /// columns and what each is multiplied by for coordinates of that vector.
    pub fn turned_by(
        &self,
        turn: &Vector3<f64>,
        columns: impl Iterator<Item = (usize, usize, f64)>,
    ) -> Self {
        let by = Frame::from_rotation_vector(Vector3::zeros(), turn);
        let (turning, back) = (turning(turn), by.inverse());
        let column = |(axis, column, factor): (usize, usize, f64)| {
            let slope = turning[axis].compose(&back);
            (column, Frame { axes: slope.axes.map(|axis| axis * factor), origin: Vector3::zeros() })
        };
        Self {
            frame: by.compose(&self.frame),
            along: self.along.map(|axis| by.vector(&axis)),
            turns: columns.map(column).collect(),
            turning: self.turning.map(|turning| by.compose(&turning)),
            columns: self.columns,
        }
    }

    /// What the rotation of the base does to a point \[m\], measuring frame, by the columns of its
    /// coordinates.
    pub fn turned<'b>(
        &'b self,
        point: &Vector3<f64>,
    ) -> impl Iterator<Item = (usize, Vector3<f64>)> + 'b {
        let (in_arm, point) = (self.frame.resolve(&(point - self.frame.origin)), *point);
        let columns = self.columns[3..].iter().zip(&self.turning);
        let own = columns
            .filter_map(move |(column, turning)| Some(((*column)?, turning.vector(&in_arm))));
        own.chain(self.turns.iter().map(move |(column, slope)| (*column, slope.vector(&point))))
    }
}

impl Target {
    /// At a place \[m\] and with a rotation vector \[rad\] in the frame of the joint `carrier`; no
    /// coordinate has a column yet.
    pub fn new(carrier: usize, position: Vector3<f64>, rotation: &Vector3<f64>) -> Self {
        Self {
            carrier,
            position,
            axes: rotation_axes(rotation),
            turning: turning(rotation),
            columns: [None; 6],
        }
    }

    /// What its own rotation does to its axes, in that frame, by the columns of its coordinates.
    pub fn turned(&self) -> impl Iterator<Item = (usize, &[Vector3<f64>; 3])> {
        let columns = self.columns[3..].iter().zip(&self.turning);
        columns.filter_map(|(column, turning)| Some(((*column)?, &turning.axes)))
    }
}

impl Inner {
    /// Writes the derivatives of a point \[m\] in the frame of a joint with respect to the arm's
    /// own parameters; returns that frame, measuring frame, `None` where the pose has no
    /// equilibrium.
    ///
    /// `setup` is the pose as the joints take it, `commanded` as it was commanded.
    #[inline]
    pub(super) fn write(
        &mut self,
        commanded: &PoseView,
        setup: &PoseView,
        base: &Base,
        point: (usize, &Vector3<f64>),
        rows: &mut Rows,
    ) -> Option<Frame<f64>> {
        match self {
            Self::Rigid(rigid) => Some(rigid.write(commanded, setup, &base.frame, point, rows)),
            Self::Elastic(elastic) => elastic.write(commanded, setup, &base.frame, point, rows),
        }
    }
}

/// Derivatives of a rotation exp(`[w]×`) with respect to the three coordinates of w, as the
/// derivatives of its axes.
fn turning(w: &Vector3<f64>) -> [Frame<f64>; 3] {
    let seeded_w: Vector3<DualSVec64<3>> = Vector3::from_fn(|i, _| seeded(w[i], Some(i)));
    let axes = rotation_axes(&seeded_w).map(|axis| axis.map(|coordinate| gradient(&coordinate)));
    std::array::from_fn(|k| Frame {
        axes: axes.map(|axis| axis.map(|g| g[k])),
        origin: Vector3::zeros(),
    })
}
