//! What `check` says and writes.

use super::detection;
use super::document::{Block, Table};
use super::forecast::{assumptions, cells};
use super::parameters::{conditioning, unidentifiable};
use super::quantity::{counted, mm};
use super::render::text;
use crate::design::{Check, ExpectedParameter, Forecast, Prediction, PredictionPoses};
use crate::fit::rows_of_kind;
use crate::problem::Problem;

/// A check in words, ending in a line break.
pub fn check_text(problem: &Problem, check: &Check) -> String {
    let forecast = &check.forecast;
    let names: Vec<String> =
        forecast.expected.iter().map(|expected| expected.name.clone()).collect();
    let rows = forecast.expected.iter().map(|expected| {
        let (mut row, unit) = cells(expected, &[expected.prior, expected.std_error]);
        row.extend([unit, share(expected)]);
        row
    });
    let header = ["parameter", "nominal", "prior ± 1 σ", "± 1 σ", "unit", "identified"];
    let mut notes = vec![
        "± 1 σ: to be expected of the estimate; identified: the share that the data will give, the rest is prior or choice",
    ];
    if forecast.expected.iter().any(goes_with_others) {
        notes.push(
            "a share with “to”: at the nominal arm, where the parameter goes with others (below), and of arms drawn from the priors",
        );
    }
    let mut blocks = vec![
        Block::lines(format!(
            "{}\n{}, {}",
            problem.title,
            counted(names.len(), "parameter"),
            counted(forecast.poses, "pose")
        )),
        Block::Table(Table::new(&header, rows.collect(), &[0, 4, 5]).noted(&notes)),
        conditioning(&forecast.identifiability, names.len(), check.coordinates),
        unidentifiable(&forecast.identifiability, &names, "check.json"),
        Block::lines(prediction(check)),
        Block::lines(
            "With more or fewer such poses (rank; parameters of the arm identified to 90 % or more; error of prediction):",
        ),
        Block::Table(growth(check)),
        Block::lines(enough(check)),
    ];
    // Where the poses are measured ones, the held-out ones are none of them.
    let all = (check.predicted_at != PredictionPoses::HeldOut).then_some(forecast.poses);
    blocks.extend(assumptions(problem, &forecast.expected, all));
    blocks.extend(detection::blocks(&check.detection));
    text(&blocks)
}

/// Shares of the data that differ by more than this are shown both.
const APART: f64 = 0.05;

/// Whether the poses hardly tell a parameter at the nominal arm, and tell it at arms drawn from the
/// priors.
fn goes_with_others(expected: &ExpectedParameter) -> bool {
    let nominal = expected.identified_at_nominal;
    nominal < Forecast::WELL_IDENTIFIED && expected.identified - nominal > APART
}

/// The share of a parameter that the data will give.
fn share(expected: &ExpectedParameter) -> String {
    let percent = |share: f64| format!("{:3.0}", share * 100.0);
    let own = percent(expected.identified);
    if goes_with_others(expected) {
        format!("{} to {} %", percent(expected.identified_at_nominal), own.trim_start())
    } else {
        format!("{own} %")
    }
}

/// Why poses do not suffice, in one line.
pub fn why_not_sufficient(check: &Check) -> String {
    let (forecast, different) = (&check.forecast, check.different);
    let (of, parameters) = (forecast.poses, check.without_prior);
    let open = forecast.undetermined.saturating_sub(check.growth.undetermined);
    if open > 0 {
        let noun = if open == 1 { "combination" } else { "combinations" };
        return format!(
            "these poses leave {open} {noun} of parameters without a prior undecided that others would decide: more poses are \
             needed"
        );
    }
    format!(
        "{different} of the {of} poses differ and measure {} coordinates, fewer than the {parameters} parameters without \
         a prior: more poses are needed",
        check.distinct
    )
}

fn prediction(check: &Check) -> String {
    let place = match check.predicted_at {
        PredictionPoses::Ranges => "anywhere within the ranges",
        PredictionPoses::HeldOut => "in the held-out poses",
        PredictionPoses::Same => "in these very poses (no ranges are known)",
    };
    let Prediction { median, quantile_95, rms } = check.prediction;
    let noise = match check.noise {
        Some(noise) if positions(check) => format!(
            "One measured position has {} mm of noise (rms), so held-out errors to expect are {} mm (rms).",
            mm(noise, 3),
            mm(rms.hypot(noise), 3)
        ),
        Some(noise) => format!(
            "One position measured with the σ of the {} would have {} mm of noise (rms).",
            rows_of_kind(check.noise_of),
            mm(noise, 3)
        ),
        None => "Tilts measure no length to compare that with.".to_owned(),
    };
    let [median, most, rms] = [median, quantile_95, rms].map(|own| mm(own, 3));
    format!(
        "The identified arm will predict positions {place} to {median} mm (median), {most} mm (95 %), {rms} mm (rms).\n{noise}"
    )
}

/// Whether the poses measure positions.
fn positions(check: &Check) -> bool {
    check.noise_of == "position"
}

fn growth(check: &Check) -> Table {
    let rows = check.growth.steps.iter().map(|step| {
        let Prediction { median, quantile_95, rms } = step.prediction;
        let mut row: Vec<String> =
            [step.poses, step.rank, step.well_identified].iter().map(usize::to_string).collect();
        row.extend([median, quantile_95, rms].map(|length| mm(length, 3)));
        row.push(if step.poses == check.forecast.poses { "these" } else { "" }.to_owned());
        row
    });
    Table::new(
        &["poses", "rank", "≥ 90 %", "median, mm", "95 %, mm", "rms, mm", ""],
        rows.collect(),
        &[6],
    )
}

fn enough(check: &Check) -> String {
    match check.growth.enough {
        Some(enough) => format!(
            "From {enough} poses on they identify all that such poses can, and predictions are as accurate as one measured position."
        ),
        None if check.noise.is_none() => {
            "From how many poses on predictions are accurate enough is not said: nothing measured is a length."
                .to_owned()
        }
        None => format!(
            "Even {} poses do not make predictions as accurate as one measured position.",
            check.growth.steps.last().map_or(0, |step| step.poses)
        ),
    }
}
