//! Quantities of a pose: the variables of formulas.

/// Variable of a formula; joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Quantity {
    /// Command q of a joint \[rad\] or \[m\], written `q3`.
    Command(usize),
    /// Temperature above the reference \[K\], written `T`; 0 if no temperature is recorded.
    Warming,
    /// Temperature above the reference \[K\] of a body that follows the air with a first-order lag,
    /// dT̃/dt = (T − T̃)/τ, written `lag(T, 300)`.
    Lagging {
        /// Time constant τ \[s\].
        time_constant: f64,
    },
    /// Friction state of a joint: share of its friction that opposes its approach, −1 to 1, written
    /// `friction(q3, 0.8)` (`Past::friction_state`). \[Dahl 1968\]
    Friction {
        /// Index of the joint.
        joint: usize,
        /// Distance over which the friction reverses \[rad\] or \[m\].
        distance: f64,
    },
    /// Time since the first pose of the session \[s\], written `t`.
    Elapsed,
    /// Time as in the table \[s\], written `time`; the number of the row, counted from 0, if no
    /// time is recorded.
    Time,
    /// Payload \[kg\], written `payload`; the declared one in a pose that records none.
    Payload,
    /// Hoist force \[N\], written `hoist`; the declared one in a pose that records none.
    Hoist,
    /// Direction from which a joint approached, −1, 0 or +1, written `approach3`; 0 if not
    /// recorded.
    Approach(usize),
    /// Moment about the axis of a joint of all loads beyond it, on the undeflected arm [N·m],
    /// written `M3`. Fitted errors of the loads are included.
    Moment(usize),
    /// Covariate of the problem, counted from 0, in its unit; written as the name of its column.
    Covariate(usize),
}

impl Quantity {
    /// Returns true if the value depends on earlier poses.
    pub fn has_memory(self) -> bool {
        matches!(self, Self::Lagging { .. } | Self::Friction { .. })
    }

    /// Returns true if the value depends on the temperature.
    pub fn is_thermal(self) -> bool {
        matches!(self, Self::Warming | Self::Lagging { .. })
    }

    /// Returns the joint, counted from 0, on whose direction of approach the value depends; `None`
    /// if there is none.
    pub fn sided_joint(self) -> Option<usize> {
        match self {
            Self::Approach(joint) | Self::Friction { joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// Returns true if the value depends on the time or the order of the poses.
    pub fn follows_time(self) -> bool {
        matches!(self, Self::Elapsed | Self::Time) || self.has_memory()
    }

    /// Returns the joint, counted from 0, whose command determines the value; `None` if there is
    /// none.
    pub fn commanded_joint(self) -> Option<usize> {
        match self {
            Self::Command(joint) | Self::Friction { joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// Returns the joint, counted from 0, to which the quantity belongs; `None` if there is none.
    pub fn joint(self) -> Option<usize> {
        match self {
            Self::Approach(joint) | Self::Moment(joint) => Some(joint),
            other => other.commanded_joint(),
        }
    }
}
