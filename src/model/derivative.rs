//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps them small.
//!
//! A base or a target moves the position rigidly. On a rigid arm so does every link: its five parameters are carried
//! through its own transform only, and chained with the frames before and the point after it in plain numbers. On an
//! elastic arm every load moves too, so the parameters go through the whole statics in chunks.

use nalgebra::{DVector, Vector3};
use num_dual::DualSVec64;

use super::{Model, Pose};
use crate::arm::{Angle, Arm, Equilibrated, Joint, Response, Workspace};
use crate::fit::Block;
use crate::parameter::{JointField, Slot};
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, rotate};

/// Parameters seeded at once on an elastic arm.
const CHUNK: usize = 8;
/// Geometric parameters of a link.
const LINK: usize = 5;

type ChunkDual = DualSVec64<CHUNK>;
type LinkDual = DualSVec64<LINK>;

/// The model linearised about one parameter vector; reused for every pose.
pub(super) struct Linearised {
    arm: Arm<f64>,
    bases: Vec<Base>,
    targets: Vec<Target>,
    inner: Inner,
    rest: Equilibrated,
}

/// A base frame, how its rotation turns with its rotation vector, and the columns of its six coordinates.
struct Base {
    frame: Frame<f64>,
    turning: [Frame<f64>; 3],
    columns: [Option<usize>; 6],
}

struct Target {
    position: Vector3<f64>,
    columns: [Option<usize>; 3],
}

/// How the arm's own parameters are differentiated.
enum Inner {
    /// Link by link; `frames` are those before each link of the pose at hand.
    Rigid { links: Vec<Link>, frames: Vec<Frame<f64>> },
    /// In chunks through the statics.
    Elastic { response: Box<Response>, chunks: Vec<Chunk>, memory: Box<(Workspace<f64>, Workspace<ChunkDual>)> },
}

/// A link of a rigid arm with its five parameters seeded, and their columns.
struct Link {
    joint: Joint<LinkDual>,
    columns: [Option<usize>; LINK],
}

/// The arm with up to [`CHUNK`] of its parameters seeded, and their columns.
struct Chunk {
    arm: Arm<ChunkDual>,
    columns: Vec<usize>,
}

impl Linearised {
    /// About the full parameter vector `x`; `unknowns[j]` is the parameter of column j.
    pub fn new(model: &Model, x: &DVector<f64>, unknowns: &[usize]) -> Self {
        let arm = model.arm(|k| x[k]);
        let mut bases: Vec<Base> = model
            .base_poses(x.as_slice())
            .into_iter()
            .map(|pose| Base {
                frame: Frame::from_rotation_vector(pose.translation, &pose.rotation),
                turning: turning(&pose.rotation),
                columns: [None; 6],
            })
            .collect();
        let mut targets: Vec<Target> = model
            .target_positions(x.as_slice())
            .into_iter()
            .map(|position| Target { position, columns: [None; 3] })
            .collect();
        let mut own = Vec::new();
        for (column, &k) in unknowns.iter().enumerate() {
            match model.parameters[k].slot {
                Slot::Base { base, axis } => bases[base].columns[axis] = Some(column),
                Slot::Target { target, axis } => targets[target].columns[axis] = Some(column),
                Slot::Joint { .. } | Slot::Beam { .. } => own.push((column, k)),
            }
        }
        let inner = if arm.is_elastic() {
            let chunks = own.chunks(CHUNK).map(|part| Chunk {
                arm: model.arm(|k| seeded(x[k], part.iter().position(|&(_, seeded)| seeded == k))),
                columns: part.iter().map(|&(column, _)| column).collect(),
            });
            let response = Box::new(Response::new(&arm));
            Inner::Elastic { response, chunks: chunks.collect(), memory: Box::default() }
        } else {
            Inner::Rigid { links: links(model, &arm, &own), frames: Vec::new() }
        };
        Self { arm, bases, targets, inner, rest: Equilibrated::default() }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of zeros.
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let mut rows = Rows { block, row, scale: -1.0 / pose.sigma };
        let Some(last) = self.inner.last_frame(&self.arm, pose, &mut self.rest) else {
            rows.put(rows.block.parameters(), &Vector3::from_element(f64::NAN));
            return;
        };
        let in_arm = last.point(&target.position);
        let predicted = base.frame.point(&in_arm);
        rows.put(rows.block.parameters(), &(predicted - pose.measured));
        for (axis, &column) in base.columns.iter().enumerate() {
            if axis < 3 {
                rows.put_if(column, || Vector3::ith(axis, 1.0));
            } else {
                rows.put_if(column, || base.turning[axis - 3].vector(&in_arm));
            }
        }
        for (axis, &column) in target.columns.iter().enumerate() {
            rows.put_if(column, || base.frame.vector(&last.axes[axis]));
        }
        self.inner.write(pose, base, target, &mut self.rest, &mut rows);
    }
}

/// Three rows of a block.
struct Rows<'a> {
    block: &'a mut Block,
    row: usize,
    /// From a derivative of the prediction to one of the residual (measured − predicted) / σ.
    scale: f64,
}

impl Rows<'_> {
    fn put(&mut self, column: usize, derivative: &Vector3<f64>) {
        let out = &mut self.block.column_mut(column)[self.row..self.row + 3];
        out.copy_from_slice((derivative * self.scale).as_slice());
    }

    fn put_if(&mut self, column: Option<usize>, derivative: impl FnOnce() -> Vector3<f64>) {
        if let Some(column) = column {
            self.put(column, &derivative());
        }
    }
}

impl Inner {
    /// The last frame of a pose, arm base frame; `None` where it has no equilibrium.
    fn last_frame(&mut self, arm: &Arm<f64>, pose: &Pose, rest: &mut Equilibrated) -> Option<Frame<f64>> {
        match self {
            Self::Rigid { frames, .. } => {
                let mut frame = Frame::identity();
                frames.clear();
                for (joint, &q) in arm.joints.iter().zip(pose.setup.configuration) {
                    frames.push(frame);
                    joint.advance(&mut frame, q);
                }
                Some(frame)
            }
            Self::Elastic { memory, .. } => arm.equilibrate(&pose.setup, &mut memory.0, rest).ok().map(|()| rest.frame),
        }
    }

    /// Writes the derivatives with respect to the arm's own parameters, once its last frame is known.
    fn write(&mut self, pose: &Pose, base: &Base, target: &Target, rest: &mut Equilibrated, rows: &mut Rows) {
        match self {
            Self::Rigid { links, frames } => {
                let mut after = target.position;
                for (i, (link, frame)) in links.iter().zip(frames).enumerate().rev() {
                    let moved = link.joint.carry(&after, pose.setup.configuration[i]);
                    let gradients = moved.map(|coordinate| gradient(&coordinate));
                    for (k, &column) in link.columns.iter().enumerate() {
                        rows.put_if(column, || base.frame.vector(&frame.vector(&gradients.map(|g| g[k]))));
                    }
                    after = moved.map(|coordinate| coordinate.re);
                }
            }
            Self::Elastic { response, chunks, memory } => {
                if !chunks.is_empty() {
                    response.adjoint(&pose.setup, &target.position, rest);
                }
                for chunk in chunks {
                    let position = chunk.arm.target_position(&pose.setup, &target.position, rest, &mut memory.1);
                    let gradients = position.map(|coordinate| gradient(&coordinate));
                    for (k, &column) in chunk.columns.iter().enumerate() {
                        rows.put(column, &base.frame.vector(&gradients.map(|g| g[k])));
                    }
                }
            }
        }
    }
}

/// The links of a rigid arm, each with its own parameters seeded.
fn links(model: &Model, arm: &Arm<f64>, own: &[(usize, usize)]) -> Vec<Link> {
    let seed = |joint: &Joint<f64>| {
        let mut seeded_joint: Joint<LinkDual> = joint.lift();
        seeded_joint.alpha = Angle::new(seeded(joint.alpha.value, Some(0)));
        seeded_joint.a = seeded(joint.a, Some(1));
        seeded_joint.theta = seeded(joint.theta, Some(2));
        seeded_joint.d = seeded(joint.d, Some(3));
        seeded_joint.beta = Angle::new(seeded(joint.beta.value, Some(4)));
        seeded_joint
    };
    let mut links: Vec<Link> =
        arm.joints.iter().map(|joint| Link { joint: seed(joint), columns: [None; LINK] }).collect();
    for &(column, k) in own {
        if let Slot::Joint { joint, field } = model.parameters[k].slot
            && let Some(place) = JointField::GEOMETRY.iter().position(|&geometric| geometric == field)
        {
            links[joint].columns[place] = Some(column);
        }
    }
    links
}

/// Derivatives of a rotation exp(`[w]×`) with respect to the three coordinates of w, as the derivatives of its axes.
fn turning(w: &Vector3<f64>) -> [Frame<f64>; 3] {
    let seeded_w: Vector3<DualSVec64<3>> = Vector3::from_fn(|i, _| seeded(w[i], Some(i)));
    let axes = Frame::identity().axes.map(|axis| rotate(&seeded_w, &axis).map(|coordinate| gradient(&coordinate)));
    std::array::from_fn(|k| Frame { axes: axes.map(|axis| axis.map(|g| g[k])), origin: Vector3::zeros() })
}
