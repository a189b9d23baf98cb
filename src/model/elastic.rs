//! Derivatives of an elastic arm with respect to its own parameters.
//!
//! What a parameter does to its own part is taken alone, and virtual work tells what that does to
//! the target; parameters that change loads go through the whole statics, one by one.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::Model;
use super::enter::enter;
use super::inputs::Input;
use super::rows::Rows;
use crate::mechanics::{AdjointSolver, Angle, Arm, Segment, Sensitivity, StaticState, Workspace};
use crate::model::parameter::{ArmField, BeamField, JointField, ParameterSite};
use crate::problem::PoseView;
use crate::spatial::Frame;

/// An elastic arm, part by part where its parameters act on one part alone, else one by one through
/// the whole arm.
pub(super) struct Elastic {
    parts: Option<Parts>,
    response: AdjointSolver,
    whole: Vec<Whole>,
    arm: Arm<f64>,
    rest: StaticState,
    /// Memory for walks.
    real: Workspace<f64>,
    ws: Workspace<Dual64>,
}

/// An arm to be taken apart, and the direction of each input in its part.
struct Parts {
    sensitivity: Sensitivity,
    inputs: Vec<(Input, Segment, usize)>,
}

/// An input with the arm that has it seeded.
struct Whole {
    arm: Arm<Dual64>,
    input: Input,
}

impl Elastic {
    /// Of `arm`, which is the model's at `x`.
    pub fn new(model: &Model, x: &[f64], arm: Arm<f64>, inputs: Vec<Input>) -> Self {
        let (mut apart, mut whole) = (Vec::new(), Vec::new());
        for input in inputs {
            match part_of(&arm, input.site).filter(|_| Sensitivity::applies_to(&arm)) {
                Some(part) => {
                    let before = apart.iter().filter(|(_, of, _)| *of == part).count();
                    apart.push((input, part, part.first_parameter_direction() + before));
                }
                None => whole.push(Whole { arm: seed_arm(model, x, &[&input]), input }),
            }
        }
        let parts = (!apart.is_empty()).then(|| {
            let count = |part| apart.iter().filter(|(_, of, _)| *of == part).count();
            let seeded = |direction| {
                let of_lane: Vec<&Input> = apart
                    .iter()
                    .filter(|(_, _, own)| *own == direction)
                    .map(|(input, _, _)| input)
                    .collect();
                seed_arm(model, x, &of_lane)
            };
            Parts { sensitivity: Sensitivity::new(&arm, count, seeded), inputs: apart.clone() }
        });
        let (response, rest) = (AdjointSolver::new(&arm), StaticState::default());
        Self {
            parts,
            response,
            whole,
            arm,
            rest,
            real: Workspace::default(),
            ws: Workspace::default(),
        }
    }

    /// Writes the derivatives of a target \[m\] in the frame of the joint `tip`; returns that
    /// frame, measuring frame, `None` where the pose has no equilibrium.
    pub fn write(
        &mut self,
        (commanded, setup): (&PoseView, &PoseView),
        base: &Frame<f64>,
        (tip, target): (usize, &Vector3<f64>),
        rows: &mut Rows,
    ) -> Option<Frame<f64>> {
        let Self { parts, response, whole, arm, rest, real, ws } = self;
        arm.equilibrate_at(setup, tip, real, rest).ok()?;
        match parts {
            Some(Parts { sensitivity, inputs }) => {
                sensitivity.differentiate(setup, target, rest).ok()?;
                for (input, part, direction) in inputs {
                    rows.put_input(
                        input,
                        commanded,
                        &base.vector(&sensitivity.derivative(*part, *direction)),
                    );
                }
            }
            None if !whole.is_empty() => response.adjoint(setup, target, rest).ok()?,
            None => {}
        }
        for Whole { arm, input } in whole {
            let position = arm.target_position(setup, target, rest, ws);
            rows.put_input(
                input,
                commanded,
                &base.vector(&position.map(|coordinate| coordinate.eps)),
            );
        }
        Some(base.compose(&rest.frame))
    }
}

/// The part on which alone an input acts; none where it changes loads.
fn part_of(arm: &Arm<f64>, site: ParameterSite) -> Option<Segment> {
    match site {
        ParameterSite::Joint { joint, field: JointField::A }
            if arm.joints[joint].beam.is_some() =>
        {
            Some(Segment::Beam(joint))
        }
        ParameterSite::Joint { joint, .. } => Some(Segment::Joint(joint)),
        ParameterSite::Beam { field: BeamField::AddedMass, .. } => None,
        ParameterSite::Beam { joint, .. } => Some(Segment::Beam(joint)),
        ParameterSite::Arm(ArmField::MountingX | ArmField::MountingY) => Some(Segment::Mounting),
        _ => None,
    }
}

/// The arm at `x` with the derivative of some inputs, of which no two act on the same part.
pub(super) fn seed_arm(model: &Model, x: &[f64], inputs: &[&Input]) -> Arm<Dual64> {
    let is_seeded = |k: usize| inputs.iter().any(|input| input.parameter == Some(k));
    let mut arm = model.arm(|k| Dual64::new(x[k], f64::from(u8::from(is_seeded(k)))));
    let seed = Dual64::from(0.0).derivative();
    for input in inputs.iter().filter(|input| input.parameter.is_none()) {
        match input.site {
            ParameterSite::Joint { joint, field } => {
                let joint = &mut arm.joints[joint];
                match field {
                    JointField::Alpha => joint.alpha = Angle::new(joint.alpha.value + seed),
                    JointField::A => joint.a += seed,
                    JointField::D => joint.d += seed,
                    JointField::Beta => joint.beta = Angle::new(joint.beta.value + seed),
                    _ => joint.theta += seed,
                }
            }
            ParameterSite::Beam { .. } => enter(&mut arm, input.site, 0.0, seed, &mut [seed; 2]),
            _ => {}
        }
    }
    arm
}
