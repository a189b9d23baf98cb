//! Reads and writes `remainder.json`, a saved correction.

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::value::{RawValue, to_raw_value};

use super::correction::{Correction, LinearisedParameter};
use super::inducing::{Inducing, Knot};
use super::kernel::Hyperparameters;
use super::posterior::Posterior;
use super::prior::ParameterPrior;
use super::rows::{AXES, InputSource, Inputs, Layout, Rows, Site, SiteKind};
use super::scores::Scores;
use crate::error::Location;
use crate::files::{Changes, FORMAT_VERSION, Format, PROGRAM, changed_key, read_limited, sealed};
use crate::fit::SavedEstimate;
use crate::problem::Problem;

/// Largest size of a `remainder.json` that is read \[MiB\].
const MAX_FILE_MIB: u64 = 256;
/// Name of the file format.
pub const FORMAT: &str = "flexcal-remainder";
/// Largest relative difference between the values of a parameter in two files of one run.
const MAX_ROUNDING: f64 = 1e-12;
/// Value of the key `kind`: the only kind of correction that this version reads.
const KIND: &str = "gaussian-process-at-joints";
/// Value of the key `kernel`: the correlation function of all processes.
const KERNEL: &str = "matern-5/2";

/// Reason why a `remainder.json` cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum SavedRemainderError {
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable { file: PathBuf, source: io::Error },
    #[error("{}: not a remainder.json: {source}", file.display())]
    Syntax { file: PathBuf, source: serde_json::Error },
    #[error("{}: a {found}, not a remainder.json", file.display())]
    OtherDocument { file: PathBuf, found: &'static str },
    #[error("{}: not a remainder.json of this version: {what}", file.display())]
    Format { file: PathBuf, what: &'static str },
    #[error("{}: {key}: changed since flexcal wrote it; fit it again with flexcal identify --remainder, or take it as it is with --trust", file.display())]
    Changed { file: PathBuf, key: String },
    #[error("{}: is the remainder of problem {found}, not of {expected}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error("{}: was fitted to another declared arm (a nominal or fixed value, a mass, gravity or an effect has changed since); fit it again with flexcal identify --remainder", file.display())]
    OtherArm { file: PathBuf },
    #[error("{}: belongs to another estimate than {} ({parameter} differs): one of the two files is of another run; fit both again with flexcal identify --remainder", file.display(), estimate.display())]
    OtherEstimate { file: PathBuf, estimate: PathBuf, parameter: String },
    #[error(
        "{location}: {source}; fit a remainder with flexcal identify --remainder, or write use = \
         false"
    )]
    Declared { location: Location, source: Box<SavedRemainderError> },
}

/// Returns the name of the file if a text is another result of flexcal; `None` otherwise.
fn other_document(text: &str) -> Option<&'static str> {
    let document: serde_json::Value = serde_json::from_str(text).ok()?;
    match document.get("format")?.get("name").or_else(|| document.get("format"))?.as_str()? {
        "flexcal-estimate" => Some("file estimate.json"),
        "flexcal-loop" => Some("file loop.json"),
        "flexcal-trace" => Some("file trace.json"),
        _ => None,
    }
}

#[derive(Serialize, Deserialize, JsonSchema)]
struct SavedSite {
    /// Joint, counted from 1.
    joint: usize,
    kind: SiteKind,
    /// Lever of the site: [m/rad] for a revolute joint, \[1\] for a prismatic one, [N·m²/rad] for
    /// compliances.
    lever: f64,
    /// 1 σ of the error that is a function of the joint's own command, as motion of the position.
    single_amplitude_m: f64,
    /// Length ℓᵤ of the function of the joint's own command: rad for angles, standard deviations
    /// for other inputs.
    single_length: f64,
    /// 1 σ of the error that is a function of all inputs, as motion of the position.
    joint_amplitude_m: f64,
    /// 1 σ of the constant error, as motion of the position.
    constant_amplitude_m: f64,
}

#[derive(Serialize, Deserialize, JsonSchema)]
struct Input {
    /// Name of the input: `q1`, …, `temperature`, `payload` or `hoist`.
    name: String,
    is_angle: bool,
    offset: f64,
    unit: f64,
    min: f64,
    max: f64,
    /// Length ℓᵥ along this input of the functions of all inputs: rad for angles, standard
    /// deviations for others.
    joint_length: f64,
}

#[derive(Serialize, Deserialize, JsonSchema)]
struct Parameter {
    name: String,
    /// Estimated value about which the arm is linearised, SI.
    estimate: f64,
    /// Deviation of the estimated value from nominal, SI.
    deviation: f64,
    /// Change of the parameter when it is fitted together with the remainder, SI.
    change: f64,
    prior_mean: f64,
    prior_sigma: f64,
}

#[derive(Serialize, Deserialize, JsonSchema)]
struct ScoreLists {
    configurations: usize,
    single: Vec<f64>,
    blocks: Vec<f64>,
}

/// Content of a `remainder.json`.
#[derive(Serialize, Deserialize, JsonSchema)]
pub struct SavedRemainder {
    format: Format,
    program: String,
    problem: String,
    arm_digest: String,
    kind: String,
    kernel: String,
    sites: Vec<SavedSite>,
    inputs: Vec<Input>,
    noise_m: f64,
    configuration_noise_m: f64,
    sigma_m: f64,
    parameters: Vec<Parameter>,
    scores: ScoreLists,
    /// Standardised inputs of each centre, one array per centre.
    #[schemars(with = "Vec<Vec<f64>>")]
    centres: Vec<Box<RawValue>>,
    /// Derivatives with respect to the sites at each centre: for each of three coordinates, one
    /// number per site.
    #[schemars(with = "Vec<Vec<f64>>")]
    columns: Vec<Box<RawValue>>,
    /// Kernel weights of each centre, three coordinates per array.
    #[schemars(with = "Vec<[f64; 3]>")]
    weights: Vec<Box<RawValue>>,
    /// Knots: number of the site, counted from 1, standardised input, and kernel weight.
    #[serde(default)]
    knots: Vec<(usize, f64, f64)>,
    /// Lower triangular factor L, row by row, of the precision A = L Lᵀ of the feature weights.
    #[schemars(with = "Vec<Vec<f64>>")]
    covariance_factor: Vec<Box<RawValue>>,
}

/// Formats numbers as a JSON array on one line.
fn line(numbers: &[f64]) -> Option<Box<RawValue>> {
    to_raw_value(numbers).ok()
}

/// Rounds a number to seven significant digits; variances computed from the factor need no more.
fn shortened(number: f64) -> f64 {
    format!("{number:.6e}").parse().unwrap_or(number)
}

impl Correction {
    /// Returns the correction as JSON text with the digests that show later changes, ending in a
    /// line break.
    #[doc(hidden)]
    pub fn to_json(&self) -> String {
        sealed(&self.to_text())
    }

    /// Returns the correction as JSON text without digests, ending in a line break.
    pub(crate) fn to_text(&self) -> String {
        let Posterior { hyper, prior, inducing: Inducing { centres, knots }, factor, .. } =
            &self.posterior;
        let change = self.posterior.parameters();
        let weights = self.posterior.kernel_weights();
        let site = |(k, site): (usize, &Site)| SavedSite {
            joint: site.joint + 1,
            kind: site.kind,
            lever: site.lever,
            single_amplitude_m: hyper.single[k],
            single_length: hyper.single_lengths[k],
            joint_amplitude_m: hyper.joint[k],
            constant_amplitude_m: hyper.constant[k],
        };
        let inputs = &self.layout.inputs;
        let input = |(k, source): (usize, &InputSource)| Input {
            name: source.name(),
            is_angle: inputs.angles[k],
            offset: inputs.standard[k].0,
            unit: inputs.standard[k].1,
            min: inputs.ranges[k].0,
            max: inputs.ranges[k].1,
            joint_length: hyper.input_lengths.get(k).copied().unwrap_or(1.0),
        };
        let parameter = |(k, parameter): (usize, &LinearisedParameter)| Parameter {
            name: parameter.name.clone(),
            estimate: parameter.estimate,
            deviation: parameter.deviation,
            change: change[k],
            prior_mean: prior.mean[k],
            prior_sigma: prior.spread[k],
        };
        let of_site = AXES * centres.sites.nrows();
        let document = SavedRemainder {
            format: Format::current(FORMAT),
            program: PROGRAM.to_owned(),
            problem: self.problem.clone(),
            arm_digest: self.arm_digest.clone(),
            kind: KIND.to_owned(),
            kernel: KERNEL.to_owned(),
            sites: self.layout.sites.iter().enumerate().map(site).collect(),
            inputs: inputs.sources.iter().enumerate().map(input).collect(),
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
            weights: weights.as_slice()[..AXES * centres.len()]
                .chunks(AXES)
                .filter_map(line)
                .collect(),
            knots: knots
                .iter()
                .zip(&weights.as_slice()[AXES * centres.len()..])
                .map(|(knot, weight)| (knot.site + 1, knot.at, *weight))
                .collect(),
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

    /// Reads a `remainder.json`.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is not a `remainder.json`, or was changed and
    /// `changes` refuses that.
    pub fn read(file: &Path, changes: Changes) -> Result<Self, SavedRemainderError> {
        let unreadable = |source| SavedRemainderError::Unreadable { file: file.to_owned(), source };
        let bytes = read_limited(file, MAX_FILE_MIB << 20).map_err(unreadable)?;
        let text = String::from_utf8(bytes)
            .map_err(|_| unreadable(io::Error::from(io::ErrorKind::InvalidData)))?;
        let correction = Self::parse(&text, file)?;
        match changed_key(&text) {
            Ok(Some(key)) if changes == Changes::Refused => {
                Err(SavedRemainderError::Changed { file: file.to_owned(), key })
            }
            _ => Ok(correction),
        }
    }

    /// Parses the text of a `remainder.json`; `file` is its path for error messages.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read).
    #[doc(hidden)]
    pub fn parse(text: &str, file: &Path) -> Result<Self, SavedRemainderError> {
        if let Some(found) = other_document(text) {
            return Err(SavedRemainderError::OtherDocument { file: file.to_owned(), found });
        }
        let syntax = |source| SavedRemainderError::Syntax { file: file.to_owned(), source };
        let wrong = |what| SavedRemainderError::Format { file: file.to_owned(), what };
        let document: SavedRemainder = serde_json::from_str(text).map_err(syntax)?;
        let Format { name, version } = &document.format;
        if (&**name, *version) != (FORMAT, FORMAT_VERSION)
            || document.kind != KIND
            || document.kernel != KERNEL
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
        let size = AXES * count + document.knots.len() + parameters;
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
            constant: document.sites.iter().map(|site| site.constant_amplitude_m).collect(),
            single_lengths: document.sites.iter().map(|site| site.single_length).collect(),
            input_lengths: document.inputs.iter().map(|input| input.joint_length).collect(),
            noise: document.noise_m,
            shared_noise: document.configuration_noise_m,
        };
        let site = |saved: &SavedSite| {
            Some(Site { joint: saved.joint.checked_sub(1)?, kind: saved.kind, lever: saved.lever })
        };
        let found_sites: Option<Vec<Site>> = document.sites.iter().map(site).collect();
        let found_sources: Option<Vec<InputSource>> =
            document.inputs.iter().map(|input| InputSource::parse(&input.name)).collect();
        let (Some(found_sites), Some(sources)) = (found_sites, found_sources) else {
            return Err(wrong("a site or an input has no joint"));
        };
        let inputs = Inputs {
            sites: Inputs::functions(&found_sites, &sources),
            sources,
            angles: document.inputs.iter().map(|input| input.is_angle).collect(),
            standard: document.inputs.iter().map(|input| (input.offset, input.unit)).collect(),
            ranges: document.inputs.iter().map(|input| (input.min, input.max)).collect(),
        };
        let of_parameters = |of: fn(&Parameter) -> f64| {
            DVector::from_iterator(parameters, document.parameters.iter().map(of))
        };
        let prior = ParameterPrior {
            mean: of_parameters(|parameter| parameter.prior_mean),
            spread: of_parameters(|parameter| parameter.prior_sigma),
            // The saved factor of the precision contains what they say.
            information: None,
        };
        let centres = Rows {
            residual: DVector::zeros(AXES * count),
            jacobian: DMatrix::zeros(AXES * count, parameters),
            sites: DMatrix::from_vec(sites, AXES * count, columns.concat()),
            inputs: DMatrix::from_vec(document.inputs.len(), count, centres.concat()),
            configuration: (0..count).collect(),
            relative_sigma: vec![1.0; count],
        };
        let knot = |&(site, at, _): &(usize, f64, f64)| {
            let site = site.checked_sub(1)?;
            inputs.sites.get(site)?.single.map(|_| Knot { site, at })
        };
        let knots: Option<Vec<Knot>> = document.knots.iter().map(knot).collect();
        let knots = knots.ok_or_else(|| wrong("a knot is at a site without a function"))?;
        let weights = weights.into_iter().flatten();
        let weights = weights.chain(document.knots.iter().map(|knot| knot.2)).collect::<Vec<_>>();
        let factor = DMatrix::from_fn(size, size, |i, j| if j <= i { lower[i][j] } else { 0.0 });
        let change = of_parameters(|parameter| parameter.change);
        let posterior = Posterior::restored(
            (hyper, inputs.clone()),
            (Inducing { centres, knots }, prior),
            (factor, DVector::from_vec(weights), change),
        )
        .ok_or_else(|| wrong("the covariance of the centres is not positive definite"))?;
        let linearised = |parameter: Parameter| LinearisedParameter {
            name: parameter.name,
            deviation: parameter.deviation,
            estimate: parameter.estimate,
        };
        let ScoreLists { configurations, single, blocks } = document.scores;
        Ok(Self {
            problem: document.problem,
            arm_digest: document.arm_digest,
            sigma: document.sigma_m,
            layout: Layout { sites: found_sites, inputs },
            parameters: document.parameters.into_iter().map(linearised).collect(),
            posterior,
            scores: Scores { configurations, single, blocks },
        })
    }

    /// Checks that the correction belongs to `problem`; `file` is its path for error messages.
    ///
    /// # Errors
    /// Returns an error if it was fitted to another problem, or to another declaration of this one.
    #[doc(hidden)]
    pub fn check(&self, problem: &Problem, file: &Path) -> Result<(), SavedRemainderError> {
        let file = || file.to_owned();
        if self.problem != problem.name {
            let (found, expected) = (self.problem.clone(), problem.name.clone());
            return Err(SavedRemainderError::OtherProblem { file: file(), found, expected });
        }
        let commands = self.layout.inputs.sources.iter().filter_map(|source| match source {
            InputSource::Command(joint) => Some(*joint),
            _ => None,
        });
        let mut joints = self.layout.sites.iter().map(|site| site.joint).chain(commands);
        let is_known = joints.all(|joint| joint < problem.joints.len());
        if self.arm_digest != problem.digest() || !is_known {
            return Err(SavedRemainderError::OtherArm { file: file() });
        }
        Ok(())
    }

    /// Checks that the correction was fitted together with `estimate`: equal values of their common
    /// parameters.
    ///
    /// # Errors
    /// Returns an error with the first parameter whose values differ.
    pub(super) fn check_estimate(
        &self,
        estimate: &SavedEstimate,
        file: &Path,
    ) -> Result<(), SavedRemainderError> {
        let differs = |parameter: &&LinearisedParameter| {
            estimate.value(&parameter.name).is_some_and(|value| {
                let largest = value.abs().max(parameter.estimate.abs());
                (value - parameter.estimate).abs() > MAX_ROUNDING * largest
            })
        };
        self.parameters.iter().find(differs).map_or(Ok(()), |parameter| {
            Err(SavedRemainderError::OtherEstimate {
                file: file.to_owned(),
                estimate: estimate.file.clone(),
                parameter: parameter.name.clone(),
            })
        })
    }
}
