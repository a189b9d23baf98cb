//! What `study` prints: a line a cell.

use super::quantity::{number, table};
use super::study_json::millimetres;
use crate::monte_carlo::{Campaign, CellResult, Results, Source};

/// A study as text, ending in a line break.
pub fn study_text(campaign: &Campaign, results: &Results) -> String {
    let by = match campaign.source {
        Source::Model => "the model itself",
        Source::Rig => "the virtual test rig",
    };
    let head = format!(
        "{}\n{} cells of {} fits, {} parameters, measured by {by}; {} poses held out in each\n\n",
        campaign.title,
        campaign.cells.len(),
        campaign.repetitions,
        campaign.parameters.len(),
        campaign.held_out
    );
    let header = [
        "noise mm",
        "poses",
        "strategy",
        "solver",
        "failed",
        "held out mean",
        "rms, mm",
        "± sd",
        "covered",
        "largest bias",
        "of",
        "steps",
        "ms",
    ];
    let body = results.cells.iter().map(|cell| line(campaign, cell)).collect();
    let foot = "  held out: measured − predicted, noise included; covered: by ± 1.96 standard errors, 95 % if those are right;\n  \
                largest bias: of all parameters, over its spread; ms: middle fit\n";
    head + &table(&header, body, &[2, 3, 10]) + foot
}

fn line(campaign: &Campaign, result: &CellResult) -> Vec<String> {
    let CellResult { cell, tally, .. } = result;
    let or_dash = |value: Option<f64>, decimals| value.map_or("–".to_owned(), |value| number(value, decimals));
    let in_mm = |value: Option<f64>| or_dash(value.map(|value| value * 1e3), 4);
    let percent = |share: Option<f64>| share.map_or("–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    let bias = result.largest_bias(campaign);
    vec![
        millimetres(cell.sigma).to_string(),
        cell.poses.to_string(),
        cell.strategy.as_str().to_owned(),
        cell.solver.as_str().to_owned(),
        percent(Some(result.failure_rate())),
        in_mm(tally.held_out_mean.mean()),
        in_mm(tally.held_out_rms.rms()),
        in_mm(tally.held_out_rms.deviation()),
        percent(result.coverage()),
        or_dash(bias.map(|(_, ratio)| ratio), 2),
        bias.map_or("–".to_owned(), |(parameter, _)| parameter.name.clone()),
        or_dash(tally.iterations.mean(), 1),
        number(result.timing().median * 1e3, 1),
    ]
}
