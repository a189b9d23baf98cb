//! Text and page of the command `check`: the expected result of measurements at some poses.

use super::detection;
use super::document::{Block, Column, Table, opening};
use super::figures::{ACCENT, Curve, Drawing, FAINT, INK, Series};
use super::forecast::{assumptions, cells, poses_to_measure, undetermined_note};
use super::parameters::{conditioning, rows_of_sheet, unidentifiable};
use super::render::{Story, text};
use crate::design::{Check, ExpectedParameter, Forecast, GrowthStep, Prediction, PredictionPoses};
use crate::fit::rows_of_kind;
use crate::problem::{Joint, Problem};
use crate::quantity::format::{counted, mm};

/// Returns the forecast of the command `check`, with a figure of the error of predictions against
/// the number of poses.
pub fn check(problem: &Problem, check: &Check) -> Story {
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
        "± 1 σ: expected standard error, root mean square over arms drawn from the priors; \
         identified: share of the information that comes from the data; the rest comes from the \
         prior or the start value",
    ];
    if forecast.expected.iter().any(is_confounded_at_nominal) {
        notes.push(
            "two shares: the first at the nominal arm, where the parameter is confounded with \
             others (below), the second over arms drawn from the priors",
        );
    }
    notes.extend(undetermined_note(&forecast.expected));
    let sheet = rows_of_sheet(problem);
    notes.extend(sheet.as_deref());
    let noun = check.row_noun;
    let mut blocks = head(problem, check);
    blocks.extend([
        Block::Table(Table::new(&header, rows.collect(), &[0, 4, 5]).noted(&notes)),
        Block::Page(vec![conditioning(
            &forecast.identifiability,
            names.len(),
            check.coordinates,
        )]),
        unidentifiable(&forecast.identifiability, &names, ("check.json", check.open_scale.as_deref())),
        Block::lines(
            format!("With more or fewer such {noun}s (rank; parameters of the arm identified to 90 % or more; error of predictions):"),
        ),
        Block::Table(growth_table(check)),
        Block::figures([growth_figure(check)]),
    ]);
    blocks.extend(assumptions_of(problem, check));
    blocks.extend(detection::blocks(problem, &check.detection));
    Story::new(&problem.title, "check", blocks)
}

/// Returns the forecast of the command `check` on one screen, ending in a line break.
pub fn check_brief(problem: &Problem, check: &Check) -> String {
    let Forecast { expected, identifiability, .. } = &check.forecast;
    let names: Vec<String> = expected.iter().map(|expected| expected.name.clone()).collect();
    let is_well = |of: &&ExpectedParameter| of.identified >= Forecast::WELL_IDENTIFIED;
    let well = expected.iter().filter(is_well).count();
    let least = expected.iter().min_by(|a, b| a.identified.total_cmp(&b.identified));
    let least = least.filter(|of| !is_well(of)).map_or_else(String::new, |least| {
        format!("; least {} ({})", least.name, share(least).trim_start())
    });
    let mut blocks = head(problem, check);
    let confounded = expected.iter().filter(|of| is_confounded_at_nominal(of)).count();
    let confounded = match confounded {
        0 => String::new(),
        count => format!(", {count} of them at arms beside the nominal one alone"),
    };
    blocks.push(Block::lines(format!(
        "The data identify {well} of {} to 90 % or more{confounded}{least}.",
        counted(names.len(), "parameter")
    )));
    blocks.push(unidentifiable(
        identifiability,
        &names,
        ("check.json", check.open_scale.as_deref()),
    ));
    blocks.extend(assumptions_of(problem, check));
    blocks.extend(detection::brief(problem, &check.detection));
    blocks.push(Block::lines(
        "-v and check.html state the standard error of each parameter, what more or fewer poses \
         give, and from which size on each effect is found.",
    ));
    text(&blocks)
}

/// Returns the counts, the recommended number of poses, and the expected errors of predictions.
fn head<'a>(problem: &Problem, check: &Check) -> Vec<Block<'a>> {
    let (forecast, noun) = (&check.forecast, check.row_noun);
    let of_poses = if noun == "pose" {
        String::new()
    } else {
        format!(" in {}", counted(check.distinct_poses, "pose"))
    };
    let checked = counted(forecast.poses, noun);
    let counts = format!("{}, {checked}{of_poses}", counted(forecast.expected.len(), "parameter"));
    let mut blocks = opening(&problem.title, counts).to_vec();
    blocks.push(Block::lines(recommendation(problem, check)));
    blocks.push(Block::lines(prediction_sentences(check)));
    let is_massless = |joint: &Joint| joint.bodies.is_empty() && joint.beam.is_none();
    if problem.gravity.norm() > 0.0 && problem.joints.iter().all(is_massless) {
        blocks.push(Block::lines(
            "No masses are declared, so what gives way under the weight of links cannot be found; rough \
             mass_kg and com_m of the links will do.",
        ));
    }
    blocks
}

/// States what the figures assume.
fn assumptions_of<'a>(problem: &Problem, check: &Check) -> Option<Block<'a>> {
    // If held-out rows are predicted, the checked poses are the fitted ones of a table.
    let poses = (check.predicted_at != PredictionPoses::HeldOut).then_some(check.forecast.poses);
    assumptions(problem, &check.forecast.expected, (poses, 0))
}

/// Draws the expected error of predictions against the number of poses.
fn growth_figure(check: &Check) -> Option<Drawing> {
    let curve = |name, colour, of: fn(&Prediction) -> f64| {
        let at = |step: &GrowthStep| (step.poses as f64, of(&step.prediction) * 1e3);
        Curve::new(name, colour, check.growth.steps.iter().map(at))
    };
    let noise = check.noise.map(|noise| {
        let name = format!("noise of one measured position, rms {} mm", mm(noise, 3));
        (name, noise * 1e3)
    });
    let (rows, title) = if check.row_noun == "point" {
        ("points", "Expected error of predictions against the number of points")
    } else {
        ("poses", "Expected error of predictions against the number of poses")
    };
    Series {
        names: ("check-growth", title),
        caption: format!(
            "Expected error of predicted positions after so many {}s of this kind, without \
             measurement noise, on a logarithmic scale.",
            check.row_noun
        ),
        labels: (rows, "error [mm]"),
        is_logarithmic: true,
        curves: vec![
            curve("95 % stay below", ACCENT, |error| error.quantile_95),
            curve("root mean square", INK, |error| error.rms),
            curve("median", FAINT, |error| error.median),
        ],
        levels: noise.into_iter().collect(),
        are_levels_in_legend: true,
        ..Series::default()
    }
    .drawing()
}

/// Difference between the identified shares at drawn arms and at the nominal arm, above which a
/// table shows both.
const MIN_SHOWN_DIFFERENCE: f64 = 0.05;

/// Returns true if a parameter is confounded with others at the nominal arm, but identified at arms
/// drawn from the priors.
fn is_confounded_at_nominal(expected: &ExpectedParameter) -> bool {
    let nominal = expected.identified_at_nominal;
    nominal < Forecast::WELL_IDENTIFIED && expected.identified - nominal > MIN_SHOWN_DIFFERENCE
}

/// Formats the expected identified share of a parameter.
fn share(expected: &ExpectedParameter) -> String {
    let percent = |share: f64| format!("{:3.0}", share * 100.0);
    let share = percent(expected.identified);
    if is_confounded_at_nominal(expected) {
        format!("{} to {} %", percent(expected.identified_at_nominal), share.trim_start())
    } else {
        format!("{share} %")
    }
}

/// States in one line why the checked poses do not suffice.
pub fn why_not_sufficient(check: &Check) -> String {
    let (forecast, different) = (&check.forecast, check.distinct_poses);
    let (of, parameters) = (forecast.poses, check.without_prior);
    let open = forecast.undetermined.saturating_sub(check.growth.undetermined);
    if open > 0 {
        let noun = if open == 1 { "combination" } else { "combinations" };
        return format!(
            "these poses do not determine {open} {noun} of parameters without a prior that other poses would determine: more poses are \
             needed"
        );
    }
    format!(
        "the {of} {}s ({}) measure {} different coordinates, fewer than the {parameters} \
         parameters without a prior: more poses are needed",
        check.row_noun,
        counted(different, "different pose"),
        check.distinct_coordinates
    )
}

/// States the expected error of predicted positions, and the noise of one measurement.
fn prediction_sentences(check: &Check) -> String {
    let place = match check.predicted_at {
        PredictionPoses::Ranges => "anywhere within the ranges",
        PredictionPoses::HeldOut => "in the held-out poses",
        PredictionPoses::Same => "in these very poses (no ranges are known)",
    };
    let Prediction { median, quantile_95, rms } = check.prediction;
    let noise = match check.noise {
        Some(noise) if measures_positions(check) => format!(
            "One measured position has {} mm of noise (rms), so held-out errors to expect are {} \
             mm (rms).",
            mm(noise, 3),
            mm(rms.hypot(noise), 3)
        ),
        Some(noise) => format!(
            "One position measured with the σ of the {} would have {} mm of noise (rms).",
            rows_of_kind(check.noise_of),
            mm(noise, 3)
        ),
        None => "No position is measured to compare that with.".to_owned(),
    };
    let [median, most, rms] = [median, quantile_95, rms].map(|length| mm(length, 3));
    format!(
        "Expected error of predicted positions {place}: {median} mm (median), {most} mm (95 %), \
         {rms} mm (rms).\n{noise}"
    )
}

/// Returns true if at least one of the checked poses measures a position.
fn measures_positions(check: &Check) -> bool {
    check.noise_of == "position"
}

/// Returns the table of forecasts for smaller and larger numbers of poses.
fn growth_table(check: &Check) -> Table {
    let count = |name, of: fn(&GrowthStep) -> usize| {
        Column::number(name, move |step: &GrowthStep| of(step).to_string())
    };
    let length = |name, of: fn(&Prediction) -> f64| {
        Column::number(name, move |step: &GrowthStep| mm(of(&step.prediction), 3))
    };
    let these = |step: &GrowthStep| {
        if step.poses == check.forecast.poses { "these" } else { "" }.to_owned()
    };
    Table::of(
        &check.growth.steps,
        &[
            count(if check.row_noun == "point" { "points" } else { "poses" }, |step| step.poses),
            count("rank", |step| step.rank),
            count("≥ 90 %", |step| step.well_identified),
            length("median, mm", |error| error.median),
            length("95 %, mm", |error| error.quantile_95),
            length("rms, mm", |error| error.rms),
            Column::words("", these),
        ],
    )
}

/// States the recommended number of poses.
fn recommendation(problem: &Problem, check: &Check) -> String {
    match check.growth.enough {
        Some(enough) if enough <= check.forecast.poses => format!(
            "Enough: {enough} such poses determine every combination of parameters that such \
             poses can determine, and predictions are then as accurate as one measured position. \
             More poses still lower the error."
        ),
        Some(enough) if let Some(measured) = poses_to_measure(problem, enough) => format!(
            "Measure {measured} poses, of which held_out removes {}: the others determine every \
             combination of parameters that such poses can determine, and predictions are then as \
             accurate as one measured position. More poses still lower the error.",
            measured - enough
        ),
        Some(enough) => format!(
            "Measure {enough} poses: they determine every combination of parameters that such \
             poses can determine, and predictions are then as accurate as one measured position. \
             More poses still lower the error."
        ),
        None if check.noise.is_none() => {
            "No number of poses is recommended, because nothing measured is a length.".to_owned()
        }
        None => format!(
            "Even {} poses do not make predictions as accurate as one measured position.",
            check.growth.steps.last().map_or(0, |step| step.poses)
        ),
    }
}
