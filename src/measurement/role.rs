//! What columns stand for, and what they are called.

use crate::problem::Problem;
use crate::quantity::Unit;

/// What a column stands for; joints and axes count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Joint(usize),
    /// What a joint's encoder read.
    Reading(usize),
    Position(usize),
    Sigma,
    Payload,
    Hoist,
    Temperature,
    Time,
    Approach(usize),
    Orientation(usize),
    Quaternion(usize),
    Split,
    Session,
    Target,
    Pose,
    /// Which fixed point a row without an arm measures.
    Nest,
    /// One of the problem's own covariates.
    Covariate(usize),
    /// At which point the target is.
    Point,
    /// To which anchor a distance is measured, and that distance.
    Anchor,
    Distance,
    /// Which surface is touched, and how far from it.
    Surface,
    Offset,
    /// Which frame is tilted, and by how much its x and y axes are.
    Frame,
    Tilt(usize),
}

impl Role {
    /// The table of `problem.toml` that has to declare something for the column to mean anything.
    fn declared_by(self) -> Option<&'static str> {
        match self {
            Self::Point => Some("point"),
            Self::Anchor | Self::Distance => Some("anchor"),
            Self::Surface | Self::Offset => Some("surface"),
            _ => None,
        }
    }

    /// Whether the column means something in this problem.
    pub fn is_known_to(self, problem: &Problem) -> bool {
        if matches!(self, Self::Frame | Self::Tilt(_)) {
            return problem.data.tilt_sigma.is_some();
        }
        self.declared_by()
            .is_none_or(|word| problem.fixtures.iter().any(|own| own.kind.word() == word))
    }

    /// What `problem.toml` lacks for a column of this name to mean anything, if it lacks something.
    pub fn undeclared(name: &str, problem: &Problem) -> Option<&'static str> {
        let tilts = name.strip_prefix("tilt_").is_some_and(|rest| rest.starts_with(['x', 'y']));
        let (role, write) = match name {
            "point" => (Self::Point, "[[point]]"),
            "anchor" => (Self::Anchor, "[[anchor]]"),
            "surface" => (Self::Surface, "[[surface]]"),
            _ if tilts => (Self::Tilt(0), "tilt_sigma_deg in [data]"),
            _ => return None,
        };
        (!role.is_known_to(problem)).then_some(write)
    }

    /// Whether it says what is measured rather than where or under which conditions.
    pub fn is_observed(self) -> bool {
        self.declared_by().is_some()
            || matches!(
                self,
                Self::Frame
                    | Self::Tilt(_)
                    | Self::Position(_)
                    | Self::Orientation(_)
                    | Self::Quaternion(_)
            )
    }

    /// Whether it is what a joint's encoder read.
    pub fn is_reading(self) -> bool {
        matches!(self, Self::Reading(_))
    }
}

/// Columns without a unit.
pub(super) const PLAIN: [(&str, Role); 13] = [
    ("nest", Role::Nest),
    ("split", Role::Split),
    ("session", Role::Session),
    ("target", Role::Target),
    ("pose", Role::Pose),
    ("point", Role::Point),
    ("anchor", Role::Anchor),
    ("surface", Role::Surface),
    ("frame", Role::Frame),
    ("qx", Role::Quaternion(0)),
    ("qy", Role::Quaternion(1)),
    ("qz", Role::Quaternion(2)),
    ("qw", Role::Quaternion(3)),
];

/// Columns with a unit, and whether they need one: a column such as `time` may be about something
/// else.
pub(super) const MEASURED: [(&str, Role, Unit, bool); 13] = [
    ("x", Role::Position(0), Unit::Length, true),
    ("y", Role::Position(1), Unit::Length, true),
    ("z", Role::Position(2), Unit::Length, true),
    ("sigma", Role::Sigma, Unit::Length, true),
    ("rx", Role::Orientation(0), Unit::Angle, true),
    ("ry", Role::Orientation(1), Unit::Angle, true),
    ("rz", Role::Orientation(2), Unit::Angle, true),
    ("distance", Role::Distance, Unit::Length, true),
    ("offset", Role::Offset, Unit::Length, true),
    ("payload", Role::Payload, Unit::Mass, false),
    ("hoist", Role::Hoist, Unit::Force, false),
    ("temperature", Role::Temperature, Unit::Temperature, false),
    ("time", Role::Time, Unit::Time, false),
];
