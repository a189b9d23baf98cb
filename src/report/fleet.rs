//! Text and page of the command `fleet`.

use std::fmt::Write as _;

use super::document::{Block, Table, last_parts};
use super::figures::{ACCENT, Drawing, FAINT, Forest, INK, WARM};
use super::render::Story;
use crate::life::{Fleet, FleetArm, FleetParameter};
use crate::quantity::format::{counted, decimals, number, or_dash, two_digits};

/// Header of the table of parameters.
const PARAMETER_HEADER: [&str; 5] = ["parameter", "mean", "± 1 σ", "spread", "data sheet"];
/// Header of the table of arms.
const ARM_HEADER: [&str; 4] = ["arm", "", "deviates most in", "sigmas"];
/// Smallest number of arms of which one could be shown to be unlike the others.
const MIN_JUDGED_ARMS: usize = 5;
/// Maximum number of decimals of a deviation.
const MAX_DECIMALS: usize = 5;

/// Returns the fleet, with its arms and parameters drawn.
pub(crate) fn fleet(fleet: &Fleet) -> Story {
    let unlike = fleet.arms.iter().filter(|arm| arm.is_unlike).count();
    let is_judged = fleet.arms.len() >= MIN_JUDGED_ARMS;
    let verdict = match unlike {
        0 if !is_judged => "too few to tell whether one is unlike the others".to_owned(),
        0 => "no arm is unlike the others".to_owned(),
        count => format!("{} unlike the others", counted(count, "arm")),
    };
    let mut head = format!("{}: {}, {verdict}", fleet.problem, counted(fleet.arms.len(), "arm"));
    if !fleet.left_out.is_empty() {
        let names = fleet.left_out.join(", ");
        let _ = write!(head, "\nLeft out, because one of the estimates gives no variance: {names}");
    }
    let parameters = fleet.parameters.iter().map(parameter).collect();
    let arms = fleet.arms.iter().map(|of| arm(of, is_judged)).collect();
    let note = "deviations from nominal; ± 1 σ: of the mean; spread: expected 1 σ of the next arm about \
                the mean; with few arms it lies between their scatter and the σ of the data sheet; \
                data sheet: declared 1 σ";
    let blocks = vec![
        Block::lines(head),
        Block::figures([draw_arms(fleet, is_judged), draw_parameters(fleet)]),
        Block::Table(Table::new(&PARAMETER_HEADER, parameters, &[0]).noted(&[note])),
        Block::Table(Table::new(&ARM_HEADER, arms, &[0, 1, 2])),
    ];
    Story::new(&fleet.problem, "fleet", blocks)
}

/// Draws the largest deviation of each arm from the other arms. `is_judged` is true if there are
/// enough arms to call one like the others.
fn draw_arms(fleet: &Fleet, is_judged: bool) -> Option<Drawing> {
    let row = |arm: &FleetArm| {
        let (parameter, sigmas) = arm.most.as_ref()?;
        let value = Some((*sigmas, 0.0));
        let values = if arm.is_unlike { vec![None, value] } else { vec![value, None] };
        Some((format!("{}: {parameter}", last_parts(&arm.file)), values))
    };
    Forest {
        names: ("fleet-arms", "Each arm against its siblings"),
        caption: "The parameter in which each arm deviates most from what the other arms say, in standard deviations of that \
                  difference."
            .to_owned(),
        label: "deviation [standard deviations]",
        legend: vec![(if is_judged { "like its siblings" } else { "arm" }, INK), ("unlike", WARM)],
        references: vec![0.0],
        rows: fleet.arms.iter().filter_map(row).collect(),
        is_logarithmic: false,
    }
    .drawing()
}

/// Draws mean and spread of each parameter in units of its declared σ.
fn draw_parameters(fleet: &Fleet) -> Option<Drawing> {
    let row = |parameter: &FleetParameter| {
        let declared = parameter.declared.filter(|sigma| *sigma > 0.0)?;
        let within = Some((parameter.mean / declared, parameter.spread / declared));
        Some((parameter.name.clone(), vec![within, Some((0.0, 1.0))]))
    };
    Forest {
        names: ("fleet-parameters", "Parameters of the fleet against the data sheet"),
        caption: "Mean deviation from nominal and its spread (1 σ) from arm to arm, both in units of the σ that the problem \
                  declares."
            .to_owned(),
        label: "deviation from nominal [declared σ]",
        legend: vec![("fleet, mean ± spread", ACCENT), ("data sheet, ± 1 σ", FAINT)],
        references: vec![0.0],
        rows: fleet.parameters.iter().filter_map(row).collect(),
        is_logarithmic: false,
    }
    .drawing()
}

fn parameter(parameter: &FleetParameter) -> Vec<String> {
    let FleetParameter { mean, mean_error, spread, declared, .. } = *parameter;
    // Deviations of stiffnesses are logarithms of the ratio to the nominal value.
    let (mean, ratio, factor, symbol) = match parameter.unit.as_str() {
        "rad" => (mean, 1.0, 1f64.to_degrees(), "°"),
        "m" => (mean, 1.0, 1e3, "mm"),
        "N·m/rad" | "N" | "N·m²" => (mean.exp_m1(), mean.exp(), 100.0, "%"),
        other => (mean, 1.0, 1.0, other),
    };
    let show = |value: f64| two_digits(value * factor, MAX_DECIMALS);
    vec![
        format!("{} [{symbol}]", parameter.name),
        number(mean * factor, decimals(ratio * mean_error * factor, MAX_DECIMALS)),
        show(ratio * mean_error),
        show(ratio * spread),
        or_dash(declared, show),
    ]
}

fn arm(arm: &FleetArm, is_judged: bool) -> Vec<String> {
    let most = arm.most.as_ref();
    vec![
        arm.file.display().to_string(),
        match (arm.is_unlike, is_judged) {
            (true, _) => "unlike",
            (false, true) => "like",
            (false, false) => "–",
        }
        .to_owned(),
        or_dash(most, |most| most.0.clone()),
        or_dash(most, |most| number(most.1, 1)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_of_a_stiffness_is_shown_as_a_ratio_to_nominal() {
        let fleet = FleetParameter {
            name: "joint2.stiffness".to_owned(),
            unit: "N·m/rad".to_owned(),
            nominal: 9e3,
            mean: -0.088,
            mean_error: 0.02,
            spread: 0.05,
            declared: Some(0.3),
        };
        assert_eq!(parameter(&fleet), ["joint2.stiffness [%]", "-8.4", "1.8", "4.6", "30"]);
    }
}
