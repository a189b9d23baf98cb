//! Arguments and work of `flexcal compensate`.

use std::error::Error;
use std::path::PathBuf;

use clap::Args;
use flexcal::design;
use flexcal::error::{InputError, InputErrorKind, TableErrorKind};
use flexcal::fit;
use flexcal::measurement::Measurements;
use flexcal::remainder::{self, Compensation, TargetFrame};
use flexcal::report::{self, Doubts, shell_word};
use flexcal::results::{CompensationResult, Document as _, commands_csv};

use super::estimate::{Trust, older_sides};
use super::input::Common;
use super::outcome::Outcome;
use super::{advice, diagnostic, values};

/// Arguments of `flexcal compensate`.
#[derive(Debug, Args)]
#[command(mut_arg("data", |data| data.help("Targets, tables like measurements")), after_help = "The targets are a table like measurements: x_mm, y_mm, z_mm are where the arm should be, and \
q1_deg, … where to start from; of the configurations that reach a target the nearest to that is taken. Ranges of joints \
are kept where the problem gives them (min_deg, max_deg of a joint). A column session says whose base to use. With the \
columns rx_deg, ry_deg, rz_deg (or qx, qy, qz, qw) the orientation is kept too; without x_mm, y_mm, z_mm the arm is brought \
to where the nominal arm would have been.

Examples:
  flexcal identify problems/lunar-sampler
  flexcal compensate problems/lunar-sampler --estimate out/lunar-sampler/estimate.json \\
    --data targets.csv")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The estimate.json of an identification of the same problem
    #[arg(long, value_name = "FILE")]
    estimate: PathBuf,
    /// The frame in which targets are given
    #[arg(long, default_value = FRAMES[0].0, value_parser = values::one_of(FRAMES))]
    frame: TargetFrame,
    /// Probability with which the bound of an error holds
    #[arg(long, value_name = "P", default_value_t = 0.95, value_parser = values::level)]
    level: f64,
    #[command(flatten)]
    trust: Trust,
}

/// Frames in which the targets may be given, each with its name and a summary.
const FRAMES: [(&str, &str, TargetFrame); 2] = [
    ("measuring", "The measuring frame, as for measurements", TargetFrame::Measuring),
    ("base", "The frame of the arm's base", TargetFrame::Base),
];

/// Returns the option that chooses a frame.
fn frame_option(frame: TargetFrame) -> String {
    let chosen = FRAMES.iter().find(|(.., other)| *other == frame);
    chosen.map_or_else(String::new, |(name, ..)| format!("--frame {name}"))
}

/// Error of missing targets: no table of targets is named.
#[derive(Debug, thiserror::Error)]
#[error("no targets; name them with --data")]
struct NoTargets;

/// Adds to the error of a missing column of commands what the column means in a table of targets.
fn with_start(mut error: InputError) -> InputError {
    if let InputErrorKind::Table(TableErrorKind::MissingColumn { write, .. }) = &mut *error.kind {
        let mut letters = write.chars();
        if letters.next() == Some('q') && letters.next().is_some_and(|next| next.is_ascii_digit()) {
            write.push_str(", the command to start from");
        }
    }
    error
}

/// Finds the commands that reach the targets, writes `commands.csv`, and prints which targets are
/// reached.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    if common.data().is_empty() {
        return Err(NoTargets.into());
    }
    let mut problem = common.read_problem()?;
    // Every row is a target, so none is held out.
    problem.data.held_out = None;
    let results = common.results(
        "compensate",
        &problem,
        std::slice::from_ref(&arguments.estimate),
        &["commands.csv"],
    )?;
    let (targets, warnings) =
        Measurements::read_poses(common.data(), &problem).map_err(with_start)?;
    common.warn(&warnings);
    let missing = fit::missing_target_columns(&problem, &targets);
    common.hint(
        missing.iter().map(|missing| {
            format!("{missing}; the commands neglect the effects that depend on it")
        }),
    );
    let estimate = arguments.trust.read(&arguments.estimate)?;
    let trusted = estimate.trusted;
    common.hint(older_sides(&estimate, &problem, &targets));
    common.warn_of_loads(&problem, &estimate, &targets);
    if !trusted {
        diagnostic::warn(
            "the estimate is not to be trusted, so the commands are not either: do not move the \
             arm by them",
        );
    }
    common.hint(estimate.doubted_bounds.as_ref().filter(|_| trusted));
    let correction = remainder::of_estimate(&problem, &estimate);
    let rivals = design::rivals(&problem).unwrap_or_else(|error| {
        common.hint([format!("{error}; what the loop did not decide is not in the bounds")]);
        Vec::new()
    });
    let fitted = (&estimate, correction.as_ref().ok().and_then(Option::as_ref), rivals.as_slice());
    let solve = |targets: Measurements, frame: TargetFrame| {
        Compensation::new(&problem, fitted, targets, frame, arguments.level)
    };
    let frame = arguments.frame;
    let found = solve(targets.clone(), frame)?;
    let as_given = (&targets, frame, found.commands.as_slice());
    let Doubts { misplaced, others } =
        Doubts::new(&problem, as_given, frame_option, |targets, frame| {
            solve(targets, frame).ok().map(|found| found.commands)
        });
    // An error of the remainder's file is reported only after errors of the estimate, which explain
    // more.
    correction?;
    let undecided = report::undecided_commands(&found, &rivals);
    common.hint(undecided.as_ref().map(|(said, _)| said));
    common.hint(report::uncorrected_commands(&found, undecided.is_some()));
    if found.is_base_open {
        common.hint([
            "the estimate does not know where the arm's base is in the measuring frame, so targets in that frame are reached as far as it \
             happens to be assumed; --frame base takes them in the frame of the base",
        ]);
    }
    // Beside an estimate that is not to be trusted, its misfit explains targets that seem misplaced.
    if trusted {
        common.hint(misplaced.iter().chain(&others));
    }
    let Compensation { targets, commands, bounds, .. } = &found;
    let bounds = bounds.as_ref();
    let table = commands_csv(&problem, targets, commands, bounds);
    results.write(&[("commands.csv", &table)])?;
    let mut result =
        CompensationResult::new(&problem, commands).with_uncorrected(&found.uncorrected);
    if let Some(bounds) = bounds {
        result = result.with_bounds(bounds);
    }
    common.print_result(&result.to_json(), || {
        let written = results.path("commands.csv");
        let [problem_word, file] = [common.problem(), &arguments.estimate].map(shell_word);
        let reached = commands.iter().filter(|command| command.is_reached()).count();
        let next = if !trusted {
            format!(
                "flexcal identify {}{} says why the estimate is not to be trusted; correct that, \
                 and identify again before commands are corrected",
                advice::fitted_arguments(common, &problem, &estimate),
                advice::strategy_argument(&estimate)
            )
        } else if misplaced.is_some() {
            "correct the table of targets, or name its frame, as the warning says".to_owned()
        } else if warnings.iter().any(|warning| warning.kind.doubts_table()) {
            "correct the table as the warning says, then the same command".to_owned()
        } else if reached == 0 {
            "check the unit and the frame of the targets (--frame base takes them in the frame of the base) and the limits of the \
             joints"
                .to_owned()
        } else if let Some((_, next)) = undecided {
            next
        } else {
            let these = if reached < commands.len() { "the commands of reached targets" } else { "these commands" };
            format!(
                "measure with {these}, then flexcal predict {problem_word} --estimate {file} \
                 --data MEASURED.csv judges them"
            )
        };
        format!(
            "{}\nWritten to {}\nNext: {next}\n",
            report::commands_text(&problem, targets, commands, bounds),
            written.display()
        )
    })?;
    let are_reached = found.reaches_all();
    if !are_reached && common.quiet {
        diagnostic::warn("a target is not reached; without --quiet it is named");
    }
    let is_refuted = warnings.iter().any(|warning| warning.kind.refutes_table());
    Ok(Outcome::from_trust(are_reached && trusted && !is_refuted))
}
