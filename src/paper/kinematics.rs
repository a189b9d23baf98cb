//! Frames of the rigid arm, eq. 1-2 of the paper.

use nalgebra::{Matrix3, Matrix4, Rotation3, Vector3};

use crate::problem::{Joint, JointKind, Problem};
use crate::spatial::Frame;

/// Modified Denavit–Hartenberg parameters of a joint and the link before it, `E_i` of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mdh {
    /// Twist angle α \[rad\].
    pub alpha: f64,
    /// Link length a \[m\].
    pub a: f64,
    /// Joint angle θ \[rad\].
    pub theta: f64,
    /// Joint offset d \[m\].
    pub d: f64,
    /// Parallelism angle β \[rad\].
    pub beta: f64,
}

impl Mdh {
    /// Returns the parameters of a joint that the problem declares.
    pub fn nominal(joint: &Joint) -> Self {
        Self { alpha: joint.alpha, a: joint.a, theta: joint.theta, d: joint.d, beta: joint.beta }
    }

    /// Returns mutable references to the five values, in the order of `e_i` = [Δα Δa Δθ Δd Δβ].
    pub fn fields_mut(&mut self) -> [&mut f64; 5] {
        [&mut self.alpha, &mut self.a, &mut self.theta, &mut self.d, &mut self.beta]
    }

    /// Returns the parameters with the configuration coordinate q added to θ of a revolute joint
    /// \[rad\] or to d of a prismatic one \[m\]; a fixed joint stays as it is.
    #[must_use]
    pub fn at(mut self, kind: JointKind, q: f64) -> Self {
        match kind {
            JointKind::Revolute => self.theta += q,
            JointKind::Prismatic => self.d += q,
            JointKind::Fixed => {}
        }
        self
    }

    /// Returns `T_i1` = Rx(α) Tx(a), the transform from frame i − 1 to the tip of the link before
    /// joint i [Chen2021, eq. 20].
    pub fn to_tip(&self) -> Matrix4<f64> {
        rotation(Vector3::x() * self.alpha) * translation(Vector3::x() * self.a)
    }

    /// Returns `T_i2` = Rz(θ) Tz(d) Ry(β), the transform from the tip of the link to frame i
    /// [Chen2021, eq. 20].
    pub fn from_tip(&self) -> Matrix4<f64> {
        rotation(Vector3::z() * self.theta)
            * translation(Vector3::z() * self.d)
            * rotation(Vector3::y() * self.beta)
    }

    /// Returns `T_i` = Rx(α) Tx(a) Rz(θ) Tz(d) Ry(β), the transform from frame i − 1 to frame i
    /// [Chen2021, eq. 1].
    pub fn transform(&self) -> Matrix4<f64> {
        self.to_tip() * self.from_tip()
    }
}

/// Returns the homogeneous transform that rotates by a rotation vector \[rad\].
fn rotation(rotation_vector: Vector3<f64>) -> Matrix4<f64> {
    Rotation3::new(rotation_vector).to_homogeneous()
}

/// Returns the homogeneous transform that translates by a vector \[m\].
fn translation(vector: Vector3<f64>) -> Matrix4<f64> {
    Matrix4::new_translation(&vector)
}

/// Returns the rotation matrix and the origin \[m\] of a homogeneous transform.
pub(super) fn split(transform: &Matrix4<f64>) -> (Matrix3<f64>, Vector3<f64>) {
    (
        transform.fixed_view::<3, 3>(0, 0).into_owned(),
        transform.fixed_view::<3, 1>(0, 3).into_owned(),
    )
}

/// Frames of the rigid arm in one configuration.
///
/// The end point of the paper is the origin of frame n, `U_{n+1}` = I. Here `U_{n+1}` =
/// Trans(target), since a point on axis n is moved neither by Δθ nor by Δβ of the last joint. The
/// inertial frame of the paper is the base frame of the arm. Measured positions are in the
/// measuring frame, in which the problem's `base` locates the arm.
#[derive(Debug, Clone)]
pub struct Chain {
    /// Parameters of the joints, with the configuration added.
    pub links: Vec<Mdh>,
    /// Transform from the measuring frame to the base: the base's pose in the measuring frame.
    pub base: Matrix4<f64>,
    /// Products `before[k]` = T₁ … T_k, k = 0 … n: the pose of frame k in the base frame.
    pub before: Vec<Matrix4<f64>>,
    /// Products `after[k]` = T_{k+1} … T_n Trans(target), k = 0 … n, the paper's `U_{k+1}`: the
    /// pose of the end frame in frame k.
    pub after: Vec<Matrix4<f64>>,
}

impl Chain {
    /// Computes the frames of `problem` with `geometry` at configuration q, shape = (joints)
    /// \[rad\] or \[m\]; missing coordinates are 0.
    pub fn new(problem: &Problem, geometry: &[Mdh], configuration: &[f64]) -> Self {
        let q = configuration.iter().copied().chain(std::iter::repeat(0.0));
        let declared = geometry.iter().zip(&problem.joints);
        let links: Vec<Mdh> =
            declared.zip(q).map(|((link, joint), q)| link.at(joint.kind, q)).collect();
        let transforms: Vec<Matrix4<f64>> = links.iter().map(Mdh::transform).collect();
        let mut before = vec![Matrix4::identity()];
        let mut product = Matrix4::identity();
        for transform in &transforms {
            product *= transform;
            before.push(product);
        }
        let mut product = translation(problem.tool.target);
        let mut after = vec![product];
        for transform in transforms.iter().rev() {
            product = transform * product;
            after.push(product);
        }
        after.reverse();
        let frame = Frame::from_rotation_vector(problem.base.translation, &problem.base.rotation);
        let mut base = Matrix3::from_columns(&frame.axes).to_homogeneous();
        base.fixed_view_mut::<3, 1>(0, 3).copy_from(&frame.origin);
        Self { links, base, before, after }
    }

    /// Returns T = T₁ … T_n multiplied by base and target: the pose of the end frame in the
    /// measuring frame [Chen2021, eq. 2].
    pub fn end(&self) -> Matrix4<f64> {
        self.base * self.after[0]
    }

    /// Returns the position `PE_nom` of the end point of the rigid arm, measuring frame \[m\].
    pub fn position(&self) -> Vector3<f64> {
        split(&self.end()).1
    }
}
