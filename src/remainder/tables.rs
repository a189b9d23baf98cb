//! Tables of a correction, from which exported programs compute the same shifts as this library.

use nalgebra::DVector;

use super::correction::Correction;
use super::inducing::Inducing;
use super::kernel::Hyperparameters;
use super::rows::{AXES, InputSource, Inputs, Layout, Site, SiteKind};
use crate::model::Model;

/// Site at which the remainder models an error: the coordinate or the compliance of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiteTable {
    /// Index of the joint, counted from 0.
    pub joint: usize,
    /// True if the error is in the compliance of the joint, false if it is in the joint's
    /// coordinate.
    pub is_compliance: bool,
    /// Lever by which the derivative of the position is divided: \[m/rad\] for a revolute joint,
    /// \[1\] for a prismatic one, \[N·m²/rad\] for a compliance.
    pub lever: f64,
    /// Prior variances \[m²\] of the error times `lever`. There are three parts: as a function of
    /// the joint's command alone, as a function of all inputs, and constant.
    pub variances: [f64; 3],
    /// Index of the input that is the joint's own command, and 1/ℓᵤ² of the function of that
    /// command alone; `None` without such a function.
    pub single: Option<(usize, f64)>,
}

/// Input of the error functions, with its standardisation and its correlation length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputTable {
    /// Quantity of a pose that is the input.
    pub source: InputSource,
    /// True if the input is an angle, so that distances are chords.
    pub is_angle: bool,
    /// Offset and unit that standardise the input as (value − offset) / unit.
    pub standard: (f64, f64),
    /// Inverse squared correlation length 1/ℓᵥ² along this input of the functions of all inputs.
    pub scale: f64,
}

/// Tables of the shift w (k(x, centres) c + J δ). The applied share is w = 1 − posterior / prior
/// variance, with prior − posterior = tr(Φ E Φᵀ) and Φ = (k(x, centres), J S½).
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionTables {
    /// Joint coordinates and compliances at which errors are modelled.
    pub sites: Vec<SiteTable>,
    /// Inputs on which the errors depend.
    pub inputs: Vec<InputTable>,
    /// Standardised inputs of each centre.
    pub centres: Vec<Vec<f64>>,
    /// Derivatives of the position with respect to the sites at each centre, divided by the levers:
    /// for each of three coordinates, one number per site.
    pub slopes: Vec<Vec<f64>>,
    /// Knots of the functions of a joint's own command: index of the site, and standardised input.
    pub knots: Vec<(usize, f64)>,
    /// Kernel weights c: three for each centre, then one for each knot.
    pub weights: Vec<f64>,
    /// Index in the model, change δ and prior standard deviation S½ of each parameter.
    pub parameters: Vec<(usize, f64, f64)>,
    /// Lower triangle of the matrix E, row by row. The data explain the part tr(Φ E Φᵀ) of the
    /// prior variance of a correction.
    pub explained: Vec<f64>,
}

impl Correction {
    /// Returns the indices of the joints whose compliance errors the remainder models, counted from
    /// 0.
    pub fn compliant_joints(&self) -> Vec<usize> {
        let sites = self.layout.sites.iter().filter(|site| site.kind == SiteKind::Compliance);
        sites.map(|site| site.joint).collect()
    }

    /// Returns the tables of the remainder for the arm at the full parameter vector `x` of `model`;
    /// `None` without a remainder.
    pub fn tables(&self, model: &Model, x: &DVector<f64>) -> Option<CorrectionTables> {
        if !self.has_remainder() {
            return None;
        }
        // The fields are listed without `..`, so that a new field cannot be forgotten in the
        // export.
        let Layout { sites, inputs } = &self.layout;
        let Inputs { sites: functions, sources, angles, standard, ranges: _ } = inputs;
        let Hyperparameters {
            single,
            joint,
            constant,
            single_lengths,
            input_lengths,
            noise: _,
            shared_noise: _,
        } = &self.posterior.hyper;
        let Inducing { centres, knots } = &self.posterior.inducing;
        let change = self.posterior.parameters();
        let place = |name: &str| model.parameters.iter().position(|found| found.name == name);
        let shared_columns: Vec<(usize, usize)> = (self.parameters.iter().enumerate())
            .filter_map(|(column, parameter)| Some((column, place(&parameter.name)?)))
            .collect();
        let parameter = |&(column, k): &(usize, usize)| {
            let moved = x[k] - self.parameters[column].deviation;
            (k, change[column] - moved, self.posterior.prior.spread[column])
        };
        let kernel = self.posterior.inducing.len();
        let explained = self.posterior.explained();
        let kept: Vec<usize> =
            (0..kernel).chain(shared_columns.iter().map(|&(column, _)| kernel + column)).collect();
        let lower = |(i, &row): (usize, &usize)| {
            kept[..=i].iter().map(|&column| explained[(row, column)]).collect::<Vec<f64>>()
        };
        let inverse_square = |length: f64| length.powi(-2);
        let site = |(s, site): (usize, &Site)| SiteTable {
            joint: site.joint,
            is_compliance: site.kind == SiteKind::Compliance,
            lever: site.lever,
            variances: [single[s], joint[s], constant[s]].map(|size: f64| size * size),
            single: (functions[s].single).map(|input| (input, inverse_square(single_lengths[s]))),
        };
        let input = |(k, &source): (usize, &InputSource)| InputTable {
            source,
            is_angle: angles[k],
            standard: standard[k],
            scale: inverse_square(input_lengths[k]),
        };
        let rows = |numbers: &[f64], width: usize| {
            numbers.chunks(width.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>()
        };
        Some(CorrectionTables {
            sites: sites.iter().enumerate().map(site).collect(),
            inputs: sources.iter().enumerate().map(input).collect(),
            centres: rows(centres.inputs.as_slice(), sources.len()),
            slopes: rows(centres.sites.as_slice(), AXES * sites.len()),
            knots: knots.iter().map(|knot| (knot.site, knot.at)).collect(),
            weights: self.posterior.kernel_weights().as_slice().to_vec(),
            parameters: shared_columns.iter().map(parameter).collect(),
            explained: kept.iter().enumerate().flat_map(lower).collect(),
        })
    }
}
