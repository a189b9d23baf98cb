//! Commands beyond the ranges of their joints.

use super::Measurements;
use crate::error::{Warning, WarningKind};
use crate::problem::{Joint, JointKind, Problem};

/// How far beyond its limit a command may be for rounding alone [rad] or [m].
const ROUNDING: f64 = 1e-6;

impl Measurements {
    /// A warning for each joint that was commanded beyond its declared range, at the first such row.
    pub fn beyond_limits(&self, problem: &Problem) -> Vec<Warning> {
        let warning = |(index, joint): (usize, &Joint)| {
            let (min, max) = joint.limits;
            let beyond = |row: &usize| {
                let q = self.configuration(*row)[index];
                q < min - ROUNDING || q > max + ROUNDING
            };
            let rows: Vec<usize> = (0..self.len()).filter(beyond).collect();
            let location = self.location(*rows.first()?).with_key(format!("joint {}", index + 1));
            Some(Warning { location, kind: WarningKind::BeyondLimits { rows: rows.len(), limits: limits(joint) } })
        };
        problem.joints.iter().enumerate().filter_map(warning).collect()
    }
}

/// The limits of a joint as its section writes them.
fn limits(joint: &Joint) -> String {
    let (unit, factor) = match joint.kind {
        JointKind::Prismatic => ("mm", 1e3),
        JointKind::Revolute | JointKind::Fixed => ("deg", 1_f64.to_degrees()),
    };
    let shown = |(key, limit): (&str, f64)| {
        // Conversions round; nobody writes more decimals.
        limit.is_finite().then(|| format!("{key}_{unit} = {}", (limit * factor * 1e6).round() / 1e6))
    };
    let both = [("min", joint.limits.0), ("max", joint.limits.1)];
    both.into_iter().filter_map(shown).collect::<Vec<_>>().join(", ")
}
