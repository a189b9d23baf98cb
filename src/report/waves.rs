//! Which parameters a table shows: of many waves of a joint only the highest.

use std::collections::BTreeMap;

use super::effect::{MOST_LISTED, SHOWN_WAVES};
use crate::identify::Estimate;

/// A line of a table of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Line<'a> {
    /// A parameter.
    Parameter(&'a Estimate),
    /// How many lower waves follow, of which joint.
    Lower(usize, &'a str),
}

/// What is shown and what is left out, both in the order in which it came.
#[derive(Debug)]
pub(super) struct Shown<'a> {
    pub lines: Vec<Line<'a>>,
    pub lower: Vec<&'a Estimate>,
}

/// Joint and order of a coefficient of a wave: `joint-harmonic[3].sin2`.
fn wave(name: &str) -> Option<(&str, u32)> {
    let (joint, part) = name.strip_prefix("joint-harmonic[")?.split_once("].")?;
    let order = part.strip_prefix("sin").or(part.strip_prefix("cos"))?;
    Some((joint, order.parse().ok()?))
}

/// All parameters; of a joint with more coefficients of waves than are listed one by one, the highest waves alone.
pub(super) fn shown(estimates: &[Estimate]) -> Shown<'_> {
    // Of each joint: how many coefficients, and the squared height of each wave.
    let mut joints: BTreeMap<&str, (usize, BTreeMap<u32, f64>)> = BTreeMap::new();
    for estimate in estimates {
        if let Some((joint, order)) = wave(&estimate.name) {
            let (count, heights) = joints.entry(joint).or_default();
            *count += 1;
            *heights.entry(order).or_default() += estimate.estimate * estimate.estimate;
        }
    }
    joints.retain(|_, (count, _)| *count > MOST_LISTED);
    let high: BTreeMap<&str, Vec<u32>> = joints
        .iter()
        .map(|(joint, (_, heights))| {
            let mut orders: Vec<u32> = heights.keys().copied().collect();
            orders.sort_by(|a, b| heights[b].total_cmp(&heights[a]));
            orders.truncate(SHOWN_WAVES);
            (*joint, orders)
        })
        .collect();
    let mut all = Shown { lines: Vec::new(), lower: Vec::new() };
    for (k, estimate) in estimates.iter().enumerate() {
        let own = wave(&estimate.name).filter(|(joint, _)| high.contains_key(joint));
        match own {
            Some((joint, order)) if !high[joint].contains(&order) => all.lower.push(estimate),
            _ => all.lines.push(Line::Parameter(estimate)),
        }
        let Some((joint, _)) = own else { continue };
        let is_last = estimates[k + 1..].iter().all(|later| wave(&later.name).is_none_or(|(other, _)| other != joint));
        let lower = joints[joint].1.len().saturating_sub(SHOWN_WAVES);
        if is_last && lower > 0 {
            all.lines.push(Line::Lower(lower, joint));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::Unit;

    fn estimate(name: String, value: f64) -> Estimate {
        Estimate {
            name,
            unit: Unit::Angle,
            nominal: 0.0,
            estimate: value,
            std_error: None,
            identified: 1.0,
            at_bound: None,
            fitted: true,
        }
    }

    fn waves(joint: usize, orders: u32) -> Vec<Estimate> {
        let of = |order: u32| {
            ["sin", "cos"].map(|part| estimate(format!("joint-harmonic[{joint}].{part}{order}"), f64::from(order)))
        };
        (1..=orders).flat_map(of).collect()
    }

    #[test]
    fn the_highest_of_many_waves_are_shown() {
        let all = [vec![estimate("tool.x".to_owned(), 1.0)], waves(1, 4), waves(2, 10)].concat();
        let Shown { lines, lower } = shown(&all);
        assert_eq!(lines.len(), 1 + 8 + 8 + 1);
        assert_eq!(lines.last(), Some(&Line::Lower(6, "2")));
        assert!(lower.len() == 12 && lower.iter().all(|left| left.name.starts_with("joint-harmonic[2]")));
        assert!(matches!(lines[9], Line::Parameter(first) if first.name == "joint-harmonic[2].sin7"));
    }
}
