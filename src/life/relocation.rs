//! Location anew of a base, camera or marker that was moved as a whole.
//!
//! Tests for small changes are linear in the parameters, which fails for a board that was put down
//! elsewhere. The pose of such a placement is fitted to the rows without its earlier value.

use nalgebra::{DVector, Rotation3, Vector3};

use super::evidence::SECOND_CHANGE_ODDS;
use super::rows::SensitiveRows;
use crate::fit::register;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::model::{Model, Pose};

/// Evidence \[nats\] by which a placement that is located anew must exceed all small changes
/// together: each of its six coordinates is located to about 1 % of the range of plausible moves.
pub(super) const MIN_RELOCATION_NATS: f64 = 28.0;
/// Largest ratio of the errors after a base, camera or marker is located anew to those before at
/// which it counts as moved, though the rows show another change too.
const MAX_REGISTERED_ERROR: f64 = 0.05;
/// Largest root mean square error after it is located anew, in units of the noise, at which it
/// counts as moved beside another change: more than that is read wrongly.
const MAX_REGISTERED_SIGMAS: f64 = 100.0;
/// Maximum number of steps of the fit of a pose.
const MAX_STEPS: usize = 60;
/// Relative reduction of the cost below which the fit of a pose ends.
const COST_TOLERANCE: f64 = 1e-10;
/// Smallest and largest damping of the fit of a pose, relative to the diagonal of its normal
/// matrix.
const DAMPING: (f64, f64) = (1e-9, 1e9);

/// Placement whose pose is free in all six coordinates.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Placed {
    /// Name for people, such as "marker\[board\]".
    pub label: String,
    /// Indices of the six parameters in the model.
    pub parameters: Vec<usize>,
    /// True for a base, false for a camera or marker.
    pub is_base: bool,
}

impl Placed {
    /// Returns the move of the placement from the full parameter vector `before` to `after`: the
    /// shift \[m\], and the rotation vector of the turn \[rad\], both in the frame in which the
    /// pose is declared. Differences of rotation vectors are no turns.
    pub fn moved(&self, model: &Model, before: &DVector<f64>, after: &DVector<f64>) -> Vec<f64> {
        let pose = |x: &DVector<f64>| -> Vec<f64> {
            self.parameters.iter().map(|&k| model.parameters[k].value(x[k])).collect()
        };
        let rotation =
            |pose: &[f64]| Rotation3::from_scaled_axis(Vector3::new(pose[3], pose[4], pose[5]));
        let (old, new) = (pose(before), pose(after));
        let turn = (rotation(&new) * rotation(&old).inverse()).scaled_axis();
        let shift = new.iter().zip(&old).take(3).map(|(new, old)| new - old);
        shift.chain(turn.iter().copied()).collect()
    }
}

/// Returns true if a parameter is a coordinate of the pose of a base, camera or marker, or of the
/// position of another fixture. Those of a lens are not.
pub(super) fn is_of_place(parameter: &Parameter) -> bool {
    match parameter.site {
        ParameterSite::Base { .. } => true,
        ParameterSite::Fixture { kind, axis, .. } => !kind.has_pose() || axis < 6,
        _ => false,
    }
}

/// Lists the bases, cameras and markers of a model whose six coordinates are free without bounds.
pub(super) fn placements(model: &Model) -> Vec<Placed> {
    let mut found: Vec<Placed> = Vec::new();
    for (k, parameter) in model.parameters.iter().enumerate() {
        let is_base = matches!(parameter.site, ParameterSite::Base { .. });
        let has_pose = is_base
            || matches!(parameter.site, ParameterSite::Fixture { kind, .. } if kind.has_pose());
        let is_free = parameter.regressor.is_constant() && !parameter.is_bounded();
        if !has_pose || !is_of_place(parameter) || !is_free {
            continue;
        }
        let label = parameter.name.rsplit_once('.').map_or("", |(label, _)| label);
        match found.iter_mut().find(|placed| placed.label == label) {
            Some(placed) => placed.parameters.push(k),
            None => found.push(Placed { label: label.to_owned(), parameters: vec![k], is_base }),
        }
    }
    found.retain(|placed| placed.parameters.len() == 6);
    found
}

/// Fits the pose of a placement to rows by Levenberg–Marquardt steps from its pose in the full
/// parameter vector `x`; the other parameters keep their values. Returns the full parameter vector,
/// or `None` if the rows do not determine the pose.
pub(super) fn located_anew(
    model: &Model,
    poses: &[Pose],
    x: &DVector<f64>,
    placed: &Placed,
) -> Option<DVector<f64>> {
    let columns = &placed.parameters;
    let mut x = x.clone();
    if placed.is_base {
        let mut free = model.clone();
        for &k in columns {
            free.parameters[k].sigma = None;
        }
        let mut registered = x.clone();
        register(&free, poses, &mut registered);
        for &k in columns {
            x[k] = registered[k];
        }
    }
    let linearised = |x: &DVector<f64>| {
        let rows = SensitiveRows::new(model, poses.to_vec(), x);
        let jacobian = rows.sensitivity.select_columns(columns);
        let cost = rows.residual.norm_squared();
        let is_finite = cost.is_finite() && jacobian.iter().all(|slope| slope.is_finite());
        is_finite.then_some((jacobian, rows.residual, cost))
    };
    let (mut jacobian, mut residual, mut cost) = linearised(&x)?;
    let mut damping = 1e-3;
    for _ in 0..MAX_STEPS {
        let normal = jacobian.tr_mul(&jacobian);
        if normal.diagonal().iter().any(|square| *square <= 0.0) {
            return None;
        }
        let mut damped = normal.clone();
        for k in 0..columns.len() {
            damped[(k, k)] *= 1.0 + damping;
        }
        let step = damped.cholesky()?.solve(&jacobian.tr_mul(&residual));
        let mut trial = x.clone();
        columns.iter().zip(step.iter()).for_each(|(&k, step)| trial[k] += step);
        match linearised(&trial).filter(|(.., lower)| *lower < cost) {
            Some(next) => {
                let reduction = cost - next.2;
                (jacobian, residual, cost) = next;
                x = trial;
                damping = (damping / 10.0).max(DAMPING.0);
                if reduction <= COST_TOLERANCE * cost {
                    break;
                }
            }
            None if damping >= DAMPING.1 => break,
            None => damping *= 10.0,
        }
    }
    Some(x)
}

/// Rows after a base, camera or marker has been located anew.
pub(super) struct LocatedAnew {
    /// χ² of the rows, and ln of the evidence for another change.
    pub chi2: f64,
    pub evidence: f64,
    /// Number of measured coordinates.
    pub coordinates: f64,
    /// Lengths of the whitened residuals before and after.
    pub residuals: [f64; 2],
}

impl LocatedAnew {
    /// Returns the probability of the move, and the gain by it alone \[nats\]: half of the decrease
    /// of χ², less that of its coordinates. `None` unless the move explains the rows: there is no
    /// evidence above `threshold` for another change, or the errors are a small fraction of those
    /// before, so that this has moved whatever else changed, and both changes explain the rows
    /// better than all small ones. `small` holds χ² of the unchanged arm and ln of the evidence for
    /// these.
    pub fn weighed(&self, threshold: f64, small: (f64, f64)) -> Option<(f64, f64)> {
        let &Self { chi2, evidence, coordinates, residuals: [before, after] } = self;
        let gain = 0.5 * (small.0 - chi2) - MIN_RELOCATION_NATS;
        if evidence < threshold {
            return Some((1.0 / (1.0 + SECOND_CHANGE_ODDS * evidence.exp()), gain));
        }
        let largest = MAX_REGISTERED_SIGMAS * coordinates.sqrt();
        // ln of the odds of the move with another change, against all small changes together.
        let odds = gain + evidence + SECOND_CHANGE_ODDS.ln() - small.1;
        let is_small = after <= largest.min(MAX_REGISTERED_ERROR * before);
        (is_small && odds > 0.0).then(|| (1.0 / (1.0 + (-odds).exp()), gain))
    }
}
