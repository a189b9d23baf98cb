//! Measured rows linearised about a fit: residuals, inputs, and derivatives with respect to
//! parameters and joint errors.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::problem::PoseView;

/// Number of coordinates of a position.
pub(super) const AXES: usize = 3;

/// Joint coordinates and compliances at which the remainder models errors, and the inputs of its
/// functions.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Joint coordinates and compliances at which errors are modelled.
    pub sites: Vec<Site>,
    /// Inputs of the error functions, such as commands and loads.
    pub inputs: Inputs,
}

/// Site: the joint, and its quantity, at which the remainder models an error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Site {
    /// Joint, counted from 0.
    pub joint: usize,
    pub kind: SiteKind,
    /// Lever: root mean square, over the fitted rows, of the derivative of the position with
    /// respect to the coordinate or compliance. An error times the lever is a motion of the
    /// position in m.
    ///
    /// The unit is \[m/rad\] for a revolute joint, \[1\] for a prismatic one and \[N·m²/rad\] for
    /// compliances, which share the largest of their levers.
    pub lever: f64,
}

/// Quantity of a joint that may be in error.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SiteKind {
    /// Coordinate of the joint. Its error is a function of its own command plus a function of all
    /// inputs.
    Coordinate,
    /// Compliance of the joint. Its error is a constant.
    Compliance,
}

/// Quantity of a pose on which joint errors may depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InputSource {
    /// Command of a joint, counted from 0.
    Command(usize),
    /// Temperature of the pose \[°C\].
    Temperature,
    /// Payload of the pose \[kg\].
    Payload,
    /// Hoist force of the pose \[N\].
    Hoist,
}

impl InputSource {
    /// Inputs that are conditions of a pose, not commands.
    pub const CONDITIONS: [Self; 3] = [Self::Temperature, Self::Payload, Self::Hoist];

    /// Returns the value of the quantity in a pose; `None` if the pose does not state it.
    pub fn value(self, setup: &PoseView) -> Option<f64> {
        match self {
            Self::Command(joint) => setup.configuration.get(joint).copied(),
            Self::Temperature => setup.temperature.copied(),
            Self::Payload => setup.payload.copied(),
            Self::Hoist => setup.hoist.copied(),
        }
    }

    /// Returns the name in files: `q1`, …, `temperature`, `payload`, `hoist`.
    pub fn name(self) -> String {
        match self {
            Self::Command(joint) => format!("q{}", joint + 1),
            Self::Temperature => "temperature".to_owned(),
            Self::Payload => "payload".to_owned(),
            Self::Hoist => "hoist".to_owned(),
        }
    }

    /// Parses the name of a quantity from a file; `None` if it is unknown.
    pub fn parse(name: &str) -> Option<Self> {
        if let Some(condition) = Self::CONDITIONS.into_iter().find(|of| of.name() == name) {
            return Some(condition);
        }
        let joint: usize = name.strip_prefix('q')?.parse().ok()?;
        Some(Self::Command(joint.checked_sub(1)?))
    }
}

/// Functions that add up to the error at a site.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SiteFunctions {
    /// Index of the input of the function uⱼ of the joint's own command; `None` without such a
    /// function.
    pub single: Option<usize>,
    /// True if the error includes a function vⱼ of all inputs.
    pub joint: bool,
    /// True if the error includes a constant.
    pub constant: bool,
}

/// Inputs of the remainder: the commands of the moving joints, and conditions that vary.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inputs {
    /// Error functions at each site of the remainder.
    pub sites: Vec<SiteFunctions>,
    /// Quantity of a pose that each input is.
    pub sources: Vec<InputSource>,
    /// For each input, true if it is an angle. Distances between angles are chords, so that q and q
    /// + 2π coincide.
    pub angles: Vec<bool>,
    /// Offset and unit that standardise each input as (value − offset) / unit. They are 0 and 1 for
    /// angles, mean and standard deviation for others.
    pub standard: Vec<(f64, f64)>,
    /// Smallest and largest value of each input in the fitted rows, before standardisation.
    pub ranges: Vec<(f64, f64)>,
}

impl Inputs {
    /// Returns the error functions at each site, for the given inputs.
    pub fn functions(sites: &[Site], sources: &[InputSource]) -> Vec<SiteFunctions> {
        let functions = |site: &Site| {
            let is_coordinate = site.kind == SiteKind::Coordinate;
            let command = InputSource::Command(site.joint);
            let input = sources.iter().position(|source| *source == command);
            SiteFunctions {
                single: input.filter(|_| is_coordinate),
                joint: is_coordinate,
                constant: !is_coordinate,
            }
        };
        sites.iter().map(functions).collect()
    }
}

/// Rows that measure positions, linearised about a fit; each row has three coordinates.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// Measured − predicted position, shape = (3 rows) \[m\].
    pub residual: DVector<f64>,
    /// Derivatives ∂p/∂x of the position with respect to the free parameters, shape = (3 rows,
    /// parameters).
    pub jacobian: DMatrix<f64>,
    /// Derivatives of the position with respect to each site's joint coordinate or compliance,
    /// divided by the site's lever, shape = (sites, 3 rows).
    pub sites: DMatrix<f64>,
    /// Standardised inputs, shape = (inputs, rows).
    pub inputs: DMatrix<f64>,
    /// Index of each row's configuration. Rows with the same session and the same commands share
    /// it.
    pub configuration: Vec<usize>,
    /// 1 σ of each row's noise, divided by the σ of rows for which the table gives none.
    pub relative_sigma: Vec<f64>,
}

/// Returns the indices 3 · row + axis of the coordinates of some rows.
pub(super) fn coordinates(rows: &[usize]) -> Vec<usize> {
    rows.iter().flat_map(|&row| (0..AXES).map(move |axis| AXES * row + axis)).collect()
}

impl Rows {
    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.configuration.len()
    }

    /// Returns the standardised inputs of a row.
    pub fn inputs_of(&self, row: usize) -> &[f64] {
        let n = self.inputs.nrows();
        &self.inputs.as_slice()[n * row..n * (row + 1)]
    }

    /// Returns the derivatives of a row's position along one axis with respect to all sites,
    /// divided by their levers, shape = (sites). `coordinate` is 3 · row + axis.
    pub fn sites_of(&self, coordinate: usize) -> &[f64] {
        let n = self.sites.nrows();
        &self.sites.as_slice()[n * coordinate..n * (coordinate + 1)]
    }

    /// Returns the rows with the given indices, in this order.
    pub fn select(&self, rows: &[usize]) -> Self {
        let coordinates = coordinates(rows);
        Self {
            residual: self.residual.select_rows(&coordinates),
            jacobian: self.jacobian.select_rows(&coordinates),
            sites: self.sites.select_columns(&coordinates),
            inputs: self.inputs.select_columns(rows),
            configuration: rows.iter().map(|&row| self.configuration[row]).collect(),
            relative_sigma: rows.iter().map(|&row| self.relative_sigma[row]).collect(),
        }
    }

    /// Returns the row indices of each configuration, in the order in which the configurations
    /// first appear.
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
