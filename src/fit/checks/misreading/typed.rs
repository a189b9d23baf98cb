//! Misreadings in which an entry of the joint table was typed wrongly.

use super::candidates::number_of;
use super::search::Trial;
use super::two_entries::entry_name;
use super::{Misreading, POSITION_UNITS};
use crate::model::parameter::JointField;
use crate::problem::{JointKind, Problem};
use crate::quantity::format::number;

/// Change of a length for the first two trials \[µm\].
const TRIAL_LENGTH: f64 = 1e5;
/// Ratio of these changes of a pass to those of the pass before, and the number of passes.
const STEP_RATIO: f64 = 0.3;
const PASSES: usize = 3;
/// Trial errors of an angle α \[m°\]. A full fit finds values between them.
const TRIAL_ANGLES: [f64; 8] = [-150.0, -120.0, -60.0, -30.0, 30.0, 60.0, 120.0, 150.0];
/// Smallest error of a length \[µm\] that was typed wrongly. Priors tell of smaller ones.
const MIN_LENGTH: f64 = 1e3;
/// Largest error of a length \[µm\].
const MAX_LENGTH: f64 = 1e8;

impl Misreading {
    /// Returns what must be added to an entry that was typed wrongly \[m\] or \[rad\]; `None` for
    /// other misreadings.
    pub(super) fn typed_change(self) -> Option<f64> {
        let Self::Typed { field, by, .. } = self else { return None };
        Some(match field {
            JointField::Alpha => (f64::from(by) * 1e-3).to_radians(),
            _ => f64::from(by) * 1e-6,
        })
    }

    /// Describes the unit of a whole joint table; empty for other misreadings.
    pub(super) fn words_of_table_unit(self) -> String {
        let Self::TableUnit { unit, has_targets } = self else { return String::new() };
        let (factor, name) = POSITION_UNITS[unit];
        let targets = if has_targets { " and of the target" } else { "" };
        format!(
            "lengths of the joint table{targets} that are in {name}, declared as millimetres \
             (multiply them by {factor})"
        )
    }

    /// Returns the number by which the misreading multiplies the positions of the table.
    pub(super) fn position_factor(self) -> f64 {
        match self {
            Self::PositionUnit { unit } => POSITION_UNITS[unit].0,
            Self::Metres => 1e3,
            Self::Millimetres => 1e-3,
            _ => 1.0,
        }
    }

    /// Describes an entry that was typed wrongly, with the number that a fit found; `None` for other
    /// misreadings.
    pub(super) fn typed_words(self, size: Option<f64>, problem: &Problem) -> Option<String> {
        let Self::Typed { joint, field, .. } = self else { return None };
        let declared = *number_of(&mut problem.joints.get(joint - 1)?.clone(), field)?;
        let found = declared + size.or(self.typed_change())?;
        let (factor, unit) =
            if field == JointField::Alpha { (1_f64.to_degrees(), "°") } else { (1e3, " mm") };
        Some(format!(
            "{} that is about {}{unit}, declared {}{unit}",
            entry_name(joint, field),
            number(factor * found, 1),
            number(factor * declared, 1)
        ))
    }
}

impl Trial<'_> {
    /// Returns the entries of the joint table that may be typed wrongly, each with the rms error of the
    /// registered nominal arm after the correction \[m\]. `as_read` is that without a correction.
    ///
    /// A length moves all points behind it in proportion, so that the squared error is nearly a
    /// parabola of the length: three errors show its minimum.
    pub(super) fn typed_entries(&self, problem: &Problem, as_read: f64) -> Vec<(Misreading, f64)> {
        use JointField::{A, Alpha, D};
        let joints = (1..).zip(&problem.joints).filter(|(_, joint)| {
            joint.placement.is_none() && joint.kind != JointKind::Fixed && joint.beam.is_none()
        });
        let entries = joints.flat_map(|(joint, _)| [A, D, Alpha].map(|field| (joint, field)));
        // The base makes up for α and, in a table in standard DH form, there is no a before joint 1.
        let is_first = |entry: &(usize, JointField)| entry.0 == 1 && entry.1 != D;
        let entries = entries.filter(|entry| !is_first(entry));
        let (angles, lengths): (Vec<_>, Vec<_>) = entries.partition(|(_, field)| *field == Alpha);
        #[expect(clippy::cast_possible_truncation, reason = "at most 100 m or 180°")]
        let typed =
            |(joint, field), by: f64| Misreading::Typed { joint, field, by: by.round() as i32 };
        let angles =
            angles.iter().flat_map(|&entry| TRIAL_ANGLES.map(|angle| typed(entry, 1e3 * angle)));
        let mut errors = self.registered_errors(&angles.collect::<Vec<_>>());
        // Each length with the number that is added to it \[µm\], its error, and the next step.
        let mut tried: Vec<_> =
            lengths.into_iter().map(|entry| (entry, 0.0, as_read, TRIAL_LENGTH)).collect();
        for _ in 0..PASSES {
            let beside = tried.iter().flat_map(|&(entry, by, _, step)| {
                [by - step, by + step].map(|by| typed(entry, by))
            });
            let beside = self.registered_errors(&beside.collect::<Vec<_>>());
            let square = |misreading| {
                let (_, error) = beside.iter().find(|(trial, _)| *trial == misreading)?;
                Some(error.powi(2))
            };
            let minimum = |&(entry, by, error, step): &(_, f64, f64, f64)| {
                let less = square(typed(entry, by - step))?;
                let more = square(typed(entry, by + step))?;
                let curvature = less + more - 2.0 * error.powi(2);
                let move_by = (less - more) / (2.0 * curvature) * step;
                let is_useful = curvature > 0.0 && move_by.abs() < MAX_LENGTH;
                is_useful.then_some((entry, by + move_by, step))
            };
            let moved: Vec<_> = tried.iter().filter_map(minimum).collect();
            let at: Vec<Misreading> =
                moved.iter().map(|&(entry, by, _)| typed(entry, by)).collect();
            let found = self.registered_errors(&at);
            let error = |misreading| found.iter().find(|(of, _)| *of == misreading).map(|of| of.1);
            let with_error = |(entry, by, step): (_, f64, f64)| {
                Some((entry, by, error(typed(entry, by))?, STEP_RATIO * step))
            };
            tried = moved.into_iter().filter_map(with_error).collect();
        }
        let found = tried.into_iter().filter(|(_, by, ..)| by.abs() >= MIN_LENGTH);
        errors.extend(found.map(|(entry, by, error, _)| (typed(entry, by), error)));
        errors
    }
}
