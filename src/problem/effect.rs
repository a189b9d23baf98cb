//! An effect as declared.

use crate::error::Location;

/// One `[[effect]]` and where it stands in the file.
#[derive(Debug, Clone)]
pub struct EffectDeclaration {
    /// The effect.
    pub effect: Effect,
    /// For errors.
    pub location: Location,
}

/// An effect and its arguments; joints are numbered from 1, links go by the name of their beam.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "arguments carry the names of the file format")]
pub enum Effect {
    JointCompliance { joint: usize },
    JointHarmonic { joint: usize, orders: Vec<u32> },
    GearRatio { joint: usize },
    Backlash { joint: usize },
    JointNonlinearStiffness { joint: usize },
    JointLateralCompliance { joint: usize },
    JointThermalDrift { joint: usize },
    JointCoupling { joint: usize, from: usize },
    LinkBending { joint: usize },
    LinkThermalBending { link: String },
    LinkThermalExpansion { link: String },
    UnmodelledMass { link: String },
    PayloadMass,
    HoistForce,
    HoistDirection,
    BaseCompliance,
    GravityDirection,
    DeflectedEquilibrium,
    TrackerScale,
    TrackerDrift,
    StationShift { at_time: f64 },
}

impl Effect {
    /// Whether it follows the temperature.
    pub fn is_thermal(&self) -> bool {
        matches!(
            self,
            Self::JointThermalDrift { .. } | Self::LinkThermalBending { .. } | Self::LinkThermalExpansion { .. }
        )
    }
}
