//! Measured rows linearised about a fit: residuals, Jacobians of parameters and of sites, inputs.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use crate::problem::PoseView;

/// Coordinates of a position.
pub(super) const AXES: usize = 3;

/// Sites at which an arm may err, and the quantities on which these errors may depend.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    pub sites: Vec<Site>,
    /// Inputs of the functions.
    pub inputs: Inputs,
}

/// Place of an error that the remainder describes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Site {
    /// Joint, counted from 0.
    pub joint: usize,
    pub kind: SiteKind,
    /// Unit of the site's columns: root mean square of the target's slope over the rows fitted,
    /// \[m/rad\] or \[1\] for a coordinate. Compliances share the largest of theirs \[N·m²/rad\].
    pub lever: f64,
}

/// Quantity of a joint that errs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SiteKind {
    /// Coordinate of the joint: a function of its command and one of all inputs.
    Coordinate,
    /// Compliance of the joint: a constant.
    Compliance,
}

/// Quantity on which errors depend.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Source {
    /// Command of a joint, counted from 0.
    Command(usize),
    /// Temperature of the pose \[°C\].
    Temperature,
    /// Payload of the pose \[kg\].
    Payload,
    /// Hoist force of the pose \[N\].
    Hoist,
}

impl Source {
    /// Conditions other than commands.
    pub const CONDITIONS: [Self; 3] = [Self::Temperature, Self::Payload, Self::Hoist];

    /// Value at a pose; `None` where the pose does not state it.
    pub fn value(self, setup: &PoseView) -> Option<f64> {
        match self {
            Self::Command(joint) => setup.configuration.get(joint).copied(),
            Self::Temperature => setup.temperature.copied(),
            Self::Payload => setup.payload.copied(),
            Self::Hoist => setup.hoist.copied(),
        }
    }

    /// Name in files: `q1`, …, `temperature`, `payload`, `hoist`.
    pub fn name(self) -> String {
        match self {
            Self::Command(joint) => format!("q{}", joint + 1),
            Self::Temperature => "temperature".to_owned(),
            Self::Payload => "payload".to_owned(),
            Self::Hoist => "hoist".to_owned(),
        }
    }

    /// Reads a name in a file.
    pub fn parse(name: &str) -> Option<Self> {
        if let Some(condition) = Self::CONDITIONS.into_iter().find(|of| of.name() == name) {
            return Some(condition);
        }
        let joint: usize = name.strip_prefix('q')?.parse().ok()?;
        Some(Self::Command(joint.checked_sub(1)?))
    }
}

/// Functions whose sum is the error of a site.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct SiteFunctions {
    /// Input of the function uⱼ of one input, if there is one.
    pub single: Option<usize>,
    /// True for a function vⱼ of all inputs.
    pub joint: bool,
    /// True for a constant.
    pub constant: bool,
}

/// Inputs of the remainder: the commands of the moving joints, and conditions that vary.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Inputs {
    /// Functions of each site.
    pub sites: Vec<SiteFunctions>,
    pub sources: Vec<Source>,
    /// True for an angle, whose distances are chords.
    pub angles: Vec<bool>,
    /// Offset and unit of each input: 0 and 1 for angles, mean and standard deviation for others.
    pub standard: Vec<(f64, f64)>,
    /// Smallest and largest value in the rows fitted, in the unit of the source.
    pub ranges: Vec<(f64, f64)>,
}

impl Inputs {
    /// Functions of the errors at these sites.
    pub fn functions(sites: &[Site], sources: &[Source]) -> Vec<SiteFunctions> {
        let functions = |site: &Site| {
            let is_coordinate = site.kind == SiteKind::Coordinate;
            let command = Source::Command(site.joint);
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

/// Rows of positions linearised about a fit; three coordinates a row.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// Measured − predicted position, shape = (3 rows) \[m\].
    pub residual: DVector<f64>,
    /// ∂p/∂x of the free parameters, shape = (3 rows, parameters).
    pub jacobian: DMatrix<f64>,
    /// Slope of the position by each site's quantity over its lever, shape = (sites, 3 rows).
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
