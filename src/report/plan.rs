//! What `plan` says and writes.

use serde::Serialize;

use super::expected::{ExpectedEntry, cells};
use super::json::{Observability, Unidentified, to_text};
use super::parameters::blind_text;
use super::quantity::{number, table};
use super::separation;
use super::text::conditioning;
use crate::design::{Criterion, Plan, Separated};
use crate::problem::Problem;

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    criterion: &'a str,
    seed: u64,
    /// Planned.
    poses: usize,
    /// Measured in any case.
    given: usize,
    candidates: usize,
    sufficient: bool,
    /// ln of the criterion: of each start, and what was reached.
    starts: &'a [f64],
    value: f64,
    /// Geometric mean of random_std_error / std_error over `gain_over`.
    gain: Option<f64>,
    gain_over: Vec<&'a str>,
    rank: usize,
    condition_number: f64,
    observability: Observability,
    parameters: Vec<PlannedEntry<'a>>,
    unidentified: Vec<Unidentified<'a>>,
    /// How well it tells two effects apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    separation: Option<separation::Entry<'a>>,
}

/// A parameter after planned poses, and after random ones.
#[derive(Debug, Serialize)]
struct PlannedEntry<'a> {
    #[serde(flatten)]
    planned: ExpectedEntry<'a>,
    random_std_error: Option<f64>,
}

/// A plan as JSON text; `separated` where it tells two effects apart.
pub fn plan_json(
    problem: &Problem,
    criterion: &Criterion,
    seed: u64,
    plan: &Plan,
    separated: Option<&Separated>,
) -> String {
    let (planned, meaningful) = (&plan.planned, plan.meaningful());
    let name = |k: usize| planned.expected[k].name.as_str();
    let parameters = planned.expected.iter().enumerate();
    let entry = |(k, own)| PlannedEntry { planned: ExpectedEntry::of(own), random_std_error: plan.random_error(k) };
    let document = Document {
        problem: &problem.name,
        criterion: criterion.as_str(),
        seed,
        poses: plan.poses.len(),
        given: planned.poses - plan.poses.len(),
        candidates: plan.candidates,
        sufficient: plan.suffices,
        starts: &plan.starts,
        value: plan.value,
        gain: plan.gain(&meaningful),
        gain_over: meaningful.iter().map(|&k| name(k)).collect(),
        rank: planned.identifiability.rank,
        condition_number: planned.identifiability.condition_number(),
        observability: Observability::of(&planned.identifiability, 3 * planned.poses),
        parameters: parameters.map(entry).collect(),
        unidentified: Unidentified::all(&planned.identifiability, name),
        separation: separated.map(separation::Entry::of),
    };
    to_text(&document)
}

/// A plan in words; `separated` where it tells two effects apart; ending in a line break.
pub fn plan_text(problem: &Problem, criterion: &Criterion, plan: &Plan, separated: Option<&Separated>) -> String {
    let planned = &plan.planned;
    let (poses, given) = (plan.poses.len(), planned.poses - plan.poses.len());
    let besides = if given > 0 { format!(" besides {given} that are measured") } else { String::new() };
    let rows = planned.expected.iter().enumerate().map(|(k, expected)| {
        let random = plan.random_error(k);
        let (mut row, unit) = cells(expected, &[expected.prior, random, expected.std_error]);
        let ratio = random.zip(expected.std_error).map(|(random, own)| random / own);
        row.push(ratio.map_or_else(|| "–".to_owned(), |ratio| number(ratio, 2)));
        row.push(unit);
        row
    });
    let header = ["parameter", "nominal", "prior ± 1 σ", "random", "planned", "gain", "unit"];
    let meaningful = plan.meaningful();
    let gain = plan.gain(&meaningful).map_or_else(String::new, |gain| {
        let (factor, than) = if gain < 1.0 { (1.0 / gain, "LARGER") } else { (gain, "smaller") };
        format!(
            "\nThe {} parameters of the arm that random poses identify to 90 % or more: standard errors {factor:.2} times {than}\n\
             than with random poses (geometric mean).\n",
            meaningful.len()
        )
    });
    let names: Vec<String> = planned.expected.iter().map(|expected| expected.name.clone()).collect();
    [
        format!(
            "{}\n{poses} poses{besides}, from {} candidates; criterion {}, best of {} starts\n\n",
            problem.title,
            plan.candidates,
            criterion.as_str(),
            plan.starts.len(),
        ),
        table(&header, rows.collect(), &[0, 6]),
        format!(
            "  planned: expected 1 σ of the estimate; random: the same after random poses, median of {} draws; gain: random / planned\n",
            plan.random.len()
        ),
        gain,
        "\n".to_owned(),
        conditioning(&planned.identifiability, names.len(), 3 * planned.poses),
        "\n".to_owned(),
        blind_text(&planned.identifiability, &names, "plan.json"),
        separated.map_or_else(String::new, |separated| format!("\n{}", separation::text(separated))),
    ]
    .concat()
}
