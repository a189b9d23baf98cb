//! Misreadings in which an entry of the joint table was typed wrongly.

use super::entries::{entry_name, number_of, place, value_of};
use super::search::Trial;
use super::{Kind, Misreading};
use crate::model::parameter::JointField;
use crate::numeric::parallel;
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

/// Creates the misreading that an entry of the joint table is another number, to which `by` must be
/// added \[m\] or \[rad\].
fn typed(problem: &Problem, (joint, field): (usize, JointField), by: f64) -> Misreading {
    let declared =
        problem.joints.get(joint - 1).and_then(|joint| value_of(joint, field)).unwrap_or(0.0);
    let place = place(problem, joint, field).map_or_else(String::new, |at| format!(" ({at})"));
    let words = move |size: f64| {
        let (factor, unit) =
            if field == JointField::Alpha { (1_f64.to_degrees(), "°") } else { (1e3, " mm") };
        format!(
            "{} that is about {}{unit}, declared {}{unit}{place}",
            entry_name(joint, field),
            number(factor * (declared + size), 1),
            number(factor * declared, 1)
        )
    };
    let typed = Misreading::of_problem(words(by), move |problem| {
        *number_of(problem.joints.get_mut(joint - 1)?, field)? += by;
        Some(())
    });
    let parameter = format!("joint{joint}.{}", field.name());
    typed.of_kind(Kind::Typed).in_group(parameter.clone()).with_size(
        (parameter, None),
        move |x| by + x,
        words,
    )
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
        let typed = |entry: (usize, JointField), by: f64| {
            let by = by.round();
            let by = if entry.1 == Alpha { (by * 1e-3).to_radians() } else { by * 1e-6 };
            typed(problem, entry, by)
        };
        let angles =
            angles.iter().flat_map(|&entry| TRIAL_ANGLES.map(|angle| typed(entry, 1e3 * angle)));
        let mut errors = self.registered_errors(&angles.collect::<Vec<_>>());
        let error =
            |&(entry, by): &((usize, JointField), f64)| self.registered_error(&typed(entry, by));
        // Each length with the number that is added to it \[µm\], its error, and the next step.
        let mut tried: Vec<_> =
            lengths.into_iter().map(|entry| (entry, 0.0, as_read, TRIAL_LENGTH)).collect();
        for _ in 0..PASSES {
            let beside = tried
                .iter()
                .flat_map(|&(entry, by, _, step)| [by - step, by + step].map(|by| (entry, by)));
            let beside = parallel::map_items(&beside.collect::<Vec<_>>(), error);
            let minimum = |(&(entry, by, error, step), beside): (&(_, f64, f64, f64), &[_])| {
                let [Some(less), Some(more)] = *beside else { return None };
                let (less, more): (f64, f64) = (less, more);
                let (less, more) = (less.powi(2), more.powi(2));
                let curvature = less + more - 2.0 * error.powi(2);
                let move_by = (less - more) / (2.0 * curvature) * step;
                let is_useful = curvature > 0.0 && move_by.abs() < MAX_LENGTH;
                is_useful.then_some(((entry, by + move_by), step))
            };
            let moved: Vec<_> = tried.iter().zip(beside.chunks(2)).filter_map(minimum).collect();
            let at: Vec<_> = moved.iter().map(|(at, _)| *at).collect();
            let found = parallel::map_items(&at, error);
            let with_error = |(((entry, by), step), error): (((_, f64), f64), Option<f64>)| {
                Some((entry, by, error?, STEP_RATIO * step))
            };
            tried = moved.into_iter().zip(found).filter_map(with_error).collect();
        }
        let found = tried.into_iter().filter(|(_, by, ..)| by.abs() >= MIN_LENGTH);
        errors.extend(found.map(|(entry, by, error, _)| (typed(entry, by), error)));
        errors
    }
}
