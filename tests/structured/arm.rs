//! An arm calculated apart from the library: products of 4 × 4 matrices, and joints that twist
//! until their springs carry the loads.

use nalgebra::{Matrix4, Rotation3, Vector3};

/// Kind of motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Revolute,
    Prismatic,
    Fixed,
}

/// Constant geometry of a joint.
#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Rx(α) Tx(a) Rz(θ+q) Tz(d+q) Ry(β); α, a, θ, d, β.
    Hayati([f64; 5]),
    /// Txyz Rz(yaw) Ry(pitch) Rx(roll) of a fixed joint; x, y, z, roll, pitch, yaw.
    Origin([f64; 6]),
}

/// Joint with what it carries; SI units.
#[derive(Debug, Clone)]
pub struct Joint {
    pub kind: Kind,
    pub geometry: Geometry,
    /// Number of the joint whose frame carries it, from 1; 0: the base.
    pub parent: usize,
    /// Range of the command.
    pub limits: Option<[f64; 2]>,
    /// Joint that this one follows, counted from 0, and the ratio of the commands.
    pub mimic: Option<(usize, f64)>,
    /// Torsional stiffness about the axis \[N·m/rad\].
    pub stiffness: Option<f64>,
    /// Mass \[kg\] and centre of mass in the frame behind the joint.
    pub bodies: Vec<(f64, Vector3<f64>)>,
}

/// Arm with the loads on its joints.
#[derive(Debug, Clone)]
pub struct Arm {
    pub joints: Vec<Joint>,
    pub gravity: Vector3<f64>,
    /// True if the loads act on the bent arm.
    pub deflected: bool,
    /// Joint that carries the payload, counted from 0, and its place in that frame.
    pub payload_on: usize,
    pub payload_at: Vector3<f64>,
    /// Payload of rows that name none \[kg\].
    pub payload_mass: f64,
}

pub fn turn(axis: Vector3<f64>, angle: f64) -> Matrix4<f64> {
    Rotation3::from_scaled_axis(axis * angle).to_homogeneous()
}

pub fn shift(by: Vector3<f64>) -> Matrix4<f64> {
    Matrix4::new_translation(&by)
}

/// Returns the transform with a translation and a rotation vector.
pub fn placed(at: Vector3<f64>, rotation: Vector3<f64>) -> Matrix4<f64> {
    shift(at) * Rotation3::from_scaled_axis(rotation).to_homogeneous()
}

/// Returns the transform with a translation and roll, pitch, yaw.
pub fn origin(numbers: &[f64; 6]) -> Matrix4<f64> {
    let [x, y, z, roll, pitch, yaw] = *numbers;
    shift(Vector3::new(x, y, z))
        * turn(Vector3::z(), yaw)
        * turn(Vector3::y(), pitch)
        * turn(Vector3::x(), roll)
}

pub fn point(frame: &Matrix4<f64>, at: &Vector3<f64>) -> Vector3<f64> {
    (frame * at.push(1.0)).xyz()
}

impl Joint {
    /// Returns the transform up to the joint's axis and the one behind it, at a coordinate.
    fn parts(&self, q: f64) -> [Matrix4<f64>; 2] {
        match &self.geometry {
            Geometry::Origin(numbers) => [origin(numbers), Matrix4::identity()],
            &Geometry::Hayati([alpha, a, theta, d, beta]) => {
                let (angle, length) = match self.kind {
                    Kind::Revolute => (theta + q, d),
                    Kind::Prismatic => (theta, d + q),
                    Kind::Fixed => (theta, d),
                };
                let before = turn(Vector3::x(), alpha) * shift(Vector3::x() * a);
                let after = turn(Vector3::z(), angle)
                    * shift(Vector3::z() * length)
                    * turn(Vector3::y(), beta);
                [before, after]
            }
        }
    }
}

impl Arm {
    /// Returns for each joint the frame on its axis and the frame behind it, arm base frame.
    pub fn frames(&self, q: &[f64]) -> Vec<[Matrix4<f64>; 2]> {
        let mut frames: Vec<[Matrix4<f64>; 2]> = Vec::new();
        for (joint, &q) in self.joints.iter().zip(q) {
            let start =
                joint.parent.checked_sub(1).map_or(Matrix4::identity(), |parent| frames[parent][1]);
            let [before, after] = joint.parts(q);
            frames.push([start * before, start * before * after]);
        }
        frames
    }

    /// Returns true if `joint` leads to the frame of `tip`.
    pub fn leads(&self, joint: usize, tip: usize) -> bool {
        let mut at = tip + 1;
        while at > 0 {
            if at == joint + 1 {
                return true;
            }
            at = self.joints[at - 1].parent;
        }
        false
    }

    /// Returns the moments of all loads about the axes of the joints \[N·m\].
    fn moments(&self, frames: &[[Matrix4<f64>; 2]], payload: f64) -> Vec<f64> {
        let bodies =
            self.joints.iter().enumerate().flat_map(|(on, joint)| {
                joint.bodies.iter().map(move |(mass, at)| (on, *mass, *at))
            });
        let loads: Vec<(usize, Vector3<f64>, Vector3<f64>)> = bodies
            .chain([(self.payload_on, payload, self.payload_at)])
            .map(|(on, mass, at)| (on, point(&frames[on][1], &at), self.gravity * mass))
            .collect();
        (0..self.joints.len())
            .map(|joint| {
                let axis = frames[joint][0].fixed_view::<3, 1>(0, 2).into_owned();
                let centre = point(&frames[joint][0], &Vector3::zeros());
                let of = |(on, at, force): &(usize, Vector3<f64>, Vector3<f64>)| {
                    if self.leads(joint, *on) { axis.dot(&(at - centre).cross(force)) } else { 0.0 }
                };
                loads.iter().map(of).sum()
            })
            .collect()
    }

    /// Returns the frames behind the joints in equilibrium, at coordinates that carry no load.
    /// Returns `None` if the arm does not come to rest.
    pub fn rest(&self, q: &[f64], payload: Option<f64>) -> Option<Vec<Matrix4<f64>>> {
        let payload = payload.unwrap_or(self.payload_mass);
        let mut bent = q.to_vec();
        for pass in 0..200 {
            let moments = self.moments(&self.frames(&bent), payload);
            let next: Vec<f64> = (0..q.len())
                .map(|k| q[k] + self.joints[k].stiffness.map_or(0.0, |k_z| moments[k] / k_z))
                .collect();
            let moved = next.iter().zip(&bent).map(|(next, bent)| (next - bent).abs());
            let is_at_rest = moved.fold(0.0, f64::max) < 1e-14;
            bent = next;
            if is_at_rest || !self.deflected && pass == 0 {
                return Some(self.frames(&bent).iter().map(|frames| frames[1]).collect());
            }
        }
        None
    }
}
