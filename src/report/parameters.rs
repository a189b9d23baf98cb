//! The table of parameters, and what the data cannot tell.

use std::collections::BTreeMap;

use super::document::{Bar, Block, Table, first_of};
use super::effect::{MOST_LISTED, SHOWN_WAVES};
use super::quantity::{decimals, number, or_dash, two_digits};
use crate::fit::{Estimate, Identification, PriorSize};
use crate::least_squares::solver::AtBound;
use crate::least_squares::{Identifiability, UnidentifiableCombination, WEAK_THRESHOLD};
use crate::model::effect;
use crate::model::parameter::Regressor;
use crate::problem::Problem;
use crate::quantity::Unit;

/// Decimals of a value that has no error.
const PLAIN: usize = 4;
/// Decimals of any value at most.
const MOST: usize = 6;
/// Weights in an unidentifiable combination that are worth naming.
const NAMED: f64 = 0.02;
/// Terms of an unidentifiable combination that are named, the largest.
const MOST_NAMED: usize = 8;
/// Unidentifiable combinations and correlations that fit on a screen.
const SHOWN: usize = 12;
/// Columns of the table of parameters.
const HEADER: [&str; 7] =
    ["parameter", "nominal", "estimate", "change", "± 1 σ", "unit", "identified"];

/// A row of the table with its bar.
type Line = (Vec<String>, Bar);

/// Joint, from 1, and order of every coefficient of a harmonic that `problem` declares, by the
/// parameter's name.
fn harmonics(problem: &Problem) -> BTreeMap<String, (usize, u32)> {
    let of = |regressor: &Regressor| match *regressor {
        Regressor::Sine(joint, order) | Regressor::Cosine(joint, order) => Some((joint + 1, order)),
        _ => None,
    };
    effect::parameters(problem)
        .into_iter()
        .filter_map(|own| Some((own.name, of(&own.regressor)?)))
        .collect()
}

/// The harmonics of joints that have more coefficients than are listed one by one: for each of
/// these joints the orders that are shown, the highest waves, and how many lower ones there are.
fn highest(
    estimates: &[Estimate],
    harmonics: &BTreeMap<String, (usize, u32)>,
) -> BTreeMap<usize, (Vec<u32>, usize)> {
    let mut joints: BTreeMap<usize, (usize, BTreeMap<u32, f64>)> = BTreeMap::new();
    for estimate in estimates {
        if let Some((joint, order)) = harmonics.get(&estimate.name) {
            let (count, heights) = joints.entry(*joint).or_default();
            *count += 1;
            *heights.entry(*order).or_default() += estimate.estimate * estimate.estimate;
        }
    }
    joints.retain(|_, (count, _)| *count > MOST_LISTED);
    let shown = |(joint, (_, heights)): (usize, (usize, BTreeMap<u32, f64>))| {
        let mut orders: Vec<u32> = heights.keys().copied().collect();
        orders.sort_by(|a, b| heights[b].total_cmp(&heights[a]));
        orders.truncate(SHOWN_WAVES);
        (joint, (orders, heights.len().saturating_sub(SHOWN_WAVES)))
    };
    joints.into_iter().map(shown).collect()
}

/// Nominal, estimate, change and standard error of every free parameter; of many waves of a joint
/// the highest. The others are in `file`, and folded on the page.
pub(super) fn parameters<'a>(
    problem: &Problem,
    found: &Identification,
    file: &str,
) -> Vec<Block<'a>> {
    let harmonics = harmonics(problem);
    let high = highest(&found.estimates, &harmonics);
    let (mut shown, mut lower): (Vec<Line>, Vec<Line>) = Default::default();
    for (k, estimate) in found.estimates.iter().enumerate() {
        let wave = harmonics
            .get(&estimate.name)
            .and_then(|(joint, order)| Some((joint, order, high.get(joint)?)));
        let own = (row(estimate), bar(estimate));
        match wave {
            Some((_, order, (orders, _))) if !orders.contains(order) => lower.push(own),
            _ => shown.push(own),
        }
        let Some((joint, _, (_, more))) = wave else { continue };
        let later = &found.estimates[k + 1..];
        if *more > 0
            && !later
                .iter()
                .any(|other| harmonics.get(&other.name).is_some_and(|(own, _)| own == joint))
        {
            let mut cells = vec![String::new(); HEADER.len()];
            cells[0] = format!("and {more} lower harmonics of joint {joint}");
            shown.push((cells, Bar::default()));
        }
    }
    let table = |rows: Vec<Line>| {
        let (rows, bars) = rows.into_iter().unzip();
        Table {
            minor: vec![1, 3, 6],
            bars: Some(("change / σ", bars)),
            ..Table::new(&HEADER, rows, &[0, 5, 6])
        }
    };
    let count = lower.len();
    let mut notes: Vec<String> =
        (count > 0).then(|| format!("lower harmonics: in {file}")).into_iter().collect();
    if found.estimates.iter().any(|estimate| estimate.std_error.is_none()) {
        notes.push(
            "–: no standard error: the data do not identify it, or only in a combination with others, a bound holds it, or \
             it was not fitted"
                .to_owned(),
        );
    }
    notes.push(
        "identified: by how much surer it is than its own prior, from data or priors of what goes with it; the rest is prior, \
         bound, or choice within unidentifiable combinations"
            .to_owned(),
    );
    notes.extend(sizes(&found.prior_sizes));
    let mut blocks = vec![Block::Table(Table { notes, ..table(shown) })];
    if count > 0 {
        let on_paper = format!("The lower harmonics are left out on paper: they are in {file}.");
        let folded = vec![Block::Table(table(lower))];
        blocks.push(Block::Folded(
            format!("The lower harmonics: {count} coefficients"),
            folded,
            on_paper,
        ));
    }
    blocks
}

/// What rules of priors the deviations found speak for, where they contradict those declared.
fn sizes(sizes: &[PriorSize]) -> Option<String> {
    let rule = |own: &PriorSize| {
        let unit = own.unit.display(own.declared);
        let [found, declared] =
            [own.found, own.declared].map(|sigma| two_digits(sigma * unit.factor, MOST));
        format!("{} {found} {} instead of {declared}", own.pattern, unit.symbol)
    };
    let rules: Vec<String> = sizes.iter().map(rule).collect();
    (!rules.is_empty()).then(|| {
        format!(
            "priors: the deviations found speak for other sizes, 1 σ of all parameters of a kind: {}; a prior of the right size \
             may predict better where poses are few",
            rules.join(", ")
        )
    })
}

/// What Markdown says below the table where waves are left out.
pub(super) fn lower_waves<'a>(
    problem: &Problem,
    found: &Identification,
    file: &str,
) -> Option<Block<'a>> {
    let some = highest(&found.estimates, &harmonics(problem)).values().any(|(_, more)| *more > 0);
    some.then(|| Block::Words(vec![Block::Text(format!("Lower harmonics: in {file}."))]))
}

fn row(estimate: &Estimate) -> Vec<String> {
    let unit = estimate.unit.display(estimate.nominal);
    let error = estimate.std_error.map(|error| error * unit.factor);
    let digits = error.map_or(PLAIN, |error| decimals(error, MOST));
    let show = |value: f64| number(value * unit.factor, digits);
    vec![
        estimate.name.clone(),
        number(estimate.nominal * unit.factor, digits.min(PLAIN)),
        show(estimate.estimate),
        show(estimate.estimate - estimate.nominal),
        or_dash(error, |error| number(error, digits)),
        unit.symbol,
        verdict(estimate),
    ]
}

/// The change in standard errors.
fn bar(estimate: &Estimate) -> Bar {
    let error = estimate.std_error.filter(|error| *error > 0.0);
    Bar {
        change: error.map(|error| (estimate.estimate - estimate.nominal) / error),
        bound: estimate.at_bound.map(|bound| if bound == AtBound::Lower { 0.0 } else { 1.0 }),
    }
}

/// How well a parameter is identified, in a word and a share.
fn verdict(estimate: &Estimate) -> String {
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

/// Whether the standard error is larger than any calibration would accept: 1°, 10 mm, or half the
/// value of a stiffness.
fn is_vague(estimate: &Estimate) -> bool {
    let limit = match estimate.unit {
        Unit::Angle => 1.0_f64.to_radians(),
        Unit::Length => 0.01,
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => {
            0.5 * estimate.estimate
        }
        _ => f64::INFINITY,
    };
    estimate.std_error.is_none_or(|error| error > limit)
}

/// The combinations that no measurement sees; `file` holds them all.
pub(super) fn unidentifiable<'a>(
    found: &Identifiability,
    unknowns: &[String],
    file: &str,
) -> Block<'a> {
    let unidentifiable = &found.unidentifiable;
    if unidentifiable.is_empty() {
        return Block::lines("Every combination of the parameters is identifiable there.");
    }
    let is = if unidentifiable.len() == 1 { "is" } else { "are" };
    let words = format!(
        "{} of {} combinations of parameters {is} not identifiable there (they can change together in these\n\
         proportions, each scaled by its effect, and no predicted position moves):",
        unidentifiable.len(),
        unknowns.len()
    );
    let mut points =
        first_of(unidentifiable.iter().map(|own| combination_words(own, unknowns)), SHOWN, file);
    points.extend(without_tracker(unidentifiable, unknowns).into_iter().map(str::to_owned));
    Block::Lines(words, points)
}

/// What contacts and distances leave open for want of a reference, in words.
fn without_tracker(
    unidentifiable: &[UnidentifiableCombination],
    unknowns: &[String],
) -> Vec<&'static str> {
    let of = |name: &str, words: &[&str]| words.iter().any(|word| name.starts_with(word));
    let is_around = |name: &str| of(name, &["point", "anchor", "surface"]);
    let field = |name: &'_ str| name.rsplit('.').next().unwrap_or_default().to_owned();
    let is_length = |name: &str| {
        let geometry = name.starts_with("joint") && ["a", "d"].contains(&&*field(name));
        geometry
            || of(name, &["tool"])
            || (is_around(name) && !["rx", "ry"].contains(&&*field(name)))
    };
    let holds = |own: &UnidentifiableCombination, is: &dyn Fn(&str) -> bool| {
        own.weights.iter().any(|&(k, _)| is(&unknowns[k]))
    };
    let all = |own: &UnidentifiableCombination, is: &dyn Fn(&str) -> bool| {
        own.weights.iter().all(|&(k, _)| is(&unknowns[k]))
    };
    let place = |own: &UnidentifiableCombination| {
        holds(own, &|name| name.starts_with("base"))
            && all(own, &|name| name.starts_with("base") || is_around(name))
    };
    // What only shifts everything moves points along one axis; a scale moves them along all three.
    let size = |own: &UnidentifiableCombination| {
        let along = |axis: &str| holds(own, &|name| is_around(name) && field(name) == axis);
        all(own, &is_length)
            && ["x", "y", "z"].into_iter().all(along)
            && holds(own, &|name| name.starts_with("joint"))
    };
    let mut words = Vec::new();
    if unidentifiable.iter().any(place) {
        words.push(
            "where the base stands: nothing is measured against a place that is known in the measuring frame; hold base.* \
             (fixed = true), or declare where a point or an anchor is (at_m)",
        );
    }
    if unidentifiable.iter().any(size) {
        words.push("the scale: no length is known; declare a [[distance]], or measure one");
    }
    words
}

/// The combinations that are seen too weakly; nothing to say without any.
pub(super) fn weak<'a>(found: &Identification, file: &str) -> Option<Block<'a>> {
    let count = found.weak.len();
    let (noun, hold) =
        if count == 1 { ("combination", "is held") } else { ("combinations", "are held") };
    let words = format!(
        "{count} {noun} of parameters {hold} where the fit met {}: seen too weakly (moved by the arm's own size, 1 rad\n\
         or a factor of 100, all measured coordinates together change by less than {WEAK_THRESHOLD} σ):",
        if count == 1 { "it" } else { "them" }
    );
    let points =
        first_of(found.weak.iter().map(|own| combination_words(own, &found.unknowns)), SHOWN, file);
    (count > 0).then_some(Block::Lines(words, points))
}

/// Those that [`unidentifiable`] leaves out, on the page.
pub(super) fn more_unidentifiable<'a>(found: &Identification, file: &str) -> Option<Block<'a>> {
    let unidentifiable = found.identifiability().unidentifiable.iter().skip(SHOWN);
    let words: Vec<String> =
        unidentifiable.map(|own| combination_words(own, &found.unknowns)).collect();
    let count = words.len();
    let on_paper = format!("{count} more are left out on paper: they are in {file}.");
    (count > 0).then(|| {
        Block::Folded(format!("{count} more combinations"), vec![Block::list(words)], on_paper)
    })
}

fn combination_words(combination: &UnidentifiableCombination, unknowns: &[String]) -> String {
    let name = |k: usize| unknowns[k].as_str();
    if let [(k, _)] = combination.weights[..] {
        return format!("{} alone", name(k));
    }
    let mut named: Vec<&(usize, f64)> =
        combination.weights.iter().filter(|(_, weight)| weight.abs() > NAMED).collect();
    // Equal weights differ by rounding from machine to machine: sort by what is shown.
    let shown = |weight: f64| (weight.abs() * 100.0).round();
    named.sort_by(|a, b| shown(b.1).total_cmp(&shown(a.1)).then(a.0.cmp(&b.0)));
    let mut terms: Vec<String> = named
        .iter()
        .take(MOST_NAMED)
        .map(|(k, weight)| {
            format!("{} {:.2} {}", if *weight < 0.0 { '−' } else { '+' }, weight.abs(), name(*k))
        })
        .collect();
    if named.len() > MOST_NAMED {
        terms.push(format!("… and {} smaller", named.len() - MOST_NAMED));
    }
    terms.join(" ")
}

/// Pairs of parameters that go together, but for those that one unidentifiable combination ties:
/// that is told by itself.
pub(super) fn correlated(found: &Identification) -> Vec<(String, String, f64)> {
    let tied = |a: &str, b: &str| {
        let holds = |own: &UnidentifiableCombination, name: &str| {
            own.weights.iter().any(|&(k, _)| found.unknowns[k] == name)
        };
        found.identifiability().unidentifiable.iter().any(|own| holds(own, a) && holds(own, b))
    };
    found.strong_correlations().into_iter().filter(|(a, b, _)| !tied(a, b)).collect()
}

/// The same in words; `file` holds them all.
pub(super) fn correlations<'a>(found: &Identification, file: &str) -> Block<'a> {
    let pairs = correlated(found).into_iter().map(|(a, b, correlation)| {
        let sign = if correlation < 0.0 { '−' } else { '+' };
        format!("{a} and {b}: {sign}{:.3}", correlation.abs())
    });
    let points = first_of(pairs, SHOWN, file);
    let words = match points.as_slice() {
        [] => "No two other parameters are correlated by more than 0.9.",
        _ => "Correlated by more than 0.9 (their sum or difference is known better than each):",
    };
    Block::Lines(words.to_owned(), points)
}

/// Rank, condition number and observability indices, in one line.
pub(super) fn conditioning<'a>(
    found: &Identifiability,
    unknowns: usize,
    coordinates: usize,
) -> Block<'a> {
    let [o1, o2, o3, o4, o5] = found.observability(coordinates);
    Block::lines(format!(
        "At the nominal arm: rank {} of {unknowns}, condition number {:.3e}; observability O1 {o1:.3e}, O2 {o2:.3e}, O3 {o3:.3e}, O4 {o4:.3e}, O5 {o5:.3e}",
        found.rank,
        found.condition_number(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(name: &str, value: f64) -> Estimate {
        Estimate {
            name: name.to_owned(),
            unit: Unit::Angle,
            nominal: 0.0,
            estimate: value,
            std_error: None,
            identified: 1.0,
            at_bound: None,
            shadow_price: None,
            fitted: true,
        }
    }

    #[test]
    fn the_highest_of_many_waves_are_shown() {
        let waves = [(1, 4_u32), (2, 10)].into_iter().flat_map(|(joint, orders)| {
            (1..=orders).flat_map(move |order| {
                ["sin", "cos"].map(|part| (format!("{joint}.{part}{order}"), (joint, order)))
            })
        });
        let harmonics: BTreeMap<String, (usize, u32)> = waves.collect();
        let mut estimates = vec![estimate("tool.x", 1.0)];
        estimates
            .extend(harmonics.iter().map(|(name, (_, order))| estimate(name, f64::from(*order))));
        // Of joint 1 all are shown.
        let expected = BTreeMap::from([(2, (vec![10, 9, 8, 7], 6))]);
        assert_eq!(highest(&estimates, &harmonics), expected);
    }
}
