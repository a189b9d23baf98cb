//! Reader of the study file `STUDY.toml`.

use std::path::{Path, PathBuf};

use super::definition::{Cell, Source, Study};
use super::effects;
use super::input::{count, distinct, path_beside, problem_of};
use super::replica::MisprintStudy;
use crate::error::{InputError, InputErrorKind, Location, StudyErrorKind};
use crate::fit::{SolverChoice, Strategy};
use crate::model::Model;
use crate::problem::item::{Document, Item};
use crate::problem::read::name;
use crate::problem::section::Section;
use crate::problem::{Freedom, ParameterRule, Problem};
use crate::quantity::Unit;
use crate::rig::{HeldOutRows, RandomRule, Truth};

/// Number of held-out poses if the file gives none.
const DEFAULT_HELD_OUT: usize = 50;

/// Study of either kind, as read from a file.
#[derive(Debug, Clone)]
pub enum Request {
    /// Fits by several strategies and solvers; `kind = "fits"`, or no kind.
    Fits(Box<Study>),
    /// Replicas of the experiment of Chen et al. (2021); `kind = "misprints"`.
    Misprints(Box<MisprintStudy>),
}

impl Request {
    /// Reads a study of either kind; `path` is its file or the folder with a `STUDY.toml`.
    ///
    /// # Errors
    /// Returns the first error in the file or in the files that it names, including unreadable
    /// files.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let file = if path.is_dir() { path.join("STUDY.toml") } else { path.to_owned() };
        let document = Document::read(&file, StudyErrorKind::Missing.into())?;
        let table = document.table()?;
        let mut root = Section::new(&document, String::new(), 0..0, table.get_ref());
        if root.word("kind", &["fits", "misprints"], &[false, true])?.unwrap_or(false) {
            return Ok(Self::Misprints(Box::new(MisprintStudy::of_document(root, &file)?)));
        }
        Ok(Self::Fits(Box::new(study(root, &file)?)))
    }
}

impl Study {
    /// Reads a study of fits; `path` is its file or the folder with a `STUDY.toml`.
    ///
    /// # Errors
    /// Returns the first error in the file or in the files that it names, including unreadable
    /// files.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        match Request::read(path)? {
            Request::Fits(study) => Ok(*study),
            Request::Misprints(study) => {
                let file = study.files.first().map_or(path, PathBuf::as_path);
                Err(Location::file(file).error(StudyErrorKind::StudyNotDivisible))
            }
        }
    }
}

/// Reads the sections of a study of fits; `file` is its path.
fn study(mut root: Section<'_, '_>, file: &Path) -> Result<Study, InputError> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let name = name(&mut root)?;
    let title = root.text("title")?.unwrap_or(&name).to_owned();
    let (problem, problem_text, problem_file) =
        problem_of(&root.require("problem", "problem = \"…\", a problem.toml")?, folder)?;
    let model = Model::new(&problem, &[String::new()], &problem.target_words())?;
    let source = source(&mut root)?;
    let seed = root.require("seed", "seed = …, a whole number")?.whole(0)?;
    let repetitions = count(&root.require("repetitions", "repetitions = …, fits per cell")?)?;
    let held_out = root.get("held_out_poses").map_or(Ok(DEFAULT_HELD_OUT), |item| count(&item))?;
    let sigmas = sigmas(&mut root)?;
    let poses =
        distinct(&root.require("identification_poses", "identification_poses = [28]")?, count)?;
    let strategies = match root.get("strategies") {
        Some(item) => distinct(&item, |item| strategy(item, &model))?,
        None => vec![Strategy::Joint],
    };
    let solvers = match root.get("solvers") {
        Some(item) => distinct(&item, |item| solver(item, &model))?,
        None => vec![SolverChoice::Auto.decide(&model)],
    };
    let truth = truth(&mut root, &problem, folder)?;
    let draws_effects = root.peek("truth").is_none();
    let mut files = [&[file.to_owned(), problem_file], problem.data.files.as_slice()].concat();
    if let Some(item) = root.peek("truth") {
        let path = path_beside(&item, folder)?;
        files.push(if path.is_dir() { path.join("TRUTH.toml") } else { path });
    }
    root.finish()?;
    effects::check(&problem, &truth, source, || {
        let item = root.peek("truth").or_else(|| root.peek("effect"));
        item.map_or_else(
            || root.error(StudyErrorKind::NeedsRig),
            |item| item.error(StudyErrorKind::NeedsRig),
        )
    })?;
    let mut cells = Vec::new();
    for &sigma in &sigmas {
        for &poses in &poses {
            for &strategy in &strategies {
                cells.extend(solvers.iter().map(|&solver| Cell { sigma, poses, strategy, solver }));
            }
        }
    }
    let parameters = model.parameters;
    Ok(Study {
        files,
        name,
        title,
        problem,
        parameters,
        truth,
        draws_effects,
        source,
        seed,
        repetitions,
        held_out,
        cells,
        problem_text,
    })
}

/// Reads the source of the measurements; the default is the model.
fn source(root: &mut Section<'_, '_>) -> Result<Source, InputError> {
    Ok(root
        .word("data", &["model", "rig"], &[Source::Model, Source::Rig])?
        .unwrap_or(Source::Model))
}

/// Reads the truth from the file that `truth` names, or from the sections of the study itself. In
/// the latter case, parameters that the sections do not name are drawn from their priors.
fn truth(
    root: &mut Section<'_, '_>,
    problem: &Problem,
    folder: &Path,
) -> Result<Truth, InputError> {
    let mut truth = if let Some(item) = root.get("truth") {
        Truth::read(&path_beside(&item, folder)?, problem)?
    } else {
        if let Some(poses) = root.peek("poses") {
            let poses = poses.section()?;
            if let Some(item) =
                ["identification", "held_out"].iter().find_map(|key| poses.peek(key))
            {
                return Err(item.error(StudyErrorKind::PosesOfStudy));
            }
        }
        let mut truth = Truth::of_sections(root, problem)?;
        truth.random = problem.parameters.iter().map(prior).chain(truth.random).collect();
        truth
    };
    (truth.noise_sigma, truth.held_out) = (0.0, HeldOutRows::Share(0.0));
    Ok(truth)
}

/// Returns the prior of a parameter as a rule by which its true value is drawn; fixed parameters
/// keep the nominal value.
fn prior(rule: &ParameterRule) -> RandomRule {
    let pattern = rule.pattern.clone();
    match &rule.freedom {
        Freedom::Fixed => RandomRule { pattern, angle: None, length: None, relative: None },
        Freedom::Free { sigma, .. } => RandomRule {
            pattern,
            angle: sigma.angle,
            length: sigma.length,
            relative: sigma.relative,
        },
    }
}

/// Reads the noise levels, 1 σ \[m\].
fn sigmas(root: &mut Section<'_, '_>) -> Result<Vec<f64>, InputError> {
    let Some((item, unit)) = root.quantity("position_sigma", Unit::Length)? else {
        return Err(
            root.missing("position_sigma_mm", "position_sigma_mm = [0.05], the noise levels")
        );
    };
    distinct(&item, |item| {
        let value = item.number()?;
        let sigma = (unit.to_si)(value);
        if sigma > 0.0 { Ok(sigma) } else { Err(item.error(InputErrorKind::NotPositive { value })) }
    })
}

/// Reads a strategy; one that could vary no parameter of the arm is an error.
fn strategy(item: &Item<'_, '_>, model: &Model) -> Result<Strategy, InputError> {
    let strategy = word(item, &Strategy::WORDS, &Strategy::EACH)?;
    let varies = |choose: &fn(&_) -> bool| {
        model.parameters.iter().any(|p| !p.site.is_placement() && choose(p))
    };
    if strategy == Strategy::Joint || strategy.stages().iter().any(varies) {
        Ok(strategy)
    } else {
        Err(item.error(StudyErrorKind::NothingToVary { strategy: strategy.as_str() }))
    }
}

/// Reads a solver; one that ignores the model's bounds is an error.
fn solver(item: &Item<'_, '_>, model: &Model) -> Result<SolverChoice, InputError> {
    let solver = word(item, SolverChoice::NAMES, SolverChoice::CHOICES)?.decide(model);
    if !solver.keeps(model) {
        return Err(item.error(StudyErrorKind::SolverIgnoresBounds { solver: solver.as_str() }));
    }
    Ok(solver)
}

/// Reads one of the `allowed` words and returns the entry of `meanings` at the same index.
fn word<T: Copy>(
    item: &Item<'_, '_>,
    allowed: &'static [&'static str],
    meanings: &[T],
) -> Result<T, InputError> {
    let word = item.text()?;
    let meaning = allowed.iter().zip(meanings).find(|(name, _)| **name == word);
    meaning.map(|(_, meaning)| *meaning).ok_or_else(|| {
        item.error(InputErrorKind::UnknownWord { word: word.to_owned(), known: allowed })
    })
}
