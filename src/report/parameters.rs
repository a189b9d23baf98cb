//! The table of parameters, and what the data cannot tell.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::quantity::{decimals, number, table};
use super::waves::{Line, shown};
use crate::identify::{Estimate, Identification};
use crate::least_squares::solver::AtBound;
use crate::least_squares::{BlindCombination, Identifiability};
use crate::quantity::Unit;

/// Decimals of a value that has no error.
const PLAIN: usize = 4;
/// Decimals of any value at most.
const MOST: usize = 6;
/// Weights in a blind combination that are worth naming.
const NAMED: f64 = 0.02;
/// Terms of a blind combination that are named, the largest.
const MOST_NAMED: usize = 8;
/// Blind combinations that fit on a screen.
const SHOWN_BLIND: usize = 12;
/// Correlations that fit on a screen.
const SHOWN_CORRELATIONS: usize = 12;

/// Columns of the table of parameters.
const HEADER: [&str; 7] = ["parameter", "nominal", "estimate", "change", "± 1 σ", "unit", "identified"];
/// Those of them that hold words.
const LEFT: [usize; 3] = [0, 5, 6];

/// Nominal, estimate, change and standard error of every free parameter.
pub(super) fn parameter_table(result: &Identification) -> String {
    let mut text = table(&HEADER, parameter_rows(result), &LEFT);
    if !shown(&result.estimates).lower.is_empty() {
        text.push_str("  lower waves: in estimate.json\n");
    }
    if result.estimates.iter().any(|estimate| estimate.std_error.is_none()) {
        text.push_str(
            "  –: no standard error: the data say nothing of it or see it in a blind combination only, a bound holds it, or it \
             was not fitted\n",
        );
    }
    text.push_str(
        "  identified: the share that the data gave; the rest is prior, bound, or choice among blind combinations\n",
    );
    text
}

/// The same without words on its columns, and the file that holds what is left out.
pub(super) fn parameter_blocks(result: &Identification, file: &str) -> Vec<Block> {
    let (header, left) = (HEADER.to_vec(), LEFT.to_vec());
    let mut blocks = vec![Block::Table(Table { header, rows: parameter_rows(result), left })];
    if !shown(&result.estimates).lower.is_empty() {
        blocks.push(Block::Text(format!("Lower waves: in {file}.")));
    }
    blocks
}

/// The rows of that table.
fn parameter_rows(result: &Identification) -> Vec<Vec<String>> {
    let row = |estimate: &Estimate| {
        let unit = estimate.unit.display(estimate.nominal);
        let error = estimate.std_error.map(|error| error * unit.factor);
        let digits = error.map_or(PLAIN, |error| decimals(error, MOST));
        let show = |value: f64| number(value * unit.factor, digits);
        vec![
            estimate.name.clone(),
            number(estimate.nominal * unit.factor, digits.min(PLAIN)),
            show(estimate.estimate),
            show(estimate.estimate - estimate.nominal),
            error.map_or_else(|| "–".to_owned(), |error| number(error, digits)),
            unit.symbol,
            verdict(estimate),
        ]
    };
    let line = |line: &Line| match line {
        Line::Parameter(estimate) => row(estimate),
        Line::Lower(waves, joint) => {
            let mut cells = vec![String::new(); HEADER.len()];
            cells[0] = format!("and {waves} lower waves of joint {joint}");
            cells
        }
    };
    shown(&result.estimates).lines.iter().map(line).collect()
}

/// How well a parameter is identified, in a word and a share.
pub(super) fn verdict(estimate: &Estimate) -> String {
    let share = format!("{:3.0} %", estimate.identified * 100.0);
    match (estimate.at_bound, estimate.fitted) {
        (Some(AtBound::Lower), _) => "at its lower bound".to_owned(),
        (Some(AtBound::Upper), _) => "at its upper bound".to_owned(),
        (None, false) => "not fitted".to_owned(),
        (None, true) => match estimate.identified {
            part if part > 0.9 && is_vague(estimate) => format!("{share}  but vaguely"),
            part if part > 0.9 => format!("{share}  well"),
            part if part > 0.1 => format!("{share}  in part"),
            part if part > 1e-6 => format!("{share}  hardly"),
            _ => format!("{share}  not at all"),
        },
    }
}

/// Whether the standard error is larger than any calibration would accept: 1°, 10 mm, or half the value of a stiffness.
fn is_vague(estimate: &Estimate) -> bool {
    let limit = match estimate.unit {
        Unit::Angle => 1.0_f64.to_radians(),
        Unit::Length => 0.01,
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => 0.5 * estimate.estimate,
        _ => f64::INFINITY,
    };
    estimate.std_error.is_none_or(|error| error > limit)
}

/// The combinations that no measurement sees, in words; `file` holds them all.
pub(super) fn blind_text(found: &Identifiability, unknowns: &[String], file: &str) -> String {
    let blind = &found.blind;
    if blind.is_empty() {
        return "The data see every combination of the parameters there.\n".to_owned();
    }
    let mut text = format!(
        "{} of {} combinations cannot be seen there (their parameters can change together in these\n\
         proportions, each scaled by its effect, and no predicted position moves):\n",
        blind.len(),
        unknowns.len()
    );
    for combination in blind.iter().take(SHOWN_BLIND) {
        let _ = writeln!(text, "  {}", blind_words(combination, unknowns));
    }
    if blind.len() > SHOWN_BLIND {
        let _ = writeln!(text, "  and {} more in {file}", blind.len() - SHOWN_BLIND);
    }
    text
}

pub(super) fn blind_words(combination: &BlindCombination, unknowns: &[String]) -> String {
    let name = |k: usize| unknowns[k].as_str();
    if let [(k, _)] = combination.weights[..] {
        return format!("{} alone", name(k));
    }
    let mut named: Vec<&(usize, f64)> = combination.weights.iter().filter(|(_, weight)| weight.abs() > NAMED).collect();
    // Equal weights differ by rounding from machine to machine: sort by what is shown.
    let shown = |weight: f64| (weight.abs() * 100.0).round();
    named.sort_by(|a, b| shown(b.1).total_cmp(&shown(a.1)).then(a.0.cmp(&b.0)));
    let mut terms: Vec<String> = named
        .iter()
        .take(MOST_NAMED)
        .map(|(k, weight)| format!("{} {:.2} {}", if *weight < 0.0 { '−' } else { '+' }, weight.abs(), name(*k)))
        .collect();
    if named.len() > MOST_NAMED {
        terms.push(format!("… and {} smaller", named.len() - MOST_NAMED));
    }
    terms.join(" ")
}

/// Pairs of parameters that go together; `file` holds them all.
pub(super) fn correlation_text(result: &Identification, file: &str) -> String {
    // What one blind combination ties together is told above.
    let tied = |a: &str, b: &str| {
        let holds =
            |blind: &BlindCombination, name: &str| blind.weights.iter().any(|&(k, _)| result.unknowns[k] == name);
        result.identifiability.blind.iter().any(|blind| holds(blind, a) && holds(blind, b))
    };
    let pairs: Vec<_> = result.correlations.iter().filter(|(a, b, _)| !tied(a, b)).collect();
    if pairs.is_empty() {
        return "No two other parameters are correlated by more than 0.9.\n".to_owned();
    }
    let mut text = "Correlated by more than 0.9 (their sum or difference is known better than each):\n".to_owned();
    for (a, b, correlation) in pairs.iter().copied().take(SHOWN_CORRELATIONS) {
        let sign = if *correlation < 0.0 { '−' } else { '+' };
        let _ = writeln!(text, "  {a} and {b}: {sign}{:.3}", correlation.abs());
    }
    if pairs.len() > SHOWN_CORRELATIONS {
        let _ = writeln!(text, "  and {} more in {file}", pairs.len() - SHOWN_CORRELATIONS);
    }
    text
}
