//! Conversion of the text of `problem.toml` to a [`Problem`].

use std::path::Path;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use super::camera::Carriers;
use super::item::Document;
use super::section::Section;
use super::target::CarrierJoints;
use super::{
    BasePose, Effect, EffectDeclaration, Equilibrium, Placement, Problem, Statics, UrdfEnds, arm,
    constraints, data, effects, fixture, parameters, plausible, remainder, robust, target,
};
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Maximum number of elements per beam: more than eight do not improve the result, and the cost per
/// pose grows quadratically.
const MAX_BEAM_ELEMENTS: usize = 32;

impl Problem {
    /// Reads a problem; `path` is its file or the folder that contains `problem.toml`.
    ///
    /// # Errors
    /// Returns the first error in the file, or an error if the file cannot be read.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::read_with_text(path).map(|(problem, _)| problem)
    }

    /// Reads a problem like [`read`](Self::read) and returns its text as well, because a pipe can
    /// be read only once.
    ///
    /// # Errors
    /// Returns the first error in the file, or an error if the file cannot be read.
    #[doc(hidden)]
    pub fn read_with_text(path: &Path) -> Result<(Self, Arc<str>), InputError> {
        let file = if path.is_dir() { path.join("problem.toml") } else { path.to_owned() };
        let closed = file.with_file_name("problem.closed.toml");
        let remedy = if path.is_dir() && closed.is_file() {
            format!("the folder holds the results of a loop: give {}", closed.display())
        } else {
            let other = || "give a problem.toml or the folder that holds one".to_owned();
            problem_within(path).unwrap_or_else(other)
        };
        let document = Document::read(&file, InputErrorKind::ProblemMissing { remedy })?;
        Ok((problem_of(&document)?, document.text))
    }

    /// Parses a problem; `file` names the text in messages, and data files are relative to its
    /// folder.
    ///
    /// # Errors
    /// Returns the first error in the text.
    pub fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        problem_of(&Document { file: file.to_owned(), text: Arc::from(text) })
    }

    /// Returns this problem with one more effect, declared after the others; the numbers of its
    /// joints count from 1.
    #[must_use]
    pub fn with_effect(&self, effect: Effect) -> Self {
        let mut problem = self.clone();
        problem.effects.push(EffectDeclaration {
            effect,
            location: Location::file(&self.data.location.file).with_key("effect"),
        });
        problem
    }

    /// Returns this problem without fitted orientations, and so without orientation parameters of
    /// the tools.
    #[must_use]
    #[doc(hidden)]
    pub fn positions_alone(&self) -> Self {
        let mut problem = self.clone();
        problem.data.fits_orientation = false;
        problem
    }

    /// Parses an effect for this arm, written as in a problem file (`gear-ratio = { joint = 3 }`);
    /// `named` names the text in messages.
    ///
    /// # Errors
    /// Returns an error if the text is no effect, or the effect cannot act on this arm.
    pub fn effect(&self, text: &str, named: &Path) -> Result<EffectDeclaration, InputError> {
        effects::parse(text, named, self)
    }
}

/// Returns the remedy for a folder that holds no problem, but a folder with one; `None` for others.
fn problem_within(path: &Path) -> Option<String> {
    let folders = path.read_dir().ok()?.flatten().map(|entry| entry.path());
    let folder = folders.filter(|folder| folder.join("problem.toml").is_file()).min()?;
    let file = folder.join("problem.toml");
    Some(format!("there is {}: give {}", file.display(), folder.display()))
}

fn problem_of(document: &Document) -> Result<Problem, InputError> {
    if document.text.trim().is_empty() {
        let expected = "a problem.toml; flexcal init makes one of a URDF or of a data sheet";
        let kind = InputErrorKind::OtherFormat { found: "an empty file", expected };
        return Err(document.locate(0..0).error(kind));
    }
    problem(Section::new(document, String::new(), 0..0, document.table()?.get_ref()))
}

fn problem(mut root: Section<'_, '_>) -> Result<Problem, InputError> {
    let name = name(&mut root)?;
    let title = root.text("title")?.unwrap_or(&name).to_owned();
    let gravity =
        root.vector("gravity", Unit::Acceleration)?.unwrap_or(Vector3::new(0.0, 0.0, -9.80665));
    let statics = read_statics(root.section("statics")?)?;
    let mut warnings = plausible::condition_warnings(&root);
    let (joints, is_standard) = arm::read_joints(&mut root, &mut warnings)?;
    let carriers = CarrierJoints { joints: &joints, is_standard };
    let tool = target::read_tool(root.section("tool")?, &carriers)?;
    let targets = target::read_targets(&mut root, &tool, &carriers)?;
    let base = read_base(root.section("base")?)?;
    let urdf = root.section("urdf")?.map(read_urdf).transpose()?;
    let (fixtures, distances) =
        fixture::read(&mut root, Carriers { joints: &joints, tool: tool.joint })?;
    let parameters = parameters::read(&mut root)?;
    let drift = parameters::read_drift(&mut root)?;
    let constraints = constraints::read(&mut root)?;
    let data = data::read(&mut root)?;
    let effects = effects::read(&mut root, &joints, &data, &fixtures)?;
    let robust = robust::read(&mut root)?;
    let remainder = remainder::read(&mut root)?;
    root.finish()?;
    effects::check(&effects, statics, &joints, &data)?;
    effects::check_cameras(&effects, &fixtures)?;
    Ok(Problem {
        name,
        title,
        gravity,
        statics,
        joints,
        tool,
        targets,
        base,
        urdf,
        effects,
        fixtures,
        distances,
        parameters,
        drift,
        constraints,
        data,
        robust,
        warnings,
        remainder,
    })
}

/// Characters that are not allowed in folder names on some system.
pub(crate) const FORBIDDEN_IN_FOLDER_NAMES: &str = "/\\:*?\"<>|";

/// Reads the name of a problem, which must be a valid folder name.
pub(crate) fn name(root: &mut Section<'_, '_>) -> Result<String, InputError> {
    let item = root.require("name", "name = \"…\"")?;
    let name = item.text()?;
    let is_forbidden = |c: char| c.is_control() || FORBIDDEN_IN_FOLDER_NAMES.contains(c);
    let is_space_or_dot = |c: char| c.is_whitespace() || c == '.';
    if name.contains(is_forbidden)
        || name.starts_with(is_space_or_dot)
        || name.ends_with(is_space_or_dot)
        || name.len() > 200
    {
        let name = name.chars().take(200).collect();
        return Err(item.error(InputErrorKind::NotAFolderName { name }));
    }
    Ok(name.to_owned())
}

fn read_statics(section: Option<Section<'_, '_>>) -> Result<Statics, InputError> {
    let mut statics = Statics { equilibrium: Equilibrium::Deflected, beam_elements: 1 };
    let Some(mut section) = section else { return Ok(statics) };
    let meanings = [Equilibrium::Deflected, Equilibrium::Undeflected];
    if let Some(equilibrium) =
        section.word("equilibrium", &["deflected", "undeflected"], &meanings)?
    {
        statics.equilibrium = equilibrium;
    }
    if let Some(item) = section.get("beam_elements") {
        statics.beam_elements = usize::from(item.small()?);
        item.check_count("beam elements", statics.beam_elements, MAX_BEAM_ELEMENTS)?;
    }
    section.finish()?;
    Ok(statics)
}

fn read_urdf(mut section: Section<'_, '_>) -> Result<UrdfEnds, InputError> {
    let base =
        section.require("base", "base = \"…\", the link at the arm's base")?.text()?.to_owned();
    let tip = section.require("tip", "tip = \"…\", the link at its tip")?.text()?.to_owned();
    section.finish()?;
    Ok(UrdfEnds { base, tip })
}

/// Checks that a base with `xyz_m` or `rpy_deg` has no key of the other form, `translation_m` and
/// `rotation_deg`.
fn check_one_form(section: &Section<'_, '_>) -> Result<(), InputError> {
    let entries = section.entries();
    let of_base = |base: &'static str| {
        entries.iter().find(|(key, _)| {
            key.strip_prefix(base).is_some_and(|unit| unit.is_empty() || unit.starts_with('_'))
        })
    };
    for (other, same, unit) in
        [("translation", "xyz", Unit::Length), ("rotation", "rpy", Unit::Angle)]
    {
        let Some((key, item)) = of_base(other) else { continue };
        return Err(item.error(match of_base(same) {
            Some((first, _)) => InputErrorKind::GivenTwice { first: (*first).to_owned() },
            None => InputErrorKind::MisplacedKey {
                place: format!(
                    "write either translation_m and rotation_deg or xyz_m and rpy_deg; {key} \
                     beside them is {}",
                    unit.alternatives(same)
                ),
            },
        }));
    }
    Ok(())
}

fn read_base(section: Option<Section<'_, '_>>) -> Result<BasePose, InputError> {
    let mut base = BasePose { translation: Vector3::zeros(), rotation: Vector3::zeros() };
    let Some(mut section) = section else { return Ok(base) };
    if let Some(Placement { xyz, rpy }) = arm::read_placement(&mut section)? {
        base.translation = xyz;
        base.rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z).scaled_axis();
        check_one_form(&section)?;
        section.finish()?;
        return Ok(base);
    }
    base.translation = section.vector("translation", Unit::Length)?.unwrap_or_default();
    base.rotation = section.vector("rotation", Unit::Angle)?.unwrap_or_default();
    section.finish()?;
    Ok(base)
}
