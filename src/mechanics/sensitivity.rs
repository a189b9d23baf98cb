//! Derivatives of the position at equilibrium with respect to the parameters of each segment.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::arm::Arm;
use super::forward::DeflectionMode;
use super::linearised_arm::LinearisedArm;
use super::segment::{Segment, moment_directions};
use super::statics::{StaticState, StaticsError};
use super::workspace::Workspace;
use crate::problem::{Equilibrium, PoseView};

/// Derivatives of poses at equilibrium with respect to the parameters of segments. In direction k,
/// the k-th variable of every segment is differentiated at once, so that a few passes in dual
/// numbers suffice.
pub struct Sensitivity {
    /// One arm for each direction, with that direction's parameter of every segment as dual-number
    /// variable.
    arms: Vec<Arm<Dual64>>,
    /// Number of parameters of each segment.
    parameters: Vec<usize>,
    /// Direction (index within its segment) of each unknown moment.
    directions: Vec<usize>,
    ws: Workspace<Dual64>,
    linearised: LinearisedArm,
}

impl Sensitivity {
    /// Returns true if the method applies: loads act on the deflected arm and do not depend on its
    /// position.
    pub fn applies_to(arm: &Arm<f64>) -> bool {
        arm.equilibrium == Equilibrium::Deflected && arm.rope.is_none()
    }

    /// Creates the derivatives of `arm`. `parameters` gives their number for each segment; their
    /// directions start at [`Segment::first_parameter_direction`]. `seeded` gives the arm with the
    /// parameters of one direction seeded, at most one of each segment.
    pub fn new(
        arm: &Arm<f64>,
        parameters: impl Fn(Segment) -> usize,
        seeded: impl Fn(usize) -> Arm<Dual64>,
    ) -> Self {
        let joints =
            (0..arm.joints.len()).flat_map(|joint| [Segment::Joint(joint), Segment::Beam(joint)]);
        let segments: Vec<Segment> = std::iter::once(Segment::Mounting).chain(joints).collect();
        let directions = segments
            .iter()
            .map(|&segment| segment.first_parameter_direction() + parameters(segment))
            .max()
            .unwrap_or(0);
        Self {
            arms: (0..directions).map(seeded).collect(),
            parameters: segments.iter().map(|&segment| parameters(segment)).collect(),
            directions: moment_directions(arm),
            ws: Workspace::default(),
            linearised: LinearisedArm::new(segments.len(), directions),
        }
    }

    /// Computes Λ of a pose at equilibrium, and all derivatives of the target at `target` \[m\] in
    /// the frame for which the equilibrium was computed.
    ///
    /// # Errors
    /// Returns an error if Λ does not converge: with a little more load, the arm would have no
    /// equilibrium.
    pub fn differentiate(
        &mut self,
        setup: &PoseView,
        target: &Vector3<f64>,
        pose: &mut StaticState,
    ) -> Result<(), StaticsError> {
        let Self { arms, parameters, directions, ws, linearised } = self;
        let mut moments = std::mem::take(&mut ws.moments);
        for (direction, arm) in arms.iter().enumerate() {
            moments.clear();
            let seeded =
                |(&x, &of): (&f64, &usize)| Dual64::new(x, f64::from(u8::from(of == direction)));
            moments.extend(pose.moments.iter().zip(&*directions).map(seeded));
            let root_rotation = (direction < 3).then(|| {
                Vector3::from_fn(|i, _| Dual64::new(0.0, f64::from(u8::from(i == direction))))
            });
            if direction == 0 {
                // The parameters of segments do not change the forces.
                arm.gather_forces(setup, &[], ws);
            }
            arm.walk(
                setup,
                DeflectionMode::BySegment(&moments, root_rotation.as_ref()),
                pose.tip,
                ws,
            );
            if direction == 0 {
                linearised.linearise(ws, parameters);
            }
            linearised.fill_derivatives(direction, ws);
        }
        ws.moments = moments;
        linearised.differentiate(&pose.frame.point(target))?;
        pose.adjoint.clear();
        for i in 0..3 {
            pose.adjoint.extend(linearised.influence.iter().skip(i).step_by(3));
        }
        Ok(())
    }

    /// Returns the derivative of the target's position, arm base frame \[m\], with respect to the
    /// parameter of a segment that has this direction.
    pub fn derivative(&self, segment: Segment, direction: usize) -> Vector3<f64> {
        self.linearised.derivative(segment.index(), direction)
    }
}
