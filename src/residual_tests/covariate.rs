//! Quantities that are recorded for every pose and on which a residual may depend.

use std::fmt;
use std::sync::Arc;

use crate::laws::Quantity;
use crate::problem::Problem;

/// Quantity that is recorded for every pose and on which a residual may depend; joints are counted
/// from 0. Its `Display` is the name in files.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Covariate {
    /// Command q of a joint \[rad\], or \[m\] for a prismatic joint.
    Command(usize),
    /// Temperature of the pose [°C].
    Temperature,
    /// Mass of the payload \[kg\].
    Payload,
    /// Force of the hoist \[N\].
    Hoist,
    /// Time since the first pose \[s\].
    Time,
    /// Number of the row, used if no time was recorded.
    Row,
    /// Side from which a joint approached the pose, −1 to 1.
    Approach(usize),
    /// Forces and moments of the loads: payload and gravity.
    Load,
    /// Measured position of the target, measuring frame \[m\].
    Position,
    /// Velocities of the joints.
    Velocity,
    /// Covariate that the user declares, by the name of its column, in the column's unit.
    Declared(Arc<str>),
}

impl Covariate {
    /// Returns the covariates through which `quantity` varies. `is_recorded` states whether
    /// directions of approach are recorded, and whether times are. Without times, the row number
    /// replaces the time. Without directions of approach, friction varies with the command alone.
    pub fn of(quantity: Quantity, problem: &Problem, is_recorded: (bool, bool)) -> Vec<Self> {
        let (approach_known, time_measured) = is_recorded;
        match quantity {
            Quantity::Warming => vec![Self::Temperature],
            Quantity::Lagging { .. } => vec![Self::Temperature, Self::time(time_measured)],
            Quantity::Friction { joint, .. } if approach_known => {
                vec![Self::Command(joint), Self::Approach(joint)]
            }
            Quantity::Command(joint) | Quantity::Friction { joint, .. } => {
                vec![Self::Command(joint)]
            }
            Quantity::Payload => vec![Self::Payload],
            Quantity::Hoist => vec![Self::Hoist],
            Quantity::Elapsed | Quantity::Time => vec![Self::time(time_measured)],
            Quantity::Approach(joint) => vec![Self::Approach(joint)],
            Quantity::Moment(_) => vec![Self::Load],
            Quantity::Covariate(index) => vec![Self::declared(index, problem)],
        }
    }

    /// Returns the time if it is recorded (`measured`), else the row number.
    pub fn time(measured: bool) -> Self {
        if measured { Self::Time } else { Self::Row }
    }

    /// Returns the covariate that the problem declares with index `which`, counted from 0.
    pub fn declared(which: usize, problem: &Problem) -> Self {
        Self::Declared(
            problem.data.covariates.get(which).map_or("", |covariate| &covariate.name).into(),
        )
    }
}

impl fmt::Display for Covariate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Command(joint) => write!(f, "q{}", joint + 1),
            Self::Temperature => f.write_str("temperature"),
            Self::Payload => f.write_str("payload"),
            Self::Hoist => f.write_str("hoist"),
            Self::Time => f.write_str("time"),
            Self::Row => f.write_str("row"),
            Self::Approach(joint) => write!(f, "approach{}", joint + 1),
            Self::Load => f.write_str("load"),
            Self::Position => f.write_str("position"),
            Self::Velocity => f.write_str("velocity"),
            Self::Declared(name) => f.write_str(name),
        }
    }
}
