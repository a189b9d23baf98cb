//! Derivatives of an elastic arm with respect to its parameters.
//!
//! A parameter of one segment is differentiated within that segment, and virtual work gives the
//! motion of the target. A parameter that changes loads goes through the whole statics.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::Model;
use super::rows::{Input, Rows};
use super::sites::set_site;
use crate::mechanics::{AdjointSolver, Angle, Arm, Segment, Sensitivity, StaticState, Workspace};
use crate::model::parameter::{ArmField, BeamField, JointField, ParameterSite};
use crate::problem::PoseView;
use crate::spatial::Frame;

/// Derivatives of an elastic arm: segment by segment for parameters that act on a single segment,
/// through the whole statics for the others.
pub(super) struct ElasticDerivatives {
    segments: Option<SegmentInputs>,
    adjoint: AdjointSolver,
    whole: Vec<WholeArmInput>,
    arm: Arm<f64>,
    state: StaticState,
    /// Memory for forward passes in real and in dual numbers, reused from pose to pose.
    real: Workspace<f64>,
    dual: Workspace<Dual64>,
}

/// Inputs that act on a single segment, each with the segment and the index of its derivative
/// direction there.
struct SegmentInputs {
    sensitivity: Sensitivity,
    inputs: Vec<(Input, Segment, usize)>,
}

/// Input that changes loads, with a copy of the arm in which it is the dual-number variable.
struct WholeArmInput {
    arm: Arm<Dual64>,
    input: Input,
}

impl ElasticDerivatives {
    /// Creates the derivatives of `arm` with respect to `inputs`. `arm` is that of the model at the
    /// full parameter vector `x`.
    pub fn new(model: &Model, x: &[f64], arm: Arm<f64>, inputs: Vec<Input>) -> Self {
        let (mut by_segment, mut whole) = (Vec::new(), Vec::new());
        for input in inputs {
            match segment_of(&arm, input.site).filter(|_| Sensitivity::applies_to(&arm)) {
                Some(segment) => {
                    let before =
                        by_segment.iter().filter(|(_, other, _)| *other == segment).count();
                    by_segment.push((input, segment, segment.first_parameter_direction() + before));
                }
                None => whole.push(WholeArmInput { arm: seed_arm(model, x, &[&input]), input }),
            }
        }
        let segments = (!by_segment.is_empty()).then(|| {
            let count =
                |segment| by_segment.iter().filter(|(_, other, _)| *other == segment).count();
            let seeded = |direction| {
                let of_direction: Vec<&Input> = by_segment
                    .iter()
                    .filter(|(_, _, its_direction)| *its_direction == direction)
                    .map(|(input, _, _)| input)
                    .collect();
                seed_arm(model, x, &of_direction)
            };
            SegmentInputs {
                sensitivity: Sensitivity::new(&arm, count, seeded),
                inputs: by_segment.clone(),
            }
        });
        let (adjoint, state) = (AdjointSolver::new(&arm), StaticState::default());
        Self {
            segments,
            adjoint,
            whole,
            arm,
            state,
            real: Workspace::default(),
            dual: Workspace::default(),
        }
    }

    /// Writes the derivatives of a target with respect to all inputs into `rows`. The target is
    /// given by its position \[m\] in the frame of the joint `tip`. Returns the frame of `tip`,
    /// measuring frame, or `None` without equilibrium.
    pub fn write(
        &mut self,
        (commanded, setup): (&PoseView, &PoseView),
        base: &Frame<f64>,
        (tip, target): (usize, &Vector3<f64>),
        rows: &mut Rows,
    ) -> Option<Frame<f64>> {
        let Self { segments, adjoint, whole, arm, state, real, dual } = self;
        arm.equilibrate_at(setup, tip, real, state).ok()?;
        match segments {
            Some(SegmentInputs { sensitivity, inputs }) => {
                sensitivity.differentiate(setup, target, state).ok()?;
                for (input, segment, direction) in inputs {
                    rows.put_input(
                        input,
                        commanded,
                        &base.vector(&sensitivity.derivative(*segment, *direction)),
                    );
                }
            }
            None if !whole.is_empty() => adjoint.adjoint(setup, target, state).ok()?,
            None => {}
        }
        let carries_payload = arm.carries_payload(setup);
        for WholeArmInput { arm, input } in whole {
            if matches!(input.site, ParameterSite::Target { .. }) && !carries_payload {
                continue;
            }
            let position = arm.target_position(setup, target, state, dual);
            rows.put_input(
                input,
                commanded,
                &base.vector(&position.map(|coordinate| coordinate.eps)),
            );
        }
        Some(base.compose(&state.frame))
    }
}

/// Returns the segment on which an input acts alone; `None` if the input changes loads.
fn segment_of(arm: &Arm<f64>, site: ParameterSite) -> Option<Segment> {
    match site {
        ParameterSite::Joint { joint, field: JointField::A }
            if arm.joints[joint].beam.is_some() =>
        {
            Some(Segment::Beam(joint))
        }
        ParameterSite::Joint { field: JointField::BodyMass, .. }
        | ParameterSite::Beam { field: BeamField::AddedMass, .. } => None,
        ParameterSite::Joint { joint, .. } => Some(Segment::Joint(joint)),
        ParameterSite::Beam { joint, .. } => Some(Segment::Beam(joint)),
        ParameterSite::Arm(ArmField::MountingX | ArmField::MountingY) => Some(Segment::Mounting),
        _ => None,
    }
}

/// Returns the arm at the full parameter vector `x` with the given inputs as dual-number variables.
/// No two inputs may belong to the same segment.
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
                    JointField::Before(_) | JointField::After(_) => {
                        if let Some((k, motion)) = field.motion().zip(joint.motion.as_mut()) {
                            motion[k] += seed;
                        }
                    }
                    _ => joint.theta += seed,
                }
            }
            ParameterSite::Beam { .. } => set_site(&mut arm, input.site, 0.0, seed, &mut [seed; 2]),
            _ => {}
        }
    }
    arm
}
