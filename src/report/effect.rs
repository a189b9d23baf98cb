//! Effects in words: values of their parameters, and compact lists of many effects.

use std::fmt::Display;

use super::document::{Point, code};
use crate::laws::ArgumentKind;
use crate::problem::{Effect, JointKind, Problem};
use crate::quantity::format::{MAX_DECIMALS, decimals, number, power_of_ten};
use crate::results::{MAX_LISTED_COEFFICIENTS, MAX_SHOWN_HARMONICS, ParameterValue, joined};

/// Standard error below which [`MAX_DECIMALS`] decimals show less than two of its digits.
const MIN_PLAIN_ERROR: f64 = 1e-5;
/// Absolute value below which a value with such a standard error is written with a power of ten.
const MAX_SMALL_VALUE: f64 = 1e-3;

/// Smallest ratio of an amplitude to its standard error at which a single harmonic is significant.
const MIN_SIGNIFICANCE: f64 = 2.0;

/// Lists the parameters of an effect with their values, one text each. Of many harmonics, only the
/// largest amplitudes are listed.
pub(super) fn values(effect: &Effect, parameters: &[ParameterValue]) -> Vec<String> {
    let line = |name: &str, parameter: &ParameterValue| format!("{name} = {}", value(parameter));
    if let (Effect::PayloadMass | Effect::BodyMass { .. }, [mass]) = (effect, parameters) {
        let than = if mass.estimate < 0.0 { "lighter" } else { "heavier" };
        let name = format!("{} − declared", mass.name);
        return vec![format!("{} ({than} than declared)", line(&name, mass))];
    }
    let orders = effect.harmonic_orders().unwrap_or_default();
    if parameters.len() <= MAX_LISTED_COEFFICIENTS || parameters.len() != 2 * orders.len() {
        return parameters.iter().map(|parameter| line(&parameter.name, parameter)).collect();
    }
    let mut waves: Vec<(u32, ParameterValue)> = orders
        .iter()
        .copied()
        .zip(parameters.chunks_exact(2).map(ParameterValue::amplitude))
        .collect();
    waves.sort_by(|(_, a), (_, b)| b.estimate.total_cmp(&a.estimate));
    let largest = waves.iter().take(MAX_SHOWN_HARMONICS).map(|(order, wave)| {
        let words = line(&format!("amplitude of order {order}"), wave);
        let is_small = wave.std_error.is_some_and(|error| wave.estimate < MIN_SIGNIFICANCE * error);
        if is_small { words + " (not significant by itself)" } else { words }
    });
    let smaller = waves.len().saturating_sub(MAX_SHOWN_HARMONICS);
    largest.chain((smaller > 0).then(|| format!("{smaller} smaller ones in loop.json"))).collect()
}

/// Removes the name of the effect from a text such as "effect[1].parameter = value". A coefficient
/// of a law is called after its term.
pub(super) fn without_effect(value: &str, effect: &Effect) -> String {
    let Some((name, _)) = value.split_once(" = ") else { return value.to_owned() };
    let parameter = name.rsplit('.').next().unwrap_or_default();
    let number: Option<usize> = parameter.parse().ok();
    let terms = if let Effect::Law(law) = effect { law.formulas() } else { Vec::new() };
    if let Some(term) = number.and_then(|number| terms.get(number.checked_sub(1)?)) {
        return value.replacen(name, &format!("coefficient of {term}"), 1);
    }
    value.replacen(name, parameter, 1)
}

/// Explains the letters in the formulas of a law that need it; `None` if it has none.
pub(super) fn legend(effect: &Effect) -> Option<String> {
    let Effect::Law(law) = effect else { return None };
    let constants =
        (!law.parameters().is_empty()).then_some("constants in SI units (angles in rad)");
    let letters = legend_of(&law.formulas().join(" "));
    let parts: Vec<String> = letters.into_iter().chain(constants.map(str::to_owned)).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Explains moments, sides of approach, time and warming in `formulas`; `None` if it has none.
pub(super) fn legend_of(formulas: &str) -> Option<String> {
    let words = formulas.split(|c: char| !c.is_ascii_alphanumeric());
    let mut explained: Vec<String> = words
        .filter_map(|word| {
            if let Some(joint) = word.strip_prefix("approach") {
                return Some(format!("{word}: side from which joint {joint} came, −1 to 1"));
            }
            match word {
                "t" => return Some("t: time since the first pose of the session [s]".to_owned()),
                "T" => return Some("T: temperature above the reference [K]".to_owned()),
                _ => {}
            }
            let joint: usize = word.strip_prefix('M')?.parse().ok()?;
            Some(format!("{word}: moment of the loads about the axis of joint {joint} [N·m]"))
        })
        .collect();
    explained.sort();
    explained.dedup();
    (!explained.is_empty()).then(|| explained.join("; "))
}

/// Sorts the texts of [`values`] so that the values largest in standard errors come first. Texts
/// that are not one for each parameter keep their order.
pub(super) fn sort_by_significance(texts: &mut Vec<String>, parameters: &[ParameterValue]) {
    if texts.len() != parameters.len() {
        return;
    }
    let sigmas = |of: &ParameterValue| of.std_error.map_or(0.0, |error| of.estimate.abs() / error);
    let mut ranked: Vec<_> = std::mem::take(texts).into_iter().zip(parameters).collect();
    ranked.sort_by(|a, b| sigmas(b.1).total_cmp(&sigmas(a.1)));
    *texts = ranked.into_iter().map(|(text, _)| text).collect();
}

/// Formats a value ± its standard error in a convenient unit: `4.12 ± 0.05 µrad/(m·K)`. A small
/// value whose error has less than two digits within [`MAX_DECIMALS`] is written with a power of
/// ten: `(9.82 ± 0.31)·10⁻⁶ °`.
fn value(parameter: &ParameterValue) -> String {
    let unit = parameter.unit.display(parameter.estimate);
    let scaled = parameter.estimate * unit.factor;
    let Some(error) = parameter.std_error.map(|error| error * unit.factor) else {
        return format!("{} {}, no standard error", number(scaled, MAX_DECIMALS), unit.symbol);
    };
    if error > 0.0 && error < MIN_PLAIN_ERROR && scaled.abs() < MAX_SMALL_VALUE {
        let power = scaled.abs().max(error).log10().floor();
        let digits = decimals(error / 10.0_f64.powf(power), MAX_DECIMALS);
        let shown = |value: f64| number(value / 10.0_f64.powf(power), digits);
        let (scaled, error, power) = (shown(scaled), shown(error), power_of_ten(power));
        return format!("({scaled} ± {error})·{power} {}", unit.symbol);
    }
    let digits = decimals(error, MAX_DECIMALS);
    // The symbol of a plain number is 1.
    let symbol = if unit.symbol == "1" { String::new() } else { format!(" {}", unit.symbol) };
    format!("{} ± {}{symbol}", number(scaled, digits), number(error, digits))
}

/// Returns true if an effect acts at a moving joint or at no joint. Lists of effects that the data
/// cannot show leave out those at fixed joints, such as the flange of a standard DH table.
pub(super) fn is_at_moving_joint(problem: &Problem, effect: &Effect) -> bool {
    let index = effect.joint().and_then(|number| number.checked_sub(1));
    index
        .and_then(|index| problem.joints.get(index))
        .is_none_or(|joint| joint.kind != JointKind::Fixed)
}

/// Groups effects by family and reason. Returns a list item for each group: the effects, then the
/// reason. Unless times were measured, row numbers stand for them.
pub(super) fn reasons<'a>(
    effects: impl IntoIterator<Item = (Effect, &'a str)>,
    time_measured: bool,
) -> Vec<Point> {
    grouped(effects, time_measured)
        .into_iter()
        .map(|(words, why)| Point::from(format!("{words}: {why}")))
        .collect()
}

/// Groups effects by family, and describes each group in one text. Unless times were measured, row
/// numbers stand for them.
pub(super) fn listed<'a>(
    effects: impl IntoIterator<Item = &'a Effect>,
    time_measured: bool,
) -> Vec<String> {
    grouped(effects.into_iter().map(|effect| (effect.clone(), ())), time_measured)
        .into_iter()
        .map(|(words, ())| words)
        .collect()
}

/// Groups effects by family and reason, and describes each group: "`backlash` at joints 1, 2, 3".
fn grouped<R: Copy + PartialEq>(
    effects: impl IntoIterator<Item = (Effect, R)>,
    time_measured: bool,
) -> Vec<(String, R)> {
    let mut groups: Vec<(Vec<Effect>, R)> = Vec::new();
    for (effect, reason) in joined(effects) {
        let alike = |(members, why): &&mut (Vec<Effect>, R)| {
            *why == reason
                && members[0].name() == effect.name()
                && members[0].harmonic_orders() == effect.harmonic_orders()
        };
        match groups.iter_mut().find(alike) {
            Some((members, _)) => members.push(effect),
            None => groups.push((vec![effect], reason)),
        }
    }
    let described =
        |(members, reason): (Vec<Effect>, R)| (describe_group(&members, time_measured), reason);
    groups.into_iter().map(described).collect()
}

/// Describes effects of one family that differ in time constants or distances by their places
/// alone.
fn describe_places(members: &[Effect]) -> String {
    let mut places: Vec<String> = Vec::new();
    for place in members
        .iter()
        .filter_map(|effect| effect.arguments().first().and_then(|(_, argument)| argument.place()))
    {
        if !places.contains(&place) {
            places.push(place);
        }
    }
    let kind = match members[0].arguments().first() {
        Some(("link", _)) => "link",
        _ => "joint",
    };
    format!(
        "{} of {kind}{} {}",
        code(members[0].name()),
        if places.len() > 1 { "s" } else { "" },
        places.join(", ")
    )
}

/// Describes effects of one family by which joints move each joint: "joint 6 by joints 1, 2".
fn describe_couplings(members: &[Effect]) -> String {
    let mut drivers: Vec<(usize, Vec<usize>)> = Vec::new();
    for (joint, from) in
        members.iter().filter_map(|effect| Some((effect.joint()?, effect.other_joint()?)))
    {
        match drivers.iter_mut().find(|(of, _)| *of == joint) {
            Some((_, others)) => others.push(from),
            None => drivers.push((joint, vec![from])),
        }
    }
    let places = drivers.iter().map(|(joint, others)| {
        let plural = if others.len() > 1 { "s" } else { "" };
        let others: Vec<String> = others.iter().map(usize::to_string).collect();
        format!("joint {joint} by joint{plural} {}", others.join(", "))
    });
    format!("{} of {}", code(members[0].name()), places.collect::<Vec<_>>().join(" and "))
}

/// Describes effects of one family: name, places, and orders or numbers of trial values.
fn describe_group(members: &[Effect], time_measured: bool) -> String {
    let name = members[0].name();
    let (times, constants) =
        if time_measured { ("times", "") } else { ("rows", ", counted in rows") };
    match (members[0].searched_value(), members.len()) {
        (Some((ArgumentKind::Time, _)), 2..) => {
            return format!("{} at {} {times}", code(name), members.len());
        }
        (_, 2..) if members[0].has_memory() => return describe_places(members),
        _ if members[0].other_joint().is_some() => return describe_couplings(members),
        (Some((ArgumentKind::Duration, _)), 2..) => {
            return format!("{} of {} time constants{constants}", code(name), members.len());
        }
        _ => {}
    }
    let place = |effect: &Effect| match (effect.searched_value(), effect.joint()) {
        (Some((ArgumentKind::Order, order)), Some(joint)) => format!("{joint} (order {order})"),
        (Some((_, seconds)), None) if effect.link().is_none() => format!("{seconds} s"),
        _ => effect.place(),
    };
    let places = members.iter().map(place).collect::<Vec<_>>().join(", ");
    let of = match members[0].arguments().first() {
        Some(("joint", _)) if members.len() > 1 => "of joints ",
        Some(("joint", _)) => "of joint ",
        Some(("link", _)) if members.len() > 1 => "of links ",
        Some(("link", _)) => "of link ",
        Some(_) => "at ",
        None => return code(name),
    };
    let orders = match members[0].harmonic_orders().as_deref() {
        Some([order]) => format!(", order {order}"),
        Some(orders) => format!(", orders {}", ranges(orders)),
        None => String::new(),
    };
    format!("{} {of}{places}{orders}", code(name))
}

/// Lists increasing numbers; three or more successive ones become a range: "1, 3–6, 8–60".
fn ranges(numbers: &[u32]) -> String {
    let run = |run: &[u32]| match run {
        [first, _, .., last] if run.len() > 2 => format!("{first}–{last}"),
        _ => run.iter().map(u32::to_string).collect::<Vec<_>>().join(", "),
    };
    numbers.chunk_by(|a, b| *b == a + 1).map(run).collect::<Vec<_>>().join(", ")
}

/// Smallest size of a number of a range that is shown without decimals.
const MIN_ROUNDED: f64 = 100.0;

/// Lists the ranges over the identification rows of the quantities in a law; `None` without
/// quantities.
pub(super) fn seen_ranges(ranges: &[(impl Display, (f64, f64))]) -> Option<String> {
    let shown = |value: f64| number(value, if value.abs() < MIN_ROUNDED { 3 } else { 0 });
    let range = |(of, (low, high)): &(_, (f64, f64))| {
        format!("{of} from {} to {}", shown(*low), shown(*high))
    };
    let ranges: Vec<String> = ranges.iter().map(range).collect();
    let joined = ranges.join(", ");
    let radians = if joined.contains('q') { ", angles in rad" } else { "" };
    let celsius = if joined.contains("temperature") { ", temperature in °C" } else { "" };
    (!ranges.is_empty()).then(|| format!("{joined} (SI units{radians}{celsius})"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Unit;

    #[test]
    fn small_coefficients_keep_their_digits() {
        let shown = |estimate: f64, error: f64| {
            value(&ParameterValue {
                name: "1".to_owned(),
                unit: Unit::Angle,
                estimate: estimate.to_radians(),
                std_error: Some(error.to_radians()),
            })
        };
        assert_eq!(shown(0.0123, 0.0004), "0.01230 ± 0.00040 °");
        assert_eq!(shown(-9.82e-6, 3.1e-7), "(-9.82 ± 0.31)·10⁻⁶ °");
        assert_eq!(shown(12.0, 3e-6), "12.000000 ± 0.000003 °");
    }

    #[test]
    fn many_effects_take_one_line() {
        let harmonics = (1..=2).flat_map(|joint| {
            (1..=60).map(move |order| Effect::JointHarmonic { joint, orders: vec![order] })
        });
        let others = [Effect::Backlash { joint: 3 }, Effect::JointCoupling { joint: 2, from: 1 }];
        let lines = grouped(harmonics.chain(others).map(|effect| (effect, ())), true);
        let words: Vec<String> = lines.into_iter().map(|(words, ())| words).collect();
        let expected = [
            format!("{} of joints 1, 2, orders 1–60", code("joint-harmonic")),
            format!("{} of joint 3", code("backlash")),
            format!("{} of joint 2 by joint 1", code("joint-coupling")),
        ];
        assert_eq!(words, expected);
        let shifts = [9.5, 19.5].map(|at_time| Effect::StationShift { at_time });
        for (time_measured, noun) in [(true, "times"), (false, "rows")] {
            let expected = format!("{} at 2 {noun}", code("station-shift"));
            assert_eq!(listed(&shifts, time_measured), [expected]);
        }
        assert_eq!(ranges(&[1, 3, 4, 5, 6, 8, 9, 11, 12, 13]), "1, 3–6, 8, 9, 11–13");
    }
}
