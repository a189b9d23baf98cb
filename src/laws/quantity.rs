//! Quantities that are known of every pose: the variables of formulas.

/// Variable of a formula; joints are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Quantity {
    /// Command q of a joint \[rad\] or \[m\], written `q3`.
    Command(usize),
    /// Temperature above the reference \[K\], written `T`; 0 where no temperature is known.
    Warming,
    /// Temperature above the reference \[K\] of a body that follows the air with a first-order lag,
    /// dT̃/dt = (T − T̃)/τ, written `lag(T, 300)`.
    Lagging {
        /// Time constant τ \[s\].
        time_constant: f64,
    },
    /// Share of its friction that holds a joint back on the path it came, −1 to 1, written
    /// `friction(q3, 0.8)` ([`Past::friction_state`](crate::problem::Past::friction_state)). \[Dahl 1968\]
    Friction {
        /// The joint.
        joint: usize,
        /// Distance over which the friction turns over \[rad\] or \[m\].
        distance: f64,
    },
    /// Time since the first pose of the session \[s\], written `t`.
    Elapsed,
    /// Time as in the table \[s\], or the row counted from 1 where no time was measured, written
    /// `time`.
    Time,
    /// Payload \[kg\], written `payload`; the declared one where a pose names none.
    Payload,
    /// Hoist force \[N\], written `hoist`; the declared one where a pose names none.
    Hoist,
    /// Direction from which a joint came, −1, 0 or +1, written `approach3`; 0 where unknown.
    Approach(usize),
    /// Covariate of the problem, counted from 0, in its unit; written as its column.
    Covariate(usize),
}

impl Quantity {
    /// Returns true if the value depends on the poses measured before.
    pub fn has_memory(self) -> bool {
        matches!(self, Self::Lagging { .. } | Self::Friction { .. })
    }

    /// Returns true if the value follows the temperature.
    pub fn is_thermal(self) -> bool {
        matches!(self, Self::Warming | Self::Lagging { .. })
    }

    /// Returns true if the value depends on the side from which a joint comes.
    pub fn has_sides(self) -> bool {
        matches!(self, Self::Approach(_) | Self::Friction { .. })
    }

    /// Returns true if the value follows the time or the order of the poses.
    pub fn follows_time(self) -> bool {
        matches!(self, Self::Elapsed | Self::Time) || self.has_memory()
    }

    /// Returns the joint, counted from 0, whose command changes the value.
    pub fn commanded_joint(self) -> Option<usize> {
        match self {
            Self::Command(joint) | Self::Friction { joint, .. } => Some(joint),
            _ => None,
        }
    }

    /// Returns the joint, counted from 0, that the quantity belongs to.
    pub fn joint(self) -> Option<usize> {
        match self {
            Self::Approach(joint) => Some(joint),
            other => other.commanded_joint(),
        }
    }
}
