//! Arguments and work of `flexcal identify`.

use std::collections::BTreeSet;
use std::error::Error;
use std::path::{Path, PathBuf};

use clap::{ArgAction, Args};
use flexcal::error::WarningKind;
use flexcal::fit::{self, Identification, Options, SolverChoice, Strategy};
use flexcal::life::{PriorError, Update, update};
use flexcal::measurement::Dataset;
use flexcal::problem::{HeldOut, Problem};
use flexcal::remainder::{self, Correction, Fitted};
use flexcal::report::{self, PredictionAccuracy};
use flexcal::results::{
    Document as _, IdentificationResult, PlotData, REMAINDER_FILE, residuals_csv,
};

use super::estimate::Trust;
use super::input::Common;
use super::outcome::Outcome;
use super::output::REPORT;
use super::progress::Line;
use super::{advice, diagnostic, interrupt, values};

/// Arguments of `flexcal identify`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  flexcal identify problems/lunar-sampler
  flexcal identify problems/ur10-ipa --data session_A.csv session_B.csv session_C.csv
  flexcal identify my-arm/problem.toml --strategy sequential --json")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// Parameters that are fitted together
    #[arg(long, default_value = Strategy::Joint.as_str(), value_parser = values::one_of(Strategy::EACH.map(|each| (each.as_str(), each.summary(), each))))]
    strategy: Strategy,
    /// Solver; auto keeps bounds and constraints if there are any
    #[arg(long, default_value = SolverChoice::Auto.as_str(), value_parser = values::one_of(solvers()))]
    solver: SolverChoice,
    /// Correct predictions by a smooth remainder that no law explains, if it improves predictions
    /// of poses left out of the fit; writes remainder.json
    #[arg(long)]
    remainder: bool,
    /// Prior: the estimate.json of an earlier identification of the same arm, whose fitted rows are
    /// left out, or the PRIOR.toml of arms of the same type (flexcal fleet)
    #[arg(long, value_name = "ESTIMATE.json|PRIOR.toml", conflicts_with = "remainder")]
    prior: Option<PathBuf>,
    /// Days since the earlier identification, by whose drift the prior is widened
    #[arg(long, value_name = "DAYS", default_value_t = 0.0, requires = "prior", value_parser = values::days)]
    drift: f64,
    /// Rows to hold out: those that the problem says, or none
    #[arg(long, value_name = "ROWS", default_value = HELD_OUT[0].0, action = ArgAction::Set, value_parser = values::one_of(HELD_OUT))]
    held_out: bool,
    #[command(flatten)]
    trust: Trust,
    /// Print every table: parameters, outliers, what the poses can tell
    #[arg(short, long, conflicts_with_all = ["quiet", "json"])]
    verbose: bool,
}

/// Values of `--held-out`, each with a summary, and true if the problem is followed.
const HELD_OUT: [(&str, &str, bool); 2] = [
    ("declared", "As held_out in [data] of the problem says", true),
    (
        "none",
        "Every row is fitted; each configuration is also predicted by a fit without it",
        false,
    ),
];

/// Returns the solvers with their names and summaries.
fn solvers() -> Vec<(&'static str, &'static str, SolverChoice)> {
    SolverChoice::CHOICES.iter().map(|each| (each.as_str(), each.summary(), *each)).collect()
}

/// Prints a warning if few new rows are fitted with a prior and some of them are held out.
fn warn_of_held_out(problem: &Problem, data: &Dataset) {
    let poses = data.measurements.arm_pose_numbers(problem);
    let held_out: BTreeSet<usize> =
        data.split.held_out.iter().filter_map(|&row| poses.get(row).copied()).collect();
    let argument = advice::held_out_argument(problem.data.held_out.as_ref(), &poses);
    if !held_out.is_empty() && !argument.is_empty() {
        let all = poses.into_iter().collect::<BTreeSet<_>>().len();
        diagnostic::warn(&format!(
            "{} of the {all} new poses are held out and not fitted;{argument} fits all",
            held_out.len()
        ));
    }
}

/// Prints a warning that the remainder of the earlier estimate `prior` is not carried over, because
/// the problem states another use.
fn warn_of_remainder(problem: &Problem, prior: Option<&Path>) {
    let Some((declared, prior)) = problem.remainder.as_ref().zip(prior) else { return };
    let reason =
        if declared.is_used { "declares a remainder of its own" } else { "says use = false" };
    diagnostic::warn(&format!(
        "the remainder of {} is not carried over, because [remainder] in the problem {reason}; \
         without that section it is",
        prior.display()
    ));
}

/// Identifies the arm, writes `estimate.json`, `residuals.csv` and both reports, and
/// `remainder.json` if one is requested and accepted; prints the result.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let mut names = vec!["estimate.json", "residuals.csv", REPORT[0], REPORT[1]];
    if arguments.remainder || arguments.prior.is_some() {
        names.push(REMAINDER_FILE);
    }
    let mut problem = common.read_problem()?;
    if !arguments.held_out {
        problem.data.held_out = Some(HeldOut::Nothing);
    }
    let results = common.results("identify", &problem, arguments.prior.as_slice(), &names)?;
    let data = common.measurements(&problem)?;
    if arguments.prior.is_some() && !common.quiet {
        warn_of_held_out(&problem, &data);
    }
    let prior =
        arguments.prior.as_deref().map(|file| arguments.trust.read_prior(file)).transpose()?;
    let declared = remainder::declared(&problem)?.filter(|_| !arguments.remainder);
    common.warn_if_nothing_is_free(&problem);
    let stop = interrupt::stop();
    let options = Options::default()
        .with_strategy(arguments.strategy)
        .with_solver(arguments.solver)
        .with_influential_rows()
        .with_stop(stop.clone());
    let (sources, updated, mut identification) =
        Line::during(common.prints_text(), stop, |sink| -> Result<_, PriorError> {
            let options = options.with_progress(sink);
            if let Some(prior) = &prior {
                let days = arguments.drift;
                let updated = update(&problem, &data, &options, prior, days)?;
                let Update { found, predictions, leaves_remainder } = updated;
                return Ok((None, Some((predictions, leaves_remainder)), found));
            }
            let found = fit::identify(&problem, &data, &options)?;
            // The requested fit is complete, so an interrupt only skips the comparison of the
            // sources of the joint values.
            match fit::joint_sources(&problem, &data, &options, &found) {
                Err(error) if error.is_interrupted() => Ok((None, None, found)),
                sources => Ok((sources.map_err(PriorError::from)?, None, found)),
            }
        })?;
    // With a prior from a file, the uncertainty of predictions is the earlier one, updated: the new
    // rows alone would be too few.
    let fitted = if let Some((predictions, leaves_remainder)) = updated {
        if leaves_remainder && !common.quiet {
            warn_of_remainder(&problem, arguments.prior.as_deref());
        }
        predictions
    } else if arguments.remainder {
        remainder::fit(&identification, &problem, &data)?
    } else {
        remainder::uncertainty(&identification, &problem, &data)?
    };
    let fitted = match (fitted, declared) {
        (Some(fitted), Some(declared)) => {
            Some(fitted.with_declared(declared, (&identification, &problem), &data)?)
        }
        (fitted, _) => fitted,
    };
    if let Some(fitted) = &fitted {
        fitted.judge_held_out(&mut identification);
    }
    let mut result =
        IdentificationResult::new(&problem, &identification).with_files(common.files(&problem));
    if let Some(fitted) = &fitted {
        result = result.with_predictions(&identification, fitted);
    }
    let json = result.to_json();
    let is_reported = |corrected: &&Fitted| arguments.remainder || corrected.remainder.is_some();
    let is_written = |corrected: &&Fitted| !corrected.is_declared;
    let words = fitted
        .as_ref()
        .filter(is_reported)
        .map(|corrected| report::remainder_paragraph(&identification, &corrected.outcome()))
        .unwrap_or_default();
    let mut shown = PlotData::of_identification(&problem, &data, &identification)?;
    if let Some(fitted) = &fitted {
        shown = shown.with_uncertainty((&identification, &problem), &data, fitted)?;
    }
    let told = report::identification_report(&problem, &identification, &shown);
    let residuals = match fitted.as_ref().and_then(|corrected| corrected.residuals.as_ref()) {
        Some(corrected) => corrected.rows.clone(),
        None => identification.residuals(&problem, &data)?,
    };
    let residuals = residuals_csv(&problem, &data.measurements, &residuals);
    let kept = fitted.as_ref().filter(is_written).and_then(|of| of.remainder.as_ref());
    let file = kept.map(Correction::to_json);
    let mut texts = vec![("estimate.json", json.as_str()), ("residuals.csv", residuals.as_str())];
    texts.extend(file.as_ref().map(|text| (REMAINDER_FILE, text.as_str())));
    interrupt::begin_writing();
    results.write_report(&texts, &told)?;
    let sources = sources.as_ref().map(report::joint_sources_text);
    let outcome =
        diagnostic::report_fit_once(&identification, (common.quiet, common.prints_text()));
    common.warn_if_all_is_held(&problem, &identification);
    common.print_result(&json, || {
        let accuracy = PredictionAccuracy::new(&identification, &shown);
        let told = if arguments.verbose {
            report::estimate_text(&problem, &identification, accuracy)
        } else {
            report::estimate_brief(&problem, &identification, accuracy)
        };
        let sources = sources.as_ref().map_or_else(String::new, |words| format!("\n{words}\n"));
        let is_structured = shown.residual_tests.is_structured();
        let estimate = results.path("estimate.json");
        let mut warnings = data.measurements.warnings.iter();
        let next = if warnings.any(|warning| is_cause(&warning.kind, &identification)) {
            format!(
                "correct the table as the warning says, then flexcal identify {}",
                common.problem_arguments()
            )
        } else {
            advice::after_fit(common, (&problem, &identification), is_structured, &estimate)
        };
        let turns = Common::orientation_line(&problem, &data.measurements);
        format!("{told}{turns}{words}{sources}{}Next: {next}\n", results.written())
    })?;
    if let (Some(words), true, false) = (&sources, common.json, common.quiet) {
        diagnostic::warn(words);
    }
    Ok(outcome)
}

/// Returns true if a warning about the table says why the fit is not to be trusted.
fn is_cause(kind: &WarningKind, found: &Identification) -> bool {
    kind.refutes_table() || kind.lacks_loads() && !found.is_trusted()
}
