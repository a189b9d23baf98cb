//! Roles of columns and their names.

use crate::problem::Problem;
use crate::quantity::Unit;

/// Role of a column; joints and axes count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    Joint(usize),
    /// Encoder reading of a joint.
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
    /// Fixed point measured by a row without the arm.
    Nest,
    /// Covariate declared in `[data.covariates]`.
    Covariate(usize),
    /// Point that the target touches.
    Point,
    /// Anchor and measured distance to it.
    Anchor,
    Distance,
    /// Surface and measured distance from it.
    Surface,
    Offset,
    /// Frame and measured tilts of its x and y axes.
    Frame,
    Tilt(usize),
}

impl Role {
    /// Returns the table of `problem.toml` that must declare the fixtures of this column.
    fn declared_by(self) -> Option<&'static str> {
        match self {
            Self::Point => Some("point"),
            Self::Anchor | Self::Distance => Some("anchor"),
            Self::Surface | Self::Offset => Some("surface"),
            _ => None,
        }
    }

    /// Returns true if the column has a meaning in this problem.
    pub fn is_known_to(self, problem: &Problem) -> bool {
        if matches!(self, Self::Frame | Self::Tilt(_)) {
            return problem.data.kind_sigmas.contains_key("tilt");
        }
        self.declared_by()
            .is_none_or(|word| problem.fixtures.iter().any(|fixture| fixture.kind.word() == word))
    }

    /// Returns the missing declaration if a column of this name has no meaning in this problem.
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

    /// Returns true if the column holds measured values or what they refer to, false for
    /// configurations and conditions.
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

    /// Returns true for encoder readings.
    pub fn is_reading(self) -> bool {
        matches!(self, Self::Reading(_))
    }
}

/// Names of columns without a unit.
pub(super) const COLUMNS_WITHOUT_UNIT: [(&str, Role); 13] = [
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

/// Names of columns with a unit. The flag is true if a missing unit is an error; other names, such
/// as `time`, may mean something else.
pub(super) const COLUMNS_WITH_UNIT: [(&str, Role, Unit, bool); 13] = [
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
