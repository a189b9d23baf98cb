//! Shadow prices of the bounds and constraints of a fit.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::active_limits::ActiveLimit;
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::shadow_price::ShadowPrice;
use crate::least_squares::solver::{AtBound, Factor};
use crate::least_squares::{Fit, LinearRows, Objective as _};
use crate::model::parameter::Parameter;

/// Smallest length of the part of a constraint normal that is orthogonal to the other normals,
/// relative to the length of the normal. If it is shorter, the constraint is linearly dependent on
/// the others.
const MIN_INDEPENDENT_LENGTH: f64 = 1e-10;

/// Shadow prices of bounds (`None` for an unknown inside its bounds) and of active constraints.
#[derive(Debug, Clone, Default)]
pub(in crate::fit) struct Prices {
    pub bounds: Vec<Option<ShadowPrice>>,
    pub constraints: Vec<ShadowPrice>,
}

impl Stage<'_> {
    /// Computes the shadow prices of bounds and active constraints at the full parameter vector
    /// `at`, from their Lagrange multipliers.
    ///
    /// At a minimum, the gradient of the cost is g = Aᵀμ + w. The rows of A are the active
    /// constraints with the multipliers μ; w holds the multipliers of the bounds. A multiplier is ≥
    /// 0 at a lower limit and ≤ 0 at an upper one.
    ///
    /// # Errors
    /// Returns an error if the rows of the priors do not match the unknowns.
    pub fn prices(
        &self,
        at: &DVector<f64>,
        at_bound: &[Option<AtBound>],
        active: &[ActiveLimit],
    ) -> Result<Prices, StageError> {
        let n = self.unknowns.len();
        if active.is_empty() && at_bound.iter().all(Option::is_none) {
            return Ok(Prices { bounds: vec![None; n], constraints: Vec::new() });
        }
        let residuals = self.residuals(at);
        let x = residuals.unknowns_in(at);
        let priors = self.priors();
        let constant = DVector::zeros(priors.nrows());
        let fit = Fit::new(&residuals)
            .with_loss(self.loss)
            .with_rows(LinearRows { matrix: priors, constant })?
            .with_rows(self.earlier_rows(at))?;
        let found = fit.linearise(&x);
        let mut gradient = found.triangle.tr_mul(&found.projected);
        let free: Vec<usize> = (0..n).filter(|&j| at_bound[j].is_none()).collect();
        let weight = |j: usize| found.triangle.column(j).norm().max(f64::MIN_POSITIVE).recip();
        let normals = DMatrix::from_fn(free.len(), active.len(), |i, k| {
            active[k].row[free[i]] * weight(free[i])
        });
        let force = DVector::from_fn(free.len(), |i, _| gradient[free[i]] * weight(free[i]));
        let forces = if active.is_empty() {
            DVector::zeros(0)
        } else {
            Factor::new(normals, -force, MIN_INDEPENDENT_LENGTH).gauss_newton()
        };
        for (held, force) in active.iter().zip(&forces) {
            held.row
                .iter()
                .enumerate()
                .for_each(|(j, coefficient)| gradient[j] -= coefficient * force);
        }
        // The rms is that of the rows of the first kind, because mm and degrees have no common
        // mean.
        let leading = self.poses.first().map(|pose| pose.observation.kind());
        let is_leading = |place: &usize| Some(self.poses[*place].observation.kind()) == leading;
        let places: Vec<usize> = (0..self.poses.len()).filter(is_leading).collect();
        let errors_of_poses = residuals.position_errors(&x);
        let errors: Vec<_> = places.iter().map(|&place| errors_of_poses[place]).collect();
        let count = errors.len().max(1) as f64;
        let rms = (errors.iter().map(nalgebra::Matrix::norm_squared).sum::<f64>() / count).sqrt();
        let variance =
            places.iter().map(|&place| self.poses[place].sigma.powi(2)).sum::<f64>() / count;
        // If both limits of a constraint are equal, either side may be active.
        let parameters: Vec<&Parameter> = self.parameters().collect();
        let is_equality = |held: &ActiveLimit| {
            let limits = &self.model.constraints[held.constraint];
            limits.lower >= limits.upper
        };
        let price = |force: f64, side: AtBound, is_one: bool| {
            let multiplier = match side {
                _ if is_one => force.abs(),
                AtBound::Lower => force.max(0.0),
                AtBound::Upper => (-force).max(0.0),
            };
            let rms = if rms > 0.0 { multiplier * variance / (count * rms) } else { 0.0 };
            ShadowPrice { multiplier, rms }
        };
        Ok(Prices {
            bounds: (0..n)
                .map(|j| {
                    at_bound[j].map(|side| {
                        price(gradient[j], side, parameters[j].lower >= parameters[j].upper)
                    })
                })
                .collect(),
            constraints: active
                .iter()
                .zip(&forces)
                .map(|(held, force)| price(*force, held.side, is_equality(held)))
                .collect(),
        })
    }
}
