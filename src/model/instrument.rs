//! What the measuring instrument makes of a position.

use nalgebra::Vector3;

use crate::model::parameter::{Driver, Parameter, Slot};
use crate::problem::PoseView;

/// Errors of the measuring instrument: p (1 + s) + Σ dᵢ·driverᵢ.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Instrument {
    /// s.
    pub scale: f64,
    /// Axis, driver and size [m per unit of the driver].
    shifts: Vec<(usize, Driver, f64)>,
}

impl Instrument {
    /// The same with the free parameters at the full parameter vector `x`.
    pub fn with(&self, parameters: &[Parameter], x: &[f64]) -> Self {
        let mut instrument = self.clone();
        for (parameter, &x) in parameters.iter().zip(x) {
            match parameter.slot {
                Slot::Scale => instrument.scale += x,
                Slot::Shift { axis } => instrument.shifts.push((axis, parameter.driver, x)),
                _ => {}
            }
        }
        instrument
    }

    /// What is measured of a position, measuring frame \[m\].
    #[inline]
    pub fn of(&self, position: &Vector3<f64>, setup: &PoseView) -> Vector3<f64> {
        let mut seen = position * (1.0 + self.scale);
        for &(axis, driver, size) in &self.shifts {
            seen[axis] += size * driver.value(setup);
        }
        seen
    }

    /// What the command of a joint, counted from 0, changes in the shifts \[m/rad\] or \[m/m\].
    pub fn slope(&self, setup: &PoseView, joint: usize) -> Vector3<f64> {
        let mut slope = Vector3::zeros();
        for &(axis, driver, size) in &self.shifts {
            slope[axis] += size * driver.slope(setup, joint);
        }
        slope
    }
}
