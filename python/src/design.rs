//! Poses before they are measured: what they will tell, and which are best.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use flexcal::design::{
    self, Candidates, CheckedPoses, Criterion, DesignError, EffectPair, Explanations, NextOptions,
    PlanOptions, PlanProgress, Purpose, Workspace,
};
use flexcal::fit::{Options, Progress};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{PoseRanges, Problem as Declared};
use flexcal::report;
use flexcal::results::{CheckResult, Document as _, NextResult, PlanResult, poses_csv};
use flexcal::rig::Truth;
use pyo3::prelude::*;

use crate::data::{Data, Poses};
use crate::error::{of_argument, raised};
use crate::problem::Problem;
use crate::supervise::supervised;

/// What measurements in some poses will tell.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Check {
    problem: Arc<Declared>,
    check: design::Check,
}

/// Poses to measure, and what they promise.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Plan {
    problem: Arc<Declared>,
    found: design::Plan,
    separated: Option<design::PairSeparation>,
    criterion: Criterion,
    seed: u64,
}

/// Poses to measure next, and the error over the workspace now and after each of them.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Next {
    json: String,
    summary: String,
    csv: String,
}

#[pymethods]
impl Next {
    /// Returns next.json.
    fn json(&self) -> String {
        self.json.clone()
    }

    /// Returns the text that the command line prints.
    fn summary(&self) -> String {
        self.summary.clone()
    }

    /// Returns next.csv.
    fn csv(&self) -> String {
        self.csv.clone()
    }
}

#[pymethods]
impl Check {
    /// check.json.
    fn json(&self) -> String {
        CheckResult::new(&self.problem, &self.check).to_json()
    }

    /// What the command line prints.
    fn summary(&self) -> String {
        report::check(&self.problem, &self.check).text()
    }

    /// Why the poses do not suffice, if they do not.
    #[getter]
    fn why_not_sufficient(&self) -> Option<String> {
        (!self.check.suffices()).then(|| report::why_not_sufficient(&self.check))
    }
}

#[pymethods]
impl Plan {
    /// plan.json.
    fn json(&self) -> String {
        let separated = self.separated.as_ref();
        PlanResult::new(&self.problem, self.reached(), self.seed, &self.found, separated).to_json()
    }

    /// What the command line prints.
    fn summary(&self) -> String {
        report::plan(&self.problem, self.reached(), &self.found, self.separated.as_ref()).text()
    }

    /// plan.csv.
    fn csv(&self) -> String {
        poses_csv(&self.problem, &self.found.poses)
    }

    /// Whether the poses decide what poses can decide.
    #[getter]
    fn suffices(&self) -> bool {
        self.found.suffices
    }
}

impl Plan {
    /// What was made small.
    fn reached(&self) -> &Criterion {
        self.separated.as_ref().map_or(&self.criterion, |separated| &separated.criterion)
    }
}

/// Where poses may lie: within `[poses]` of a TRUTH.toml, or else the limits of the joints.
fn ranges(problem: &Declared, truth: Option<&Path>) -> Result<PoseRanges, DesignError> {
    match truth {
        Some(file) => Ok(Truth::read(file, problem)?.poses),
        None => PoseRanges::of(problem),
    }
}

/// The same, if it is known: a TRUTH.toml that is named must be right, limits may be missing.
fn known_ranges(
    problem: &Declared,
    truth: Option<&Path>,
) -> Result<Option<PoseRanges>, DesignError> {
    match ranges(problem, truth) {
        Err(DesignError::NoRange(_)) => Ok(None),
        other => other.map(Some),
    }
}

/// Poses as they are judged: `count` of a table, all of it, or as many drawn.
fn judged(
    problem: &Declared,
    table: Option<&Measurements>,
    (count, seed): (Option<usize>, u64),
    truth: Option<&Path>,
) -> Result<CheckedPoses, DesignError> {
    match (table, count) {
        (None, None) => Err(DesignError::NoPoses),
        (None, Some(count)) => Ok(CheckedPoses::Drawn(ranges(problem, truth)?, count)),
        (Some(table), Some(poses)) if poses > table.len() => {
            Err(DesignError::TooFewCandidates { poses, candidates: table.len() })
        }
        (Some(table), count) => {
            let poses = count
                .map_or_else(|| table.clone(), |count| design::random_rows(table, count, seed));
            Ok(CheckedPoses::Table {
                poses: Box::new(poses),
                within: known_ranges(problem, truth)?,
                held_out: None,
            })
        }
    }
}

/// Measured poses as they are judged: those to identify with, where predictions count in those held
/// out.
fn judged_data(
    problem: &Declared,
    rows: &Measurements,
    truth: Option<&Path>,
) -> Result<CheckedPoses, DesignError> {
    let data = Dataset::from_measurements(problem, rows.clone())?;
    let held_out = design::predictable_rows(&data);
    Ok(CheckedPoses::Table {
        poses: Box::new(rows.select(&data.split.identification)),
        within: known_ranges(problem, truth)?,
        held_out: (!held_out.is_empty()).then(|| Box::new(rows.select(&held_out))),
    })
}

/// Says what measurements in some poses will tell: `measured` ones, `count` of the `candidates`, or
/// `count` drawn.
#[pyfunction]
pub fn check(
    py: Python<'_>,
    problem: &Problem,
    measured: Option<&Poses>,
    candidates: Option<&Poses>,
    count: Option<usize>,
    truth: Option<PathBuf>,
    seed: u64,
) -> PyResult<Check> {
    let declared = Arc::clone(&problem.declared);
    let (measured, candidates) = (rows(measured), rows(candidates));
    let check = supervised(py, None, move |_| {
        let truth = truth.as_deref();
        let judged = match measured {
            Some(measured) => judged_data(&declared, &measured, truth),
            None => judged(&declared, candidates.as_deref(), (count, seed), truth),
        };
        design::check(&declared, &judged?, seed)
    })?;
    Ok(Check {
        problem: Arc::clone(&problem.declared),
        check: check.map_err(|error| raised(&error))?,
    })
}

/// Chooses the poses that identify best, or that tell two effects apart.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn plan(
    py: Python<'_>,
    problem: &Problem,
    poses: usize,
    given: Option<&Poses>,
    candidates: Option<&Poses>,
    criterion: &str,
    separate: Option<(String, String)>,
    region: Region,
    truth: Option<PathBuf>,
    seed: u64,
) -> PyResult<Plan> {
    let criterion = criterion_of(criterion)?;
    let workspace = workspace(&region)?;
    let (given, candidates) = (rows(given), rows(candidates));
    let pair = separate.map(|(one, other)| {
        let effect = |text: &str| problem.declared.effect(text, Path::new("separate"));
        EffectPair::new(&problem.declared, [effect(&one)?, effect(&other)?])
    });
    let pair = pair.transpose().map_err(|error| raised(&error))?;
    let problem = pair
        .as_ref()
        .map_or_else(|| Arc::clone(&problem.declared), |pair| Arc::new(pair.declared.clone()));
    let declared = Arc::clone(&problem);
    let chosen = criterion.clone();
    let found = supervised(py, None, move |sink| {
        let candidates = match candidates {
            Some(rows) => Candidates::Rows(Box::new(rows.as_ref().clone())),
            None => Candidates::Within(ranges(&declared, truth.as_deref())?.relevant_to(&declared)),
        };
        // A sweep is a step at which an interrupt ends the work.
        let sweep = |sweep: PlanProgress| {
            sink(Progress::Step {
                iteration: sweep.sweep as u64,
                unknowns: 0,
                poses,
                cost: sweep.value,
            });
        };
        let options = PlanOptions {
            poses,
            criterion: &chosen,
            seed,
            workspace: workspace.as_ref(),
            progress: Some(&sweep),
        };
        match &pair {
            Some(pair) => design::separate(pair, &candidates, given.as_deref(), &options)
                .map(|(plan, separated)| (plan, Some(separated))),
            None => design::plan(&declared, &candidates, given.as_deref(), &options)
                .map(|plan| (plan, None)),
        }
    })?;
    let (found, separated) = found.map_err(|error: DesignError| raised(&error))?;
    Ok(Plan { problem, found, separated, criterion, seed })
}

/// Chooses the poses to measure next, after a fit to the measured ones.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn next(
    py: Python<'_>,
    problem: &Problem,
    data: &Data,
    poses: usize,
    pool: Option<&Poses>,
    purpose: &str,
    explanations: Option<PathBuf>,
    tolerance_mm: Option<f64>,
    level: f64,
    remainder: bool,
    region: Region,
    truth: Option<PathBuf>,
    seed: u64,
) -> PyResult<Next> {
    let workspace = workspace(&region)?;
    let purpose = match purpose {
        "accuracy" => Purpose::Accuracy,
        "causes" => Purpose::Causes,
        "both" => Purpose::Both,
        word => {
            let message = format!("purpose: \"{word}\" is none of accuracy, causes, both");
            return Err(of_argument("purpose", message));
        }
    };
    if !(0.0 < level && level < 1.0) {
        let message = "level: a probability between 0 and 1 is needed".to_owned();
        return Err(of_argument("level", message));
    }
    if tolerance_mm.is_some_and(|length| !(length.is_finite() && length > 0.0)) {
        let message = "tolerance_mm: a positive length is needed".to_owned();
        return Err(of_argument("tolerance_mm", message));
    }
    let declared = Arc::clone(&problem.declared);
    let explanations = explanations.map(|file| Explanations::read(&file, &declared));
    let explanations = explanations.transpose().map_err(|error| raised(&error))?;
    let (data, pool) = (Arc::clone(&data.data), rows(pool));
    let chosen = supervised(py, None, move |sink| {
        let candidates = match (pool, known_ranges(&declared, truth.as_deref())?) {
            (Some(rows), _) => Candidates::Rows(Box::new(rows.as_ref().clone())),
            (None, Some(ranges)) => Candidates::Within(ranges.relevant_to(&declared)),
            (None, None) => {
                Candidates::Within(PoseRanges::declared_or_measured(&declared, &data.measurements))
            }
        };
        let options = NextOptions {
            poses,
            purpose,
            tolerance: tolerance_mm.map(|length| length * 1e-3),
            level,
            seed,
            workspace: workspace.as_ref(),
            explanations: explanations.as_ref(),
            remainder,
            fit: Options::default().with_progress(sink),
            update: None,
        };
        let next = design::next(&declared, &data, &candidates, &options)?;
        Ok::<_, design::NextError>(Next {
            json: NextResult::new(&declared, &options, &next).to_json(),
            summary: report::next(&declared, &options, &next).text(),
            csv: poses_csv(&declared, &next.poses),
        })
    })?;
    chosen.map_err(|error| raised(&error))
}

/// Box and planes [mm] in which the nominal target stays.
type Region = (Option<[f64; 6]>, Vec<[f64; 4]>);

fn workspace((room, planes): &Region) -> PyResult<Option<Workspace>> {
    Workspace::from_mm(*room, planes)
        .map_err(|error| of_argument("workspace_mm, keep_out_mm", error.to_string()))
}

fn rows(poses: Option<&Poses>) -> Option<Arc<Measurements>> {
    poses.map(|poses| Arc::clone(&poses.rows))
}

fn criterion_of(word: &str) -> PyResult<Criterion> {
    match word {
        "S" => Ok(Criterion::S),
        "A" => Ok(Criterion::A),
        "D" => Ok(Criterion::D),
        "E" => Ok(Criterion::E),
        "I" => Ok(Criterion::I),
        _ => {
            Err(of_argument("criterion", format!("criterion: \"{word}\" is none of S, A, D, E, I")))
        }
    }
}
