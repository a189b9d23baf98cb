//! Structure without a cause: the residual at its place against what it depends on, and its correction.

use nalgebra::{DMatrix, DVector, Vector3};

use super::cause::{Abscissa, Cause, Ordinate, Point};
use super::joint::{along, levers, telling};
use super::states::{Arm, Sight};
use crate::diagnose::{Closure, Unexplained};
use crate::least_squares::{jacobian, residual_vector};
use crate::model::PoseResiduals;
use crate::model::parameter::{JointField, Slot, Unit};
use crate::problem::JointKind;

/// Poses that are enough to see the trend.
const ENOUGH: usize = 1000;
/// Eigenvalues of a normal matrix of unit diagonal below this are what nothing sees.
const UNSEEN: f64 = 1e-12;

/// The picture of a correction, less its mean: every pose's own measurement of it, where its place and quantity are known.
pub(super) fn of(left: &Unexplained, closure: &Closure, arm: &Arm, sight: &Sight, sigma: f64) -> Option<Cause> {
    let correction = left.correction.as_ref()?;
    let abscissa = abscissa(left.depends_on.first()?, closure)?;
    let all = &sight.split.identification;
    let rows: Vec<usize> = all.iter().copied().step_by(all.len().div_ceil(ENOUGH).max(1)).collect();
    let fit = Neighbourhood::of(arm, sight, closure, &rows, sigma);
    let x: Vec<f64> = rows.iter().map(|&row| value(abscissa, sight, row)).collect();
    let law: Vec<f64> = x.iter().map(|&x| at(&correction.curve, x)).collect();
    // Which coordinate of the place it is, is the one that the correction explains best.
    let tried = slots(&left.place).into_iter().map(|slot| {
        let levers = levers(arm, sight, &rows, slot);
        let own: Vec<Vector3<f64>> = levers.iter().zip(&law).map(|(lever, law)| lever * *law).collect();
        let (squares, rest) = fit.with(&own);
        (squares, slot, levers, rest)
    });
    let (_, slot, levers, rest) = tried.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let telling = telling(&levers);
    let mean = mean(&correction.curve);
    let points = (0..rows.len())
        .filter(|&k| telling[k])
        .map(|k| Point { x: x[k], y: law[k] - mean + along(&levers[k], &rest[k]), held_out: false })
        .collect();
    let unit = match slot {
        Slot::Joint { field: JointField::A | JointField::D, .. } => Unit::Length,
        _ => Unit::Angle,
    };
    Some(Cause {
        title: format!("{}: structure without a known cause", left.place),
        abscissa,
        ordinate: Ordinate::Place { place: left.place.clone(), unit },
        points,
        curve: correction.curve.iter().map(|&(x, y)| (x, y - mean)).collect(),
    })
}

/// The quantity of that name.
fn abscissa(name: &str, closure: &Closure) -> Option<Abscissa> {
    match name {
        "temperature" => Some(Abscissa::Temperature),
        "time" => Some(Abscissa::Elapsed),
        "payload" => Some(Abscissa::Payload),
        "hoist" => Some(Abscissa::Hoist),
        other => {
            let joint: usize = other.strip_prefix('q')?.parse().ok()?;
            let kind = closure.closed.joints.get(joint.checked_sub(1)?)?.kind;
            Some(Abscissa::Command { joint, slides: kind == JointKind::Prismatic })
        }
    }
}

fn value(abscissa: Abscissa, sight: &Sight, row: usize) -> f64 {
    let measurements = sight.measurements;
    let of = |column: &Option<Vec<f64>>| column.as_ref().map_or(0.0, |values| values[row]);
    match abscissa {
        Abscissa::Command { joint, .. } => measurements.configuration(row)[joint - 1],
        Abscissa::Temperature => of(&measurements.temperature),
        Abscissa::Payload => of(&measurements.payload),
        Abscissa::Hoist => of(&measurements.hoist),
        _ => measurements.time[row] - measurements.time.iter().copied().fold(f64::INFINITY, f64::min),
    }
}

/// Coordinates that a place in words may mean.
fn slots(place: &str) -> Vec<Slot> {
    let at = |number: &str, fields: &[JointField]| -> Vec<Slot> {
        let joint = number.parse::<usize>().ok().and_then(|joint| joint.checked_sub(1));
        joint.map_or_else(Vec::new, |joint| fields.iter().map(|&field| Slot::Joint { joint, field }).collect())
    };
    match (place.strip_prefix("link before joint "), place.strip_prefix("joint ")) {
        (Some(number), _) => at(number, &[JointField::Alpha, JointField::A]),
        (None, Some(number)) => at(number, &[JointField::Theta, JointField::D, JointField::Beta]),
        (None, None) => Vec::new(),
    }
}

/// Mean height of a curve over its range.
fn mean(curve: &[(f64, f64)]) -> f64 {
    let trapezoids: f64 = curve.windows(2).map(|pair| (pair[1].0 - pair[0].0) * 0.5 * (pair[0].1 + pair[1].1)).sum();
    let width = curve.last().zip(curve.first()).map_or(0.0, |(last, first)| last.0 - first.0);
    if width > 0.0 { trapezoids / width } else { 0.0 }
}

/// A curve between its points; nought beyond them.
fn at(curve: &[(f64, f64)], x: f64) -> f64 {
    let inside = curve.windows(2).find(|pair| (pair[0].0..=pair[1].0).contains(&x));
    inside.map_or(0.0, |pair| {
        let (a, b) = (pair[0], pair[1]);
        a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0)
    })
}

/// A fit and its linear neighbourhood at some rows.
struct Neighbourhood {
    /// ∂r/∂x of the whitened residuals, rows of priors below, shape = (3 N + n, n + 1); the last column is for what is added.
    columns: DMatrix<f64>,
    residual: DVector<f64>,
    sigmas: Vec<f64>,
}

impl Neighbourhood {
    fn of(arm: &Arm, sight: &Sight, closure: &Closure, rows: &[usize], sigma: f64) -> Self {
        let parameters = &arm.model.parameters;
        let varied = |&k: &usize| closure.after.unknowns.contains(&parameters[k].name);
        let unknowns: Vec<usize> = (0..parameters.len()).filter(varied).collect();
        let n = unknowns.len();
        let poses = sight.placement.poses(sight.measurements, rows, sigma);
        let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
        let residuals = PoseResiduals::new(&arm.model, poses, unknowns.clone(), arm.x.clone());
        let x = residuals.reduced(&arm.x);
        let coordinates = 3 * rows.len();
        let mut columns = DMatrix::zeros(coordinates + n, n + 1);
        columns.view_mut((0, 0), (coordinates, n)).copy_from(&jacobian(&residuals, &x));
        let mut residual = DVector::zeros(coordinates + n);
        residual.rows_mut(0, coordinates).copy_from(&residual_vector(&residuals, &x));
        for (j, &k) in unknowns.iter().enumerate() {
            if let Some(sigma) = parameters[k].sigma {
                columns[(coordinates + j, j)] = sigma.recip();
                residual[coordinates + j] = x[j] / sigma;
            }
        }
        Self { columns, residual, sigmas }
    }

    /// Squares and residuals [m] of the fit made again with a multiple of the displacements `own` [m] added.
    fn with(&self, own: &[Vector3<f64>]) -> (f64, Vec<Vector3<f64>>) {
        let mut columns = self.columns.clone();
        let last = columns.ncols() - 1;
        for (k, own) in own.iter().enumerate() {
            for axis in 0..3 {
                columns[(3 * k + axis, last)] = -own[axis] / self.sigmas[k];
            }
        }
        let normal = columns.tr_mul(&columns);
        let scale: Vec<f64> = normal.diagonal().iter().map(|d| if *d > 0.0 { d.sqrt() } else { 1.0 }).collect();
        let n = scale.len();
        let eigen = DMatrix::from_fn(n, n, |i, j| normal[(i, j)] / (scale[i] * scale[j])).symmetric_eigen();
        let pull = columns.tr_mul(&self.residual);
        let scaled = DVector::from_fn(n, |j, _| -pull[j] / scale[j]);
        let mut turned = eigen.eigenvectors.tr_mul(&scaled);
        for (value, eigenvalue) in turned.iter_mut().zip(&eigen.eigenvalues) {
            *value = if *eigenvalue > UNSEEN { *value / eigenvalue } else { 0.0 };
        }
        let mut step = &eigen.eigenvectors * turned;
        step.iter_mut().zip(&scale).for_each(|(step, scale)| *step /= scale);
        let rest = &self.residual + &columns * step;
        let of_row = |k: usize| Vector3::from_fn(|axis, _| rest[3 * k + axis] * self.sigmas[k]);
        (rest.norm_squared(), (0..own.len()).map(of_row).collect())
    }
}
