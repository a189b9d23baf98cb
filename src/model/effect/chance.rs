//! Share of a family's prior probability that one of its members has, and prior sizes of
//! parameters.

use std::collections::BTreeSet;
use std::f64::consts::PI;

use super::place::{MIN_MOMENT, greatest_moment, slides};
use crate::laws::{Argument, Chance, Effect, Prior};
use crate::problem::{Body, Joint, JointKind, Problem};

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

/// Prior size of the coupling of twist and bending for a beam declared rigid in both [1/(N·m²)].
const RIGID_COUPLING: f64 = 1e-2;

impl Effect {
    /// Returns the prior size (1 σ, SI) that `prior` gives on the arm of `problem`; `None` if the
    /// arm lacks the joint, beam or argument that the rule refers to.
    pub(super) fn size(&self, prior: Prior, problem: &Problem) -> Option<f64> {
        let moment = || Some(greatest_moment(problem, self.joint()?).max(MIN_MOMENT));
        let length = |key: &str| match self.argument(key) {
            Some(Argument::Point([x, y])) => Some(x.hypot(y)),
            _ => None,
        };
        Some(match prior {
            Prior::Size(size) => size,
            Prior::OfCubedMoment(angle) => angle / moment()?.powi(3),
            // The moment of a spring is l h times its rate, or h times its preload. l h is at most
            // |A| |B|, and h, the distance of the line of pull from the axis, at most the shorter
            // lever.
            Prior::SpringRate => moment()? / (length("anchor_m")? * length("lever_m")?),
            Prior::SpringPreload => moment()? / length("anchor_m")?.min(length("lever_m")?),
            Prior::TwistCoupling { about_z } => {
                let beam = problem.joints.get(self.beam(problem)?)?.beam.as_ref()?;
                // The size is 1/√(EI GJ). If one rigidity is not declared, the other one is used
                // for both.
                match (if about_z { beam.ei_z } else { beam.ei_y }, beam.gj) {
                    (Some(ei), Some(gj)) => (ei * gj).sqrt().recip(),
                    (Some(rigidity), None) | (None, Some(rigidity)) => rigidity.recip(),
                    (None, None) => RIGID_COUPLING,
                }
            }
            Prior::HalfLength => problem.joints.get(self.beam(problem)?)?.a.abs() / 2.0,
            Prior::BodyMass => Body::total_mass(&problem.joints.get(self.joint()? - 1)?.bodies),
        })
    }
}
