//! Derivatives of a rigid arm with respect to its parameters.
//!
//! Every parameter belongs to one elementary motion of a link. An inward pass transforms the target
//! through each motion in dual numbers, from tip to base, and gives its derivative in the frame
//! before that motion. An outward pass computes these frames in real numbers. In a tree of joints,
//! both follow the path from base to target; parameters elsewhere have no effect.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::rows::{Input, Rows};
use crate::mechanics::{Angle, Arm, Coordinates, Joint, MOTION_LEN, MOTION_STARTS, Placement};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::{PoseView, Tree};
use crate::spatial::{Frame, rotate, rotated_about_x, rotated_about_y, rotated_about_z};

/// Derivatives of the target with respect to the small motions on either side of a joint.
type MotionLevers = Box<[Vector3<f64>; 2 * MOTION_LEN]>;

/// Derivatives of a rigid arm, one elementary motion (rotation or translation) at a time.
pub(super) struct RigidDerivatives {
    links: Vec<Link>,
    tree: Tree,
    inputs: Vec<Input>,
    /// Derivatives of the target in the current pose, link by link, from the last to the first.
    carried: Vec<LinkDerivatives>,
    /// Derivatives with respect to the six placement numbers, for those links that have a
    /// placement.
    placed: Vec<[Vector3<f64>; 6]>,
}

/// Link whose parameters are dual-number variables, with the index of the input for each of its
/// elementary motions; `None` for motions without an input.
struct Link {
    joint: Joint<Dual64>,
    /// Inputs of α, a, θ, d, β.
    inputs: [Option<usize>; 5],
    /// Inputs of x, y, z, roll, pitch, yaw of the placement.
    placing: [Option<usize>; 6],
    /// Inputs of the small motions on either side of the joint.
    moving: [Option<usize>; 2 * MOTION_LEN],
}

/// Derivatives of the target with respect to α, a, θ, d, β of a link, each in the frame before its
/// motion, and the joint's coordinates.
struct LinkDerivatives {
    derivatives: [Vector3<f64>; 5],
    coordinates: Coordinates<Dual64>,
    /// Derivatives with respect to the small motions; `None` if the link has none.
    motions: Option<MotionLevers>,
}

impl RigidDerivatives {
    /// Creates the derivatives of an arm with respect to `inputs`.
    pub fn new(arm: &Arm<f64>, inputs: Vec<Input>) -> Self {
        let mut links: Vec<Link> = arm.joints.iter().map(Link::seeded).collect();
        for (index, input) in inputs.iter().enumerate() {
            if let ParameterSite::Joint { joint, field } = input.site {
                if let Some(place) =
                    JointField::GEOMETRY.iter().position(|&geometric| geometric == field)
                {
                    links[joint].inputs[place] = Some(index);
                }
                if let Some(place) = field.placement() {
                    links[joint].placing[place] = Some(index);
                }
                if let Some(place) = field.motion() {
                    links[joint].moving[place] = Some(index);
                }
            }
        }
        Self { links, tree: arm.tree.clone(), inputs, carried: Vec::new(), placed: Vec::new() }
    }

    /// Writes the derivatives of a target with respect to all inputs into `rows`. The target is
    /// given by its position \[m\] in the frame of the joint `tip`. Returns the frame of `tip`,
    /// measuring frame.
    #[inline]
    pub fn write(
        &mut self,
        (commanded, setup): (&PoseView, &PoseView),
        base: &Frame<f64>,
        (tip, target): (usize, &Vector3<f64>),
        rows: &mut Rows,
    ) -> Frame<f64> {
        let Self { links, tree, inputs, carried, placed } = self;
        carried.clear();
        placed.clear();
        let mut point = *target;
        let links_on_path = || {
            let path = links.iter().zip(setup.configuration).enumerate();
            path.filter(|(joint, _)| tree.path_contains(*joint, tip))
        };
        for (joint, (link, &q)) in links_on_path().rev() {
            let coordinates = link.joint.coordinates(q);
            let motion = link.motion(setup.motion(joint));
            let (derivatives, motions);
            (derivatives, motions, point) =
                link.carry_inward(&coordinates, &point, motion.as_ref());
            carried.push(LinkDerivatives { derivatives, coordinates, motions });
            if let Some(placement) = &link.joint.placement {
                let derivatives;
                (derivatives, point) = carry_through(placement, &point);
                placed.push(derivatives);
            }
        }
        let mut frame = *base;
        for ((joint, (link, _)), LinkDerivatives { derivatives, coordinates, motions }) in
            links_on_path().zip(carried.iter().rev())
        {
            if let Some((placement, derivatives)) =
                link.joint.placement.as_ref().and_then(|placement| Some((placement, placed.pop()?)))
            {
                advance_through(placement, &mut frame, |place, frame| {
                    if let Some(input) = link.placing[place] {
                        rows.put_input(
                            &inputs[input],
                            commanded,
                            &frame.vector(&derivatives[place]),
                        );
                    }
                });
            }
            let motion = link.motion(setup.motion(joint));
            let write_motion = |side: usize, frame: &Frame<f64>, rows: &mut Rows| {
                let Some(motions) = motions else { return };
                for place in MOTION_STARTS[side]..MOTION_STARTS[side] + MOTION_LEN {
                    if let Some(input) = link.moving[place] {
                        let column = frame.vector(&motions[place]);
                        rows.put_input(&inputs[input], commanded, &column);
                    }
                }
            };
            link.advance(coordinates, &mut frame, motion.as_ref(), |place, frame| match place {
                LinkMotion::Geometry(place) => {
                    if let Some(input) = link.inputs[place] {
                        let column = frame.vector(&derivatives[place]);
                        rows.put_input(&inputs[input], commanded, &column);
                    }
                }
                LinkMotion::Motion(side) => write_motion(side, frame, rows),
            });
        }
        frame
    }
}

impl Link {
    fn seeded(joint: &Joint<f64>) -> Self {
        let seed = |value: f64| Dual64::from(value).derivative();
        let angle = |angle: Angle<f64>| Angle::new(seed(angle.value));
        let (alpha, beta) = (angle(joint.alpha), angle(joint.beta));
        let (a, theta, d) = (seed(joint.a), seed(joint.theta), seed(joint.d));
        let placement = joint.placement.map(|placement| Placement {
            xyz: placement.xyz.map(seed),
            rpy: placement.rpy.map(angle),
        });
        Self {
            joint: Joint { placement, alpha, a, theta, d, beta, ..joint.lift() },
            inputs: [None; 5],
            placing: [None; 6],
            moving: [None; 2 * MOTION_LEN],
        }
    }

    /// Returns the link's small motions in a pose; `None` if the link has none.
    fn motion(&self, of_pose: Option<&[f64; 2 * MOTION_LEN]>) -> Option<[f64; 2 * MOTION_LEN]> {
        self.joint.motion.as_ref()?;
        Some(of_pose.copied().unwrap_or_default())
    }

    /// Transforms a point \[m\] from the frame behind the link to the frame before it. Returns its
    /// derivatives with respect to α, a, θ, d, β, those with respect to small motions, if any, and
    /// the point.
    #[inline]
    fn carry_inward(
        &self,
        at: &Coordinates<Dual64>,
        point: &Vector3<f64>,
        motion: Option<&[f64; 2 * MOTION_LEN]>,
    ) -> ([Vector3<f64>; 5], Option<MotionLevers>, Vector3<f64>) {
        let Joint { alpha, a, beta, .. } = &self.joint;
        let mut motions = motion.map(|_| Box::new([Vector3::zeros(); 2 * MOTION_LEN]));
        let mut displaced = |side: usize, point: Vector3<f64>| match (motion, &mut motions) {
            (Some(motion), Some(motions)) => displace(motion, motions, MOTION_STARTS[side], &point),
            _ => point,
        };
        let point = displaced(1, *point);
        let (by_beta, point) = split_derivative(&rotated_about_y(beta.sin_cos, &point));
        let (by_d, point) =
            split_derivative(&Vector3::new(point.x.into(), point.y.into(), at.offset + point.z));
        let (by_theta, point) = split_derivative(&rotated_about_z(at.angle, &point));
        let point = displaced(0, point);
        let (by_a, point) =
            split_derivative(&Vector3::new(*a + point.x, point.y.into(), point.z.into()));
        let (by_alpha, point) = split_derivative(&rotated_about_x(alpha.sin_cos, &point));
        ([by_alpha, by_a, by_theta, by_d, by_beta], motions, point)
    }

    /// Moves `frame` from before the link to behind it. Calls `before` with each elementary motion
    /// and the frame before it.
    #[inline]
    fn advance(
        &self,
        at: &Coordinates<Dual64>,
        frame: &mut Frame<f64>,
        motion: Option<&[f64; 2 * MOTION_LEN]>,
        mut before: impl FnMut(LinkMotion, &Frame<f64>),
    ) {
        let Joint { alpha, a, beta, .. } = &self.joint;
        let displaced = |side: usize,
                         frame: &mut Frame<f64>,
                         before: &mut dyn FnMut(LinkMotion, &Frame<f64>)| {
            if let Some(motion) = motion {
                before(LinkMotion::Motion(side), frame);
                let [translation, rotation] = translation_and_rotation(motion, MOTION_STARTS[side]);
                frame.translate(&translation);
                frame.rotate(&rotation);
            }
        };
        before(LinkMotion::Geometry(0), frame);
        frame.rotate_x(real_parts(alpha.sin_cos));
        before(LinkMotion::Geometry(1), frame);
        frame.translate_x(a.re);
        displaced(0, frame, &mut before);
        before(LinkMotion::Geometry(2), frame);
        frame.rotate_z(real_parts(at.angle));
        before(LinkMotion::Geometry(3), frame);
        frame.translate_z(at.offset.re);
        before(LinkMotion::Geometry(4), frame);
        frame.rotate_y(real_parts(beta.sin_cos));
        displaced(1, frame, &mut before);
    }
}

/// Elementary motion of a link: one of its geometry, or a small motion on one side of the joint.
#[derive(Clone, Copy)]
enum LinkMotion {
    Geometry(usize),
    Motion(usize),
}

/// Returns the translation \[m\] and the rotation vector \[rad\] of the small motion whose six
/// numbers start at `first`.
fn translation_and_rotation(motion: &[f64; 2 * MOTION_LEN], first: usize) -> [Vector3<f64>; 2] {
    [first, first + 3].map(|first| Vector3::from_column_slice(&motion[first..first + 3]))
}

/// Transforms a point \[m\] from the frame behind a small motion to the frame before it. Writes its
/// derivatives, in the frame before the motion, into `motions`.
fn displace(
    motion: &[f64; 2 * MOTION_LEN],
    motions: &mut [Vector3<f64>; 2 * MOTION_LEN],
    first: usize,
    point: &Vector3<f64>,
) -> Vector3<f64> {
    let [translation, rotation] = translation_and_rotation(motion, first);
    let dual = point.map(Dual64::from);
    for axis in 0..3 {
        motions[first + axis] = Vector3::ith(axis, 1.0);
        let mut seeded = rotation.map(Dual64::from);
        seeded[axis] = seeded[axis].derivative();
        motions[first + 3 + axis] = split_derivative(&rotate(&seeded, &dual)).0;
    }
    translation + rotate(&rotation, point)
}

/// Transforms a point \[m\] from the frame behind a placement to the frame before it. Returns first
/// its derivatives with respect to x, y, z, roll, pitch, yaw, each in the frame before its motion,
/// then the point.
fn carry_through(
    placement: &Placement<Dual64>,
    point: &Vector3<f64>,
) -> ([Vector3<f64>; 6], Vector3<f64>) {
    let [roll, pitch, yaw] = &placement.rpy;
    let (by_roll, point) = split_derivative(&rotated_about_x(roll.sin_cos, point));
    let (by_pitch, point) = split_derivative(&rotated_about_y(pitch.sin_cos, &point));
    let (by_yaw, point) = split_derivative(&rotated_about_z(yaw.sin_cos, &point));
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    ([x, y, z, by_roll, by_pitch, by_yaw], point + placement.xyz.map(|coordinate| coordinate.re))
}

/// Moves `frame` from before a placement to behind it. Calls `before` with the index of each number
/// (x, y, z, roll, pitch, yaw) and the frame before its motion.
fn advance_through(
    placement: &Placement<Dual64>,
    frame: &mut Frame<f64>,
    mut before: impl FnMut(usize, &Frame<f64>),
) {
    let [roll, pitch, yaw] = &placement.rpy;
    (0..3).for_each(|axis| before(axis, frame));
    frame.translate(&placement.xyz.map(|coordinate| coordinate.re));
    before(5, frame);
    frame.rotate_z(real_parts(yaw.sin_cos));
    before(4, frame);
    frame.rotate_y(real_parts(pitch.sin_cos));
    before(3, frame);
    frame.rotate_x(real_parts(roll.sin_cos));
}

/// Returns the real parts of (sin, cos).
fn real_parts((sin, cos): (Dual64, Dual64)) -> (f64, f64) {
    (sin.re, cos.re)
}

/// Splits a dual vector into its derivative and its real part.
#[inline]
fn split_derivative(vector: &Vector3<Dual64>) -> (Vector3<f64>, Vector3<f64>) {
    (vector.map(|coordinate| coordinate.eps), vector.map(|coordinate| coordinate.re))
}
