//! Where in an arm structure is, and what it depends on.

use std::fmt;

use crate::model::parameter::{JointField, Quantity, Slot};
use crate::quantity::Unit;

/// What is known of every pose and a residual may depend on; joints are counted from 0. Its `Display` is the name in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
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
}

impl Covariate {
    /// Of a quantity; without measured times the order of the rows stands for them.
    pub fn of(quantity: Quantity, time_measured: bool) -> Self {
        match quantity {
            Quantity::Command(joint) => Self::Command(joint),
            Quantity::Temperature => Self::Temperature,
            Quantity::Payload => Self::Payload,
            Quantity::Hoist => Self::Hoist,
            Quantity::Elapsed if time_measured => Self::Time,
            Quantity::Elapsed => Self::Row,
        }
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
        }
    }
}

/// Where in an arm structure is; joints are counted from 0. Its `Display` is the name in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Place {
    /// A coordinate behind a joint's axis: θ, d or β.
    Joint {
        /// Which joint.
        joint: usize,
        /// Which coordinate.
        field: JointField,
    },
    /// A coordinate of the link before a joint: α or a.
    LinkBefore {
        /// Which joint.
        joint: usize,
        /// Which coordinate.
        field: JointField,
    },
    /// At no single coordinate.
    Nowhere,
}

impl Place {
    /// The place of a slot; only coordinates of joints and links are places.
    pub fn of(slot: Slot) -> Self {
        match slot {
            Slot::Joint { joint, field: field @ (JointField::Alpha | JointField::A) } => {
                Self::LinkBefore { joint, field }
            }
            Slot::Joint { joint, field } => Self::Joint { joint, field },
            _ => Self::Nowhere,
        }
    }

    /// Where that is in the model.
    pub fn slot(self) -> Option<Slot> {
        match self {
            Self::Joint { joint, field } | Self::LinkBefore { joint, field } => Some(Slot::Joint { joint, field }),
            Self::Nowhere => None,
        }
    }

    /// Unit of an error there: an angle or a length.
    pub fn unit(self) -> Option<Unit> {
        self.slot().map(Slot::unit)
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Joint { joint, .. } => write!(f, "joint {}", joint + 1),
            Self::LinkBefore { joint, .. } => write!(f, "link before joint {}", joint + 1),
            Self::Nowhere => f.write_str("nowhere in particular"),
        }
    }
}
