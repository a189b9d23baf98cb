//! Loads of a pose, resolved in the frames of the rigid arm.
//!
//! The paper resolves the loads by hand for its arm (`G_4r`, `G_4n`, `M_4P`, `M_4V`, …, §2.1 and
//! §2.2). Here they follow from the frames, with signs, for any arm. Component x of a link frame is
//! the index r of the paper, components y and z its index n in the two planes. Moment components z
//! and y are its `M_V` and (with opposite sign) `M_Pn`, component x its `M_Pr`.

use nalgebra::{Matrix3, Vector3};

use super::kinematics::{Chain, split};
use crate::problem::{Beam, PoseView, Problem};

/// Force \[N\] and moment [N·m] at a point.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Wrench {
    /// Force at the point \[N\].
    pub force: Vector3<f64>,
    /// Moment about the point [N·m].
    pub moment: Vector3<f64>,
}

/// Weight or hoist that acts on a link between its root and its tip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLoad {
    /// Coordinate s along the link from its root \[m\]; `r_cx` and `l_F1` of the paper.
    pub station: f64,
    /// Force, and moment about the point at s on the link's axis, link frame.
    pub wrench: Wrench,
    /// True for the force of the hoist, false for a weight.
    pub hoist: bool,
}

/// Loads of an elastic link, in the frame at its root with x along the link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkLoads {
    /// Length l \[m\], negative for a link along −x.
    pub length: f64,
    /// Distributed weight q, the link's weight over l [N/m]; opposite to gravity for a negative l.
    pub spread: Vector3<f64>,
    /// Weights of the masses on the link, and the hoist if it holds this link.
    pub points: Vec<PointLoad>,
    /// Sum of the weights beyond the tip, with moments about the tip: `G_4`, `M_4` or `G_34`,
    /// `M_34` [Chen2021, eq. 3].
    pub tip: Wrench,
    /// Sum of the hoists on links beyond the tip, with moments about the tip.
    pub tip_hoist: Wrench,
}

/// Moments about a joint's axis [N·m].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointLoads {
    /// Moment of the weights beyond the joint, positive along the axis: `M_4V`, `M_34V`, `M_234V`.
    pub weights: f64,
    /// Moment of the hoists beyond the joint, positive along the axis: −`M_1F`, −`M_2F`.
    pub hoists: f64,
}

/// Loads of a pose, with an entry for each joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Loads {
    /// Loads on the link before each joint; `None` if that link is not a beam.
    pub links: Vec<Option<LinkLoads>>,
    /// Moments about each joint axis.
    pub joints: Vec<JointLoads>,
}

/// Force \[N\] at a point \[m\] of the arm, base frame. `hoist` is true for a hoist, false for a
/// weight.
struct Load {
    at: Vector3<f64>,
    force: Vector3<f64>,
    hoist: bool,
}

impl Loads {
    /// Computes the loads joint by joint from the end point to the base. Each joint and link
    /// carries the loads between it and the end point.
    pub fn new(problem: &Problem, chain: &Chain, setup: &PoseView) -> Self {
        let gravity = problem.gravity;
        let n = problem.joints.len();
        let mut forces = Vec::new();
        let weight = |at, mass: f64| Load { at, force: gravity * mass, hoist: false };
        let (axes, origin) = split(&chain.before[n]);
        let payload = setup.payload.copied().unwrap_or(problem.tool.payload_mass);
        forces.push(weight(origin + axes * problem.tool.payload_at, payload));
        let mut out = Self { links: vec![None; n], joints: vec![JointLoads::default(); n] };
        for (k, joint) in problem.joints.iter().enumerate().rev() {
            let (axes, origin) = split(&chain.before[k + 1]);
            let bodies = joint.bodies.iter();
            forces.extend(bodies.map(|body| weight(origin + axes * body.position, body.mass)));
            let (axes, tip) = split(&(chain.before[k] * chain.links[k].to_tip()));
            let (weights, hoists) = (sum_about(&forces, tip, false), sum_about(&forces, tip, true));
            let axis = axes.column(2);
            out.joints[k] =
                JointLoads { weights: axis.dot(&weights.moment), hoists: axis.dot(&hoists.moment) };
            if let Some(beam) = &joint.beam {
                let length = chain.links[k].a;
                let mut link = LinkLoads {
                    length,
                    spread: axes.tr_mul(&gravity) * (beam.mass / length),
                    points: Vec::new(),
                    tip: resolved(&axes, &weights),
                    tip_hoist: resolved(&axes, &hoists),
                };
                let root = tip - axes.column(0) * length;
                forces.push(weight((root + tip) * 0.5, beam.mass));
                for (at, force, hoist) in carried(beam, gravity, setup) {
                    forces.push(Load { at: root + axes * at, force, hoist });
                    link.points.push(point_load(at, length, axes.tr_mul(&force), hoist));
                }
                out.links[k] = Some(link);
            }
        }
        out
    }
}

/// Returns the loads that act on a beam: positions in the link frame \[m\], forces in the base
/// frame \[N\], and true for a hoist, false for a weight.
fn carried(
    beam: &Beam,
    gravity: Vector3<f64>,
    setup: &PoseView,
) -> Vec<(Vector3<f64>, Vector3<f64>, bool)> {
    let masses = beam.masses.iter().map(|mass| (mass.position, gravity * mass.mass, false));
    let hoist = beam.hoist.iter();
    masses
        .chain(hoist.map(|hoist| {
            (hoist.at, hoist.direction * setup.hoist.copied().unwrap_or(hoist.force), true)
        }))
        .collect()
}

/// Returns a force at a point `at` as a load on the axis of a link with this `length`, all in the
/// link frame. A force beyond an end acts at that end, with its moment about the end.
fn point_load(at: Vector3<f64>, length: f64, force: Vector3<f64>, hoist: bool) -> PointLoad {
    let station = at.x.clamp(length.min(0.0), length.max(0.0));
    let offset = at - Vector3::x() * station;
    PointLoad { station, wrench: Wrench { force, moment: offset.cross(&force) }, hoist }
}

/// Returns the sum of the hoists among `forces` if `hoist` is true, else of the weights, with
/// moments about `point`, base frame.
fn sum_about(forces: &[Load], point: Vector3<f64>, hoist: bool) -> Wrench {
    forces.iter().filter(|load| load.hoist == hoist).fold(Wrench::default(), |sum, load| Wrench {
        force: sum.force + load.force,
        moment: sum.moment + (load.at - point).cross(&load.force),
    })
}

/// Returns the components of a wrench along `axes`, given in the frame in which these are.
fn resolved(axes: &Matrix3<f64>, wrench: &Wrench) -> Wrench {
    Wrench { force: axes.tr_mul(&wrench.force), moment: axes.tr_mul(&wrench.moment) }
}
