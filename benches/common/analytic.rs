//! The geometric Jacobian of a rigid arm written by hand, as a reference for the speed and the
//! values of automatic differentiation.

use std::ops::Range;

use flexcal::least_squares::{Block, LeastSquares};
use flexcal::model::parameter::{JointField, ParameterSite};
use flexcal::model::{Model, PoseResiduals};
use nalgebra::{DVector, Vector3};

/// Problem with the residuals of [`PoseResiduals`] for a rigid arm of revolute joints with its base
/// at the origin.
pub struct Analytic<'a> {
    residuals: &'a PoseResiduals<'a>,
    model: &'a Model,
    nominal: Vec<[f64; 5]>,
    target: Vector3<f64>,
}

/// Parameters of a link for one parameter vector, angles as (sine, cosine), with the column of the
/// Jacobian of each of α, a, θ, d, β.
struct Link {
    alpha: (f64, f64),
    a: f64,
    theta: f64,
    d: f64,
    beta: (f64, f64),
    columns: [Option<usize>; 5],
}

/// Axes and points of a link about and along which its parameters move the target in one pose.
#[derive(Clone, Copy, Default)]
struct LinkAxes {
    root: Vector3<f64>,
    x: Vector3<f64>,
    joint: Vector3<f64>,
    z: Vector3<f64>,
    end: Vector3<f64>,
    y: Vector3<f64>,
}

impl<'a> Analytic<'a> {
    /// Wraps `residuals`, those of an arm of six joints.
    pub fn new(model: &'a Model, residuals: &'a PoseResiduals<'a>) -> Self {
        let arm = model.arm(|_| 0.0);
        let links = arm.joints.iter().map(|j| [j.alpha.value, j.a, j.theta, j.d, j.beta.value]);
        Self { residuals, model, nominal: links.collect(), target: model.target_positions(&[])[0] }
    }

    /// Returns the links, the target in the last frame and the columns of the target's coordinates for
    /// the unknowns `x`.
    fn links(&self, x: &DVector<f64>) -> (Vec<Link>, Vector3<f64>, [Option<usize>; 3]) {
        let (mut values, mut columns) = (self.nominal.clone(), vec![[None; 5]; self.nominal.len()]);
        let (mut target, mut target_columns) = (self.target, [None; 3]);
        for (column, (&k, x)) in self.residuals.unknowns().iter().zip(x).enumerate() {
            match self.model.parameters[k].site {
                ParameterSite::Joint { joint, field } => {
                    let index = JointField::GEOMETRY.iter().position(|&f| f == field).unwrap();
                    values[joint][index] += x;
                    columns[joint][index] = Some(column);
                }
                ParameterSite::Target { axis, .. } => {
                    target[axis] += x;
                    target_columns[axis] = Some(column);
                }
                _ => unreachable!("not in this bench"),
            }
        }
        let links = values.iter().zip(columns).map(|(&[alpha, a, theta, d, beta], columns)| Link {
            alpha: alpha.sin_cos(),
            a,
            theta,
            d,
            beta: beta.sin_cos(),
            columns,
        });
        (links.collect(), target, target_columns)
    }
}

/// Turns the axes `u` and `v` in their plane by an angle given as (sine, cosine).
fn turn(u: &mut Vector3<f64>, v: &mut Vector3<f64>, (sin, cos): (f64, f64)) {
    (*u, *v) = (*u * cos + *v * sin, *v * cos - *u * sin);
}

/// Calls `visit` with the axes of each link from the base outwards, and returns the axes and the
/// origin of the last frame.
fn walk(
    links: &[Link],
    q: &[f64],
    mut visit: impl FnMut(usize, LinkAxes),
) -> ([Vector3<f64>; 3], Vector3<f64>) {
    let (mut x, mut y, mut z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let mut origin = Vector3::zeros();
    for (i, (link, q)) in links.iter().zip(q).enumerate() {
        let mut axes = LinkAxes { root: origin, x, ..LinkAxes::default() };
        turn(&mut y, &mut z, link.alpha);
        origin += x * link.a;
        (axes.joint, axes.z) = (origin, z);
        turn(&mut x, &mut y, (link.theta + q).sin_cos());
        origin += z * link.d;
        (axes.end, axes.y) = (origin, y);
        turn(&mut z, &mut x, link.beta);
        visit(i, axes);
    }
    ([x, y, z], origin)
}

impl LeastSquares for Analytic<'_> {
    fn parameters(&self) -> usize {
        self.residuals.parameters()
    }

    fn items(&self) -> usize {
        self.residuals.items()
    }

    fn rows_per_item(&self) -> usize {
        3
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        let (links, target, _) = self.links(x);
        for (pose, out) in self.residuals.poses()[items].iter().zip(out.chunks_exact_mut(3)) {
            let (axes, origin) = walk(&links, pose.setup.configuration, |_, _| ());
            let p = origin + axes[0] * target.x + axes[1] * target.y + axes[2] * target.z;
            out.copy_from_slice(((pose.measured - p) / pose.sigma).as_slice());
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let (links, target, target_columns) = self.links(x);
        let last = block.parameters();
        let mut links_axes = [LinkAxes::default(); 6];
        for (row, pose) in self.residuals.poses()[items].iter().enumerate() {
            let scale = -1.0 / pose.sigma;
            let mut put = |column: usize, v: Vector3<f64>| {
                block.column_mut(column)[3 * row..3 * row + 3]
                    .copy_from_slice((v * scale).as_slice());
            };
            let (axes, origin) =
                walk(&links, pose.setup.configuration, |i, link| links_axes[i] = link);
            let p = origin + axes[0] * target.x + axes[1] * target.y + axes[2] * target.z;
            put(last, p - pose.measured);
            for (column, axis) in target_columns.iter().zip(axes) {
                if let Some(column) = *column {
                    put(column, axis);
                }
            }
            for (link, m) in links.iter().zip(&links_axes) {
                let [alpha, a, theta, d, beta] = link.columns;
                if let Some(column) = alpha {
                    put(column, m.x.cross(&(p - m.root)));
                }
                if let Some(column) = a {
                    put(column, m.x);
                }
                if let Some(column) = theta {
                    put(column, m.z.cross(&(p - m.joint)));
                }
                if let Some(column) = d {
                    put(column, m.z);
                }
                if let Some(column) = beta {
                    put(column, m.y.cross(&(p - m.end)));
                }
            }
        }
    }
}
