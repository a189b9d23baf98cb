//! What is measured and what is carried: `[tool]`, and `[[target]]` where several points are
//! measured.

use nalgebra::Vector3;

use super::Joint;
use super::fixture::name_of;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// `[tool]`.
#[derive(Debug, Clone)]
pub struct Tool {
    /// Index of the joint whose frame carries it: the last one, unless the file says otherwise.
    pub joint: usize,
    /// The measured point in that frame \[m\].
    pub target: Vector3<f64>,
    /// Orientation of what is measured in that frame, a rotation vector \[rad\].
    pub rotation: Vector3<f64>,
    /// Where a payload hangs, in that frame \[m\].
    pub payload_at: Vector3<f64>,
    /// Payload where no column `payload_kg` says otherwise \[kg\].
    pub payload_mass: f64,
}

/// `[[target]]`: a point that rows name in the column `target`.
#[derive(Debug, Clone)]
pub struct Target {
    /// Its name, as the column has it.
    pub name: String,
    /// Index of the joint whose frame carries it.
    pub joint: usize,
    /// Place in that frame \[m\].
    pub at: Vector3<f64>,
    /// Orientation in that frame, a rotation vector \[rad\].
    pub rotation: Vector3<f64>,
    /// For errors.
    pub location: Location,
}

impl Target {
    /// What `[tool]` says, without a name.
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

/// Joints that may carry something.
pub(super) struct InfluentialRows<'a> {
    pub joints: &'a [Joint],
    /// Whether frames have no place of their own in the file's form of the joints.
    pub is_standard: bool,
}

impl InfluentialRows<'_> {
    /// The joint with the number behind the key `joint`.
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

/// `[tool]`, all of it at the origin of the last frame where the section is not there.
pub(super) fn tool(
    section: Option<Section<'_, '_>>,
    influential_rows: &InfluentialRows,
) -> Result<Tool, InputError> {
    let joint = influential_rows.joints.len().saturating_sub(1);
    let (target, rotation, payload_at) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
    let mut tool = Tool { joint, target, rotation, payload_at, payload_mass: 0.0 };
    let Some(mut section) = section else { return Ok(tool) };
    tool.joint = influential_rows.joint(&mut section)?.unwrap_or(joint);
    tool.target = section.vector("target", Unit::Length)?.unwrap_or_default();
    tool.rotation = section.vector("rotation", Unit::Angle)?.unwrap_or_default();
    tool.payload_at = section.vector("payload_at", Unit::Length)?.unwrap_or(tool.target);
    tool.payload_mass = section.not_negative("payload", Unit::Mass)?.unwrap_or(0.0);
    section.finish()?;
    Ok(tool)
}

/// Every `[[target]]`; what one does not say of itself is as in `[tool]`.
pub(super) fn targets(
    root: &mut Section<'_, '_>,
    tool: &Tool,
    influential_rows: &InfluentialRows,
) -> Result<Vec<Target>, InputError> {
    let mut targets: Vec<Target> = Vec::new();
    for mut section in root.sections("target")? {
        let item = section.require("name", "name = \"…\", a word of the column target")?;
        let name = name_of(&item, "a target")?;
        if let Some(first) = targets.iter().find(|own| own.name == name) {
            let line = first.location.line.unwrap_or(0);
            return Err(item.error(InputErrorKind::RepeatedFixture { what: "target", name, line }));
        }
        let joint = influential_rows.joint(&mut section)?.unwrap_or(tool.joint);
        let at = section.vector("at", Unit::Length)?.unwrap_or(tool.target);
        let rotation = section.vector("rotation", Unit::Angle)?.unwrap_or(tool.rotation);
        section.finish()?;
        targets.push(Target { name, joint, at, rotation, location: section.location() });
    }
    Ok(targets)
}
