//! Kinds of measured rows: one file each, with its columns, units and words, and its prediction,
//! generic over the scalar.
//!
//! A new sensor needs a file with a `KIND` and a `predict`, and a line in the table below. A
//! prediction uses only a `Scene`, which the model fills in. The model then propagates its
//! derivatives to the free parameters.

mod distance;
mod fixture;
mod kind;
mod known_distance;
mod lens;
mod pixel;
mod point;
mod position;
mod scene;
mod surface;
mod tilt;

pub(crate) use fixture::{FixtureKind, FixtureValues, MAX_FIXTURE_NUMBERS};
pub use kind::Kind;
pub(crate) use kind::{Content, Field, Needs};
pub(crate) use lens::slopes_of_pixel;
pub(crate) use scene::Scene;

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use crate::quantity::Unit;
use crate::scalar::{Scalar, gradient, seeded};
use crate::spatial::{Frame, rotate};

/// Predicted numbers of a row and their first derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Slopes {
    /// Predicted numbers, padded with zeros, in the units of the observation.
    pub value: Vector3<f64>,
    /// Derivative with respect to the position of the target, or of the point of the second
    /// fixture.
    pub by_target: Matrix3<f64>,
    /// Derivative with respect to a small rotation of the base's axes, measuring frame [1/rad].
    pub by_base: Matrix3<f64>,
    /// Derivatives with respect to the numbers of the fixtures.
    pub by_fixtures: [SMatrix<f64, 3, MAX_FIXTURE_NUMBERS>; 2],
}

/// Number of input scalars before those of the fixtures: 3 for the position of the target, 3 for
/// the rotation of the base.
const INPUTS_BEFORE_FIXTURES: usize = 6;
/// Number of input scalars of a prediction with two fixtures of at most four numbers.
const INPUTS: usize = INPUTS_BEFORE_FIXTURES + 8;
/// Number of input scalars of a prediction with two fixtures of any kind.
const ALL_INPUTS: usize = INPUTS_BEFORE_FIXTURES + 2 * MAX_FIXTURE_NUMBERS;

/// Declares [`Observation`] and forwards each variant to the file of its kind.
macro_rules! observations {
    ($($(#[$doc:meta])* $variant:ident $(($($index:ident: $type:ty),+))? => $kind:ident,)+) => {
        /// Quantity measured by a row. Fixtures are counted from 0, in the order of
        /// `Problem::fixtures`.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
        pub enum Observation {
            $($(#[$doc])* $variant $(($($type),+))?,)+
        }

        /// All kinds of rows, in the order of [`Observation`].
        const KINDS: &[&Kind] = &[$(&$kind::KIND),+];

        impl Observation {
            /// Returns the columns, units and words of this kind of rows.
            pub fn description(self) -> &'static Kind {
                match self { $(Self::$variant { .. } => &$kind::KIND,)+ }
            }

            /// Returns the predicted numbers of a row \[m\], \[rad\] or \[px\], followed by
            /// zeros.
            #[inline]
            pub fn predict<S: Scalar>(self, scene: &Scene<S>) -> Vector3<S> {
                match self { $(Self::$variant { .. } => $kind::predict(scene),)+ }
            }

            /// Creates the observation of a kind from its indices, in the order of the kind's
            /// references; `None` if an index is missing or too large.
            pub(crate) fn new(kind: &Kind, indices: &[usize]) -> Option<Self> {
                let mut indices = indices.iter();
                $(if kind.name == $kind::KIND.name {
                    return Some(Self::$variant $(($(<$type>::try_from(*indices.next()?).ok()?),+))?);
                })+
                None
            }

            /// Returns the indices that the variant contains, in order; `None` for missing ones.
            fn indices(self) -> [Option<usize>; 3] {
                match self {
                    $(Self::$variant $(($($index),+))? => padded(&[$($($index as usize),+)?]),)+
                }
            }
        }
    };
}

observations! {
    /// Position of the target, measuring frame: three numbers, six with its orientation.
    #[default]
    Position => position,
    /// Contact of the target with a point.
    Point(fixture: usize) => point,
    /// Distance from the target to an anchor.
    Distance(fixture: usize) => distance,
    /// Distance of the target from a surface, 0 in contact.
    Surface(fixture: usize) => surface,
    /// Tilts of the x and the y axis of a frame against the horizontal. Frame 0 is the arm's base,
    /// frame i that of joint i.
    Tilt(frame: usize) => tilt,
    /// Known distance between two points, independent of the arm. The narrow integers keep the enum
    /// small.
    Between(first: u32, second: u32) => known_distance,
    /// Pixel of a numbered point of a marker in the image of a camera.
    Pixel(camera: u32, marker: u32, point: u32) => pixel,
}

/// Returns up to three indices, padded with `None`.
fn padded(indices: &[usize]) -> [Option<usize>; 3] {
    std::array::from_fn(|k| indices.get(k).copied())
}

/// Returns the kind of rows called `name`; positions if no kind has this name.
pub(crate) fn kind_named(name: &str) -> &'static Kind {
    kinds().find(|kind| kind.name == name).unwrap_or(&position::KIND)
}

/// Returns all kinds of rows, in the order of [`Observation`].
pub(crate) fn kinds() -> impl Iterator<Item = &'static Kind> {
    KINDS.iter().copied()
}

/// Returns the columns of all kinds of rows, in the order of [`Observation`].
pub(crate) fn fields() -> impl Iterator<Item = &'static Field> {
    kinds().flat_map(|kind| kind.fields)
}

impl Observation {
    /// Returns the columns that name the row's fixtures or frame, each with its index.
    pub(crate) fn references(self) -> impl Iterator<Item = (&'static Field, usize)> {
        let fields = self.description().references();
        fields.zip(self.indices()).filter_map(|(field, index)| Some((field, index?)))
    }

    /// Returns the number of scalars that a row measures, without an orientation.
    pub fn coordinates(self) -> usize {
        self.description().numbers
    }

    /// Returns √k for a row of k measured scalars ([`Observation::coordinates`]), the expected norm
    /// of a whitened residual.
    pub(crate) fn expected_norm(self) -> f64 {
        (self.coordinates() as f64).sqrt()
    }

    /// Returns the name of the kind in files and results.
    pub fn kind(self) -> &'static str {
        self.description().name
    }

    /// Returns the index of the fixture against which the row measures the arm: a point, an anchor,
    /// a surface or a camera. Returns `None` for positions, tilts and known distances.
    pub fn fixture(self) -> Option<usize> {
        self.fixtures()[0].filter(|_| self.is_of_arm())
    }

    /// Returns the indices of the fixtures that the row refers to; `None` for missing ones.
    pub fn fixtures(self) -> [Option<usize>; 2] {
        let [first, second, _] = self.indices();
        if self.description().needs == Needs::Frame { [None; 2] } else { [first, second] }
    }

    /// Returns the index of the point of the second fixture, from 0, if the row names one.
    pub(crate) fn point(self) -> Option<usize> {
        self.indices()[2]
    }

    /// Returns a sort key of four numbers, which two observations share only if they are equal.
    pub(crate) fn sort_key(self) -> [usize; 4] {
        let kind = kinds().take_while(|kind| kind.name != self.kind()).count();
        let [first, second, third] = self.indices().map(|index| index.map_or(0, |index| index + 1));
        [kind, first, second, third]
    }

    /// Returns true if the row measures a position, a distance or a contact of the arm's target.
    pub(crate) fn measures_length(self) -> bool {
        self.is_of_arm() && self.description().unit == Unit::Length
    }

    /// Returns true if the spread of the measured numbers shows how far the arm moves. It is false
    /// for contacts and for distances to fixtures.
    pub(crate) fn is_measured_directly(self) -> bool {
        self.is_position() || self.description().needs != Needs::Target
    }

    /// Returns true if the row measures a position in the measuring frame.
    pub fn is_position(self) -> bool {
        self == Self::Position
    }

    /// Returns true if the row measures a position of the target: in the measuring frame, or as the
    /// contact with a point.
    pub fn is_of_position(self) -> bool {
        self.is_position() || self.is_point()
    }

    /// Returns true if the target touches a point. Its residual is resolved in the axes of the
    /// arm's base, so that it does not depend on the pose of arm and point together.
    pub fn is_point(self) -> bool {
        matches!(self, Self::Point(_))
    }

    /// Returns true if the prediction depends on the arm's configuration.
    pub fn is_of_arm(self) -> bool {
        self.description().needs != Needs::Fixtures
    }

    /// Returns the frame whose tilt is measured: 0 is the base, i that of joint i. Returns 0 for
    /// other rows.
    pub(crate) fn frame(self) -> usize {
        self.indices()[0].filter(|_| self.description().needs == Needs::Frame).unwrap_or(0)
    }

    /// Returns the predicted numbers of a row with their derivatives with respect to the position
    /// of the target (or of the point of the second fixture), a small rotation of the base, and the
    /// numbers of the fixtures.
    pub(crate) fn slopes(self, scene: &Scene<f64>) -> Slopes {
        if self.description().needs == Needs::Carriers {
            self.slopes_of::<ALL_INPUTS>(scene)
        } else {
            self.slopes_of::<INPUTS>(scene)
        }
    }

    fn slopes_of<const N: usize>(self, scene: &Scene<f64>) -> Slopes {
        let seed = |value: f64, k: usize| seeded::<N>(value, Some(k));
        let turn = Vector3::from_fn(|i, _| seed(0.0, 3 + i));
        let per_fixture = (N - INPUTS_BEFORE_FIXTURES) / 2;
        let starts = [0, 1].map(|k| INPUTS_BEFORE_FIXTURES + k * per_fixture);
        let fixture = |k: usize| FixtureValues {
            kind: scene.fixtures[k].kind,
            numbers: std::array::from_fn(|axis| {
                let direction = (axis < per_fixture).then_some(starts[k] + axis);
                seeded(scene.fixtures[k].numbers[axis], direction)
            }),
        };
        let seeded_position =
            |position: &Vector3<f64>| Vector3::from_fn(|i, _| seed(position[i], i));
        let lifted = |frame: &Frame<f64>| Frame {
            axes: frame.axes.map(|axis| axis.map(Into::into)),
            origin: frame.origin.map(Into::into),
        };
        let [first, second] = scene.carriers.each_ref().map(lifted);
        let second = Frame { origin: seeded_position(&scene.carriers[1].origin), ..second };
        let predicted = self.predict(&Scene {
            target: seeded_position(&scene.target),
            base: scene.base.map(|axis| rotate(&turn, &axis.map(Into::into))),
            fixtures: [fixture(0), fixture(1)],
            carriers: [first, second],
            point: scene.point.map(Into::into),
            ..Scene::default()
        });
        let rows: [SVector<f64, N>; 3] = std::array::from_fn(|i| gradient(&predicted[i]));
        let by_number = |start: usize| {
            SMatrix::from_fn(|i, j| if j < per_fixture { rows[i][start + j] } else { 0.0 })
        };
        Slopes {
            value: predicted.map(|number| number.re),
            by_target: Matrix3::from_fn(|i, j| rows[i][j]),
            by_base: Matrix3::from_fn(|i, j| rows[i][3 + j]),
            by_fixtures: starts.map(by_number),
        }
    }
}
