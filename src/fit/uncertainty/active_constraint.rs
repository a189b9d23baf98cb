//! Constraints that hold parameters back, and what they leave to the errors.

use crate::error::Location;
use crate::fit::stages::constraints::Held;
use crate::fit::uncertainty::shadow_price::ShadowPrice;
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
    pub(in crate::fit) fn all(held: &[Held], prices: &[ShadowPrice], model: &Model) -> Vec<Self> {
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
