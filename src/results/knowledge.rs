//! Classes of parameters by how well the data determine them, and joints with many harmonics.

use std::collections::BTreeMap;

use crate::fit::{ActiveConstraint, Estimate};
use crate::least_squares::solver::AtBound;
use crate::model::effect;
use crate::model::parameter::Regressor;
use crate::problem::Problem;
use crate::quantity::Unit;

/// Identified share above which a parameter is well identified.
const MIN_WELL_IDENTIFIED: f64 = 0.9;
/// Identified share above which a parameter is identified in part.
const MIN_PARTLY_IDENTIFIED: f64 = 0.1;
/// Identified share up to which a parameter is not identified at all.
const MAX_UNIDENTIFIED: f64 = 1e-6;
/// Maximum number of harmonic coefficients of one joint that are listed one by one.
pub(crate) const MAX_LISTED_COEFFICIENTS: usize = 8;
/// Number of harmonics with the largest amplitudes that are listed for a joint with more
/// coefficients than [`MAX_LISTED_COEFFICIENTS`].
pub(crate) const MAX_SHOWN_HARMONICS: usize = 4;

/// Class of a parameter by how well the data determine it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knowledge {
    /// The estimate rests on a bound.
    AtBound(AtBound),
    /// The parameter was not fitted.
    NotFitted,
    /// Active constraints alone decide the parameter.
    SetByConstraints,
    /// The data determine the parameter.
    Well,
    /// The data determine the parameter, but with a standard error too large for a calibration:
    /// above 1°, 10 mm, or half the value of a stiffness.
    Vaguely,
    /// The data and the prior together determine the parameter.
    InPart,
    /// The prior, or the start value, determines nearly all of the parameter.
    Hardly,
    /// The data contain no information on the parameter.
    NotAtAll,
}

impl Knowledge {
    /// Classifies an estimate by its bound, its identified share and its standard error, and by the
    /// active constraints of its fit.
    pub fn of(estimate: &Estimate, constraints: &[ActiveConstraint]) -> Self {
        let is_constrained = || constraints.iter().any(|active| active.holds(&estimate.name));
        match (estimate.at_bound, estimate.fitted, estimate.identified) {
            (Some(bound), ..) => Self::AtBound(bound),
            (None, false, _) => Self::NotFitted,
            (None, true, share) if share > MIN_WELL_IDENTIFIED && is_vague(estimate) => {
                Self::Vaguely
            }
            (None, true, share) if share > MIN_WELL_IDENTIFIED => Self::Well,
            (None, true, share) if share > MIN_PARTLY_IDENTIFIED => Self::InPart,
            (None, true, share) if share > MAX_UNIDENTIFIED => Self::Hardly,
            _ if is_constrained() => Self::SetByConstraints,
            _ => Self::NotAtAll,
        }
    }

    /// Returns true if the data determine the parameter, not its prior or a bound.
    pub fn is_identified(self) -> bool {
        matches!(self, Self::Well | Self::Vaguely)
    }

    /// Returns true if the estimate rests on a bound, or if active constraints alone decide it.
    pub fn is_limited(self) -> bool {
        matches!(self, Self::AtBound(_) | Self::SetByConstraints)
    }
}

/// Returns true if the standard error is missing or too large for a calibration: above 1°, 10 mm, or
/// half of a stiffness or rigidity.
fn is_vague(estimate: &Estimate) -> bool {
    let limit = match estimate.unit {
        Unit::Angle => 1.0_f64.to_radians(),
        Unit::Length => 0.01,
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => {
            0.5 * estimate.estimate
        }
        _ => f64::INFINITY,
    };
    estimate.std_error.is_none_or(|error| error > limit)
}

/// Harmonics of joints, some of which have too many coefficients to list one by one.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LargestHarmonics {
    /// Joint (from 1) and order of each harmonic coefficient, by the parameter's name.
    coefficients: BTreeMap<String, (usize, u32)>,
    /// For each joint (from 1) with too many coefficients: the orders of its largest amplitudes,
    /// and the number of its smaller harmonics.
    largest: BTreeMap<usize, (Vec<u32>, usize)>,
}

impl LargestHarmonics {
    /// Finds the declared harmonics of all joints, and those with the largest estimated amplitudes.
    pub fn of(problem: &Problem, estimates: &[Estimate]) -> Self {
        let joint_and_order = |regressor: &Regressor| match *regressor {
            Regressor::Sine(joint, order) | Regressor::Cosine(joint, order) => {
                Some((joint + 1, order))
            }
            _ => None,
        };
        let parameters = effect::parameters(problem).into_iter();
        let coefficients = parameters
            .filter_map(|parameter| Some((parameter.name, joint_and_order(&parameter.regressor)?)))
            .collect();
        Self::from_coefficients(coefficients, estimates)
    }

    fn from_coefficients(
        coefficients: BTreeMap<String, (usize, u32)>,
        estimates: &[Estimate],
    ) -> Self {
        let mut joints: BTreeMap<usize, (usize, BTreeMap<u32, f64>)> = BTreeMap::new();
        for estimate in estimates {
            if let Some((joint, order)) = coefficients.get(&estimate.name) {
                let (count, squares) = joints.entry(*joint).or_default();
                *count += 1;
                *squares.entry(*order).or_default() += estimate.estimate * estimate.estimate;
            }
        }
        joints.retain(|_, (count, _)| *count > MAX_LISTED_COEFFICIENTS);
        let shown = |(joint, (_, squares)): (usize, (usize, BTreeMap<u32, f64>))| {
            let mut orders: Vec<u32> = squares.keys().copied().collect();
            orders.sort_by(|a, b| squares[b].total_cmp(&squares[a]));
            orders.truncate(MAX_SHOWN_HARMONICS);
            (joint, (orders, squares.len().saturating_sub(MAX_SHOWN_HARMONICS)))
        };
        Self { largest: joints.into_iter().map(shown).collect(), coefficients }
    }

    /// Returns true if the parameter `name` is a coefficient of one of the smaller harmonics, which
    /// are not listed.
    pub fn is_smaller(&self, name: &str) -> bool {
        self.coefficients.get(name).is_some_and(|(joint, order)| {
            self.largest.get(joint).is_some_and(|(orders, _)| !orders.contains(order))
        })
    }

    /// Returns the joint (from 1) of the harmonic coefficient `name` and the number of smaller
    /// harmonics of this joint, which are not listed. `None` for other parameters, or if all
    /// harmonics of the joint are listed.
    pub fn joint_with_smaller(&self, name: &str) -> Option<(usize, usize)> {
        let (joint, _) = self.coefficients.get(name)?;
        let (_, smaller) = self.largest.get(joint)?;
        (*smaller > 0).then_some((*joint, *smaller))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(name: &str, value: f64) -> Estimate {
        Estimate {
            name: name.to_owned(),
            unit: Unit::Angle,
            nominal: 0.0,
            estimate: value,
            std_error: None,
            identified: 1.0,
            at_bound: None,
            shadow_price: None,
            fitted: true,
            prior_sigma: None,
        }
    }

    #[test]
    fn the_largest_of_many_harmonics_are_listed() {
        let harmonics = [(1, 4_u32), (2, 10)].into_iter().flat_map(|(joint, orders)| {
            (1..=orders).flat_map(move |order| {
                ["sin", "cos"].map(|part| (format!("{joint}.{part}{order}"), (joint, order)))
            })
        });
        let coefficients: BTreeMap<String, (usize, u32)> = harmonics.collect();
        let mut estimates = vec![estimate("tool.x", 1.0)];
        estimates.extend(
            coefficients.iter().map(|(name, (_, order))| estimate(name, f64::from(*order))),
        );
        let many = LargestHarmonics::from_coefficients(coefficients, &estimates);
        // Joint 1 has few enough to list all of them.
        assert_eq!(many.largest, BTreeMap::from([(2, (vec![10, 9, 8, 7], 6))]));
        assert!(
            many.is_smaller("2.sin6") && !many.is_smaller("2.cos7") && !many.is_smaller("1.sin1")
        );
        assert_eq!(
            (many.joint_with_smaller("2.sin9"), many.joint_with_smaller("tool.x")),
            (Some((2, 6)), None)
        );
    }
}
