//! Arguments and work of `flexcal predict`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use flexcal::fit::{self, Residual};
use flexcal::measurement::{Measurements, Split};
use flexcal::nalgebra::Vector3;
use flexcal::problem::HeldOut;
use flexcal::remainder::{self, Bounds, Compared, CorrectedPrediction};
use flexcal::report::{self, shell_word};
use flexcal::results::{Document as _, PredictionErrors, predictions_csv, residuals_csv};

use super::estimate::{Trust, older_sides};
use super::input::Common;
use super::outcome::Outcome;
use super::{advice, diagnostic, values};

/// Arguments of `flexcal predict`.
#[derive(Debug, Args)]
#[command(
    mut_arg("data", |arg| arg.help("Tables of poses like measurements; positions are not needed")),
    after_help = "Writes predictions.csv and predictions.html; where the table holds measured positions also residuals.csv and errors.json, the errors of all \
rows and of each session. A session that the estimate does not know is given a base and a tool fitted to those of its rows that are measured, with the arm as \
it is.

Examples:
  flexcal predict problems/lunar-sampler --estimate out/lunar-sampler/estimate.json \\
    --data tomorrow.csv
  flexcal predict my-arm --data poses.csv"
)]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The estimate.json of an identification of the same problem; without it the nominal arm is
    /// predicted
    #[arg(long, value_name = "ESTIMATE.json")]
    estimate: Option<PathBuf>,
    /// Probability with which the bound of an error holds
    #[arg(long, value_name = "P", default_value_t = 0.95, value_parser = values::level)]
    level: f64,
    #[command(flatten)]
    trust: Trust,
}

/// Minimum number of rows that show a common error.
const MIN_COMMON_ROWS: usize = 3;
/// Smallest ratio of a common error to the scatter around it that is reported.
const MIN_COMMON_SCATTERS: f64 = 5.0;
/// Smallest common error that is reported \[m\].
const MIN_COMMON_ERROR: f64 = 1e-3;

/// Names of the files that the command may write.
const RESULT_FILES: [&str; 4] =
    ["predictions.csv", "residuals.csv", "errors.json", "predictions.html"];

/// Predicts the rows, writes predictions, residuals and errors, and prints the errors.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    let problem = common.read_problem()?;
    let results =
        common.results("predict", &problem, arguments.estimate.as_slice(), &RESULT_FILES)?;
    let (rows, warnings) = common.read_rows(&problem, Measurements::read_to_predict)?;
    let rows = rows.arm_rows();
    common.warn(&warnings);
    let estimate = arguments.estimate.as_deref();
    let estimate = estimate.map(|file| arguments.trust.read(file)).transpose()?;
    common.hint(estimate.as_ref().and_then(|of| older_sides(of, &problem, &rows)));
    let trusted = estimate.as_ref().is_none_or(|of| of.trusted);
    if !trusted {
        diagnostic::warn("the estimate is not to be trusted, so the predictions are not either");
    }
    common.hint(estimate.iter().filter_map(|of| of.doubted_bounds.as_ref()).filter(|_| trusted));
    let lacks_loads =
        estimate.as_ref().is_some_and(|estimate| common.warn_of_loads(&problem, estimate, &rows));
    // Rows without a split are predicted too. A random split applies only to the rows of the
    // problem, not to new rows.
    let is_random_split = matches!(problem.data.held_out, Some(HeldOut::Fraction { .. }));
    let split =
        Split::new(&problem, &rows).ok().filter(|_| !is_random_split || common.data().is_empty());
    let of_estimate = |of| remainder::of_estimate(&problem, of);
    let correction = estimate.as_ref().map(of_estimate).transpose()?.flatten();
    let (prediction, bounds) = match (&estimate, &correction) {
        (Some(estimate), Some(correction)) => {
            let CorrectedPrediction { prediction, poses, sides } =
                remainder::predict(&problem, estimate, correction, &rows, split.as_ref())?;
            common.hint(report::unknown_sides(&sides, true));
            let bounds = Bounds::new(correction, poses, arguments.level);
            (prediction, Some(bounds.with_misfit(estimate.misfit)))
        }
        _ => (fit::predict(&problem, estimate.as_ref(), &rows, split.as_ref())?, None),
    };
    let bounds = bounds.as_ref();
    let residuals = prediction.residuals.as_deref().unwrap_or_default();
    common.hint(common_error(&rows, residuals));
    let is_position = |row: usize| rows.observation(row).is_position();
    let bounds_suffice = bounds.is_some() && (0..rows.len()).all(is_position);
    let errors = estimate
        .as_ref()
        .filter(|_| !bounds_suffice)
        .map(|estimate| fit::standard_errors(&problem, estimate, &rows, &prediction.x))
        .transpose()?;
    let table = predictions_csv(&problem, &rows, &prediction, (bounds, errors.as_deref()));
    let mut texts = vec![("predictions.csv", table)];
    texts.extend(
        prediction
            .residuals
            .as_ref()
            .map(|residuals| ("residuals.csv", residuals_csv(&problem, &rows, residuals))),
    );
    let fitted = estimate.as_ref().map_or_else(Vec::new, |estimate| estimate.fitted_among(&rows));
    // Targets of commands are true positions, of which readings differ by errors of the instrument.
    let read_otherwise = match &estimate {
        Some(estimate) => remainder::true_positions(&problem, estimate, &rows, &prediction)?,
        None => None,
    };
    common.hint(read_otherwise.map(report::true_positions_sentence));
    let measured = if read_otherwise.is_none() { residuals } else { &[] };
    let lengths = measured.iter().enumerate().map(|(row, of)| (row, of.position.norm()));
    let lengths = lengths.filter(|(row, _)| rows.observation(*row).is_of_position());
    let lengths: Vec<(usize, f64)> = lengths.collect();
    let of_others = lengths.iter().filter(|(row, _)| fitted.binary_search(row).is_err());
    let of_others = of_others.map(|&(row, length)| (row, row, length));
    let test = bounds.map(|bounds| bounds.test(&rows, of_others)).filter(|test| test.of > 0);
    let compared = bounds.map(|bounds| Compared { bounds, errors: &lengths, test: test.as_ref() });
    let errors = prediction.errors.as_ref().map(|errors_of_rows| {
        let errors = PredictionErrors::new(errors_of_rows, &prediction.spreads);
        match compared {
            Some(compared) => errors.with_bounds(compared).to_json(),
            None => errors.to_json(),
        }
    });
    texts.extend(errors.clone().map(|json| ("errors.json", json)));
    let arm = if estimate.is_some() { "the identified arm" } else { "the nominal arm" };
    // Bounds of an estimate that is not trusted say nothing.
    let judged = compared.filter(|_| trusted);
    let story = report::prediction(&problem, arm, &prediction, (judged, &fitted, lacks_loads));
    texts.push((RESULT_FILES[3], story.page()));
    let borrowed: Vec<(&str, &str)> =
        texts.iter().map(|(name, text)| (*name, text.as_str())).collect();
    results.write(&borrowed)?;
    let lost = prediction.lost_rows();
    common.print_result(errors.as_deref().unwrap_or(&PredictionErrors::default().to_json()), || {
        let text = story.text();
        let names: Vec<&str> = texts.iter().map(|(name, _)| *name).collect();
        let next = match (&arguments.estimate, &estimate) {
            _ if let Some(&first) = lost.first() => format!(
                "correct the loads (payload_kg, hoist_N) of {} without equilibrium, the first at \
                 {}, then the same command",
                if lost.len() == 1 { "1 row".to_owned() } else { format!("{} rows", lost.len()) },
                rows.location(first)
            ),
            _ if warnings.iter().any(|warning| warning.kind.doubts_table()) => {
                "correct the table as the warning says, then the same command".to_owned()
            }
            _ if lacks_loads && test.is_some_and(|of| of.is_contradicted()) => {
                "add the column of loads that the warning names, then the same command".to_owned()
            }
            (Some(file), _) if fitted.is_empty() && test.is_some_and(|of| of.is_contradicted()) => format!(
                "flexcal watch {} --estimate {} says whether the arm has changed: fewer rows than \
                 foreseen lie within their bounds",
                common.problem_arguments(),
                shell_word(file)
            ),
            (Some(_), Some(estimate)) if trusted && !estimate.posterior.has_prior && test.is_some_and(|of| of.is_contradicted()) => format!(
                "flexcal loop {} looks for what the model lacks, because fewer rows than \
                 foreseen lie within their bounds",
                advice::fitted_arguments(common, &problem, estimate)
            ),
            (Some(file), Some(estimate)) => {
                advice::after_applying(common, &problem, estimate, file)
            }
            _ => format!(
                "flexcal identify {} writes an estimate for --estimate",
                shell_word(common.problem())
            ),
        };
        let folder = results.folder.display();
        format!("{text}\nWritten to {folder}: {}\nNext: {next}\n", names.join(", "))
    })?;
    let is_refuted = warnings.iter().any(|warning| warning.kind.refutes_table());
    Ok(Outcome::from_trust(trusted && lost.is_empty() && !is_refuted))
}

/// Returns a warning if all measured positions of one session are off by nearly the same vector.
fn common_error(rows: &Measurements, residuals: &[Residual]) -> Option<String> {
    let is_one_session = rows.session.names.len() == 1 && residuals.len() == rows.len();
    if !is_one_session || residuals.len() < MIN_COMMON_ROWS {
        return None;
    }
    let count = residuals.len() as f64;
    let mean = residuals.iter().map(|row| row.position).sum::<Vector3<f64>>() / count;
    let scatter = residuals.iter().map(|row| (row.position - mean).norm_squared()).sum::<f64>();
    let is_common = mean.norm() > MIN_COMMON_SCATTERS * (scatter / count).sqrt();
    let are_positions = (0..rows.len()).all(|row| rows.observation(row).is_position());
    (are_positions && is_common && mean.norm() > MIN_COMMON_ERROR).then(|| {
        format!(
            "all {} rows are off by about the same vector ({:.3}, {:.3}, {:.3} mm): if the instrument \
             was set up anew, give these rows a session of their own in the column session",
            residuals.len(),
            mean.x * 1e3,
            mean.y * 1e3,
            mean.z * 1e3
        )
    })
}
