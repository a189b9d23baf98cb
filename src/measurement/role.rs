//! Roles of columns and their names.

use crate::observation::{Content, Field, Kind, fields, kinds};
use crate::problem::{Fixture, Problem};
use crate::quantity::Unit;

/// Role of a column, the quantity that it contains; joints and axes count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Command of a joint.
    Joint(usize),
    /// Encoder reading of a joint.
    Reading(usize),
    /// Column of a kind of rows, given by its name without unit: a measured number or the name of a
    /// fixture.
    Field(&'static str),
    /// Standard deviation of the noise.
    Sigma,
    Payload,
    Hoist,
    Temperature,
    Time,
    /// Direction from which a joint approached.
    Approach(usize),
    /// Velocity of a joint.
    Velocity(usize),
    /// Angle rx, ry or rz of an orientation.
    Orientation(usize),
    /// Component qx, qy, qz or qw of an orientation.
    Quaternion(usize),
    /// Mark of held-out rows.
    Split,
    Session,
    Target,
    /// Number or name of the pose.
    Pose,
    /// Fixed point that a row measures without the arm.
    Nest,
    /// Covariate declared in `[data.covariates]`.
    Covariate(usize),
}

/// Roles of the coordinates of a measured position.
pub(super) const POSITION: [Role; 3] = [Role::Field("x"), Role::Field("y"), Role::Field("z")];
/// Role of the column that names the touched point. The name of the file may replace the column.
pub(super) const POINT: Role = Role::Field("point");

/// Returns true if the problem declares the fixtures that rows of a kind are measured against, or
/// the standard deviation for a kind without fixtures.
pub(super) fn is_declared(kind: &Kind, problem: &Problem) -> bool {
    let is_fixture = |word: &str| problem.fixtures.iter().any(|known| known.kind.word() == word);
    let mut fixtures =
        kind.references().filter(|field| field.content == Content::Fixture).peekable();
    match fixtures.peek() {
        _ if kind.declared_by.is_empty() => true,
        Some(_) => fixtures.all(|field| is_fixture(field.name)),
        None => problem.data.kind_sigmas.contains_key(kind.name),
    }
}

/// Returns the index of the only camera or marker that the problem declares, if the column `field`
/// names cameras or markers: a table may lack the column then.
pub(super) fn only_fixture(field: &Field, problem: &Problem) -> Option<usize> {
    let is_one = |known: &Fixture| known.kind.word() == field.name && known.kind.has_pose();
    let mut all = problem.fixtures.iter().enumerate().filter(|(_, known)| is_one(known));
    let (index, _) = all.next().filter(|_| field.content == Content::Fixture)?;
    all.next().is_none().then_some(index)
}

impl Role {
    /// Returns true if the column has a meaning in this problem.
    pub fn is_known_to(self, problem: &Problem) -> bool {
        let Self::Field(name) = self else { return true };
        kinds().any(|kind| kind.field(name).is_some() && is_declared(kind, problem))
    }

    /// Returns the section of a problem that is missing for a column with this name to have a
    /// meaning; `None` if none is missing.
    ///
    /// The column names a fixture, or contains a measured number of a kind of rows without
    /// fixtures.
    pub fn undeclared(name: &str, problem: &Problem) -> Option<&'static str> {
        let announces = |kind: &&Kind| {
            let has_fixture = kind.fields.iter().any(|field| field.content == Content::Fixture);
            kind.fields.iter().any(|field| match field.content {
                Content::Fixture => field.name == name,
                _ => !has_fixture && field.unit().is_some() && name.starts_with(field.name),
            })
        };
        let mut kinds = kinds().filter(|kind| !kind.declared_by.is_empty());
        let kind = kinds.find(announces)?;
        (!is_declared(kind, problem)).then_some(kind.declared_by)
    }

    /// Returns true if the column contains measured values or names of fixtures, false for
    /// configurations and conditions.
    pub fn is_observed(self) -> bool {
        matches!(self, Self::Field(_)) || self.is_orientation()
    }

    /// Returns true for a coordinate of an orientation.
    pub fn is_orientation(self) -> bool {
        matches!(self, Self::Orientation(_) | Self::Quaternion(_))
    }

    /// Returns true for encoder readings.
    pub fn is_reading(self) -> bool {
        matches!(self, Self::Reading(_))
    }
}

/// Returns the names and roles of columns without a unit.
pub(super) fn columns_without_unit() -> impl Iterator<Item = (&'static str, Role)> {
    let references = fields().filter(|field| field.unit().is_none());
    references.map(|field| (field.name, Role::Field(field.name))).chain([
        ("nest", Role::Nest),
        ("split", Role::Split),
        ("session", Role::Session),
        ("target", Role::Target),
        ("pose", Role::Pose),
        ("qx", Role::Quaternion(0)),
        ("qy", Role::Quaternion(1)),
        ("qz", Role::Quaternion(2)),
        ("qw", Role::Quaternion(3)),
    ])
}

/// Returns name, role and quantity of columns with a unit. The flag is true if a name without unit
/// is an error; other names, such as `time`, may mean another quantity.
pub(super) fn columns_with_unit() -> impl Iterator<Item = (&'static str, Role, Unit, bool)> {
    let measured = fields()
        .filter_map(|field| Some((field.name, Role::Field(field.name), field.unit()?, true)));
    measured.chain([
        ("sigma", Role::Sigma, Unit::Length, true),
        ("rx", Role::Orientation(0), Unit::Angle, true),
        ("ry", Role::Orientation(1), Unit::Angle, true),
        ("rz", Role::Orientation(2), Unit::Angle, true),
        ("payload", Role::Payload, Unit::Mass, false),
        ("hoist", Role::Hoist, Unit::Force, false),
        ("temperature", Role::Temperature, Unit::Temperature, false),
        ("time", Role::Time, Unit::Time, false),
    ])
}
