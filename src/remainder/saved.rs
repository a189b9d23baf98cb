//! remainder.json: a correction as a file.

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use serde_json::value::{RawValue, to_raw_value};

use super::correction::{Correction, Linearised};
use super::kernel::Hyperparameters;
use super::posterior::Posterior;
use super::prior::ParameterPrior;
use super::rows::{AXES, Inputs, Layout, Rows};
use super::scores::Scores;
use crate::files::read_limited;
use crate::problem::Problem;

/// Largest remainder.json that is read \[MiB\].
const LARGEST_MIB: u64 = 256;
/// Name and version of the format.
const FORMAT: (&str, u32) = ("flexcal-remainder", 1);
/// What the file holds.
const KIND: &str = "gaussian-process-at-joints";
/// Correlation function of all processes.
const KERNEL: &str = "matern-5/2";

/// A remainder.json that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SavedRemainderError {
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable { file: PathBuf, source: io::Error },
    #[error("{}: not a remainder.json: {source}", file.display())]
    Syntax { file: PathBuf, source: serde_json::Error },
    #[error("{}: not a remainder.json of this version: {what}", file.display())]
    Format { file: PathBuf, what: &'static str },
    #[error("{}: is the remainder of problem {found}, not of {expected}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error("{}: was fitted to another declared arm (a fixed value, a mass, gravity or an effect has changed since); fit it again with flexcal identify --remainder", file.display())]
    OtherArm { file: PathBuf },
}

#[derive(Serialize, Deserialize)]
struct Format {
    name: String,
    version: u32,
}

#[derive(Serialize, Deserialize)]
struct Site {
    /// Joint, counted from 1.
    joint: usize,
    /// Root mean square of ‖∂p/∂q‖ [m/rad] or [1].
    lever: f64,
    /// 1 σ of the error that follows the joint's command, as motion of the target.
    single_amplitude_m: f64,
    /// The same of the error that follows all inputs.
    joint_amplitude_m: f64,
}

#[derive(Serialize, Deserialize)]
struct Input {
    name: String,
    joint: usize,
    is_angle: bool,
    offset: f64,
    unit: f64,
    min: f64,
    max: f64,
}

#[derive(Serialize, Deserialize)]
struct Lengths {
    single: f64,
    joint: f64,
}

#[derive(Serialize, Deserialize)]
struct Parameter {
    name: String,
    /// Value about which the arm is linearised, SI.
    estimate: f64,
    /// The same as a deviation from nominal.
    deviation: f64,
    /// Change of the deviation beside the remainder.
    change: f64,
    prior_mean: f64,
    prior_sigma: f64,
}

#[derive(Serialize, Deserialize)]
struct ScoreLists {
    configurations: usize,
    single: Vec<f64>,
    blocks: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
struct Document {
    format: Format,
    program: String,
    problem: String,
    arm_digest: String,
    kind: String,
    kernel: String,
    sites: Vec<Site>,
    inputs: Vec<Input>,
    lengths: Lengths,
    noise_m: f64,
    configuration_noise_m: f64,
    sigma_m: f64,
    parameters: Vec<Parameter>,
    scores: ScoreLists,
    /// Standardised inputs of each centre.
    centres: Vec<Box<RawValue>>,
    /// Site columns of each centre: three coordinates, each with one number for every site.
    columns: Vec<Box<RawValue>>,
    /// Weights of the three coordinates of each centre.
    weights: Vec<Box<RawValue>>,
    /// Lower triangle L, row by row, of the precision L Lᵀ of the standardised weights and of the
    /// parameters.
    covariance_factor: Vec<Box<RawValue>>,
}

/// Numbers as one line of JSON.
fn line(numbers: &[f64]) -> Option<Box<RawValue>> {
    to_raw_value(numbers).ok()
}

/// A number with seven digits: variances follow from the factor to as many.
fn shortened(number: f64) -> f64 {
    format!("{number:.6e}").parse().unwrap_or(number)
}

impl Correction {
    /// The correction as JSON text, ending in a line break.
    #[doc(hidden)]
    pub fn to_json(&self) -> String {
        let Posterior { hyper, prior, centres, factor, .. } = &self.posterior;
        let change = self.posterior.parameters();
        let weights = self.posterior.kernel_weights();
        let site = |(k, (&joint, &lever)): (usize, (&usize, &f64))| Site {
            joint: joint + 1,
            lever,
            single_amplitude_m: hyper.single[k],
            joint_amplitude_m: hyper.joint[k],
        };
        let inputs = &self.layout.inputs;
        let input = |(k, &joint): (usize, &usize)| Input {
            name: format!("q{}", joint + 1),
            joint: joint + 1,
            is_angle: inputs.angles[k],
            offset: inputs.standard[k].0,
            unit: inputs.standard[k].1,
            min: inputs.ranges[k].0,
            max: inputs.ranges[k].1,
        };
        let parameter = |(k, parameter): (usize, &Linearised)| Parameter {
            name: parameter.name.clone(),
            estimate: parameter.estimate,
            deviation: parameter.deviation,
            change: change[k],
            prior_mean: prior.mean[k],
            prior_sigma: prior.spread[k],
        };
        let of_site = AXES * centres.sites.nrows();
        let document = Document {
            format: Format { name: FORMAT.0.to_owned(), version: FORMAT.1 },
            program: format!("flexcal {}", env!("CARGO_PKG_VERSION")),
            problem: self.problem.clone(),
            arm_digest: self.arm_digest.clone(),
            kind: KIND.to_owned(),
            kernel: KERNEL.to_owned(),
            sites: self
                .layout
                .joints
                .iter()
                .zip(&self.layout.levers)
                .enumerate()
                .map(site)
                .collect(),
            inputs: inputs.joints.iter().enumerate().map(input).collect(),
            lengths: Lengths { single: hyper.lengths[0], joint: hyper.lengths[1] },
            noise_m: hyper.noise,
            configuration_noise_m: hyper.shared_noise,
            sigma_m: self.sigma,
            parameters: self.parameters.iter().enumerate().map(parameter).collect(),
            scores: ScoreLists {
                configurations: self.scores.configurations,
                single: self.scores.single.clone(),
                blocks: self.scores.blocks.clone(),
            },
            centres: (0..centres.len()).filter_map(|row| line(centres.inputs_of(row))).collect(),
            columns: centres.sites.as_slice().chunks(of_site.max(1)).filter_map(line).collect(),
            weights: weights.as_slice().chunks(AXES).filter_map(line).collect(),
            covariance_factor: (0..factor.nrows())
                .filter_map(|row| {
                    line(&(0..=row).map(|k| shortened(factor[(row, k)])).collect::<Vec<_>>())
                })
                .collect(),
        };
        let mut text = serde_json::to_string_pretty(&document).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Reads a remainder.json.
    ///
    /// # Errors
    /// The file cannot be read or is no remainder.json.
    pub fn read(file: &Path) -> Result<Self, SavedRemainderError> {
        let unreadable = |source| SavedRemainderError::Unreadable { file: file.to_owned(), source };
        let bytes = read_limited(file, LARGEST_MIB << 20).map_err(unreadable)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| unreadable(io::Error::from(io::ErrorKind::InvalidData)))?;
        Self::parse(&text, file)
    }

    /// Reads the text of a remainder.json; `file` names it in messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    #[doc(hidden)]
    pub fn parse(text: &str, file: &Path) -> Result<Self, SavedRemainderError> {
        let syntax = |source| SavedRemainderError::Syntax { file: file.to_owned(), source };
        let wrong = |what| SavedRemainderError::Format { file: file.to_owned(), what };
        let document: Document = serde_json::from_str(text).map_err(syntax)?;
        let Format { name, version } = &document.format;
        if (name.as_str(), *version) != FORMAT || document.kind != KIND || document.kernel != KERNEL
        {
            return Err(wrong("another format, kind or kernel"));
        }
        let rows = |lines: &[Box<RawValue>]| {
            lines
                .iter()
                .map(|line| serde_json::from_str::<Vec<f64>>(line.get()))
                .collect::<Result<Vec<_>, _>>()
                .map_err(syntax)
        };
        let (centres, columns) = (rows(&document.centres)?, rows(&document.columns)?);
        let (weights, lower) = (rows(&document.weights)?, rows(&document.covariance_factor)?);
        let (count, sites) = (centres.len(), document.sites.len());
        let parameters = document.parameters.len();
        let size = AXES * count + parameters;
        let has_sizes = columns.len() == count
            && weights.len() == count
            && lower.len() == size
            && centres.iter().all(|line| line.len() == document.inputs.len())
            && columns.iter().all(|line| line.len() == AXES * sites)
            && weights.iter().all(|line| line.len() == AXES)
            && lower.iter().enumerate().all(|(row, line)| line.len() == row + 1);
        if !has_sizes {
            return Err(wrong("centres, columns, weights and covariance_factor differ in size"));
        }
        let hyper = Hyperparameters {
            single: document.sites.iter().map(|site| site.single_amplitude_m).collect(),
            joint: document.sites.iter().map(|site| site.joint_amplitude_m).collect(),
            lengths: [document.lengths.single, document.lengths.joint],
            noise: document.noise_m,
            shared_noise: document.configuration_noise_m,
        };
        let joints: Vec<usize> =
            document.sites.iter().map(|site| site.joint.wrapping_sub(1)).collect();
        let of_input = |input: &Input| input.joint.wrapping_sub(1);
        let inputs = Inputs {
            joints: document.inputs.iter().map(of_input).collect(),
            angles: document.inputs.iter().map(|input| input.is_angle).collect(),
            site_of: document
                .inputs
                .iter()
                .map(|input| joints.iter().position(|&joint| joint == of_input(input)))
                .collect(),
            standard: document.inputs.iter().map(|input| (input.offset, input.unit)).collect(),
            ranges: document.inputs.iter().map(|input| (input.min, input.max)).collect(),
        };
        let of_parameters = |of: fn(&Parameter) -> f64| {
            DVector::from_iterator(parameters, document.parameters.iter().map(of))
        };
        let prior = ParameterPrior {
            mean: of_parameters(|parameter| parameter.prior_mean),
            spread: of_parameters(|parameter| parameter.prior_sigma),
        };
        let centres = Rows {
            residual: DVector::zeros(AXES * count),
            jacobian: DMatrix::zeros(AXES * count, parameters),
            sites: DMatrix::from_vec(sites, AXES * count, columns.concat()),
            inputs: DMatrix::from_vec(document.inputs.len(), count, centres.concat()),
            configuration: (0..count).collect(),
            relative_sigma: vec![1.0; count],
        };
        let factor = DMatrix::from_fn(size, size, |i, j| if j <= i { lower[i][j] } else { 0.0 });
        let change = of_parameters(|parameter| parameter.change);
        let posterior = Posterior::restored(
            (hyper, inputs.clone()),
            (centres, prior),
            (factor, DVector::from_vec(weights.concat()), change),
        )
        .ok_or_else(|| wrong("the covariance of the centres is not positive definite"))?;
        let levers = document.sites.iter().map(|site| site.lever).collect();
        let linearised = |parameter: Parameter| Linearised {
            name: parameter.name,
            deviation: parameter.deviation,
            estimate: parameter.estimate,
        };
        let ScoreLists { configurations, single, blocks } = document.scores;
        Ok(Self {
            problem: document.problem,
            arm_digest: document.arm_digest,
            sigma: document.sigma_m,
            layout: Layout { joints, levers, inputs },
            parameters: document.parameters.into_iter().map(linearised).collect(),
            posterior,
            scores: Scores { configurations, single, blocks },
        })
    }

    /// Checks that the correction belongs to `problem`; `file` names it in messages.
    ///
    /// # Errors
    /// It was fitted to another problem, or to the same one declared otherwise.
    #[doc(hidden)]
    pub fn check(&self, problem: &Problem, file: &Path) -> Result<(), SavedRemainderError> {
        let file = || file.to_owned();
        if self.problem != problem.name {
            let (found, expected) = (self.problem.clone(), problem.name.clone());
            return Err(SavedRemainderError::OtherProblem { file: file(), found, expected });
        }
        let joints = self.layout.joints.iter().chain(&self.layout.inputs.joints);
        let is_known = joints.copied().all(|joint| joint < problem.joints.len());
        if self.arm_digest != problem.digest() || !is_known {
            return Err(SavedRemainderError::OtherArm { file: file() });
        }
        Ok(())
    }
}
