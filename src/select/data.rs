//! Identification rows, with the quantities that the search derives from them.

use crate::select::settings::{CROSS_VALIDATION_BLOCKS, MAX_SHIFT_TIMES, MIN_POSES_BESIDE_SHIFT};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};

use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

use super::harmonic_prior::admits_common_prior;
use super::rules::SelectionRules;
use crate::fit::Stop;
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::effect::{DataCoverage, NO_REFERENCE, NO_TEMPERATURE, NO_VELOCITIES};
use crate::numeric::range;
use crate::observation::Needs;
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;
use crate::residual_tests::CovariateValues;

/// Identification rows of a data set with the settings of a search.
#[derive(Debug, Clone)]
pub(super) struct Data<'a> {
    /// Complete data set, to which problems with more effects are fitted.
    pub dataset: &'a Dataset,
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub rules: &'a SelectionRules,
    /// Identifier of the measuring conditions (configuration, loads, temperature, session, target)
    /// of each identification row. Rows with equal identifiers are repeats.
    pub setup: Vec<usize>,
    /// Index of the cross-validation block to which each identification row belongs. Rows of equal
    /// configuration belong to one block.
    pub block: Vec<usize>,
    /// Effects that the search considers in addition to those of the catalogue.
    pub candidates: &'a [Effect],
    /// True if the harmonics of all joints may have a common prior: one σ for each order.
    pub admits_common_prior: bool,
    /// True if a part that the problem declares gives way to loads.
    pub gives_way: bool,
    /// Request to stop the search early.
    pub stop: Stop,
    /// Laws that the search over formulas proposed.
    pub proposed: Proposed,
}

/// Cached laws by key.
type Proposed = Arc<Mutex<BTreeMap<ProposalKey, Vec<Effect>>>>;

/// Key of cached laws: names of the sites, names of the other hypotheses assumed, poses left out
/// with the rows set aside, and names of the fitted effects.
type ProposalKey = (String, Vec<String>, Vec<usize>, Vec<String>);

/// Number of points in images that count as one pose in the limit of the rows of evidence. A point
/// has less information than a position, and a view has many.
const IMAGE_ROWS_PER_POSE: usize = 6;

impl<'a> Data<'a> {
    pub fn new(problem: &Problem, dataset: &'a Dataset, rules: &'a SelectionRules) -> Self {
        let Dataset { measurements, split } = dataset;
        let rows = &split.identification;
        let setup = numbered(rows.iter().map(|&row| conditions_of(measurements, row)));
        let configurations =
            numbered(rows.iter().map(|&row| bits(measurements.configuration(row))));
        let count = configurations.iter().max().map_or(0, |last| last + 1);
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(rules.seed));
        let mut block_of = vec![0; count];
        for (rank, configuration) in order.into_iter().enumerate() {
            block_of[configuration] = rank % CROSS_VALIDATION_BLOCKS.min(count.max(1));
        }
        let block =
            configurations.into_iter().map(|configuration| block_of[configuration]).collect();
        Self {
            dataset,
            measurements,
            split,
            rules,
            setup,
            block,
            candidates: &[],
            admits_common_prior: admits_common_prior(problem),
            gives_way: gives_way(problem),
            stop: Stop::default(),
            proposed: Proposed::default(),
        }
    }

    /// Returns the indices of the identification rows in the table.
    pub fn rows(&self) -> &'a [usize] {
        &self.split.identification
    }

    /// Returns the values of a column at the identification rows.
    fn values_at_rows(&self, column: &[f64]) -> Vec<f64> {
        self.rows().iter().map(|&row| column[row]).collect()
    }

    /// Returns the identification rows on which evidence is evaluated: at most `evidence_poses`,
    /// or [`IMAGE_ROWS_PER_POSE`] times as many if most of them are points in images, evenly spaced
    /// in the order of the table.
    pub fn evidence_rows(&self) -> Vec<usize> {
        let rows = self.rows();
        let is_image = |row: &&usize| {
            self.measurements.observation(**row).description().needs == Needs::Carriers
        };
        let images = rows.iter().filter(is_image).count();
        let factor = if 2 * images > rows.len() { IMAGE_ROWS_PER_POSE } else { 1 };
        let count = rows.len().min(factor * self.rules.evidence_poses);
        (0..count).map(|k| rows[k * rows.len() / count]).collect()
    }

    /// Returns the time of each identification row \[s\].
    pub fn time(&self) -> Vec<f64> {
        self.values_at_rows(&self.measurements.time)
    }

    /// Returns the session of each identification row.
    pub fn session(&self) -> Vec<usize> {
        self.rows().iter().map(|&row| self.measurements.session.of_row[row]).collect()
    }

    /// Collects which quantities the identification rows record, and their ranges; these decide
    /// which effects the rows can show.
    pub fn conditions(&self, problem: &Problem) -> DataCoverage {
        let measurements = self.measurements;
        let column = |joint: usize| {
            range(self.rows().iter().map(move |&row| measurements.configuration(row)[joint]))
        };
        let varies =
            |values: Vec<f64>| values.iter().any(|value| value.to_bits() != values[0].to_bits());
        let payload = measurements.payload.as_deref().map(|values| self.values_at_rows(values));
        let temperature =
            measurements.temperature.as_deref().map(|values| self.values_at_rows(values));
        let n = measurements.joints;
        let from = |joint: usize, side: f64| {
            let came = |sides: &Vec<f64>| {
                self.rows().iter().any(|&row| sides[row * n + joint] * side > 0.0)
            };
            measurements.approach.as_ref().is_some_and(came)
        };
        DataCoverage {
            no_temperature: match temperature {
                Some(values) if varies(values.clone()) => {
                    problem.data.reference_temperature.is_none().then_some(NO_REFERENCE)
                }
                _ => Some(NO_TEMPERATURE),
            },
            approach: measurements.approach.is_some(),
            both_sides: (0..n).map(|joint| from(joint, 1.0) && from(joint, -1.0)).collect(),
            is_one_payload: payload.as_ref().is_none_or(|values| {
                let mut carried = values.iter().filter(|payload| **payload > 0.0);
                carried
                    .next()
                    .is_none_or(|first| carried.all(|payload| payload.total_cmp(first).is_eq()))
            }),
            payload: payload.map_or([problem.tool.payload_mass; 2].into(), range),
            ranges: (0..n).map(column).collect(),
            covariates: self.declared_covariates().map(varies).collect(),
            no_velocities: measurements.velocities.as_ref().map_or(
                Some(NO_VELOCITIES),
                |velocities| {
                    let of_row = |row: &usize| &velocities[row * n..(row + 1) * n];
                    let mut moving = self.rows().iter().flat_map(of_row);
                    moving.all(|velocity| *velocity == 0.0).then_some(NO_VELOCITIES)
                },
            ),
            times: self.shift_times(),
            clock: measurements.clock(),
            gravity: problem.gravity,
            gives_way: self.gives_way,
        }
    }

    /// Returns the covariates that the problem declares, each with its value in every
    /// identification row.
    fn declared_covariates(&self) -> impl Iterator<Item = Vec<f64>> {
        let count =
            self.rows().first().map_or(0, |&row| self.measurements.covariates_of(row).len());
        (0..count).map(|which| {
            self.rows().iter().map(|&row| self.measurements.covariates_of(row)[which]).collect()
        })
    }

    /// Returns the candidate times of a station shift: at most `MAX_SHIFT_TIMES` of
    /// [`Self::times_between_poses`], evenly chosen.
    pub fn shift_times(&self) -> Vec<f64> {
        let times = self.times_between_poses();
        let every = times.len().div_ceil(MAX_SHIFT_TIMES).max(1);
        times.into_iter().step_by(every).collect()
    }

    /// Returns times approximately half way between consecutive poses \[s\], ascending, written
    /// with few digits. Each leaves at least `MIN_POSES_BESIDE_SHIFT` poses on either side.
    pub fn times_between_poses(&self) -> Vec<f64> {
        let mut times = self.time();
        times.sort_by(f64::total_cmp);
        let (count, side) = (times.len(), MIN_POSES_BESIDE_SHIFT);
        let between =
            |k: usize| (times[k] > times[k - 1]).then(|| half_way(times[k - 1], times[k]));
        (side..count).take_while(|k| k + side <= count).filter_map(between).collect()
    }

    /// Returns all quantities on which the residual may depend, each with its value in every
    /// identification row.
    pub fn covariates(&self, problem: &Problem) -> Vec<CovariateValues> {
        let measurements = self.measurements;
        let moving = problem.joints.iter().enumerate().filter(|(_, joint)| joint.takes_command());
        let joint = |(index, _): (usize, _)| CovariateValues {
            covariate: Covariate::Command(index),
            values: self.rows().iter().map(|&row| measurements.configuration(row)[index]).collect(),
        };
        let mut covariates: Vec<CovariateValues> = moving.clone().map(joint).collect();
        let columns = [
            (Covariate::Temperature, &measurements.temperature),
            (Covariate::Payload, &measurements.payload),
            (Covariate::Hoist, &measurements.hoist),
        ];
        for (covariate, column) in columns {
            if let Some(column) = column {
                covariates.push(CovariateValues { covariate, values: self.values_at_rows(column) });
            }
        }
        let declared = self.declared_covariates().enumerate();
        covariates.extend(declared.map(|(which, values)| CovariateValues {
            covariate: Covariate::declared(which, problem),
            values,
        }));
        let covariate = Covariate::time(measurements.time_measured);
        covariates.push(CovariateValues { covariate, values: self.time() });
        if let Some(approach) = &measurements.approach {
            let n = measurements.joints;
            covariates.extend(moving.map(|(joint, _)| CovariateValues {
                covariate: Covariate::Approach(joint),
                values: self.rows().iter().map(|&row| approach[row * n + joint]).collect(),
            }));
        }
        covariates
    }
}

/// Returns true if a joint, a link or the base that the problem declares gives way to loads.
fn gives_way(problem: &Problem) -> bool {
    let sites = problem.effects.iter().flat_map(|declared| declared.effect.terms(problem));
    let mut sites = sites.map(|term| term.site);
    problem.is_elastic() || sites.any(|site| site.is_elastic() && !site.is_load())
}

/// Returns the bit patterns of all measuring conditions of one row. Equal patterns mean repeated
/// measurements.
fn conditions_of(measurements: &Measurements, row: usize) -> Vec<u64> {
    let mut key = bits(measurements.configuration(row));
    let n = measurements.joints;
    for column in [&measurements.payload, &measurements.hoist, &measurements.temperature]
        .into_iter()
        .flatten()
    {
        key.push(column[row].to_bits());
    }
    if let Some(approach) = &measurements.approach {
        key.extend(bits(&approach[row * n..(row + 1) * n]));
    }
    key.extend(bits(measurements.covariates_of(row)));
    key.push(measurements.session.of_row[row] as u64);
    key.extend(measurements.observation(row).sort_key().map(|word| word as u64));
    key.extend(measurements.target.as_ref().map(|target| target.of_row[row] as u64));
    key
}

/// Returns the bit pattern of each value, as a key of comparisons.
pub(super) fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Returns a number for each key: equal keys have equal numbers, counted from 0 in order of first
/// appearance.
pub(super) fn numbered<K: Ord>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut number_of_key = BTreeMap::new();
    keys.map(|key| {
        let next = number_of_key.len();
        *number_of_key.entry(key).or_insert(next)
    })
    .collect()
}

/// Returns a number with few decimals between `low` and `high`, at most a twentieth of their
/// distance from the middle.
fn half_way(low: f64, high: f64) -> f64 {
    let middle = 0.5 * (low + high);
    let unit = 10.0_f64.powf(((high - low) / 10.0).log10().floor());
    // Dividing by an integer, instead of multiplying by 0.1 or 0.01, gives the float nearest to the
    // decimal number.
    let near = if unit < 1.0 {
        (middle / unit).round() / unit.recip().round()
    } else {
        (middle / unit).round() * unit
    };
    if low < near && near < high { near } else { middle }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_way_takes_few_digits() {
        let cases = [
            (3200.0, 3221.2, 3211.0),
            (3.0, 4.0, 3.5),
            (0.0, 0.002, 0.001),
            (1000.0, 61000.0, 31000.0),
        ];
        for (low, high, expected) in cases {
            assert_eq!(half_way(low, high).to_bits(), f64::to_bits(expected), "{low} {high}");
        }
    }
}
