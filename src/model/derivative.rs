//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps them small.
//!
//! A base or a target moves the position rigidly. On a rigid arm so does every parameter of a link: the point beyond is
//! carried through its one motion in dual numbers, and the frame before that motion chains on in plain numbers. On an
//! elastic arm every load moves too, so the parameters go through the whole statics in chunks.

use nalgebra::{DVector, Vector3};
use num_dual::{Dual64, DualSVec64};

use super::{Model, Pose};
use crate::arm::{Angle, Arm, Equilibrated, Joint, Response, Workspace};
use crate::fit::Block;
use crate::parameter::{JointField, Slot};
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, Motion, rotation_axes};

/// Parameters seeded at once on an elastic arm.
const CHUNK: usize = 10;

type ChunkDual = DualSVec64<CHUNK>;

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
    /// Motion by motion; `passed` are those of the pose at hand.
    Rigid { links: Vec<Link>, passed: Vec<Passed> },
    /// In chunks through the statics.
    Elastic(Box<Elastic>),
}

/// An elastic arm, chunk by chunk, with memory for its walks.
struct Elastic {
    response: Response,
    chunks: Vec<Chunk>,
    real: Workspace<f64>,
    ws: Workspace<ChunkDual>,
}

/// A link of a rigid arm with each of its five parameters seeded, and their columns.
struct Link {
    joint: Joint<Dual64>,
    columns: [Option<usize>; 5],
}

/// A motion of a rigid arm, its parameter seeded, with the frame before it (measuring frame) and its column.
struct Passed {
    motion: Motion<Dual64>,
    before: Frame<f64>,
    column: Option<usize>,
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
        // In the order of the arm: a chunk costs less the further out its first parameter is, for all before it is constant.
        own.sort_by_key(|&(_, k)| match model.parameters[k].slot {
            Slot::Joint { joint, .. } | Slot::Beam { joint, .. } => joint,
            Slot::Base { .. } | Slot::Target { .. } => usize::MAX,
        });
        let inner = if arm.is_elastic() {
            let chunks = own.chunks(CHUNK).map(|part| Chunk {
                arm: model.arm(|k| seeded(x[k], part.iter().position(|&(_, seeded)| seeded == k))),
                columns: part.iter().map(|&(column, _)| column).collect(),
            });
            Inner::Elastic(Box::new(Elastic {
                response: Response::new(&arm),
                chunks: chunks.collect(),
                real: Workspace::default(),
                ws: Workspace::default(),
            }))
        } else {
            Inner::Rigid { links: links(model, &arm, &own), passed: Vec::new() }
        };
        Self { arm, bases, targets, inner, rest: Equilibrated::default() }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of zeros.
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let mut rows = Rows { block, row, scale: -1.0 / pose.sigma };
        let Some(last) = self.inner.last_frame(&self.arm, pose, base, &mut self.rest) else {
            rows.put(rows.block.parameters(), &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = last.point(&target.position);
        rows.put(rows.block.parameters(), &(predicted - pose.measured));
        for (axis, &column) in base.columns.iter().enumerate() {
            if axis < 3 {
                rows.put_if(column, || Vector3::ith(axis, 1.0));
            } else {
                let in_arm = || base.frame.resolve(&(predicted - base.frame.origin));
                rows.put_if(column, || base.turning[axis - 3].vector(&in_arm()));
            }
        }
        for (axis, &column) in target.columns.iter().enumerate() {
            rows.put_if(column, || last.axes[axis]);
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
    /// The last frame of a pose, measuring frame; `None` where it has no equilibrium.
    fn last_frame(&mut self, arm: &Arm<f64>, pose: &Pose, base: &Base, rest: &mut Equilibrated) -> Option<Frame<f64>> {
        match self {
            Self::Rigid { links, passed } => {
                let mut frame = base.frame;
                passed.clear();
                for (link, &q) in links.iter().zip(pose.setup.configuration) {
                    for (motion, column) in link.joint.motions(q).into_iter().zip(link.columns) {
                        passed.push(Passed { motion, before: frame, column });
                        motion.re().apply(&mut frame);
                    }
                }
                Some(frame)
            }
            Self::Elastic(elastic) => {
                arm.equilibrate(&pose.setup, &mut elastic.real, rest).ok().map(|()| base.frame.seen(&rest.frame))
            }
        }
    }

    /// Writes the derivatives with respect to the arm's own parameters, once its last frame is known.
    fn write(&mut self, pose: &Pose, base: &Base, target: &Target, rest: &mut Equilibrated, rows: &mut Rows) {
        match self {
            Self::Rigid { passed, .. } => {
                let mut after = target.position;
                for Passed { motion, before, column } in passed.iter().rev() {
                    let moved = motion.carry(&after);
                    rows.put_if(*column, || before.vector(&moved.map(|coordinate| coordinate.eps)));
                    after = moved.map(|coordinate| coordinate.re);
                }
            }
            Self::Elastic(elastic) => {
                let Elastic { response, chunks, ws, .. } = &mut **elastic;
                if !chunks.is_empty() {
                    response.adjoint(&pose.setup, &target.position, rest);
                }
                for chunk in chunks {
                    let position = chunk.arm.target_position(&pose.setup, &target.position, rest, ws);
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
    let seed = |value: f64| Dual64::from(value).derivative();
    let link = |joint: &Joint<f64>| {
        let angle = |angle: Angle<f64>| Angle::new(seed(angle.value));
        let (alpha, beta) = (angle(joint.alpha), angle(joint.beta));
        let (a, theta, d) = (seed(joint.a), seed(joint.theta), seed(joint.d));
        Link { joint: Joint { alpha, a, theta, d, beta, ..joint.lift() }, columns: [None; 5] }
    };
    let mut links: Vec<Link> = arm.joints.iter().map(link).collect();
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
    let axes = rotation_axes(&seeded_w).map(|axis| axis.map(|coordinate| gradient(&coordinate)));
    std::array::from_fn(|k| Frame { axes: axes.map(|axis| axis.map(|g| g[k])), origin: Vector3::zeros() })
}
