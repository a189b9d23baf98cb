//! Arguments and work of `flexcal watch`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::fit::SavedEstimate;
use flexcal::life::{self, CauseKind};
use flexcal::measurement::Measurements;
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, WatchResult};

use super::estimate::{Trust, older_sides};
use super::input::Common;
use super::outcome::Outcome;
use super::{advice, diagnostic, values};

/// Arguments of `flexcal watch`.
#[derive(Debug, Args)]
#[command(after_help = "Exit status: 0 unchanged, 3 changed, also if the table may be misread.

Examples:
  flexcal watch problems/lunar-sampler --estimate out/lunar-sampler/estimate.json \\
    --data tomorrow.csv")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The estimate.json of an identification of the same arm
    #[arg(long, value_name = "ESTIMATE.json")]
    estimate: PathBuf,
    /// Days since the estimate, whose drift counts as no change
    #[arg(long, value_name = "DAYS", default_value_t = 0.0, value_parser = values::days)]
    drift: f64,
    /// Probability of an alarm at any row if nothing has changed
    #[arg(long, value_name = "P", default_value_t = 0.01, value_parser = values::number(|p| p > 0.0 && p <= 0.5, "a probability above 0 and up to 0.5 is expected"))]
    false_alarms: f64,
    #[command(flatten)]
    trust: Trust,
}

/// Returns the argument with the days since the estimate; empty for none.
fn drift_argument(days: f64) -> String {
    if days > 0.0 { format!(" --drift {days}") } else { String::new() }
}

/// Returns a warning that the rows were measured days after the rows of the estimate, if both have
/// dates; `None` if less than a day lies between them.
fn age(estimate: &SavedEstimate, rows: &Measurements) -> Option<String> {
    let days = estimate.start_times.as_ref()?.days_until(rows)?.round();
    (days >= 1.0).then(|| {
        format!(
            "these rows were measured {days} days after those of the estimate; --drift {days} allows for what changes in that time without \
             a cause"
        )
    })
}

/// Returns the name of a folder beside that of an estimate which does not exist yet, as a word of a
/// suggested command: `out/arm-update` beside `out/arm`, then `out/arm-update-2`.
fn unused_folder(estimate: &Path, what: &str) -> String {
    let folder = estimate.parent().filter(|folder| folder.file_name().is_some());
    let folder = folder.map_or_else(|| "out".to_owned(), |folder| folder.display().to_string());
    let (suffix, is_number) = (format!("-{what}"), |text: &str| text.parse::<u32>().is_ok());
    let stem = folder
        .rsplit_once(&suffix)
        .filter(|(_, end)| end.is_empty() || end.strip_prefix('-').is_some_and(is_number));
    let stem = stem.map_or(folder.as_str(), |(stem, _)| stem);
    let first = format!("{stem}{suffix}");
    let mut names = (2..).map(|number| format!("{first}-{number}"));
    let is_unused = |name: &String| !Path::new(name).exists();
    let name = if is_unused(&first) { Some(first) } else { names.find(is_unused) };
    shell_word(Path::new(&name.unwrap_or_default()))
}

/// Tests whether the rows contradict the estimate, writes `watch.json` and `watch.html`, and prints
/// the verdict.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let mut problem = common.read_problem()?;
    // Every row is judged, so none is held out, and the table needs no column that marks such rows.
    let held_out = problem.data.held_out.take();
    let estimate_file = std::slice::from_ref(&arguments.estimate);
    let results =
        common.results("watch", &problem, estimate_file, &["watch.json", "watch.html"])?;
    let (rows, mut warnings) = common.read_rows(&problem, Measurements::read_to_judge)?;
    warnings.extend(rows.row_warnings(&problem));
    common.warn(&warnings);
    let estimate = arguments.trust.read(&arguments.estimate)?;
    if !estimate.trusted {
        diagnostic::warn("the estimate is not to be trusted, so the verdict is not either");
    }
    common.hint(older_sides(&estimate, &problem, &rows));
    common.warn_of_loads(&problem, &estimate, &rows);
    let is_without_data = common.data().is_empty();
    common.hint(is_without_data.then_some(
        "rows of the problem's tables that the estimate did not fit are judged; if they were measured \
         before it, no change since can be seen: give new ones with --data FILE",
    ));
    let unknown: Vec<String> =
        estimate.unknown_sessions(&rows).into_iter().map(str::to_owned).collect();
    common.hint(unknown.iter().map(|session| {
        let (what, tool) = match rows.target {
            Some(_) => ("base is", ""),
            None => ("base and tool are", "; a column target holds the tool"),
        };
        format!(
            "the estimate does not know session {session}: its {what} fitted to these rows, so that a move of them cannot be seen; if \
             all stands where it stood, give the rows the session of the estimate{tool}"
        )
    }));
    if arguments.drift == 0.0 {
        common.hint(age(&estimate, &rows));
    }
    let settings = (arguments.drift, arguments.false_alarms);
    let rows = rows.arm_rows();
    let watch = life::watch(&problem, &estimate, &rows, settings)?;
    common.hint(report::sides_not_stated(&watch.sides, "; the test allows for both"));
    let named = arguments.estimate.display().to_string();
    let json = WatchResult::new(&problem, &named, arguments.drift, &watch).to_json();
    let story = report::watch(&problem, (&watch, estimate.trusted), &rows);
    results.write(&[("watch.json", &json), ("watch.html", &story.page())])?;
    common.print_result(&json, || {
        let file = shell_word(&arguments.estimate);
        let first = watch.causes.first().map(|cause| cause.kind);
        let poses = rows.arm_pose_numbers(&problem);
        let held_out = advice::held_out_argument(held_out.as_ref(), &poses);
        let update = || {
            format!(
                "flexcal identify {} --prior {file}{}{held_out} --out {}",
                common.problem_arguments(),
                drift_argument(arguments.drift),
                unused_folder(&arguments.estimate, "update")
            )
        };
        let next = if watch.is_changed() && first == Some(CauseKind::Other) {
            format!(
                "flexcal identify {} --out {}: if that fit is trusted, the arm has changed or is \
                 another one; if not, check units, signs, columns and \
                 the order of joints",
                common.problem_arguments(),
                unused_folder(&arguments.estimate, "check")
            )
        } else if watch.is_changed() && first == Some(CauseKind::Misread) {
            format!(
                "correct the table, then flexcal watch {} --estimate {file}",
                common.problem_arguments()
            )
        } else if watch.is_changed() && first == Some(CauseKind::Noise) {
            "measure a few of these poses again. If watch.html shows the evidence rise from some \
             row on, give the rows from there on alone"
                .to_owned()
        } else if watch.is_changed() && first == Some(CauseKind::Row) {
            format!("check that row, then flexcal watch {} --estimate {file} without it", common.problem_arguments())
        } else if watch.is_changed() {
            let update = format!("{} takes the change over into an estimate", update());
            if first == Some(CauseKind::Base) {
                format!(
                    "if the instrument or the arm was set up anew, give these rows another word in a column session and watch again; if both \
                     stood still, {update}"
                )
            } else {
                update
            }
        } else if watch.has_drifted() {
            format!(
                "{} takes the drift over into an estimate, because the old one errs by more than \
                 its bounds say",
                update()
            )
        } else if !unknown.is_empty() {
            format!("{} adds the session to the estimate", update())
        } else {
            advice::after_applying(common, &problem, &estimate, &arguments.estimate)
        };
        format!("{}{}Next: {next}\n", story.text(), results.written())
    })?;
    let misread = watch.causes.first().filter(|cause| cause.kind == CauseKind::Misread);
    if let Some(cause) = misread.filter(|_| !common.prints_text()) {
        diagnostic::warn(&format!("not judged: the table may be misread, {}", cause.label));
    }
    Ok(if watch.is_changed() { Outcome::Changed } else { Outcome::from_trust(estimate.trusted) })
}
