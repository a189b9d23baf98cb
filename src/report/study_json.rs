//! `study.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::json::to_text;
use crate::monte_carlo::{Campaign, CellResult, ParameterResult, Results};

#[derive(Debug, Serialize)]
struct Document<'a> {
    study: &'a str,
    problem: &'a str,
    data: &'a str,
    seed: u64,
    repetitions: usize,
    held_out_poses: usize,
    cells: Vec<Cell<'a>>,
}

#[derive(Debug, Serialize)]
struct Cell<'a> {
    position_sigma_mm: f64,
    identification_poses: usize,
    strategy: &'a str,
    solver: &'a str,
    fits: u64,
    failed: u64,
    failure_rate: f64,
    /// Fits that are not to be trusted, by reason.
    failures: &'a BTreeMap<String, u64>,
    held_out_mm: HeldOut,
    reduced_chi2: Option<f64>,
    coverage: Option<f64>,
    largest_bias: Option<LargestBias<'a>>,
    iterations_mean: Option<f64>,
    iterations_max: Option<f64>,
    parameters: Vec<Parameter<'a>>,
}

/// Position errors of held-out poses; mean and rms over fits and poses, the others of the rms of each fit.
#[derive(Debug, Serialize)]
struct HeldOut {
    mean: Option<f64>,
    rms: Option<f64>,
    rms_sd: Option<f64>,
    rms_max: Option<f64>,
}

#[derive(Debug, Serialize)]
struct LargestBias<'a> {
    parameter: &'a str,
    /// Bias over spread.
    bias_sd: f64,
}

#[derive(Debug, Serialize)]
struct Parameter<'a> {
    name: &'a str,
    unit: &'a str,
    fits: u64,
    bias: Option<f64>,
    spread: Option<f64>,
    rms_error: Option<f64>,
    with_std_error: u64,
    std_error: Option<f64>,
    coverage: Option<f64>,
}

impl<'a> From<ParameterResult<'a>> for Parameter<'a> {
    fn from(result: ParameterResult<'a>) -> Self {
        Self {
            name: &result.parameter.name,
            unit: result.unit(),
            fits: result.fits,
            bias: result.bias,
            spread: result.spread,
            rms_error: result.rms_error,
            with_std_error: result.with_std_error,
            std_error: result.std_error,
            coverage: result.coverage,
        }
    }
}

impl<'a> Cell<'a> {
    fn of(campaign: &'a Campaign, result: &'a CellResult) -> Self {
        let CellResult { cell, tally, .. } = result;
        let in_mm = |value: Option<f64>| value.map(|value| value * 1e3);
        Self {
            position_sigma_mm: millimetres(cell.sigma),
            identification_poses: cell.poses,
            strategy: cell.strategy.as_str(),
            solver: cell.solver.as_str(),
            fits: tally.fits,
            failed: tally.failed(),
            failure_rate: result.failure_rate(),
            failures: &tally.failures,
            held_out_mm: HeldOut {
                mean: in_mm(tally.held_out_mean.mean()),
                rms: in_mm(tally.held_out_rms.rms()),
                rms_sd: in_mm(tally.held_out_rms.deviation()),
                rms_max: in_mm(tally.held_out_rms.largest()),
            },
            reduced_chi2: tally.reduced_chi2.mean(),
            coverage: result.coverage(),
            largest_bias: result
                .largest_bias(campaign)
                .map(|(parameter, bias_sd)| LargestBias { parameter: &parameter.name, bias_sd }),
            iterations_mean: tally.iterations.mean(),
            iterations_max: tally.iterations.largest(),
            parameters: result.parameters(campaign).map(Parameter::from).collect(),
        }
    }
}

/// A study as JSON text, ending in a line break; SI units except where a key says otherwise, and without times.
pub fn study_json(campaign: &Campaign, results: &Results) -> String {
    to_text(&Document {
        study: &campaign.name,
        problem: &campaign.problem.name,
        data: campaign.source.as_str(),
        seed: campaign.seed,
        repetitions: campaign.repetitions,
        held_out_poses: campaign.held_out,
        cells: results.cells.iter().map(|cell| Cell::of(campaign, cell)).collect(),
    })
}

/// A noise level as it was written: 0.1 mm are not 0.10000000000000001 mm.
pub(super) fn millimetres(metres: f64) -> f64 {
    (metres * 1e15).round() / 1e12
}
