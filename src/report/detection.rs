//! Effects that measurements at the checked poses would show, in words.

use super::document::{Block, Table, code};
use super::effect;
use super::forecast::format_size;
use crate::laws::{ArgumentKind, Need};
use crate::problem::{Effect, Problem};
use crate::select::{Detectable, Detection, Size};

/// Maximum number of effects of one family that a table lists.
const MAX_SHOWN_EFFECTS: usize = 3;
/// Note on the columns of the table.
const COLUMNS_NOTE: &str = "found from: smallest size that is found for every axis or phase; at best: for the most visible axis or phase; –: for some axis or phase, no size is found";

/// Returns the table of the effects of each family that are hardest to detect, and lists of those
/// that the poses cannot show.
pub(super) fn blocks<'a>(problem: &Problem, detection: &Detection) -> Vec<Block<'a>> {
    let seen = |effect: &&Detectable| effect.sizes.iter().any(Size::is_within_prior);
    let (mut visible, mut hidden): (Vec<&Detectable>, Vec<&Detectable>) =
        detection.effects.iter().partition(seen);
    // An effect with a searched argument, for example a time, is visible if one trial value is.
    let places: Vec<String> = visible.iter().map(|effect| effect.effect.name_and_place()).collect();
    hidden.retain(|effect| {
        !effect.effect.is_searched() || !places.contains(&effect.effect.name_and_place())
    });
    hidden.retain(|effect| effect::is_at_moving_joint(problem, &effect.effect));
    let needs_times = |effect: &&Detectable| detection.times_assumed && effect.effect.has_memory();
    let if_timed: Vec<&Effect> =
        visible.iter().copied().filter(needs_times).map(|effect| &effect.effect).collect();
    visible.retain(|effect| !needs_times(effect));
    // Times and durations mean nothing if row numbers stand for times.
    let is_timed = |effect: &&Detectable| {
        let value = effect.effect.searched_value();
        let kind = value.map(|(kind, _)| kind);
        detection.times_are_rows
            && matches!(kind, Some(ArgumentKind::Time | ArgumentKind::Duration))
    };
    let untimed: Vec<&Effect> =
        visible.iter().copied().filter(is_timed).map(|effect| &effect.effect).collect();
    visible.retain(|effect| !is_timed(effect));
    let mut families: Vec<&str> = Vec::new();
    for effect in &visible {
        if !families.contains(&effect.effect.name()) {
            families.push(effect.effect.name());
        }
    }
    let rows: Vec<Vec<String>> =
        families.into_iter().flat_map(|family| hardest_rows(&visible, family)).collect();
    let mut blocks = vec![Block::Text(format!(
        "Size from which on an effect is found in {:.0} of 100 such sets of measurements, for the least visible effect at each of the \
         {MAX_SHOWN_EFFECTS} places of a family where it is least visible:",
        detection.power * 100.0
    ))];
    if !rows.is_empty() {
        let header = ["effect", "found from", "at best", "prior ± 1 σ", "unit", "parameters"];
        blocks.push(Block::Table(Table::new(&header, rows, &[0, 4, 5]).noted(&[COLUMNS_NOTE])));
    }
    if !if_timed.is_empty() {
        let list = effect::listed(if_timed, true).join("; ");
        blocks.push(Block::Text(format!(
            "These effects can be seen only if the table records {} (the figures assume about one \
             minute between poses): {list}.",
            code("time_s")
        )));
    }
    if !untimed.is_empty() {
        let mut names: Vec<String> = Vec::new();
        for name in untimed.iter().map(|effect| code(effect.name())) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        blocks.push(Block::Text(format!(
            "No size is stated for effects with a time or a time constant, because the table has \
             no {}: {}. Drifts are per row.",
            code("time_s"),
            names.join(", ")
        )));
    }
    let acts_by_load = |effect: &&Detectable| effect.effect.has_need(&[Need::Loads]);
    if has_no_mass(problem) && hidden.iter().any(acts_by_load) {
        let loaded = hidden.iter().filter(|effect| acts_by_load(effect));
        let list = effect::listed(loaded.map(|effect| &effect.effect), true).join("; ");
        blocks.push(Block::Text(format!(
            "Not visible, because no mass is declared, so no load acts: {list}. Give the links {} \
             and {} in {}.",
            code("mass_kg"),
            code("com_m"),
            code("[[joint.body]]")
        )));
        hidden.retain(|effect| !acts_by_load(effect));
    }
    if !hidden.is_empty() {
        let list = effect::listed(hidden.into_iter().map(|effect| &effect.effect), true).join("; ");
        blocks.push(Block::Text(format!(
            "Not visible with these poses, even at the size of their prior: {list}."
        )));
    }
    let untestable = detection.untestable.iter();
    let untestable: Vec<_> =
        untestable.filter(|(of, _)| effect::is_at_moving_joint(problem, of)).cloned().collect();
    if !untestable.is_empty() {
        blocks.push(Block::heading("Not visible with measurements of this kind"));
        blocks.push(Block::List(effect::reasons(untestable, true)));
    }
    blocks
}

/// Names the families of effects that the poses would show, and those that they would not, in a few
/// lines.
pub(super) fn brief<'a>(problem: &Problem, detection: &Detection) -> Vec<Block<'a>> {
    let (mut seen, mut hidden): (Vec<&str>, Vec<&str>) = (Vec::new(), Vec::new());
    for effect in &detection.effects {
        // Poses that are still to be measured may get times.
        let is_timed = detection.times_assumed && effect.effect.has_memory();
        let is_seen = effect.sizes.iter().any(Size::is_within_prior) && !is_timed;
        let names = if is_seen { &mut seen } else { &mut hidden };
        if !names.contains(&effect.effect.name()) {
            names.push(effect.effect.name());
        }
    }
    for (effect, _) in &detection.untestable {
        if !hidden.contains(&effect.name()) {
            hidden.push(effect.name());
        }
    }
    hidden.retain(|name| !seen.contains(name));
    let listed =
        |names: &[&str]| names.iter().map(|name| code(name)).collect::<Vec<_>>().join(", ");
    let mut blocks = Vec::new();
    if !seen.is_empty() {
        let seen = listed(&seen);
        blocks.push(Block::Text(format!("Effects that these poses would show: {seen}.")));
    }
    if !hidden.is_empty() {
        let masses = if has_no_mass(problem) {
            format!(
                ". No mass is declared, so no load acts: give the links {} and {} in {}",
                code("mass_kg"),
                code("com_m"),
                code("[[joint.body]]")
            )
        } else {
            String::new()
        };
        let untimed = if detection.times_assumed {
            format!(", or not without a column {}", code("time_s"))
        } else {
            String::new()
        };
        let hidden = listed(&hidden);
        blocks.push(Block::Text(format!("Effects not shown{untimed}: {hidden}{masses}.")));
    }
    blocks
}

/// Returns the table rows of a family of effects, for at most [`MAX_SHOWN_EFFECTS`] places. Each
/// place shows its effect that is hardest to detect; the hardest one comes first.
fn hardest_rows(shown: &[&Detectable], family: &str) -> Vec<Vec<String>> {
    let mut members: Vec<(&Detectable, f64)> = Vec::new();
    for effect in shown.iter().filter(|effect| effect.effect.name() == family) {
        let sizes = effect.sizes.iter();
        let part =
            sizes.map(|size| size.worst.unwrap_or(f64::INFINITY) / size.prior).fold(0.0, f64::max);
        members.push((effect, part));
    }
    members.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut places: Vec<String> = Vec::new();
    let rows = members.iter().filter(|(effect, _)| {
        // Effects that differ only in a searched argument, such as a time, act at one place.
        let place = effect.effect.name_and_place();
        let new = !places.contains(&place);
        places.push(place);
        new
    });
    rows.take(MAX_SHOWN_EFFECTS)
        .flat_map(|(effect, _)| effect.sizes.iter().map(|size| row(&effect.effect, size)))
        .collect()
}

fn row(effect: &Effect, size: &Size) -> Vec<String> {
    let unit = size.unit.display(size.prior);
    let short = |name: &String| name.rsplit('.').next().unwrap_or_default().to_owned();
    vec![
        effect.declaration(),
        format_size(size.worst, &unit),
        format_size(size.best, &unit),
        format_size(Some(size.prior), &unit),
        unit.symbol.clone(),
        size.parameters.iter().map(short).collect::<Vec<_>>().join(", "),
    ]
}

/// Returns true if the problem declares no mass and no payload, so that no load deflects the arm.
pub(super) fn has_no_mass(problem: &Problem) -> bool {
    problem.tool.payload_mass == 0.0
        && problem.joints.iter().all(|joint| joint.bodies.is_empty() && joint.beam.is_none())
}
