//! From the text of `STUDY.toml` to a [`Study`].

use std::path::{Path, PathBuf};

use super::effects;
use super::study::{Cell, Source, Study};
use crate::error::{InputError, InputErrorKind};
use crate::identify::{SolverChoice, Strategy};
use crate::model::Model;
use crate::problem::item::{Document, Item};
use crate::problem::read::name;
use crate::problem::section::Section;
use crate::problem::{Freedom, ParameterRule, Problem};
use crate::quantity::Unit;
use crate::simulate::{HeldOutRows, RandomRule, Truth};

/// Poses held out where the file says nothing.
const HELD_OUT: usize = 50;
/// Most poses, held-out ones, repetitions.
const MOST: u64 = 1_000_000;

impl Study {
    /// Reads a study; `path` is its file, or the folder that holds a `STUDY.toml`.
    ///
    /// # Errors
    /// The first mistake found, in it or in the files that it names; a file that cannot be read among them.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let file = if path.is_dir() { path.join("STUDY.toml") } else { path.to_owned() };
        let document = Document::read(&file, InputErrorKind::StudyMissing)?;
        let table = document.table()?;
        study(Section::new(&document, String::new(), 0..0, table.get_ref()), &file)
    }
}

fn study(mut root: Section<'_, '_>, file: &Path) -> Result<Study, InputError> {
    let folder = file.parent().unwrap_or(Path::new(""));
    let name = name(&mut root)?;
    let title = root.text("title")?.unwrap_or(&name).to_owned();
    let (problem, problem_text, problem_file) =
        problem(&root.require("problem", "problem = \"…\", a problem.toml")?, folder)?;
    let model = Model::new(&problem, &[String::new()], &[String::new()])?;
    let source = source(&mut root)?;
    let seed = root.require("seed", "seed = …, a whole number")?.whole(0)?;
    let repetitions = count(&root.require("repetitions", "repetitions = …, fits per cell")?)?;
    let held_out = root.get("held_out_poses").map_or(Ok(HELD_OUT), |item| count(&item))?;
    let sigmas = sigmas(&mut root)?;
    let poses = distinct(&root.require("identification_poses", "identification_poses = [28]")?, count)?;
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
        files.push(truth_file(beside(&item, folder)?));
    }
    root.finish()?;
    effects::check(&problem, &truth, source, || {
        let place = root.peek("truth").or_else(|| root.peek("effect"));
        place.map_or_else(|| root.error(InputErrorKind::NeedsRig), |item| item.error(InputErrorKind::NeedsRig))
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

fn problem(item: &Item<'_, '_>, folder: &Path) -> Result<(Problem, String, PathBuf), InputError> {
    let mut file = beside(item, folder)?;
    if file.is_dir() {
        file.push("problem.toml");
    }
    let document = Document::read(&file, InputErrorKind::ProblemMissing)?;
    Ok((Problem::parse(&document.text, &file)?, document.text.to_string(), file))
}

/// A file that the study names.
fn beside(item: &Item<'_, '_>, folder: &Path) -> Result<PathBuf, InputError> {
    let path = folder.join(item.text()?);
    if path.exists() { Ok(path) } else { Err(item.error(InputErrorKind::StudyFileMissing { path })) }
}

/// The file that is meant by a path to it or to its folder.
fn truth_file(path: PathBuf) -> PathBuf {
    if path.is_dir() { path.join("TRUTH.toml") } else { path }
}

fn source(root: &mut Section<'_, '_>) -> Result<Source, InputError> {
    Ok(root.word("data", &["model", "rig"], &[Source::Model, Source::Rig])?.unwrap_or(Source::Model))
}

/// The file that `truth` names; or else the same sections in the study itself, over the priors of the problem.
fn truth(root: &mut Section<'_, '_>, problem: &Problem, folder: &Path) -> Result<Truth, InputError> {
    let mut truth = if let Some(item) = root.get("truth") {
        Truth::read(&beside(&item, folder)?, problem)?
    } else {
        if let Some(poses) = root.peek("poses") {
            let poses = poses.section()?;
            if let Some(item) = ["identification", "held_out"].iter().find_map(|key| poses.peek(key)) {
                return Err(item.error(InputErrorKind::PosesOfStudy));
            }
        }
        let mut truth = Truth::of_sections(root, problem)?;
        truth.random = problem.parameters.iter().map(prior).chain(truth.random).collect();
        truth
    };
    (truth.noise_sigma, truth.held_out) = (0.0, HeldOutRows::Share(0.0));
    Ok(truth)
}

/// A prior as the spread of the truth; parameters without one stay nominal.
fn prior(rule: &ParameterRule) -> RandomRule {
    let pattern = rule.pattern.clone();
    match &rule.freedom {
        Freedom::Fixed => RandomRule { pattern, angle: None, length: None, relative: None },
        Freedom::Free { sigma, .. } => {
            RandomRule { pattern, angle: sigma.angle, length: sigma.length, relative: sigma.relative }
        }
    }
}

/// Noise levels \[m\].
fn sigmas(root: &mut Section<'_, '_>) -> Result<Vec<f64>, InputError> {
    let Some((item, unit)) = root.quantity("position_sigma", Unit::Length)? else {
        return Err(root.missing("position_sigma_mm", "position_sigma_mm = [0.05], the noise levels"));
    };
    distinct(&item, |item| {
        let value = item.number()?;
        let sigma = (unit.to_si)(value);
        if sigma > 0.0 { Ok(sigma) } else { Err(item.error(InputErrorKind::NotPositive { value })) }
    })
}

fn count(item: &Item<'_, '_>) -> Result<usize, InputError> {
    let value = item.whole(1)?;
    let fits = usize::try_from(value).ok().filter(|_| value <= MOST);
    fits.ok_or_else(|| item.error(InputErrorKind::TooLarge { value, most: MOST }))
}

fn strategy(item: &Item<'_, '_>, model: &Model) -> Result<Strategy, InputError> {
    let strategy = word(item, &Strategy::NAMES, &Strategy::EACH)?;
    let varies = |choose: &fn(&_) -> bool| model.parameters.iter().any(|p| !p.slot.is_placement() && choose(p));
    if strategy == Strategy::Joint || strategy.stages().iter().any(varies) {
        Ok(strategy)
    } else {
        Err(item.error(InputErrorKind::NothingToVary { strategy: strategy.as_str() }))
    }
}

fn solver(item: &Item<'_, '_>, model: &Model) -> Result<SolverChoice, InputError> {
    let solver = word(item, &SolverChoice::NAMES, &SolverChoice::CHOICES)?.decide(model);
    if solver != SolverChoice::Bounded && model.is_bounded() {
        return Err(item.error(InputErrorKind::SolverIgnoresBounds { solver: solver.as_str() }));
    }
    Ok(solver)
}

/// One of a few words, with what each stands for.
fn word<T: Copy>(item: &Item<'_, '_>, known: &'static [&'static str], meanings: &[T]) -> Result<T, InputError> {
    let word = item.text()?;
    let meaning = known.iter().zip(meanings).find(|(known, _)| **known == word).map(|(_, meaning)| *meaning);
    meaning.ok_or_else(|| item.error(InputErrorKind::UnknownWord { word: word.to_owned(), known }))
}

/// A list of distinct values, at least one.
fn distinct<'a, 'i, T: PartialEq>(
    item: &Item<'a, 'i>,
    read: impl Fn(&Item<'a, 'i>) -> Result<T, InputError>,
) -> Result<Vec<T>, InputError> {
    let items = item.list("a list")?;
    let mut values = Vec::with_capacity(items.len());
    for item in &items {
        let value = read(item)?;
        if values.contains(&value) {
            return Err(item.error(InputErrorKind::Repeated));
        }
        values.push(value);
    }
    if values.is_empty() { Err(item.error(InputErrorKind::EmptyList)) } else { Ok(values) }
}
