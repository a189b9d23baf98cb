//! Many waves of one joint's command that add to the same, summed in one pass.

use multiversion::multiversion;

use super::driven::{Driven, Place};
use crate::model::parameter::Regressor;

/// Orders that are summed side by side.
const LANES: usize = 4;
/// Waves from which on a sum is worth a pass.
const MANY: usize = 8;
/// The least that a turn by [`LANES`] orders may have on average of its sines and cosines.
const DENSE: usize = 2;
/// Orders up to which there is a sum.
const HIGHEST: u32 = 1024;

/// Σ aₖ sin kq + bₖ cos kq over orders k = 1, 2, … of one joint's command q.
#[derive(Debug, Clone)]
pub(super) struct Series {
    pub place: Place,
    joint: usize,
    /// aₖ and bₖ of some orders after others.
    terms: Vec<[[f64; LANES]; 2]>,
}

impl Series {
    /// Takes out of what drives a pose the waves of a joint that add to the same, where these are
    /// many and leave few orders out.
    pub fn take(all: &mut Vec<Driven>) -> Vec<Self> {
        let mut found: Vec<(Self, usize)> = Vec::new();
        for &Driven { place, regressor, value } in &*all {
            let Some((joint, order, of)) = wave(regressor) else { continue };
            let is_it = |(own, _): &(Self, usize)| (own.place, own.joint) == (place, joint);
            let number = found.iter().position(is_it).unwrap_or(found.len());
            if number == found.len() {
                found.push((Self { place, joint, terms: Vec::new() }, 0));
            }
            let (series, waves) = &mut found[number];
            *waves += 1;
            let (turn, lane) = (order / LANES, order % LANES);
            if series.terms.len() <= turn {
                series.terms.resize(turn + 1, [[0.0; LANES]; 2]);
            }
            series.terms[turn][of][lane] += value;
        }
        found.retain(|(series, waves)| *waves >= MANY && *waves >= DENSE * series.terms.len());
        let taken: Vec<Self> = found.into_iter().map(|(series, _)| series).collect();
        all.retain(|own| {
            wave(own.regressor).is_none_or(|(joint, ..)| {
                !taken.iter().any(|series| (series.place, series.joint) == (own.place, joint))
            })
        });
        taken
    }

    /// Its value in a configuration.
    pub fn value(&self, configuration: &[f64]) -> f64 {
        sum(&self.terms, configuration[self.joint].sin_cos())
    }
}

/// Joint, order less one, and whether it is a cosine, of a regressor that is a wave of a whole order.
fn wave(regressor: Regressor) -> Option<(usize, usize, usize)> {
    match regressor {
        Regressor::Sine(joint, order) if (1..=HIGHEST).contains(&order) => {
            Some((joint, order as usize - 1, 0))
        }
        Regressor::Cosine(joint, order) if (1..=HIGHEST).contains(&order) => {
            Some((joint, order as usize - 1, 1))
        }
        _ => None,
    }
}

/// The sum at a command of this sine and cosine: those of the next orders come by turns.
#[multiversion(targets("x86_64+avx2"))]
fn sum(terms: &[[[f64; LANES]; 2]], first: (f64, f64)) -> f64 {
    let turned = |(sin, cos): (f64, f64), (by_sin, by_cos): (f64, f64)| {
        (sin * by_cos + cos * by_sin, cos * by_cos - sin * by_sin)
    };
    let (mut sines, mut cosines) = ([first.0; LANES], [first.1; LANES]);
    for lane in 1..LANES {
        (sines[lane], cosines[lane]) = turned((sines[lane - 1], cosines[lane - 1]), first);
    }
    let by = (sines[LANES - 1], cosines[LANES - 1]);
    let mut sums = [0.0; LANES];
    for [a, b] in terms {
        for lane in 0..LANES {
            sums[lane] += a[lane] * sines[lane] + b[lane] * cosines[lane];
            (sines[lane], cosines[lane]) = turned((sines[lane], cosines[lane]), by);
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
        let place = Place::Joint(0);
        let mut all: Vec<Driven> = Vec::new();
        for order in 1..=43 {
            let value = 1e-3 / f64::from(order);
            all.push(Driven { place, regressor: Regressor::Sine(1, order), value });
            all.push(Driven { place, regressor: Regressor::Cosine(1, order), value: -2.0 * value });
        }
        // Others stay by themselves: another place, few waves, orders far apart.
        let few = [(Place::Joint(2), 1, 3), (place, 2, 1), (place, 2, 400)];
        let few = few.map(|(place, joint, order)| Driven {
            place,
            regressor: Regressor::Sine(joint, order),
            value: 1.0,
        });
        let mut left: Vec<Driven> = all.iter().chain(&few).copied().collect();
        left.push(Driven { place, regressor: Regressor::Elapsed, value: 1.0 });
        let series = Series::take(&mut left);
        assert!(series.len() == 1 && left.len() == 4 && left[..3] == few);
        for k in -30..30 {
            let configuration = [0.4, 0.21 * f64::from(k), 1.0];
            let pose = PoseView::from_configuration(&configuration);
            let expected: f64 = all.iter().map(|own| own.value * own.regressor.value(&pose)).sum();
            assert!((series[0].value(&configuration) - expected).abs() < 1e-15);
        }
    }
}
