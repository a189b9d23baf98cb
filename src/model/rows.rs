//! Where the derivatives of one pose are written.

use nalgebra::{Matrix3, Vector3};

use super::inputs::Input;
use crate::least_squares::Block;
use crate::model::parameter::Waves;
use crate::problem::PoseView;

/// Three rows of a block.
pub(super) struct Rows<'a> {
    pub block: &'a mut Block,
    pub row: usize,
    /// From a derivative of the prediction to one of the residual (measured − predicted) / σ.
    pub scale: f64,
}

impl Rows<'_> {
    #[inline]
    pub fn put(&mut self, column: usize, derivative: &Vector3<f64>) {
        let out = &mut self.block.column_mut(column)[self.row..self.row + 3];
        out.copy_from_slice((derivative * self.scale).as_slice());
    }

    /// What is there already, multiplied by a matrix from the left.
    pub fn turn(&mut self, by: &Matrix3<f64>) {
        for column in 0..self.block.parameters() {
            let own = &mut self.block.column_mut(column)[self.row..self.row + 3];
            let turned = by * Vector3::new(own[0], own[1], own[2]);
            own.copy_from_slice(turned.as_slice());
        }
    }

    #[inline]
    pub fn put_if(&mut self, column: Option<usize>, derivative: impl FnOnce() -> Vector3<f64>) {
        if let Some(column) = column {
            self.put(column, &derivative());
        }
    }

    /// Writes the derivative with respect to an input for each parameter that acts there.
    #[inline]
    pub fn put_input(&mut self, input: &Input, commanded: &PoseView, derivative: &Vector3<f64>) {
        if let Some(column) = input.column {
            self.put(column, derivative);
        }
        let mut waves = Waves::default();
        for &(column, regressor) in &input.driven {
            self.put(column, &(derivative * waves.value(regressor, commanded)));
        }
    }
}
