//! What `check` says and writes.

use serde::Serialize;

use super::detection;
use super::expected::{ExpectedEntry, cells};
use super::json::{Observability, Unidentified, to_text};
use super::parameters::blind_text;
use super::quantity::{number, table};
use super::text::conditioning;
use crate::design::{Check, Elsewhere, GrowthStep, Prediction};
use crate::problem::Problem;

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    poses: usize,
    sufficient: bool,
    rank: usize,
    /// With all poses of the series.
    attainable_rank: usize,
    condition_number: f64,
    observability: Observability,
    parameters: Vec<ExpectedEntry<'a>>,
    unidentified: Vec<Unidentified<'a>>,
    /// Root mean square length of the error of one measured position.
    noise_mm: f64,
    prediction: PredictionEntry,
    growth: Vec<StepEntry>,
    /// Least number of poses that see everything and predict as exactly as one position is measured.
    enough: Option<usize>,
    /// From what size on each effect of the catalogue would be found.
    detectable: detection::Entry<'a>,
}

#[derive(Debug, Serialize)]
struct PredictionEntry {
    judged_in: &'static str,
    #[serde(flatten)]
    lengths: Lengths,
    /// Of measured − predicted there: with the noise of the measurement.
    held_out_rms_mm: f64,
}

/// [mm]
#[derive(Debug, Serialize)]
struct Lengths {
    #[serde(rename = "median_mm")]
    median: f64,
    #[serde(rename = "most_mm")]
    most: f64,
    #[serde(rename = "rms_mm")]
    rms: f64,
}

#[derive(Debug, Serialize)]
struct StepEntry {
    poses: usize,
    rank: usize,
    open: usize,
    well_identified: usize,
    #[serde(flatten)]
    prediction: Lengths,
}

impl From<&Prediction> for Lengths {
    fn from(own: &Prediction) -> Self {
        Self { median: own.median * 1e3, most: own.most * 1e3, rms: own.rms * 1e3 }
    }
}

impl From<&GrowthStep> for StepEntry {
    fn from(own: &GrowthStep) -> Self {
        let GrowthStep { poses, rank, open, well_identified, prediction } = own;
        let prediction = prediction.into();
        Self { poses: *poses, rank: *rank, open: *open, well_identified: *well_identified, prediction }
    }
}

/// A check as JSON text.
pub fn check_json(problem: &Problem, check: &Check) -> String {
    let (forecast, growth) = (&check.forecast, &check.growth);
    let document = Document {
        problem: &problem.name,
        poses: forecast.poses,
        sufficient: check.suffices(),
        rank: forecast.identifiability.rank,
        attainable_rank: growth.attainable_rank,
        condition_number: forecast.identifiability.condition_number(),
        observability: Observability::of(&forecast.identifiability, check.coordinates),
        parameters: forecast.expected.iter().map(ExpectedEntry::of).collect(),
        unidentified: Unidentified::all(&forecast.identifiability, |k| forecast.expected[k].name.as_str()),
        noise_mm: check.noise * 1e3,
        prediction: PredictionEntry {
            judged_in: match check.elsewhere {
                Elsewhere::Ranges => "ranges",
                Elsewhere::HeldOut => "held-out",
                Elsewhere::Same => "same",
            },
            lengths: (&check.prediction).into(),
            held_out_rms_mm: check.prediction.rms.hypot(check.noise) * 1e3,
        },
        growth: growth.steps.iter().map(StepEntry::from).collect(),
        enough: growth.enough,
        detectable: detection::Entry::of(&check.detection),
    };
    to_text(&document)
}

/// A check in words, ending in a line break.
pub fn check_text(problem: &Problem, check: &Check) -> String {
    let forecast = &check.forecast;
    let names: Vec<String> = forecast.expected.iter().map(|expected| expected.name.clone()).collect();
    let rows = forecast.expected.iter().map(|expected| {
        let (mut row, unit) = cells(expected, &[expected.prior, expected.std_error]);
        row.extend([unit, format!("{:3.0} %", expected.identified * 100.0)]);
        row
    });
    let header = ["parameter", "nominal", "prior ± 1 σ", "± 1 σ", "unit", "identified"];
    [
        format!("{}\n{} parameters, {} poses\n\n", problem.title, names.len(), forecast.poses),
        table(&header, rows.collect(), &[0, 4, 5]),
        "  ± 1 σ: to be expected of the estimate; identified: the share that the data will give, the rest is prior or choice\n\n"
            .to_owned(),
        conditioning(&forecast.identifiability, names.len(), check.coordinates),
        "\n".to_owned(),
        blind_text(&forecast.identifiability, &names, "check.json"),
        "\n".to_owned(),
        prediction(check),
        "\n".to_owned(),
        growth(check),
        "\n".to_owned(),
        detection::text(&check.detection),
    ]
    .concat()
}

/// Why poses do not suffice, in one line.
pub fn why_not_sufficient(check: &Check) -> String {
    let (forecast, different) = (&check.forecast, check.different);
    let (of, parameters) = (forecast.poses, check.without_prior);
    let open = forecast.open.saturating_sub(check.growth.open);
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
        3 * different
    )
}

fn prediction(check: &Check) -> String {
    let place = match check.elsewhere {
        Elsewhere::Ranges => "anywhere within the ranges",
        Elsewhere::HeldOut => "in the held-out poses",
        Elsewhere::Same => "in these very poses (no ranges are known)",
    };
    let Prediction { median, most, rms } = check.prediction;
    format!(
        "The identified arm will predict positions {place} to {} mm (median), {} mm (95 %), {} mm (rms).\n\
         One measured position has {} mm of noise (rms), so held-out errors to expect are {} mm (rms).\n",
        length(median),
        length(most),
        length(rms),
        length(check.noise),
        length(rms.hypot(check.noise)),
    )
}

fn growth(check: &Check) -> String {
    let growth = &check.growth;
    let rows = growth.steps.iter().map(|step| {
        let Prediction { median, most, rms } = step.prediction;
        let mark = if step.poses == check.forecast.poses { "these" } else { "" };
        vec![
            step.poses.to_string(),
            step.rank.to_string(),
            step.well_identified.to_string(),
            length(median),
            length(most),
            length(rms),
            mark.to_owned(),
        ]
    });
    let header = ["poses", "rank", "≥ 90 %", "median, mm", "95 %, mm", "rms, mm", ""];
    let enough = match growth.enough {
        Some(enough) => format!(
            "From {enough} poses on they see all that such poses can, and the arm predicts as exactly as one position is measured.\n"
        ),
        None => format!(
            "Even {} poses do not make the arm predict as exactly as one position is measured.\n",
            growth.steps.last().map_or(0, |step| step.poses)
        ),
    };
    format!(
        "With more or fewer such poses (rank; parameters of the arm identified to 90 % or more; error of prediction):\n\n{}\n{enough}",
        table(&header, rows.collect(), &[6])
    )
}

/// Metres as millimetres.
fn length(metres: f64) -> String {
    number(metres * 1e3, 3)
}
