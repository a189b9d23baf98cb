//! Rows of a block that contain the derivatives of one predicted vector.

use nalgebra::{Matrix3, Vector3};

use super::Model;
use super::load_moments::JacobianColumn;
use super::sites::lengths;
use crate::least_squares::Block;
use crate::model::parameter::{JointField, ParameterSite, Regressor, Waves};
use crate::problem::PoseView;

/// Three rows of a block that receive the derivatives of one predicted vector.
pub(super) struct Rows<'a> {
    /// Block that holds the rows.
    pub block: &'a mut Block,
    /// Index of the first of the three rows of the vector.
    pub row: usize,
    /// Factor from a derivative of the prediction to one of the residual (measured − predicted) /
    /// σ.
    pub scale: f64,
}

impl Rows<'_> {
    /// Writes `derivative` of the predicted vector into a column, times `scale`.
    #[inline]
    pub fn put(&mut self, column: usize, derivative: &Vector3<f64>) {
        let out = &mut self.block.column_mut(column)[self.row..self.row + 3];
        out.copy_from_slice((derivative * self.scale).as_slice());
    }

    /// Writes the derivative of the predicted vector if there is a column; otherwise it is not
    /// evaluated.
    #[inline]
    pub fn put_if(&mut self, column: Option<usize>, derivative: impl FnOnce() -> Vector3<f64>) {
        if let Some(column) = column {
            self.put(column, &derivative());
        }
    }

    /// Adds `derivative` of the predicted vector, times `scale`, to a column.
    pub fn add(&mut self, column: usize, derivative: &Vector3<f64>) {
        let out = &mut self.block.column_mut(column)[self.row..self.row + 3];
        out.iter_mut().zip(derivative).for_each(|(out, add)| *out += add * self.scale);
    }

    /// Multiplies the three rows by a matrix from the left, in all columns.
    pub fn multiply(&mut self, matrix: &Matrix3<f64>) {
        for column in 0..self.block.parameters() {
            let out = &mut self.block.column_mut(column)[self.row..self.row + 3];
            let product = matrix * Vector3::new(out[0], out[1], out[2]);
            out.copy_from_slice(product.as_slice());
        }
    }

    /// Adds to the column of each parameter that acts on `input`: `derivative` with respect to the
    /// input times the parameter's regressor in the `commanded` pose.
    #[inline]
    pub fn put_input(&mut self, input: &Input, commanded: &PoseView, derivative: &Vector3<f64>) {
        self.put_if(input.column, || *derivative);
        let mut waves = Waves::default();
        for (column, factor, regressor) in &input.regressors {
            self.add(*column, &(derivative * (factor * waves.value(regressor, commanded))));
        }
    }
}

/// Sets all entries of the reused block `points` to zero, because the previous pose may have
/// written columns that this one does not.
pub(super) fn clear_block(points: &mut Block) {
    for column in 0..points.parameters() {
        points.column_mut(column).fill(0.0);
    }
}

/// Scalar quantity of the arm, with the Jacobian columns of the parameters that act on it.
#[derive(Debug, Clone)]
pub(super) struct Input {
    pub site: ParameterSite,
    /// Index of the unknown parameter whose value this scalar takes; `None` if there is none.
    pub parameter: Option<usize>,
    /// Jacobian column of that parameter; `None` if there is none.
    pub column: Option<usize>,
    /// Jacobian columns of the parameters that add to the scalar, each with the factor and the
    /// regressor that multiply it.
    pub regressors: Vec<(usize, f64, Regressor)>,
}

/// Returns the inputs of the arm that the parameters of these Jacobian columns act on.
pub(super) fn inputs(model: &Model, columns: &[JacobianColumn]) -> Vec<Input> {
    let mut inputs: Vec<Input> = Vec::new();
    let input_at = |inputs: &mut Vec<Input>, site: ParameterSite| {
        inputs.iter().position(|input| input.site == site).unwrap_or_else(|| {
            inputs.push(Input { site, parameter: None, column: None, regressors: Vec::new() });
            inputs.len() - 1
        })
    };
    for (index_of_column, column) in columns.iter().enumerate() {
        let site = column.site;
        // The time of an exposure acts on the coordinates of all joints.
        if let ParameterSite::Exposure { camera, by_row } = site {
            for joint in 0..model.joints() {
                let index = input_at(&mut inputs, model.coordinate(joint));
                let regressor = Regressor::Exposure { camera, joint, by_row };
                inputs[index].regressors.push((index_of_column, 1.0, regressor));
            }
            continue;
        }
        // A strain of the arm acts on all its lengths.
        if site == ParameterSite::ArmStrain {
            for (joint, axis, length) in lengths(&model.nominal) {
                let site = ParameterSite::Joint { joint, field: JointField::Before(axis) };
                let index = input_at(&mut inputs, site);
                let regressor = column.regressor.clone();
                inputs[index].regressors.push((index_of_column, length, regressor));
            }
            continue;
        }
        let is_of_arm = matches!(
            site,
            ParameterSite::Joint { .. } | ParameterSite::Beam { .. } | ParameterSite::Arm(_)
        );
        if !is_of_arm && model.payload_axis(site).is_none() {
            continue;
        }
        let index = input_at(&mut inputs, site);
        let input = &mut inputs[index];
        if column.regressor.is_constant() {
            (input.parameter, input.column) = (column.parameter, Some(index_of_column));
        } else {
            input.regressors.push((index_of_column, 1.0, column.regressor.clone()));
        }
    }
    inputs
}
