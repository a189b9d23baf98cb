//! Search for rows with another payload than the table states.
//!
//! The payload of every row is fitted together with the arm: with the whitened residual r, the
//! derivatives J by the unknowns of the arm and the column s of the payload of each row, steps
//! minimise ‖r + J Δx + Σ s Δm‖² and the priors. If that leaves only noise, the fitted payloads are
//! compared with mistakes of the column, and each mistake is fitted without free payloads.

use nalgebra::{DMatrix, DVector};

use super::Misreading;
use super::explanation::Explanation;
use super::loads::{MassScale, NEWTONS, POUNDS, TENFOLD, TENTH, THOUSANDFOLD, THOUSANDTH};
use super::search::Trial;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::row_kind::listed;
use crate::fit::stages::fitting::Fitting;
use crate::least_squares::{LinearisationCache, jacobian_and_residual};
use crate::measurement::Measurements;
use crate::numeric;
use crate::quantity::format::about_three_digits;

/// Minimum number of rows of the search, and of rows with another payload.
const MIN_ROWS: [usize; 2] = [20, 3];
/// Maximum number of rows for each row with another payload. Fewer such rows may be wrong otherwise.
const MAX_ROWS_PER_CHANGED: usize = 8;
/// Number of steps of a fit with free payloads.
const STEPS: usize = 8;
/// Standard deviation that keeps a payload determined in rows that it does not move, as a multiple
/// of the largest payload.
const RANGE: f64 = 3.0;
/// Change of a payload for its derivative, as a part of the largest one.
const DIFFERENCE: f64 = 1e-3;
/// Maximum number of mistakes of the column that are fitted: those that agree best with the payloads
/// of the rows.
const MAX_FITTED: usize = 4;
/// Maximum number of payloads that a column of one number may stand for.
const MAX_CLUSTERS: usize = 4;
/// Smallest ratio of the error as read to the largest one with a mistake corrected, at which every row
/// may have another payload than the table states: that many numbers make up for small errors.
const MIN_CLEAR_RATIO: f64 = 2.5;
/// Maximum number of different payloads of a column.
const MAX_LEVELS: usize = 12;
/// Factors of payloads in another unit, or with a misplaced decimal point.
const SCALES: [MassScale; 6] = [POUNDS, NEWTONS, TENTH, TENFOLD, THOUSANDTH, THOUSANDFOLD];

/// Payloads of the rows with the arm that fits them.
struct Fitted {
    x: DVector<f64>,
    payloads: Vec<f64>,
    /// Squared length of the whitened column of each payload: its precision for a known arm.
    precisions: Vec<f64>,
    /// Root mean squared error with the deviations from priors \[m\].
    rms: f64,
}

/// Mistake of the column of payloads.
struct Mistake {
    words: String,
    /// Payloads of the chosen rows.
    payloads: Vec<f64>,
}

/// Rows in which payloads are sought.
struct Rows<'a> {
    trial: &'a Trial<'a>,
    fitting: &'a Fitting<'a>,
    /// Payloads of the chosen rows as the table states them.
    stated: Vec<f64>,
    largest: f64,
}

/// Returns the mistake of the column of payloads with which a fit leaves at most `limit` \[m\];
/// `None` if there is none, or no such column.
pub(super) fn of_payload_rows(trial: &Trial, fit: &CheckedFit, limit: f64) -> Option<Explanation> {
    let table = fit.table();
    let column = table.payload.as_ref()?;
    let stated: Vec<f64> = trial.chosen.iter().map(|&row| column[row]).collect();
    let largest = column.iter().copied().fold(0.0, f64::max);
    if stated.len() < MIN_ROWS[0] || largest <= 0.0 || fit.fitting.earlier.is_some() {
        return None;
    }
    trial.with_corrected(&Misreading::none(), false, |fitting, problem| {
        let rows = Rows { trial, fitting, stated, largest };
        let free: Vec<Option<usize>> = (0..rows.stated.len()).map(Some).collect();
        let found = rows.fitted(&fit.end.x, &rows.stated, &free)?;
        if found.rms > limit {
            return None;
        }
        let is_clear = trial.error_as_read(fit) > MIN_CLEAR_RATIO * limit;
        let ranked = rows.ranked(table, column, (&found, is_clear));
        let explanation = |mistake: &Mistake| {
            rows.with(&mistake.payloads, |fitting| {
                let end = fitting.run(&found.x).ok()?;
                let rms = trial.penalised(fitting, &fitting.split.identification, &end.x);
                (rms <= limit).then(|| Explanation {
                    words: mistake.words.clone(),
                    rms,
                    effect: None,
                    left_out: trial.left_out(fitting, &end, problem),
                })
            })
        };
        ranked.iter().find_map(explanation)
    })
}

impl Rows<'_> {
    /// Returns what `result` returns for the fit with these payloads.
    fn with<R>(&self, payloads: &[f64], result: impl FnOnce(&Fitting) -> R) -> R {
        let payload = Some(payloads.to_vec());
        let measurements = &Measurements { payload, ..self.fitting.measurements.clone() };
        let cache = &LinearisationCache::default();
        result(&Fitting { measurements, cache, ..self.fitting.with_declared_noise() })
    }

    /// Fits the arm from `start` together with payloads: `groups` has the index of the payload of
    /// each row among the free ones, `None` for a row that keeps its payload.
    fn fitted(
        &self,
        start: &DVector<f64>,
        payloads: &[f64],
        groups: &[Option<usize>],
    ) -> Option<Fitted> {
        let free = groups.iter().flatten().max().map_or(0, |last| last + 1);
        let (mut x, mut payloads) = (start.clone(), payloads.to_vec());
        let mut precisions = vec![0.0; payloads.len()];
        for _ in 0..STEPS {
            let change = self.with(&payloads, |fitting| {
                let whole = fitting.whole();
                let residuals = whole.residuals(&x);
                let at = residuals.unknowns_in(&x);
                let (jacobian, residual) = jacobian_and_residual(&residuals, &at);
                let (n, size) = (at.len(), whole.coordinates());
                let slopes = self.slopes(&payloads, &x, fitting)?;
                let mut columns = jacobian.resize_horizontally(n + free, 0.0);
                for (row, (slope, group)) in slopes.iter().zip(groups).enumerate() {
                    precisions[row] = slope.norm_squared();
                    if let Some(group) = group {
                        columns.view_mut((size * row, n + group), (3, 1)).copy_from(slope);
                    }
                }
                let mut matrix = columns.tr_mul(&columns);
                let mut right = columns.tr_mul(&residual);
                for (k, sigma) in whole.prior_sigmas().into_iter().enumerate() {
                    let precision = sigma.map_or(0.0, |sigma| sigma.powi(-2));
                    matrix[(k, k)] += precision + f64::EPSILON * matrix[(k, k)];
                    right[k] += precision * at[k];
                }
                for k in n..n + free {
                    matrix[(k, k)] += (RANGE * self.largest).powi(-2);
                }
                let step = -matrix.cholesky()?.solve(&right);
                let x = whole.full_vector(&x, &(at + step.rows(0, n)));
                Some((x, step.rows(n, free).clone_owned()))
            });
            let (next, step) = change?;
            x = next;
            for (payload, group) in payloads.iter_mut().zip(groups) {
                let step = group.map_or(0.0, |group| step[group]);
                *payload = (*payload + step).clamp(-RANGE * self.largest, RANGE * self.largest);
            }
        }
        let rms = self.with(&payloads, |fitting| {
            self.trial.penalised(fitting, &fitting.split.identification, &x)
        });
        rms.is_finite().then_some(Fitted { x, payloads, precisions, rms })
    }

    /// Returns the derivatives of the whitened residuals of each row by its payload; 0 for rows that
    /// measure no position.
    fn slopes(
        &self,
        payloads: &[f64],
        x: &DVector<f64>,
        fitting: &Fitting,
    ) -> Option<Vec<DMatrix<f64>>> {
        let difference = DIFFERENCE * self.largest;
        let moved: Vec<f64> = payloads.iter().map(|payload| payload + difference).collect();
        let every_row: Vec<usize> = (0..payloads.len()).collect();
        let errors = fitting.position_errors(&every_row, x);
        let moved = self.with(&moved, |fitting| fitting.position_errors(&every_row, x));
        let sigmas = fitting.poses(&every_row);
        let slopes = errors.iter().zip(moved).zip(&sigmas).map(|((error, moved), pose)| {
            let is_position = pose.observation.is_position();
            let scale = if is_position { (difference * pose.sigma).recip() } else { 0.0 };
            let slope = (moved - error) * scale;
            slope
                .iter()
                .all(|entry| entry.is_finite())
                .then(|| DMatrix::from_column_slice(3, 1, slope.as_slice()))
        });
        slopes.collect()
    }

    /// Returns the mistakes of the column, those that agree best with the payloads that were `found`
    /// first. If the misfit `is_clear`, mistakes with other numbers follow.
    fn ranked(
        &self,
        table: &Measurements,
        column: &[f64],
        (found, is_clear): (&Fitted, bool),
    ) -> Vec<Mistake> {
        let mut mistakes = self.mistakes(table, column);
        let misfit = |mistake: &Mistake| misfit(found, &mistake.payloads);
        let least = MIN_ROWS[1].max(self.stated.len() / MAX_ROWS_PER_CHANGED);
        mistakes.retain(|mistake| self.count_changed(&mistake.payloads) >= least);
        mistakes.sort_by(|a, b| misfit(a).total_cmp(&misfit(b)));
        mistakes.truncate(MAX_FITTED);
        let levels = numeric::levels(self.stated.iter().copied());
        if !is_clear {
            return mistakes;
        }
        let others = if let [only] = levels.as_slice() {
            self.of_clusters(*only, found)
        } else {
            let of_level = levels.iter().filter_map(|&level| self.of_level(level, found));
            of_level.chain(self.of_assigned(table, column, (&levels, found))).collect()
        };
        let others = others.into_iter();
        mistakes.extend(others.filter(|of| self.count_changed(&of.payloads) >= least));
        mistakes
    }

    /// Returns the number of rows with another payload than the table states.
    fn count_changed(&self, payloads: &[f64]) -> usize {
        payloads.iter().zip(&self.stated).filter(|(one, other)| !is_same(**one, **other)).count()
    }

    /// Returns the mistake that one payload of the column is another number.
    fn of_level(&self, level: f64, found: &Fitted) -> Option<Mistake> {
        let groups = self.stated.iter().map(|stated| is_same(*stated, level).then_some(0));
        let payloads = self.fitted(&found.x, &self.stated, &groups.collect::<Vec<_>>())?.payloads;
        let place = self.stated.iter().position(|stated| is_same(*stated, level))?;
        let words = format!(
            "payloads of {} kg that were about {} kg",
            shown(level),
            shown(payloads[place])
        );
        Some(Mistake { words, payloads })
    }

    /// Returns the mistakes that a column that holds one number stands for few payloads.
    fn of_clusters(&self, only: f64, found: &Fitted) -> Vec<Mistake> {
        let mut sorted = found.payloads.clone();
        sorted.sort_by(f64::total_cmp);
        let clusters = |count: usize| {
            let mut levels: Vec<f64> =
                (0..count).map(|k| sorted[(2 * k + 1) * sorted.len() / (2 * count)]).collect();
            let nearest = |levels: &[f64], payload: f64| {
                let distance = |k: &usize| (levels[*k] - payload).abs();
                (0..count).min_by(|a, b| distance(a).total_cmp(&distance(b)))
            };
            let mut groups: Vec<Option<usize>> = Vec::new();
            for _ in 0..STEPS {
                groups = found.payloads.iter().map(|&of| nearest(&levels, of)).collect();
                for (k, level) in levels.iter_mut().enumerate() {
                    let rows = groups.iter().zip(&found.payloads).zip(&found.precisions);
                    let rows = rows.filter(|((group, _), _)| **group == Some(k));
                    let [sum, weight] = rows.fold([0.0; 2], |[sum, weight], ((_, payload), of)| {
                        [sum + of * payload, weight + of]
                    });
                    *level = if weight > 0.0 { sum / weight } else { *level };
                }
            }
            let start = groups.iter().map(|group| group.map_or(only, |k| levels[k]));
            let fitted = self.fitted(&found.x, &start.collect::<Vec<_>>(), &groups)?;
            let level = |k: usize| {
                let rows = groups.iter().zip(&fitted.payloads);
                let mut rows = rows.filter(|(group, _)| **group == Some(k)).map(|(_, of)| *of);
                let first = rows.next()?;
                Some(format!("about {} kg in {} rows", shown(first), rows.count() + 1))
            };
            let levels: Option<Vec<String>> = (0..count).map(level).collect();
            let words = format!(
                "a column of payloads that holds {} kg in all rows, where {} fit",
                shown(only),
                levels?.join(", ")
            );
            Some(Mistake { words, payloads: fitted.payloads })
        };
        (2..=MAX_CLUSTERS).filter_map(clusters).collect()
    }

    /// Returns the mistakes that a column of payloads may have.
    fn mistakes(&self, table: &Measurements, column: &[f64]) -> Vec<Mistake> {
        let rows = &self.trial.chosen;
        let levels = numeric::levels(self.stated.iter().copied());
        let mut mistakes = Vec::new();
        let mut add = |words: String, of_row: &dyn Fn(usize, f64) -> f64| {
            let payloads = rows.iter().zip(&self.stated);
            let payloads = payloads.map(|(&row, &stated)| of_row(row, stated)).collect();
            mistakes.push(Mistake { words, payloads });
        };
        let place = |row: usize| table.location(row);
        if levels.len() <= MAX_LEVELS {
            for (k, &one) in levels.iter().enumerate() {
                for &other in &levels[k + 1..] {
                    let words = format!(
                        "payloads of {} and {} kg that are exchanged",
                        shown(one),
                        shown(other)
                    );
                    add(words, &|_, stated| match stated {
                        stated if is_same(stated, one) => other,
                        stated if is_same(stated, other) => one,
                        stated => stated,
                    });
                }
            }
        }
        for &from in rows {
            for (by, side) in [(-1, "before"), (1, "after")] {
                let words =
                    format!("payloads that belong to the row {side} from {} on", place(from));
                add(words, &|row, stated| {
                    let other = row.checked_add_signed(-by).and_then(|row| column.get(row));
                    if row < from { stated } else { other.copied().unwrap_or(stated) }
                });
            }
            for (factor, scale) in SCALES {
                if from != rows[0] {
                    let words = format!("payloads from {} on that are {scale}", place(from));
                    add(words, &|row, stated| if row < from { stated } else { factor * stated });
                    let words = format!("payloads before {} that are {}", place(from), scale);
                    add(words, &|row, stated| if row < from { factor * stated } else { stated });
                }
            }
        }
        let files = table.origin.iter().map(|(file, _)| *file).max().map_or(1, |last| last + 1);
        for file in (0..files).filter(|_| files > 1) {
            for (factor, scale) in SCALES {
                let name = table.files[file as usize].display();
                add(format!("payloads of {name} that are {scale}"), &|row, stated| {
                    if table.origin[row].0 == file { factor * stated } else { stated }
                });
            }
        }
        mistakes
    }

    /// Returns the mistake that some rows have another payload of the column.
    fn of_assigned(
        &self,
        table: &Measurements,
        column: &[f64],
        (levels, found): (&[f64], &Fitted),
    ) -> Option<Mistake> {
        let rows = &self.trial.chosen;
        let payloads = self.assigned(levels, found);
        let changed: Vec<usize> =
            (0..rows.len()).filter(|&k| !is_same(payloads[k], self.stated[k])).collect();
        let (&first, &last) = (changed.first()?, changed.last()?);
        let place = |k: usize| table.location(rows[k]);
        let stated = self.stated[first];
        let is_held = self.stated[first..=last].iter().all(|other| is_same(*other, stated));
        let sorted = |payloads: &[f64]| {
            let mut payloads = payloads.to_vec();
            payloads.sort_by(f64::total_cmp);
            payloads
        };
        // Sorting changes the order of the numbers alone.
        let same = sorted(&payloads).into_iter().zip(sorted(&self.stated));
        let words = if is_sorted(column) && same.into_iter().all(|(one, of)| is_same(one, of)) {
            "a column of payloads that was sorted by itself, unlike the other columns".to_owned()
        } else if is_held {
            format!(
                "payloads that are not all {} kg in the rows from {} to {}, as a column that was \
                 filled down",
                shown(stated),
                place(first),
                place(last)
            )
        } else {
            let words =
                changed.iter().map(|&k| format!("{} kg in {}", shown(payloads[k]), place(k)));
            let words: Vec<String> = words.collect();
            format!("other payloads in some rows: {}", listed(&words))
        };
        Some(Mistake { words, payloads })
    }

    /// Returns, for each row, the one of `levels` that is nearest to the payload that was found: that of
    /// the row itself unless another one agrees better by more than the error of the found one. The
    /// stiffnesses of the arm make up for a factor of all payloads.
    fn assigned(&self, levels: &[f64], found: &Fitted) -> Vec<f64> {
        let with_factor = |factor: f64| {
            let row = |k: usize| {
                let cost =
                    |level: f64| found.precisions[k] * (found.payloads[k] - factor * level).powi(2);
                let as_stated = (self.stated[k], cost(self.stated[k]) - MIN_GAIN);
                let others = levels.iter().map(|&level| (level, cost(level)));
                others.chain([as_stated]).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or(as_stated)
            };
            let rows: Vec<(f64, f64)> = (0..self.stated.len()).map(row).collect();
            (rows.iter().map(|of| of.0).collect(), rows.iter().map(|of| of.1).sum::<f64>())
        };
        let factors = (-FACTORS..=FACTORS).map(|k| FACTOR_STEP.powi(k));
        let best = factors.map(with_factor).min_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or_else(|| self.stated.clone(), |(payloads, _)| payloads)
    }
}

/// Factors of all found payloads that are tried: powers of the step.
const FACTOR_STEP: f64 = 1.03;
const FACTORS: i32 = 24;
/// Smallest reduction of the squared deviation of a found payload, in units of its standard error, at
/// which a row has another payload than the table states.
const MIN_GAIN: f64 = 9.0;

/// Returns the sum of the squared deviations of payloads from those that were found, in units of
/// their standard errors. The stiffnesses of the arm make up for a factor of all payloads.
fn misfit(found: &Fitted, payloads: &[f64]) -> f64 {
    let rows = || found.payloads.iter().zip(payloads).zip(&found.precisions);
    let [crossed, squares] = rows().fold([0.0; 2], |[crossed, squares], ((one, other), weight)| {
        [crossed + weight * one * other, squares + weight * other * other]
    });
    let factor = if squares > 0.0 { crossed / squares } else { 0.0 };
    rows().map(|((one, other), weight)| weight * (one - factor * other).powi(2)).sum()
}

/// Returns true if the numbers rise, or fall, from the first to the last.
fn is_sorted(column: &[f64]) -> bool {
    column.is_sorted() || column.is_sorted_by(|one, other| one >= other)
}

/// Returns true if two payloads are the same number.
fn is_same(one: f64, other: f64) -> bool {
    one.total_cmp(&other).is_eq()
}

/// Formats a payload.
fn shown(payload: f64) -> String {
    about_three_digits(payload).trim_end_matches('0').trim_end_matches('.').to_owned()
}
