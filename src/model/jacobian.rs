//! Residuals of rows with their derivatives, in dual numbers where few variables suffice.
//!
//! A base or a target moves the position rigidly, and on a rigid arm so does every parameter of a
//! link. On an elastic arm a parameter also changes the moments of the loads.

use nalgebra::{Matrix3, Vector3};

use super::Model;
use super::command_terms::CommandTerms;
use super::derivatives::{ArmDerivatives, BaseDerivatives, TargetDerivatives, angular_velocity};
use super::elastic::ElasticDerivatives;
use super::instrument::Instrument;
use super::load_moments::JacobianColumn;
use super::pose::{MeasuredOrientation, Pose};
use super::rigid::RigidDerivatives;
use super::rows::{Rows, clear_block, inputs};
use super::tilt::TiltDerivatives;
use crate::least_squares::Block;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::observation::{FixtureValues, Needs, Scene, Slopes};
use crate::problem::PoseView;
use crate::spatial::{Frame, inverse_right_jacobian, rotation_between};

/// Writer of residuals and Jacobian rows at one parameter vector, used for every row.
pub(super) struct JacobianWriter<'m> {
    model: &'m Model,
    commands: CommandTerms,
    instrument: Instrument,
    /// Site, regressor and Jacobian column of each unknown error of the instrument.
    instrument_columns: Vec<(ParameterSite, Regressor, usize)>,
    /// Axis, regressor and Jacobian column of each unknown that rotates every base.
    base_rotations: Vec<(usize, Regressor, usize)>,
    bases: Vec<BaseDerivatives>,
    targets: Vec<TargetDerivatives>,
    fixtures: Vec<FixtureValues<f64>>,
    /// Index of the number, regressor and Jacobian column of each unknown that acts on a number of
    /// a fixture, for each fixture.
    fixture_columns: Vec<Vec<(usize, Regressor, usize)>>,
    /// Derivatives of tilts; `None` if the rows measure no tilt.
    tilts: Option<TiltDerivatives>,
    arm: ArmDerivatives,
    /// Memory for derivatives of points on the arm, reused from row to row.
    points: Block,
}

impl<'m> JacobianWriter<'m> {
    /// Creates a writer of these `columns` at the full parameter vector `x`. `oriented` must be
    /// true if a row has an orientation, `tilted` if a row measures tilts.
    pub fn new(
        model: &'m Model,
        x: &[f64],
        columns: &[JacobianColumn],
        (oriented, tilted): (bool, bool),
    ) -> Self {
        let arm = model.arm(|k| x[k]);
        let mut bases: Vec<BaseDerivatives> =
            model.base_poses(x).iter().map(BaseDerivatives::new).collect();
        let placements = model.target_positions(x).into_iter().zip(model.target_rotations(x));
        let target = |(index, (position, rotation))| {
            TargetDerivatives::new(model.target_joint(index), position, &rotation)
        };
        let mut targets: Vec<TargetDerivatives> = placements.enumerate().map(target).collect();
        let fixtures = model.fixtures(x);
        let mut fixture_columns = vec![Vec::new(); fixtures.len()];
        let (mut instrument_columns, mut base_rotations) = (Vec::new(), Vec::new());
        for (column, of_column) in columns.iter().enumerate() {
            let (site, regressor) = (of_column.site, || of_column.regressor.clone());
            match site {
                ParameterSite::Base { base, axis } => bases[base].columns[axis] = Some(column),
                ParameterSite::Target { target, axis } => {
                    targets[target].columns[axis] = Some(column);
                }
                ParameterSite::Fixture { fixture, axis, .. } => {
                    fixture_columns[fixture].push((axis, regressor(), column));
                }
                ParameterSite::FixtureShift { fixture, axis, count, .. } => {
                    let of_number = |axis| (axis, regressor(), column);
                    fixture_columns[fixture].extend((axis..axis + count).map(of_number));
                }
                ParameterSite::Turn { axis } => base_rotations.push((axis, regressor(), column)),
                ParameterSite::Scale
                | ParameterSite::Strain { .. }
                | ParameterSite::Shift { .. } => {
                    instrument_columns.push((site, regressor(), column));
                }
                ParameterSite::Joint { .. }
                | ParameterSite::Beam { .. }
                | ParameterSite::Exposure { .. }
                | ParameterSite::ArmStrain
                | ParameterSite::Arm(_) => {}
            }
        }
        let inputs = inputs(model, columns);
        let tilts = tilted.then(|| TiltDerivatives::new(model, x, arm.clone(), inputs.clone()));
        let arm = if arm.is_elastic() {
            ArmDerivatives::Elastic(Box::new(ElasticDerivatives::new(model, x, arm, inputs)))
        } else {
            ArmDerivatives::Rigid(RigidDerivatives::new(&arm, inputs))
        };
        let point_rows = match (oriented, fixtures.is_empty()) {
            (true, _) => ROWS_OF_FOUR_POINTS,
            (false, false) => 3,
            (false, true) => 0,
        };
        Self {
            model,
            commands: model.commands(x),
            instrument: model.instrument_at(x),
            instrument_columns,
            base_rotations,
            bases,
            targets,
            fixtures,
            fixture_columns,
            tilts,
            arm,
            points: Block::zeros(point_rows, columns.len()),
        }
    }

    /// Writes the whitened residual of a row and its derivatives into a block of zeros, from row
    /// `row` on: three rows, or six if the pose has an orientation.
    #[inline]
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        if pose.observation.is_position() {
            self.write_position(pose, block, row);
        } else {
            self.write_other(pose, block, row);
        }
    }

    /// Writes the whitened residual and derivatives of a row that measures anything but a position,
    /// by the chain rule through target, base and fixtures.
    fn write_other(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (observation, last_column) = (pose.observation, block.parameters());
        let mut rows = Rows { block, row, scale: -1.0 / pose.sigma };
        let no_equilibrium = Vector3::from_element(f64::NAN);
        let fixtures = self.instrument.fixtures(pose, &self.fixtures);
        let mut scene = Scene { fixtures, ..Scene::default() };
        let mut slopes = None;
        match observation.description().needs {
            Needs::Fixtures => {}
            Needs::Frame => {
                let Some(tilts) = &mut self.tilts else { return };
                let setup = self.commands.apply(&pose.setup);
                let tilts = tilts.write((&pose.setup, &setup), observation, &mut rows);
                rows.put(last_column, &tilts.map_or(no_equilibrium, |tilts| tilts - pose.measured));
                return;
            }
            Needs::Carriers => match self.write_carriers(pose, &mut scene, &mut rows) {
                Some(by) => slopes = Some(by),
                None => return rows.put(last_column, &no_equilibrium),
            },
            Needs::Target => {
                let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
                let rotated = self.rotated(base, pose);
                let base = rotated.as_ref().unwrap_or(base);
                let setup = self.commands.apply(&pose.setup);
                let points = &mut self.points;
                clear_block(points);
                let mut moves = Rows { block: points, row: 0, scale: 1.0 };
                let point = (target.joint, &target.position);
                let Some(frame) = self.arm.write((&pose.setup, &setup), base, point, &mut moves)
                else {
                    rows.put(last_column, &no_equilibrium);
                    return;
                };
                scene.target = write_placement(&frame, base, target, &mut moves);
                scene.base = base.frame.axes;
                let by = slopes.insert(observation.slopes(&scene));
                for column in 0..points.parameters() {
                    let moved = points.column(column);
                    let moved = Vector3::new(moved[0], moved[1], moved[2]);
                    rows.put(column, &(by.by_target * moved));
                }
                if by.by_base != Matrix3::zeros() {
                    for (column, velocity) in base.angular_velocities() {
                        rows.add(column, &(by.by_base * velocity));
                    }
                }
            }
        }
        let slopes = slopes.unwrap_or_else(|| observation.slopes(&scene));
        for (fixture, by) in observation.fixtures().into_iter().flatten().zip(&slopes.by_fixtures) {
            for (axis, regressor, column) in &self.fixture_columns[fixture] {
                rows.add(*column, &(by.column(*axis) * regressor.value(&pose.setup)));
            }
        }
        rows.put(last_column, &(slopes.value - pose.measured));
    }

    /// Writes the derivatives of a row with respect to the arm and the base, which move the frames
    /// that carry its fixtures. Returns the derivatives of its prediction with respect to the
    /// fixtures' numbers; `None` without equilibrium.
    ///
    /// Only the motion of the second fixture's point relative to the frame of the first fixture
    /// counts. It is the point's motion with its carrier, less its motion if it were fixed to the
    /// first carrier.
    fn write_carriers(
        &mut self,
        pose: &Pose,
        scene: &mut Scene<f64>,
        rows: &mut Rows,
    ) -> Option<Slopes> {
        let base = &self.bases[pose.base];
        let rotated = self.rotated(base, pose);
        let base = rotated.as_ref().unwrap_or(base);
        let setup = self.commands.apply(&pose.setup);
        let carriers = self.model.carriers(pose.observation);
        scene.point = self.model.fixture_point(pose.observation);
        let points = &mut self.points;
        let mut write = |joint: Option<usize>, point: &Vector3<f64>, points: &mut Block| {
            clear_block(points);
            let mut moves = Rows { block: points, row: 0, scale: 1.0 };
            let Some(joint) = joint else { return Some(base.frame) };
            self.arm.write((&pose.setup, &setup), base, (joint, point), &mut moves)
        };
        for (frame, carrier) in scene.carriers.iter_mut().zip(carriers) {
            if let Some(carrier) = carrier {
                *frame = write(carrier.checked_sub(1), &Vector3::zeros(), points)?;
            }
        }
        let by = pose.observation.slopes(scene);
        let position = scene.carriers[1].point(&scene.fixtures[1].frame().point(&scene.point));
        for ((frame, carrier), sign) in scene.carriers.iter().zip(carriers).zip([-1.0, 1.0]) {
            let Some(carrier) = carrier else { continue };
            let point = frame.resolve(&(position - frame.origin));
            write(carrier.checked_sub(1), &point, points)?;
            let mut moves = Rows { block: points, row: 0, scale: 1.0 };
            for (axis, &column) in base.columns.iter().take(3).enumerate() {
                moves.put_if(column, || base.directions[axis]);
            }
            for (column, slope) in base.point_slopes(&position) {
                moves.put(column, &slope);
            }
            for column in 0..points.parameters() {
                let moved = points.column(column);
                let moved = Vector3::new(moved[0], moved[1], moved[2]);
                rows.add(column, &(by.by_target * moved * sign));
            }
        }
        Some(by)
    }

    /// Returns the base as effects rotate it in a pose; `None` if no effect rotates bases.
    fn rotated(&self, base: &BaseDerivatives, pose: &Pose) -> Option<BaseDerivatives> {
        self.instrument.rotates_bases().then(|| {
            let columns = self
                .base_rotations
                .iter()
                .map(|(axis, regressor, column)| (*axis, *column, regressor.value(&pose.setup)));
            base.rotated(&self.instrument.base_rotation(&pose.setup), columns)
        })
    }

    #[inline]
    fn write_position(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let rotated = self.rotated(base, pose);
        let base = rotated.as_ref().unwrap_or(base);
        let setup = self.commands.apply(&pose.setup);
        let per_sigma = -1.0 / pose.sigma;
        let last_column = block.parameters();
        let mut rows = Rows { block, row, scale: per_sigma * (1.0 + self.instrument.scale) };
        let (setups, point) = ((&pose.setup, &setup), (target.joint, &target.position));
        let Some(frame) = self.arm.write(setups, base, point, &mut rows) else {
            rows.put(last_column, &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = write_placement(&frame, base, target, &mut rows);
        if let Some(strain) = self.instrument.reading_factor(&predicted, &pose.setup) {
            rows.multiply(&strain);
        }
        rows.scale = per_sigma;
        for (site, regressor, column) in &self.instrument_columns {
            let slope = Instrument::slope(*site, &predicted, regressor, &pose.setup);
            rows.put(*column, &slope);
        }
        let reading = self.instrument.reading(&predicted, &pose.setup);
        rows.put(last_column, &(reading - pose.measured));
        if let Some(measured) = &pose.orientation {
            let place = OrientedPose { setups, base, target, frame: &frame };
            write_orientation(&mut self.arm, &mut self.points, &place, measured, (block, row + 3));
        }
    }
}

/// Writes the derivatives of the target's position with respect to base and target. Returns that
/// position, measuring frame \[m\]. `frame` carries the target, measuring frame.
#[inline]
fn write_placement(
    frame: &Frame<f64>,
    base: &BaseDerivatives,
    target: &TargetDerivatives,
    rows: &mut Rows,
) -> Vector3<f64> {
    let position = frame.point(&target.position);
    for (axis, &column) in base.columns.iter().take(3).enumerate() {
        rows.put_if(column, || base.directions[axis]);
    }
    for (column, slope) in base.point_slopes(&position) {
        rows.put(column, &slope);
    }
    // The payload may hang at the target, whose coordinates then change the loads as well.
    for (axis, column) in target.columns.iter().take(3).enumerate() {
        if let Some(column) = *column {
            rows.add(column, &frame.axes[axis]);
        }
    }
    position
}

/// Number of rows for the derivatives of four points: the target and the ends of its three axes, 1
/// m long.
const ROWS_OF_FOUR_POINTS: usize = 12;

/// Pose, base and target at which an orientation is differentiated.
struct OrientedPose<'a> {
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
fn write_orientation(
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
