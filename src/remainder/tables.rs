//! Tables of a correction, from which other programs compute the same shifts.

use nalgebra::DVector;

use super::correction::Correction;
use super::kernel::Hyperparameters;
use super::rows::{AXES, Inputs, Layout};
use crate::model::Model;

/// Site at which an arm errs: the coordinate of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SiteTable {
    /// Index of the joint.
    pub joint: usize,
    /// Unit of its slope ∂p/∂q \[m/rad\] or \[1\].
    pub lever: f64,
    /// Variances of the errors that follow its own command, all inputs, and none \[m²\].
    pub variances: [f64; 3],
    /// Index of the input that is its own command, and 1/ℓ² of the error that follows it.
    pub single: Option<(usize, f64)>,
}

/// Quantity of a pose on which errors depend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum InputSource {
    /// Command of a joint, counted from 0.
    Command(usize),
}

/// Input of the errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InputTable {
    /// Quantity of a pose.
    pub source: InputSource,
    /// True if distances are chords of angles.
    pub is_angle: bool,
    /// Offset and unit of the standardised input.
    pub standard: (f64, f64),
    /// 1/ℓ² of the errors that follow all inputs.
    pub scale: f64,
}

/// Tables of the shift w (k(x, centres) c + J δ), with w = 1 − left / prior:
/// prior − left = tr Φ E Φᵀ, Φ = (k(x, centres), J S½).
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectionTables {
    /// Sites that err.
    pub sites: Vec<SiteTable>,
    /// Quantities on which their errors depend.
    pub inputs: Vec<InputTable>,
    /// Standardised inputs of each centre.
    pub centres: Vec<Vec<f64>>,
    /// Site columns of each centre: three coordinates, each with one number for every site.
    pub slopes: Vec<Vec<f64>>,
    /// Knots of the errors that follow one input: index of the site, and standardised input.
    pub knots: Vec<(usize, f64)>,
    /// Weights c: three of each centre, then one of each knot.
    pub weights: Vec<f64>,
    /// Index in the model, change δ and S½ of each parameter.
    pub parameters: Vec<(usize, f64, f64)>,
    /// Lower triangle of E, row by row.
    pub explained: Vec<f64>,
}

impl Correction {
    /// Returns the tables of the remainder for the arm at the full parameter vector `x` of `model`;
    /// `None` without a remainder.
    pub fn tables(&self, model: &Model, x: &DVector<f64>) -> Option<CorrectionTables> {
        if !self.has_remainder() {
            return None;
        }
        // Named without rest: a new field must be exported too.
        let Layout { joints, levers, inputs } = &self.layout;
        let Inputs { joints: input_joints, angles, site_of, standard, ranges: _ } = inputs;
        let Hyperparameters { single, joint, lengths, noise: _, shared_noise: _ } =
            &self.posterior.hyper;
        let centres = &self.posterior.centres;
        let change = self.posterior.parameters();
        let place = |name: &str| model.parameters.iter().position(|found| found.name == name);
        let known: Vec<(usize, usize)> = (self.parameters.iter().enumerate())
            .filter_map(|(column, parameter)| Some((column, place(&parameter.name)?)))
            .collect();
        let parameter = |&(column, k): &(usize, usize)| {
            let moved = x[k] - self.parameters[column].deviation;
            (k, change[column] - moved, self.posterior.prior.spread[column])
        };
        let kernel = AXES * centres.len();
        let explained = self.posterior.explained();
        let kept: Vec<usize> =
            (0..kernel).chain(known.iter().map(|&(column, _)| kernel + column)).collect();
        let lower = |(i, &row): (usize, &usize)| {
            kept[..=i].iter().map(|&column| explained[(row, column)]).collect::<Vec<f64>>()
        };
        let [single_scale, scale] = lengths.map(|length: f64| length.powi(-2));
        let site = |(s, (&joint_index, &lever)): (usize, (&usize, &f64))| SiteTable {
            joint: joint_index,
            lever,
            variances: [single[s].powi(2), joint[s].powi(2), 0.0],
            single: (site_of.iter().position(|of| *of == Some(s)))
                .map(|input| (input, single_scale)),
        };
        let input = |(k, &joint): (usize, &usize)| InputTable {
            source: InputSource::Command(joint),
            is_angle: angles[k],
            standard: standard[k],
            scale,
        };
        let rows = |numbers: &[f64], width: usize| {
            numbers.chunks(width.max(1)).map(<[f64]>::to_vec).collect::<Vec<_>>()
        };
        Some(CorrectionTables {
            sites: joints.iter().zip(levers).enumerate().map(site).collect(),
            inputs: input_joints.iter().enumerate().map(input).collect(),
            centres: rows(centres.inputs.as_slice(), input_joints.len()),
            slopes: rows(centres.sites.as_slice(), AXES * joints.len()),
            knots: Vec::new(),
            weights: self.posterior.kernel_weights().as_slice().to_vec(),
            parameters: known.iter().map(parameter).collect(),
            explained: kept.iter().enumerate().flat_map(lower).collect(),
        })
    }
}
