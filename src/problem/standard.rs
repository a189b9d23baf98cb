//! Conversion of standard (distal) DH tables to the modified form.

use nalgebra::Vector3;

use super::{Joint, JointKind, Placement, Problem};
use crate::spatial::Frame;

/// Name of the fixed joint that is added for a and α of the last row of a standard table.
const FLANGE: &str = "flange";

/// Converts rows of standard DH, T = Rz(θ+q) Tz(d) Tx(a) Rx(α), to joints of modified DH.
///
/// a and α of a row become those of the next joint, where Rx(α) Tx(a) = Tx(a) Rx(α) come first.
/// Those of the last row belong to an added fixed joint. Bodies keep their physical positions;
/// their coordinates change, because a body's frame no longer includes the row's a and α.
pub(super) fn to_modified_form(rows: Vec<Joint>) -> Vec<Joint> {
    let mut joints = Vec::with_capacity(rows.len() + 1);
    // Values of a and α in the previous row.
    let mut previous = (0.0, 0.0);
    let mut last = None;
    for mut row in rows {
        let (a, alpha) = (row.a, row.alpha);
        (row.a, row.alpha) = previous;
        if let Some(Placement { xyz, rpy }) = &mut row.placement {
            let frame = link_transform(previous).compose(&Frame::from_xyz_rpy(xyz, rpy));
            (*xyz, *rpy) = (frame.origin, frame.roll_pitch_yaw());
            (row.a, row.alpha) = (0.0, 0.0);
        }
        for body in &mut row.bodies {
            body.position = link_transform((a, alpha)).point(&body.position);
        }
        previous = (a, alpha);
        last = Some(row.location.clone());
        joints.push(row);
    }
    if let Some(location) = last {
        let (a, alpha) = previous;
        joints.push(Joint {
            name: FLANGE.to_owned(),
            kind: JointKind::Fixed,
            parent: joints.len().checked_sub(1),
            placement: None,
            mimic: None,
            alpha,
            a,
            theta: 0.0,
            d: 0.0,
            beta: 0.0,
            limits: (f64::NEG_INFINITY, f64::INFINITY),
            stiffness: None,
            beam: None,
            bodies: Vec::new(),
            location,
        });
    }
    joints
}

impl Problem {
    /// Returns the problem with the rows of its joint table interpreted as standard DH, for a table
    /// declared as modified DH. Returns `None` if standard rows cannot have such values.
    pub(crate) fn read_as_standard(&self) -> Option<Self> {
        let has_row = |joint: &Joint| {
            joint.kind != JointKind::Fixed
                && joint.beam.is_none()
                && joint.beta == 0.0
                && joint.placement.is_none()
        };
        if !self.is_chain() || !self.joints.iter().all(has_row) {
            return None;
        }
        Some(self.with_chain(to_modified_form(self.joints.clone())))
    }

    /// Returns the joints that are rows of a standard DH table; `None` for tables in another form.
    pub(crate) fn standard_rows(&self) -> Option<&[Joint]> {
        let (flange, rows) = self.joints.split_last()?;
        let last = rows.last()?;
        // The added joint has the place of the last row in the file.
        let is_added = flange.kind == JointKind::Fixed
            && flange.name == FLANGE
            && flange.location == last.location;
        (self.is_chain() && is_added).then_some(rows)
    }

    /// Returns the problem with the rows of its joint table interpreted as modified DH, for a table
    /// declared as standard DH. Returns `None` for other tables.
    pub(crate) fn read_as_modified(&self) -> Option<Self> {
        let mut joints = self.standard_rows()?.to_vec();
        for (joint, next) in joints.iter_mut().zip(self.joints.iter().skip(1)) {
            (joint.a, joint.alpha) = (next.a, next.alpha);
            let link = link_transform((next.a, next.alpha));
            for body in &mut joint.bodies {
                body.position = link.resolve(&(body.position - link.origin));
            }
        }
        let mut problem = self.with_chain(joints);
        // Rules for the flange match no parameter without it.
        let flange = format!("joint{}.", self.joints.len());
        problem.parameters.retain(|rule| !rule.pattern.starts_with(&flange));
        Some(problem)
    }

    /// Returns the problem with changed rows of the joint table as the file has them. Returns `None`
    /// if `change` does, or if the changed rows are not those of a standard table that the problem
    /// declares.
    pub(crate) fn with_changed_joint_rows(
        &self,
        change: impl FnOnce(&mut [Joint]) -> Option<()>,
    ) -> Option<Self> {
        let is_standard = self.standard_rows().is_some();
        let mut problem = if is_standard { self.read_as_modified()? } else { self.clone() };
        change(&mut problem.joints)?;
        if is_standard { problem.read_as_standard() } else { Some(problem) }
    }

    /// Returns the problem with other joints in a chain; the last joint carries the tool and all
    /// targets.
    fn with_chain(&self, joints: Vec<Joint>) -> Self {
        let last = joints.len() - 1;
        let mut problem = Self { joints, ..self.clone() };
        problem.tool.joint = last;
        problem.targets.iter_mut().for_each(|target| target.joint = last);
        problem
    }
}

/// Returns the transform Tx(a) Rx(α) of a link.
fn link_transform((a, alpha): (f64, f64)) -> Frame<f64> {
    Frame::from_xyz_rpy(&Vector3::new(a, 0.0, 0.0), &Vector3::new(alpha, 0.0, 0.0))
}
