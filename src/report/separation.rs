//! How well a plan tells two effects apart, for programs and for people.

use super::document::{Block, Table};
use super::forecast::size as shown;
use super::json::object;
use super::quantity::{number, or_dash, p_value};
use crate::design::Separated;
use crate::diagnose::{Separation, Side};
use crate::problem::Effect;

object! {
    /// All of it.
    Entry<'a>(separated: &'a Separated) {
        /// Largest principal angle between the two.
        angle_deg: Option<f64> = separated.planned.angle.map(f64::to_degrees),
        random_angle_deg: Option<f64> = random_angle(separated).map(f64::to_degrees),
        effects: [SideEntry<'a>; 2] = [0, 1].map(|side| SideEntry::of(separated, side, &Figures::of(separated, side))),
    }
}
object! {
    /// One of the two, sizes in SI; beside each figure the median over random poses.
    SideEntry<'a>(separated: &'a Separated, side: usize, figures: &Figures<'a>) {
        #[serde(flatten)]
        effect: &'a Effect = &separated.effects[side],
        parameters: &'a [String] = &figures.planned.found.parameters,
        unit: &'static str = figures.planned.found.unit.symbol(),
        found_from: Option<f64> = figures.planned.found.worst,
        random_found_from: Option<f64> = figures.random_found,
        /// The other in its place is ruled out.
        told_from: Option<f64> = figures.planned.told.worst,
        random_told_from: Option<f64> = figures.random_told,
        /// The size of `p_value` and `random_p_value`: from which random poses find it, or its prior.
        size: f64 = figures.size,
        p_value: f64 = figures.p,
        random_p_value: f64 = figures.random_p,
    }
}

/// Figures about one of the two.
pub(super) struct Figures<'a> {
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

/// A table of the two, random poses beside planned ones.
pub(super) fn blocks<'a>(separated: &Separated) -> Vec<Block<'a>> {
    let angle = |angle: Option<f64>| or_dash(angle, |angle| number(angle.to_degrees(), 1));
    let cells = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let planned = separated.planned.angle;
    let mut rows = vec![cells(["angle between them", &angle(random_angle(separated)), &angle(planned), "°"])];
    for (k, own) in separated.effects.iter().enumerate() {
        let Figures { planned, random_found, random_told, size, p, random_p } = Figures::of(separated, k);
        let unit = planned.found.unit.display(planned.found.prior);
        let show = |value: Option<f64>| shown(value, &unit);
        rows.push(cells([&own.declaration(), "", "", ""]));
        rows.push(cells(["  found from", &show(random_found), &show(planned.found.worst), &unit.symbol]));
        rows.push(cells(["  told apart from", &show(random_told), &show(planned.told.worst), &unit.symbol]));
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
