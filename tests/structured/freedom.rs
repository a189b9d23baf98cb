//! Random choice of what is free, and of the true deviations that follow from it.

use std::fmt::Write as _;

use super::arm::{Geometry, Kind};
use super::draw::Draw;
use super::world::World;

/// Kind of the numbers of a rule, with how they are written and spread.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Sort {
    Angle,
    Length,
    Relative,
}

/// What may be said of free parameters.
pub struct Freedom {
    /// Section `[parameters]`, and sections `[[constraint]]`.
    pub text: String,
    /// True if bounds or constraints may keep the fit from the truth.
    pub is_limited: bool,
}

/// Draws the rules of free parameters, and moves `truth` from nominal by what they allow; not at
/// all if `is_exact`.
pub fn drawn(draw: &mut Draw, truth: &mut World, is_exact: bool, turns_tool: bool) -> Freedom {
    let mut text = "[parameters]\n".to_owned();
    let mut is_limited = false;
    let mut free = Vec::new();
    let groups = [
        ("alpha", Sort::Angle),
        ("a", Sort::Length),
        ("theta", Sort::Angle),
        ("d", Sort::Length),
        ("beta", Sort::Angle),
        ("stiffness", Sort::Relative),
    ];
    for (field, sort) in groups {
        let names = names_of(truth, field);
        if names.is_empty() || !draw.chance(if field == "beta" { 0.2 } else { 0.5 }) {
            continue;
        }
        let (key, sigma, unit): (_, f64, f64) = match sort {
            Sort::Angle => ("sigma_deg", draw.pick(&[0.1, 0.3, 1.0]), 1f64.to_radians()),
            Sort::Length => ("sigma_mm", draw.pick(&[0.5, 2.0, 5.0]), 1e-3),
            Sort::Relative => ("sigma_relative", 0.3, 1.0),
        };
        let mut rule = format!("{key} = {sigma}");
        let mut reach = 2.0 * sigma;
        if draw.chance(0.12) {
            let width = draw.pick(&[0.3, 1.0, 3.0]) * sigma;
            let ends = match sort {
                Sort::Angle => format!("min_deg = {}, max_deg = {width}", -width),
                Sort::Length => format!("min_mm = {}, max_mm = {width}", -width),
                Sort::Relative => {
                    format!("min_relative = {:?}, max_relative = {:?}", (-width).exp(), width.exp())
                }
            };
            rule = format!("{rule}, {ends}");
            if draw.chance(0.8) {
                reach = reach.min(width);
            } else {
                is_limited = true;
            }
            // Noise alone brings estimates to their bounds.
            is_limited |= width < sigma;
        }
        let _ = writeln!(text, "\"joint*.{field}\" = {{ {rule} }}");
        for name in names {
            free.push((name, sort, (0.6 * sigma, reach), unit));
        }
    }
    if draw.chance(0.1)
        && let Some((name, ..)) = free.pop()
    {
        let _ = writeln!(text, "\"{name}\" = {{ fixed = true }}");
    }
    if !is_exact {
        for (name, sort, (sigma, reach), unit) in &free {
            let moved = (sigma * draw.normal()).clamp(-reach, *reach) * unit;
            if let Some(value) = truth.parameter(name) {
                if *sort == Sort::Relative { *value *= moved.exp() } else { *value += moved }
            }
        }
    }
    base(draw, truth, &mut text, is_exact);
    tool(draw, truth, &mut text, is_exact, turns_tool);
    let deviations = truth.effects.iter().flat_map(|effect| effect.parameters.clone());
    for (name, size) in deviations.collect::<Vec<_>>() {
        if !is_exact && let Some(value) = truth.parameter(&name) {
            *value = size * draw.normal().clamp(-2.0, 2.0);
        }
    }
    let lengths: Vec<String> = free
        .iter()
        .filter(|(_, sort, ..)| *sort == Sort::Length)
        .map(|(name, ..)| name.clone())
        .collect();
    // With bounds no point might satisfy everything.
    if lengths.len() > 1 && draw.chance(0.08) && !text.contains("min_") {
        let (first, last) = (lengths[0].clone(), lengths[lengths.len() - 1].clone());
        let apart = *truth.parameter(&first).unwrap() - *truth.parameter(&last).unwrap();
        let _ = writeln!(
            text,
            "[[constraint]]\nterms = {{ \"{first}\" = 1.0, \"{last}\" = -1.0 }}\nat_least_mm = {:?}\nat_most_mm = {:?}",
            apart * 1e3 - draw.number(0.1, 3.0),
            apart * 1e3 + draw.number(0.1, 3.0)
        );
        is_limited = true;
    }
    Freedom { text, is_limited }
}

/// Returns the names of a geometric number or the stiffness of all joints that have it.
fn names_of(world: &World, field: &str) -> Vec<String> {
    let has = |k: &usize| {
        let joint = &world.arm.joints[*k];
        match (field, &joint.geometry) {
            ("stiffness", _) => joint.stiffness.is_some() && joint.kind == Kind::Revolute,
            (_, Geometry::Hayati(_)) => true,
            _ => false,
        }
    };
    (0..world.arm.joints.len()).filter(has).map(|k| format!("joint{}.{field}", k + 1)).collect()
}

/// Draws whether bases are free, and where they truly are.
fn base(draw: &mut Draw, truth: &mut World, text: &mut String, is_exact: bool) {
    let choice = draw.whole(0, 9);
    let spread = match choice {
        0..=4 => {
            *text += "\"base.*\" = { free = true }\n";
            [0.3, 0.5]
        }
        5 | 6 => {
            *text += "\"base.*\" = { sigma_mm = 5, sigma_deg = 0.5 }\n";
            [3e-3, 5e-3]
        }
        _ => return,
    };
    if !is_exact {
        for base in truth.bases.values_mut() {
            let [at, turned] =
                spread.map(|size| draw.normals(size).map(|x| x.clamp(-2.0 * size, 2.0 * size)));
            base[0] += at;
            base[1] += turned;
        }
    }
}

fn tool(draw: &mut Draw, truth: &mut World, text: &mut String, is_exact: bool, turns: bool) {
    if draw.chance(0.5) {
        return;
    }
    *text += if turns {
        "\"tool.*\" = { sigma_mm = 3, sigma_deg = 0.5 }\n"
    } else {
        "\"tool.*\" = { sigma_mm = 3 }\n"
    };
    if !is_exact {
        for tool in truth.tools.values_mut() {
            tool.at += draw.normals(2e-3).map(|x| x.clamp(-5e-3, 5e-3));
            if turns {
                tool.turn += draw.normals(4e-3).map(|x| x.clamp(-9e-3, 9e-3));
            }
        }
    }
}
