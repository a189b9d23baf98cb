//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps them small.
//!
//! A base or a target moves the position rigidly, and on a rigid arm so does every parameter of a link. On an elastic arm
//! every load moves too.

use nalgebra::{DVector, Vector3};
use num_dual::DualSVec64;

use super::Model;
use super::driven::Commands;
use super::elastic::Elastic;
use super::inputs::inputs;
use super::instrument::Instrument;
use super::pose::Pose;
use super::rigid::Rigid;
use super::rows::Rows;
use crate::least_squares::Block;
use crate::model::parameter::{Driver, Slot};
use crate::problem::PoseView;
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, rotation_axes};

/// The model linearised about one parameter vector; reused for every pose.
pub(super) struct Linearised {
    commands: Commands,
    instrument: Instrument,
    /// Columns of what the measurement does: scale, and shifts by axis and driver.
    scale: Option<usize>,
    shifts: Vec<(usize, Driver, usize)>,
    bases: Vec<Base>,
    targets: Vec<Target>,
    inner: Inner,
}

/// A base frame, how its rotation turns with its rotation vector, and the columns of its six coordinates.
pub(super) struct Base {
    pub frame: Frame<f64>,
    turning: [Frame<f64>; 3],
    columns: [Option<usize>; 6],
}

pub(super) struct Target {
    pub position: Vector3<f64>,
    columns: [Option<usize>; 3],
}

/// How the arm's own parameters are differentiated.
enum Inner {
    /// Motion by motion.
    Rigid(Rigid),
    /// Through the statics.
    Elastic(Box<Elastic>),
}

impl Linearised {
    /// About the full parameter vector `x`; `unknowns[j]` is the parameter of column j.
    pub fn new(model: &Model, x: &DVector<f64>, unknowns: &[usize]) -> Self {
        let arm = model.arm(|k| x[k]);
        let mut bases: Vec<Base> = model
            .base_poses(x.as_slice())
            .into_iter()
            .map(|pose| Base {
                frame: Frame::from_rotation_vector(pose.translation, &pose.rotation),
                turning: turning(&pose.rotation),
                columns: [None; 6],
            })
            .collect();
        let mut targets: Vec<Target> = model
            .target_positions(x.as_slice())
            .into_iter()
            .map(|position| Target { position, columns: [None; 3] })
            .collect();
        let (mut scale, mut shifts) = (None, Vec::new());
        for (column, &k) in unknowns.iter().enumerate() {
            let parameter = &model.parameters[k];
            match parameter.slot {
                Slot::Base { base, axis } => bases[base].columns[axis] = Some(column),
                Slot::Target { target, axis } => targets[target].columns[axis] = Some(column),
                Slot::Scale => scale = Some(column),
                Slot::Shift { axis } => shifts.push((axis, parameter.driver, column)),
                Slot::Joint { .. } | Slot::Beam { .. } | Slot::Arm(_) => {}
            }
        }
        let inputs = inputs(model, unknowns);
        let inner = if arm.is_elastic() {
            Inner::Elastic(Box::new(Elastic::new(model, x, arm, inputs)))
        } else {
            Inner::Rigid(Rigid::new(&arm, inputs))
        };
        let commands = model.commands(x.as_slice());
        let instrument = model.instrument_at(x.as_slice());
        Self { commands, instrument, scale, shifts, bases, targets, inner }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of zeros.
    #[inline]
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let setup = self.commands.apply(&pose.setup);
        let per_sigma = -1.0 / pose.sigma;
        let last_column = block.parameters();
        let mut rows = Rows { block, row, scale: per_sigma * (1.0 + self.instrument.scale) };
        let Some(last) = self.inner.write(&pose.setup, &setup, base, target, &mut rows) else {
            rows.put(last_column, &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = last.point(&target.position);
        for (axis, &column) in base.columns.iter().enumerate() {
            if axis < 3 {
                rows.put_if(column, || Vector3::ith(axis, 1.0));
            } else {
                let in_arm = || base.frame.resolve(&(predicted - base.frame.origin));
                rows.put_if(column, || base.turning[axis - 3].vector(&in_arm()));
            }
        }
        for (axis, &column) in target.columns.iter().enumerate() {
            rows.put_if(column, || last.axes[axis]);
        }
        rows.scale = per_sigma;
        rows.put_if(self.scale, || predicted);
        for &(axis, driver, column) in &self.shifts {
            rows.put(column, &Vector3::ith(axis, driver.value(&pose.setup)));
        }
        let seen = self.instrument.of(&predicted, &pose.setup);
        rows.put(last_column, &(seen - pose.measured));
    }
}

impl Inner {
    /// Writes the derivatives with respect to the arm's own parameters; returns the last frame of the pose, measuring
    /// frame, `None` where it has no equilibrium.
    ///
    /// `setup` is the pose as the joints take it, `commanded` as it was commanded.
    #[inline]
    fn write(
        &mut self,
        commanded: &PoseView,
        setup: &PoseView,
        base: &Base,
        target: &Target,
        rows: &mut Rows,
    ) -> Option<Frame<f64>> {
        match self {
            Self::Rigid(rigid) => Some(rigid.write(commanded, setup, &base.frame, &target.position, rows)),
            Self::Elastic(elastic) => elastic.write(commanded, setup, &base.frame, &target.position, rows),
        }
    }
}

/// Derivatives of a rotation exp(`[w]×`) with respect to the three coordinates of w, as the derivatives of its axes.
fn turning(w: &Vector3<f64>) -> [Frame<f64>; 3] {
    let seeded_w: Vector3<DualSVec64<3>> = Vector3::from_fn(|i, _| seeded(w[i], Some(i)));
    let axes = rotation_axes(&seeded_w).map(|axis| axis.map(|coordinate| gradient(&coordinate)));
    std::array::from_fn(|k| Frame { axes: axes.map(|axis| axis.map(|g| g[k])), origin: Vector3::zeros() })
}
