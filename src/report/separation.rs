//! How well a plan tells two effects apart, for programs and for people.

use serde::Serialize;

use super::document::{Block, Table};
use super::forecast::size as shown;
use super::json::object;
use super::quantity::{number, or_dash, p_value};
use crate::design::PairSeparation;
use crate::select::{Separation, Side};

/// All of it as JSON: sizes in SI, beside each figure the median over random poses.
pub(super) fn entry(separated: &PairSeparation) -> impl Serialize {
    let side = |side: usize| {
        let Figures { planned, random_found, random_told, size, p, random_p } =
            Figures::of(separated, side);
        object! {
            ..&separated.effects[side],
            parameters: &planned.found.parameters,
            unit: planned.found.unit.symbol(),
            found_from: planned.found.worst,
            random_found_from: random_found,
            // The other in its place is ruled out.
            told_from: planned.told.worst,
            random_told_from: random_told,
            // The size of `p_value` and `random_p_value`: from which random poses find it, or its
            // prior.
            size: size,
            p_value: p,
            random_p_value: random_p,
        }
    };
    object! {
        // Largest principal angle between the two.
        angle_deg: separated.planned.angle.map(f64::to_degrees),
        random_angle_deg: random_angle(separated).map(f64::to_degrees),
        effects: [0, 1].map(side),
    }
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
    fn of(separated: &'a PairSeparation, side: usize) -> Self {
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

fn random_angle(separated: &PairSeparation) -> Option<f64> {
    Some(separated.random(|own: &Separation| own.angle)).filter(|angle| angle.is_finite())
}

/// A table of the two, random poses beside planned ones.
pub(super) fn blocks<'a>(separated: &PairSeparation) -> Vec<Block<'a>> {
    let angle = |angle: Option<f64>| or_dash(angle, |angle| number(angle.to_degrees(), 1));
    let cells = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let planned = separated.planned.angle;
    let mut rows =
        vec![cells(["angle between them", &angle(random_angle(separated)), &angle(planned), "°"])];
    for (k, own) in separated.effects.iter().enumerate() {
        let Figures { planned, random_found, random_told, size, p, random_p } =
            Figures::of(separated, k);
        let unit = planned.found.unit.display(planned.found.prior);
        let show = |value: Option<f64>| shown(value, &unit);
        rows.push(cells([&own.declaration(), "", "", ""]));
        rows.push(cells([
            "  found from",
            &show(random_found),
            &show(planned.found.worst),
            &unit.symbol,
        ]));
        rows.push(cells([
            "  told apart from",
            &show(random_told),
            &show(planned.told.worst),
            &unit.symbol,
        ]));
        let at = format!("  p beside the other at {} {}", show(Some(size)), unit.symbol);
        rows.push(cells([&at, &p_value(random_p), &p_value(p), ""]));
    }
    vec![
        Block::Table(Table::new(&["told apart", "random", "planned", "unit"], rows, &[0, 3])),
        Block::Text(
            "The angle is that between the two once all parameters have been fitted: at 0° nothing tells them apart, at 90° they \
             have nothing in common. An effect of the size given is found, or told apart from the other, in 80 of 100 such sets of \
             measurements; p is the p-value to expect with the other in its place. Random: median over as many random poses, \
             drawn again and again."
                .to_owned(),
        ),
    ]
}
