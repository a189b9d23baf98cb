//! What `identify` and `loop` print unless all of it is asked for: one screen, with where the rest
//! is.

use super::around::unsteady;
use super::closed_loop::{errors, to_know};
use super::document::{Block, Point, named};
use super::errors::{both_parts, noun, shown, unit};
use super::findings;
use super::identify::{errors_by_axis, headline};
use super::noise::{carried, noise, short};
use super::parameters::correlated;
use super::quantity::{counted, number};
use super::render::text_within;
use super::unexplained::{places, size_alone};
use super::verdict::{called, is_beside, verdict};
use crate::fit::{Estimate, Identification, size_of_kind};
use crate::problem::Problem;
use crate::select::{ClosedLoop, Found, Verdict};

/// Lines of a screen, less those that say where results are and what to do next.
const LINES: usize = 22;

/// A fit on one screen of so many columns, ending in a line break: errors, how large the residual
/// is, and what to look at.
pub fn estimate_brief(problem: &Problem, found: &Identification, columns: usize) -> String {
    let mut blocks = vec![
        headline(problem, found),
        Block::Table(errors_by_axis(found)),
        Block::lines(noise(problem, found)),
    ];
    blocks.extend(carried(found));
    blocks.push(Block::Lines(parameters(&found.estimates), worth_a_look(found)));
    text_within(&blocks, columns)
}

/// Whether the data, rather than its prior, say what a parameter is.
fn is_well(own: &Estimate) -> bool {
    own.at_bound.is_none() && own.fitted && own.identified > 0.9
}

/// Whether a fit found no parameter well.
pub fn tells_little(found: &Identification) -> bool {
    !found.estimates.iter().any(is_well)
}

/// How many parameters are known how well.
fn parameters(estimates: &[Estimate]) -> String {
    let count = |is: fn(&Estimate) -> bool| estimates.iter().filter(|own| is(own)).count();
    let held = count(|own| own.at_bound.is_some() || !own.fitted);
    let well = count(is_well);
    let in_part = count(|own| own.at_bound.is_none() && own.fitted && own.identified > 0.1) - well;
    let parts =
        [(in_part, "in part"), (estimates.len() - held - well - in_part, "hardly"), (held, "held")];
    let rest: Vec<String> =
        parts.iter().filter(|own| own.0 > 0).map(|(n, how)| format!(", {n} {how}")).collect();
    let rest = rest.concat();
    format!(
        "{} of {} identified well{rest}; -v lists them.",
        well,
        counted(estimates.len(), "parameter")
    )
}

/// What the tables would tell at length.
fn worth_a_look(found: &Identification) -> Vec<String> {
    let mut points = Vec::new();
    if let Some(own) = &found.orientation {
        let mean = |of: &crate::fit::Errors| number(of.held_out.mean.norm.to_degrees(), 4);
        points.push(format!(
            "orientation: {} ° before, {} ° after, mean of the held-out poses",
            mean(&own.registered),
            mean(&own.fitted)
        ));
    }
    let farthest = found.outliers.iter().max_by(|a, b| a.distance.total_cmp(&b.distance));
    points.extend(farthest.map(|own| {
        let n = counted(found.outliers.len(), noun(found));
        format!(
            "{n} too far off to be noise, the farthest {}: {}",
            own.location,
            size_of_kind(own.kind, own.error.norm(), 3)
        )
    }));
    points.extend(unsteady(found.spreads.iter().map(|own| &own.1)));
    let of_parameters =
        format!("of {} not identifiable", counted(found.unknowns.len(), "parameter"));
    let counts = [
        (found.identifiability().unidentifiable.len(), "combination", of_parameters.as_str()),
        (found.weak.len(), "combination", "seen too weakly"),
        (correlated(found).len(), "pair", "correlated by more than 0.9"),
        (found.active_constraints.len(), "constraint", "at its limit"),
    ];
    let counts = counts.into_iter().filter(|own| own.0 > 0);
    points.extend(counts.map(|(n, noun, what)| format!("{} {what}", counted(n, noun))));
    points
}

/// A loop on one screen of so many columns, ending in a line break: what it came to, what was
/// found, and what remains.
pub fn loop_brief(problem: &Problem, closure: &ClosedLoop, columns: usize) -> String {
    let text = |blocks: &[Block]| text_within(blocks, columns);
    let mut table = errors(closure);
    // Of the held-out poses, whose column of χ² is empty.
    table.rows.truncate(table.rows.len() / 2);
    table.header.pop();
    table.rows.iter_mut().for_each(|row| _ = row.pop());
    let mut blocks = vec![
        Block::lines(format!("{}\n{}", problem.title, both_parts(&closure.before.fit))),
        Block::Text(verdict(closure)),
    ];
    blocks.extend(to_know(problem, closure));
    blocks.push(Block::Table(table));
    blocks.extend(Some(gain(closure)).filter(|gain| !gain.is_empty()).map(Block::Text));
    let end = remains(closure)
        .map_or_else(String::new, |words| format!("\n{}", text(&[Block::Text(words)])));
    let last = end.lines().count();
    let found: Vec<&Found> = closure.effects.iter().filter(|found| !is_beside(found)).collect();
    if !found.is_empty() {
        // A blank line and a heading, and perhaps how many more there are.
        let room = LINES.saturating_sub(text(&blocks).lines().count() + last + 3).max(1);
        let few = found.len() <= FEW;
        let title = |found| {
            if few {
                called(closure, found) + &untold(closure, found)
            } else {
                cut(&called(closure, found))
            }
        };
        let titles = found.iter().map(|found| Point::from(title(found)));
        blocks.push(Block::heading("What was found"));
        blocks.push(Block::Ranking(titles.take(room).collect()));
        let more = found.len().saturating_sub(room);
        let more = if more > 0 { format!("     and {more} more\n") } else { String::new() };
        return text(&blocks) + &more + &end;
    }
    text(&blocks) + &end
}

/// What the data do not tell an effect from, in a few words.
fn untold(closure: &ClosedLoop, found: &Found) -> String {
    let others =
        named(found.alternatives.iter().map(|other| closure.before.describe(other)), 1, "");
    if others.is_empty() { others } else { format!("; not told from: {others}") }
}

/// Effects whose titles may take two lines each.
const FEW: usize = 3;

/// The beginning of words that would not fit in a line.
fn cut(words: &str) -> String {
    const MOST: usize = 100;
    if words.chars().count() <= MOST {
        words.to_owned()
    } else {
        words.chars().take(MOST - 1).chain(['…']).collect()
    }
}

/// What was gained.
fn gain(closure: &ClosedLoop) -> String {
    let [before, after] = [&closure.before.fit, &closure.after].map(|fit| fit.reduced_chi2);
    let chi2 = match (before, after) {
        (Some(before), Some(after)) if !closure.effects.is_empty() => {
            let too_large =
                if closure.after.sigma_scale < 1.0 { " The declared σ is too large." } else { "" };
            let (before, after) = (short(before), short(after));
            format!(
                "χ²/ν of the residual falls from {before} to {after}; noise alone: 1.{too_large}"
            )
        }
        (Some(before), _) => format!("χ²/ν of the residual is {}; noise alone: 1.", short(before)),
        _ => String::new(),
    };
    let gain = closure.gain;
    if closure.effects.is_empty() || !gain.value.is_finite() {
        return chi2;
    }
    let of = &closure.after.fitted.held_out;
    let [value, low, high] = [gain.value, gain.low, gain.high].map(|value| shown(of, value));
    let (rows, unit) = (if of.kind == "position" { "poses" } else { "rows" }, unit(of));
    format!(
        "Gain on the held-out {rows} {value} {unit} in the mean (95 % interval {low} to {high} {unit}). {chi2}"
    )
}

/// What is left, in a sentence.
fn remains(closure: &ClosedLoop) -> Option<String> {
    let failed = findings::failed(&closure.findings).len();
    let is_left = closure.verdict == Verdict::Unexplained && size_alone(closure).is_none();
    let places = if is_left { places(closure) } else { Vec::new() };
    let places = named(places.iter().map(|place| cut(place)), 1, "");
    let structure =
        (!places.is_empty()).then(|| format!("structure without a known law ({places})"));
    let checks = (failed > 0).then(|| format!("{} failed", counted(failed, "check")));
    let parts: Vec<String> = structure.into_iter().chain(checks).collect();
    (!parts.is_empty())
        .then(|| format!("What remains: {}; -v lists it, report.html shows it.", parts.join(", ")))
}
