//! Reader of `[data]`: measurement files and their use.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::Problem;
use super::dialect::{self, Dialect};
use super::item::Item;
use super::joint_log::{self, JointLog};
use super::joint_source::JointSource;
use super::path::without_detours;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location, TableErrorKind};
use crate::observation::{Needs, Observation, kinds};
use crate::quantity::{Suffix, Unit};

/// Maximum number of measurement files.
const MAX_DATA_FILES: usize = 1000;
/// Maximum number of declared covariates; the search tests each of them at every joint.
const MAX_COVARIATES: usize = 20;

/// Section `[data]`: measurement files and their use.
#[derive(Debug, Clone)]
pub struct Data {
    /// Measurement files, resolved against the problem's folder.
    pub files: Vec<PathBuf>,
    /// Standard deviation of a measured coordinate \[m\]; `None` if unknown.
    pub position_sigma: Option<f64>,
    /// Place of `position_sigma_mm`, or else of `[data]`, for messages.
    #[doc(hidden)]
    pub position_sigma_location: Location,
    /// Standard deviations of other kinds of rows by their name \[m\] or \[rad\]. Tilts are not
    /// read without one.
    pub kind_sigmas: BTreeMap<&'static str, f64>,
    /// Selection of rows that take no part in fitting or choosing effects; `None` if the file
    /// states none.
    pub held_out: Option<HeldOut>,
    /// Reference temperature T₀ [°C].
    pub reference_temperature: Option<f64>,
    /// Source of the configurations if a table has both commands and readings.
    pub joints: JointSource,
    /// Second table with the joint coordinates; `None` if the measured table holds them.
    pub joint_log: Option<JointLog>,
    /// Standard deviation of a measured orientation about each axis \[rad\]; `None` if orientations
    /// are not fitted.
    pub orientation_sigma: Option<f64>,
    /// True if orientations are fitted, which requires `orientation_sigma`.
    pub fits_orientation: bool,
    /// Format of the files and names of their columns.
    pub dialect: Dialect,
    /// Covariates on which the arm's errors may depend, in the order of the file.
    pub covariates: Vec<DeclaredCovariate>,
    /// Place of `files`, or else of `[data]`, for errors.
    pub files_location: Location,
    /// Place of `held_out`, or else of `[data]`, for errors.
    pub held_out_location: Location,
    /// Place of `[data]`, for errors.
    pub location: Location,
}

/// Entry of `[data.covariates]`: a user column that effects may depend on, in its unit.
#[derive(Debug, Clone)]
pub struct DeclaredCovariate {
    /// Name of the column.
    pub name: String,
    /// Description of the covariate for display.
    pub meaning: String,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Value of `held_out` in `[data]`: selection of the rows that are not fitted.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HeldOut {
    /// Holds out the rows whose cell in the column of this name is `validation`.
    Column(String),
    /// Holds out a random fraction; rows of one joint configuration stay together.
    Fraction {
        /// Fraction of the rows, in (0, 1).
        fraction: f64,
        /// Seed of the random choice.
        seed: u64,
    },
    /// Holds out all rows of one session.
    Session(String),
    /// Holds out no row. Prediction errors are those of each configuration, left out of the fit in
    /// turn.
    Nothing,
}

impl Data {
    /// Returns the standard deviation that `[data]` declares for each number of an observation
    /// \[m\] or \[rad\].
    fn sigma_of(&self, observation: Observation) -> Option<f64> {
        if observation.is_position() {
            return self.position_sigma;
        }
        self.kind_sigmas.get(observation.kind()).copied()
    }
}

impl Problem {
    /// Returns the declared standard deviation of each number that a row measures \[m\], \[rad\] or
    /// \[px\]. For pixels it is the one that the camera declares.
    pub(crate) fn sigma_of(&self, observation: Observation) -> Option<f64> {
        let mut fixtures = observation.fixtures().into_iter().flatten();
        let of_fixture = fixtures.find_map(|fixture| self.fixtures.get(fixture)?.sigma);
        of_fixture.or(self.data.sigma_of(observation))
    }
}

/// Reads the section; returns empty settings if it is absent.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Data, InputError> {
    let file = root.location();
    let Some(mut section) = root.section("data")? else {
        let location = Location::file(file.file).with_key("data");
        return Ok(Data {
            files: Vec::new(),
            position_sigma: None,
            position_sigma_location: location.clone(),
            kind_sigmas: BTreeMap::new(),
            held_out: None,
            reference_temperature: None,
            joints: JointSource::Commanded,
            joint_log: None,
            orientation_sigma: None,
            fits_orientation: false,
            dialect: Dialect::default(),
            covariates: Vec::new(),
            files_location: location.clone(),
            held_out_location: location.clone(),
            location,
        });
    };
    let location = section.location();
    let mut files = Vec::new();
    let mut files_location = location.clone();
    if let Some(item) = section.get("files") {
        let folder = file.file.parent().unwrap_or(Path::new(""));
        let names = item.list("a list of file names")?;
        item.check_count("files", names.len(), MAX_DATA_FILES)?;
        for element in names {
            files.push(without_detours(folder.join(element.text()?)));
        }
        files_location = item.location();
    }
    let of_suffix = |suffix: &Suffix| section.peek(&format!("position_sigma_{}", suffix.name));
    let position_sigma_location = Unit::Length.suffixes().iter().find_map(of_suffix);
    let position_sigma_location =
        position_sigma_location.map_or_else(|| location.clone(), |item| item.location());
    let mut kind_sigmas = BTreeMap::new();
    // The σ of a known distance is declared in `[[distance]]`, that of a pixel in `[[camera]]`.
    let beside = [Needs::Fixtures, Needs::Carriers];
    for kind in kinds().filter(|kind| !beside.contains(&kind.needs)) {
        let not_positive = |value| InputErrorKind::NotPositive { value };
        let sigma = section.positive(&format!("{}_sigma", kind.name), kind.unit, not_positive)?;
        kind_sigmas.extend(sigma.map(|sigma| (kind.name, sigma)));
    }
    let position_sigma = kind_sigmas.remove(Observation::Position.kind());
    let mut held_out = None;
    let mut held_out_location = location.clone();
    if let Some(item) = section.get("held_out") {
        held_out_location = item.location();
        held_out = Some(match item.text() {
            Ok("none") => HeldOut::Nothing,
            Err(_) if item.holds_tables() => read_held_out_rows(item.section()?)?,
            text => {
                let word = text.ok().map(str::to_owned);
                return Err(item.error(InputErrorKind::NotOneHeldOut { word }));
            }
        });
    }
    let reference_temperature = section.number("reference_temperature", Unit::Temperature)?;
    let (mut joints, mut joint_log) = (JointSource::default(), None);
    if let Some(item) = section.peek("joints").filter(Item::holds_tables) {
        let folder = file.file.parent().unwrap_or(Path::new(""));
        let (log, source) = joint_log::read(&item, folder)?;
        (joints, joint_log) = (source.unwrap_or_default(), Some(log));
        section.get("joints");
    } else if let Some(item) = section.peek("joints").filter(|item| !is_word_of_joints(item)) {
        let file = item.first_text().unwrap_or("joints.csv");
        let write = format!(
            "joints = {{ files = [\"{file}\"], by = \"name\" }}, by also \"order\" or \"time\""
        );
        return Err(item.error(TableErrorKind::JointTable { write }));
    } else if let Some(source) = section.word("joints", &JointSource::WORDS, &JointSource::EACH)? {
        joints = source;
    }
    let orientation_sigma = section.positive("orientation_sigma", Unit::Angle, |value| {
        InputErrorKind::NotPositive { value }
    })?;
    let dialect = dialect::read(&mut section)?;
    let covariates = section
        .section("covariates")?
        .map_or(Ok(Vec::new()), |section| read_covariates(&section))?;
    section.finish()?;
    Ok(Data {
        files,
        position_sigma,
        position_sigma_location,
        kind_sigmas,
        held_out,
        reference_temperature,
        joints,
        joint_log,
        orientation_sigma,
        fits_orientation: orientation_sigma.is_some(),
        dialect,
        covariates,
        files_location,
        held_out_location,
        location,
    })
}

/// Returns true unless the value of `joints` is a list, or the name of a file.
fn is_word_of_joints(item: &Item<'_, '_>) -> bool {
    item.text().map_or_else(|_| item.list("").is_err(), |word| !word.contains(['.', '/', '\\']))
}

/// Reads the entries `name = "meaning"`.
fn read_covariates(section: &Section<'_, '_>) -> Result<Vec<DeclaredCovariate>, InputError> {
    section.check_names()?;
    let entries = section.entries();
    if let Some((_, item)) = entries.first() {
        item.check_count("covariates", entries.len(), MAX_COVARIATES)?;
    }
    let declaration = |(name, item): (&str, Item<'_, '_>)| {
        // Parameter names contain the covariate in brackets after a comma.
        if name.trim() != name || name.is_empty() || name.contains(['[', ']', ',', '*', '?', '"']) {
            return Err(item.error(InputErrorKind::NoCovariateName { name: name.to_owned() }));
        }
        Ok(DeclaredCovariate {
            name: name.to_owned(),
            meaning: item.text()?.to_owned(),
            location: item.location(),
        })
    };
    entries.into_iter().map(declaration).collect()
}

fn read_held_out_rows(mut section: Section<'_, '_>) -> Result<HeldOut, InputError> {
    let column = section.get("column");
    let fraction = section.get("fraction");
    let session = section.get("session");
    let seed = section.get("seed");
    section.finish()?;
    match (column, fraction, session, seed) {
        (Some(column), None, None, None) => Ok(HeldOut::Column(column.text()?.trim().to_owned())),
        (None, None, Some(session), None) => {
            Ok(HeldOut::Session(session.text()?.trim().to_owned()))
        }
        (None, Some(item), None, seed) => {
            let fraction = item.number()?;
            if fraction <= 0.0 || fraction >= 1.0 {
                return Err(item.error(InputErrorKind::NotAFraction { value: fraction }));
            }
            let seed = seed.map_or(Ok(0), |seed| seed.whole(0))?;
            Ok(HeldOut::Fraction { fraction, seed })
        }
        _ => Err(section.error(InputErrorKind::NotOneHeldOut { word: None })),
    }
}
