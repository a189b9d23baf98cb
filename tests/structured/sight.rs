//! What a row measures besides positions, and against what.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use nalgebra::{Rotation3, Vector3};

use super::draw::Draw;

/// Quantity that a row measures, with the word of its fixture or frame.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sight {
    #[default]
    Position,
    Distance(String),
    Offset(String),
    /// Tilts of the x and y axes of `base`, `tool` or `joint<i>`.
    Tilt(String),
}

impl Sight {
    /// Returns the rank of the kind: summaries are of the first kind that there is.
    pub fn rank(&self) -> usize {
        match self {
            Self::Position => 0,
            Self::Distance(_) => 1,
            Self::Offset(_) => 2,
            Self::Tilt(_) => 3,
        }
    }
}

/// Thing in the measuring frame.
#[derive(Debug, Clone)]
pub enum Fixture {
    Anchor(Vector3<f64>),
    /// n·x = d with n = exp((rx, ry, 0)×) ẑ; rx, ry, d.
    Plane([f64; 3]),
    /// Centre and radius.
    Sphere([f64; 4]),
}

impl Fixture {
    /// Returns a number by the field of its parameter.
    pub fn field(&mut self, field: &str) -> Option<&mut f64> {
        let place = |fields: &[&str]| fields.iter().position(|name| *name == field);
        match self {
            Self::Anchor(at) => place(&["x", "y", "z"]).map(|k| &mut at[k]),
            Self::Plane(numbers) => place(&["rx", "ry", "d"]).map(|k| &mut numbers[k]),
            Self::Sphere(numbers) => place(&["x", "y", "z", "radius"]).map(|k| &mut numbers[k]),
        }
    }

    /// Returns the distance of a point from the fixture.
    pub fn distance(&self, x: &Vector3<f64>) -> f64 {
        match self {
            Self::Anchor(at) => (x - at).norm(),
            Self::Plane([rx, ry, d]) => {
                let normal =
                    Rotation3::from_scaled_axis(Vector3::new(*rx, *ry, 0.0)) * Vector3::z();
                normal.dot(x) - d
            }
            Self::Sphere([a, b, c, radius]) => (x - Vector3::new(*a, *b, *c)).norm() - radius,
        }
    }
}

/// Draws fixtures; returns them by name, and their sections.
pub fn fixtures(draw: &mut Draw) -> (BTreeMap<String, Fixture>, String) {
    let mut text = String::new();
    let mut all = BTreeMap::new();
    for name in ["wire", "bar"] {
        let at = draw.vector(3.0);
        let _ = writeln!(
            text,
            "[[anchor]]\nname = \"{name}\"\nat_m = [{:?}, {:?}, {:?}]",
            at.x, at.y, at.z
        );
        all.insert(name.to_owned(), Fixture::Anchor(at));
    }
    let at = draw.vector(1.0);
    let turn = Vector3::new(draw.number(-1.5, 1.5), draw.number(-1.5, 1.5), 0.0);
    let normal = Rotation3::from_scaled_axis(turn) * Vector3::z();
    let _ = writeln!(
        text,
        "[[surface]]\nname = \"table\"\nkind = \"plane\"\nnormal = [{:?}, {:?}, {:?}]\nat_m = [{:?}, {:?}, {:?}]",
        normal.x, normal.y, normal.z, at.x, at.y, at.z
    );
    all.insert("table".to_owned(), Fixture::Plane([turn.x, turn.y, normal.dot(&at)]));
    let (at, radius) = (draw.vector(1.0), draw.number(0.05, 0.3));
    let _ = writeln!(
        text,
        "[[surface]]\nname = \"globe\"\nkind = \"sphere\"\nat_m = [{:?}, {:?}, {:?}]\nradius_m = {radius:?}",
        at.x, at.y, at.z
    );
    all.insert("globe".to_owned(), Fixture::Sphere([at.x, at.y, at.z, radius]));
    (all, text)
}

/// Draws what a row measures.
pub fn drawn(draw: &mut Draw, joints: usize) -> Sight {
    match draw.whole(0, 9) {
        0 | 1 => Sight::Distance(draw.pick(&["wire", "bar"]).to_owned()),
        2 | 3 => Sight::Offset(draw.pick(&["table", "globe"]).to_owned()),
        4 | 5 => {
            let joint = format!("joint{}", draw.whole(1, joints));
            Sight::Tilt(draw.pick(&["base".to_owned(), "tool".to_owned(), joint]))
        }
        _ => Sight::Position,
    }
}
