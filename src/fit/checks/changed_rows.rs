//! Check of the order of the rows: does something differ from a certain row on?
//!
//! A reflector that is put into another nest, a station or a board that is moved, or a joint that
//! loses its zero position changes one place of the model between two rows. All places and rows are
//! compared, in the order of the table and, to see whether the order counts, in others. The points
//! of an image stay together.

use std::collections::BTreeSet;

use rand::seq::SliceRandom as _;
use rayon::prelude::*;
use serde_json::json;
use statrs::distribution::{ChiSquared, ContinuousCDF as _, FisherSnedecor};

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::row_kind::listed;
use super::row_steps::{Linear, MIN_ROWS, Place, Places, Step};
use super::turned_target::turn_of_target;
use crate::fit::uncertainty::noise::Noise;
use crate::least_squares::Loss;
use crate::model::parameter::{JointField, Parameter, ParameterSite, Regressor};
use crate::problem::{JointKind, Problem};
use crate::random;

/// Smallest ratio of the noise variance that the fit assumed to the declared one, at which the
/// order of the rows is examined.
const MIN_NOISE_FACTOR: f64 = 4.0;
/// Smallest share of the misfit beyond the declared noise that a change explains.
const MIN_EXPLAINED: f64 = 0.8;
/// Largest probability of a reported change by chance (F test), times the number of tries.
const MAX_CHANCE_PROBABILITY: f64 = 1e-6;
/// Smallest factor by which the best change in any other order of the rows, or a drift over the
/// rows, must leave more cost than the change in the order of the table, for that change to be
/// reported.
const MIN_OTHER_RATIO: f64 = 2.0;
/// Largest number of rows and of unknowns for which the order is examined. The time of an order
/// grows with the product of the number of rows and the square of the number of unknowns, and, for
/// a fixed number of rows, with the cube of the number of unknowns.
const MAX_SIZE: [usize; 2] = [4000, 150];
/// Smallest probability of a residual as large as that of two arms, by noise alone. A larger
/// residual shows that the model lacks something, which two arms approximate better than one.
const MIN_NOISE_PROBABILITY: f64 = 1e-3;
/// Largest share of the misfit beyond the declared noise that two places of a target leave. A choice of
/// rows explains much of any misfit.
const MAX_LEFT_BY_TARGETS: f64 = 0.02;
/// Largest share of the changed rows on the wrong side of a limit of a column that tells them from the
/// others.
const MAX_MIXED_SHARE: f64 = 0.1;
/// Number of random orders of the rows.
const RANDOM_ORDERS: usize = 19;
/// Seed of the random orders.
const SEED: u64 = 1;

/// Checks that no place of the model is different from a certain row on.
pub(super) fn rows_stay_alike(fit: &CheckedFit) -> Option<Finding> {
    let kinds = fit.kinds();
    let positions = kinds.iter().all(|kind| kind.observation.is_position());
    let images = kinds.iter().all(|kind| kind.observation.point().is_some());
    let is_asked = fit.noise == Noise::Declared
        && fit.noise_factor >= MIN_NOISE_FACTOR
        && fit.has_further_fits
        && fit.fitting.loss == Loss::Squares
        && fit.fitting.earlier.is_none();
    if !(positions || images) || !is_asked {
        return None;
    }
    changed(fit, images)
}

impl Place {
    /// Returns the place to which a parameter belongs; `None` for other parameters of the arm.
    fn of(parameter: &Parameter, fit: &CheckedFit) -> Option<Self> {
        match parameter.site {
            ParameterSite::Target { target, .. } => Some(Self::Target(target)),
            ParameterSite::Base { base, .. } => Some(Self::Base(base)),
            ParameterSite::Fixture { fixture, kind, axis } if kind.has_pose() && axis < 6 => {
                Some(Self::Fixture(fixture))
            }
            ParameterSite::Joint { joint, field }
                if matches!(parameter.regressor, Regressor::Constant | Regressor::Unit)
                    && Some(field) == zero_field(fit.problem, joint) =>
            {
                Some(Self::Zero(joint))
            }
            _ => None,
        }
    }
}

/// Returns the field of a joint that holds its zero position; `None` for a joint without commands.
fn zero_field(problem: &Problem, joint: usize) -> Option<JointField> {
    match problem.joints.get(joint)?.command_kind() {
        JointKind::Revolute => Some(JointField::Theta),
        JointKind::Prismatic => Some(JointField::D),
        JointKind::Fixed => None,
    }
}

/// Returns the finding on a change from a row on; `None` if no change explains most of the misfit.
/// In `images`, a change begins with an image, and that of the whole arm is not tried.
fn changed(fit: &CheckedFit, images: bool) -> Option<Finding> {
    let stage = fit.whole;
    let rows = fit.rows();
    let unknowns: Vec<&Parameter> = stage.parameters().collect();
    if rows.len() > MAX_SIZE[0] || unknowns.len() > MAX_SIZE[1] || rows.len() < 2 * MIN_ROWS {
        return None;
    }
    let mut places: Places = Places::new();
    for (column, parameter) in unknowns.iter().enumerate() {
        if let Some(place) = Place::of(parameter, fit) {
            places.entry(place).or_default().push(column);
        }
    }
    if !images {
        places.insert(Place::Arm, (0..unknowns.len()).collect());
    }
    let linear = Linear::of(fit)?;
    let mut order: Vec<usize> = (0..rows.len()).collect();
    order.sort_by_key(|&place| rows[place]);
    let groups = groups(fit, &order, images);
    let of_place = linear.best_of_places(&places, &order, &begins(&groups));
    let of_arm = (!images).then(|| linear.best_of_arm_refined(&order)).flatten();
    let of_arm = of_arm.filter(|step| is_noise(&linear, step));
    let step = linear.better(of_place, of_arm)?;
    if is_shown(fit, (&linear, &places), (&order, &groups), &step) {
        return finding(fit, &linear, &places, &[of_order(fit, &order, step)]);
    }
    if images {
        return None;
    }
    places.remove(&Place::Arm);
    two_changes(fit, (&linear, &places), (&order, &groups))
        .or_else(|| mixed_targets(fit, &linear, &places))
}

/// Returns true if a change explains most of the misfit, if chance does not explain that, and if only
/// the order of the table shows it.
fn is_shown(
    fit: &CheckedFit,
    (linear, places): (&Linear, &Places),
    (order, groups): (&[usize], &[Vec<usize>]),
    step: &Step,
) -> bool {
    let tries = (places.len() * order.len()) as f64;
    is_beyond_chance(linear, step, tries)
        && !is_explained_otherwise(fit, (linear, places), (order, groups), step)
}

/// Returns true if a change that was chosen from `tries` explains most of the misfit, and if chance
/// does not explain that.
fn is_beyond_chance(linear: &Linear, step: &Step, tries: f64) -> bool {
    let freedom = freedom_of(linear, step);
    let noise = freedom.min(linear.cost);
    let explained = (linear.cost - step.cost) / (linear.cost - noise).max(f64::MIN_POSITIVE);
    let ratio = (linear.cost - step.cost) / step.columns as f64 / (step.cost / freedom);
    let chance = FisherSnedecor::new(step.columns as f64, freedom).map(|of| of.sf(ratio));
    explained >= MIN_EXPLAINED
        && chance.is_ok_and(|chance| chance * tries <= MAX_CHANCE_PROBABILITY)
}

/// Returns the finding on two places that change, or one that changes twice, each from a row on; `None`
/// if one of the two changes is not shown beside the other.
fn two_changes(
    fit: &CheckedFit,
    (linear, places): (&Linear, &Places),
    (order, groups): (&[usize], &[Vec<usize>]),
) -> Option<Finding> {
    let beside = |step: &Step| linear.with_change(&places[&step.place], &order[step.first..]);
    let may_begin = begins(groups);
    let best = |of: &Linear| of.best_of_places(places, order, &may_begin);
    let second = best(&beside(&best(linear)?)?)?;
    let first = best(&beside(&second)?)?;
    let second = best(&beside(&first)?)?;
    let mut steps = [first, second];
    let are_shown = (0..2).all(|k| {
        let beside = beside(&steps[1 - k]);
        beside.is_some_and(|of| is_shown(fit, (&of, places), (order, groups), &steps[k]))
    });
    if !are_shown {
        return None;
    }
    steps.sort_by_key(|step| step.first);
    let [first, second] = &mut steps;
    if first.place == second.place {
        // Few rows between two changes are rows that are wrong.
        if second.first - first.first < MIN_ROWS {
            return None;
        }
        // Each is stated from what was before both.
        second.change += &first.change;
    }
    finding(fit, linear, places, &steps.map(|step| of_order(fit, order, step)))
}

/// Returns a change with the words for its rows, from a row of the order on, and the first of them.
fn of_order(fit: &CheckedFit, order: &[usize], step: Step) -> (String, String, Step) {
    let row = fit.rows()[order[step.first]];
    let location = fit.table().location(row).to_string();
    let rows = format!("from {location} on ({} of {} rows)", order.len() - step.first, order.len());
    (rows, location, step)
}

/// Returns the finding on rows in which a target sits elsewhere, in any order; `None` if these rows
/// are not told apart clearly.
fn mixed_targets(fit: &CheckedFit, linear: &Linear, places: &Places) -> Option<Finding> {
    let is_target = |place: &Place| matches!(place, Place::Target(_));
    places.iter().filter(|(place, _)| is_target(place)).find_map(|(&place, columns)| {
        let (rows, change, cost) = linear.two_values(columns)?;
        let step = Step { place, first: 0, cost, change, columns: columns.len() };
        // Chance chooses from all divisions of the rows.
        let tries = 2_f64.powi(i32::try_from(fit.rows().len()).ok()?);
        let left = (step.cost - freedom_of(linear, &step)).max(0.0);
        let is_clear = left <= MAX_LEFT_BY_TARGETS * (linear.cost - linear.freedom);
        let is_sure = is_clear && is_beyond_chance(linear, &step, tries);
        if !is_sure || is_told_by_column(fit, &rows) {
            return None;
        }
        let identification = fit.rows();
        let location = |&row: &usize| fit.table().location(identification[row]);
        let shown: Vec<String> = rows.iter().map(|row| location(row).to_string()).collect();
        let place =
            format!("in {} ({} of {} rows)", listed(&shown), rows.len(), identification.len());
        finding(fit, linear, places, &[(place, shown[0].clone(), step)])
    })
}

/// Returns true if a column of the table tells nearly all of these rows from the others by a limit of
/// its values.
fn is_told_by_column(fit: &CheckedFit, rows: &[usize]) -> bool {
    let count = fit.rows().len();
    let order: Vec<usize> = (0..count).collect();
    let tells = |values: Vec<f64>| {
        let mut sorted = order.clone();
        sorted.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        // The number of rows on the side that each limit gives them, of either sense.
        let mut right = rows.len();
        sorted.iter().any(|row| {
            right = if rows.contains(row) { right - 1 } else { right + 1 };
            let least = right.min(count - right) as f64;
            least <= MAX_MIXED_SHARE * rows.len() as f64
        })
    };
    other_columns(fit, &order).into_iter().any(tells)
}

/// Returns the rows of an order in groups between which a change may begin: each image, or each row
/// of other tables.
fn groups(fit: &CheckedFit, order: &[usize], images: bool) -> Vec<Vec<usize>> {
    let numbers = fit.table().arm_pose_numbers(fit.problem);
    let pose = |place: usize| numbers[fit.rows()[place]];
    let together = |a: &usize, b: &usize| images && pose(*a) == pose(*b);
    order.chunk_by(together).map(<[usize]>::to_vec).collect()
}

/// Returns a function that is true at the first row of a group, with [`MIN_ROWS`] groups on both
/// sides.
fn begins(groups: &[Vec<usize>]) -> impl Fn(usize) -> bool + use<> {
    let mut first = 0;
    let mut firsts = BTreeSet::new();
    for (number, group) in groups.iter().enumerate() {
        if number >= MIN_ROWS && groups.len() - number >= MIN_ROWS {
            firsts.insert(first);
        }
        first += group.len();
    }
    move |row| firsts.contains(&row)
}

/// Returns true if the residual with a change is not larger than that of the declared noise (χ²
/// test), so that the rows before and after fit by themselves.
fn is_noise(linear: &Linear, step: &Step) -> bool {
    ChiSquared::new(freedom_of(linear, step))
        .is_ok_and(|squares| squares.sf(step.cost) >= MIN_NOISE_PROBABILITY)
}

/// Returns the number of measured coordinates beyond the unknowns and the changes of some of them.
fn freedom_of(linear: &Linear, step: &Step) -> f64 {
    (linear.freedom - step.columns as f64).max(1.0)
}

/// Returns the columns by whose values the rows are sorted into other orders: joints, their
/// directions of approach, payload, hoist force, temperature, covariates, and the place of the
/// target in the frame of the base. The place is predicted, so that a moved instrument does not
/// change it.
fn other_columns(fit: &CheckedFit, order: &[usize]) -> Vec<Vec<f64>> {
    let table = fit.table();
    let rows: Vec<usize> = order.iter().map(|&place| fit.rows()[place]).collect();
    let in_rows = |value: &dyn Fn(usize) -> f64| rows.iter().map(|&row| value(row)).collect();
    let joints = table.joints;
    let mut columns: Vec<Vec<f64>> =
        (0..joints).map(|joint| in_rows(&|row| table.configuration(row)[joint])).collect();
    if let Some(approach) = &table.approach {
        columns.extend((0..joints).map(|joint| in_rows(&|row| approach[row * joints + joint])));
    }
    let optional = [&table.payload, &table.hoist, &table.temperature].into_iter().flatten();
    columns.extend(optional.map(|of| in_rows(&|row| of[row])));
    let covariates = rows.first().map_or(0, |&row| table.covariates_of(row).len());
    columns.extend((0..covariates).map(|k| in_rows(&|row| table.covariates_of(row)[k])));
    let targets =
        fit.model().predicted_targets_in_base(&fit.fitting.poses(&rows), fit.end.x.as_slice());
    let along =
        |axis: usize| targets.iter().map(move |at| at.map_or(f64::NAN, |at| at[axis])).collect();
    columns.extend((0..3).map(along));
    columns
}

/// Returns true if a change in another order of the rows, or a drift, explains the residual about
/// as well as a step: the order of the table is then not what counts.
fn is_explained_otherwise(
    fit: &CheckedFit,
    (linear, places): (&Linear, &Places),
    (order, groups): (&[usize], &[Vec<usize>]),
    step: &Step,
) -> bool {
    let most = MIN_OTHER_RATIO * step.cost;
    let columns = other_columns(fit, order);
    let explains = |other: &[usize], may_begin: &dyn Fn(usize) -> bool| {
        let of_place = linear.best_of_places(places, other, may_begin);
        if !places.contains_key(&Place::Arm) {
            return of_place.is_some_and(|found| found.cost < most);
        }
        let mut firsts = linear.arm_rows(other.len(), may_begin);
        // A sorted order may be that of the table, or the reverse.
        let ends = firsts.first().copied().zip(firsts.last().copied());
        let alike = [step.first, other.len() - step.first];
        let is_between =
            |first: &usize| ends.is_some_and(|(a, b)| (a..=b).contains(first)) && may_begin(*first);
        firsts.extend(alike.into_iter().filter(is_between));
        firsts.sort_unstable();
        let found = linear.better(of_place, linear.best_of_arm(other, &firsts));
        found.is_some_and(|found| found.cost < most)
    };
    let is_other_order = |values: &Vec<f64>| {
        let mut sorted: Vec<usize> = (0..order.len()).collect();
        sorted.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
        let is_new = |first: usize| values[sorted[first]] > values[sorted[first - 1]];
        let poses: Vec<usize> = sorted.iter().map(|&place| order[place]).collect();
        explains(&poses, &is_new)
    };
    // A drift whose cost cannot be computed might explain as much.
    let drifts = |columns: &Vec<usize>| {
        linear.cost_of_drift(step.place, columns, order).is_none_or(|cost| cost < most)
    };
    let is_by_chance = |number: usize| {
        let mut shuffled = groups.to_vec();
        shuffled.shuffle(&mut random::stream(SEED, number as u64));
        explains(&shuffled.concat(), &begins(&shuffled))
    };
    places.get(&step.place).is_some_and(drifts)
        || columns.par_iter().any(is_other_order)
        || (0..RANDOM_ORDERS).into_par_iter().any(is_by_chance)
}

/// Returns the finding on changes that explain most of the misfit together, each with the words for its
/// rows and its first row.
fn finding(
    fit: &CheckedFit,
    linear: &Linear,
    places: &Places,
    changes: &[(String, String, Step)],
) -> Option<Finding> {
    let (_, location, first) = changes.first()?;
    let (mut texts, mut remedies) = (Vec::new(), Vec::new());
    for (rows, _, step) in changes {
        let (what, remedy) = described(fit, &places[&step.place], step);
        texts.push(format!("{rows} {what}"));
        if !remedies.contains(&remedy) {
            remedies.push(remedy);
        }
    }
    let (cost, columns) = changes.iter().fold((f64::INFINITY, 0), |(cost, columns), of| {
        (cost.min(of.2.cost), columns + of.2.columns)
    });
    let freedom = (linear.freedom - columns as f64).max(1.0);
    let before = (linear.cost / linear.freedom).sqrt();
    let after = (cost / freedom).sqrt();
    let text = format!(
        "{}: as linearised, that leaves {after:.1} times the declared σ instead of {before:.1}",
        texts.join("; ")
    );
    let name = match first.place {
        Place::Target(_) => "target",
        Place::Base(_) => "base",
        Place::Fixture(_) => "fixture",
        Place::Zero(_) => "zero",
        Place::Arm => "arm",
    };
    let numbers = [json!(location), json!(name), before.into(), after.into()];
    Some(Finding::new(FindingCode::RowsChanged, numbers, text).with_remedy(remedies.join("; ")))
}

/// Describes the change of a place, with the remedy for it.
fn described(fit: &CheckedFit, columns: &[usize], step: &Step) -> (String, String) {
    let parameters: Vec<&Parameter> = fit.whole.parameters().collect();
    let length = |from: usize| {
        let squares = columns.iter().zip(step.change.iter()).filter(|(column, _)| match parameters
            [**column]
            .site
        {
            ParameterSite::Target { axis, .. }
            | ParameterSite::Base { axis, .. }
            | ParameterSite::Fixture { axis, .. } => axis / 3 == from,
            _ => false,
        });
        squares.map(|(_, change)| change * change).sum::<f64>().sqrt()
    };
    match step.place {
        Place::Target(target) => (
            format!(
                "the target sits {:.1} mm elsewhere in its frame{}",
                1e3 * length(0),
                turn_of_target(fit, target, (columns, step)).unwrap_or_default()
            ),
            "if the reflector was put into another nest, or the tool was changed, give these \
             rows another word in a column target"
                .to_owned(),
        ),
        Place::Fixture(index) => {
            let fixture = fit.problem.fixtures.get(index);
            let (kind, name) =
                fixture.map_or(("marker", ""), |of| (of.kind.word(), of.name.as_str()));
            let by = format!("{:.1} mm and {:.2}°", 1e3 * length(0), length(1).to_degrees());
            (
                format!("{kind} {name} stands elsewhere, by {by}"),
                format!(
                    "if it was put down or mounted again, declare a second [[{kind}]] and give \
                     these rows its name in the column {kind}"
                ),
            )
        }
        Place::Base(_) => (
            format!(
                "the base stands elsewhere, by {:.1} mm and {:.2}°",
                1e3 * length(0),
                length(1).to_degrees()
            ),
            "if the instrument or the arm was moved, give these rows another word in a column \
             session"
                .to_owned(),
        ),
        Place::Zero(joint) => {
            let change = step.change.iter().sum::<f64>();
            let by = match zero_field(fit.problem, joint) {
                Some(JointField::D) => format!("{:.2} mm", 1e3 * change),
                _ => format!("{:.3}°", change.to_degrees()),
            };
            (
                format!("the zero position of joint {} is off by {by}", joint + 1),
                "if the joint lost its zero position there (a slipped belt, a new reference \
                 run), fit the rows before and after by themselves"
                    .to_owned(),
            )
        }
        Place::Arm => (
            "the arm or its set-up seems to be another one".to_owned(),
            "the rows before and after fit by themselves, but not together: check whether they \
             are of one arm, one set-up and one scale of the instrument, and fit them by themselves"
                .to_owned(),
        ),
    }
}
