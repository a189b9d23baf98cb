//! Functions without a law of one joint coordinate that are not smooth: a free value in every pose,
//! harmonics with slowly changing amplitude, and periodic errors with many orders.

use nalgebra::{DMatrix, DVector};

use super::block::Design;
use super::columns::Columns;
use super::functions::expand;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use crate::model::parameter::ParameterSite;
use crate::problem::{Effect, EffectDeclaration, JointKind};
use crate::residual_tests::Covariate;
use crate::select::harmonic_prior::{MIN_GEAR_ORDERS, is_periodic_of_many_orders_at};
use crate::select::settings::{GEAR_ORDERS, MAX_NEAR_ORDER, SLOW_LENGTH};

/// Number of different commands per order that distinguish a periodic error from other functions:
/// twice its number of coefficients.
const LEVELS_PER_ORDER: usize = 4;

impl Columns<'_, '_> {
    /// Adds the hypothesis that the coordinate `site` has a free error in every pose.
    pub(super) fn add_per_pose(&mut self, site: ParameterSite, at: &DVector<f64>) {
        let hypothesis =
            Hypothesis::new(HypothesisKind::PerPose, Site::of(site), Some(site), Vec::new());
        self.add_design("per pose", 1.0, hypothesis, || Design::per_pose(at));
    }

    /// Adds harmonics of a joint's command with slowly changing amplitude and phase. They
    /// approximate non-integer orders and sums of neighbouring orders.
    pub(super) fn add_near_harmonics(
        &mut self,
        site: ParameterSite,
        at: &DVector<f64>,
        joint: usize,
    ) {
        if self.problem.joints[joint].command_kind() != JointKind::Revolute {
            return;
        }
        let Some(command) = self.sampled(Covariate::Command(joint), self.command(joint)) else {
            return;
        };
        let slow = command.basis(SLOW_LENGTH);
        for order in 1..=MAX_NEAR_ORDER {
            let waves = || {
                let (k, mut waves) = (slow.ncols(), DMatrix::zeros(slow.nrows(), 2 * slow.ncols()));
                for (row, q) in command.values.iter().enumerate() {
                    let (sin, cos) = (f64::from(order) * q).sin_cos();
                    for j in 0..k {
                        waves[(row, j)] = slow[(row, j)] * sin;
                        waves[(row, j + k)] = slow[(row, j)] * cos;
                    }
                }
                waves
            };
            let (kind, depends_on) =
                (HypothesisKind::NearHarmonic(order), vec![command.covariate.clone()]);
            let hypothesis = Hypothesis::new(kind, Site::Joint(joint), Some(site), depends_on);
            self.add("near harmonic", 1.0 / f64::from(order * order), hypothesis, || {
                expand(&[at], &waves())
            });
        }
    }

    /// Adds periodic errors of a joint with many orders under one prior, one hypothesis for each
    /// highest order. Adds none if the fit contains one, or if the command has too few different
    /// values.
    pub(super) fn add_periodic_errors(
        &mut self,
        site: ParameterSite,
        at: &DVector<f64>,
        joint: usize,
    ) {
        let is_present = |declared: &EffectDeclaration| {
            is_periodic_of_many_orders_at(&declared.effect, joint + 1)
        };
        if !self.admits_common_prior || self.problem.effects.iter().any(is_present) {
            return;
        }
        let Some(command) = self.sampled(Covariate::Command(joint), self.command(joint)) else {
            return;
        };
        for highest in GEAR_ORDERS {
            if command.levels < LEVELS_PER_ORDER * highest as usize {
                continue;
            }
            let is_declared = |order: &u32| {
                let single = Effect::JointHarmonic { joint: joint + 1, orders: vec![*order] };
                self.problem.effects.iter().any(|declared| declared.effect.covers(&single))
            };
            // A common prior is used only for at least this many orders that are not declared.
            if (1..=highest).filter(|order| !is_declared(order)).count() < MIN_GEAR_ORDERS {
                continue;
            }
            let hypothesis = Hypothesis::new(
                HypothesisKind::Gear(highest),
                Site::Joint(joint),
                Some(site),
                vec![command.covariate.clone()],
            );
            self.add("gear", 1.0, hypothesis, || {
                let waves =
                    DMatrix::from_fn(command.values.len(), 2 * highest as usize, |row, k| {
                        let phase = (k / 2 + 1) as f64 * command.values[row];
                        if k % 2 == 0 { phase.sin() } else { phase.cos() }
                    });
                expand(&[at], &waves)
            });
        }
    }
}
