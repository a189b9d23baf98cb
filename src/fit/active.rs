//! Constraints that hold parameters back, and what they leave to the errors.

use nalgebra::DMatrix;

use super::shadow_price::ShadowPrice;
use crate::error::Location;
use crate::least_squares::solver::AtBound;
use crate::model::Model;
use crate::quantity::Unit;

/// A constraint that holds parameters back.
#[derive(Debug, Clone, PartialEq)]
pub struct ActiveConstraint {
    /// Which of the model's constraints.
    pub constraint: usize,
    /// The limit in words: `ln A.EI − ln B.EI ≥ 0`.
    pub words: String,
    /// Which limit.
    pub side: AtBound,
    /// What it costs, for its limit moved out by one of its unit.
    pub shadow_price: ShadowPrice,
    /// Unit of its terms; those of stiffnesses and rigidities are logarithms.
    pub unit: Unit,
    /// Where it stands in the problem file.
    pub location: Location,
}

impl ActiveConstraint {
    /// In words of the problem.
    pub(super) fn all(held: &[Held], prices: &[ShadowPrice], model: &Model) -> Vec<Self> {
        let of = |(held, shadow_price): (&Held, &ShadowPrice)| {
            let constraint = &model.constraints[held.constraint];
            let [lower, upper] = &constraint.limits;
            let limit = if held.side == AtBound::Lower { lower } else { upper };
            let words = format!("{} {}", constraint.sum, limit.as_deref().unwrap_or_default());
            let unit =
                constraint.terms.first().map_or(Unit::Length, |&(k, _)| model.parameters[k].unit());
            let location = constraint.location.clone();
            Self {
                constraint: held.constraint,
                words,
                side: held.side,
                shadow_price: *shadow_price,
                unit,
                location,
            }
        };
        held.iter().zip(prices).map(of).collect()
    }
}

/// A constraint that holds the unknowns of a stage back.
#[derive(Debug, Clone)]
pub(super) struct Held {
    /// Which of the model's constraints.
    pub constraint: usize,
    /// The limit that it is on.
    pub side: AtBound,
    /// Its coefficients, one per unknown.
    pub row: Vec<f64>,
}

/// The rows of `gauge` and of active constraints, all of length one in unknowns scaled by the data.
///
/// A constraint on a single unknown that nothing else holds is a bound: the unknown is held.
pub(super) fn confine(
    triangle: &DMatrix<f64>,
    gauge: &DMatrix<f64>,
    constraints: &[Held],
    held: &mut [bool],
) -> DMatrix<f64> {
    let n = held.len();
    let scale: Vec<f64> =
        triangle.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let mut left: Vec<&Held> = constraints.iter().collect();
    loop {
        let open = |row: &[f64]| (0..n).filter(|&j| row[j] != 0.0 && !held[j]).collect::<Vec<_>>();
        let Some(alone) = left.iter().position(|found| open(&found.row).len() <= 1) else { break };
        let unknowns = open(&left.remove(alone).row);
        for j in unknowns {
            held[j] = true;
        }
    }
    let mut rows = gauge.clone().insert_rows(gauge.nrows(), left.len(), 0.0);
    for (i, found) in left.iter().enumerate() {
        let scaled = found.row.iter().zip(&scale).zip(&*held).filter(|(_, held)| !**held);
        let length = scaled.map(|((a, s), _)| (a / s).powi(2)).sum::<f64>().sqrt();
        (0..n).for_each(|j| rows[(gauge.nrows() + i, j)] = found.row[j] / length);
    }
    rows
}
