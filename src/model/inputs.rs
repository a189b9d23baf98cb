//! Scalars of the arm that parameters act on. One derivative serves all parameters at the same
//! site.

use super::Model;
use crate::model::parameter::{ParameterSite, Regressor, slope_regressor};

/// Scalar quantity of the arm, with the Jacobian columns of the parameters that act on it.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub site: ParameterSite,
    /// Index of the unknown parameter that equals this scalar; `None` if there is none.
    pub parameter: Option<usize>,
    /// Jacobian column of the parameter that equals this scalar; `None` if there is none.
    pub column: Option<usize>,
    /// Jacobian columns of the parameters that add to the scalar, each with the regressor that
    /// multiplies it.
    pub regressors: Vec<(usize, Regressor)>,
}

/// Returns the inputs of the arm that the `unknowns` act on, at the full parameter vector `x`.
/// Column j belongs to the parameter `unknowns[j]`.
pub(super) fn inputs(model: &Model, x: &[f64], unknowns: &[usize]) -> Vec<Input> {
    let mut inputs: Vec<Input> = Vec::new();
    for (column, &k) in unknowns.iter().enumerate() {
        let parameter = &model.parameters[k];
        let is_of_arm = matches!(
            parameter.site,
            ParameterSite::Joint { .. } | ParameterSite::Beam { .. } | ParameterSite::Arm(_)
        );
        if !is_of_arm && model.payload_axis(parameter.site).is_none() {
            continue;
        }
        let existing = inputs.iter().position(|input| input.site == parameter.site);
        let index = existing.unwrap_or_else(|| {
            inputs.push(Input {
                site: parameter.site,
                parameter: None,
                column: None,
                regressors: Vec::new(),
            });
            inputs.len() - 1
        });
        let input = &mut inputs[index];
        if parameter.regressor.is_constant() {
            (input.parameter, input.column) = (Some(k), Some(column));
        } else {
            input.regressors.push((column, slope_regressor(&model.parameters, x, k)));
        }
    }
    inputs
}
