//! Misreadings of a table or problem: mistakes that would explain why an arm does not fit its
//! measurements.
//!
//! Each [`Misreading`] is corrected in a copy of table and problem, and the nominal arm is
//! registered to that copy ([`search`]). The misreadings with the smallest errors are then fitted
//! in full. Linearised tests at a fit with a large error would not find them.

mod axis_scale;
mod candidates;
mod chosen_rows;
mod commands;
mod explanation;
mod held_places;
mod images;
mod known_arm;
mod masses;
mod payload_rows;
mod reversed;
mod search;
mod some_rows;
mod target;
mod two_entries;
mod two_mistakes;
mod typed;
mod undo;
mod views;
mod words;

pub(in crate::fit) use explanation::Explanations;
pub(crate) use explanation::MisreadEffect;
pub(in crate::fit) use explanation::first_of;
pub(in crate::fit) use images::is_of_views;
pub(crate) use known_arm::misread_table;
pub(in crate::fit) use masses::{error_with_priors, misread_masses};
pub(in crate::fit) use search::{MAX_CLEAR_RATIO, MAX_NOISE_SIGMAS};
pub(in crate::fit) use some_rows::reading_of_rows;
pub(in crate::fit) use views::{start_of_fit, with_readings};

use crate::fit::stages::single_views::Numbering;
use crate::model::parameter::JointField;

/// Misreading: a quantity of table or problem that may have been declared in the wrong unit, sign,
/// order or convention.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Misreading {
    /// Joint angles are in degrees, declared as radians.
    Degrees,
    /// Joint angles are in radians, declared as degrees.
    Radians,
    /// Joint angles are in another unit, declared as degrees: gradians, tenths or hundredths of a
    /// degree, or counts of an encoder.
    TurnUnit {
        /// Number of these units to a turn.
        per_turn: u32,
    },
    /// The angles of some joints alone are in radians, declared as degrees, or the reverse.
    MixedUnits {
        /// Set of these joints as bits, as in [`Misreading::Reversed`].
        joints: u64,
        /// True if these angles are in radians.
        is_radians: bool,
    },
    /// The columns of three joints, by number, are exchanged in a ring: each holds the angles of the
    /// next joint, the last one those of the first.
    Cycled {
        /// Numbers of the joints, from 1.
        joints: [usize; 3],
    },
    /// Coordinates of sliding joints are in another unit.
    Slides {
        /// Exponent of the power of ten by which the coordinates must be multiplied.
        power: i8,
    },
    /// Positions are in metres, declared as millimetres.
    Metres,
    /// Positions are in millimetres, declared as metres.
    Millimetres,
    /// Positions are in another unit than metres, declared as millimetres.
    PositionUnit {
        /// Index of the unit in [`POSITION_UNITS`].
        unit: usize,
    },
    /// All positions are longer or shorter by one factor, because the instrument or the joint table
    /// has a wrong scale.
    Scale {
        /// Ratio of the measured lengths to those of the arm, in hundredths.
        percent: i16,
    },
    /// Positions are in a left-handed frame: two coordinates are exchanged, or one has the wrong
    /// sign.
    Mirrored {
        /// The two exchanged coordinates, 0…2 for x, y, z, or twice the one with the wrong sign;
        /// `None` if the free base makes all alike.
        axes: Option<[usize; 2]>,
    },
    /// The measured angles of some joints have the opposite sign.
    Reversed {
        /// Set of joints as bits: bit k (from 0) is set for joint k + 1.
        joints: u64,
    },
    /// The columns of two joints, by number, are exchanged.
    Exchanged {
        /// Number of the first joint, from 1.
        joint: usize,
        /// Number of the second joint, from 1.
        with: usize,
    },
    /// The columns of two pairs of joints, by number, are exchanged.
    ExchangedPairs {
        /// Numbers of the joints, from 1: the first is exchanged with the second, the third with the
        /// fourth.
        joints: [usize; 4],
    },
    /// The columns of all joints are in the opposite order.
    OppositeOrder,
    /// The columns of all joints are in the alphabetical order of the joints' names.
    Alphabetical,
    /// Rows of one of two joined tables are sorted by the text of their numbers: 1, 10, 11, 2.
    TextOrder {
        /// Smallest number of a row.
        first: u8,
        /// True if the configurations are sorted so, false if the positions are.
        is_of_joints: bool,
    },
    /// Positions are in the opposite order of the rows.
    ReversedRows,
    /// Poses are inverse: of the measuring frame in the frame of the target.
    InversePose,
    /// The columns of all joints are shifted to the right; the last ones come first.
    Rotated {
        /// Number of places by which the columns are shifted to the right.
        by: usize,
    },
    /// One coordinate of the positions is in another unit than the others.
    AxisUnit {
        /// Coordinate, 0…2 for x, y, z.
        axis: usize,
        /// Exponent of the power of ten by which the coordinate must be multiplied.
        power: i8,
    },
    /// One coordinate of the positions is longer or shorter than the others by a factor.
    AxisScale {
        /// Coordinate, 0…2 for x, y, z.
        axis: usize,
        /// Ratio of the coordinate to the two others, in millionths.
        millionths: u32,
    },
    /// One coordinate of the positions is in inches, declared as millimetres.
    AxisInches {
        /// Coordinate, 0…2 for x, y, z.
        axis: usize,
    },
    /// The angle of a joint contains the command of another joint (mechanical coupling). Joints are
    /// counted from 1.
    Coupled {
        /// Number of the joint whose angle changes.
        joint: usize,
        /// Number of the joint whose command is added.
        from: usize,
        /// True if the other joint's command is subtracted instead of added.
        is_opposite: bool,
    },
    /// A turning joint also turns with a sliding one, as the nut of a ball screw does. Joints are
    /// counted from 1.
    Screw {
        /// Number of the turning joint.
        joint: usize,
        /// Number of the sliding joint.
        from: usize,
        /// Lead of the screw \[mm\]; negative for a left-handed screw.
        lead: i16,
    },
    /// Positions stand in a wrong row, so that they belong to the configuration of another row.
    Shifted {
        /// Number of rows by which a position comes after its configuration; negative if before.
        by: i8,
        /// First row whose position is shifted, counted from 0.
        from: usize,
    },
    /// The zero position of a joint, counted from 1, is wrong.
    Zero {
        /// Number of the joint.
        joint: usize,
        /// Angle that must be added to the joint's command \[°\].
        degrees: i16,
    },
    /// The zero positions of two joints, counted from 1, are wrong.
    Zeros {
        /// Numbers of the joints.
        joints: [usize; 2],
        /// Number of quarter turns that must be added to the command of each.
        quarters: [i8; 2],
    },
    /// The angles α of two joints, counted from 1, have the other sign.
    TwistSigns {
        /// Numbers of the joints.
        joints: [usize; 2],
    },
    /// A joint, counted from 1, turns by a multiple of its command.
    Ratio {
        /// Number of the joint.
        joint: usize,
        /// Ratio of the joint's motion to its command, in hundredths.
        percent: i16,
    },
    /// The joint table is in standard DH form, declared as modified.
    StandardForm,
    /// The joint table is in modified DH form, declared as standard.
    ModifiedForm,
    /// An angle of the joint table is in radians, declared in degrees.
    TableRadians {
        /// Number of the joint, from 1; 0 for all joints.
        joint: usize,
        /// Angle (α, θ or β) of the joint table.
        field: JointField,
    },
    /// An angle of the joint table is in degrees, declared in radians.
    TableDegrees {
        /// Number of the joint, from 1; 0 for all joints.
        joint: usize,
        /// Angle of the joint table.
        field: JointField,
    },
    /// A number of the joint table has the other sign.
    Sign {
        /// Number of the joint, from 1.
        joint: usize,
        /// Entry of the joint table with the wrong sign.
        field: JointField,
    },
    /// Two neighbouring rows of the joint table are exchanged.
    ExchangedRows {
        /// Number of the first row, from 1.
        row: usize,
    },
    /// Two lengths a or d of one joint or of two neighbouring joints are exchanged.
    ExchangedLengths {
        /// Number of the first length's joint, from 1.
        joint: usize,
        /// First length.
        field: JointField,
        /// Number of the second length's joint: the same or the next one.
        with: usize,
        /// Second length.
        other: JointField,
    },
    /// The angle α of the joint table is wrong by a multiple of 90°.
    Twist {
        /// Number of the joint, from 1.
        joint: usize,
        /// Angle that must be added to α \[°\].
        degrees: i16,
    },
    /// A length of the joint table is in another unit or has a misplaced decimal point.
    Length {
        /// Number of the joint, from 1.
        joint: usize,
        /// Length of the joint table.
        field: JointField,
        /// Exponent of the power of ten by which the length must be multiplied.
        power: i8,
    },
    /// A length a or d, or an angle α of the joint table is another number.
    Typed {
        /// Number of the joint, from 1.
        joint: usize,
        /// Entry of the joint table.
        field: JointField,
        /// Number that must be added \[µm\], or \[m°\] for an angle.
        by: i32,
    },
    /// All lengths of the joint table are in another unit, declared as millimetres.
    TableUnit {
        /// Index of the unit in [`POSITION_UNITS`].
        unit: usize,
        /// True if the targets are in this unit too.
        has_targets: bool,
    },
    /// The base stands elsewhere than declared, and the problem holds it there.
    HeldBase,
    /// The target lies elsewhere than declared, and the problem holds it there.
    HeldTarget,
    /// A target is declared on the frame of another joint than the one that carries it.
    Carrier {
        /// Index of the target in `[[target]]`; 0 for `[tool]`.
        target: usize,
        /// Number of the joint that carries the target, from 1.
        joint: usize,
    },
    /// The words of two targets, by index, are exchanged.
    ExchangedTargets {
        /// Index of the first target.
        target: usize,
        /// Index of the second target.
        with: usize,
    },
    /// The payload hangs at the measured target, declared elsewhere.
    PayloadAtTarget,
    /// A coordinate of the centre of a declared mass has the other sign.
    CentreSign {
        /// Number of the mass, from 1, counted along the arm over the bodies.
        mass: usize,
        /// Coordinate, 0…2 for x, y, z.
        axis: usize,
    },
    /// The target of `[tool]` is in millimetres, declared as metres.
    TargetInMillimetres,
    /// Lengths of joints above 1 m are in millimetres, declared as metres; likewise the target.
    ArmInMillimetres,
    /// A declared mass is in another unit or has a misplaced decimal point.
    Mass {
        /// Number of the mass, from 1, counted along the arm; 0 for all masses.
        mass: usize,
        /// Unit or decimal point of the declared number.
        scale: MassScale,
    },
    /// The payloads of the table are in another unit.
    Payload {
        /// Unit or decimal point of the numbers in the table.
        scale: MassScale,
    },
    /// The column of payloads is shifted against the configurations.
    ShiftedPayload {
        /// Number of rows by which a payload comes after its configuration; negative if before.
        by: i8,
    },
    /// Suspension forces are in kilograms, declared as newtons, or pull the other way.
    Hoist {
        /// True if the forces pull the other way.
        is_reversed: bool,
    },
    /// Stiffnesses of joints are in another unit.
    Stiffness {
        /// Number of the joint, from 1; 0 for all joints.
        joint: usize,
        /// Exponent of the power of ten by which the stiffnesses must be multiplied; 0 if they are
        /// per degree, declared per radian.
        power: i8,
    },
    /// The columns u and v of images are exchanged.
    ExchangedAxes,
    /// Rows of pixels are counted from the bottom of the image.
    FromBottom,
    /// The points of a marker are numbered in another way: a grid column by column, or the corners of
    /// a tag across it.
    Renumbered(Numbering),
    /// The points of a marker are numbered from 1 instead of 0.
    FromOne,
    /// The points of a marker are declared by squares, and corners between them are numbered.
    Squares,
    /// Images belong to the configuration of another view.
    ShiftedViews {
        /// Number of views by which an image comes too late.
        by: i8,
    },
    /// A camera or marker is carried by another frame than declared.
    Mounted {
        /// Index of the camera or marker in the fixtures of the problem.
        fixture: usize,
        /// Number of the joint whose frame carries it.
        frame: usize,
    },
    /// The carriers of a camera and a marker are exchanged.
    ExchangedMounts {
        /// Index of the camera in the fixtures of the problem.
        fixture: usize,
        /// Index of the marker.
        with: usize,
    },
    /// Gravity points along another axis of the base frame.
    Gravity {
        /// Axis along which gravity points, 0…2 for x, y, z.
        axis: usize,
        /// True if gravity points in the negative direction of the axis.
        is_negative: bool,
    },
}

/// Units of positions that are taken for millimetres: length \[mm\] and name.
pub(in crate::fit) const POSITION_UNITS: [(f64, &str); 7] = [
    (25.4, "inches"),
    (10.0, "centimetres"),
    (1e-3, "micrometres"),
    (0.1, "tenths of a millimetre"),
    (0.01, "hundredths of a millimetre"),
    (100.0, "decimetres"),
    (304.8, "feet"),
];

/// Weight of a kilogram \[N\].
const STANDARD_GRAVITY: f64 = 9.80665;

/// Unit or decimal point of a number that was declared as a mass in kilograms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MassScale {
    /// The number must be multiplied by this power of ten.
    Power(i8),
    /// The number is in pounds.
    Pounds,
    /// The number is a weight in newtons.
    Newtons,
}

impl Misreading {
    /// Returns the factor by which suspension forces must be multiplied; 1 for other misreadings.
    fn hoist_factor(self) -> f64 {
        match self {
            Self::Hoist { is_reversed: true } => -1.0,
            Self::Hoist { is_reversed: false } => STANDARD_GRAVITY,
            _ => 1.0,
        }
    }

    /// Creates the misreading that the angles of these joints, counted from 1, have the opposite
    /// sign.
    pub fn reversed(joints: &[usize]) -> Self {
        Self::Reversed { joints: joints.iter().map(|joint| 1 << (joint - 1)).sum() }
    }

    /// Returns the first row whose position is shifted; `None` for misreadings other than shifts.
    fn shifted_from(self) -> Option<usize> {
        match self {
            Self::Shifted { from, .. } => Some(from),
            _ => None,
        }
    }

    /// Returns the shift by the same number of rows that begins at the row `from`; misreadings
    /// other than shifts stay as they are.
    fn with_shift_from(self, from: usize) -> Self {
        match self {
            Self::Shifted { by, .. } => Self::Shifted { by, from },
            _ => self,
        }
    }

    /// Returns a key that is equal for misreadings that differ only in size. Of the misreadings
    /// with one key, only the best is fitted in full.
    fn group(self) -> (std::mem::Discriminant<Self>, usize, usize, Option<JointField>) {
        let (first, second, field) = match self {
            Self::Zero { joint, .. } | Self::Ratio { joint, .. } => (joint, 0, None),
            Self::Exchanged { joint, with }
            | Self::Zeros { joints: [joint, with], .. }
            | Self::TwistSigns { joints: [joint, with] } => (joint, with, None),
            Self::Coupled { joint, from, .. } | Self::Screw { joint, from, .. } => {
                (joint, from, None)
            }
            Self::Length { joint, field, .. }
            | Self::Sign { joint, field }
            | Self::TableRadians { joint, field }
            | Self::TableDegrees { joint, field }
            | Self::Typed { joint, field, .. } => (joint, 0, Some(field)),
            Self::Twist { joint, .. } => (joint, 0, Some(JointField::Alpha)),
            Self::Mass { mass, .. } => (mass, 0, None),
            Self::Hoist { is_reversed } => (usize::from(is_reversed), 0, None),
            Self::Stiffness { joint, power } => {
                (joint, usize::from(power.unsigned_abs()) + usize::from(power > 0) * 8, None)
            }
            Self::Carrier { target, joint } => (target, joint, None),
            Self::ExchangedTargets { target, with } => (target, with, None),
            Self::CentreSign { mass, axis } => (mass, axis, None),
            Self::Mounted { fixture, frame: with } | Self::ExchangedMounts { fixture, with } => {
                (fixture, with, None)
            }
            Self::TurnUnit { per_turn } => (per_turn as usize, 0, None),
            Self::PositionUnit { unit } => (unit, 0, None),
            Self::Cycled { joints: [first, second, third] } => (first, 64 * second + third, None),
            Self::ExchangedPairs { joints: [a, b, c, d] } => (64 * a + b, 64 * c + d, None),
            Self::AxisUnit { axis, .. }
            | Self::AxisInches { axis }
            | Self::AxisScale { axis, .. } => (axis, 0, None),
            Self::ExchangedRows { row } => (row, 0, None),
            Self::ExchangedLengths { joint, field, with, other } => {
                (joint, 2 * with + usize::from(other == JointField::D), Some(field))
            }
            Self::Reversed { joints } | Self::MixedUnits { joints, .. } => {
                (usize::try_from(joints).unwrap_or(usize::MAX), 0, None)
            }
            _ => (0, 0, None),
        };
        (std::mem::discriminant(&self), first, second, field)
    }
}

/// Returns 10 to the power `power`, the factor between two units of a length or a mass.
fn power_of_ten(power: i8) -> f64 {
    10.0_f64.powi(power.into())
}

/// Returns the numbers, from 1, of the joints in a set of bits: bit k is set for joint k + 1.
fn numbers_of(joints: u64) -> impl Iterator<Item = usize> {
    (0..64).filter(move |joint| joints >> joint & 1 == 1).map(|joint| joint + 1)
}
