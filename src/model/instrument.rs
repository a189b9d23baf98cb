//! What the measuring instrument makes of a position, and what turns under it.

use nalgebra::{Matrix3, Vector3};

use crate::model::parameter::{Parameter, ParameterSite, Regressor};
use crate::problem::PoseView;
use crate::spatial::Frame;

/// Errors of the measuring instrument: p (1 + s) + E p + Σ dᵢ·driverᵢ; and turns of all bases by
/// the rotation vector Σ ωᵢ·driverᵢ, about the measuring frame's origin.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Instrument {
    /// s.
    pub scale: f64,
    /// E; `None` where nobody asks.
    strain: Option<Matrix3<f64>>,
    /// Axis, regressor and size [m per unit of the regressor].
    shifts: Vec<(usize, Regressor, f64)>,
    /// The same of turns [rad per unit of the regressor].
    turns: Vec<(usize, Regressor, f64)>,
}

impl Instrument {
    /// The same with the free parameters at the full parameter vector `x`.
    pub fn with(&self, parameters: &[Parameter], x: &[f64]) -> Self {
        let mut instrument = self.clone();
        for (parameter, &x) in parameters.iter().zip(x) {
            match parameter.site {
                ParameterSite::Scale => instrument.scale += x,
                ParameterSite::Strain { entry } => {
                    *instrument.strain.get_or_insert_with(Matrix3::zeros) += strained(entry) * x;
                }
                ParameterSite::Shift { axis } => {
                    instrument.shifts.push((axis, parameter.regressor, x))
                }
                ParameterSite::Turn { axis } => {
                    instrument.turns.push((axis, parameter.regressor, x))
                }
                _ => {}
            }
        }
        instrument
    }

    /// What is true of the arm's surroundings: bases that move with covariates, and no errors of
    /// the instrument.
    pub fn without_instrument_errors(&self) -> Self {
        let moves = |all: &[(usize, Regressor, f64)]| {
            all.iter()
                .filter(|(_, regressor, _)| matches!(regressor, Regressor::Covariate(_)))
                .copied()
                .collect()
        };
        Self { scale: 0.0, strain: None, shifts: moves(&self.shifts), turns: moves(&self.turns) }
    }

    /// What is measured of a position, measuring frame \[m\].
    #[inline]
    pub fn of(&self, position: &Vector3<f64>, setup: &PoseView) -> Vector3<f64> {
        let mut seen = position * (1.0 + self.scale);
        if let Some(strain) = self.strain {
            seen += strain * position;
        }
        for &(axis, regressor, size) in &self.shifts {
            seen[axis] += size * regressor.value(setup);
        }
        seen
    }

    /// What the strain makes of derivatives that the scale is already in; `None` where there is
    /// none.
    pub fn strains(&self) -> Option<Matrix3<f64>> {
        self.strain.map(|strain| Matrix3::identity() + strain / (1.0 + self.scale))
    }

    /// Whether bases turn.
    pub fn turns(&self) -> bool {
        !self.turns.is_empty()
    }

    /// By how much bases turn in a pose, a rotation vector, measuring frame \[rad\].
    pub fn turn(&self, setup: &PoseView) -> Vector3<f64> {
        let mut turn = Vector3::zeros();
        for &(axis, regressor, size) in &self.turns {
            turn[axis] += size * regressor.value(setup);
        }
        turn
    }

    /// A base in a pose, measuring frame.
    #[inline]
    pub fn base(&self, base: &Frame<f64>, setup: &PoseView) -> Frame<f64> {
        if self.turns() {
            Frame::from_rotation_vector(Vector3::zeros(), &self.turn(setup)).compose(base)
        } else {
            *base
        }
    }

    /// What the command of a joint, counted from 0, changes in the shifts \[m/rad\] or \[m/m\].
    pub fn slope(&self, setup: &PoseView, joint: usize) -> Vector3<f64> {
        let mut slope = Vector3::zeros();
        for &(axis, regressor, size) in &self.shifts {
            slope[axis] += size * regressor.slope(setup, joint);
        }
        slope
    }
}

/// ∂E by one of its entries, in the order of [`ParameterSite::Strain`].
pub(super) fn strained(entry: usize) -> Matrix3<f64> {
    const PLACES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
    let mut matrix = Matrix3::zeros();
    if let Some(place) = PLACES.get(entry) {
        matrix[*place] = 1.0;
    }
    matrix
}
