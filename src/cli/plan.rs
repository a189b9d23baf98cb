//! Arguments and work of `flexcal plan`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::design::{
    self, Candidates, Criterion, DesignError, EffectPair, Plan, PlanOptions, PlanProgress,
};
use flexcal::measurement::Measurements;
use flexcal::problem::{HeldOut, Problem};
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, PlanResult, poses_csv};

use super::input::Common;
use super::outcome::Outcome;
use super::poses::{Region, Source};
use super::progress::Line;
use super::{diagnostic, values};

/// Arguments of `flexcal plan`.
#[derive(Debug, Args)]
#[command(
    mut_arg("data", |arg| arg.help("Measurements that are there already: the plan completes them")),
    after_help = "Poses are sought within the limits of the joints, in the ranges of [poses] of a TRUTH.toml, or among the rows of \
a table. The plan is plan.csv (page: plan.html): measure it, add the columns x_mm, y_mm, z_mm, and identify.

Examples:
  flexcal plan problems/lunar-sampler --truth problems/lunar-sampler/TRUTH.toml --poses 28
  flexcal plan my-arm --poses 40 --candidates reachable.csv --criterion D
  flexcal plan my-arm --poses 10 --data first.csv --seed 7
  flexcal plan my-arm --poses 30 --workspace-mm=-800,800,-800,800,100,1200 --keep-out-mm 1,0,0,250
  flexcal plan my-arm --poses 12 --separate 'gear-ratio = { joint = 3 }' \\
    'joint-harmonic = { joint = 3, orders = [1] }'"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Number of poses to measure
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = values::count::<10_000>)]
    poses: u32,
    /// Quantity to minimise
    #[arg(long, ignore_case = true, default_value = CRITERIA[0].0, value_parser = values::one_of(CRITERIA))]
    criterion: Criterion,
    /// Choose poses that separate two effects, each as trace and loop print it and as a problem
    /// declares it
    #[arg(long, value_name = "EFFECT", num_args = 2, conflicts_with = "criterion")]
    separate: Vec<String>,
    #[command(flatten)]
    region: Region,
    #[command(flatten)]
    source: Source,
}

/// Criteria of a plan, each with its letter and a summary.
const CRITERIA: [(&str, &str, Criterion); 5] = [
    ("S", "The geometric mean of the standard errors", Criterion::S),
    (
        "A",
        "The mean variance, each parameter's in units of what average poses leave of it",
        Criterion::A,
    ),
    ("D", "The volume of the confidence ellipsoid", Criterion::D),
    (
        "E",
        "The largest variance of any combination, in units of what average poses leave of it",
        Criterion::E,
    ),
    (
        "I",
        "The mean variance of predicted positions in the ranges, with a misfit as large as the \
         noise",
        Criterion::I,
    ),
];

/// Chooses the poses of the plan, writes `plan.csv`, `plan.json` and `plan.html`, and prints the
/// accuracy that the plan is expected to give.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let (common, source) = (&arguments.common, &arguments.source);
    let declared = common.read_problem()?;
    if declared.data.fits_orientation && !arguments.separate.is_empty() {
        common.hint(["effects are told apart by positions: orientations do not count"]);
    }
    let pair = effect_pair(&arguments.separate, &declared)?;
    let declared_files = declared.data.files.clone();
    let problem = pair.as_ref().map_or(declared, |pair| pair.declared.clone());
    let results = common.results(
        "plan",
        &problem,
        &source.files(),
        &["plan.csv", "plan.json", "plan.html"],
    )?;
    let candidates = match source.table(&problem, common)? {
        Some(rows) => Candidates::Rows(Box::new(rows)),
        None => Candidates::Within(source.ranges(&problem)?),
    };
    let given = if common.data().is_empty() {
        None
    } else {
        let (given, warnings) = Measurements::read_to_predict(common.data(), &problem)?;
        common.warn(&warnings);
        Some(given)
    };
    if given.is_none() {
        common.warn(&problem.plausibility_warnings());
    }
    let line = common.prints_text().then(Line::new);
    let show = |PlanProgress { start, sweep, value }: PlanProgress| {
        if let Some(line) = &line {
            let what =
                start.map_or_else(|| "refining".to_owned(), |start| format!("start {start}"));
            line.say(|| format!("{what}, sweep {sweep}: ln of the criterion {value:.4}"));
        }
    };
    let workspace = arguments.region.workspace()?;
    let options = PlanOptions {
        workspace: workspace.as_ref(),
        poses: arguments.poses as usize,
        criterion: &arguments.criterion,
        seed: source.seed,
        progress: Some(&show),
    };
    let result = match &pair {
        Some(pair) => design::separate(pair, &candidates, given.as_ref(), &options)
            .map(|(plan, separated)| (plan, Some(separated))),
        None => {
            design::plan(&problem, &candidates, given.as_ref(), &options).map(|plan| (plan, None))
        }
    };
    if let Some(line) = &line {
        line.clear();
    }
    let (plan, separated) = match result {
        Err(alike @ DesignError::CausesAlike { .. }) => {
            diagnostic::print(&alike);
            return Ok(Outcome::NotMet);
        }
        result => result?,
    };
    let criterion =
        separated.as_ref().map_or(&arguments.criterion, |separated| &separated.criterion);
    let json =
        PlanResult::new(&problem, criterion, source.seed, &plan, separated.as_ref()).to_json();
    let table = poses_csv(&problem, &plan.poses);
    let story = report::plan(&problem, criterion, &plan, separated.as_ref());
    results.write(&[("plan.csv", &table), ("plan.json", &json), ("plan.html", &story.page())])?;
    common.print_result(&json, || {
        let table = results.path("plan.csv");
        let next = next_step(common, &problem, &declared_files, &table, &plan, pair.is_some());
        format!("{}{}Next: {next}\n", story.text(), results.written())
    })?;
    if plan.suffices {
        return Ok(Outcome::Done);
    }
    diagnostic::warn("the plan does not determine all parameters without a prior: plan more poses");
    Ok(Outcome::NotMet)
}

/// Returns the columns that the measurements in `files` have and a table of planned poses lacks. All
/// tables that are read together have the same columns. Empty if the files cannot be read.
pub(super) fn columns_at_hand(
    files: &[&PathBuf],
    (problem, poses): (&Problem, &Measurements),
    is_of_cameras: bool,
) -> Vec<&'static str> {
    let files: Vec<PathBuf> = files.iter().map(|&file| file.clone()).collect();
    let Ok((given, _)) = Measurements::read_to_predict(&files, problem) else { return Vec::new() };
    let has_sessions = |of: &Measurements| of.session.names.iter().any(|name| !name.is_empty());
    let columns = [
        (
            if given.has_dates() { "time" } else { "time_s" },
            given.time_measured,
            poses.time_measured,
        ),
        ("those of the orientation", given.orientations.is_some(), poses.orientations.is_some()),
        ("payload_kg", given.payload.is_some(), poses.payload.is_some()),
        ("hoist_N", given.hoist.is_some(), poses.hoist.is_some()),
        ("temperature_C", given.temperature.is_some(), poses.temperature.is_some()),
        // Of a pixel, σ is that of the camera.
        ("sigma_mm", given.sigma.is_some(), is_of_cameras || poses.sigma.is_some()),
        ("session", has_sessions(&given), has_sessions(poses)),
        ("approach1 …", given.approach.is_some(), poses.approach.is_some()),
        ("target", given.target.is_some(), poses.target.is_some()),
    ];
    let lacks = |(name, at_hand, planned): (&'static str, bool, bool)| {
        (at_hand && !planned).then_some(name)
    };
    columns.into_iter().filter_map(lacks).collect()
}

/// States how to measure the plan in the file `table`, and the command that reads it afterwards.
/// `separates` is true if the plan is to distinguish two effects.
fn next_step(
    common: &Common,
    problem: &Problem,
    declared_files: &[PathBuf],
    table: &Path,
    plan: &Plan,
    separates: bool,
) -> String {
    let given = common.data();
    // Every planned row is for identification, so held-out rows that a column or a session names
    // are those of the declared files.
    let (needs_held_out, mark) = match &problem.data.held_out {
        Some(HeldOut::Column(column)) => (true, format!("validation in the column {column}")),
        Some(HeldOut::Session(session)) => (true, format!("{session} in the column session")),
        Some(HeldOut::Fraction { .. } | HeldOut::Nothing) | None => (false, String::new()),
    };
    // Two effects are told apart by the measurements at hand and the planned ones together.
    let named = match given {
        [] if separates || needs_held_out => declared_files,
        given => given,
    };
    let at_hand: Vec<&PathBuf> = named.iter().filter(|file| file.is_file()).collect();
    let measure = if plan.is_of_cameras {
        "take an image in each of these poses, write a row for each point that is found"
    } else {
        "measure these poses, add the columns x_mm, y_mm, z_mm"
    };
    let others = if at_hand.is_empty() {
        Vec::new()
    } else {
        columns_at_hand(&at_hand, (problem, &plan.poses), plan.is_of_cameras)
    };
    let beside = if !others.is_empty() {
        let verb = if plan.is_of_cameras { ", add" } else { " and" };
        format!("{verb} {}, which the measurements at hand have", others.join(", "))
    } else if at_hand.is_empty() && needs_held_out {
        format!(", write {mark} for some of them")
    } else {
        String::new()
    };
    let files: Vec<String> =
        at_hand.into_iter().map(PathBuf::as_path).chain([table]).map(shell_word).collect();
    let command = if separates { "loop" } else { "identify" };
    format!(
        "{measure}{beside}, then flexcal {command} {} --data {}",
        shell_word(common.problem()),
        files.join(" ")
    )
}

/// Parses the two effects that the plan is to distinguish; `None` if `named` is empty.
pub(super) fn effect_pair(
    named: &[String],
    problem: &Problem,
) -> Result<Option<EffectPair>, Box<dyn Error>> {
    let [one, other] = named else { return Ok(None) };
    let read = |text: &String| problem.effect(text, Path::new("--separate"));
    Ok(Some(EffectPair::new(problem, [read(one)?, read(other)?])?))
}
