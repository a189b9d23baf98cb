//! Reader of `estimate.json`, by which an identified arm is applied without another fit.

use std::collections::{BTreeMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use nalgebra::{DMatrix, DVector};

use super::saved_document::{Document, Entry};
use super::saved_estimate_error::{
    DifferingPart, FORMAT, Format, MAX_FILE_MIB, SavedEstimateError, missing, not_an_estimate,
};
use super::saved_posterior::SavedPosterior;
use crate::error::{binary_format, one_line};
use crate::files::{Changes, changed_key, read_limited};
use crate::fit::checks::finding::{RESERVATIONS, doubted_bounds};
use crate::fit::checks::open_views::MAX_POSE_ERROR;
use crate::fit::checks::pose_sufficiency::label;
use crate::fit::{Placement, Strategy};
use crate::measurement::{Measurements, StartTimes};
use crate::model::parameter::Parameter;
use crate::model::{Model, Pose};
use crate::problem::Problem;
use crate::problem::digest::with_whole_names;
use crate::problem::item::MAX_MAGNITUDE;

/// Smallest identified share of a parameter, 0…1, at which the data determine it.
const MIN_IDENTIFIED_SHARE: f64 = 0.99;

/// Largest deviation of a factor from 1 that rounding explains.
const MAX_ROUNDING: f64 = 1e-9;

/// Identified arm as saved in an `estimate.json`.
#[derive(Debug, Clone)]
pub struct SavedEstimate {
    /// Path of the file.
    pub file: PathBuf,
    /// Whether files that belong to the estimate are accepted or refused if they were changed since
    /// flexcal wrote them.
    pub changes: Changes,
    /// First key of the file that was changed since flexcal wrote it; `None` if nothing changed.
    pub changed_key: Option<String>,
    /// True if no check of the fit reported an error.
    pub trusted: bool,
    /// Findings that contradict a trusted fit or say that it was not judged, as texts.
    pub reservations: Vec<String>,
    /// What held-out rows say against the error bounds of predictions; `None` if nothing.
    #[doc(hidden)]
    pub doubted_bounds: Option<String>,
    /// Standard deviation (1 σ) of a measured coordinate, estimated from the scatter of the fit
    /// \[m\]; `None` if the problem declares σ.
    pub estimated_sigma: Option<f64>,
    /// Reduced χ² of the fit if its residuals are larger than the declared noise; `None` otherwise.
    #[doc(hidden)]
    pub misfit: Option<f64>,
    /// Start time of each session, relative to which time-dependent terms are evaluated; `None` in
    /// files of older versions.
    pub start_times: Option<StartTimes>,
    /// True if the fitted rows had directions of approach; false in files of older versions.
    pub(crate) has_approach: bool,
    /// False in files of older versions, which do not say whether rows had directions of approach.
    pub(crate) states_approach: bool,
    /// Name of the `remainder.json` in the same folder; `None` if no remainder was accepted.
    pub remainder: Option<String>,
    /// Text of the remainder, if it is in no file.
    pub(crate) remainder_text: Option<String>,
    /// Measurement files of the fit, as its command named them; empty if the file names none.
    pub measurement_files: Vec<PathBuf>,
    /// Section on the uncertainty of predictions, as JSON text; `None` in files of older versions.
    pub prediction: Option<String>,
    /// Name of the problem.
    problem: String,
    /// Digest of the declared arm; `None` in files of older versions.
    arm_digest: Option<String>,
    /// Digest of each part of the declared arm, by its name; empty in files of older versions.
    pub(crate) arm_parts: BTreeMap<String, String>,
    /// Strategy of the fit.
    pub strategy: Strategy,
    pub(super) parameters: Vec<Entry>,
    /// Uncertainty and noise of the estimate.
    pub(crate) posterior: SavedPosterior,
}

impl SavedEstimate {
    /// Returns those of the coordinates `names` of a pose that were fitted although the rows leave
    /// them open.
    #[doc(hidden)]
    pub fn undetermined<'a>(&self, names: &'a [String]) -> Vec<&'a str> {
        let is_wide = |of: &Entry| of.std_error.is_none_or(|error| error > MAX_POSE_ERROR);
        let is_open = |of: &Entry| of.fitted == Some(true) && is_wide(of);
        names.iter().filter(|name| self.entry(name).is_some_and(is_open)).map(|x| &**x).collect()
    }

    /// Returns a copy of the estimate without the fitted parameters for whose name `is_left_out`
    /// returns true.
    pub(crate) fn without_fitted(&self, is_left_out: impl Fn(&str) -> bool) -> Self {
        let mut estimate = self.clone();
        estimate.parameters.retain(|entry| entry.fitted != Some(true) || !is_left_out(&entry.name));
        estimate
    }

    /// Returns true if the estimate has parameters of this part of the arm, such as `joint2` or
    /// `base[A]`.
    fn has_part(&self, part: &str) -> bool {
        let of_part =
            |name: &str| name.strip_prefix(part).is_some_and(|rest| rest.starts_with('.'));
        self.parameters.iter().any(|entry| of_part(&entry.name))
    }

    /// Returns the sessions of a table whose base the estimate does not know, although it knows other
    /// bases.
    #[doc(hidden)]
    pub fn unknown_sessions<'a>(&self, rows: &'a Measurements) -> Vec<&'a str> {
        let knows_bases = self.parameters.iter().any(|entry| entry.name.starts_with("base"));
        let names = rows.session.names.iter().map(String::as_str);
        let is_unknown = |name: &&str| !name.is_empty() && !self.has_part(&label("base", name));
        if knows_bases { names.filter(is_unknown).collect() } else { Vec::new() }
    }

    /// Reads an `estimate.json`.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is no `estimate.json`, has a parameter twice or
    /// with a value that is too large, or was changed since flexcal wrote it.
    pub fn read(file: &Path) -> Result<Self, SavedEstimateError> {
        Self::read_with(file, Changes::Refused)
    }

    /// Reads an `estimate.json`; `changes` states whether a changed file is accepted.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read).
    pub(crate) fn read_with(file: &Path, changes: Changes) -> Result<Self, SavedEstimateError> {
        let named = || file.to_owned();
        let bytes =
            read_limited(file, MAX_FILE_MIB << 20).map_err(|source| match source.kind() {
                io::ErrorKind::FileTooLarge => SavedEstimateError::TooLarge { file: named() },
                io::ErrorKind::NotFound => SavedEstimateError::NoSuchFile { file: named() },
                _ => SavedEstimateError::Unreadable { file: named(), source },
            })?;
        if let Some(found) = binary_format(&bytes) {
            return Err(SavedEstimateError::OtherFile { file: named(), found });
        }
        let text =
            String::from_utf8(bytes).map_err(|_| SavedEstimateError::NotUtf8 { file: named() })?;
        Self::parse_with(&text, file, changes)
    }

    /// Parses the text of an `estimate.json`; `file` names it in messages.
    ///
    /// # Errors
    /// Returns the errors of [`read`](Self::read), except those of reading the file.
    #[doc(hidden)]
    pub fn parse(text: &str, file: &Path) -> Result<Self, SavedEstimateError> {
        Self::parse_with(text, file, Changes::Refused)
    }

    fn parse_with(text: &str, file: &Path, changes: Changes) -> Result<Self, SavedEstimateError> {
        let file = file.to_owned();
        let Document {
            format,
            problem,
            arm_digest,
            strategy,
            trusted,
            estimated_sigma_mm,
            first_time_s,
            session_times_s,
            has_approach,
            mut parameters,
            remainder,
            measurement_files,
            prediction,
            arm_parts,
            covariance,
            sigma_taken_mm,
            noise_factor,
            reduced_chi2,
            chance,
            fitted_rows,
            prior,
            findings,
        } = match serde_json::from_str(text) {
            Ok(document) => document,
            Err(source) => return Err(not_an_estimate(text, file, source)),
        };
        if let Some(Format { name, version }) = format {
            if name != FORMAT.0 {
                return Err(SavedEstimateError::OtherFormat { file, name: one_line(&name) });
            }
            if version > FORMAT.1 {
                return Err(SavedEstimateError::NewerFormat { file, version });
            }
        }
        let problem = one_line(&problem);
        for entry in &mut parameters {
            entry.name = one_line(&entry.name);
        }
        let mut names = HashSet::new();
        for Entry { name, nominal, estimate, .. } in &parameters {
            if !names.insert(name.as_str()) {
                return Err(SavedEstimateError::Twice { file, name: name.clone() });
            }
            if !(estimate.abs() <= MAX_MAGNITUDE && nominal.abs() <= MAX_MAGNITUDE) {
                return Err(SavedEstimateError::MagnitudeTooLarge { file, name: name.clone() });
            }
        }
        // Digests are checked last, because the errors above explain more.
        let changed_key = match changed_key(text) {
            Ok(key) => key.map(|key| one_line(&key)),
            Err(source) => return Err(SavedEstimateError::Syntax { file, source }),
        };
        if let (Some(key), Changes::Refused) = (&changed_key, changes) {
            return Err(SavedEstimateError::Changed { file, key: key.clone() });
        }
        let estimated_sigma =
            estimated_sigma_mm.map(|sigma: f64| sigma * 1e-3).filter(|sigma| *sigma > 0.0);
        let named =
            Strategy::EACH.into_iter().find(|named| strategy.as_deref() == Some(named.as_str()));
        let strategy = named.unwrap_or_default();
        Ok(Self {
            file,
            changes,
            changed_key,
            trusted,
            doubted_bounds: doubted_bounds(
                findings.iter().flatten().map(|of| (of.code.as_str(), of.text.as_str())),
            )
            .map(|text| one_line(&text)),
            reservations: findings
                .into_iter()
                .flatten()
                .filter(|of| RESERVATIONS.iter().any(|code| code.entry().code == of.code))
                .map(|of| one_line(&of.text))
                .collect(),
            misfit: reduced_chi2.filter(|chi2| {
                let factor = noise_factor.unwrap_or(1.0);
                let is_known = (factor - 1.0).abs() <= MAX_ROUNDING;
                let exceeds = chance.is_some_and(|(_, high)| *chi2 > high);
                let is_large = if is_known { exceeds } else { factor > 1.0 };
                estimated_sigma.is_none() && remainder.is_none() && is_large
            }),
            estimated_sigma,
            start_times: first_time_s
                .map(|first| StartTimes { first, sessions: session_times_s.unwrap_or_default() }),
            has_approach: has_approach.unwrap_or(false),
            states_approach: has_approach.is_some(),
            remainder: remainder.and_then(|result| result.file),
            remainder_text: None,
            measurement_files: measurement_files.unwrap_or_default(),
            prediction: prediction.map(|result| result.get().to_owned()),
            problem,
            arm_digest,
            arm_parts: with_whole_names(arm_parts.unwrap_or_default()),
            strategy,
            posterior: SavedPosterior {
                covariance: DMatrix::from_fn(parameters.len(), parameters.len(), |i, j| {
                    let entry = covariance.as_ref().and_then(|rows| rows.get(i)?.get(j).copied());
                    entry.flatten().unwrap_or(f64::NAN)
                }),
                sigma_taken: sigma_taken_mm.map(|sigma| sigma * 1e-3),
                noise_factor: noise_factor.unwrap_or(1.0),
                fitted_rows: fitted_rows.unwrap_or_default(),
                has_prior: prior.is_some(),
                includes_fleet: prior.and_then(|prior| prior.includes_fleet).unwrap_or(false),
            },
            parameters,
        })
    }

    /// Returns the estimate with the text of its `remainder.json`, which then is in no file.
    #[doc(hidden)]
    #[must_use]
    pub fn with_remainder(self, text: String) -> Self {
        Self { remainder_text: Some(text), ..self }
    }

    /// Returns the model that the saved strategy fitted, derived from the `declared` model.
    #[must_use]
    pub(crate) fn model(&self, declared: Model) -> Model {
        self.strategy.model(declared)
    }

    /// Sets the elapsed times of `poses` to those since the start of their session in the
    /// identification; `placement` is that of the poses. Without start times in the file, they
    /// stay.
    pub(crate) fn count_time_in(&self, placement: &Placement, poses: &mut [Pose]) {
        if let Some(starts) = &self.start_times {
            placement.count_time_from(starts, poses);
        }
    }

    /// Checks that the estimate belongs to `problem` with the model `model`: equal name, nominal
    /// values and declared arm. Bases and tools of the estimate that the model lacks are ignored:
    /// those of sessions without rows, and the single ones if the rows name sessions.
    ///
    /// # Errors
    /// Returns an error if the estimate belongs to another problem, or to a different version of
    /// its declaration.
    pub(crate) fn check(&self, problem: &Problem, model: &Model) -> Result<(), SavedEstimateError> {
        let file = || self.file.clone();
        if self.problem != problem.name {
            let (found, expected) = (self.problem.clone(), problem.name.clone());
            return Err(SavedEstimateError::OtherProblem { file: file(), found, expected });
        }
        for entry in &self.parameters {
            let name = || entry.name.clone();
            let Some(parameter) = model.parameters.iter().find(|known| known.name == entry.name)
            else {
                if is_other_placement(&entry.name, model) {
                    continue;
                }
                return Err(SavedEstimateError::NotFree { file: file(), name: name() });
            };
            if (parameter.nominal - entry.nominal).abs() > 1e-9 * parameter.nominal.abs().max(1.0) {
                let (found, expected) = (entry.nominal, parameter.nominal);
                return Err(SavedEstimateError::OtherNominal {
                    file: file(),
                    name: name(),
                    found,
                    expected,
                });
            }
        }
        if self.arm_digest.as_ref().is_some_and(|digest| *digest != problem.digest()) {
            return Err(SavedEstimateError::OtherArm { file: file() });
        }
        Ok(())
    }

    /// Returns true if the fitted rows did not determine the pose of a base in its measuring frame.
    /// Contacts with sockets at unknown positions, for example, do not determine it.
    pub(crate) fn leaves_base_open(&self) -> bool {
        let is_base =
            |entry: &&Entry| entry.name.starts_with("base.") || entry.name.starts_with("base[");
        let is_open = |entry: &Entry| {
            entry.std_error.is_none()
                && entry.identified.is_some_and(|part| part < MIN_IDENTIFIED_SHARE)
        };
        self.parameters.iter().filter(is_base).any(is_open)
    }

    /// Returns the names in brackets of the saved bases or tools (`of` is "base" or "tool"), in the
    /// order of the file. If none has a name, the list has one empty name.
    pub(crate) fn words(&self, of: &str) -> Vec<String> {
        let mut words: Vec<String> = Vec::new();
        for entry in &self.parameters {
            let bracket = entry
                .name
                .strip_prefix(of)
                .and_then(|rest| rest.strip_prefix('[')?.split_once(']'));
            if let Some((word, _)) =
                bracket.filter(|(word, _)| !words.iter().any(|earlier| earlier == word))
            {
                words.push(word.to_owned());
            }
        }
        if words.is_empty() { vec![String::new()] } else { words }
    }

    /// Returns the estimated value of the parameter `name`, in SI units; `None` if the estimate
    /// lacks it.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.entry(name).map(|entry| entry.estimate)
    }

    fn entry(&self, name: &str) -> Option<&Entry> {
        self.parameters.iter().find(|entry| entry.name == name)
    }

    /// Returns the rows of `table` to which the arm was fitted.
    #[doc(hidden)]
    pub fn fitted_among(&self, table: &Measurements) -> Vec<usize> {
        let fitted = &self.posterior.fitted_rows;
        (0..table.len()).filter(|&row| table.is_among(row, fitted)).collect()
    }

    /// Returns name, estimated value \[SI\] and prior σ of every parameter, in the order of the
    /// covariance; the prior σ is `None` without a prior.
    pub(crate) fn entries(&self) -> impl Iterator<Item = (&str, f64, Option<f64>)> {
        self.parameters.iter().map(|entry| (&*entry.name, entry.estimate, entry.prior_sigma))
    }

    /// Returns the nominal value of a parameter, SI; `None` if the estimate lacks it.
    pub(crate) fn nominal_of(&self, name: &str) -> Option<f64> {
        self.entry(name).map(|entry| entry.nominal)
    }

    /// Returns the symbol of the SI unit of a parameter; `None` if the file has no such parameter,
    /// or no unit for it.
    pub(crate) fn unit_of(&self, name: &str) -> Option<&str> {
        self.entry(name)?.unit.as_deref()
    }

    /// Returns the name of the problem that was identified.
    pub(crate) fn problem_name(&self) -> &str {
        &self.problem
    }

    /// Returns the numbers of declared joints of this estimate and of `other` if they differ; `None`
    /// if they are equal or not known.
    pub(crate) fn joint_counts(&self, other: &Self) -> Option<[usize; 2]> {
        let [one, two] = [self, other].map(|estimate| {
            estimate.arm_parts.keys().filter(|part| part.starts_with("joint ")).count()
        });
        (one != two && one.min(two) > 0).then_some([one, two])
    }

    /// Returns the first part of the declared arm in which this estimate and `other` differ; `None`
    /// if both are of the same declared arm.
    pub(crate) fn differing_part(&self, other: &Self) -> Option<DifferingPart> {
        let (parts, others) = (&self.arm_parts, &other.arm_parts);
        let differs = |name: &&String| parts.get(*name) != others.get(*name);
        let part = parts.keys().chain(others.keys()).find(differs).map(|part| DifferingPart {
            name: part.clone(),
            is_declared: [parts, others].map(|of| of.is_empty() || of.contains_key(part)),
        });
        part.or_else(|| {
            (self.arm_digest != other.arm_digest).then(|| DifferingPart {
                name: "the declared arm".to_owned(),
                is_declared: [true; 2],
            })
        })
    }

    /// Checks, as [`check`](Self::check) does, that the estimate is of the declared arm of
    /// `problem`. The estimate must also have a value of every parameter of the model except bases,
    /// tools and fixtures.
    ///
    /// # Errors
    /// Returns an error that names what differs.
    pub(crate) fn check_same_arm(
        &self,
        problem: &Problem,
        model: &Model,
    ) -> Result<(), SavedEstimateError> {
        let checked = self.check(problem, model);
        if !matches!(checked, Ok(()) | Err(SavedEstimateError::OtherArm { .. })) {
            return checked;
        }
        let lacks = |parameter: &&Parameter| {
            !parameter.site.is_placement() && self.value(&parameter.name).is_none()
        };
        if let Some(parameter) = model.parameters.iter().find(lacks) {
            let (file, name) = (self.file.clone(), parameter.name.clone());
            return Err(SavedEstimateError::LacksParameter { file, name });
        }
        let parts = problem.digest_parts();
        let differs = |name: &&String| parts.get(*name) != self.arm_parts.get(*name);
        match self.arm_parts.keys().chain(parts.keys()).find(differs) {
            Some(part) if !self.arm_parts.is_empty() => {
                let (file, part) = (self.file.clone(), part.clone());
                Err(SavedEstimateError::OtherPart { file, part })
            }
            _ => checked,
        }
    }

    /// Returns the full parameter vector of `model`, a model of `problem`, with the estimated
    /// values.
    ///
    /// # Errors
    /// Returns an error if the estimate is of another problem or arm, or lacks a parameter of the
    /// model.
    #[doc(hidden)]
    pub fn vector(
        &self,
        problem: &Problem,
        model: &Model,
    ) -> Result<DVector<f64>, SavedEstimateError> {
        self.check(problem, model)?;
        let missing = |name| missing(self.file.clone(), name, |kind| self.words(kind));
        model.parameter_vector(|name| self.value(name)).map_err(missing)
    }
}

/// Returns true if the saved parameter `name` is of a base or tool with a name in brackets. Also
/// true for that of a single base or tool if those of `model` have names in brackets.
fn is_other_placement(name: &str, model: &Model) -> bool {
    ["base", "tool"].iter().any(|kind| {
        let (bracketed, single) = (format!("{kind}["), format!("{kind}."));
        let has_names =
            || model.parameters.iter().any(|parameter| parameter.name.starts_with(&bracketed));
        name.starts_with(&bracketed) || name.starts_with(&single) && has_names()
    })
}
