//! Measured rows linearised about a fit: residuals, Jacobians of parameters and of joints, inputs.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

/// Coordinates of a position.
pub(super) const AXES: usize = 3;

/// Joints at which an arm may err, and the quantities on which these errors may depend.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Joint of each site, counted from 0.
    pub joints: Vec<usize>,
    /// Lever of each site: root mean square of ‖∂p/∂q‖ over the rows fitted \[m/rad\] or \[1\].
    pub levers: Vec<f64>,
    /// Inputs of the functions.
    pub inputs: Inputs,
}

/// Inputs of the remainder: the commands of the moving joints.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inputs {
    /// Joint of each input, counted from 0.
    pub joints: Vec<usize>,
    /// True for an angle, whose distances are chords.
    pub angles: Vec<bool>,
    /// Site whose own command the input is.
    pub site_of: Vec<Option<usize>>,
    /// Offset and unit of each input: 0 and 1 for angles, mean and standard deviation for others.
    pub standard: Vec<(f64, f64)>,
    /// Smallest and largest value in the rows fitted \[rad\] or \[m\].
    pub ranges: Vec<(f64, f64)>,
}

/// Rows of positions linearised about a fit; three coordinates a row.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// Measured − predicted position, shape = (3 rows) \[m\].
    pub residual: DVector<f64>,
    /// ∂p/∂x of the free parameters, shape = (3 rows, parameters).
    pub jacobian: DMatrix<f64>,
    /// ∂p/∂q over the lever of each site, shape = (sites, 3 rows).
    pub sites: DMatrix<f64>,
    /// Standardised inputs, shape = (inputs, rows).
    pub inputs: DMatrix<f64>,
    /// Number of the configuration of each row: rows of one session in one configuration share it.
    pub configuration: Vec<usize>,
    /// 1 σ of each row over that of the others \[1\].
    pub relative_sigma: Vec<f64>,
}

impl Rows {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.configuration.len()
    }

    /// Inputs of a row.
    pub fn inputs_of(&self, row: usize) -> &[f64] {
        let n = self.inputs.nrows();
        &self.inputs.as_slice()[n * row..n * (row + 1)]
    }

    /// Site columns of a coordinate of a row.
    pub fn sites_of(&self, coordinate: usize) -> &[f64] {
        let n = self.sites.nrows();
        &self.sites.as_slice()[n * coordinate..n * (coordinate + 1)]
    }

    /// Some of the rows.
    pub fn select(&self, rows: &[usize]) -> Self {
        let coordinates: Vec<usize> =
            rows.iter().flat_map(|&row| (0..AXES).map(move |axis| AXES * row + axis)).collect();
        Self {
            residual: self.residual.select_rows(&coordinates),
            jacobian: self.jacobian.select_rows(&coordinates),
            sites: self.sites.select_columns(&coordinates),
            inputs: self.inputs.select_columns(rows),
            configuration: rows.iter().map(|&row| self.configuration[row]).collect(),
            relative_sigma: rows.iter().map(|&row| self.relative_sigma[row]).collect(),
        }
    }

    /// Places of the rows of each configuration, in the order in which configurations appear.
    pub fn configurations(&self) -> Vec<Vec<usize>> {
        let mut place = HashMap::new();
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for (row, configuration) in self.configuration.iter().enumerate() {
            let group = *place.entry(*configuration).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(row);
        }
        groups
    }
}
