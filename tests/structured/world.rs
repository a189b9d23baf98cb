//! Values of all parameters of a case, and what is measured with them.

use std::collections::BTreeMap;

use nalgebra::{Matrix4, Vector3};

use super::arm::{Arm, Geometry, placed, point};
use super::effect::Effect;
use super::row::Row;
use super::sight::{Fixture, Sight};

/// Measured point: the joint that carries it, counted from 0, its place and its rotation vector.
#[derive(Debug, Clone)]
pub struct Tool {
    pub joint: usize,
    pub at: Vector3<f64>,
    pub turn: Vector3<f64>,
}

/// Arm with bases, tools and effects.
#[derive(Debug, Clone)]
pub struct World {
    pub arm: Arm,
    /// Translation and rotation vector of the base of each session; "" where there are none.
    pub bases: BTreeMap<String, [Vector3<f64>; 2]>,
    /// Tool of each word; "" where there are none.
    pub tools: BTreeMap<String, Tool>,
    pub fixtures: BTreeMap<String, Fixture>,
    pub effects: Vec<Effect>,
    /// Parameters of the effects by name; 0 where none is given.
    pub values: BTreeMap<String, f64>,
}

impl World {
    /// Returns a number of the arm by its name in the results, SI.
    pub fn parameter(&mut self, name: &str) -> Option<&mut f64> {
        let (of, field) = name.rsplit_once('.')?;
        let word = |of: &str| {
            let (_, word) = of.split_once('[').unwrap_or((of, "]"));
            word.trim_end_matches(']').to_owned()
        };
        let axis = |field: &str| ["x", "y", "z"].iter().position(|axis| *axis == field);
        if let Some(number) = of.strip_prefix("joint").and_then(|n| n.parse::<usize>().ok()) {
            let joint = self.arm.joints.get_mut(number - 1)?;
            if field == "stiffness" {
                return joint.stiffness.as_mut();
            }
            let place = |fields: &[&str]| fields.iter().position(|name| *name == field);
            return match &mut joint.geometry {
                Geometry::Hayati(numbers) => {
                    place(&["alpha", "a", "theta", "d", "beta"]).map(|k| &mut numbers[k])
                }
                Geometry::Origin(numbers) => {
                    place(&["x", "y", "z", "roll", "pitch", "yaw"]).map(|k| &mut numbers[k])
                }
            };
        }
        if of == "base" || of.starts_with("base[") {
            let base = self.bases.get_mut(&word(of))?;
            let turned = field.strip_prefix('r').and_then(axis);
            return axis(field)
                .map_or_else(|| turned.map(|k| (1, k)), |k| Some((0, k)))
                .map(|(part, k)| &mut base[part][k]);
        }
        if of == "tool" || of.starts_with("tool[") {
            let tool = self.tools.get_mut(&word(of))?;
            return match axis(field) {
                Some(k) => Some(&mut tool.at[k]),
                None => field.strip_prefix('r').and_then(axis).map(|k| &mut tool.turn[k]),
            };
        }
        if of.starts_with("anchor[") || of.starts_with("surface[") {
            return self.fixtures.get_mut(&word(of))?.field(field);
        }
        let is_known = self.effects.iter().any(|effect| effect.has(name));
        is_known.then(|| self.values.entry(name.to_owned()).or_default())
    }

    /// Returns position and orientation of the target of a row, as the instrument sees them,
    /// without noise. Returns `None` if the arm does not come to rest.
    pub fn pose(&self, row: &Row) -> Option<Matrix4<f64>> {
        let mut pose = self.true_pose(row)?;
        let mut seen = point(&pose, &Vector3::zeros());
        for effect in &self.effects {
            effect.show(&self.values, row, &mut seen);
        }
        pose.fixed_view_mut::<3, 1>(0, 3).copy_from(&seen);
        Some(pose)
    }

    /// Returns the numbers that a row measures, without noise: a position, or another quantity
    /// followed by zeros.
    pub fn numbers(&self, row: &Row) -> Option<Vector3<f64>> {
        let alone = |value: f64| Some(Vector3::new(value, 0.0, 0.0));
        match &row.sight {
            Sight::Position => Some(point(&self.pose(row)?, &Vector3::zeros())),
            Sight::Distance(word) | Sight::Offset(word) => alone(
                self.fixtures[word].distance(&point(&self.true_pose(row)?, &Vector3::zeros())),
            ),
            Sight::Tilt(frame) => self.tilts(frame, row),
        }
    }

    /// Returns the angles of the x and y axes of a frame above the horizontal.
    fn tilts(&self, frame: &str, row: &Row) -> Option<Vector3<f64>> {
        let frames = self.arm.rest(&self.coordinates(row), row.payload)?;
        let frame = match frame {
            "base" => Matrix4::identity(),
            "tool" => frames[self.arm.payload_on],
            joint => frames[joint.strip_prefix("joint")?.parse::<usize>().ok()? - 1],
        };
        let up = -self.arm.gravity.normalize();
        let tilt = |axis: usize| frame.fixed_view::<3, 1>(0, axis).dot(&up).asin();
        Some(Vector3::new(tilt(0), tilt(1), 0.0))
    }

    /// Returns the coordinates of the joints with their errors, without load.
    fn coordinates(&self, row: &Row) -> Vec<f64> {
        let mut q = row.q.clone();
        for effect in &self.effects {
            effect.act(&self.values, row, &mut q);
        }
        q
    }

    /// Returns the true position and orientation, as an instrument without errors sees them.
    pub fn true_pose(&self, row: &Row) -> Option<Matrix4<f64>> {
        let frames = self.arm.rest(&self.coordinates(row), row.payload)?;
        let tool = &self.tools[&row.tool];
        let [at, rotation] = self.bases[&row.session];
        Some(placed(at, rotation) * frames[tool.joint] * placed(tool.at, tool.turn))
    }
}
