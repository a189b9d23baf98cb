//! Search for the mistake in rows that do not fit the arm of the other rows.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DVector, Vector3};

use super::checked_fit::CheckedFit;
use super::doubted_columns::{column_name, moving};
use super::misreading::reading_of_rows;
use super::row_kind::{AXES, listed};
use crate::fit::SolverChoice;
use crate::fit::stages::fitting::Fitting;
use crate::fit::stages::stage::Stage;
use crate::model::Pose;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::numeric::{self, root_mean};

/// Minimum number of rows that show where the base or the target stands.
const MIN_MOVED_ROWS: usize = 6;
/// Minimum number of successive rows that show base and target together.
const MIN_REGISTERED_ROWS: usize = 12;
/// Largest ratio of the error with a moved base to that with a moved target, at which the base moved.
const MAX_RATIO_TO_TARGET: f64 = 0.5;
/// Maximum number of different payloads of a table that are tried in each row.
const MAX_PAYLOADS: usize = 12;
/// Units of a length that a table may confuse: factors of the measured numbers, with their words.
const LENGTH_FACTORS: [(f64, &str); 6] = [
    (1e3, "multiply them by 1000"),
    (1e-3, "divide them by 1000"),
    (10.0, "multiply them by 10"),
    (0.1, "divide them by 10"),
    (25.4, "multiply them by 25.4"),
    (1.0 / 25.4, "divide them by 25.4"),
];

/// Rows that do not fit the arm of the other rows.
pub(super) struct MistakenRows<'a, 'f> {
    pub fit: &'f CheckedFit<'a>,
    /// Full parameter vector of the arm that the other rows fit.
    pub x: &'f DVector<f64>,
    /// Indices of the rows in the table.
    pub rows: &'f [usize],
    /// Largest rms error of the rows with the mistake corrected \[m\].
    pub limit: f64,
}

impl MistakenRows<'_, '_> {
    /// Returns the words for the mistake that explains the rows; `None` if none does.
    pub fn cause(&self) -> Option<String> {
        let table = self.fit.table();
        let errors = self.fit.errors_at(self.rows, self.x);
        let measured = self.rows.iter().map(|&row| table.positions[row]);
        let pairs = measured.zip(errors).map(|(measured, error)| (measured, measured - error));
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = pairs.collect();
        self.of_other_word()
            .or_else(|| self.of_other_payload())
            .or_else(|| mistake(&pairs, self.limit))
            .or_else(|| self.of_other_joint_angles())
            .or_else(|| self.of_joints())
            .or_else(|| self.of_moved_place())
            .or_else(|| reading_of_rows(self.fit, (self.x, self.limit), self.rows))
            .or_else(|| self.of_unit())
    }

    /// Returns the words for rows that fit with the words of other sessions or targets.
    fn of_other_word(&self) -> Option<String> {
        let placement = self.fit.fitting.placement;
        // Without a column target each session has its target.
        let has_targets = placement.targets != placement.bases;
        let in_session = |pose: &Pose<'_>, base: usize| {
            let word = placement.bases.get(base)?;
            let has_target = placement.targets.get(pose.target) == placement.bases.get(pose.base);
            let target = placement.targets.iter().position(|of| of == word && has_target);
            (pose.base != base).then_some((base, target.unwrap_or(pose.target)))
        };
        let of_target = |pose: &Pose<'_>, target: usize| {
            (has_targets && pose.target != target).then_some((pose.base, target))
        };
        self.of_word(("session", &placement.bases), &in_session)
            .or_else(|| self.of_word(("target", &placement.targets), &of_target))
    }

    /// Returns the words for rows that each fit with another of `words` of a column. `placed` is
    /// the function for these words.
    fn of_word(&self, (column, words): (&str, &[String]), placed: &Placed) -> Option<String> {
        let mut found = BTreeSet::new();
        for pose in &self.fit.fitting.poses(self.rows) {
            let others = (0..words.len()).filter_map(|word| Some((word, placed(pose, word)?)));
            let (others, places): (Vec<usize>, Vec<(usize, usize)>) = others.unzip();
            let poses = places.into_iter().map(|(base, target)| Pose { base, target, ..*pose });
            let errors = self.fit.model().residuals(poses.collect::<Vec<_>>(), self.x);
            let near = errors.iter().position(|error| error.norm() < self.limit)?;
            found.insert(words[others[near]].as_str());
        }
        let found: Vec<&str> = found.into_iter().collect();
        Some(format!(
            "they fit in {column} {} instead: correct the column {column}",
            found.join(" or ")
        ))
    }

    /// Returns the words for rows that each fit with a payload that other rows of the table have.
    fn of_other_payload(&self) -> Option<String> {
        let table = self.fit.table();
        let column = table.payload.as_ref()?;
        let levels = numeric::levels(column.iter().copied());
        if levels.len() > MAX_PAYLOADS {
            return None;
        }
        // The best payload of each row, and its error.
        let mut best: Vec<(f64, f64)> = vec![(0.0, f64::INFINITY); self.rows.len()];
        for level in levels {
            let mut corrected = table.clone();
            corrected.payload = Some(vec![level; column.len()]);
            let Fitting { placement, model, .. } = *self.fit.fitting;
            let errors = placement.position_errors(model, self.x, &corrected, self.rows);
            for (best, error) in best.iter_mut().zip(errors) {
                if error.norm() < best.1 {
                    *best = (level, error.norm());
                }
            }
        }
        let changed = self.rows.iter().zip(&best);
        let changed = changed.filter(|(row, (level, _))| column[**row].total_cmp(level).is_ne());
        let words =
            changed.map(|(&row, (level, _))| format!("{level} kg in {}", table.location(row)));
        let words: Vec<String> = words.collect();
        let is_explained = root_mean(best.iter().map(|(_, error)| error.powi(2))) < self.limit;
        (is_explained && words.len() > 1)
            .then(|| format!("they fit with other payloads: {}", listed(&words)))
    }

    /// Returns the words for positions that belong to the joint angles of other rows of the table. A
    /// shift leaves a row without a position.
    fn of_other_joint_angles(&self) -> Option<String> {
        let Self { fit, x, rows: chosen, limit } = *self;
        let table = fit.table();
        let is_position = |row: &usize| table.observation(*row).is_position();
        let every_row: Vec<usize> = (0..table.len()).filter(is_position).collect();
        let errors = fit.errors_at(&every_row, x);
        let predicted: Vec<(usize, Vector3<f64>)> = every_row
            .iter()
            .zip(errors)
            .map(|(&row, error)| (row, table.positions[row] - error))
            .collect();
        let base_of = |row: usize| fit.fitting.placement.base_of(row);
        let source = |row: &usize| {
            let distance = |of: &&(usize, Vector3<f64>)| (of.1 - table.positions[*row]).norm();
            let of_base = predicted.iter().filter(|of| base_of(of.0) == base_of(*row));
            let nearest = of_base.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            (nearest.0 != *row && distance(&nearest) < limit).then_some((*row, nearest.0))
        };
        let sources: Vec<(usize, usize)> = chosen.iter().filter_map(source).collect();
        if sources.len() < chosen.len().saturating_sub(1).max(2) {
            return None;
        }
        let are_shifted = |by: isize| {
            let shifted =
                sources.iter().filter(|(row, of)| row.checked_add_signed(by) == Some(*of));
            shifted.count() >= chosen.len().saturating_sub(1).max(2)
        };
        let are_exchanged = || {
            let others: BTreeSet<usize> = sources.iter().map(|&(_, of)| of).collect();
            others.len() == sources.len() && others.iter().all(|of| chosen.contains(of))
        };
        if are_shifted(-1) {
            Some("their positions belong to the joint angles of the row before".to_owned())
        } else if are_shifted(1) {
            Some("their positions belong to the joint angles of the row after".to_owned())
        } else {
            are_exchanged()
                .then(|| "their positions belong to each other's joint angles".to_owned())
        }
    }

    /// Returns the words for a mistake in the joint columns: angles in another unit, or the sign of a
    /// joint.
    fn of_joints(&self) -> Option<String> {
        let Self { fit, x, rows: chosen, limit } = *self;
        let table = fit.table();
        let joints: Vec<usize> = moving(fit).collect();
        let is_turning = |joint: &usize| fit.turns(*joint);
        let turning: Vec<usize> = joints.iter().copied().filter(is_turning).collect();
        let fits = |changed: &[usize], factor: f64| {
            let mut corrected = table.clone();
            for &row in chosen {
                for &joint in changed {
                    corrected.configurations[row * table.joints + joint] *= factor;
                }
            }
            let fitting = Fitting { measurements: &corrected, ..fit.fitting.with_declared_noise() };
            fit.rms(chosen, &fitting.position_errors(chosen, x)) < limit
        };
        let degree = 1_f64.to_radians();
        let units = [(degree.recip(), "radians"), (degree, "degrees")];
        if let Some((_, unit)) = units.into_iter().find(|(factor, _)| fits(&turning, *factor)) {
            return Some(format!("their joint angles are in {unit}, unlike those of the others"));
        }
        let joint = joints.into_iter().find(|&joint| fits(&[joint], -1.0))?;
        Some(format!("their {} has the other sign", column_name(table, joint)))
    }

    /// Returns the words for rows that fit where the target or the base, or both, stand elsewhere.
    fn of_moved_place(&self) -> Option<String> {
        let table = self.fit.table();
        let is_enough = self.rows.len() >= MIN_MOVED_ROWS;
        is_enough.then(|| self.fit.with_rows(table, self.rows, |of| self.of_place_in(of)))?
    }

    /// Does the work of [`of_moved_place`](Self::of_moved_place) with the fit of these rows alone.
    fn of_place_in(&self, fitting: &Fitting) -> Option<String> {
        let (placement, model, rows) = (fitting.placement, fitting.model, self.rows);
        let is_base = |parameter: &Parameter| matches!(parameter.site, ParameterSite::Base { .. });
        // A base may have turned far.
        let located = fitting.located();
        let is_used = |parameter: &Parameter| match parameter.site {
            ParameterSite::Base { base, .. } => {
                rows.iter().any(|&row| placement.base_of(row) == base)
            }
            ParameterSite::Target { target, .. } => {
                rows.iter().any(|&row| placement.target_of(row) == target)
            }
            _ => false,
        };
        let moved = |is_moved: &dyn Fn(&Parameter) -> bool| {
            let is_unknown = |parameter: &Parameter| is_moved(parameter) && is_used(parameter);
            let unknowns: Vec<usize> =
                (0..model.parameters.len()).filter(|&k| is_unknown(&model.parameters[k])).collect();
            let stage = Stage {
                solver: SolverChoice::Auto.decide(model),
                custom_solver: None,
                progress: None,
                linear_model: None,
                ..fitting.stage(rows, unknowns.clone())
            };
            let mut start = self.x.clone();
            let bases = unknowns.iter().filter(|&&k| is_base(&model.parameters[k]));
            bases.for_each(|&k| start[k] = located[k]);
            let x = stage.run(&start).ok().filter(|_| !unknowns.is_empty())?.x;
            let rms = self.fit.rms(rows, &fitting.position_errors(rows, &x));
            // The largest shift and turn of all bases or targets.
            let size = |from: usize| {
                let of_axis = unknowns.iter().filter_map(|&k| match model.parameters[k].site {
                    ParameterSite::Target { target: of, axis }
                    | ParameterSite::Base { base: of, axis } => {
                        (axis / 3 == from).then_some((of, (x[k] - self.x[k]).powi(2)))
                    }
                    _ => None,
                });
                let mut squares: BTreeMap<usize, f64> = BTreeMap::new();
                of_axis.for_each(|(of, square)| *squares.entry(of).or_default() += square);
                squares.into_values().fold(0.0, f64::max).sqrt()
            };
            Some((rms, [size(0), size(1)]))
        };
        let is_target =
            |parameter: &Parameter| matches!(parameter.site, ParameterSite::Target { .. });
        let target = moved(&is_target).filter(|(rms, _)| *rms < self.limit);
        let limit = target.map_or(self.limit, |(rms, _)| MAX_RATIO_TO_TARGET * rms);
        if let Some((_, [shift, turn])) = moved(&is_base).filter(|(rms, _)| *rms < limit) {
            let (shift, turn) = (1e3 * shift, turn.to_degrees());
            return Some(format!(
                "they fit where the base stands elsewhere, by {shift:.1} mm and {turn:.2}°: if the \
                 instrument or the base was moved, give them another word in a column session"
            ));
        }
        if let Some((_, [shift, _])) = target {
            return Some(format!(
                "they fit with the target {:.1} mm elsewhere in its frame: if the reflector was put \
                 into another nest, give them another word in a column target",
                1e3 * shift
            ));
        }
        let both = |parameter: &Parameter| is_target(parameter) || is_base(parameter);
        let is_enough = rows.len() >= MIN_REGISTERED_ROWS;
        let both = if is_enough { moved(&both) } else { None };
        both.filter(|(rms, _)| *rms < self.limit).map(|_| {
            "they fit where base and target stand elsewhere: if both were moved, give them another \
             word in the columns session and target"
                .to_owned()
        })
    }

    /// Returns the words for positions in another unit, from another base.
    fn of_unit(&self) -> Option<String> {
        let table = self.fit.table();
        let fits = |&(factor, _): &(f64, &str)| {
            let mut converted = table.clone();
            for &row in self.rows {
                converted.positions[row] *= factor;
            }
            let rms = self.fit.registration_error(&converted, self.rows);
            rms.is_some_and(|rms| rms < self.limit)
        };
        let has_enough = self.rows.len() >= MIN_REGISTERED_ROWS;
        let mut factors = LENGTH_FACTORS.into_iter().filter(|_| has_enough);
        factors.find(fits).map(|(_, words)| format!("their positions are in another unit: {words}"))
    }
}

/// Function of a row and the index of a word that returns the indices of base and target of the row
/// with that word; `None` for the word that it has.
type Placed<'a> = dyn Fn(&Pose<'_>, usize) -> Option<(usize, usize)> + 'a;

/// Function that corrects a measured position; it may take numbers of the predicted one.
type Correction = Box<dyn Fn(Vector3<f64>, &Vector3<f64>) -> Vector3<f64>>;

/// Returns the words for a mistake that explains pairs of measured and predicted positions to
/// `limit` \[m\].
fn mistake(pairs: &[(Vector3<f64>, Vector3<f64>)], limit: f64) -> Option<String> {
    let mut mistakes: Vec<(String, Correction)> = Vec::new();
    for (axis, name) in AXES.into_iter().enumerate() {
        let signed = move |mut at: Vector3<f64>, _: &_| {
            at[axis] = -at[axis];
            at
        };
        mistakes.push((format!("{name} has the other sign"), Box::new(signed)));
    }
    for [a, b] in [[0, 1], [0, 2], [1, 2]] {
        let exchanged = move |mut at: Vector3<f64>, _: &_| {
            at.swap_rows(a, b);
            at
        };
        mistakes.push((format!("{} and {} are exchanged", AXES[a], AXES[b]), Box::new(exchanged)));
    }
    for (factor, words) in LENGTH_FACTORS {
        let words = format!("positions are in another unit: {words}");
        mistakes.push((words, Box::new(move |at, _| at * factor)));
    }
    for (axis, name) in AXES.into_iter().enumerate() {
        let replaced = move |mut at: Vector3<f64>, predicted: &Vector3<f64>| {
            at[axis] = predicted[axis];
            at
        };
        mistakes.push((format!("{name} alone is wrong"), Box::new(replaced)));
    }
    let fits = |(_, correct): &(String, Correction)| {
        let squares = pairs.iter().map(|(at, of)| (correct(*at, of) - of).norm_squared());
        root_mean(squares) < limit
    };
    mistakes.into_iter().find(fits).map(|(words, _)| format!("their {words}"))
}
