//! Constraints that are active in a fit, because the fit rests on one of their limits.

use crate::error::Location;
use crate::fit::stages::active_limits::ActiveLimit;
use crate::fit::uncertainty::shadow_price::ShadowPrice;
use crate::least_squares::solver::AtBound;
use crate::model::Model;
use crate::quantity::Unit;

/// Active constraint: a `[[constraint]]` on whose limit the fit rests.
#[doc(hidden)]
#[derive(Debug, Clone, PartialEq)]
pub struct ActiveConstraint {
    /// Index of the constraint among those of the model, in the order of the file.
    pub constraint: usize,
    /// Text of the constraint with its active limit, such as `ln A.EI − ln B.EI ≥ 0`.
    pub words: String,
    /// Limit (lower or upper) of the constraint on which the fit rests.
    pub side: AtBound,
    /// Shadow price of moving the limit outwards, per unit of the limit.
    pub shadow_price: ShadowPrice,
    /// Unit of the terms of the constraint; stiffnesses and rigidities enter by their logarithms.
    pub unit: Unit,
    /// Location of the constraint in the problem file.
    pub location: Location,
    /// Names of the parameters in the constraint.
    pub parameters: Vec<String>,
}

impl ActiveConstraint {
    /// Returns true if the parameter called `name` is in the constraint.
    pub(crate) fn holds(&self, name: &str) -> bool {
        self.parameters.iter().any(|parameter| parameter == name)
    }

    /// Describes the active constraints `held` of a stage with their shadow `prices`, in the
    /// notation of the problem file.
    pub(in crate::fit) fn all(
        held: &[ActiveLimit],
        prices: &[ShadowPrice],
        model: &Model,
    ) -> Vec<Self> {
        let of = |(held, shadow_price): (&ActiveLimit, &ShadowPrice)| {
            let constraint = &model.constraints[held.constraint];
            let [lower, upper] = &constraint.limits;
            let limit = if held.side == AtBound::Lower { lower } else { upper };
            let words = format!("{} {}", constraint.sum, limit.as_deref().unwrap_or_default());
            let unit =
                constraint.terms.first().map_or(Unit::Length, |&(k, _)| model.parameters[k].unit());
            let location = constraint.location.clone();
            let name = |&(k, _): &(usize, f64)| model.parameters[k].name.clone();
            Self {
                constraint: held.constraint,
                words,
                side: held.side,
                shadow_price: *shadow_price,
                unit,
                location,
                parameters: constraint.terms.iter().map(name).collect(),
            }
        };
        held.iter().zip(prices).map(of).collect()
    }
}
