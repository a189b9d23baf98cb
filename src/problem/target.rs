//! Reader of `[tool]` and `[[target]]`: the measured points and the payload.

use nalgebra::Vector3;

use super::Joint;
use super::item::name_of;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Section `[tool]`: the measured point and the payload.
#[derive(Debug, Clone)]
pub struct Tool {
    /// Index of the joint whose frame carries the tool, by default the last.
    pub joint: usize,
    /// Measured point in the frame of the joint that carries the tool \[m\].
    pub target: Vector3<f64>,
    /// Orientation of the target in the frame of the joint that carries the tool, a rotation vector
    /// \[rad\].
    pub rotation: Vector3<f64>,
    /// Position of the payload in the frame of the joint that carries the tool \[m\].
    pub payload_at: Vector3<f64>,
    /// True if the payload hangs at the identified target: `payload_at = "target"`.
    pub payload_follows: bool,
    /// True if the problem declares the position of the payload.
    pub payload_is_declared: bool,
    /// Payload mass of rows without a column `payload_kg` \[kg\].
    pub payload_mass: f64,
}

/// Table `[[target]]`: a measured point that rows name in the column `target`.
#[derive(Debug, Clone)]
pub struct Target {
    /// Name of the target, as used in the column.
    pub name: String,
    /// Index of the joint whose frame carries the target.
    pub joint: usize,
    /// Position of the target in the frame of the joint that carries it \[m\].
    pub at: Vector3<f64>,
    /// Orientation of the target in the frame of the joint that carries it, a rotation vector
    /// \[rad\].
    pub rotation: Vector3<f64>,
    /// Place in the file, for errors.
    pub location: Location,
}

impl Target {
    /// Returns the unnamed target of `[tool]`.
    pub(super) fn of_tool(tool: &Tool, location: Location) -> Self {
        Self {
            name: String::new(),
            joint: tool.joint,
            at: tool.target,
            rotation: tool.rotation,
            location,
        }
    }
}

/// Joints that may carry a tool or target.
pub(super) struct CarrierJoints<'a> {
    pub joints: &'a [Joint],
    /// True if the joint table is in standard form, which has no frame per row to refer to.
    pub is_standard: bool,
}

impl CarrierJoints<'_> {
    /// Reads the optional key `joint` and returns the joint's index.
    fn joint(&self, section: &mut Section<'_, '_>) -> Result<Option<usize>, InputError> {
        let Some(item) = section.get("joint") else { return Ok(None) };
        if self.is_standard {
            return Err(item.error(InputErrorKind::NotInStandardForm));
        }
        let number = item.whole(0)?;
        let joint = usize::try_from(number).ok().and_then(|number| number.checked_sub(1));
        match joint.filter(|&joint| joint < self.joints.len()) {
            Some(joint) => Ok(Some(joint)),
            None => Err(item
                .error(InputErrorKind::UnknownJoint { joint: number, joints: self.joints.len() })),
        }
    }
}

/// Reads `[tool]`; without the section everything is at the origin of the last frame.
pub(super) fn read_tool(
    section: Option<Section<'_, '_>>,
    carriers: &CarrierJoints,
) -> Result<Tool, InputError> {
    let joint = carriers.joints.len().saturating_sub(1);
    let (target, rotation, payload_at) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    let mut tool = Tool {
        joint,
        target,
        rotation,
        payload_at,
        payload_follows: false,
        payload_is_declared: false,
        payload_mass: 0.0,
    };
    let Some(mut section) = section else { return Ok(tool) };
    tool.joint = carriers.joint(&mut section)?.unwrap_or(joint);
    tool.target = section.vector("target", Unit::Length)?.unwrap_or_default();
    tool.rotation = section.vector("rotation", Unit::Angle)?.unwrap_or_default();
    tool.payload_at = tool.target;
    if section.peek("payload_at").is_some_and(|item| item.text().is_ok()) {
        section.word("payload_at", &["target"], &[()])?;
        (tool.payload_follows, tool.payload_is_declared) = (true, true);
    } else if let Some(at) = section.vector("payload_at", Unit::Length)? {
        (tool.payload_at, tool.payload_is_declared) = (at, true);
    }
    tool.payload_mass = section.non_negative_number("payload", Unit::Mass)?.unwrap_or(0.0);
    section.finish()?;
    Ok(tool)
}

/// Reads all `[[target]]` tables; missing keys default to the values of `[tool]`.
pub(super) fn read_targets(
    root: &mut Section<'_, '_>,
    tool: &Tool,
    carriers: &CarrierJoints,
) -> Result<Vec<Target>, InputError> {
    let mut targets: Vec<Target> = Vec::new();
    for mut section in root.sections("target")? {
        let item = section.require("name", "name = \"…\", a word of the column target")?;
        let name = name_of(&item, "a target")?;
        if let Some(first) = targets.iter().find(|target| target.name == name) {
            let line = first.location.line.unwrap_or(0);
            return Err(item.error(InputErrorKind::RepeatedFixture { what: "target", name, line }));
        }
        let joint = carriers.joint(&mut section)?.unwrap_or(tool.joint);
        let at = section.vector("at", Unit::Length)?.unwrap_or(tool.target);
        let rotation = section.vector("rotation", Unit::Angle)?.unwrap_or(tool.rotation);
        section.finish()?;
        targets.push(Target { name, joint, at, rotation, location: section.location() });
    }
    Ok(targets)
}
