//! Derivatives of the position at rest with respect to what each segment of the arm is made of.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::arm::Arm;
use super::forward::Bend;
use super::segment::{Segment, moment_lanes};
use super::statics::{StaticState, StaticsError};
use super::tape::Tape;
use super::workspace::Workspace;
use crate::problem::{Equilibrium, PoseView};

/// Differentiates poses at rest by the parameters of segments, each segment by its own few
/// directions.
pub struct Sensitivity {
    /// For each direction the arm that has the parameter of every segment in that direction seeded.
    arms: Vec<Arm<Dual64>>,
    /// How many parameters each segment has.
    parameters: Vec<usize>,
    /// Direction of each moment.
    lanes: Vec<usize>,
    ws: Workspace<Dual64>,
    tape: Tape,
}

impl Sensitivity {
    /// Whether an arm can be taken apart: its loads are taken where it has bent, and do not change
    /// with the place.
    pub fn applies_to(arm: &Arm<f64>) -> bool {
        arm.equilibrium == Equilibrium::Deflected && arm.rope.is_none()
    }

    /// Of `arm`; each segment has so many `parameters`, whose directions begin at
    /// [`Segment::first_lane`], and `seeded` gives the arm that has the parameters of one direction
    /// seeded, at most one of each segment.
    pub fn new(
        arm: &Arm<f64>,
        parameters: impl Fn(Segment) -> usize,
        seeded: impl Fn(usize) -> Arm<Dual64>,
    ) -> Self {
        let joints =
            (0..arm.joints.len()).flat_map(|joint| [Segment::Joint(joint), Segment::Beam(joint)]);
        let segments: Vec<Segment> = std::iter::once(Segment::Mounting).chain(joints).collect();
        let lanes = segments
            .iter()
            .map(|&segment| segment.first_lane() + parameters(segment))
            .max()
            .unwrap_or(0);
        Self {
            arms: (0..lanes).map(seeded).collect(),
            parameters: segments.iter().map(|&segment| parameters(segment)).collect(),
            lanes: moment_lanes(arm),
            ws: Workspace::default(),
            tape: Tape::new(segments.len(), lanes),
        }
    }

    /// Fills in Λ of an equilibrated pose for the target at `target` \[m\] in the frame that the
    /// pose was brought to rest for, and finds all derivatives.
    ///
    /// # Errors
    /// Λ does not settle: a little more load, and the arm would not come to rest.
    pub fn differentiate(
        &mut self,
        setup: &PoseView,
        target: &Vector3<f64>,
        pose: &mut StaticState,
    ) -> Result<(), StaticsError> {
        let Self { arms, parameters, lanes, ws, tape } = self;
        let mut moments = std::mem::take(&mut ws.moments);
        for (lane, arm) in arms.iter().enumerate() {
            moments.clear();
            let seeded =
                |(&x, &of): (&f64, &usize)| Dual64::new(x, f64::from(u8::from(of == lane)));
            moments.extend(pose.moments.iter().zip(&*lanes).map(seeded));
            let turning = (lane < 3)
                .then(|| Vector3::from_fn(|i, _| Dual64::new(0.0, f64::from(u8::from(i == lane)))));
            if lane == 0 {
                // No segment's parameters change the forces.
                arm.gather_forces(setup, &[], ws);
            }
            arm.walk(setup, Bend::Apart(&moments, turning.as_ref()), pose.tip, ws);
            if lane == 0 {
                tape.record(ws, parameters);
            }
            tape.fill(lane, ws);
        }
        ws.moments = moments;
        tape.differentiate(&pose.frame.point(target))?;
        pose.adjoint.clear();
        for i in 0..3 {
            pose.adjoint.extend(tape.influence.iter().skip(i).step_by(3));
        }
        Ok(())
    }

    /// Derivative of the position \[m\], arm base frame, with respect to the parameter in a
    /// direction of a segment.
    pub fn of(&self, segment: Segment, lane: usize) -> Vector3<f64> {
        self.tape.derivative(segment.index(), lane)
    }
}
