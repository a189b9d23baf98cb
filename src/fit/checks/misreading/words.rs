//! Texts that describe misreadings.

use std::f64::consts::PI;
use std::fmt;

use super::candidates::name_of_mass;
use super::commands::MILLIRADIANS;
use super::images::name_of_fixture;
use super::two_entries::entry_name;
use super::{MassScale, Misreading, POSITION_UNITS, numbers_of, power_of_ten};
use crate::fit::checks::row_kind::AXES;
use crate::fit::stages::single_views::Numbering;
use crate::measurement::Measurements;
use crate::model::parameter::JointField;
use crate::problem::fixture::carrier_word;
use crate::problem::{Fixture, JointKind, Problem};

impl Misreading {
    /// Describes the misreading with its fitted `size` (an angle \[rad\], a ratio, or rad/m), if it
    /// has one. If an entry of the joint table is misread, its place in the file is added.
    pub(super) fn described(self, size: Option<f64>, problem: &Problem) -> String {
        if let Some(place) = self.place(problem).or_else(|| self.places_of_two(problem)) {
            let words = self.lengths_of_rows(problem).or_else(|| self.typed_words(size, problem));
            let words = words.unwrap_or_else(|| self.to_string());
            return format!("{words} ({place})");
        }
        match (self, size) {
            (Self::Zero { joint, .. }, Some(size)) => {
                format!("joint {joint} whose zero position is {:.2}° off", size.to_degrees())
            }
            (Self::Ratio { joint, .. }, Some(size)) => {
                let kind = problem.joints.get(joint - 1).map(|joint| joint.kind);
                let moves = if kind == Some(JointKind::Prismatic) { "moves" } else { "turns" };
                let unit = unit_of_ratio(size, kind);
                format!("joint {joint} that {moves} by {size:.4} times its command{unit}")
            }
            (Self::Scale { .. }, Some(size)) => format!("{self}: {size:.4} times as large"),
            (Self::Screw { joint, from, .. }, Some(size)) => format!(
                "joint {joint} that also turns by {:.3}°/mm of joint {from} (as a ball screw \
                 does; declare joint-coupling)",
                size.to_degrees() * 1e-3
            ),
            (Self::Coupled { joint, from, .. }, Some(size)) => format!(
                "joint {joint} that also turns by {size:.3} times the command of joint {from} \
                 (declare joint-coupling)"
            ),
            (Self::Carrier { target, joint }, _) => match problem.targets.get(target) {
                Some(named) => format!(
                    "the target \"{}\" on the frame of joint {joint} (joint = {joint})",
                    named.name
                ),
                None => self.to_string(),
            },
            (Self::ExchangedTargets { target, with }, _) => {
                let name = |target: usize| {
                    problem.targets.get(target).map_or("", |target| target.name.as_str())
                };
                format!(
                    "the words \"{}\" and \"{}\" exchanged in the column target",
                    name(target),
                    name(with)
                )
            }
            (Self::Mounted { fixture, frame }, _) => {
                let name = name_of_fixture(problem, fixture);
                let mounted = problem.fixtures.get(fixture).cloned();
                let mounted = mounted.map(|of| Fixture { carrier: Some(frame), ..of });
                let word = mounted.map_or_else(String::new, |of| carrier_word(problem, &of));
                format!("{name} on the frame of joint {frame} (on = \"{word}\")")
            }
            (Self::ExchangedMounts { fixture, with }, _) => {
                let [camera, marker] = [fixture, with].map(|index| name_of_fixture(problem, index));
                format!("{camera} and {marker} with exchanged frames (on = …)")
            }
            (Self::CentreSign { mass, axis }, _) => {
                let mut bodies = problem.joints.iter().flat_map(|joint| &joint.bodies);
                let name = bodies.nth(mass - 1).map_or("", |body| body.name.as_str());
                let axis = AXES[axis];
                format!("{axis} of the centre of mass of {name} that has the other sign")
            }
            (Self::Mass { mass, scale }, _) => match name_of_mass(problem, mass) {
                Some((name, joint)) => {
                    format!("the mass of {name} at joint {joint} that is {scale}")
                }
                None => self.to_string(),
            },
            _ => self.to_string(),
        }
    }

    /// Returns a clause that names the offset of the clocks with which positions belong to the
    /// configurations of their rows; empty unless tables are joined by time.
    pub(super) fn clock_hint(self, table: &Measurements) -> String {
        let Self::Shifted { by, from: 0 } = self else { return String::new() };
        let offset = table.clock_offsets.iter().find(|(rows, _)| *rows == by);
        offset.map_or_else(String::new, |(_, seconds)| {
            let seconds = (seconds * 1e3).round() / 1e3;
            format!(
                " (joined by time: the clocks may differ; with offset_s = {seconds} in joints they \
                 belong to that of their own row)"
            )
        })
    }

    /// Describes exchanged lengths by the rows of the declared joint table; `None` for other
    /// misreadings. In a table in standard DH form, a of a joint is in the row before.
    fn lengths_of_rows(self, problem: &Problem) -> Option<String> {
        let Self::ExchangedLengths { joint, field, with, other } = self else { return None };
        let is_standard = problem.standard_rows().is_some();
        let row = |joint: usize, field| joint - usize::from(is_standard && field == JointField::A);
        let (first, second) = (row(joint, field), row(with, other));
        let [field, other] = [field, other].map(JointField::name);
        Some(if first == second {
            format!("a and d of row {first} of the joint table that are exchanged")
        } else {
            format!(
                "{field} of row {first} and {other} of row {second} of the joint table \
                 that are exchanged"
            )
        })
    }

    /// Returns the place in the file of the entry or row of the joint table that is misread; `None`
    /// for other misreadings. In a table in standard DH form, a and α of a joint are in the row
    /// before.
    fn place(self, problem: &Problem) -> Option<String> {
        use JointField::{A, Alpha};
        let is_standard = problem.standard_rows().is_some();
        let row = match self {
            Self::Sign { joint, field }
            | Self::Length { joint, field, .. }
            | Self::TableRadians { joint, field }
            | Self::TableDegrees { joint, field }
            | Self::Typed { joint, field, .. } => {
                joint.checked_sub(usize::from(is_standard && matches!(field, A | Alpha)))?
            }
            Self::Twist { joint, .. } => joint.checked_sub(usize::from(is_standard))?,
            Self::ExchangedLengths { joint, field, .. } => {
                joint.checked_sub(usize::from(is_standard && field == A)).filter(|row| *row > 0)?
            }
            Self::ExchangedRows { row } => row,
            _ => return None,
        };
        let location = &problem.joints.get(row.checked_sub(1)?)?.location;
        let place = location.of_line();
        Some(if is_standard {
            format!("row {row} of the table, {place}")
        } else {
            place.to_string()
        })
    }
}

/// Largest relative deviation of a ratio of motion to command from that of two units, at which the
/// text names the units.
const UNIT_TOLERANCE: f64 = 0.02;

/// Returns the text about the unit of a joint's column that follows from a ratio of motion to
/// command. Empty if the ratio is not that of two units.
fn unit_of_ratio(ratio: f64, kind: Option<JointKind>) -> &'static str {
    let is = |other: f64| (ratio / other - 1.0).abs() < UNIT_TOLERANCE;
    let is_prismatic = kind == Some(JointKind::Prismatic);
    if is_prismatic && is(1e-3) {
        " (its column is in millimetres, declared in metres)"
    } else if is_prismatic && is(1e3) {
        " (its column is in metres, declared in millimetres)"
    } else if !is_prismatic && is(180.0 / PI) {
        " (its column is in radians, declared in degrees)"
    } else if !is_prismatic && is(PI / 180.0) {
        " (its column is in degrees, declared in radians)"
    } else {
        ""
    }
}

/// Lists the numbers of a set of joints: "1, 2 and 4".
fn listed_joints(joints: u64) -> String {
    let numbers: Vec<String> = numbers_of(joints).map(|joint| joint.to_string()).collect();
    match numbers.as_slice() {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => numbers.concat(),
    }
}

impl fmt::Display for MassScale {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Weights in newtons are nearly ten times as large as masses in kilograms.
            Self::Power(-1) => f.write_str(
                "to be multiplied by 0.1, or divided by 9.81 if weights in newtons were written",
            ),
            Self::Power(power) => write!(f, "to be multiplied by {}", power_of_ten(*power)),
            Self::Pounds => f.write_str("in pounds, declared as kilograms"),
            Self::Newtons => f.write_str("a weight in newtons, declared as kilograms"),
        }
    }
}

impl fmt::Display for Misreading {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Degrees => f.write_str("joint angles that are degrees, declared as radians"),
            Self::Radians => f.write_str("joint angles that are radians, declared as degrees"),
            Self::TurnUnit { per_turn } => {
                f.write_str("joint angles that are ")?;
                match per_turn {
                    1 => f.write_str("turns"),
                    6 => f.write_str("divided by 60"),
                    400 => f.write_str("gradians"),
                    MILLIRADIANS => f.write_str("milliradians"),
                    21_600 => f.write_str("minutes of arc"),
                    1_296_000 => f.write_str("seconds of arc"),
                    3600 => f.write_str("tenths of a degree"),
                    36_000 => f.write_str("hundredths of a degree"),
                    _ => write!(f, "counts of {per_turn} to a turn"),
                }?;
                f.write_str(", declared as degrees")
            }
            Self::Scale { .. } => f.write_str(
                "positions on another scale than the joint table (scale factor of the instrument, \
                 or a joint table of another size of this arm)",
            ),
            Self::OppositeOrder => f.write_str("columns of all joints in the opposite order"),
            Self::Alphabetical => f.write_str(
                "columns of all joints in the alphabetical order of the joints' names (as in ROS \
                 joint_states; name the columns after the joints)",
            ),
            Self::TextOrder { is_of_joints, .. } => {
                let what = if is_of_joints { "joint angles" } else { "positions" };
                write!(
                    f,
                    "{what} whose rows are sorted by the text of their numbers (1, 10, 11, …, 2; \
                     join the tables by name or number, not by order)"
                )
            }
            Self::InversePose => f.write_str(
                "poses that are inverse (of the measuring frame in the frame of the target; invert \
                 each 4 × 4 matrix)",
            ),
            Self::Metres => f.write_str("positions that are metres, declared as millimetres"),
            Self::Millimetres => f.write_str("positions that are millimetres, declared as metres"),
            Self::PositionUnit { unit } => {
                write!(f, "positions that are {}, declared as millimetres", POSITION_UNITS[unit].1)
            }
            Self::Mirrored { axes: None } => {
                f.write_str("two of x, y and z that are exchanged, or one of the other sign")
            }
            Self::Mirrored { axes: Some([first, second]) } => {
                let [one, other] = [first, second].map(|axis| AXES[axis]);
                if first == second {
                    write!(f, "{one} of the positions that has the other sign")
                } else {
                    write!(f, "{one} and {other} of the positions that are exchanged")
                }
            }
            Self::Reversed { joints } => {
                let numbers = listed_joints(joints);
                if joints.count_ones() > 1 {
                    write!(f, "joints {numbers} that count the other way")
                } else {
                    write!(f, "joint {numbers} that counts the other way")
                }
            }
            Self::AxisUnit { axis, power } => {
                let (found, declared) = match power {
                    3 => ("metres", "millimetres"),
                    1 => ("centimetres", "millimetres"),
                    -2 => ("centimetres", "metres"),
                    _ => ("millimetres", "metres"),
                };
                let name = AXES[axis];
                write!(f, "{name} alone that is in {found}, declared in {declared}")
            }
            Self::AxisScale { axis, millionths } => {
                let (name, ratio) = (AXES[axis], f64::from(millionths) * 1e-6);
                write!(
                    f,
                    "{name} of the positions that is {ratio:.4} times as large as it should be"
                )
            }
            Self::AxisInches { axis } => {
                let name = AXES[axis];
                write!(f, "{name} alone that is in inches, declared in millimetres")
            }
            Self::Shifted { by, from } => {
                let rows = if by.abs() == 1 { "row" } else { "rows" };
                let side = if by > 0 { "before" } else { "after" };
                write!(f, "positions that belong to the configuration {} {rows} {side}", by.abs())?;
                // Behind it the configuration at `from` is the first with another position.
                let first = from.saturating_add_signed(isize::from(by.min(0))) + 1;
                if from > 0 { write!(f, ", from row {first} of the table on") } else { Ok(()) }
            }
            Self::ExchangedAxes => f.write_str("columns u and v that are exchanged"),
            Self::FromBottom => f.write_str(
                "a column v that counts from the bottom of the image (write height − v)",
            ),
            Self::Renumbered(Numbering::Exchanged([a, b])) => write!(
                f,
                "corners {a} and {b} of a tag that are exchanged (points_mm crosses it, detectors go \
                 round)"
            ),
            Self::Renumbered(_) => f.write_str(
                "points of the marker that are numbered along the other side (its rows and \
                 columns exchanged)",
            ),
            Self::FromOne => {
                f.write_str("points of the marker that are numbered from 1 (point counts from 0)")
            }
            Self::Squares => f.write_str(
                "points_mm that count the squares of the board (declare its inner corners)",
            ),
            Self::ShiftedViews { by } => {
                let (views, side) = (by.unsigned_abs(), if by > 0 { "before" } else { "after" });
                let plural = if views == 1 { "" } else { "s" };
                write!(f, "images that belong to the configuration {views} view{plural} {side}")
            }
            _ => self.fmt_of_commands(f),
        }
    }
}

impl Misreading {
    /// Writes the description of a misreading of joint columns.
    fn fmt_of_commands(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Zero { joint, degrees } => {
                write!(f, "joint {joint} whose zero position is {degrees}° off")
            }
            Self::Ratio { joint, percent } => {
                let ratio = f64::from(percent) / 100.0;
                write!(f, "joint {joint} that turns by {ratio} times its command")
            }
            Self::MixedUnits { joints, is_radians } => {
                let [found, declared] =
                    if is_radians { ["radians", "degrees"] } else { ["degrees", "radians"] };
                let numbers = listed_joints(joints);
                write!(f, "joints {numbers} alone that are in {found}, declared as {declared}")
            }
            Self::Cycled { joints: [first, second, third] } => write!(
                f,
                "columns of joints {first}, {second} and {third} that hold the angles of joints \
                 {second}, {third} and {first}"
            ),
            Self::ReversedRows => f.write_str("positions in the opposite order of the rows"),
            Self::Rotated { by } => {
                let places = if by == 1 { "place" } else { "places" };
                write!(f, "columns of the joints that are moved on by {by} {places}")
            }
            Self::Exchanged { joint, with } => {
                write!(f, "columns of joints {joint} and {with} that are exchanged")
            }
            Self::ExchangedPairs { joints: [a, b, c, d] } => write!(
                f,
                "columns of joints {a} and {b} that are exchanged, and those of joints {c} and {d}"
            ),
            Self::Coupled { joint, from, is_opposite } => {
                let sign = if is_opposite { "minus " } else { "" };
                write!(f, "joint {joint} that also turns by {sign}the command of joint {from}")
            }
            Self::Screw { joint, from, lead } => {
                write!(f, "joint {joint} that also turns once per {lead} mm of joint {from}")
            }
            Self::Zeros { .. } | Self::TwistSigns { .. } => f.write_str(&self.words_of_two()),
            _ => self.fmt_of_loads(f),
        }
    }

    /// Writes the description of a misreading of loads, targets, cameras or the joint table.
    fn fmt_of_loads(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mass { mass: 0, scale } => write!(f, "masses that are {scale}"),
            Self::Mass { mass, scale } => {
                write!(f, "mass {mass}, counted along the arm, that is {scale}")
            }
            Self::Payload { scale } => write!(f, "payloads that are {scale}"),
            Self::Hoist { is_reversed: false } => {
                f.write_str("hoist forces that are in kilograms, declared in newtons")
            }
            Self::Hoist { is_reversed: true } => f.write_str(
                "a hoist that pulls the other way (its direction, or the signs of hoist_N)",
            ),
            Self::ShiftedPayload { by } => {
                let (rows, side) = (by.unsigned_abs(), if by > 0 { "before" } else { "after" });
                let plural = if rows == 1 { "" } else { "s" };
                write!(f, "payloads that belong to the configuration {rows} row{plural} {side}")
            }
            Self::Stiffness { joint, power } => {
                let verb = if joint == 0 { "are" } else { "is" };
                match joint {
                    0 => f.write_str("stiffnesses of joints")?,
                    _ => write!(f, "the stiffness of joint {joint}")?,
                }
                match power {
                    0 => write!(f, " that {verb} per degree, declared per radian"),
                    _ => write!(f, " that {verb} to be multiplied by {}", power_of_ten(power)),
                }
            }
            Self::Slides { power } => {
                let [found, declared] =
                    if power < 0 { ["millimetres", "metres"] } else { ["metres", "millimetres"] };
                write!(f, "columns of sliding joints that are in {found}, declared in {declared}")
            }
            Self::Carrier { joint, .. } => {
                write!(f, "the target on the frame of joint {joint} (joint = {joint})")
            }
            Self::ExchangedTargets { .. } => f.write_str("two targets that are exchanged"),
            Self::Mounted { frame, .. } => {
                write!(f, "a camera or marker on the frame of joint {frame}")
            }
            Self::ExchangedMounts { .. } => {
                f.write_str("a camera and a marker with exchanged frames")
            }
            Self::PayloadAtTarget => f.write_str(
                "the payload at the measured target (declare payload_at = \"target\" in [tool])",
            ),
            Self::CentreSign { mass, axis } => write!(
                f,
                "{} of the centre of mass {mass}, counted along the arm, that has the other sign",
                AXES[axis]
            ),
            Self::Gravity { axis, is_negative } => {
                let sign = if is_negative { "−" } else { "+" };
                write!(f, "gravity that points along {sign}{} (gravity_m_s2)", AXES[axis])
            }
            Self::HeldTarget => f.write_str(
                "a target that lies elsewhere than [tool] declares (correct it there, or free it \
                 in [parameters]: \"tool.*\" = { free = true })",
            ),
            Self::HeldBase => f.write_str(
                "a base that stands elsewhere than declared (free it in [parameters]: \"base.*\" \
                 = { free = true })",
            ),
            Self::TargetInMillimetres => {
                f.write_str("a target of [tool] that is in millimetres, declared in metres")
            }
            Self::ArmInMillimetres => {
                f.write_str("lengths of joints that are in millimetres, declared in metres")
            }
            _ => self.fmt_of_table(f),
        }
    }

    /// Writes the description of a misreading of the joint table; nothing for other misreadings.
    fn fmt_of_table(self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ExchangedRows { row } => {
                write!(f, "rows {row} and {} of the joint table that are exchanged", row + 1)
            }
            Self::ExchangedLengths { joint, field, with, other } => {
                let [first, second] = [entry_name(joint, field), entry_name(with, other)];
                write!(f, "{first} and {second} that are exchanged")
            }
            Self::StandardForm => {
                f.write_str("a joint table in standard DH form (declare dh = \"standard\")")
            }
            Self::ModifiedForm => {
                f.write_str("a joint table in modified DH form, declared as standard (declare dh = \"modified\")")
            }
            Self::TableRadians { joint, field } => {
                write!(f, "{} that is in radians, declared in degrees", entry_name(joint, field))
            }
            Self::TableDegrees { joint, field } => {
                write!(f, "{} that is in degrees, declared in radians", entry_name(joint, field))
            }
            Self::Sign { joint, field } => {
                write!(f, "{} that has the other sign", entry_name(joint, field))
            }
            Self::Twist { joint, degrees } => {
                let entry = entry_name(joint, JointField::Alpha);
                let error = if degrees == 180 { 180 } else { -degrees };
                write!(f, "{entry} that is {error}° off")
            }
            Self::Length { joint, field, power: -3 } => {
                write!(f, "{} that is in millimetres, declared in metres", entry_name(joint, field))
            }
            Self::Length { joint, field, power: 3 } => {
                write!(f, "{} that is in metres, declared in millimetres", entry_name(joint, field))
            }
            Self::Length { joint, field, power } => {
                write!(
                    f,
                    "{} that should be multiplied by {}",
                    entry_name(joint, field),
                    power_of_ten(power)
                )
            }
            _ => f.write_str(&self.words_of_table_unit()),
        }
    }
}
