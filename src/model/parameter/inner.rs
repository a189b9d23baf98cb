//! Dependence of formulas on the parameter vector: by parameters inside them, and by the moments of
//! fitted loads.

use std::sync::Arc;

use num_dual::Dual64;

use super::Parameter;
use super::regressor::{Dependence, Formula, Regressor, Slope};
use crate::mechanics::AxisMoments;

/// Returns the regressor that multiplies parameter k in the prediction, with all formula parameters
/// at their values in the full parameter vector `x`. `None` if k is itself a parameter inside a
/// formula, which multiplies nothing.
pub(crate) fn value_regressor(parameters: &[Parameter], x: &[f64], k: usize) -> Option<Regressor> {
    match &parameters[k].regressor {
        Regressor::Inner => None,
        Regressor::Formula(formula) if !formula.parameters().is_empty() => {
            Some(Regressor::Formula(Arc::new(with_values_at(formula, parameters, x))))
        }
        regressor => Some(regressor.clone()),
    }
}

/// Returns the regressor r for which r(pose) is the derivative of the site's quantity with respect
/// to parameter k, at the full parameter vector `x`. For a parameter inside formulas, r sums the
/// derivatives of all terms that use it.
pub(crate) fn slope_regressor(parameters: &[Parameter], x: &[f64], k: usize) -> Regressor {
    value_regressor(parameters, x, k).unwrap_or_else(|| {
        let name = &parameters[k].name;
        let term = |(parameter, c): (&Parameter, &f64)| {
            let Regressor::Formula(formula) = &parameter.regressor else { return None };
            let index = formula.parameters().iter().position(|(inner, _)| inner == name)?;
            let formula = Arc::new(with_values_at(formula, parameters, x));
            Some((*c, formula, Dependence::Inner(index)))
        };
        let terms = parameters.iter().zip(x).filter_map(term).collect();
        Regressor::Slope(Arc::new(Slope::new(terms)))
    })
}

/// Returns the regressor r for which r(pose) is the derivative of a site's quantity with respect to
/// a load, through the moments that the `terms` at the site use. `moments` has this load as its
/// variable, and `terms` are indices of parameters in the full parameter vector `x`.
pub(crate) fn load_derivative(
    parameters: &[Parameter],
    x: &[f64],
    terms: &[usize],
    moments: &Arc<AxisMoments<Dual64>>,
) -> Regressor {
    let term = |&k: &usize| {
        let Regressor::Formula(formula) = &parameters[k].regressor else { return None };
        let formula = Arc::new(with_values_at(formula, parameters, x));
        Some((x[k], formula, Dependence::Load(moments.clone())))
    };
    Regressor::Slope(Arc::new(Slope::new(terms.iter().filter_map(term).collect())))
}

/// Returns true if a parameter's regressor uses moments of the arm's loads.
pub(crate) fn uses_moments(parameter: &Parameter) -> bool {
    matches!(&parameter.regressor, Regressor::Formula(formula) if formula.uses_moments())
}

/// Returns a parameter whose regressor uses these moments, if it uses any.
pub(crate) fn with_moments(parameter: &Parameter, moments: &Arc<AxisMoments<f64>>) -> Parameter {
    match &parameter.regressor {
        Regressor::Formula(formula) if formula.uses_moments() => Parameter {
            regressor: Regressor::Formula(Arc::new(formula.with_moments(moments.clone()))),
            ..parameter.clone()
        },
        _ => parameter.clone(),
    }
}

/// Returns a formula with the values that its parameters have at the full parameter vector `x`;
/// parameters that are not free keep their start value.
fn with_values_at(formula: &Formula, parameters: &[Parameter], x: &[f64]) -> Formula {
    let value = |(name, start): &(String, f64)| {
        let index = parameters.iter().position(|parameter| parameter.name == *name);
        let value = index.map_or(*start, |k| parameters[k].value(x[k]));
        (name.clone(), value)
    };
    formula.with_parameters(formula.parameters().iter().map(value).collect())
}
