//! Predicted positions with their derivatives, by dual numbers where the structure of the arm keeps them small.
//!
//! A base or a target moves the position rigidly. On a rigid arm so does every parameter of a link: the point beyond is
//! carried through its one motion in dual numbers, and the frame before that motion chains on in plain numbers. On an
//! elastic arm every load moves too: what a parameter does to its own part is taken alone, and virtual work tells what that
//! does to the target; parameters that change loads go through the whole statics, one by one.

use nalgebra::{DVector, Vector3};
use num_dual::{Dual64, DualSVec64};

use super::driven::Commands;
use super::elastic::Elastic;
use super::inputs::{Input, inputs};
use super::observation::Observation;
use super::{Model, Pose};
use crate::arm::{Angle, Arm, Equilibrated, Joint, Setup};
use crate::fit::Block;
use crate::parameter::{Driver, JointField, Slot};
use crate::scalar::{gradient, seeded};
use crate::spatial::{Frame, Motion, rotation_axes};

/// The model linearised about one parameter vector; reused for every pose.
pub(super) struct Linearised {
    arm: Arm<f64>,
    commands: Commands,
    observation: Observation,
    /// Columns of what the measurement does: scale, and shifts by axis and driver.
    scale: Option<usize>,
    shifts: Vec<(usize, Driver, usize)>,
    bases: Vec<Base>,
    targets: Vec<Target>,
    inner: Inner,
    rest: Equilibrated,
}

/// A base frame, how its rotation turns with its rotation vector, and the columns of its six coordinates.
pub(super) struct Base {
    pub frame: Frame<f64>,
    turning: [Frame<f64>; 3],
    columns: [Option<usize>; 6],
}

pub(super) struct Target {
    pub position: Vector3<f64>,
    columns: [Option<usize>; 3],
}

/// How the arm's own parameters are differentiated.
enum Inner {
    /// Motion by motion; `passed` are those of the pose at hand.
    Rigid { links: Vec<Link>, inputs: Vec<Input>, passed: Vec<Passed> },
    /// Through the statics.
    Elastic(Box<Elastic>),
}

/// A link of a rigid arm with each of its five parameters seeded, and which input each is.
struct Link {
    joint: Joint<Dual64>,
    inputs: [Option<usize>; 5],
}

/// A motion of a rigid arm, its parameter seeded, with the frame before it (measuring frame) and which input it is.
struct Passed {
    motion: Motion<Dual64>,
    before: Frame<f64>,
    input: Option<usize>,
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
        let (mut scale, mut shifts) = (None, Vec::new());
        for (column, &k) in unknowns.iter().enumerate() {
            let parameter = &model.parameters[k];
            match parameter.slot {
                Slot::Base { base, axis } => bases[base].columns[axis] = Some(column),
                Slot::Target { target, axis } => targets[target].columns[axis] = Some(column),
                Slot::Scale => scale = Some(column),
                Slot::Shift { axis } => shifts.push((axis, parameter.driver, column)),
                Slot::Joint { .. } | Slot::Beam { .. } | Slot::Arm(_) => {}
            }
        }
        let inputs = inputs(model, unknowns);
        let inner = if arm.is_elastic() {
            Inner::Elastic(Box::new(Elastic::new(model, x, &arm, inputs)))
        } else {
            Inner::Rigid { links: links(&arm, &inputs), inputs, passed: Vec::new() }
        };
        let commands = Commands::new(model, x.as_slice());
        let observation = Observation::new(model, x.as_slice());
        Self { arm, commands, observation, scale, shifts, bases, targets, inner, rest: Equilibrated::default() }
    }

    /// Writes the whitened residual of a pose and its derivatives into three rows of a block of zeros.
    #[inline]
    pub fn write(&mut self, pose: &Pose, block: &mut Block, row: usize) {
        let (base, target) = (&self.bases[pose.base], &self.targets[pose.target]);
        let setup = self.commands.apply(&pose.setup);
        let mut rows = Rows { block, row, scale: -1.0 / pose.sigma };
        let Some(last) = self.inner.last_frame(&self.arm, &setup, base, &mut self.rest) else {
            rows.put(rows.block.parameters(), &Vector3::from_element(f64::NAN));
            return;
        };
        let predicted = last.point(&target.position);
        let seen = self.observation.of(&predicted, &pose.setup);
        rows.put(rows.block.parameters(), &(seen - pose.measured));
        rows.put_if(self.scale, || predicted);
        for &(axis, driver, column) in &self.shifts {
            rows.put(column, &(Vector3::ith(axis, driver.value(&pose.setup))));
        }
        rows.scale *= 1.0 + self.observation.scale;
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
        self.inner.write(&pose.setup, &setup, base, target, &mut self.rest, &mut rows);
    }
}

/// Three rows of a block.
pub(super) struct Rows<'a> {
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

    /// Writes the derivative with respect to an input for each parameter that acts there.
    #[inline]
    pub fn put_input(&mut self, input: &Input, commanded: &Setup, derivative: &Vector3<f64>) {
        if let Some(column) = input.column {
            self.put(column, derivative);
        }
        for &(column, driver) in &input.driven {
            self.put(column, &(derivative * driver.value(commanded)));
        }
    }
}

impl Inner {
    /// The last frame of a pose, measuring frame; `None` where it has no equilibrium.
    fn last_frame(
        &mut self,
        arm: &Arm<f64>,
        setup: &Setup,
        base: &Base,
        rest: &mut Equilibrated,
    ) -> Option<Frame<f64>> {
        match self {
            Self::Rigid { links, passed, .. } => {
                let mut frame = base.frame;
                passed.clear();
                for (link, &q) in links.iter().zip(setup.configuration) {
                    for (motion, input) in link.joint.motions(q).into_iter().zip(link.inputs) {
                        passed.push(Passed { motion, before: frame, input });
                        motion.re().apply(&mut frame);
                    }
                }
                Some(frame)
            }
            Self::Elastic(elastic) => {
                arm.equilibrate(setup, &mut elastic.real, rest).ok().map(|()| base.frame.seen(&rest.frame))
            }
        }
    }

    /// Writes the derivatives with respect to the arm's own parameters, once its last frame is known.
    ///
    /// `setup` is the pose as the joints take it, `commanded` as it was commanded.
    fn write(
        &mut self,
        commanded: &Setup,
        setup: &Setup,
        base: &Base,
        target: &Target,
        rest: &mut Equilibrated,
        rows: &mut Rows,
    ) {
        match self {
            Self::Rigid { passed, inputs, .. } => {
                let mut after = target.position;
                for Passed { motion, before, input } in passed.iter().rev() {
                    let moved = motion.carry(&after);
                    if let Some(input) = input {
                        let derivative = before.vector(&moved.map(|coordinate| coordinate.eps));
                        rows.put_input(&inputs[*input], commanded, &derivative);
                    }
                    after = moved.map(|coordinate| coordinate.re);
                }
            }
            Self::Elastic(elastic) => elastic.write(commanded, setup, base, target, rest, rows),
        }
    }
}

/// The links of a rigid arm, each with its own parameters seeded.
fn links(arm: &Arm<f64>, inputs: &[Input]) -> Vec<Link> {
    let seed = |value: f64| Dual64::from(value).derivative();
    let link = |joint: &Joint<f64>| {
        let angle = |angle: Angle<f64>| Angle::new(seed(angle.value));
        let (alpha, beta) = (angle(joint.alpha), angle(joint.beta));
        let (a, theta, d) = (seed(joint.a), seed(joint.theta), seed(joint.d));
        Link { joint: Joint { alpha, a, theta, d, beta, ..joint.lift() }, inputs: [None; 5] }
    };
    let mut links: Vec<Link> = arm.joints.iter().map(link).collect();
    for (index, input) in inputs.iter().enumerate() {
        if let Slot::Joint { joint, field } = input.slot
            && let Some(place) = JointField::GEOMETRY.iter().position(|&geometric| geometric == field)
        {
            links[joint].inputs[place] = Some(index);
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
