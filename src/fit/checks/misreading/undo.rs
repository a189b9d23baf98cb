//! Correction of misreadings: table and problem as they should have been read.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::candidates::{
    MIN_MILLIMETRE_LENGTH, is_far, lengths_of, masses_of, number_of, text_order,
};
use super::commands::radians_per_metre;
use super::images::shift_views;
use super::{MassScale, Misreading, POSITION_UNITS, STANDARD_GRAVITY, power_of_ten};
use crate::measurement::Measurements;
use crate::model::parameter::JointField;
use crate::problem::{Effect, Joint, ParameterRule, Problem};

/// Length of an inch \[mm\].
const MM_PER_INCH: f64 = 25.4;

/// Ratios of a quantity in one unit to the same quantity in another unit: degrees and radians,
/// millimetres and metres.
const UNIT_RATIOS: [f64; 4] = [PI / 180.0, 180.0 / PI, 1e-3, 1e3];
/// Largest relative deviation of a fitted ratio from one of [`UNIT_RATIOS`] at which the column is
/// in another unit; gear errors are smaller.
const UNIT_RATIO_TOLERANCE: f64 = 0.05;

/// Returns true if a ratio of motion to command is that of two units, see [`UNIT_RATIOS`].
pub(super) fn is_unit_ratio(size: f64) -> bool {
    UNIT_RATIOS.iter().any(|ratio| (size / ratio - 1.0).abs() < UNIT_RATIO_TOLERANCE)
}

impl MassScale {
    /// Returns the factor by which the number must be multiplied.
    pub(super) fn factor(self) -> f64 {
        match self {
            Self::Power(power) => power_of_ten(power),
            Self::Pounds => 0.453_592_37,
            Self::Newtons => STANDARD_GRAVITY.recip(),
        }
    }
}

impl Misreading {
    /// Returns true if the misreading concerns the joint table of the problem file.
    pub(super) fn concerns_problem(self) -> bool {
        matches!(
            self,
            Self::StandardForm
                | Self::ModifiedForm
                | Self::TableRadians { .. }
                | Self::TableDegrees { .. }
                | Self::Sign { .. }
                | Self::TwistSigns { .. }
                | Self::Length { .. }
                | Self::Twist { .. }
                | Self::ExchangedRows { .. }
                | Self::ExchangedLengths { .. }
                | Self::Typed { .. }
                | Self::TableUnit { .. }
        )
    }

    /// Returns the problem with the misreading corrected; `None` if the misreading concerns the
    /// table of measurements alone, or if the correction changes nothing.
    pub(super) fn rewritten(self, declared: &Problem) -> Option<Problem> {
        let mut problem = declared.clone();
        match self {
            Self::HeldBase => {
                problem.parameters.push(ParameterRule::free("base*".to_owned(), declared));
                return Some(problem);
            }
            Self::HeldTarget => {
                let rule = |axis| ParameterRule::free(format!("tool*.{axis}"), declared);
                problem.parameters.extend(["x", "y", "z"].map(rule));
                return Some(problem);
            }
            Self::Twist { joint, degrees } => {
                problem.joints.get_mut(joint - 1)?.alpha += f64::from(degrees).to_radians();
                return Some(problem);
            }
            Self::TableUnit { unit, has_targets } => {
                let (factor, _) = POSITION_UNITS[unit];
                let lengths = problem.joints.iter_mut().flat_map(lengths_of);
                lengths.for_each(|length| *length *= factor);
                if has_targets {
                    problem.tool.target *= factor;
                    problem.targets.iter_mut().for_each(|target| target.at *= factor);
                }
                return Some(problem);
            }
            Self::Typed { joint, field, .. } => {
                *number_of(problem.joints.get_mut(joint - 1)?, field)? += self.typed_change()?;
                return Some(problem);
            }
            Self::TargetInMillimetres => {}
            Self::ArmInMillimetres => {
                let lengths = problem.joints.iter_mut().flat_map(lengths_of);
                lengths
                    .filter(|length| length.abs() > MIN_MILLIMETRE_LENGTH)
                    .for_each(|length| *length *= 1e-3);
            }
            Self::StandardForm => return declared.read_as_standard(),
            Self::ModifiedForm => return declared.read_as_modified(),
            Self::TableRadians { joint, field } => {
                scale(&mut problem, joint, field, 180.0 / PI, &|angle| {
                    angle.to_degrees().abs() <= 2.0 * PI
                })?;
                return Some(problem);
            }
            Self::TableDegrees { joint, field } => {
                scale(&mut problem, joint, field, PI / 180.0, &|angle| angle.abs() > 2.0 * PI)?;
                return Some(problem);
            }
            Self::Sign { joint, field } => {
                scale(&mut problem, joint, field, -1.0, &|_| true)?;
                return Some(problem);
            }
            Self::TwistSigns { joints } => {
                for joint in joints {
                    scale(&mut problem, joint, JointField::Alpha, -1.0, &|_| true)?;
                }
                return Some(problem);
            }
            Self::Length { joint, field, power } => {
                scale(&mut problem, joint, field, power_of_ten(power), &|_| true)?;
                return Some(problem);
            }
            Self::ExchangedRows { row } => {
                return declared.with_changed_joint_rows(|rows| {
                    let [first, second] = rows.get_mut(row - 1..=row)? else { return None };
                    exchange_joint_rows(first, second)
                });
            }
            Self::ExchangedLengths { joint, field, with, other } => {
                let value = |joint: usize, field| {
                    let found = declared.joints.get(joint - 1)?;
                    let has_row = found.placement.is_none() && found.beam.is_none();
                    number_of(&mut found.clone(), field).copied().filter(|_| has_row)
                };
                let (first, second) = (value(joint, field)?, value(with, other)?);
                if first.total_cmp(&second).is_eq() {
                    return None;
                }
                *number_of(&mut problem.joints[joint - 1], field)? = second;
                *number_of(&mut problem.joints[with - 1], other)? = first;
                return Some(problem);
            }
            Self::Payload { scale } => problem.tool.payload_mass *= scale.factor(),
            Self::Mass { .. }
            | Self::Stiffness { .. }
            | Self::Hoist { .. }
            | Self::Gravity { .. }
            | Self::Carrier { .. }
            | Self::Mounted { .. }
            | Self::ExchangedMounts { .. }
            | Self::PayloadAtTarget
            | Self::CentreSign { .. } => return self.with_other_loads(problem),
            _ => return None,
        }
        if is_far(&problem) && !matches!(self, Self::Payload { .. }) {
            problem.tool.target *= 1e-3;
        }
        Some(problem)
    }

    /// Returns the problem with the misreading of masses, stiffnesses, gravity, or of the frames of
    /// targets, cameras and markers corrected; `None` if the correction changes nothing.
    fn with_other_loads(self, mut problem: Problem) -> Option<Problem> {
        match self {
            Self::Mass { mass, scale } => {
                let masses = (1..).zip(masses_of(&mut problem));
                let chosen = masses.filter(|(number, _)| mass == 0 || *number == mass);
                chosen.for_each(|(_, value)| *value *= scale.factor());
            }
            Self::Stiffness { joint, power } => {
                let factor = if power == 0 { 180.0 / PI } else { power_of_ten(power) };
                let joints = (1..).zip(&mut problem.joints);
                let chosen = joints.filter(|(number, _)| joint == 0 || *number == joint);
                let stiffnesses = chosen.filter_map(|(_, joint)| joint.stiffness.as_mut());
                stiffnesses.for_each(|stiffness| *stiffness *= factor);
            }
            Self::Hoist { .. } => {
                let beams = problem.joints.iter_mut().filter_map(|joint| joint.beam.as_mut());
                let hoists = beams.filter_map(|beam| beam.hoist.as_mut());
                hoists.for_each(|hoist| hoist.force *= self.hoist_factor());
            }
            Self::Carrier { target, joint } => {
                if problem.targets.is_empty() {
                    problem.tool.joint = joint - 1;
                } else {
                    problem.targets.get_mut(target)?.joint = joint - 1;
                }
            }
            Self::Mounted { fixture, frame } => {
                problem.fixtures.get_mut(fixture)?.carrier = Some(frame);
            }
            Self::ExchangedMounts { fixture, with } => {
                let [first, second] =
                    [fixture, with].map(|index| problem.fixtures.get(index)?.carrier);
                problem.fixtures.get_mut(fixture)?.carrier = second;
                problem.fixtures.get_mut(with)?.carrier = first;
            }
            Self::PayloadAtTarget => {
                problem.tool.payload_follows = true;
                problem.tool.payload_at = problem.tool.target;
            }
            Self::CentreSign { mass, axis } => {
                let mut bodies = problem.joints.iter_mut().flat_map(|joint| &mut joint.bodies);
                let coordinate = &mut bodies.nth(mass.checked_sub(1)?)?.position[axis];
                if *coordinate == 0.0 {
                    return None;
                }
                *coordinate = -*coordinate;
            }
            Self::Gravity { axis, is_negative } => {
                let sign = if is_negative { -1.0 } else { 1.0 };
                problem.gravity = Vector3::ith(axis, sign * problem.gravity.norm());
            }
            _ => return None,
        }
        Some(problem)
    }

    /// Returns the problem with the size of the misreading as a free parameter without a prior;
    /// `None` if the misreading has no size.
    pub(super) fn with_free_size(self, problem: &Problem) -> Option<Problem> {
        let (pattern, _) = self.size(0.0)?;
        let mut problem =
            self.effect().map_or_else(|| problem.clone(), |effect| problem.with_effect(effect));
        let rule = ParameterRule::free(pattern, &problem);
        problem.parameters.push(rule);
        Some(problem)
    }

    /// Returns the effect whose parameter is the size of the misreading; `None` if there is none.
    fn effect(self) -> Option<Effect> {
        match self {
            Self::Ratio { joint, .. } => Some(Effect::GearRatio { joint }),
            Self::Scale { .. } => Some(Effect::TrackerScale),
            Self::Coupled { joint, from, .. } | Self::Screw { joint, from, .. } => {
                Some(Effect::JointCoupling { joint, from })
            }
            _ => None,
        }
    }

    /// Returns the effect with which the model fits the table as it was read, and the value of its
    /// parameter for a misreading of this `size`. `None` if there is no such effect, or if the size
    /// is the ratio of two units.
    pub(super) fn expressed(self, size: f64) -> Option<(Effect, f64)> {
        let effect = self.effect()?;
        match effect {
            Effect::TrackerScale => Some((effect, size - 1.0)),
            Effect::GearRatio { .. } => (!is_unit_ratio(size)).then_some((effect, size - 1.0)),
            _ => Some((effect, size)),
        }
    }

    /// Returns the name of the parameter that stands for the size of the misreading, and the size
    /// for the deviation `x` of that parameter. `None` if the misreading has no size.
    pub(super) fn size(self, x: f64) -> Option<(String, f64)> {
        match self {
            Self::Ratio { joint, percent } => {
                let name = format!("gear-ratio[{joint}].error");
                Some((name, f64::from(percent) / 100.0 * (1.0 + x)))
            }
            Self::Scale { percent } => {
                Some(("tracker-scale.error".to_owned(), f64::from(percent) / 100.0 * (1.0 + x)))
            }
            Self::Coupled { joint, from, is_opposite } => {
                let name = format!("joint-coupling[{joint},{from}].factor");
                Some((name, if is_opposite { -1.0 } else { 1.0 } + x))
            }
            Self::Screw { joint, from, lead } => {
                let name = format!("joint-coupling[{joint},{from}].factor");
                Some((name, radians_per_metre(lead) + x))
            }
            Self::Zero { joint, degrees } => {
                Some((format!("joint{joint}.theta"), f64::from(degrees).to_radians() + x))
            }
            Self::Typed { joint, field, .. } => {
                Some((format!("joint{joint}.{}", field.name()), self.typed_change()? + x))
            }
            _ => None,
        }
    }

    /// Returns the chosen rows of `table` with the misreading corrected. `problem` is the declared
    /// one, and `joints` is the number of joints of the corrected problem.
    pub(super) fn undone(
        self,
        table: &Measurements,
        chosen: &[usize],
        (problem, joints): (&Problem, usize),
    ) -> Measurements {
        let mut rows = if let Self::Shifted { by, .. } | Self::ShiftedPayload { by } = self {
            // Rows whose position or payload the table does not hold are left out.
            let from = self.shifted_from().unwrap_or(0);
            let source = |row: usize| {
                let shifted = row.checked_add_signed(by.into())?;
                // The positions of the last rows before a shift to later rows belong behind it.
                let is_taken = row < from && row.saturating_add_signed(isize::from(-by)) >= from;
                match row {
                    _ if is_taken => None,
                    row if row < from => Some(row),
                    _ => (shifted < table.len()).then_some(shifted),
                }
            };
            let pairs = chosen.iter().filter_map(|&row| Some((row, source(row)?)));
            let (chosen, sources): (Vec<usize>, Vec<usize>) = pairs.unzip();
            let mut rows = table.select(&chosen);
            if let Self::ShiftedPayload { .. } = self {
                let of_table = table.payload.as_ref();
                rows.payload = of_table.map(|of| sources.into_iter().map(|row| of[row]).collect());
            } else {
                rows.positions = sources.into_iter().map(|row| table.positions[row]).collect();
            }
            rows
        } else {
            let mut rows = table.select(chosen);
            self.undo_order(&mut rows, table, chosen);
            rows
        };
        if joints != rows.joints {
            resize(&mut rows, joints);
        }
        if let Self::ShiftedViews { by } = self {
            shift_views(&mut rows, table, (chosen, by));
        }
        for q in rows.configurations.chunks_exact_mut(joints.max(1)) {
            self.undo_command(q, problem, table);
        }
        rows.hoist.iter_mut().flatten().for_each(|force| *force *= self.hoist_factor());
        match self {
            Self::Metres => rows.positions.iter_mut().for_each(|position| *position *= 1e3),
            Self::Millimetres => rows.positions.iter_mut().for_each(|position| *position *= 1e-3),
            Self::PositionUnit { unit } => {
                let (millimetres, _) = POSITION_UNITS[unit];
                rows.positions.iter_mut().for_each(|position| *position *= millimetres);
            }
            Self::Scale { percent } => {
                rows.positions.iter_mut().for_each(|at| *at *= 100.0 / f64::from(percent));
            }
            Self::Mirrored { axes } => {
                let [first, second] = axes.unwrap_or([0, 1]);
                let sign = if first == second { -1.0 } else { 1.0 };
                for position in &mut rows.positions {
                    position.swap_rows(first, second);
                    position[first] *= sign;
                }
            }
            Self::InversePose => {
                let turns = rows.orientations.iter_mut().flatten();
                for (position, turn) in rows.positions.iter_mut().zip(turns) {
                    *turn = turn.inverse();
                    *position = -(*turn * *position);
                }
            }
            Self::ExchangedAxes
            | Self::FromBottom
            | Self::Renumbered(_)
            | Self::FromOne
            | Self::Squares => {
                self.undo_image(&mut rows, problem);
            }
            Self::ExchangedTargets { target, with } => {
                let Some(words) = &mut rows.target else { return rows };
                let place = |target: usize| {
                    let name = &problem.targets.get(target)?.name;
                    words.names.iter().position(|word| word == name)
                };
                if let (Some(first), Some(second)) = (place(target), place(with)) {
                    for word in &mut words.of_row {
                        *word = match *word {
                            word if word == first => second,
                            word if word == second => first,
                            word => word,
                        };
                    }
                }
            }
            Self::AxisUnit { axis, power } => {
                rows.positions.iter_mut().for_each(|at| at[axis] *= power_of_ten(power));
            }
            Self::AxisScale { axis, millionths } => {
                let factor = 1e6 / f64::from(millionths);
                rows.positions.iter_mut().for_each(|position| position[axis] *= factor);
            }
            Self::AxisInches { axis } => {
                rows.positions.iter_mut().for_each(|position| position[axis] *= MM_PER_INCH);
            }
            Self::Payload { scale } => {
                rows.payload.iter_mut().flatten().for_each(|payload| *payload *= scale.factor());
            }
            _ => {}
        }
        rows
    }

    /// Corrects the order of positions in `rows`, the `chosen` ones of `table`.
    fn undo_order(self, rows: &mut Measurements, table: &Measurements, chosen: &[usize]) {
        if self == Self::ReversedRows {
            let of_arm: Vec<usize> =
                (0..table.len()).filter(|&row| table.observation(row).is_of_arm()).collect();
            let opposite = |row: &usize| match of_arm.binary_search(row) {
                Ok(place) => table.positions[of_arm[of_arm.len() - 1 - place]],
                Err(_) => table.positions[*row],
            };
            rows.positions = chosen.iter().map(opposite).collect();
        }
        let Self::TextOrder { first, is_of_joints } = self else { return };
        let numbers = text_order(table.len(), first);
        let index = |number: usize| number - usize::from(first);
        let mut source: Vec<usize> = numbers.iter().copied().map(index).collect();
        if !is_of_joints {
            for (place, &number) in numbers.iter().enumerate() {
                source[index(number)] = place;
            }
        }
        rows.positions = chosen.iter().map(|&row| table.positions[source[row]]).collect();
    }
}

/// Exchanges the entries of two joints in the joint table. Returns `None`, and changes nothing, if
/// the entries are equal or a joint has a placement or a beam.
fn exchange_joint_rows(first: &mut Joint, second: &mut Joint) -> Option<()> {
    let row =
        |joint: &Joint| [joint.alpha, joint.a, joint.theta, joint.d, joint.beta].map(f64::to_bits);
    let has_row = |joint: &Joint| joint.placement.is_none() && joint.beam.is_none();
    if row(first) == row(second) || !has_row(first) || !has_row(second) {
        return None;
    }
    std::mem::swap(&mut first.alpha, &mut second.alpha);
    std::mem::swap(&mut first.a, &mut second.a);
    std::mem::swap(&mut first.theta, &mut second.theta);
    std::mem::swap(&mut first.d, &mut second.d);
    std::mem::swap(&mut first.beta, &mut second.beta);
    Some(())
}

/// Multiplies the entry `field` of the joint with number `joint` (from 1), or of all joints if it
/// is 0, by `factor`. Entries stay if they are 0 or `applies` returns false for them; `None` if all
/// stay.
fn scale(
    problem: &mut Problem,
    joint: usize,
    field: JointField,
    factor: f64,
    applies: &dyn Fn(f64) -> bool,
) -> Option<()> {
    let joints = (1..).zip(&mut problem.joints);
    let chosen = joints.filter(|(number, _)| joint == 0 || *number == joint);
    let mut count = 0;
    for value in chosen.filter_map(|(_, joint)| number_of(joint, field)) {
        if *value != 0.0 && applies(*value) {
            *value *= factor;
            count += 1;
        }
    }
    (count > 0).then_some(())
}

/// Sets the number of joints of each configuration in `rows` to `joints`; the commands of added
/// joints are 0.
fn resize(rows: &mut Measurements, joints: usize) {
    let previous = rows.joints;
    let resized = |column: &[f64]| -> Vec<f64> {
        let row = |q: &[f64]| {
            let mut q = q.to_vec();
            q.resize(joints, 0.0);
            q
        };
        column.chunks_exact(previous.max(1)).flat_map(row).collect()
    };
    let others = rows.other_configurations.iter_mut().chain(rows.approach.iter_mut());
    for column in std::iter::once(&mut rows.configurations).chain(others) {
        *column = resized(column);
    }
    rows.joints = joints;
}
