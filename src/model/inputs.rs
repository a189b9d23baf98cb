//! Scalars of the arm that parameters act on. One derivative serves all parameters at the same
//! site.

use super::Model;
use super::load_moments::JacobianColumn;
use crate::model::parameter::{ParameterSite, Regressor};

/// Scalar quantity of the arm, with the Jacobian columns of the parameters that act on it.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub site: ParameterSite,
    /// Index of the unknown parameter whose value this scalar takes; `None` if there is none.
    pub parameter: Option<usize>,
    /// Jacobian column of that parameter; `None` if there is none.
    pub column: Option<usize>,
    /// Jacobian columns of the parameters that add to the scalar, each with the regressor that
    /// multiplies it.
    pub regressors: Vec<(usize, Regressor)>,
}

/// Returns the inputs of the arm that the parameters of these Jacobian columns act on.
pub(super) fn inputs(model: &Model, columns: &[JacobianColumn]) -> Vec<Input> {
    let mut inputs: Vec<Input> = Vec::new();
    for (index_of_column, column) in columns.iter().enumerate() {
        let site = column.site;
        let is_of_arm = matches!(
            site,
            ParameterSite::Joint { .. } | ParameterSite::Beam { .. } | ParameterSite::Arm(_)
        );
        if !is_of_arm && model.payload_axis(site).is_none() {
            continue;
        }
        let existing = inputs.iter().position(|input| input.site == site);
        let index = existing.unwrap_or_else(|| {
            inputs.push(Input { site, parameter: None, column: None, regressors: Vec::new() });
            inputs.len() - 1
        });
        let input = &mut inputs[index];
        if column.regressor.is_constant() {
            (input.parameter, input.column) = (column.parameter, Some(index_of_column));
        } else {
            input.regressors.push((index_of_column, column.regressor.clone()));
        }
    }
    inputs
}
