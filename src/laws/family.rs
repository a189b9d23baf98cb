//! Types of the catalogue: a family of effects as data.

use super::argument::ArgumentKind;
use super::site::{ArmField, BeamField, JointField};

/// Family of effects: the law of an effect, with place and numbers left open.
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
    /// Description of the effect in words: "transmission ratio of joint {joint} is off".
    pub says: &'static str,
    /// Description if times were not measured, with row numbers, counted from 1, instead of times;
    /// empty if it is the same.
    pub says_by_row: &'static str,
    /// Description if the effect acts on the base instead of a joint.
    pub says_of_base: &'static str,
    /// Conditions on the arm under which the effect is a candidate.
    pub only: &'static [Only],
    /// Conditions under which data can show the effect; the first unmet one is the reason given.
    pub needs: &'static [Need],
    /// Values of arguments that are candidates of the search for effects.
    pub search: Search,
    /// Rule for the share of the family's prior probability that one member has.
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

/// Parameter of a family.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct TermEntry {
    /// Part of its name after the dot.
    pub name: &'static str,
    /// Site of the model where it enters.
    pub at: At,
    /// Formula that multiplies it there; empty if it is itself the quantity of its site.
    pub formula: &'static str,
    /// Size that no realistic effect exceeds by much: 1 σ of its prior.
    pub prior: Prior,
    /// Value at which the effect vanishes, as a prior size; `None` for 0.
    pub nominal: Option<Prior>,
    /// True if a negative value is physically impossible. An effect whose fit needs one is rejected
    /// as a cause.
    pub never_negative: bool,
}

impl TermEntry {
    /// Creates a parameter that is itself the quantity of its site; `size` is 1 σ of its prior
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

    /// Replaces the value at which the effect vanishes.
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

/// Axis of displacements along the line of sight from the station, the origin of the measuring frame.
pub(crate) const RANGE_AXIS: usize = 3;

/// Site of a parameter, relative to the place that the effect names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum At {
    /// Coordinate of the joint that its command moves: θ, or d of a prismatic joint.
    Coordinate,
    /// Field of the joint.
    Joint(JointField),
    /// Field of the joint: the first one for a revolute, the second one for a prismatic joint.
    JointOrSlide(JointField, JointField),
    /// Field of the link's beam, or of the beam before the joint.
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
    /// Small motion of the tool in the frame that carries it: x, y, z, rx, ry, rz.
    Tool(usize),
    /// Relative error of every measured coordinate.
    Scale,
    /// Entry of the strain of the measuring frame: xx, yy, zz, xy, xz, yz.
    Strain(usize),
}

/// Rule for the prior size (1 σ) of a parameter on an arm, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Prior {
    /// Size that is the same on every arm; infinite if any size is plausible.
    Size(f64),
    /// Coefficient c₃ at which the cube of the largest plausible moment rotates the joint by this
    /// angle \[rad\].
    OfCubedMoment(f64),
    /// Rate of a spring that balances the largest plausible moment.
    SpringRate,
    /// Preload of a spring that balances the largest plausible moment.
    SpringPreload,
    /// Largest coupling of twist with bending about y or z at which the strain energy stays
    /// positive.
    TwistCoupling {
        /// True for bending about z.
        about_z: bool,
    },
    /// Half the length of the link.
    HalfLength,
}

/// Condition on the arm for an effect. If it is not met, the effect is no candidate, or its
/// declaration is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Only {
    /// The joint is revolute and takes a command; otherwise the effect is no candidate.
    Turning,
    /// The joint takes a command; otherwise the effect is no candidate.
    Commanded,
    /// The joint has no stiffness; otherwise the effect is no candidate.
    RigidJoint,
    /// The link has a length; otherwise the effect is refused.
    Link,
    /// The link does not bend; otherwise the effect is no candidate.
    RigidLink,
    /// Loads act on the rigid arm; otherwise the effect is refused.
    Undeflected,
    /// A beam has a hoist; otherwise the effect is refused.
    Hoisted,
}

/// Condition on the data without which they cannot show an effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Need {
    /// Gravity is not zero.
    Loads,
    /// The joint named by the argument with this key moves.
    Moves(&'static str),
    /// The temperature is recorded and varies, and its reference is declared.
    Temperature,
    /// Times are recorded, so that the order of the poses is known.
    Clock,
    /// There are enough poses before and after some time.
    Times,
    /// Some poses have a payload, and gravity is not zero.
    Payload,
    /// The payload varies, and joints approach from both sides.
    PayloadFromBothSides,
    /// The joint is approached from both sides. If the table records no sides, loads must exert a
    /// moment on the joint instead.
    Play,
    /// The covariate is recorded and varies.
    Covariate,
}

/// Values of the searched or listed argument that become candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Search {
    /// One candidate at each place; the effect has no searched argument.
    Places,
    /// No candidates: the effect is only declared, or found by a separate search.
    Declared,
    /// Each integer order up to 60.
    Orders,
    /// Each time at which an event may have happened.
    Times,
    /// Time constants from twice the typical time between poses to a fraction of a session.
    TimeConstants,
    /// Time constants that are fractions of the measured duration.
    SettlingTimes,
    /// Paths that are fractions of the range of the joint.
    Distances,
}

/// Rule for the share of a family's prior probability that one of its members has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Chance {
    /// Equal share for every candidate.
    Equal,
    /// Share that decreases with the order of a harmonic.
    Orders,
    /// Share that decreases with the order of a wave.
    Waves,
}
