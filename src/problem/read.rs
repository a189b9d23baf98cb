//! From the text of `problem.toml` to a [`Problem`].

use std::path::Path;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use super::item::Document;
use super::section::Section;
use super::target::InfluentialRows;
use super::{
    BasePose, Effect, EffectDeclaration, Equilibrium, Placement, Problem, Statics, UrdfEnds, arm,
    constraints, data, effects, fixture, parameters, robust, target,
};
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;

/// Most elements of a beam: eight are as good as any number, and the time of a pose grows with
/// their square.
const MOST_ELEMENTS: usize = 32;

impl Problem {
    /// Reads a problem; `path` is its file, or the folder that holds a `problem.toml`.
    ///
    /// # Errors
    /// The first mistake found, a file that cannot be read among them.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::read_with_text(path).map(|(problem, _)| problem)
    }

    /// As [`read`](Self::read), with the text: a pipe can be read only once.
    ///
    /// # Errors
    /// The first mistake found, a file that cannot be read among them.
    pub fn read_with_text(path: &Path) -> Result<(Self, Arc<str>), InputError> {
        let file = if path.is_dir() { path.join("problem.toml") } else { path.to_owned() };
        let document = Document::read(&file, InputErrorKind::ProblemMissing)?;
        Ok((problem_of(&document)?, document.text))
    }

    /// Reads a problem from its text; `file` names it in messages, and data files are looked for
    /// beside it.
    ///
    /// # Errors
    /// The first mistake found.
    pub fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        problem_of(&Document { file: file.to_owned(), text: Arc::from(text) })
    }

    /// The same problem with one more effect declared, behind the others; joints are numbered from
    /// 1.
    #[must_use]
    pub fn with_effect(&self, effect: Effect) -> Self {
        let mut problem = self.clone();
        problem.effects.push(EffectDeclaration {
            effect,
            location: Location::file(&self.data.location.file).with_key("effect"),
        });
        problem
    }

    /// The same problem with orientations left out of fits, and the tools' own with them.
    #[must_use]
    pub fn positions_alone(&self) -> Self {
        let mut problem = self.clone();
        problem.data.fits_orientation = false;
        problem
    }

    /// Reads an effect that this arm may have, written as in a problem file (`gear-ratio = { joint
    /// = 3 }`); `named` is what messages call the text.
    ///
    /// # Errors
    /// It is no effect, or one that could never act on this arm.
    pub fn effect(&self, text: &str, named: &Path) -> Result<EffectDeclaration, InputError> {
        effects::parse(text, named, self)
    }
}

fn problem_of(document: &Document) -> Result<Problem, InputError> {
    problem(Section::new(document, String::new(), 0..0, document.table()?.get_ref()))
}

fn problem(mut root: Section<'_, '_>) -> Result<Problem, InputError> {
    let name = name(&mut root)?;
    let title = root.text("title")?.unwrap_or(&name).to_owned();
    let gravity =
        root.vector("gravity", Unit::Acceleration)?.unwrap_or(Vector3::new(0.0, 0.0, -9.80665));
    let statics = statics(root.section("statics")?)?;
    let (joints, is_standard) = arm::joints(&mut root)?;
    let influential_rows = InfluentialRows { joints: &joints, is_standard };
    let tool = target::tool(root.section("tool")?, &influential_rows)?;
    let targets = target::targets(&mut root, &tool, &influential_rows)?;
    let base = base(root.section("base")?)?;
    let urdf = root.section("urdf")?.map(urdf).transpose()?;
    let effects = effects::read(&mut root, &joints)?;
    let (fixtures, distances) = fixture::read(&mut root)?;
    let parameters = parameters::read(&mut root)?;
    let constraints = constraints::read(&mut root)?;
    let data = data::read(&mut root)?;
    let robust = robust::read(&mut root)?;
    root.finish()?;
    effects::check(&effects, statics, &joints, &data)?;
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
        constraints,
        data,
        robust,
    })
}

/// Characters that no name of a folder holds everywhere.
pub(crate) const BARRED_IN_NAMES: &str = "/\\:*?\"<>|";

/// A name that is fit to name a folder.
pub(crate) fn name(root: &mut Section<'_, '_>) -> Result<String, InputError> {
    let item = root.require("name", "name = \"…\"")?;
    let name = item.text()?;
    let barred = |c: char| c.is_control() || BARRED_IN_NAMES.contains(c);
    let edges = |c: char| c.is_whitespace() || c == '.';
    if name.contains(barred) || name.starts_with(edges) || name.ends_with(edges) || name.len() > 200
    {
        let name = name.chars().take(200).collect();
        return Err(item.error(InputErrorKind::NotAFolderName { name }));
    }
    Ok(name.to_owned())
}

fn statics(section: Option<Section<'_, '_>>) -> Result<Statics, InputError> {
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
        item.check_count("beam elements", statics.beam_elements, MOST_ELEMENTS)?;
    }
    section.finish()?;
    Ok(statics)
}

fn urdf(mut section: Section<'_, '_>) -> Result<UrdfEnds, InputError> {
    let base =
        section.require("base", "base = \"…\", the link at the arm's base")?.text()?.to_owned();
    let tip = section.require("tip", "tip = \"…\", the link at its tip")?.text()?.to_owned();
    section.finish()?;
    Ok(UrdfEnds { base, tip })
}

fn base(section: Option<Section<'_, '_>>) -> Result<BasePose, InputError> {
    let mut base = BasePose { translation: Vector3::zeros(), rotation: Vector3::zeros() };
    let Some(mut section) = section else { return Ok(base) };
    if let Some(Placement { xyz, rpy }) = arm::placement(&mut section)? {
        base.translation = xyz;
        base.rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z).scaled_axis();
        section.finish()?;
        return Ok(base);
    }
    base.translation = section.vector("translation", Unit::Length)?.unwrap_or_default();
    base.rotation = section.vector("rotation", Unit::Angle)?.unwrap_or_default();
    section.finish()?;
    Ok(base)
}
