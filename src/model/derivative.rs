//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps them small.
//!
//! A base or a target moves the position rigidly, and on a rigid arm so does every parameter of a link. On an elastic arm
//! every load moves too.

use nalgebra::{DVector, Vector3};

use super::Model;
use super::driven::Commands;
use super::elastic::Elastic;
use super::inputs::inputs;
use super::instrument::Instrument;
use super::parts::{Base, Inner, Target};
use super::pose::Pose;
use super::rigid::Rigid;
use super::rows::Rows;
use super::turn;
use crate::least_squares::Block;
use crate::model::parameter::{Driver, Slot};

/// The model linearised about one parameter vector; reused for every pose.
pub(super) struct Linearised {
    commands: Commands,
    instrument: Instrument,
    /// Columns of what the measurement does: scale, and shifts by axis and driver.
    scale: Option<usize>,
    shifts: Vec<(usize, Driver, usize)>,
    /// The same of turns of the bases.
    turns: Vec<(usize, Driver, usize)>,
    bases: Vec<Base>,
    targets: Vec<Target>,
    inner: Inner,
    /// Memory for derivatives of orientations.
    probe: Block,
}

impl Linearised {
    /// About the full parameter vector `x`; `unknowns[j]` is the parameter of column j, and poses may be `oriented`.
    pub fn new(model: &Model, x: &DVector<f64>, unknowns: &[usize], oriented: bool) -> Self {
        let arm = model.arm(|k| x[k]);
        let mut bases: Vec<Base> = model.base_poses(x.as_slice()).iter().map(Base::new).collect();
        let places = model.target_positions(x.as_slice()).into_iter().zip(model.target_rotations(x.as_slice()));
        let mut targets: Vec<Target> = places.map(|(position, rotation)| Target::new(position, &rotation)).collect();
        let (mut scale, mut shifts, mut turns) = (None, Vec::new(), Vec::new());
        for (column, &k) in unknowns.iter().enumerate() {
            let parameter = &model.parameters[k];
            match parameter.slot {
                Slot::Base { base, axis } => bases[base].columns[axis] = Some(column),
                Slot::Target { target, axis } => targets[target].columns[axis] = Some(column),
                Slot::Scale => scale = Some(column),
                Slot::Shift { axis } => shifts.push((axis, parameter.driver, column)),
                Slot::Turn { axis } => turns.push((axis, parameter.driver, column)),
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
        let probe = Block::zeros(if oriented { turn::PROBE_ROWS } else { 0 }, unknowns.len());
        Self { commands, instrument, scale, shifts, turns, bases, targets, inner, probe }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of zeros, six where its orientation
    /// counts.
    #[inline]
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let turned = self.instrument.turns().then(|| {
            let columns = self.turns.iter().map(|&(axis, driver, column)| (axis, column, driver.value(&pose.setup)));
            base.turned_by(&self.instrument.turn(&pose.setup), columns)
        });
        let base = turned.as_ref().unwrap_or(base);
        let setup = self.commands.apply(&pose.setup);
        let per_sigma = -1.0 / pose.sigma;
        let last_column = block.parameters();
        let mut rows = Rows { block, row, scale: per_sigma * (1.0 + self.instrument.scale) };
        let Some(last) = self.inner.write(&pose.setup, &setup, base, &target.position, &mut rows) else {
            rows.put(last_column, &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = last.point(&target.position);
        for (axis, &column) in base.columns.iter().take(3).enumerate() {
            rows.put_if(column, || base.along[axis]);
        }
        for (column, derivative) in base.turned(&predicted) {
            rows.put(column, &derivative);
        }
        for (axis, &column) in target.columns.iter().take(3).enumerate() {
            rows.put_if(column, || last.axes[axis]);
        }
        rows.scale = per_sigma;
        rows.put_if(self.scale, || predicted);
        for &(axis, driver, column) in &self.shifts {
            rows.put(column, &Vector3::ith(axis, driver.value(&pose.setup)));
        }
        let seen = self.instrument.of(&predicted, &pose.setup);
        rows.put(last_column, &(seen - pose.measured));
        if let Some(orientation) = &pose.orientation {
            let about = turn::About { setup: (&pose.setup, &setup), base, target, last: &last };
            turn::write(&mut self.inner, &mut self.probe, &about, orientation, (block, row + 3));
        }
    }
}
