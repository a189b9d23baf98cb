//! How well a plan tells two effects apart, for programs and for people.

use serde::Serialize;

use super::document::{Block, Table, to_text};
use super::effect;
use super::quantity::{decimals, number};
use crate::design::Separated;
use crate::diagnose::{Separation, Side};

/// Decimals of any size at most.
const MOST: usize = 6;

/// All of it.
#[derive(Debug, Serialize)]
pub(super) struct Entry<'a> {
    /// Largest principal angle between the two.
    angle_deg: Option<f64>,
    random_angle_deg: Option<f64>,
    effects: [SideEntry<'a>; 2],
}

/// One of the two, sizes in SI; beside each figure the median over random poses.
#[derive(Debug, Serialize)]
struct SideEntry<'a> {
    #[serde(flatten)]
    effect: effect::Entry<'a>,
    parameters: &'a [String],
    unit: &'static str,
    found_from: Option<f64>,
    random_found_from: Option<f64>,
    /// The other in its place is ruled out.
    told_from: Option<f64>,
    random_told_from: Option<f64>,
    /// The size of `p_value` and `random_p_value`: from which random poses find it, or its prior.
    size: f64,
    p_value: f64,
    random_p_value: f64,
}

/// Figures about one of the two.
struct Figures<'a> {
    planned: &'a Side,
    random_found: Option<f64>,
    random_told: Option<f64>,
    size: f64,
    p: f64,
    random_p: f64,
}

impl<'a> Figures<'a> {
    fn of(separated: &'a Separated, side: usize) -> Self {
        let planned = &separated.planned.sides[side];
        let median = |of: fn(&Side) -> Option<f64>| {
            Some(separated.random(|own| of(&own.sides[side]))).filter(|value| value.is_finite())
        };
        let random_found = median(|side| side.found.worst);
        let size = random_found.unwrap_or(planned.found.prior).min(planned.found.prior);
        Self {
            random_found,
            random_told: median(|side| side.told.worst),
            size,
            p: planned.expected_p(size),
            random_p: separated.random(|own| Some(own.sides[side].expected_p(size))),
            planned,
        }
    }
}

fn random_angle(separated: &Separated) -> Option<f64> {
    Some(separated.random(|own: &Separation| own.angle)).filter(|angle| angle.is_finite())
}

impl<'a> Entry<'a> {
    pub fn of(separated: &'a Separated) -> Self {
        let side = |k: usize| {
            let Figures { planned, random_found, random_told, size, p, random_p } = Figures::of(separated, k);
            SideEntry {
                effect: effect::Entry(&separated.effects[k]),
                parameters: &planned.found.parameters,
                unit: planned.found.unit.symbol(),
                found_from: planned.found.worst,
                random_found_from: random_found,
                told_from: planned.told.worst,
                random_told_from: random_told,
                size,
                p_value: p,
                random_p_value: random_p,
            }
        };
        Self {
            angle_deg: separated.planned.angle.map(f64::to_degrees),
            random_angle_deg: random_angle(separated).map(f64::to_degrees),
            effects: [side(0), side(1)],
        }
    }
}

/// A table of the two, random poses beside planned ones, ending in a line break.
pub(super) fn text(separated: &Separated) -> String {
    let angle = |angle: Option<f64>| angle.map_or_else(|| "–".to_owned(), |angle| number(angle.to_degrees(), 1));
    let cells = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let planned = separated.planned.angle;
    let mut rows = vec![cells(["angle between them", &angle(random_angle(separated)), &angle(planned), "°"])];
    for (k, own) in separated.effects.iter().enumerate() {
        let Figures { planned, random_found, random_told, size, p, random_p } = Figures::of(separated, k);
        let unit = planned.found.unit.display(planned.found.prior);
        let show = |value: Option<f64>| {
            let scaled = value.map(|value| value * unit.factor);
            scaled.map_or_else(|| "–".to_owned(), |value| number(value, decimals(value, MOST)))
        };
        rows.push(cells([&effect::declaration(own), "", "", ""]));
        rows.push(cells(["  found from", &show(random_found), &show(planned.found.worst), &unit.symbol]));
        rows.push(cells(["  told from the other from", &show(random_told), &show(planned.told.worst), &unit.symbol]));
        let at = format!("  p beside the other at {} {}", show(Some(size)), unit.symbol);
        let short = |p: f64| effect::p(p).trim_start_matches("p ").to_owned();
        rows.push(cells([&at, &short(random_p), &short(p), ""]));
    }
    let header = vec!["told apart", "random", "planned", "unit"];
    to_text(&[
        Block::Table(Table { header, rows, left: vec![0, 3] }),
        Block::Text(
            "The angle is that between the two once all parameters have been fitted: at 0° nothing tells them apart, at 90° they \
             have nothing in common. Sizes are those found, or told from the other, in 80 of 100 such sets; p is what to expect \
             for the other in its place. Random: median over as many random poses, drawn again and again."
                .to_owned(),
        ),
    ])
}
