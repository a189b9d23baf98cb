//! Sums of many harmonics of one joint's command, evaluated in one pass.

use multiversion::multiversion;

use super::command_term::{CommandTerm, TermSite};
use crate::model::parameter::Regressor;

/// Number of consecutive orders that are evaluated together by one vector operation.
const LANES: usize = 4;
/// Minimum number of harmonics from which a sum by recurrence is faster than separate evaluation
/// (timed).
const MIN_HARMONICS: usize = 8;
/// Smallest average number of sines and cosines in a group of [`LANES`] orders at which a sum is
/// used. With fewer, most lanes would multiply zeros.
const MIN_TERMS_PER_GROUP: usize = 2;
/// Largest order k in a sum; it limits the memory of a sum with few high orders.
const MAX_SUMMED_ORDER: u32 = 1024;

/// Sum Σ aₖ sin kq + bₖ cos kq over orders k = 1, 2, … of one joint's command q.
#[derive(Debug, Clone)]
pub(super) struct HarmonicSum {
    pub site: TermSite,
    joint: usize,
    /// Coefficients aₖ, then bₖ, in groups of [`LANES`] consecutive orders.
    terms: Vec<[[f64; LANES]; 2]>,
}

impl HarmonicSum {
    /// Removes from `terms` the harmonics of a joint that add to the same quantity, if they are
    /// many and dense, and returns their sums.
    pub fn take_from(terms: &mut Vec<CommandTerm>) -> Vec<Self> {
        let mut found: Vec<(Self, usize)> = Vec::new();
        for CommandTerm { site, regressor, value } in &*terms {
            let (site, value) = (*site, *value);
            let Some((joint, order, of)) = as_harmonic(regressor) else { continue };
            let is_it = |(sum, _): &(Self, usize)| (sum.site, sum.joint) == (site, joint);
            let number = found.iter().position(is_it).unwrap_or(found.len());
            if number == found.len() {
                found.push((Self { site, joint, terms: Vec::new() }, 0));
            }
            let (series, waves) = &mut found[number];
            *waves += 1;
            let (group, lane) = (order / LANES, order % LANES);
            if series.terms.len() <= group {
                series.terms.resize(group + 1, [[0.0; LANES]; 2]);
            }
            series.terms[group][of][lane] += value;
        }
        found.retain(|(series, waves)| {
            *waves >= MIN_HARMONICS && *waves >= MIN_TERMS_PER_GROUP * series.terms.len()
        });
        let series_found: Vec<Self> = found.into_iter().map(|(series, _)| series).collect();
        terms.retain(|term| {
            as_harmonic(&term.regressor).is_none_or(|(joint, ..)| {
                !series_found.iter().any(|series| (series.site, series.joint) == (term.site, joint))
            })
        });
        series_found
    }

    /// Returns the value of the sum at the commands `configuration` \[rad\] or \[m\].
    pub fn value(&self, configuration: &[f64]) -> f64 {
        evaluate(&self.terms, configuration[self.joint].sin_cos())
    }
}

/// Returns (joint, order − 1, 0 for a sine or 1 for a cosine); `None` if the regressor is no
/// harmonic of integer order up to [`MAX_SUMMED_ORDER`].
fn as_harmonic(regressor: &Regressor) -> Option<(usize, usize, usize)> {
    match *regressor {
        Regressor::Sine(joint, order) if (1..=MAX_SUMMED_ORDER).contains(&order) => {
            Some((joint, order as usize - 1, 0))
        }
        Regressor::Cosine(joint, order) if (1..=MAX_SUMMED_ORDER).contains(&order) => {
            Some((joint, order as usize - 1, 1))
        }
        _ => None,
    }
}

/// Returns the sum for `first` = (sin q, cos q). Angle-addition formulas give the higher orders.
#[multiversion(targets("x86_64+avx2"))]
fn evaluate(terms: &[[[f64; LANES]; 2]], first: (f64, f64)) -> f64 {
    let rotated = |(sin, cos): (f64, f64), (by_sin, by_cos): (f64, f64)| {
        (sin * by_cos + cos * by_sin, cos * by_cos - sin * by_sin)
    };
    let (mut sines, mut cosines) = ([first.0; LANES], [first.1; LANES]);
    for lane in 1..LANES {
        (sines[lane], cosines[lane]) = rotated((sines[lane - 1], cosines[lane - 1]), first);
    }
    let by = (sines[LANES - 1], cosines[LANES - 1]);
    let mut sums = [0.0; LANES];
    for [a, b] in terms {
        for lane in 0..LANES {
            sums[lane] += a[lane] * sines[lane] + b[lane] * cosines[lane];
            (sines[lane], cosines[lane]) = rotated((sines[lane], cosines[lane]), by);
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::PoseView;

    #[test]
    fn a_series_is_the_sum_of_its_waves() {
        let site = TermSite::Joint(0);
        let mut terms: Vec<CommandTerm> = Vec::new();
        for order in 1..=43 {
            let value = 1e-3 / f64::from(order);
            terms.push(CommandTerm { site, regressor: Regressor::Sine(1, order), value });
            terms.push(CommandTerm {
                site,
                regressor: Regressor::Cosine(1, order),
                value: -2.0 * value,
            });
        }
        // These terms are not summed: they are few, sparse, or add to another quantity.
        let few = [(TermSite::Joint(2), 1, 3), (site, 2, 1), (site, 2, 400)];
        let few = few.map(|(site, joint, order)| CommandTerm {
            site,
            regressor: Regressor::Sine(joint, order),
            value: 1.0,
        });
        let mut remaining: Vec<CommandTerm> = terms.iter().chain(&few).cloned().collect();
        remaining.push(CommandTerm { site, regressor: Regressor::Unit, value: 1.0 });
        let series = HarmonicSum::take_from(&mut remaining);
        assert!(series.len() == 1 && remaining.len() == 4 && remaining[..3] == few);
        for k in -30..30 {
            let configuration = [0.4, 0.21 * f64::from(k), 1.0];
            let pose = PoseView::from_configuration(&configuration);
            let expected: f64 =
                terms.iter().map(|term| term.value * term.regressor.value(&pose)).sum();
            assert!((series[0].value(&configuration) - expected).abs() < 1e-15);
        }
    }
}
