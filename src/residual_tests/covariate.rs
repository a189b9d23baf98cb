//! Known quantities of every pose on which a residual may depend.

use std::fmt;
use std::sync::Arc;

use crate::laws::Quantity;
use crate::problem::Problem;

/// Known quantity of every pose on which a residual may depend; joints are counted from 0. Its
/// `Display` is the name in files.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Covariate {
    /// Command q of a joint \[rad\] or, where it slides, \[m\].
    Command(usize),
    /// Temperature of the pose [°C].
    Temperature,
    /// Mass of the payload \[kg\].
    Payload,
    /// Force of the hoist \[N\].
    Hoist,
    /// Time since the first pose \[s\].
    Time,
    /// Number of the row, used where no time was measured.
    Row,
    /// Side from which a joint approached the pose, −1 to 1.
    Approach(usize),
    /// Forces and moments of the loads.
    Load,
    /// Measured position of the target.
    Position,
    /// Covariate that the user declares, by the name of its column, in its unit.
    Own(Arc<str>),
}

impl Covariate {
    /// Returns the covariates that a quantity follows; without measured times the order of the rows
    /// stands for them, and without directions of approach the commands do.
    pub fn of(quantity: Quantity, problem: &Problem, known: (bool, bool)) -> Vec<Self> {
        let (approach_known, time_measured) = known;
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
            Quantity::Covariate(index) => vec![Self::declared(index, problem)],
        }
    }

    /// Returns the measured time, or the order of the rows where it is not measured.
    pub fn time(measured: bool) -> Self {
        if measured { Self::Time } else { Self::Row }
    }

    /// Returns the covariate that the user declared under this number, from 0.
    pub fn declared(which: usize, problem: &Problem) -> Self {
        Self::Own(problem.data.covariates.get(which).map_or("", |covariate| &covariate.name).into())
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
            Self::Own(name) => f.write_str(name),
        }
    }
}
