//! `[data]`: where the measurements are and how they are used.

use std::path::{Path, PathBuf};

use super::dialect::{self, Dialect};
use super::fixture::Observation;
use super::item::Item;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Most files of measurements.
const MOST_FILES: usize = 1000;
/// Most covariates of one's own: each is looked for at every joint.
const MOST_COVARIATES: usize = 20;

/// `[data]`.
#[derive(Debug, Clone)]
pub struct Data {
    /// Measurement files, already resolved against the problem's folder.
    pub files: Vec<PathBuf>,
    /// 1 σ of a measured coordinate \[m\]; `None`: not known.
    pub position_sigma: Option<f64>,
    /// The same of a target at a point, of a measured distance, and of a distance from a surface
    /// \[m\].
    pub point_sigma: Option<f64>,
    /// See [`point_sigma`](Self::point_sigma).
    pub distance_sigma: Option<f64>,
    /// See [`point_sigma`](Self::point_sigma).
    pub surface_sigma: Option<f64>,
    /// 1 σ of a measured tilt \[rad\]; `None`: tilts are not read.
    pub tilt_sigma: Option<f64>,
    /// Which rows never take part in fitting or choosing; `None` where the file says nothing.
    pub held_out: Option<HeldOut>,
    /// T₀ [°C].
    pub reference_temperature: Option<f64>,
    /// Which of commands and readings of the joints are the configuration.
    pub joints: JointSource,
    /// 1 σ of a measured orientation about each axis \[rad\]; `None`: orientations are not fitted.
    pub orientation_sigma: Option<f64>,
    /// Whether orientations are fitted; without a σ they never are.
    pub fits_orientation: bool,
    /// How the files are written.
    pub dialect: Dialect,
    /// Further columns that errors of the arm may depend on, in the order of the file.
    pub covariates: Vec<OwnCovariate>,
    /// Where `files` stands, or `[data]`, for errors.
    pub files_location: Location,
    /// Where `held_out` stands, or `[data]`, for errors.
    pub held_out_location: Location,
    /// Where `[data]` stands, for errors.
    pub location: Location,
}

/// A line of `[data.covariates]`: a column of one's own, in its own unit.
#[derive(Debug, Clone)]
pub struct OwnCovariate {
    /// Name of the column.
    pub name: String,
    /// What it is, in words.
    pub meaning: String,
    /// For errors.
    pub location: Location,
}

/// Where the configurations come from, in tables that have both.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum JointSource {
    /// What the joints were told: `q1_deg`.
    #[default]
    Commanded,
    /// What their encoders read: `q1_read_deg`.
    Read,
}

impl JointSource {
    /// As the file has it.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Commanded => "commanded",
            Self::Read => "read",
        }
    }
}

/// `held_out` of `[data]`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum HeldOut {
    /// Rows whose column says `validation`.
    Column(String),
    /// A random part of the joint configurations; rows of one configuration stay together.
    Fraction {
        /// Part of the rows, in (0, 1).
        fraction: f64,
        /// Seed of the choice.
        seed: u64,
    },
    /// Every row of one session.
    Session(String),
}

impl Data {
    /// 1 σ of what a row measures, as declared \[m\].
    pub fn sigma_of(&self, observation: Observation) -> Option<f64> {
        match observation {
            Observation::Position => self.position_sigma,
            Observation::Point(_) => self.point_sigma,
            Observation::Distance(_) => self.distance_sigma,
            Observation::Surface(_) => self.surface_sigma,
            Observation::Tilt(_) => self.tilt_sigma,
            Observation::Between(..) => None,
        }
    }
}

/// The section; empty where it is not there.
pub(super) fn read(root: &mut Section<'_, '_>) -> Result<Data, InputError> {
    let file = root.location();
    let Some(mut section) = root.section("data")? else {
        let location = Location::file(file.file).with_key("data");
        return Ok(Data {
            files: Vec::new(),
            position_sigma: None,
            point_sigma: None,
            distance_sigma: None,
            surface_sigma: None,
            tilt_sigma: None,
            held_out: None,
            reference_temperature: None,
            joints: JointSource::Commanded,
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
        item.check_count("files", names.len(), MOST_FILES)?;
        for element in names {
            files.push(folder.join(element.text()?));
        }
        files_location = item.location();
    }
    let mut sigma =
        |base| section.positive(base, Unit::Length, |value| InputErrorKind::NotPositive { value });
    let (position_sigma, point_sigma) = (sigma("position_sigma")?, sigma("point_sigma")?);
    let (distance_sigma, surface_sigma) = (sigma("distance_sigma")?, sigma("surface_sigma")?);
    let tilt_sigma = section
        .positive("tilt_sigma", Unit::Angle, |value| InputErrorKind::NotPositive { value })?;
    let mut held_out = None;
    let mut held_out_location = location.clone();
    if let Some(item) = section.get("held_out") {
        held_out_location = item.location();
        held_out = Some(held_out_rows(item.section()?)?);
    }
    let reference_temperature = section.number("reference_temperature", Unit::Temperature)?;
    let sources = [JointSource::Commanded, JointSource::Read];
    let joints = section.word("joints", &["commanded", "read"], &sources)?.unwrap_or_default();
    let orientation_sigma = section.positive("orientation_sigma", Unit::Angle, |value| {
        InputErrorKind::NotPositive { value }
    })?;
    let dialect = dialect::read(&mut section)?;
    let covariates =
        section.section("covariates")?.map_or(Ok(Vec::new()), |section| covariates(&section))?;
    section.finish()?;
    Ok(Data {
        files,
        position_sigma,
        point_sigma,
        distance_sigma,
        surface_sigma,
        tilt_sigma,
        held_out,
        reference_temperature,
        joints,
        orientation_sigma,
        fits_orientation: orientation_sigma.is_some(),
        dialect,
        covariates,
        files_location,
        held_out_location,
        location,
    })
}

/// `name = "what it is"`, one a line.
fn covariates(section: &Section<'_, '_>) -> Result<Vec<OwnCovariate>, InputError> {
    let entries = section.entries();
    if let Some((_, item)) = entries.first() {
        item.check_count("covariates", entries.len(), MOST_COVARIATES)?;
    }
    let one = |(name, item): (&str, Item<'_, '_>)| {
        // Names of parameters have it between brackets, behind a comma.
        if name.trim() != name || name.is_empty() || name.contains(['[', ']', ',', '*', '?', '"']) {
            return Err(item.error(InputErrorKind::NoCovariateName { name: name.to_owned() }));
        }
        Ok(OwnCovariate {
            name: name.to_owned(),
            meaning: item.text()?.to_owned(),
            location: item.location(),
        })
    };
    entries.into_iter().map(one).collect()
}

fn held_out_rows(mut section: Section<'_, '_>) -> Result<HeldOut, InputError> {
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
        _ => Err(section.error(InputErrorKind::NotOneHeldOut)),
    }
}
