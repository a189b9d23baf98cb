//! Arguments and work of `flexcal loop`.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::fit::{Options, ProgressSink};
use flexcal::problem::{self, Problem};
use flexcal::remainder::Correction;
use flexcal::report::{self, PredictionAccuracy};
use flexcal::results::{Document as _, LoopResult, PlotData, REMAINDER_FILE, residuals_csv};
use flexcal::select;

use super::input::Common;
use super::loop_record::LoopRecord;
use super::outcome::Outcome;
use super::output::REPORT;
use super::progress::Line;
use super::{advice, diagnostic, interrupt};

/// Arguments of `flexcal loop`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal loop problems/lunar-sampler
  flexcal loop problems/ur10-ipa --data session_A.csv session_B.csv session_C.csv
  flexcal identify out/lunar-sampler/problem.closed.toml

Writes loop.json, problem.closed.toml (the problem with the effects that were found declared, a valid input again), \
report.md and report.html, with its figures in figures/.")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Print the whole story: every check that failed, and all that is claimed of each effect
    #[arg(short, long, conflicts_with_all = ["quiet", "json"])]
    verbose: bool,
}

/// Fits the problem, searches for the effects that it lacks, and prints the result.
///
/// Writes `loop.json`, `problem.closed.toml`, `residuals.csv` and both reports, and
/// `remainder.json` if a remainder is accepted.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let (problem, text) = common.read_problem_with_text()?;
    common.files(&problem).iter().try_for_each(|file| check_data_file(file))?;
    let texts = ["loop.json", "problem.closed.toml", "residuals.csv", REMAINDER_FILE];
    let names = [&texts[..], &REPORT].concat();
    let results = common.results("loop", &problem, &[], &names)?;
    let mut data = common.measurements(&problem)?;
    common.warn_if_nothing_is_free(&problem);
    common.warn_of_orientation(&problem, &mut data);
    let stop = interrupt::stop();
    let record = LoopRecord::new(&text, &problem, common.files(&problem), &results);
    let options = Options::default().with_influential_rows().with_stop(stop.clone());
    let close = |sink: Option<ProgressSink>| {
        let sink = record.recording_sink(sink);
        select::close(&problem, &data, &options.with_progress(sink))
    };
    let at_deadline = record.clone();
    interrupt::at_deadline(move || at_deadline.write());
    let closure = Line::during(common.prints_text(), stop, close)?;
    let results = if closure.interrupted { record.beside_finished()? } else { results };
    let [files, joint_files] = record.files_relative_to(&results.folder)?;
    let (closure, fitted) = closure.corrected(&data)?;
    let mut shown = PlotData::of_loop(&problem, &data, &closure)?;
    let closed = report::closed_problem(&text, &problem, &closure, [&files, &joint_files])?;
    // The text declares another arm than was fitted if data contradict an effect.
    let is_declared =
        Problem::parse(&closed, &problem.data.location.file)?.digest() == closure.closed.digest();
    let fitted = fitted.filter(|_| is_declared);
    if let Some(fitted) = &fitted {
        shown = shown.with_uncertainty((&closure.after, &closure.closed), &data, fitted)?;
    }
    let kept = fitted.as_ref().and_then(|corrected| corrected.remainder.as_ref());
    let closed = problem::with_remainder(&closed, kept.map(|_| REMAINDER_FILE))?;
    let mut result = LoopResult::new(&problem, &closure);
    if let Some(fitted) = &fitted {
        result = result.with_remainder(&closure, fitted);
    }
    let json = result.to_json();
    let residuals = match fitted.as_ref().and_then(|corrected| corrected.residuals.as_ref()) {
        Some(corrected) => corrected.rows.clone(),
        None => closure.after.residuals(&closure.closed, &data)?,
    };
    let residuals = residuals_csv(&closure.closed, &data.measurements, &residuals);
    let file = kept.map(Correction::to_json);
    let mut texts = vec![
        ("loop.json", json.as_str()),
        ("problem.closed.toml", closed.as_str()),
        ("residuals.csv", residuals.as_str()),
    ];
    texts.extend(file.as_ref().map(|text| (REMAINDER_FILE, text.as_str())));
    let words = kept.and(fitted.as_ref()).map_or_else(String::new, |corrected| {
        report::remainder_paragraph(&closure.after, &corrected.outcome())
    });
    let told = report::loop_report(&problem, &closure, &shown);
    interrupt::begin_writing();
    results.write_report(&texts, &told)?;
    let outcome = diagnostic::report_fit_once(&closure.after, (common.quiet, common.prints_text()));
    if let Some(held) = advice::held_instead(&closure.before.fit, &closure.after) {
        diagnostic::warn(&format!("{held}; what was found may only make up for it"));
    }
    if closure.interrupted {
        diagnostic::warn(&report::interrupted(closure.rounds.len()));
    }
    common.print_result(&json, || {
        let accuracy = PredictionAccuracy::new(&closure.after, &shown);
        let told = if arguments.verbose {
            report::loop_text(&problem, &closure, accuracy)
        } else {
            report::loop_brief(&problem, &closure, accuracy)
        };
        let poses = data.measurements.arm_pose_numbers(&problem);
        let mut fitted: Vec<usize> =
            data.split.identification.iter().filter_map(|&row| poses.get(row).copied()).collect();
        fitted.sort_unstable();
        fitted.dedup();
        let fit = (&closure.before.fit, &closure.after, fitted.len());
        let next = advice::after_loop(common, &problem, fit, &result, &results);
        format!("{told}{words}{}Next: {next}\n", results.written())
    })?;
    Ok(if closure.interrupted { Outcome::NotMet } else { outcome })
}

/// Error of a data file that `problem.closed.toml` cannot name.
#[derive(Debug, thiserror::Error)]
enum DataFileError {
    #[error("{}: loop names its data in problem.closed.toml, and this is no file that can be read again; save it as one", file.display())]
    NotReadableAgain { file: PathBuf },
    #[error("{}: loop names its data in problem.closed.toml, and the name of this file is not UTF-8; give it another", file.display())]
    NotUtf8 { file: PathBuf },
}

/// Returns an error if `problem.closed.toml` cannot name a data file: if the name is not UTF-8, or
/// if the file is a pipe or standard input, which cannot be read a second time.
fn check_data_file(file: &Path) -> Result<(), DataFileError> {
    match file.canonicalize() {
        // A missing file is reported elsewhere.
        Err(_) if file.symlink_metadata().is_err() => Ok(()),
        Ok(real) if real.is_file() || real.is_dir() => match real.to_str() {
            Some(_) => Ok(()),
            None => Err(DataFileError::NotUtf8 { file: file.to_owned() }),
        },
        _ => Err(DataFileError::NotReadableAgain { file: file.to_owned() }),
    }
}
