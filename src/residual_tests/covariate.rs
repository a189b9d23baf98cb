//! What is known of every pose and a residual may depend on.

use std::fmt;
use std::sync::Arc;

use crate::model::parameter::Quantity;
use crate::problem::Problem;

/// What is known of every pose and a residual may depend on; joints are counted from 0. Its
/// `Display` is the name in files.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Covariate {
    /// q of a joint \[rad\] or, where it slides, \[m\].
    Command(usize),
    /// Temperature [°C].
    Temperature,
    /// Payload \[kg\].
    Payload,
    /// Hoist force \[N\].
    Hoist,
    /// Time since the first pose \[s\].
    Time,
    /// Number of the row, where no time was measured.
    Row,
    /// Side from which a joint came, −1 to 1.
    Approach(usize),
    /// Forces and moments of the loads.
    Load,
    /// Measured position.
    Position,
    /// One of the problem's own covariates, by the name of its column, in its unit.
    Own(Arc<str>),
}

impl Covariate {
    /// Of a quantity; without measured times the order of the rows stands for them.
    pub fn of(quantity: Quantity, problem: &Problem, time_measured: bool) -> Self {
        match quantity {
            Quantity::Command(joint) => Self::Command(joint),
            Quantity::Temperature => Self::Temperature,
            Quantity::Payload => Self::Payload,
            Quantity::Hoist => Self::Hoist,
            Quantity::Elapsed if time_measured => Self::Time,
            Quantity::Elapsed => Self::Row,
            Quantity::Covariate(which) => Self::own(which, problem),
        }
    }

    /// The problem's own covariate of that number, from 0.
    pub fn own(which: usize, problem: &Problem) -> Self {
        Self::Own(problem.data.covariates.get(which).map_or("", |own| &own.name).into())
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
