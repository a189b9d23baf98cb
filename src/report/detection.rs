//! Which effects poses would show, for programs and for people.

use serde::Serialize;

use super::document::{Block, Table, to_text};
use super::effect;
use super::quantity::{decimals, number};
use crate::diagnose::{Detectable, Detection, Size};
use crate::model::effect::{name, place};
use crate::problem::Effect;

/// Effects of a family on a screen.
const SHOWN: usize = 3;
/// Decimals of any size at most.
const MOST: usize = 6;

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Entry<'a> {
    power: f64,
    level: f64,
    effects: Vec<EffectEntry<'a>>,
    untestable: Vec<UntestableEntry<'a>>,
}

#[derive(Debug, Serialize)]
struct EffectEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    sizes: Vec<SizeEntry<'a>>,
}

/// SI.
#[derive(Debug, Serialize)]
struct SizeEntry<'a> {
    parameters: &'a [String],
    unit: &'static str,
    prior_sigma: f64,
    found_from: Option<f64>,
    found_from_at_best: Option<f64>,
}

#[derive(Debug, Serialize)]
struct UntestableEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    reason: &'static str,
}

impl<'a> Entry<'a> {
    pub fn of(detection: &'a Detection) -> Self {
        let size = |size: &'a Size| SizeEntry {
            parameters: &size.parameters,
            unit: size.unit.symbol(),
            prior_sigma: size.prior,
            found_from: size.worst,
            found_from_at_best: size.best,
        };
        let effect = |own: &'a Detectable| EffectEntry {
            effect: effect::Entry(&own.effect),
            sizes: own.sizes.iter().map(size).collect(),
        };
        let untestable =
            |(effect, reason): &'a (Effect, &'static str)| UntestableEntry { effect: effect::Entry(effect), reason };
        Self {
            power: detection.power,
            level: detection.level,
            effects: detection.effects.iter().map(effect).collect(),
            untestable: detection.untestable.iter().map(untestable).collect(),
        }
    }
}

/// The hardest of each family, and what is not to be seen, ending in a line break.
pub(super) fn text(detection: &Detection) -> String {
    let seen = |own: &&Detectable| own.sizes.iter().any(Size::is_within_prior);
    let (shown, hidden): (Vec<&Detectable>, Vec<&Detectable>) = detection.effects.iter().partition(seen);
    let (mut rows, mut families): (Vec<Vec<String>>, Vec<&str>) = Default::default();
    for own in &shown {
        let family = name(&own.effect);
        if !families.contains(&family) {
            families.push(family);
            rows.extend(hardest(&shown, family));
        }
    }
    let mut blocks = vec![Block::Text(format!(
        "How large an effect must be to be found (in {:.0} of 100 such sets, at the level of the loop), the {SHOWN} hardest of \
         each family:",
        detection.power * 100.0
    ))];
    if !rows.is_empty() {
        let header = vec!["effect", "found from", "at best", "prior ± 1 σ", "unit", "parameters"];
        blocks.push(Block::Table(Table { header, rows, left: vec![0, 4, 5] }));
    }
    let list = |effects: Vec<Effect>| {
        let groups = effect::grouped(effects.into_iter().map(|effect| (effect, ())));
        groups.into_iter().map(|(words, ())| words).collect::<Vec<_>>().join("; ")
    };
    if !hidden.is_empty() {
        let hidden = hidden.into_iter().map(|own| own.effect.clone()).collect();
        blocks.push(Block::Text(format!("Not with these poses, even at the size of their prior: {}.", list(hidden))));
    }
    let groups = effect::grouped(detection.untestable.iter().cloned());
    blocks.extend((!groups.is_empty()).then(|| Block::heading("Not with measurements of this kind")));
    blocks
        .extend((!groups.is_empty()).then(|| Block::list(groups.iter().map(|(words, why)| format!("{words}: {why}")))));
    to_text(&blocks)
}

/// Rows of a family: the effect at each place that is hardest to see, the hardest first.
fn hardest(shown: &[&Detectable], family: &str) -> Vec<Vec<String>> {
    let mut own: Vec<(&Detectable, f64)> = Vec::new();
    for effect in shown.iter().filter(|effect| name(&effect.effect) == family) {
        let sizes = effect.sizes.iter();
        let part = sizes.map(|size| size.worst.unwrap_or(f64::INFINITY) / size.prior).fold(0.0, f64::max);
        own.push((effect, part));
    }
    own.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut places: Vec<String> = Vec::new();
    let rows = own.iter().filter(|(effect, _)| {
        // Times of a shift are not places.
        let place =
            if matches!(effect.effect, Effect::StationShift { .. }) { String::new() } else { place(&effect.effect) };
        let new = !places.contains(&place);
        places.push(place);
        new
    });
    rows.take(SHOWN).flat_map(|(effect, _)| effect.sizes.iter().map(|size| row(&effect.effect, size))).collect()
}

fn row(effect: &Effect, size: &Size) -> Vec<String> {
    let unit = size.unit.display(size.prior);
    let show = |value: Option<f64>| {
        let scaled = value.map(|value| value * unit.factor);
        scaled.map_or_else(|| "–".to_owned(), |value| number(value, decimals(value, MOST)))
    };
    let short = |name: &String| name.rsplit('.').next().unwrap_or_default().to_owned();
    vec![
        effect::declaration(effect),
        show(size.worst),
        show(size.best),
        show(Some(size.prior)),
        unit.symbol.clone(),
        size.parameters.iter().map(short).collect::<Vec<_>>().join(", "),
    ]
}
