//! Errors of the measuring instrument, and rotations of the bases under it.

use nalgebra::{Matrix3, Vector3};

use super::pose::Pose;
use crate::laws::RANGE_AXIS;
use crate::model::parameter::{Parameter, ParameterSite, Regressor, value_regressor};
use crate::observation::FixtureValues;
use crate::problem::PoseView;
use crate::spatial::Frame;

/// Error model of the measuring instrument.
///
/// A position p reads as p (1 + s) + E p + Σ dᵢ·regressorᵢ with displacements dᵢ. All bases rotate
/// about the measuring frame's origin by the rotation vector Σ ωᵢ·regressorᵢ. Numbers of cameras
/// change in the same way.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Instrument {
    /// Relative scale error s of the instrument: measured lengths are 1 + s times the true ones.
    pub scale: f64,
    /// Strain E of the measuring frame; `None` counts as zero.
    strain: Option<Matrix3<f64>>,
    /// Axis, regressor and size [m per unit of the regressor] of each displacement d of the
    /// readings. Axis [`RANGE_AXIS`] is the line of sight.
    shifts: Vec<(usize, Regressor, f64)>,
    /// Axis, regressor and size [rad per unit of the regressor] of each rotation ω.
    rotations: Vec<(usize, Regressor, f64)>,
    /// Fixture, index of its number, regressor and size of each change of a number of a fixture.
    fixtures: Vec<(usize, usize, Regressor, f64)>,
}

impl Instrument {
    /// Returns the instrument with the errors that the free parameters add at the full parameter
    /// vector `x`.
    pub fn with_parameters(&self, parameters: &[Parameter], x: &[f64]) -> Self {
        let mut instrument = self.clone();
        for (k, (parameter, &value)) in parameters.iter().zip(x).enumerate() {
            let regressor = || value_regressor(parameters, x, k);
            match parameter.site {
                ParameterSite::Scale => instrument.scale += value,
                ParameterSite::Strain { entry } => {
                    *instrument.strain.get_or_insert_with(Matrix3::zeros) +=
                        unit_strain(entry) * value;
                }
                ParameterSite::Shift { axis } => {
                    instrument.shifts.extend(regressor().map(|value_of| (axis, value_of, value)));
                }
                ParameterSite::FixtureShift { fixture, axis, count, .. } => {
                    for axis in axis..axis + count {
                        let of_number = |value_of| (fixture, axis, value_of, value);
                        instrument.fixtures.extend(regressor().map(of_number));
                    }
                }
                ParameterSite::Turn { axis } => {
                    instrument
                        .rotations
                        .extend(regressor().map(|value_of| (axis, value_of, value)));
                }
                _ => {}
            }
        }
        instrument
    }

    /// Returns two lists of (axis, regressor, size): displacements, then rotations.
    pub fn terms(&self) -> [&[(usize, Regressor, f64)]; 2] {
        [&self.shifts, &self.rotations]
    }

    /// Returns the six entries of the instrument's strain, in the order of
    /// [`ParameterSite::Strain`]; zeros without a strain.
    pub fn strain_entries(&self) -> [f64; 6] {
        self.strain.map_or([0.0; 6], |strain| STRAIN_ENTRIES.map(|place| strain[place]))
    }

    /// Returns the part of the instrument that displaces the arm itself, the motions of the bases,
    /// without errors of the readings.
    pub fn without_errors(&self) -> Self {
        let of_bases = |terms: &[(usize, Regressor, f64)]| {
            terms.iter().filter(|(_, regressor, _)| regressor.moves_base()).cloned().collect()
        };
        Self {
            scale: 0.0,
            strain: None,
            shifts: of_bases(&self.shifts),
            rotations: of_bases(&self.rotations),
            fixtures: Vec::new(),
        }
    }

    /// Returns the (at most two) fixtures that a row refers to, with the changes of their numbers in
    /// the row; the others are default. `values` are those without changes.
    #[inline]
    pub fn fixtures(&self, pose: &Pose, values: &[FixtureValues<f64>]) -> [FixtureValues<f64>; 2] {
        pose.observation.fixtures().map(|fixture| {
            let Some(fixture) = fixture else { return FixtureValues::default() };
            let mut found = values[fixture];
            for (of, axis, regressor, size) in &self.fixtures {
                if *of == fixture {
                    found.numbers[*axis] += size * regressor.value(&pose.setup);
                }
            }
            found
        })
    }

    /// Returns the reading of a position, measuring frame \[m\].
    #[inline]
    pub fn reading(&self, position: &Vector3<f64>, setup: &PoseView) -> Vector3<f64> {
        let mut reading = position * (1.0 + self.scale);
        if let Some(strain) = self.strain {
            reading += strain * position;
        }
        for (axis, regressor, size) in &self.shifts {
            reading += direction(*axis, position) * (size * regressor.value(setup));
        }
        reading
    }

    /// Returns the derivative of the reading of a position \[m\] with respect to a parameter at
    /// `site`, per unit; 0 for sites that are no error of the instrument.
    pub fn slope(
        site: ParameterSite,
        position: &Vector3<f64>,
        regressor: &Regressor,
        setup: &PoseView,
    ) -> Vector3<f64> {
        match site {
            ParameterSite::Scale => *position,
            ParameterSite::Strain { entry } => unit_strain(entry) * position,
            ParameterSite::Shift { axis } => direction(axis, position) * regressor.value(setup),
            _ => Vector3::zeros(),
        }
    }

    /// Returns the factor I + (E + ∂d/∂p) / (1 + s) that turns derivatives of (1 + s) times a
    /// position into those of its reading. Returns `None` if the factor is 1: without a strain and
    /// without a displacement d along the line of sight.
    pub fn reading_factor(
        &self,
        position: &Vector3<f64>,
        setup: &PoseView,
    ) -> Option<Matrix3<f64>> {
        let along = self.shifts.iter().filter(|(axis, ..)| *axis == RANGE_AXIS);
        let mut added = self.strain;
        for (_, regressor, size) in along {
            let sight = direction(RANGE_AXIS, position);
            let across = Matrix3::identity() - sight * sight.transpose();
            let turned = size * regressor.value(setup) / position.norm().max(f64::MIN_POSITIVE);
            *added.get_or_insert_with(Matrix3::zeros) += across * turned;
        }
        added.map(|added| Matrix3::identity() + added / (1.0 + self.scale))
    }

    /// Returns true if effects rotate the bases.
    pub fn rotates_bases(&self) -> bool {
        !self.rotations.is_empty()
    }

    /// Returns the rotation vector of all bases in a pose, measuring frame \[rad\].
    pub fn base_rotation(&self, setup: &PoseView) -> Vector3<f64> {
        sum_by_axis(&self.rotations, |regressor| regressor.value(setup))
    }

    /// Returns the frame of a base in a pose, measuring frame.
    #[inline]
    pub fn base_frame(&self, base: &Frame<f64>, setup: &PoseView) -> Frame<f64> {
        if self.rotates_bases() {
            Frame::from_rotation_vector(Vector3::zeros(), &self.base_rotation(setup)).compose(base)
        } else {
            *base
        }
    }
}

/// Returns the unit vector along which a displacement of readings acts: an axis of the measuring
/// frame, or the line of sight from the station at its origin.
fn direction(axis: usize, position: &Vector3<f64>) -> Vector3<f64> {
    if axis == RANGE_AXIS {
        position.try_normalize(0.0).unwrap_or_default()
    } else {
        Vector3::ith(axis.min(2), 1.0)
    }
}

/// Returns the vector whose entry for each axis is Σ size × value(regressor) over the terms of this
/// axis.
fn sum_by_axis(
    terms: &[(usize, Regressor, f64)],
    value: impl Fn(&Regressor) -> f64,
) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for (axis, regressor, size) in terms {
        if let Some(entry) = sum.get_mut(*axis) {
            *entry += size * value(regressor);
        }
    }
    sum
}

/// Row and column of each entry of a strain, in the order of [`ParameterSite::Strain`].
const STRAIN_ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Returns the derivative of E with respect to one of its entries, in the order of
/// [`ParameterSite::Strain`].
fn unit_strain(entry: usize) -> Matrix3<f64> {
    let mut matrix = Matrix3::zeros();
    if let Some(place) = STRAIN_ENTRIES.get(entry) {
        matrix[*place] = 1.0;
    }
    matrix
}
