//! What `plan` says and writes.

use super::document::{Block, Table};
use super::forecast::{ExpectedEntry, assumptions, cells};
use super::json::{Conditioning, Unidentified, object, to_text, unidentified};
use super::parameters::{conditioning, unidentifiable};
use super::quantity::{counted, number, or_dash};
use super::render::text;
use super::separation;
use crate::design::{Criterion, Expected, Plan, Separated};
use crate::problem::Problem;

object! {
    Document<'a>(
        problem: &'a Problem,
        criterion: &'a Criterion,
        seed: u64,
        plan: &'a Plan,
        separated: Option<&'a Separated>,
    ) {
        problem: &'a str = &problem.name,
        criterion: &'a str = criterion.as_str(),
        seed: u64 = seed,
        /// Planned.
        poses: usize = plan.poses.len(),
        /// Measured in any case.
        given: usize = plan.given,
        candidates: usize = plan.candidates,
        sufficient: bool = plan.suffices,
        /// ln of the criterion: of each start, and what was reached.
        starts: &'a [f64] = &plan.starts,
        value: f64 = plan.value,
        /// Geometric mean of random_std_error / std_error over `gain_over`.
        gain: Option<f64> = plan.gain(&plan.meaningful()),
        gain_over: Vec<&'a str> = plan.meaningful().iter().map(|&k| plan.planned.expected[k].name.as_str()).collect(),
        rank: usize = plan.planned.identifiability.rank,
        /// With all candidates.
        attainable_rank: usize = plan.attainable_rank,
        /// Poses without which that rank cannot be reached.
        least_poses: usize = plan.least_poses,
        #[serde(flatten)]
        conditioning: Conditioning<'a> = Conditioning::of(&plan.planned.identifiability, plan.coordinates),
        parameters: Vec<PlannedEntry<'a>> =
            plan.planned.expected.iter().enumerate().map(|(k, own)| PlannedEntry::of(own, plan.random_error(k))).collect(),
        unidentified: Vec<Unidentified<'a>> =
            unidentified(&plan.planned.identifiability, |k| plan.planned.expected[k].name.as_str()),
        /// How well it tells two effects apart.
        #[serde(skip_serializing_if = "Option::is_none")]
        separation: Option<separation::Entry<'a>> = separated.map(separation::Entry::of),
    }
}
object! {
    /// A parameter after planned poses, and after random ones.
    PlannedEntry<'a>(planned: &'a Expected, random: Option<f64>) {
        #[serde(flatten)]
        planned: ExpectedEntry<'a> = ExpectedEntry::of(planned),
        random_std_error: Option<f64> = random,
    }
}

/// A plan as JSON text; `separated` where it tells two effects apart.
pub fn plan_json(
    problem: &Problem,
    criterion: &Criterion,
    seed: u64,
    plan: &Plan,
    separated: Option<&Separated>,
) -> String {
    to_text(&Document::of(problem, criterion, seed, plan, separated))
}

/// That the poses are fewer than it takes to see all that such poses can; nothing to say where they are not.
fn too_few<'a>(plan: &Plan) -> Option<Block<'a>> {
    let Plan { attainable_rank, least_poses, .. } = *plan;
    let (rank, poses) = (plan.planned.identifiability.rank, plan.poses.len());
    let at_least = if least_poses > poses {
        format!("it takes {} at least, and a few more to judge them by", counted(least_poses, "pose"))
    } else {
        "more poses may see more".to_owned()
    };
    (rank < attainable_rank).then(|| {
        Block::Text(format!(
            "Too few poses: they see {rank} of the {attainable_rank} combinations of the {} that such poses can see; {at_least}. What \
             they do not see rests on priors, if on anything.",
            counted(plan.planned.expected.len(), "parameter")
        ))
    })
}

/// A plan in words; `separated` where it tells two effects apart; ending in a line break.
pub fn plan_text(problem: &Problem, criterion: &Criterion, plan: &Plan, separated: Option<&Separated>) -> String {
    let planned = &plan.planned;
    let (poses, given) = (plan.poses.len(), plan.given);
    let besides = if given > 0 { format!(" besides {given} that are measured") } else { String::new() };
    let rows = planned.expected.iter().enumerate().map(|(k, expected)| {
        let random = plan.random_error(k);
        let (mut row, unit) = cells(expected, &[expected.prior, random, expected.std_error]);
        row.push(or_dash(random.zip(expected.std_error), |(random, own)| number(random / own, 2)));
        row.push(unit);
        row
    });
    let header = ["parameter", "nominal", "prior ± 1 σ", "random", "planned", "gain", "unit"];
    let note = format!(
        "planned: expected 1 σ of the estimate; random: the same after random poses, median of {} draws; gain: random / planned",
        plan.random.len()
    );
    let meaningful = plan.meaningful();
    let gain = plan.gain(&meaningful).map(|gain| {
        let (factor, than) = if gain < 1.0 { (1.0 / gain, "LARGER") } else { (gain, "smaller") };
        Block::lines(format!(
            "The {} parameters of the arm that random poses identify to 90 % or more: standard errors {factor:.2} times {than}\n\
             than with random poses (geometric mean).",
            meaningful.len()
        ))
    });
    let names: Vec<String> = planned.expected.iter().map(|expected| expected.name.clone()).collect();
    let mut blocks = vec![Block::lines(format!(
        "{}\n{}{besides}, from {}; criterion {}, best of {}",
        problem.title,
        counted(poses, "pose"),
        counted(plan.candidates, "candidate"),
        criterion.as_str(),
        counted(plan.starts.len(), "start"),
    ))];
    blocks.extend(too_few(plan));
    blocks.push(Block::Table(Table::new(&header, rows.collect(), &[0, 6]).noted(&[&note])));
    blocks.extend(gain);
    blocks.push(conditioning(&planned.identifiability, names.len(), plan.coordinates));
    blocks.push(unidentifiable(&planned.identifiability, &names, "plan.json"));
    blocks.extend(assumptions(problem, &planned.expected, Some(poses + given)));
    blocks.extend(separated.map(separation::blocks).unwrap_or_default());
    text(&blocks)
}
