//! Arguments and work of `flexcal accept`.

use std::error::Error;
use std::fs;
use std::path::Path;

use clap::Args;
use flexcal::files::digest;
use flexcal::fit::{self, Options, SolverChoice, Strategy, Tolerance, Verdict};
use flexcal::remainder::{self, Bounds};
use flexcal::report;
use flexcal::results::{AcceptanceRecord, AcceptanceResult, Document as _};

use super::flags::is_tiny;
use super::input::{Common, Input};
use super::outcome::Outcome;
use super::progress::Line;
use super::{diagnostic, git, values};

/// Arguments of `flexcal accept`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal accept problems/lunar-sampler --instrument 'laser tracker, 1.5 inch reflector'
  flexcal accept out/lunar-sampler/problem.closed.toml --tolerance-mm 2 --share 0.9 --risk 0.05

With --tolerance-mm the exit status is 1 unless the verdict is pass. A remainder that the problem \
declares corrects the predictions.

Writes acceptance.html, a page to print and sign, and acceptance.json with the digest of every input.")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The instrument, for the record
    #[arg(long, value_name = "TEXT")]
    instrument: Option<String>,
    /// Largest error that a pose may have [mm]; the arm passes if the share of poses within it is
    /// large enough
    #[arg(long, value_name = "MM", value_parser = values::number(|mm| mm > 0.0, "a length in mm greater than 0 is needed, such as 0.2"))]
    tolerance_mm: Option<f64>,
    /// Share of all poses that must be within the tolerance
    #[arg(long, value_name = "P", default_value_t = 0.9, value_parser = values::level, requires = "tolerance_mm")]
    share: f64,
    /// Largest probability of a wrong verdict: a pass although fewer poses are within the
    /// tolerance, or a fail although enough are
    #[arg(long, value_name = "P", default_value_t = 0.05, value_parser = values::level, requires = "tolerance_mm")]
    risk: f64,
    /// Correct predictions by a smooth remainder that no law explains, if it improves predictions
    /// of poses left out of the fit
    #[arg(long)]
    remainder: bool,
}

/// Probability with which an error bound of the record holds.
const CONFIDENCE_LEVEL: f64 = 0.95;

/// Identifies the arm, judges its accuracy in the held-out poses, and writes the record and the
/// page.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let Input { problem, data, results } =
        common.read("accept", &["acceptance.json", "acceptance.html"])?;
    fit::held_out_positions(&problem, &data)?;
    let options = Options::default().with_strategy(Strategy::Joint).with_solver(SolverChoice::Auto);
    let fit = |sink| fit::identify(&problem, &data, &options.with_progress(sink));
    let mut found = Line::during(common.prints_text(), None, fit)?;
    let declared = remainder::declared(&problem)?.filter(|_| !arguments.remainder);
    let fitted = if arguments.remainder {
        remainder::fit(&found, &problem, &data)?
    } else {
        remainder::uncertainty(&found, &problem, &data)?
    };
    let fitted = fitted.as_ref();
    let corrected = fitted.and_then(|fitted| fitted.remainder.as_ref());
    let correction = declared.as_ref().or(corrected).or(fitted.map(|fitted| &fitted.alone));
    let predicted = correction
        .map(|correction| remainder::residuals(&found, &problem, &data, correction))
        .transpose()?;
    let has_remainder = declared.is_some() || corrected.is_some();
    let rows = predicted.as_ref().filter(|_| has_remainder).map(|of| of.rows.as_slice());
    let judged = fit::acceptance(&problem, &data, &found, rows)?;
    if let Some(rows) = rows {
        found.judge_corrected(&rows.iter().map(|row| row.position).collect::<Vec<_>>());
    }
    let file = common.problem_file();
    let inputs = std::iter::once(&file)
        .chain(common.files(&problem))
        .chain(problem.data.joint_log.iter().flat_map(|log| &log.files));
    let record = AcceptanceRecord {
        inputs: inputs.map(|file| (file.clone(), sha256(file))).collect(),
        commit: git::commit(&file),
        instrument: arguments.instrument.clone(),
    };
    let mut result = AcceptanceResult::new(&problem, &data.measurements, &found, &judged, &record);
    if let (Some(correction), Some(predicted)) = (correction, &predicted) {
        let held_out = fit::held_out_positions(&problem, &data)?;
        let poses = held_out.iter().filter_map(|&row| predicted.poses.get(row).copied()).collect();
        let bounds = Bounds::new(correction, poses, CONFIDENCE_LEVEL);
        let errors =
            held_out.iter().filter_map(|&row| Some(predicted.rows.get(row)?.position.norm()));
        let errors: Vec<f64> = errors.collect();
        let rows = errors.len();
        let of_rows = held_out.iter().zip(&errors).enumerate();
        let test = bounds
            .test(&data.measurements, of_rows.map(|(pose, (&row, &length))| (pose, row, length)));
        let covered = (bounds.coverage(errors.into_iter().enumerate()), rows, test);
        result = result.with_bounds(&bounds, covered, has_remainder);
    }
    common.warn_if_tiny(arguments.tolerance_mm);
    let tolerance = arguments.tolerance_mm.map(|length| Tolerance {
        length: length * 1e-3,
        share: arguments.share,
        risk: arguments.risk,
    });
    let test = tolerance.map(|tolerance| judged.test(tolerance));
    if let Some(test) = &test {
        result = result.with_tolerance(test, &judged);
    }
    let (json, page) = (result.to_json(), report::acceptance_page(&problem, &result));
    results.write(&[("acceptance.json", &json), ("acceptance.html", &page)])?;
    let outcome = diagnostic::report_fit(&found, common.quiet);
    common.print_result(&json, || {
        let text = report::acceptance_text(&problem, &result);
        let page = results.path("acceptance.html");
        let verdict = result.tolerance.as_ref().map(|tested| tested.verdict);
        let next = if !found.is_trusted() {
            format!("flexcal identify {} says what to correct", common.problem_arguments())
        } else if judged.are_poses_fitted {
            "hold out poses that are not fitted, as held_out = { fraction = 0.3, seed = 1 } does, \
             then the same command again"
                .to_owned()
        } else if arguments.tolerance_mm.is_some_and(is_tiny) {
            "give --tolerance-mm in millimetres, as the warning says".to_owned()
        } else if verdict == Some(Verdict::Fail.as_str()) {
            let page = page.display();
            format!(
                "flexcal loop {} looks for what the model lacks; {page} records the failure",
                common.problem_arguments()
            )
        } else if verdict == Some(Verdict::Undecided.as_str()) {
            "measure and hold out more poses, then the same command again".to_owned()
        } else if found.cautions().next().is_some() {
            let (named, page) = (common.problem_arguments(), page.display());
            format!(
                "clear up the warnings first (flexcal identify {named} says how); print and sign \
                 {page} only if they do not matter here"
            )
        } else {
            format!("print {} and sign it", page.display())
        };
        format!("{text}{}Next: {next}\n", results.written())
    })?;
    match &result.tolerance {
        Some(tested) if tested.verdict != Verdict::Pass.as_str() => {
            if common.quiet {
                diagnostic::warn(&report::tolerance_text(tested));
            }
            Ok(Outcome::NotMet)
        }
        _ => Ok(outcome),
    }
}

/// Returns the SHA-256 digest of a file; `None` if it cannot be read, or for a pipe, which cannot
/// be read a second time.
fn sha256(file: &Path) -> Option<String> {
    file.is_file().then(|| fs::read(file).ok()).flatten().map(|bytes| digest(&bytes))
}
