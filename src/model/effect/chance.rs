//! Share of a family's prior probability that one of its members has.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use super::place::slides;
use crate::laws::{Chance, Effect};
use crate::problem::{Joint, JointKind, Problem};

/// Prior probability of all orders between k and k + 1 together, relative to that of order k. Gears
/// have integer tooth counts, so most errors repeat an integer number of times a revolution; those
/// of an inner gear stage need not.
const FRACTIONAL_SHARE: f64 = 0.2;
/// Natural logarithm of the ratio of longest to shortest lead of a screw (or pitch of a rack) that
/// is considered. The prior is uniform in ln(lead).
const LOG_LEAD_RANGE: f64 = 7.0;

impl Effect {
    /// Returns the effective number of tries (Bonferroni factor) at the effect: the reciprocal of
    /// its share of its family's prior probability. `members` are the candidates of the family.
    pub(crate) fn tries(&self, members: &[&Self], problem: &Problem) -> f64 {
        match self.family().map_or(Chance::Equal, |family| family.chance) {
            Chance::Equal => members.len().max(1) as f64,
            Chance::Orders => {
                // The probability of order k falls as 1/k², and Σ 1/k² = π²/6: n π²/6 k² tries at n
                // joints. Low orders have known physical causes, high orders do not.
                let joints: BTreeSet<usize> =
                    members.iter().filter_map(|member| member.joint()).collect();
                let order = self.waves().iter().map(|wave| wave.1).fold(1.0, f64::max);
                joints.len().max(1) as f64 * PI.powi(2) / 6.0 * order * order
            }
            Chance::Waves => {
                let of_kind = |kind| {
                    let is_it = |joint: &&Joint| joint.command_kind() == kind;
                    problem.joints.iter().filter(is_it).count().max(1) as f64
                };
                let (joint, order) = self.waves().first().copied().unwrap_or((1, 1.0));
                let order = order.max(1.0);
                // The prior is uniform in ln(lead), and a unit interval of ln(lead) contains about
                // k orders.
                if slides(problem, joint) {
                    return of_kind(JointKind::Prismatic) * LOG_LEAD_RANGE * order;
                }
                // All waves with orders between k and k + 1 together have `FRACTIONAL_SHARE` times
                // the probability of a harmonic of order k at a revolute joint.
                of_kind(JointKind::Revolute) * PI.powi(2) / 6.0 * order.powi(2) / FRACTIONAL_SHARE
            }
        }
    }
}
