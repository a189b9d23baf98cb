//! Derivatives of the position at rest with respect to what each part of the arm is made of.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::apart::{Part, moment_lanes};
use super::link::Arm;
use super::place::Bend;
use super::statics::Equilibrated;
use super::trail::Trail;
use super::workspace::Workspace;
use crate::problem::{Equilibrium, PoseView};

/// Differentiates poses at rest by the parameters of parts, each part by its own few directions.
pub struct Sensitivity {
    /// For each direction the arm that has the parameter of every part in that direction seeded.
    arms: Vec<Arm<Dual64>>,
    /// How many parameters each part has.
    parameters: Vec<usize>,
    /// Direction of each moment.
    lanes: Vec<usize>,
    ws: Workspace<Dual64>,
    trail: Trail,
}

impl Sensitivity {
    /// Whether an arm can be taken apart: its loads are taken where it has bent, and do not change with the place.
    pub fn applies_to(arm: &Arm<f64>) -> bool {
        arm.equilibrium == Equilibrium::Deflected && arm.rope.is_none()
    }

    /// Of `arm`; each part has so many `parameters`, whose directions begin at [`Part::first_lane`], and `seeded` gives the
    /// arm that has the parameters of one direction seeded, at most one of each part.
    pub fn new(arm: &Arm<f64>, parameters: impl Fn(Part) -> usize, seeded: impl Fn(usize) -> Arm<Dual64>) -> Self {
        let joints = (0..arm.joints.len()).flat_map(|joint| [Part::Joint(joint), Part::Beam(joint)]);
        let parts: Vec<Part> = std::iter::once(Part::Mounting).chain(joints).collect();
        let lanes = parts.iter().map(|&part| part.first_lane() + parameters(part)).max().unwrap_or(0);
        Self {
            arms: (0..lanes).map(seeded).collect(),
            parameters: parts.iter().map(|&part| parameters(part)).collect(),
            lanes: moment_lanes(arm),
            ws: Workspace::default(),
            trail: Trail::new(parts.len(), lanes),
        }
    }

    /// Fills in Λ of an equilibrated pose for the target at `target` [m], last frame, and finds all derivatives.
    pub fn differentiate(&mut self, setup: &PoseView, target: &Vector3<f64>, pose: &mut Equilibrated) {
        let Self { arms, parameters, lanes, ws, trail } = self;
        let mut moments = std::mem::take(&mut ws.moments);
        for (lane, arm) in arms.iter().enumerate() {
            moments.clear();
            let seeded = |(&x, &of): (&f64, &usize)| Dual64::new(x, f64::from(u8::from(of == lane)));
            moments.extend(pose.moments.iter().zip(&*lanes).map(seeded));
            let turning = (lane < 3).then(|| Vector3::from_fn(|i, _| Dual64::new(0.0, f64::from(u8::from(i == lane)))));
            if lane == 0 {
                // No part's parameters change the forces.
                arm.gather_forces(setup, &[], ws);
            }
            arm.walk(setup, Bend::Apart(&moments, turning.as_ref()), ws);
            if lane == 0 {
                trail.record(ws, parameters);
            }
            trail.fill(lane, ws);
        }
        ws.moments = moments;
        trail.differentiate(&pose.frame.point(target));
        pose.adjoint.clear();
        for i in 0..3 {
            pose.adjoint.extend(trail.influence.iter().skip(i).step_by(3));
        }
    }

    /// Derivative of the position [m], arm base frame, with respect to the parameter in a direction of a part.
    pub fn of(&self, part: Part, lane: usize) -> Vector3<f64> {
        self.trail.derivative(part.index(), lane)
    }
}
