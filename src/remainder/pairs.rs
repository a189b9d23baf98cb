//! Correlations between one row and all later rows, and sums over these pairs, written for vector
//! registers. Products are never fused, so that results do not depend on the processor.

use multiversion::multiversion;

use super::rows::{AXES, Rows};
use crate::numeric::kernel::dot;

/// ln 2 as the sum of a number with few digits, whose small multiples are exact, and a rest.
const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
/// Number whose addition rounds a small number to an integer, in the last digits of the sum.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// Smallest argument of the exponential function, which is 3e-308 there.
const MIN_EXPONENT: f64 = -708.0;
/// Coefficients 1/k! of the exponential function from k = 13 down to k = 2.
const COEFFICIENTS: [f64; 12] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
];

/// Values for one row and itself, and for it and each later row: the pairs of the row.
pub(super) struct PairColumn {
    /// For each site j, the correlations of the function uⱼ of its own command, one per pair;
    /// behind them those of the functions vⱼ of all inputs.
    correlations: Vec<f64>,
    /// For each site j, the derivatives of its correlations with respect to ln ℓᵤⱼ; behind them
    /// those of the others with respect to −½ d². d is the distance of both rows in units of ℓᵥ.
    slopes: Vec<f64>,
    count: usize,
}

impl PairColumn {
    /// Creates the column for `sites` sites and `count` pairs, with all values 0.
    pub fn new(sites: usize, count: usize) -> Self {
        let zeros = vec![0.0; (sites + 1) * count];
        Self { correlations: zeros.clone(), slopes: zeros, count }
    }

    /// Returns correlations and slopes of a site, or those of the functions of all inputs if `site`
    /// is the number of sites.
    pub fn of(&self, site: usize) -> (&[f64], &[f64]) {
        let range = site * self.count..(site + 1) * self.count;
        (&self.correlations[range.clone()], &self.slopes[range])
    }

    /// Computes correlations and slopes from the squared distances in units of the length.
    pub fn set(&mut self, site: usize, squared: &[f64]) {
        let range = site * self.count..(site + 1) * self.count;
        let (correlations, slopes) =
            (&mut self.correlations[range.clone()], &mut self.slopes[range]);
        materns(squared, correlations, slopes);
    }

    /// Computes them for the function of a site's own command, whose slopes are with respect to the
    /// logarithm of its length.
    pub fn set_single(&mut self, site: usize, squared: &[f64]) {
        self.set(site, squared);
        let slopes = &mut self.slopes[site * self.count..(site + 1) * self.count];
        slopes.iter_mut().zip(squared).for_each(|(slope, squared)| *slope *= squared);
    }
}

/// Derivatives of the positions of rows with respect to the errors at all sites, stored row after
/// row for each axis and site.
pub(super) struct Levers {
    entries: Vec<f64>,
    rows: usize,
    sites: usize,
}

impl Levers {
    pub fn new(rows: &Rows) -> Self {
        let (n, sites) = (rows.len(), rows.sites.nrows());
        let of = |axis: usize, site: usize| {
            (0..n).map(move |row| rows.sites_of(AXES * row + axis)[site])
        };
        let entries = (0..AXES).flat_map(|axis| (0..sites).flat_map(move |site| of(axis, site)));
        Self { entries: entries.collect(), rows: n, sites }
    }

    /// Returns the derivatives along one axis with respect to one site, from row `first` on.
    pub fn from(&self, first: usize, (axis, site): (usize, usize)) -> &[f64] {
        let place = axis * self.sites + site;
        &self.entries[place * self.rows + first..(place + 1) * self.rows]
    }
}

/// Writes the Matérn 5/2 correlations at d² = `squared`, and their derivatives with respect to −½
/// d². See [`super::kernel::matern`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn materns(squared: &[f64], correlations: &mut [f64], slopes: &mut [f64]) {
    let outputs = correlations.iter_mut().zip(slopes);
    for (squared, (correlation, slope)) in squared.iter().zip(outputs) {
        let scaled = (5.0 * squared).sqrt();
        // exp(x) = 2ᵏ exp(x − k ln 2), the latter by its series.
        let x = (-scaled).max(MIN_EXPONENT);
        let rounded = x * std::f64::consts::LOG2_E + ROUNDING;
        let k = rounded - ROUNDING;
        let rest = (x - k * LN_2[0]) - k * LN_2[1];
        let mut series = COEFFICIENTS[0];
        for coefficient in &COEFFICIENTS[1..] {
            series = series * rest + coefficient;
        }
        let power = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
        let decay = (1.0 + (rest + rest * rest * series)) * power;
        *correlation = (1.0 + scaled + 5.0 / 3.0 * squared) * decay;
        *slope = 5.0 / 3.0 * (1.0 + scaled) * decay;
    }
}

/// Adds a b `factor` to `out`, entry by entry.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn add_products(out: &mut [f64], a: &[f64], b: &[f64], factor: f64) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        *out += a * factor * b;
    }
}

/// Returns aᵀb.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
pub(super) fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    dot(a, b)
}

#[cfg(test)]
mod tests {
    use super::super::kernel::matern;
    use super::*;

    #[test]
    fn correlations_of_many_pairs_are_those_of_single_ones() {
        let mut squared: Vec<f64> = (0..3000).map(|k| (0.02 * f64::from(k)).powi(2)).collect();
        squared.extend([0.0, 1e-300, 1e5, 1e12]);
        let mut column = PairColumn::new(1, squared.len());
        column.set(1, &squared);
        let (correlations, slopes) = column.of(1);
        for (k, &squared) in squared.iter().enumerate() {
            let expected = matern(squared);
            for (value, expected) in [(correlations[k], expected.0), (slopes[k], expected.1)] {
                assert!((value - expected).abs() <= 2e-15 * expected + 1e-290, "{squared}");
            }
        }
    }
}
