//! How well the data determine parameters and their combinations.

use std::collections::BTreeMap;

use crate::fit::Estimate;
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
pub(crate) const MAX_COEFFICIENTS: usize = 8;
/// Number of largest harmonics of a joint that are listed if it has more coefficients.
pub(crate) const MAX_SHOWN_HARMONICS: usize = 4;

/// How well the data determine a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Knowledge {
    /// The estimate rests on a bound.
    AtBound(AtBound),
    /// The parameter was not fitted.
    NotFitted,
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
    /// Classifies an estimate.
    pub fn of(estimate: &Estimate) -> Self {
        match (estimate.at_bound, estimate.fitted, estimate.identified) {
            (Some(bound), ..) => Self::AtBound(bound),
            (None, false, _) => Self::NotFitted,
            (None, true, share) if share > MIN_WELL_IDENTIFIED && is_vague(estimate) => {
                Self::Vaguely
            }
            (None, true, share) if share > MIN_WELL_IDENTIFIED => Self::Well,
            (None, true, share) if share > MIN_PARTLY_IDENTIFIED => Self::InPart,
            (None, true, share) if share > MAX_UNIDENTIFIED => Self::Hardly,
            _ => Self::NotAtAll,
        }
    }

    /// Returns true if the data determine the parameter, rather than its prior.
    pub fn is_identified(self) -> bool {
        matches!(self, Self::Well | Self::Vaguely)
    }

    /// Returns true if the parameter was not fitted or rests on a bound.
    pub fn is_held(self) -> bool {
        matches!(self, Self::AtBound(_) | Self::NotFitted)
    }
}

/// Returns true if the standard error is too large for a calibration.
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

/// Harmonics of joints that have too many coefficients to list one by one. Contains joint (from 1)
/// and order of each coefficient, and the largest orders of each of these joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ManyHarmonics {
    coefficients: BTreeMap<String, (usize, u32)>,
    /// For each joint, the orders of the largest amplitudes and the number of smaller harmonics.
    largest: BTreeMap<usize, (Vec<u32>, usize)>,
}

impl ManyHarmonics {
    /// Selects the harmonics that the problem declares.
    pub fn new(problem: &Problem, estimates: &[Estimate]) -> Self {
        let place = |regressor: &Regressor| match *regressor {
            Regressor::Sine(joint, order) | Regressor::Cosine(joint, order) => {
                Some((joint + 1, order))
            }
            _ => None,
        };
        let parameters = effect::parameters(problem).into_iter();
        let coefficients = parameters
            .filter_map(|parameter| Some((parameter.name, place(&parameter.regressor)?)))
            .collect();
        Self::among(coefficients, estimates)
    }

    fn among(coefficients: BTreeMap<String, (usize, u32)>, estimates: &[Estimate]) -> Self {
        let mut joints: BTreeMap<usize, (usize, BTreeMap<u32, f64>)> = BTreeMap::new();
        for estimate in estimates {
            if let Some((joint, order)) = coefficients.get(&estimate.name) {
                let (count, heights) = joints.entry(*joint).or_default();
                *count += 1;
                *heights.entry(*order).or_default() += estimate.estimate * estimate.estimate;
            }
        }
        joints.retain(|_, (count, _)| *count > MAX_COEFFICIENTS);
        let shown = |(joint, (_, heights)): (usize, (usize, BTreeMap<u32, f64>))| {
            let mut orders: Vec<u32> = heights.keys().copied().collect();
            orders.sort_by(|a, b| heights[b].total_cmp(&heights[a]));
            orders.truncate(MAX_SHOWN_HARMONICS);
            (joint, (orders, heights.len().saturating_sub(MAX_SHOWN_HARMONICS)))
        };
        Self { largest: joints.into_iter().map(shown).collect(), coefficients }
    }

    /// Returns true if a parameter is a coefficient of one of the smaller harmonics.
    pub fn is_smaller(&self, name: &str) -> bool {
        self.coefficients.get(name).is_some_and(|(joint, order)| {
            self.largest.get(joint).is_some_and(|(orders, _)| !orders.contains(order))
        })
    }

    /// Returns the joint of a harmonic coefficient (from 1) and the number of smaller harmonics of
    /// the joint that are not listed; `None` for other parameters, or if all harmonics are listed.
    pub fn joint_of(&self, name: &str) -> Option<(usize, usize)> {
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
        let many = ManyHarmonics::among(coefficients, &estimates);
        // Joint 1 has few enough to list all of them.
        assert_eq!(many.largest, BTreeMap::from([(2, (vec![10, 9, 8, 7], 6))]));
        assert!(
            many.is_smaller("2.sin6") && !many.is_smaller("2.cos7") && !many.is_smaller("1.sin1")
        );
        assert_eq!((many.joint_of("2.sin9"), many.joint_of("tool.x")), (Some((2, 6)), None));
    }
}
