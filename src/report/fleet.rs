//! Text of the command `fleet`.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::render::text;
use crate::life::{Fleet, FleetArm, FleetParameter};
use crate::quantity::format::{counted, number, or_dash, two_digits};

/// Header of the table of parameters.
const PARAMETERS: [&str; 5] = ["parameter", "mean", "± 1 σ", "spread", "data sheet"];
/// Header of the table of arms.
const ARMS: [&str; 4] = ["arm", "", "deviates most in", "sigmas"];
/// Maximum number of decimals of a deviation.
const MAX_DECIMALS: usize = 5;

/// Returns the fleet as text, ending in a line break.
pub fn fleet_text(fleet: &Fleet) -> String {
    let unlike = fleet.arms.iter().filter(|arm| arm.is_unlike).count();
    let verdict = match unlike {
        0 => "no arm is unlike the others".to_owned(),
        count => format!("{} unlike the others", counted(count, "arm")),
    };
    let mut head = format!("{}: {}, {verdict}", fleet.problem, counted(fleet.arms.len(), "arm"));
    if !fleet.left_out.is_empty() {
        let names = fleet.left_out.join(", ");
        let _ = write!(head, "\nLeft out, without a variance in some estimate: {names}");
    }
    let parameters = fleet.parameters.iter().map(parameter).collect();
    let arms = fleet.arms.iter().map(arm).collect();
    let notes = [
        "deviations from nominal; spread: 1 σ of the next arm about the mean; data sheet: declared 1 σ",
    ];
    text(&[
        Block::lines(head),
        Block::Table(Table::new(&PARAMETERS, parameters, &[0]).noted(&notes)),
        Block::Table(Table::new(&ARMS, arms, &[0, 1, 2])),
    ])
}

fn parameter(parameter: &FleetParameter) -> Vec<String> {
    let (factor, symbol) = match parameter.unit.as_str() {
        "rad" => (1f64.to_degrees(), "°"),
        "m" => (1e3, "mm"),
        "N·m/rad" | "N" | "N·m²" => (100.0, "%"),
        other => (1.0, other),
    };
    let show = |value: f64| two_digits(value * factor, MAX_DECIMALS);
    vec![
        format!("{} [{symbol}]", parameter.name),
        number(parameter.mean * factor, 4),
        show(parameter.mean_error),
        show(parameter.spread),
        or_dash(parameter.declared, show),
    ]
}

fn arm(arm: &FleetArm) -> Vec<String> {
    let most = arm.most.as_ref();
    vec![
        arm.file.display().to_string(),
        if arm.is_unlike { "unlike" } else { "like" }.to_owned(),
        or_dash(most, |most| most.0.clone()),
        or_dash(most, |most| number(most.1, 1)),
    ]
}
