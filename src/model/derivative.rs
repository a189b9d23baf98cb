//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps
//! them small.
//!
//! A base or a target moves the position rigidly, and on a rigid arm so does every parameter of a
//! link. On an elastic arm every load moves too.

use nalgebra::{DVector, Vector3};

use super::Model;
use super::commands::Commands;
use super::elastic::Elastic;
use super::inputs::inputs;
use super::instrument::{Instrument, strained};
use super::observation::{FixtureValues, Slopes, between};
use super::parts::{Base, Inner, Target};
use super::pose::Pose;
use super::rigid::Rigid;
use super::rows::Rows;
use super::tilt::Tilts;
use super::turn;
use crate::least_squares::Block;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Observation;
use crate::spatial::Frame;

/// The model linearised about one parameter vector; reused for every pose.
pub(super) struct Linearised {
    commands: Commands,
    instrument: Instrument,
    /// Columns of what the measurement does: scale, and shifts by axis and regressor.
    scale: Option<usize>,
    /// Entry of the strain and column.
    strains: Vec<(usize, usize)>,
    shifts: Vec<(usize, Regressor, usize)>,
    /// The same of turns of the bases.
    turns: Vec<(usize, Regressor, usize)>,
    bases: Vec<Base>,
    targets: Vec<Target>,
    /// Fixtures, and the columns of their numbers.
    fixtures: Vec<(FixtureValues<f64>, [Option<usize>; 4])>,
    /// Tilts of frames, where some are measured.
    tilts: Option<Tilts>,
    inner: Inner,
    /// Memory for derivatives of orientations.
    probe: Block,
}

impl Linearised {
    /// About the full parameter vector `x`; `unknowns[j]` is the parameter of column j, and poses
    /// may be `oriented` or measure tilts.
    pub fn new(
        model: &Model,
        x: &DVector<f64>,
        unknowns: &[usize],
        (oriented, tilted): (bool, bool),
    ) -> Self {
        let arm = model.arm(|k| x[k]);
        let mut bases: Vec<Base> = model.base_poses(x.as_slice()).iter().map(Base::new).collect();
        let places = model
            .target_positions(x.as_slice())
            .into_iter()
            .zip(model.target_rotations(x.as_slice()));
        let target =
            |(own, (position, rotation))| Target::new(model.target_joint(own), position, &rotation);
        let mut targets: Vec<Target> = places.enumerate().map(target).collect();
        let mut fixtures: Vec<_> =
            model.fixtures(x.as_slice()).into_iter().map(|own| (own, [None; 4])).collect();
        let (mut scale, mut strains, mut shifts, mut turns) =
            (None, Vec::new(), Vec::new(), Vec::new());
        for (column, &k) in unknowns.iter().enumerate() {
            let parameter = &model.parameters[k];
            match parameter.site {
                ParameterSite::Base { base, axis } => bases[base].columns[axis] = Some(column),
                ParameterSite::Target { target, axis } => {
                    targets[target].columns[axis] = Some(column)
                }
                ParameterSite::Fixture { fixture, axis, .. } => {
                    fixtures[fixture].1[axis] = Some(column)
                }
                ParameterSite::Scale => scale = Some(column),
                ParameterSite::Strain { entry } => strains.push((entry, column)),
                ParameterSite::Shift { axis } => shifts.push((axis, parameter.regressor, column)),
                ParameterSite::Turn { axis } => turns.push((axis, parameter.regressor, column)),
                ParameterSite::Joint { .. }
                | ParameterSite::Beam { .. }
                | ParameterSite::Arm(_) => {}
            }
        }
        let inputs = inputs(model, unknowns);
        let tilts = tilted.then(|| Tilts::new(model, x, arm.clone(), inputs.clone()));
        let inner = if arm.is_elastic() {
            Inner::Elastic(Box::new(Elastic::new(model, x, arm, inputs)))
        } else {
            Inner::Rigid(Rigid::new(&arm, inputs))
        };
        let commands = model.commands(x.as_slice());
        let instrument = model.instrument_at(x.as_slice());
        let probed = match (oriented, fixtures.is_empty()) {
            (true, _) => turn::PROBE_ROWS,
            (false, false) => 3,
            (false, true) => 0,
        };
        let probe = Block::zeros(probed, unknowns.len());
        Self {
            commands,
            instrument,
            scale,
            strains,
            shifts,
            turns,
            bases,
            targets,
            fixtures,
            tilts,
            inner,
            probe,
        }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of
    /// zeros, six where its orientation counts.
    #[inline]
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        if pose.observation.is_position() {
            self.write_position(pose, block, row);
        } else {
            self.write_contact(pose, block, row);
        }
    }

    /// Writes the whitened residual of what is measured against a fixture, and its derivatives,
    /// into three rows.
    fn write_contact(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let per_sigma = -1.0 / pose.sigma;
        let last_column = block.parameters();
        let mut put = |column: usize, of: Vector3<f64>| {
            block.column_mut(column)[row..row + 3].copy_from_slice((of * per_sigma).as_slice());
        };
        if let Observation::Between(first, second) = pose.observation {
            let ((one, own), (other, others)) =
                (&self.fixtures[first as usize], &self.fixtures[second as usize]);
            let Slopes { seen, by_target, by_fixture } = between(one, other);
            let by_first = own.iter().zip(by_fixture.column_iter());
            let by_second = others.iter().zip(by_target.column_iter());
            for (&column, by) in by_first.chain(by_second) {
                if let Some(column) = column {
                    put(column, by.into_owned());
                }
            }
            put(last_column, seen - pose.measured);
            return;
        }
        if let (Observation::Tilt(frame), Some(tilts)) = (pose.observation, &mut self.tilts) {
            let setup = self.commands.apply(&pose.setup);
            let mut rows = Rows { block, row, scale: per_sigma };
            let seen = tilts.write(&pose.setup, &setup, frame, &mut rows);
            let lost = Vector3::from_element(f64::NAN);
            rows.put(last_column, &seen.map_or(lost, |seen| seen - pose.measured));
            return;
        }
        let mut put = |column: usize, of: Vector3<f64>| {
            block.column_mut(column)[row..row + 3].copy_from_slice((of * per_sigma).as_slice());
        };
        let Some((fixture, columns)) =
            pose.observation.fixture().map(|fixture| self.fixtures[fixture])
        else {
            return;
        };
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let turned = self.turned(base, pose);
        let base = turned.as_ref().unwrap_or(base);
        let setup = self.commands.apply(&pose.setup);
        let probe = &mut self.probe;
        // What the last pose left there may be of another base.
        for column in 0..probe.parameters() {
            probe.column_mut(column).fill(0.0);
        }
        let mut moves = Rows { block: probe, row: 0, scale: 1.0 };
        let Some(last) = self.inner.write(
            &pose.setup,
            &setup,
            base,
            (target.carrier, &target.position),
            &mut moves,
        ) else {
            put(last_column, Vector3::from_element(f64::NAN));
            return;
        };
        let position = placed(&last, base, target, &mut moves);
        let Slopes { seen, by_target, by_fixture } = fixture.slopes(&position);
        // What is missing to be at a point is told along the axes of the arm's base, which turn
        // with it.
        let in_base = |of: Vector3<f64>| {
            if pose.observation.is_point() { base.frame.resolve(&of) } else { of }
        };
        if pose.observation.is_point() {
            let origin = base.frame.origin;
            for ((column, turned), (_, carried)) in
                base.turned(&(origin + seen)).zip(base.turned(&origin))
            {
                let with_axes = turned - carried;
                probe
                    .column_mut(column)
                    .iter_mut()
                    .zip(&with_axes)
                    .for_each(|(own, with)| *own -= with);
            }
        }
        for column in 0..probe.parameters() {
            let own = probe.column(column);
            put(column, in_base(by_target * Vector3::new(own[0], own[1], own[2])));
        }
        for (&column, by) in columns.iter().zip(by_fixture.column_iter()) {
            if let Some(column) = column {
                put(column, in_base(by.into_owned()));
            }
        }
        put(last_column, in_base(seen) - pose.measured);
    }

    /// The base as it has turned in a pose; `None` where none does.
    fn turned(&self, base: &Base, pose: &Pose) -> Option<Base> {
        self.instrument.turns().then(|| {
            let columns = self
                .turns
                .iter()
                .map(|&(axis, regressor, column)| (axis, column, regressor.value(&pose.setup)));
            base.turned_by(&self.instrument.turn(&pose.setup), columns)
        })
    }

    #[inline]
    fn write_position(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let turned = self.turned(base, pose);
        let base = turned.as_ref().unwrap_or(base);
        let setup = self.commands.apply(&pose.setup);
        let per_sigma = -1.0 / pose.sigma;
        let last_column = block.parameters();
        let mut rows = Rows { block, row, scale: per_sigma * (1.0 + self.instrument.scale) };
        let Some(last) = self.inner.write(
            &pose.setup,
            &setup,
            base,
            (target.carrier, &target.position),
            &mut rows,
        ) else {
            rows.put(last_column, &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = placed(&last, base, target, &mut rows);
        if let Some(strain) = self.instrument.strains() {
            rows.turn(&strain);
        }
        rows.scale = per_sigma;
        rows.put_if(self.scale, || predicted);
        for &(entry, column) in &self.strains {
            rows.put(column, &(strained(entry) * predicted));
        }
        for &(axis, regressor, column) in &self.shifts {
            rows.put(column, &Vector3::ith(axis, regressor.value(&pose.setup)));
        }
        let seen = self.instrument.of(&predicted, &pose.setup);
        rows.put(last_column, &(seen - pose.measured));
        if let Some(orientation) = &pose.orientation {
            let about = turn::About { setup: (&pose.setup, &setup), base, target, last: &last };
            turn::write(&mut self.inner, &mut self.probe, &about, orientation, (block, row + 3));
        }
    }
}

/// The target's position \[m\], measuring frame, from the frame `last` that carries it there;
/// writes what base and target do to it.
#[inline]
fn placed(last: &Frame<f64>, base: &Base, target: &Target, rows: &mut Rows) -> Vector3<f64> {
    let position = last.point(&target.position);
    for (axis, &column) in base.columns.iter().take(3).enumerate() {
        rows.put_if(column, || base.along[axis]);
    }
    for (column, derivative) in base.turned(&position) {
        rows.put(column, &derivative);
    }
    for (axis, &column) in target.columns.iter().take(3).enumerate() {
        rows.put_if(column, || last.axes[axis]);
    }
    position
}
