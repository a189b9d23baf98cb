//! Text and page of the command `plan`: the poses to measure and the accuracy that they are
//! expected to give.

use super::candidates::{at_limits, candidates_drawn};
use super::document::{Block, Table, opening};
use super::figures::{ACCENT, Drawing, Forest};
use super::forecast::{
    assumptions, cells, separation_blocks, separation_sentence, undetermined_note,
};
use super::next::command_table;
use super::parameters::{conditioning, rows_of_sheet, unidentifiable};
use super::render::Story;
use crate::design::{Criterion, PairSeparation, Plan};
use crate::problem::Problem;
use crate::quantity::format::{counted, number, or_dash};

/// Smallest ratio of the planned to the random standard error at which a text says that it is larger.
const MIN_GROWTH: f64 = 1.1;

/// States whether the planned poses determine all combinations of parameters that such poses can
/// determine.
fn sufficiency<'a>(plan: &Plan) -> Block<'a> {
    let Plan { attainable_rank, least_poses, .. } = *plan;
    let (rank, poses) = (plan.planned.identifiability.rank, plan.poses.len());
    let at_least = if least_poses > poses {
        format!(
            "it takes {} at least, and a few more to judge them by",
            counted(least_poses, "pose")
        )
    } else {
        "more poses may determine more".to_owned()
    };
    let parameters = counted(plan.planned.expected.len(), "parameter");
    if rank >= attainable_rank {
        return Block::Text(format!(
            "More such poses would determine no further combination of parameters: these \
             determine {rank} of {}. That does not \
             say that the errors are small enough: flexcal check says how many poses that takes.",
            plan.planned.expected.len()
        ));
    }
    Block::Text(format!(
        "Too few poses: they determine {rank} of the {attainable_rank} combinations of the {parameters} that such poses can determine; \
         {at_least}. The other combinations rest on priors, if there are any."
    ))
}

/// Returns the plan, with a figure of the gain over random poses; `separated` is given if the plan is
/// to distinguish two effects.
pub fn plan(
    problem: &Problem,
    criterion: &Criterion,
    plan: &Plan,
    separated: Option<&PairSeparation>,
) -> Story {
    let planned = &plan.planned;
    let (poses, given) = (plan.poses.len(), plan.given);
    let besides = match plan.held_out {
        0 if given == 0 => String::new(),
        0 => format!(" besides {given} that are measured"),
        held_out => format!(
            " besides {given} measured ones that are fitted ({held_out} others are held out)"
        ),
    };
    let rows = planned.expected.iter().enumerate().map(|(k, expected)| {
        let random = plan.random_error(k);
        let (mut row, unit) = cells(expected, &[expected.prior, random, expected.std_error]);
        row.push(or_dash(random.zip(expected.std_error), |(random, planned)| {
            number(random / planned, 2)
        }));
        row.push(unit);
        row
    });
    let header = ["parameter", "nominal", "prior ± 1 σ", "random", "planned", "gain", "unit"];
    let note = format!(
        "planned: expected standard error (1 σ) of the nominal arm (that of flexcal check is a \
         root mean square over arms drawn from the priors); random: the same after random poses, \
         median of {} draws; gain: random / planned",
        plan.random.len()
    );
    let meaningful = plan.meaningful();
    let gain = plan.gain(&meaningful).map(|gain| {
        let (factor, than) = if gain < 1.0 { (1.0 / gain, "LARGER") } else { (gain, "smaller") };
        Block::Text(format!(
            "These poses make the standard errors {factor:.2} times {than} than random poses do (geometric mean of the {} parameters \
             of the arm that random poses identify well).{}",
            meaningful.len(),
            worse_than_random(plan)
        ))
    });
    let names: Vec<String> =
        planned.expected.iter().map(|expected| expected.name.clone()).collect();
    let counts = format!(
        "{}{besides}, from {}; criterion {}, best of {}",
        counted(poses, "pose"),
        candidates_drawn(plan.candidates, plan.drawn, false),
        criterion_words(criterion),
        counted(plan.starts.len(), "start"),
    );
    let mut blocks = opening(&problem.title, counts).to_vec();
    blocks.extend(separated.and_then(separation_sentence).map(Block::Text));
    blocks.push(sufficiency(plan));
    blocks.extend(gain);
    blocks.extend(at_limits(problem, &plan.poses, "plan").map(Block::Text));
    let undetermined = undetermined_note(&planned.expected).map(str::to_owned);
    let notes = [Some(note), undetermined, rows_of_sheet(problem)].into_iter().flatten().collect();
    blocks.push(Block::Table(Table { notes, ..Table::new(&header, rows.collect(), &[0, 6]) }));
    blocks.push(Block::figures([draw_gains(plan)]));
    blocks.push(Block::Page(vec![conditioning(
        &planned.identifiability,
        names.len(),
        plan.coordinates,
    )]));
    blocks.push(unidentifiable(&planned.identifiability, &names, ("plan.json", None)));
    // Rows of a camera's table are points, not poses.
    let fitted = (!plan.is_of_cameras || given == 0).then_some(poses + given);
    let at_hand = given + plan.held_out;
    blocks.extend(assumptions(problem, &planned.expected, (fitted, at_hand)));
    blocks.extend(separated.map(separation_blocks).unwrap_or_default());
    blocks.push(Block::Page(vec![
        Block::heading("The planned poses"),
        Block::Table(command_table(problem, &plan.poses)),
    ]));
    Story::new(&problem.title, "plan", blocks)
}

/// Names the parameter whose standard error grows most against random poses, with the number of
/// those that grow; empty if none grows noticeably.
fn worse_than_random(plan: &Plan) -> String {
    let expected = plan.planned.expected.iter().enumerate();
    let grown = expected.filter_map(|(k, expected)| {
        let ratio = expected.std_error? / plan.random_error(k)?;
        (ratio > MIN_GROWTH && ratio.is_finite()).then_some((ratio, &expected.name))
    });
    let grown: Vec<(f64, &String)> = grown.collect();
    let (count, of) = (grown.len(), counted(plan.planned.expected.len(), "parameter"));
    match grown.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((ratio, name)) if count == 1 => format!(
            " Of all {of}, {name} alone has a standard error that is more than {MIN_GROWTH} times \
             larger ({ratio:.2} times)."
        ),
        Some((ratio, name)) => format!(
            " {count} of all {of} have standard errors that are more than {MIN_GROWTH} times \
             larger, the most {name} ({ratio:.1} times)."
        ),
        None => String::new(),
    }
}

/// Returns the letter of a criterion with the quantity that it minimises.
fn criterion_words(criterion: &Criterion) -> &'static str {
    match criterion {
        Criterion::D => "D (volume of the confidence ellipsoid)",
        Criterion::S => "S (geometric mean of the standard errors)",
        Criterion::A => "A (mean relative variance)",
        Criterion::E => "E (largest relative variance of a combination)",
        Criterion::I => "I (mean variance of predictions)",
        Criterion::Each(_) => {
            "S (geometric mean of the standard errors) of the parameters of both effects"
        }
        Criterion::Subset(_) => "D of chosen parameters",
    }
}

/// Draws the gain of each parameter: its standard error after random poses divided by that after
/// the planned poses.
fn draw_gains(plan: &Plan) -> Option<Drawing> {
    let rows = plan.planned.expected.iter().enumerate().filter_map(|(k, expected)| {
        let gain = plan.random_error(k)? / expected.std_error?;
        gain.is_finite().then(|| (expected.name.clone(), vec![Some((gain, 0.0))]))
    });
    Forest {
        names: ("plan-gains", "Gain of the planned poses over random ones"),
        caption: "Standard error of each parameter after as many random poses, divided by that after the planned ones: right of 1 \
                  the plan is better."
            .to_owned(),
        label: "standard error, random / planned",
        legend: vec![("gain", ACCENT)],
        references: vec![1.0],
        rows: rows.collect(),
        is_logarithmic: false,
    }
    .drawing()
}
