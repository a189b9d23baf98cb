//! Arguments and work of `flexcal next`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::design::{
    self, Candidates, Explanations, NextOptions, NextPoses, Purpose, StopReason,
};
use flexcal::fit::Options;
use flexcal::life;
use flexcal::measurement::Measurements;
use flexcal::problem::{PoseRanges, Problem};
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, NextResult, poses_csv};

use super::estimate::Trust;
use super::input::{Common, Input};
use super::outcome::Outcome;
use super::output::Results;
use super::plan::columns_at_hand;
use super::poses::{Region, Source};
use super::progress::Line;
use super::{diagnostic, interrupt, values};

/// Arguments of `flexcal next`.
#[derive(Debug, Args)]
#[command(
    mut_arg("candidates", |arg| arg.long("pool").alias("candidates").help(
        "Tables of poses to choose from, with the columns of measurements; positions are not \
         needed. Predictions are judged there"
    )),
    after_help = "Fits the measured poses, then chooses those that lower the error of predictions in the workspace most: the limits of the \
joints (measured ranges where there are none), the ranges of a TRUTH.toml, or the rows of --pool. Writes next.json, the page next.html and, unless nothing more is needed, next.csv. Exit \
status 1: further poses gain nothing and the tolerance is not met, or do not tell the causes apart.

Examples:
  flexcal next my-arm --poses 10
  flexcal next my-arm --pool reachable.csv --tolerance-mm 0.3
  flexcal next my-arm --for causes --poses 12
  flexcal next my-arm --workspace-mm=-800,800,-800,800,100,1200 --keep-out-mm 1,0,0,250"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Number of poses to choose
    #[arg(long, value_name = "K", default_value_t = DEFAULT_POSES, allow_negative_numbers = true, value_parser = values::count::<10_000>)]
    poses: u32,
    /// Say "enough" once errors in the workspace are below this, with the probability of --level
    #[arg(long, value_name = "MM", value_parser = values::number(|mm| mm > 0.0, "a positive number is needed"))]
    tolerance_mm: Option<f64>,
    /// Aim of the poses
    #[arg(long = "for", default_value = PURPOSES[0].0, value_parser = values::one_of(PURPOSES))]
    purpose: Purpose,
    /// The loop.json with the explanations to tell apart [default: the one in the folder of
    /// results]
    #[arg(long, value_name = "LOOP.json")]
    explanations: Option<PathBuf>,
    /// Probability with which errors stay below the bound
    #[arg(long, value_name = "P", default_value_t = DEFAULT_LEVEL, value_parser = values::level)]
    level: f64,
    /// Judge predictions with a remainder fitted to the measured poses, as identify --remainder
    /// makes them
    #[arg(long)]
    remainder: bool,
    /// Prior of the measured poses: the estimate.json that they update, or the PRIOR.toml of arms of
    /// the same type, as for identify
    #[arg(long, value_name = "ESTIMATE.json|PRIOR.toml", conflicts_with = "remainder")]
    prior: Option<PathBuf>,
    /// Days since the earlier identification, by whose drift the prior is widened
    #[arg(long, value_name = "DAYS", default_value_t = 0.0, requires = "prior", value_parser = values::days)]
    drift: f64,
    #[command(flatten)]
    trust: Trust,
    #[command(flatten)]
    region: Region,
    #[command(flatten)]
    source: Source,
}

impl Arguments {
    /// Formats the arguments that are not those of the problem and its data, as far as they differ
    /// from their defaults; each follows a space.
    fn flags(&self) -> String {
        let mut words: Vec<String> = Vec::new();
        if self.poses != DEFAULT_POSES {
            words.push(format!("--poses {}", self.poses));
        }
        words.extend(self.tolerance_mm.map(|most| format!("--tolerance-mm {most}")));
        let aim = PURPOSES.iter().skip(1).find(|(.., purpose)| *purpose == self.purpose);
        words.extend(aim.map(|(name, ..)| format!("--for {name}")));
        let path = |flag: &str, file: &PathBuf| format!("{flag} {}", shell_word(file));
        words.extend(self.explanations.iter().map(|file| path("--explanations", file)));
        if (self.level - DEFAULT_LEVEL).abs() > 0.0 {
            words.push(format!("--level {}", self.level));
        }
        words.extend(self.remainder.then(|| "--remainder".to_owned()));
        words.extend(self.prior_words());
        words.extend(self.region.words());
        words.extend(self.source.candidates.iter().map(|file| path("--pool", file)));
        words.extend(self.source.truth.iter().map(|file| path("--truth", file)));
        if words.is_empty() { String::new() } else { format!(" {}", words.join(" ")) }
    }

    /// Formats the arguments of the prior.
    fn prior_words(&self) -> Vec<String> {
        let prior = self.prior.iter().map(|file| format!("--prior {}", shell_word(file)));
        let drift = (self.drift > 0.0).then(|| format!("--drift {}", self.drift));
        prior.chain(drift).collect()
    }
}

/// Number of poses without `--poses`.
const DEFAULT_POSES: u32 = 5;
/// Probability without `--level`.
const DEFAULT_LEVEL: f64 = 0.95;

/// Aims of the next poses, each with its name and a summary.
const PURPOSES: [(&str, &str, Purpose); 3] = [
    ("accuracy", "Small errors of predictions in the workspace", Purpose::Accuracy),
    ("causes", "To tell apart the effects among which the loop did not decide", Purpose::Causes),
    ("both", "Both, with equal weight", Purpose::Both),
];

/// Difference up to which two commands are those of one pose \[rad\] or \[m\].
const SAME_COMMAND: f64 = 1e-4;

/// Returns a warning if chosen poses of a pool are poses of the measurements: equal in joints and
/// payload.
fn measured_already(measured: &Measurements, chosen: &Measurements) -> Option<String> {
    let load = |rows: &Measurements, row: usize| {
        rows.payload.as_ref().and_then(|payload| payload.get(row).copied())
    };
    let is_same = |row: usize, other: usize| {
        let (q, p) = (chosen.configuration(row), measured.configuration(other));
        let is_near = |(a, b): (&f64, &f64)| (a - b).abs() < SAME_COMMAND;
        q.iter().zip(p).all(is_near) && load(chosen, row) == load(measured, other)
    };
    let repeated: Vec<usize> = (0..chosen.len())
        .filter_map(|row| (0..measured.len()).find(|&other| is_same(row, other)))
        .collect();
    let first = measured.location(*repeated.first()?);
    Some(format!(
        "{} of the {} chosen poses of the pool are measured already, such as {first}; take rows that \
         are measured out of the pool, unless they are to be measured again",
        repeated.len(),
        chosen.len()
    ))
}

/// Returns a warning if some of the rows that the loop of `file` fitted, but not all, are not among
/// the measurements.
fn other_rows(file: &Path, (missing, of): (usize, usize)) -> Option<String> {
    (missing > 0 && missing < of).then(|| {
        format!(
            "{}: {missing} of the {of} rows that this loop fitted are not among these measurements, \
             so its probabilities are of other data; run flexcal loop on these",
            file.display()
        )
    })
}

/// Chooses the next poses, writes `next.csv`, `next.json` and `next.html`, and prints the error
/// that is expected after them.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let (common, source) = (&arguments.common, &arguments.source);
    let others = [source.files(), arguments.prior.iter().cloned().collect()].concat();
    let Input { problem, data, results } =
        common.read_beside("next", &others, &["next.json", "next.html", "next.csv"])?;
    let candidates = match source.table(&problem, common)? {
        Some(rows) => Candidates::Rows(Box::new(rows)),
        None if source.truth.is_some() => Candidates::Within(source.ranges(&problem)?),
        None => Candidates::Within(PoseRanges::declared_or_measured(&problem, &data.measurements)),
    };
    let prior =
        arguments.prior.as_deref().map(|file| arguments.trust.read_prior(file)).transpose()?;
    let explanations = if arguments.purpose == Purpose::Accuracy {
        None
    } else {
        let file = arguments.explanations.clone().unwrap_or_else(|| results.path("loop.json"));
        let explanations = Explanations::read(&file, &problem)?;
        common.hint(other_rows(&file, explanations.missing_rows(&data.measurements)));
        Some(explanations)
    };
    let workspace = arguments.region.workspace()?;
    common.warn_if_tiny(arguments.tolerance_mm);
    let stop = interrupt::stop();
    let fit = Options::default().with_stop(stop.clone());
    let update = prior
        .map(|prior| life::update(&problem, &data, &fit, &prior, arguments.drift))
        .transpose()?;
    let (next, options) = Line::during(common.prints_text(), stop.clone(), |sink| {
        let options = NextOptions {
            poses: arguments.poses as usize,
            purpose: arguments.purpose,
            tolerance: arguments.tolerance_mm.map(|length| length * 1e-3),
            level: arguments.level,
            seed: source.seed,
            workspace: workspace.as_ref(),
            explanations: explanations.as_ref(),
            remainder: arguments.remainder,
            fit: fit.with_progress(sink),
            update: update.as_ref().map(|of| (&of.found, of.predictions.as_ref())),
        };
        design::next(&problem, &data, &candidates, &options).map(|next| (next, options))
    })?;
    if !source.candidates.is_empty() {
        common.hint(measured_already(&data.measurements, &next.poses));
    }
    let json = NextResult::new(&problem, &options, &next).to_json();
    let table = poses_csv(&problem, &next.poses);
    interrupt::begin_writing();
    let story = report::next(&problem, &options, &next);
    let page = story.page();
    let mut texts = vec![("next.json", json.as_str()), ("next.html", page.as_str())];
    if !next.poses.is_empty() {
        texts.push(("next.csv", table.as_str()));
    }
    results.write(&texts)?;
    common.print_result(&json, || {
        let step = next_step(arguments, &problem, (&next, &options), &results);
        format!("{}{}Next: {step}\n", story.text(), results.written())
    })?;
    let is_trusted = next.found.is_trusted();
    if !is_trusted {
        diagnostic::warn(
            "the fit to the measured poses is not to be trusted: flexcal identify says why",
        );
    }
    let is_met = next.error.zip(options.tolerance).is_none_or(|(error, most)| error.bound <= most);
    let is_exhausted = match next.stop {
        Some(StopReason::GainBelowNoise) => !is_met,
        stop => stop == Some(StopReason::CausesAlike),
    };
    Ok(Outcome::from_trust(is_trusted && !is_exhausted))
}

/// States what to do after the choice of poses, with the commands.
fn next_step(
    asked: &Arguments,
    problem: &Problem,
    (next, &NextOptions { tolerance, level, .. }): (&NextPoses, &NextOptions),
    results: &Results,
) -> String {
    let common = &asked.common;
    let arguments = common.problem_arguments();
    let prior = asked.prior_words().iter().fold(String::new(), |all, word| all + " " + word);
    if !next.found.is_trusted() {
        return format!(
            "flexcal identify {arguments}{prior} says why the fit is not to be trusted"
        );
    }
    let flags = asked.flags();
    if next.stop == Some(StopReason::CausesAlike) {
        return "name other ranges of the joints or payloads with --truth or --pool, then this \
                command again"
            .to_owned();
    }
    // More poses cannot correct a model that lacks an effect.
    let noise_exceeds = next.noise_exceeds(tolerance, level);
    // The new rows of an update are too few for a search.
    let mut lacks = if asked.prior.is_some() || asked.purpose == Purpose::Causes {
        String::new()
    } else if next.has_large_misfit() && !noise_exceeds {
        let closed = results.path("problem.closed.toml");
        if Problem::read(&closed).is_ok_and(|closed| closed.name == problem.name) {
            return format!(
                "flexcal next {}{flags}{} chooses poses for the problem with the effects that \
                 flexcal loop found",
                shell_word(&closed),
                common.data_arguments()
            );
        }
        format!(
            "flexcal loop {arguments} looks for what the model lacks, because the misfit exceeds \
             the noise; or "
        )
    } else {
        String::new()
    };
    if next.is_out_of_reach(tolerance) && !next.poses.is_empty() {
        let instrument = if lacks.is_empty() { " or a better instrument" } else { "" };
        let _ = write!(
            lacks,
            "choose another --tolerance-mm{instrument}; to lower the error all the same, "
        );
    }
    if next.poses.is_empty() {
        return format!("{lacks}flexcal identify {arguments}{prior} writes the estimate to apply");
    }
    let file = shell_word(common.problem());
    if problem.data.joint_log.is_some() {
        return format!(
            "{lacks}measure these poses, append them to the measurements and, unless these hold the \
             joints, to the joint table of {file}, then flexcal next {file}{flags}{}",
            common.data_arguments()
        );
    }
    let files = common.files(problem);
    let these = match next.enough_after(tolerance) {
        Some(enough) if enough < next.poses.len() => format!(
            "{} (the others are a reserve)",
            if enough == 1 {
                "the first pose".to_owned()
            } else {
                format!("the first {enough} poses")
            }
        ),
        _ => "these poses".to_owned(),
    };
    let measure = match files {
        _ if next.is_of_cameras => {
            "take an image in each of these poses, write a row for each point that is found, then"
                .to_owned()
        }
        [_, ..] => {
            let at_hand: Vec<&PathBuf> = files.iter().collect();
            let others = columns_at_hand(&at_hand, (problem, &next.poses), false);
            let others = others.iter().fold(String::new(), |all, name| all + ", " + name);
            format!("measure {these}, add the columns x_mm, y_mm, z_mm{others}, then")
        }
        [] => format!("measure {these}, add the columns x_mm, y_mm, z_mm, then"),
    };
    let measured: Vec<String> = files.iter().map(|file| shell_word(file)).collect();
    let command = if asked.purpose == Purpose::Causes {
        format!("loop {file}")
    } else {
        format!("next {file}{flags}")
    };
    format!(
        "{lacks}{measure} flexcal {command} --data {} {}",
        measured.join(" "),
        shell_word(&results.path("next.csv")),
    )
}
