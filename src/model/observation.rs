//! What a row of each kind is predicted to measure, from where the target is and where the fixtures
//! are.

use nalgebra::{Matrix3, Matrix3x4, Vector3};
use num_dual::DualSVec64;

use crate::problem::{Fixture, FixtureKind};
use crate::scalar::{Scalar, gradient, seeded};
use crate::spatial::plane_normal;

/// Most numbers of a fixture.
const NUMBERS: usize = 4;
/// What a prediction is differentiated by: the target's three coordinates, then the fixture's
/// numbers.
const INPUTS: usize = 3 + NUMBERS;

/// A fixture at some parameters: its numbers in the order of [`FixtureKind::fields`], SI, measuring
/// frame; 0 behind the last.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FixtureValues<S> {
    pub kind: FixtureKind,
    pub numbers: [S; NUMBERS],
}

/// Derivatives of what a row measures: by the target's position, and by the fixture's numbers.
pub(super) struct Slopes {
    pub seen: Vector3<f64>,
    pub by_target: Matrix3<f64>,
    pub by_fixture: Matrix3x4<f64>,
}

impl FixtureValues<f64> {
    /// As declared, 0 where nothing is known.
    pub fn declared(fixture: &Fixture) -> Self {
        let mut numbers = [0.0; NUMBERS];
        for (number, known) in numbers.iter_mut().zip(&fixture.known) {
            *number = known.unwrap_or(0.0);
        }
        Self { kind: fixture.kind, numbers }
    }

    /// Its first three numbers.
    pub fn place(&self) -> Vector3<f64> {
        let [x, y, z, _] = self.numbers;
        Vector3::new(x, y, z)
    }

    /// What is seen of it from the target's `position` \[m\], with all derivatives.
    pub(super) fn slopes(&self, position: &Vector3<f64>) -> Slopes {
        let position = Vector3::from_fn(|i, _| seeded::<INPUTS>(position[i], Some(i)));
        let numbers = std::array::from_fn(|k| seeded::<INPUTS>(self.numbers[k], Some(3 + k)));
        let seen: Vector3<DualSVec64<INPUTS>> =
            FixtureValues { kind: self.kind, numbers }.seen(&position);
        let by = [gradient(&seen.x), gradient(&seen.y), gradient(&seen.z)];
        Slopes {
            seen: seen.map(|own| own.re),
            by_target: Matrix3::from_fn(|i, j| by[i][j]),
            by_fixture: Matrix3x4::from_fn(|i, j| by[i][3 + j]),
        }
    }
}

/// Distance \[m\] between two points, and its derivatives: by the second as the target, by the
/// first as the fixture.
pub(super) fn between(first: &FixtureValues<f64>, second: &FixtureValues<f64>) -> Slopes {
    FixtureValues { kind: FixtureKind::Anchor, ..*first }.slopes(&second.place())
}

impl<S: Scalar> FixtureValues<S> {
    /// What is seen of the fixture from the target's `position` \[m\], measuring frame; zeros
    /// behind the numbers that there are.
    ///
    /// - point P: x − P, which is 0 in the socket
    /// - anchor A: ‖x − A‖
    /// - plane: n·x − d with n of [`plane_normal`]
    /// - sphere of centre C and radius ρ: ‖x − C‖ − ρ
    pub fn seen(&self, position: &Vector3<S>) -> Vector3<S> {
        let zero = S::from(0.0);
        let [x, y, z, radius] = self.numbers;
        let only = |value: S| Vector3::new(value, zero, zero);
        let centre = Vector3::new(x, y, z);
        match self.kind {
            FixtureKind::Point => position - centre,
            FixtureKind::Anchor => only(length(&(position - centre))),
            FixtureKind::Sphere => only(length(&(position - centre)) - radius),
            FixtureKind::Plane => only(plane_normal(x, y).dot(position) - z),
        }
    }
}

/// Squared length below which a direction is none \[m²\].
const NO_LENGTH: f64 = 1e-24;

/// Length, with a derivative of 0 where there is none.
fn length<S: Scalar>(of: &Vector3<S>) -> S {
    (of.x * of.x + of.y * of.y + of.z * of.z + NO_LENGTH).sqrt()
}
