//! Arguments and work of `flexcal check`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use flexcal::design::{self, CheckedPoses};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{Joint, JointKind, Problem};
use flexcal::report::{self, shell_word};
use flexcal::results::{CheckResult, Document as _};
use nalgebra::Vector3;

use super::input::Common;
use super::outcome::Outcome;
use super::poses::Source;
use super::{diagnostic, values};

/// Arguments of `flexcal check`.
#[derive(Debug, Args)]
#[command(
    after_help = "Which poses: --candidates names a table (with --poses: N of its rows, drawn at random); --poses alone draws \
within the limits of the joints or the ranges of a TRUTH.toml; without both they are those of the measurements.

Examples:
  flexcal check problems/lunar-sampler --truth problems/lunar-sampler/TRUTH.toml --poses 28
  flexcal check my-arm --candidates out/my-arm/plan.csv
  flexcal check problems/lunar-sampler --json"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Number of poses to draw
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::count::<10_000>)]
    poses: Option<u32>,
    #[command(flatten)]
    source: Source,
    /// Print every table: standard errors, other numbers of poses, sizes of effects
    #[arg(short, long, conflicts_with_all = ["quiet", "json"])]
    verbose: bool,
}

/// Error of arguments that name no poses, or contradictory ones.
#[derive(Debug, thiserror::Error)]
enum PosesError {
    #[error(
        "no poses to check; give --poses N, --candidates FILE.csv, or measurements with --data"
    )]
    None,
    #[error("--poses {poses}: the tables of --candidates have only {rows} rows")]
    TooMany { poses: usize, rows: usize },
    #[error("--data and --candidates both name poses; keep one of the two")]
    Twice,
}

/// Forecasts the results of measurements in the poses, writes `check.json` and `check.html`, and
/// prints the forecast.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let problem = common.read_problem()?;
    let results = common.results(
        "check",
        &problem,
        &arguments.source.files(),
        &["check.json", "check.html"],
    )?;
    common.hint(slides_along_gravity(&problem));
    let poses = checked_poses(arguments, &problem)?;
    let turns = match &poses {
        CheckedPoses::Table { poses, .. } => Common::orientation_line(&problem, poses),
        CheckedPoses::Drawn(..) => "",
    };
    if let CheckedPoses::Table { poses, .. } = &poses {
        let is_moved = |joint: &usize| {
            problem.joints.get(*joint).is_some_and(|of| of.command_kind() != JointKind::Fixed)
        };
        common.hint(poses.still_joints().into_iter().filter(is_moved).map(|joint| {
            format!(
                "joint {} stands still in all poses, so that they do not tell what its other \
                 coordinates would show; vary it",
                joint + 1
            )
        }));
    }
    let check = design::check(&problem, &poses, arguments.source.seed)?;
    let json = CheckResult::new(&problem, &check).to_json();
    let story = report::check(&problem, &check);
    results.write(&[("check.json", &json), ("check.html", &story.page())])?;
    common.print_result(&json, || {
        let problem_word = shell_word(common.problem());
        let is_measured = arguments.poses.is_none() && arguments.source.candidates.is_empty();
        let next = if check.suffices() && is_measured {
            format!("flexcal identify {} fits these measurements", common.problem_arguments())
        } else if check.suffices() {
            next_if_drawn(&problem, &problem_word)
        } else {
            format!("flexcal plan {problem_word} --poses N chooses poses that tell more")
        };
        let told =
            if arguments.verbose { story.text() } else { report::check_brief(&problem, &check) };
        format!("{told}{turns}{}Next: {next}\n", results.written())
    })?;
    if check.suffices() {
        return Ok(Outcome::Done);
    }
    diagnostic::warn(&report::why_not_sufficient(&check));
    Ok(Outcome::NotMet)
}

/// Returns the next step after poses that were not measured yet, or that are drawn although the
/// tables of the problem are there.
fn next_if_drawn(problem: &Problem, problem_word: &str) -> String {
    let files = &problem.data.files;
    if !files.is_empty() && files.iter().all(|file| file.exists()) {
        return format!("flexcal loop {problem_word} fits the tables that [data] names");
    }
    let log = if problem.data.joint_log.is_some() { " --joints LOG.csv" } else { "" };
    format!("measure such poses, then flexcal loop {problem_word} --data MEASURED.csv{log}")
}

/// Largest sine of the angle between two parallel directions.
const MAX_PARALLEL_SINE: f64 = 1e-3;

/// Returns a warning if the arm has masses and gravity acts along the axis of a first joint that
/// slides, as it does by default on a level rail, whose direction is the z axis of the base.
fn slides_along_gravity(problem: &Problem) -> Option<&'static str> {
    let first = problem.joints.first().filter(|joint| joint.kind == JointKind::Prismatic)?;
    let has_masses = |joint: &Joint| !joint.bodies.is_empty() || joint.beam.is_some();
    let (sin, cos) = first.alpha.sin_cos();
    let across = problem.gravity.cross(&Vector3::new(0.0, -sin, cos)).norm();
    let is_along = across < MAX_PARALLEL_SINE * problem.gravity.norm();
    (is_along && problem.joints.iter().any(has_masses)).then_some(
        "gravity acts along the axis on which joint 1 slides: right for a lift; on a level rail, \
         write gravity_m_s2 as the base frame sees it",
    )
}

/// Returns the poses to check that the arguments name, drawn from ranges or read from tables.
fn checked_poses(arguments: &Arguments, problem: &Problem) -> Result<CheckedPoses, Box<dyn Error>> {
    let Arguments { common, poses, source, .. } = arguments;
    let poses = poses.map(|poses| poses as usize);
    let table = source.table(problem, common)?;
    match (table, poses) {
        (Some(_), _) if !common.data().is_empty() => Err(PosesError::Twice.into()),
        (Some(table), poses) => {
            let rows = table.len();
            let poses = match poses {
                Some(poses) if poses > rows => {
                    return Err(PosesError::TooMany { poses, rows }.into());
                }
                Some(poses) => design::random_rows(&table, poses, source.seed),
                None => table,
            };
            Ok(CheckedPoses::Table {
                poses: Box::new(poses),
                within: source.known_ranges(problem)?,
                held_out: None,
            })
        }
        (None, Some(poses)) => {
            common.warn(&problem.plausibility_warnings());
            Ok(CheckedPoses::Drawn(source.all_ranges(problem)?, poses))
        }
        (None, None) => {
            let files: &[PathBuf] =
                if common.data().is_empty() { &problem.data.files } else { common.data() };
            if files.is_empty() {
                return Err(PosesError::None.into());
            }
            let (measured, warnings) = Measurements::read_to_predict(files, problem)?;
            common.warn(&warnings);
            let data = Dataset::from_measurements(problem, measured)?;
            let held_out = design::predictable_rows(&data);
            let Dataset { measurements: measured, split } = data;
            Ok(CheckedPoses::Table {
                poses: Box::new(measured.select(&split.identification)),
                within: source.known_ranges(problem)?,
                held_out: (!held_out.is_empty()).then(|| Box::new(measured.select(&held_out))),
            })
        }
    }
}
