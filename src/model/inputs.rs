//! The scalars of the arm that parameters act on: one derivative serves every parameter that is
//! regressors at one place.

use super::Model;
use crate::model::parameter::{ParameterSite, Regressor};

/// A scalar of the arm with the columns of the parameters that act on it.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub site: ParameterSite,
    /// The parameter that is this scalar, if it is an unknown.
    pub parameter: Option<usize>,
    /// Its column.
    pub column: Option<usize>,
    /// Columns of the parameters that add to the scalar, each multiplied by its regressor.
    pub regressors: Vec<(usize, Regressor)>,
}

/// Inputs of the arm for some unknowns, whose column is their place in the list.
pub(super) fn inputs(model: &Model, unknowns: &[usize]) -> Vec<Input> {
    let mut inputs: Vec<Input> = Vec::new();
    for (column, &k) in unknowns.iter().enumerate() {
        let parameter = &model.parameters[k];
        if !matches!(
            parameter.site,
            ParameterSite::Joint { .. } | ParameterSite::Beam { .. } | ParameterSite::Arm(_)
        ) {
            continue;
        }
        let known = inputs.iter().position(|input| input.site == parameter.site);
        let index = known.unwrap_or_else(|| {
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
            input.regressors.push((column, parameter.regressor));
        }
    }
    inputs
}
