//! Comparison of the prior, an earlier estimate or that of a fleet, with new rows and the
//! posterior, in words.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::figures::{ACCENT, Drawing, Forest, INK};
use crate::fit::{ComparedParameter, Identification, PriorComparison};
use crate::quantity::format::{MAX_DECIMALS, counted, decimals, number, or_dash, p_value};

/// Header of the table of parameters.
const HEADER: [&str; 7] =
    ["parameter", "prior", "± 1 σ", "new rows", "± 1 σ", "posterior", "± 1 σ"];
/// Largest standard error by the new rows, in units of the earlier one, at which the figure shows a
/// parameter. Above it the new rows add hardly any information.
const MAX_DRAWN_ERROR: f64 = 10.0;

/// Returns the comparison with the prior: a summary, a figure and a table of the parameters that it
/// informs on. Empty for a fit without an earlier estimate or a fleet as its prior.
pub(super) fn prior<'a>(found: &Identification) -> Vec<Block<'a>> {
    let Some(comparison) = &found.prior else { return Vec::new() };
    let rows = comparison.parameters.iter().map(row).collect();
    let note =
        "new rows: estimate from them and the prior of the other parameters; –: they add less than \
         a thousandth to the information of the prior, or the parameter is at a bound"
            .to_owned();
    let table = Table { notes: vec![note], ..Table::new(&HEADER, rows, &[0]) };
    vec![
        Block::Heading("Prior against the new rows".to_owned()),
        Block::Text(summary(found, comparison)),
        Block::figures([draw(comparison)]),
        Block::Table(table),
    ]
}

/// Draws the estimate by the new rows and the posterior of each parameter, in standard errors of
/// the earlier estimate.
fn draw(comparison: &PriorComparison) -> Option<Drawing> {
    let row = |compared: &ComparedParameter| {
        let (earlier, sigma) = compared.prior;
        let scaled = |(value, error): (f64, f64)| ((value - earlier) / sigma, error / sigma);
        let data = compared.data.map(scaled).filter(|data| data.1 <= MAX_DRAWN_ERROR)?;
        let posterior = compared.posterior.1.map(|error| scaled((compared.posterior.0, error)));
        Some((compared.name.clone(), vec![Some(data), posterior]))
    };
    Forest {
        names: ("earlier-estimate", "New rows and posterior against the prior"),
        caption:
            "Values ± 1 σ of each parameter that the new rows inform on, in units of the σ of \
                  the prior, which is at 0 ± 1."
                .to_owned(),
        label: "deviation from the prior [its σ]",
        legend: vec![("new rows", INK), ("posterior", ACCENT)],
        references: vec![0.0, -1.0, 1.0],
        rows: comparison.parameters.iter().filter_map(row).collect(),
        is_logarithmic: false,
    }
    .drawing()
}

/// States whether the new rows agree with the earlier estimate. This test knows no bounds and no
/// constraints, which the text says if the fit is at one.
pub(super) fn summary(found: &Identification, comparison: &PriorComparison) -> String {
    let mut text = format!("Prior: {}", comparison.file.display());
    if comparison.days > 0.0 {
        let plural = if comparison.days > 1.0 { "s" } else { "" };
        let _ = write!(text, ", widened by the drift of {} day{plural}", comparison.days);
    }
    if comparison.left_out > 0 {
        let rows = counted(comparison.left_out, "row");
        let _ = write!(text, "; {rows} that it was fitted to left out");
    }
    let is_limited = !found.active_constraints.is_empty()
        || found.estimates.iter().any(|estimate| estimate.at_bound.is_some());
    let limits = if is_limited { " (without bounds and constraints)" } else { "" };
    if let Some((chi2, coordinates, p)) = comparison.chi2 {
        let _ = write!(
            text,
            ". New rows against it{limits}: χ² = {} with {coordinates:.0} degrees of freedom, p {}",
            number(chi2, 1),
            p_value(p)
        );
    }
    let verdict = match comparison.causes.as_slice() {
        [] => match comparison.chi2 {
            Some(_) if comparison.contradicting_p().is_none() => {
                ". No contradiction is shown.".to_owned()
            }
            Some(_) => ". That is improbable, but no single cause explains it.".to_owned(),
            None => ". Their agreement could not be tested.".to_owned(),
        },
        [noise] if comparison.has_raised_sigma => {
            format!(
                ". They disagree, and no change that was tried explains that as well as {noise}."
            )
        }
        causes => {
            // χ² counts all coordinates alike, so that a small change of one kind may leave it as
            // expected.
            let is_hidden = comparison.chi2.is_some() && comparison.contradicting_p().is_none();
            let but = if is_hidden { ", but the test for single causes finds one" } else { "" };
            format!(
                "{but}. They disagree. Most probable of the changes that are tried: {}.",
                causes.join(", together with ")
            )
        }
    };
    text + &verdict
}

/// Returns true if the new rows contradict the prior of a fit, and neither a change that was tried nor
/// larger noise explains that.
pub fn is_prior_contradicted(found: &Identification) -> bool {
    found
        .prior
        .as_ref()
        .is_some_and(|prior| prior.is_unexplained || prior.has_raised_sigma && !found.is_trusted())
}

/// States that the new rows contradict the earlier estimate; `None` if they do not.
pub(super) fn contradiction(comparison: &PriorComparison) -> Option<String> {
    let words = "the new rows contradict the prior";
    comparison.is_contradicted().then(|| match comparison.contradicting_p() {
        Some(p) => format!("{words} (p {})", p_value(p)),
        None => words.to_owned(),
    })
}

fn row(compared: &ComparedParameter) -> Vec<String> {
    let unit = compared.unit.display(compared.prior.0);
    let error = compared.posterior.1.unwrap_or(compared.prior.1);
    let digits = decimals(error * unit.factor, MAX_DECIMALS);
    let show = |value: f64| number(value * unit.factor, digits);
    vec![
        format!("{} [{}]", compared.name, unit.symbol),
        show(compared.prior.0),
        show(compared.prior.1),
        or_dash(compared.data, |data| show(data.0)),
        or_dash(compared.data, |data| show(data.1)),
        show(compared.posterior.0),
        or_dash(compared.posterior.1, show),
    ]
}
