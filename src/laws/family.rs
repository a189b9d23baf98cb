//! Types of the catalogue: a family of effects as data.

use super::argument::ArgumentKind;
use super::site::{ArmField, BeamField, JointField};

/// Family of effects: formulas whose place and numbers are arguments.
///
/// Texts contain keys of arguments in braces, which are replaced by their values:
/// `"sin({orders}*q{joint})"`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Family {
    /// Name in problem files.
    pub name: &'static str,
    /// Keys and kinds of the arguments, in the order of files.
    pub arguments: &'static [(&'static str, ArgumentKind)],
    /// Parameters. If a formula or name contains a list argument, there is one parameter for each
    /// element.
    pub terms: &'static [TermEntry],
    /// Statement of the effect in words: "transmission ratio of joint {joint} is off".
    pub says: &'static str,
    /// Statement for data without times, with row numbers (from 1) instead of times; empty if it is
    /// the same.
    pub says_by_row: &'static str,
    /// Statement for an effect that acts on the base instead of a joint.
    pub says_of_base: &'static str,
    /// Conditions on the arm under which the effect is a candidate.
    pub only: &'static [Only],
    /// Conditions under which data can show the effect. The first one that is not met is reported
    /// as the reason.
    pub needs: &'static [Need],
    /// Values of arguments that are candidates of the search for effects.
    pub search: Search,
    /// Rule by which the family's prior probability is divided among its candidates.
    pub chance: Chance,
}

impl Family {
    /// Family without arguments, terms or conditions, from which the others are built.
    pub const PLAIN: Self = Self {
        name: "",
        arguments: &[],
        terms: &[],
        says: "",
        says_by_row: "",
        says_of_base: "",
        only: &[],
        needs: &[],
        search: Search::Places,
        chance: Chance::Equal,
    };
}

/// Parameter of every effect of a family.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TermEntry {
    /// Last part of the parameter's name, after the dot.
    pub name: &'static str,
    /// Site of the model at which the parameter acts.
    pub at: At,
    /// Formula that multiplies the parameter; empty if the parameter replaces the quantity at its
    /// site.
    pub formula: &'static str,
    /// Rule for 1 σ of the parameter's prior about its nominal value. Realistic effects are hardly
    /// larger.
    pub prior: Prior,
    /// Rule for the nominal value of the parameter, at which the effect vanishes; `None` for 0.
    pub nominal: Option<Prior>,
    /// True if a negative value is physically impossible. The effect is rejected as a cause if its
    /// fit needs one.
    pub never_negative: bool,
}

impl TermEntry {
    /// Creates a parameter that replaces the quantity at its site; `size` is 1 σ of its prior
    /// \[SI\].
    pub const fn at(at: At, name: &'static str, size: f64) -> Self {
        Self::driven(at, name, "", size)
    }

    /// Creates a parameter that is multiplied by a formula; `size` is 1 σ of its prior \[SI\].
    pub const fn driven(at: At, name: &'static str, formula: &'static str, size: f64) -> Self {
        let prior = Prior::Size(size);
        Self { name, at, formula, prior, nominal: None, never_negative: false }
    }

    /// Replaces the prior of the parameter.
    #[must_use]
    pub const fn prior(self, prior: Prior) -> Self {
        Self { prior, ..self }
    }

    /// Sets the rule for the nominal value of the parameter, at which the effect vanishes.
    #[must_use]
    pub const fn nominal(self, nominal: Prior) -> Self {
        Self { nominal: Some(nominal), ..self }
    }

    /// Marks the parameter as one that cannot be negative.
    #[must_use]
    pub const fn never_negative(self) -> Self {
        Self { never_negative: true, ..self }
    }
}

/// Axis of displacements along the line of sight from the station, the origin of the measuring
/// frame.
pub(crate) const RANGE_AXIS: usize = 3;

/// Site of a parameter: the quantity that it changes, at the joint, link or arm that the effect
/// names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum At {
    /// Coordinate of the joint that its command moves: θ, or d of a prismatic joint.
    Coordinate,
    /// Field of the joint.
    Joint(JointField),
    /// Two fields of the joint: the first applies to a revolute, the second to a prismatic joint.
    JointOrSlide(JointField, JointField),
    /// Field of the link's beam; if a joint is named, of the beam before that joint.
    Beam(BeamField),
    /// Field of the arm as a whole.
    Arm(ArmField),
    /// Displacement of every measured position along an axis of the measuring frame, 0 to 2, or
    /// away from the station ([`RANGE_AXIS`]).
    Shift(usize),
    /// Rotation of the instrument about an axis of the measuring frame, 0 to 2.
    Turn(usize),
    /// Displacement of the base along an axis of the measuring frame, 0 to 2.
    BaseShift(usize),
    /// Rotation of the base about an axis of the measuring frame, 0 to 2.
    BaseTurn(usize),
    /// Small motion of the joint's frame before it turns: x, y, z, rx, ry, rz.
    Before(usize),
    /// Small motion of the frame behind the joint: x, y, z, rx, ry, rz.
    After(usize),
    /// Small motion of the tool in the frame of the joint that it is mounted on: x, y, z, rx, ry,
    /// rz.
    Tool(usize),
    /// Strain of the arm: all its lengths (a, d, xyz of placements) grow in proportion.
    ArmStrain,
    /// Relative error of every measured coordinate.
    Scale,
    /// Entry of the strain of the measuring frame, by its index: xx, yy, zz, xy, xz, yz.
    Strain(usize),
    /// Number of the camera, by its name in parameters, such as `fx`; `f` for both focal lengths alike.
    Camera(&'static str),
    /// Time between the reading of the joints and the exposure of a pixel, constant or per row of
    /// the image.
    Exposure {
        /// True for the time per row of the image.
        by_row: bool,
    },
}

/// Rule for the prior size (1 σ) of a parameter, or for its nominal value, on an arm; SI.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Prior {
    /// Value that is the same on every arm; infinite for a flat prior.
    Size(f64),
    /// Size of a coefficient c₃ in θ = c₃ M³ at which the largest plausible moment M rotates the
    /// joint by this angle \[rad\].
    OfCubedMoment(f64),
    /// Size of a spring rate at which the spring balances the largest plausible moment.
    SpringRate,
    /// Size of a preload at which the spring balances the largest plausible moment.
    SpringPreload,
    /// Size of the coupling of twist with bending about y or z: the largest one with a positive
    /// strain energy.
    TwistCoupling {
        /// True for bending about z.
        about_z: bool,
    },
    /// Half the length of the link.
    HalfLength,
    /// Declared mass of the joint's bodies.
    BodyMass,
}

/// Condition on the arm. If it is not met, the effect is no candidate of the search, or its
/// declaration is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Only {
    /// Requires a revolute joint that takes a command; otherwise the effect is no candidate.
    Turning,
    /// Requires a joint that takes a command; otherwise the effect is no candidate.
    Commanded,
    /// Requires a joint without declared stiffness; otherwise the effect is no candidate.
    RigidJoint,
    /// Requires a link with a length; otherwise the effect is refused.
    Link,
    /// Requires a link without declared bending; otherwise the effect is no candidate.
    RigidLink,
    /// Requires that loads act on the undeflected arm; otherwise the effect is refused.
    Undeflected,
    /// Requires a beam with a hoist; otherwise the effect is refused.
    Hoisted,
    /// Requires that the joint moves the camera; otherwise the effect is no candidate.
    CarriesCamera,
    /// Requires a joint that carries bodies with mass; otherwise the effect is refused.
    Bodies,
}

/// Condition that data must meet to show an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Need {
    /// Requires gravity, so that masses load the arm.
    Loads,
    /// Requires that the joint named by the argument with this key moves.
    Moves(&'static str),
    /// Requires a recorded temperature that varies, and a declared reference temperature.
    Temperature,
    /// Requires recorded times, so that the order of the poses is known.
    Clock,
    /// Requires recorded times with enough poses before and after some instant.
    Times,
    /// Requires gravity and poses with a payload.
    Payload,
    /// Requires that the problem declares a part that gives way. Otherwise an error of the loads
    /// shows only through causes that the search has added itself.
    GivesWay,
    /// Requires a declared part that gives way, or other loads than one payload. With one payload
    /// alone, only the product of its mass and a compliance that the search has added is known.
    OtherLoads,
    /// Requires a payload that varies, and joints that approach from both sides.
    PayloadFromBothSides,
    /// Requires a joint that is approached from both sides. If no sides are recorded, loads must
    /// exert a moment on the joint instead.
    Play,
    /// Requires a recorded covariate that varies.
    Covariate,
    /// Requires recorded velocities of joints that are not all zero.
    Velocities,
}

/// Rule for the trial values of an effect's searched or listed argument.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Search {
    /// One candidate at each joint, link or other place; the effect has no searched argument.
    Places,
    /// No candidates: the effect must be declared, or another search finds it.
    Declared,
    /// Each integer order up to 60.
    Orders,
    /// Each time at which an event may have happened.
    Times,
    /// Time constants from twice the typical time between poses to a fraction of a session.
    TimeConstants,
    /// Time constants that are fractions of the measured duration.
    SettlingTimes,
    /// Trial values of the sliding distance of the Dahl friction model: fixed fractions of the
    /// joint's range.
    Distances,
}

/// Rule by which the prior probability of a family is divided among its candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Chance {
    /// Equal probability of every candidate.
    Equal,
    /// Probability that decreases with the order of a harmonic.
    Orders,
    /// Probability that decreases with the order of a wave.
    Waves,
}
