//! Types of the catalogue: a family of effects as data.

use super::argument::ArgumentKind;
use super::site::{ArmField, BeamField, JointField};

/// Family of effects: the law of an effect, with the place and numbers of one left open.
///
/// Texts take arguments in braces by their keys: `"sin({orders}*q{joint})"`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Family {
    /// Name in problem files.
    pub name: &'static str,
    /// Keys and kinds of the arguments, in the order of files.
    pub arguments: &'static [(&'static str, ArgumentKind)],
    /// Parameters. Where a formula or name holds a list argument, one of each for every element.
    pub terms: &'static [TermEntry],
    /// The effect in words for people: "transmission ratio of joint {joint} is off".
    pub says: &'static str,
    /// The same where the order of the rows, counted from 1, stands for times that were not
    /// measured; empty: the same.
    pub says_by_row: &'static str,
    /// The same of the base instead of a joint.
    pub says_of_base: &'static str,
    /// Arms and places at which the effect can be.
    pub only: &'static [Only],
    /// Conditions under which data can show the effect; the first unmet one is the reason given.
    pub needs: &'static [Need],
    /// Values of arguments that are candidates of the search for effects.
    pub search: Search,
    /// Share of the family's chance that falls to one of its members.
    pub chance: Chance,
}

impl Family {
    /// Family without arguments, terms or conditions.
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
    /// Name after the dot.
    pub name: &'static str,
    /// Where it enters.
    pub at: At,
    /// Formula that multiplies it there; empty: it is itself the quantity of its site.
    pub formula: &'static str,
    /// Size that no realistic effect exceeds by much: 1 σ of its prior.
    pub prior: Prior,
    /// Value where the effect has no size, as a prior size; `None`: 0.
    pub nominal: Option<Prior>,
    /// True if nature knows no negative values: an effect that needs one is no explanation.
    pub never_negative: bool,
}

impl TermEntry {
    /// Parameter that is itself the quantity of its site, with 1 σ of its prior \[SI\].
    pub const fn at(at: At, name: &'static str, size: f64) -> Self {
        Self::driven(at, name, "", size)
    }

    /// Parameter that is multiplied by a formula, with 1 σ of its prior \[SI\].
    pub const fn driven(at: At, name: &'static str, formula: &'static str, size: f64) -> Self {
        let prior = Prior::Size(size);
        Self { name, at, formula, prior, nominal: None, never_negative: false }
    }

    /// The same with another prior.
    #[must_use]
    pub const fn prior(self, prior: Prior) -> Self {
        Self { prior, ..self }
    }

    /// The same with another value of no effect.
    #[must_use]
    pub const fn nominal(self, nominal: Prior) -> Self {
        Self { nominal: Some(nominal), ..self }
    }

    /// The same, never negative.
    #[must_use]
    pub const fn never_negative(self) -> Self {
        Self { never_negative: true, ..self }
    }
}

/// Site of a parameter at the place that the effect names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum At {
    /// Coordinate of the joint: θ, or d where it slides.
    Coordinate,
    /// Field of the joint.
    Joint(JointField),
    /// Field of the joint where it turns, another one where it slides.
    JointOrSlide(JointField, JointField),
    /// Field of the link's beam, or of the link before the joint.
    Beam(BeamField),
    /// Field of the arm as a whole.
    Arm(ArmField),
    /// Displacement of every measured position along an axis of the measuring frame, 0 to 2.
    Shift(usize),
    /// Turn of the instrument about an axis of the measuring frame, 0 to 2.
    Turn(usize),
    /// Displacement of the base along an axis of the measuring frame, 0 to 2.
    BaseShift(usize),
    /// Turn of the base about an axis of the measuring frame, 0 to 2.
    BaseTurn(usize),
    /// Relative error of every measured coordinate.
    Scale,
    /// Entry of the strain of the measuring frame: xx, yy, zz, xy, xz, yz.
    Strain(usize),
}

/// Size of a parameter on an arm, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Prior {
    /// The same on every arm; infinite where no size is too great.
    Size(f64),
    /// Coefficient at which the cube of the greatest conceivable moment turns the joint by an angle
    /// \[rad\].
    OfCubedMoment(f64),
    /// Rate of a spring that takes off all of the greatest conceivable moment.
    SpringRate,
    /// Preload of a spring that takes off all of the greatest conceivable moment.
    SpringPreload,
    /// Largest coupling of twist with bending about y or z with which no load gains energy.
    TwistCoupling {
        /// True for bending about z.
        about_z: bool,
    },
    /// Half the length of the link.
    HalfLength,
}

/// Condition of an arm on which an effect can be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Only {
    /// The joint turns and takes a command; where it does not, the effect is no candidate.
    Turning,
    /// The joint takes a command; where it does not, the effect is no candidate.
    Commanded,
    /// The joint has no stiffness; where it has one, the effect is no candidate.
    RigidJoint,
    /// The link has a length; without one the effect is refused.
    Link,
    /// The link does not bend; where it does, the effect is no candidate.
    RigidLink,
    /// Loads act on the rigid arm; otherwise the effect is refused.
    Undeflected,
    /// A beam has a hoist; otherwise the effect is refused.
    Hoisted,
}

/// Condition of the data without which an effect cannot be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Need {
    /// Gravity.
    Loads,
    /// A joint that moves, by the key of the argument that names it.
    Moves(&'static str),
    /// A temperature that is known beside its reference and changes.
    Temperature,
    /// Measured times, which say which pose was before which.
    Clock,
    /// Enough poses before and after some time.
    Times,
    /// A payload in some poses, and gravity.
    Payload,
    /// A payload that changes, and approaches from both sides.
    PayloadFromBothSides,
    /// Approaches from both sides, or a moment where no side is known.
    Play,
    /// A covariate that changes.
    Covariate,
}

/// Values of a searched or listed argument that are candidates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Search {
    /// One candidate at each place; nothing else is open.
    Places,
    /// No candidate: declared effects alone, or a separate search.
    Declared,
    /// Each whole order up to 60.
    Orders,
    /// Each time at which something may have happened.
    Times,
    /// Time constants from twice the time between poses to a part of a session.
    TimeConstants,
    /// Time constants as parts of the time measured.
    SettlingTimes,
    /// Paths as parts of the range of the joint.
    Distances,
}

/// Share of a family's chance that falls to one of its members.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Chance {
    /// The same for every candidate.
    Equal,
    /// The smaller the higher the order of a harmonic.
    Orders,
    /// The smaller the higher the order of a wave.
    Waves,
}
