//! Checks of the size of the residual: a very large one indicates data of another arm or wrong
//! units.

use nalgebra::Vector3;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misreading::POSITION_UNITS;
use super::row_kind::{RowKind, format_error, quantity_noun, spread, suspects};
use crate::numeric::root_mean;
use crate::problem::Observation;

/// Largest rms residual of a fit, relative to the spread of the measurements, that is not reported
/// as a misfit.
const MAX_MISS: f64 = 0.02;
/// Largest rms residual of a fit, as a multiple of the declared σ, that is not reported, however
/// small the spread of the measurements is.
const MAX_UNREPORTED_RESIDUAL: f64 = 100.0;
/// Smallest ratio of the rms error of the fitted arm to that of the registered nominal arm, at
/// which the fit is no better than the nominal arm.
const MIN_UNIMPROVED_RATIO: f64 = 0.9;
/// Smallest rms error, as a multiple of the declared σ, at which a fit that is no better than the
/// nominal arm is reported.
const MIN_REPORTED_ERROR: f64 = 1000.0;
/// Smallest rms residual of a fit, relative to the spread of the measurements, at which the table
/// may be that of another arm.
const MIN_OTHER_ARM_MISS: f64 = 0.5;
/// Largest ratio between the spreads of measured and predicted points that is not reported.
const MAX_SIZE_RATIO: f64 = 2.0;
/// Ratios of the spread of the nominal arm's points to that of the measured ones, each with the unit
/// that gives it, and whether the column is then declared in metres instead of millimetres. Other
/// units than these are in [`POSITION_UNITS`].
const SIZES_OF_UNITS: [(f64, bool, &str); 2] =
    [(1e3, false, "metres"), (1e-3, true, "millimetres")];
/// Largest deviation of such a ratio from that of two units: its logarithm.
const MAX_OFF_UNIT: f64 = 0.4;
/// Smallest spread of points from which the size of an arm is judged \[m\], or of tilts from which
/// rotations are judged \[rad\].
pub(super) const MIN_SPREAD: f64 = 0.01;
/// Minimum number of different poses from which the spread of their points is judged.
const MIN_POSES: usize = 4;

/// Reports each kind of rows whose rms error after the fit exceeds [`MAX_MISS`] times the spread of
/// the rows and [`MAX_UNREPORTED_RESIDUAL`] σ. Reports other rows than positions also if the fit is
/// no better than the nominal arm and the error exceeds [`MIN_REPORTED_ERROR`] σ.
pub(super) fn misfit(fit: &CheckedFit) -> Vec<Finding> {
    let of_kind = |kind: RowKind| {
        let error = |x| fit.rms_at(&kind.rows, x);
        let (nominal, fitted) = (error(fit.registered_x), error(&fit.end.x));
        // A solver that did not converge may have increased the error, so its misfit is only
        // reported if the nominal arm has one as well.
        let counts = |_: &Finding| {
            fit.end.termination.converged() || misfit_finding(&kind, nominal).is_some()
        };
        let finding = misfit_finding(&kind, fitted)
            .filter(counts)
            .or_else(|| no_better_finding(&kind, nominal, fitted))?;
        Some(finding.with_remedy_of(
            reading_of_tilts(fit, &kind, fitted).map(|words| format!("the tilts fit with {words}")),
        ))
    };
    fit.kinds().into_iter().filter_map(of_kind).collect()
}

/// Returns the largest rms residual of rows of a kind that is no misfit.
pub(super) fn unreported(kind: &RowKind) -> f64 {
    let noise = kind.declared_sigma.map_or(0.0, |sigma| MAX_UNREPORTED_RESIDUAL * sigma);
    noise.max(MAX_MISS * kind.spread)
}

/// Function from the two numbers of a measured tilt \[rad\] to those that another reading means.
type TiltReading = fn(&Vector3<f64>) -> [f64; 2];

/// Other readings of the two columns of tilts.
const TILT_READINGS: [(&str, TiltReading); 5] = [
    ("tilt_x of the other sign", |tilt| [-tilt.x, tilt.y]),
    ("tilt_y of the other sign", |tilt| [tilt.x, -tilt.y]),
    ("tilt_x and tilt_y of the other sign", |tilt| [-tilt.x, -tilt.y]),
    ("tilt_x and tilt_y exchanged", |tilt| [tilt.y, tilt.x]),
    ("numbers in mm/m, which are no degrees: write atan(number / 1000)", |tilt| {
        [tilt.x, tilt.y].map(|angle| (angle.to_degrees() * 1e-3).atan())
    }),
];
/// Largest ratio of the error of tilts with another reading to that as read, at which the reading is
/// named.
const MAX_READ_RATIO: f64 = 0.1;

/// Returns the words of the reading of tilts with which the fitted or the nominal arm misses them
/// far less than by `rms` \[rad\]; `None` for other kinds of rows, or if there is no such reading.
fn reading_of_tilts(fit: &CheckedFit, kind: &RowKind, rms: f64) -> Option<&'static str> {
    if kind.observation.kind() != Observation::Tilt(0).kind() {
        return None;
    }
    let measured = &fit.table().positions;
    let errors = [&fit.end.x, fit.registered_x].map(|x| fit.errors_at(&kind.rows, x));
    let error = |reading: TiltReading| {
        let of_arm = errors.iter().map(|errors| {
            let squares = kind.rows.iter().zip(errors).map(|(&row, error)| {
                let (read, predicted) = (reading(&measured[row]), measured[row] - error);
                (read[0] - predicted.x).powi(2) + (read[1] - predicted.y).powi(2)
            });
            root_mean(squares)
        });
        of_arm.fold(f64::INFINITY, f64::min)
    };
    let readings = TILT_READINGS.into_iter().map(|(words, reading)| (words, error(reading)));
    let (words, best) = readings.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (best < MAX_READ_RATIO * rms).then_some(words)
}

/// Checks that the measured positions spread over a workspace of the nominal arm's size.
pub(super) fn size_of_arm(fit: &CheckedFit) -> Vec<Finding> {
    let of_kind = |kind: RowKind| {
        let RowKind { observation, rows, .. } = &kind;
        if !observation.is_position() || fit.poses.poses.min(rows.len()) < MIN_POSES {
            return None;
        }
        let nominal = fit.errors_at(rows, fit.registered_x);
        let table = &fit.table();
        let positions = &table.positions;
        let predicted =
            spread(fit.fitting.placement, rows, |place| positions[rows[place]] - nominal[place]);
        other_size_finding((kind.spread, predicted), table.position_unit)
    };
    fit.kinds().into_iter().filter_map(of_kind).collect()
}

/// Returns the finding that the rms error `rms` of an arm is large relative to both the spread and
/// the declared σ of rows of a kind; `None` if it is not.
fn misfit_finding(kind: &RowKind, rms: f64) -> Option<Finding> {
    let RowKind { observation, spread, .. } = *kind;
    if !(spread > MIN_SPREAD && rms > unreported(kind)) {
        return None;
    }
    let kind = observation.kind();
    let numbers = [kind.into(), rms.into(), spread.into()];
    let finding = |text: String, remedy: String| {
        Some(Finding::new(FindingCode::MissesMeasurements, numbers, text).with_remedy(remedy))
    };
    if !rms.is_finite() {
        let text = "the fitted arm misses the measurements by more than can be computed";
        return finding(text.to_owned(), "check their units".to_owned());
    }
    let (what, by, part) = (quantity_noun(kind), format_error(kind, rms, 1), 100.0 * rms / spread);
    let text = format!("the fitted arm misses the {what} by {by}, {part:.0} % of their spread");
    let suspects = suspects(kind);
    finding(
        text,
        if rms > MIN_OTHER_ARM_MISS * spread {
            format!(
                "check units, signs of joints, {suspects}, and whether the table is one of this \
                 arm, with the measurement of each row beside its own joint angles"
            )
        } else {
            format!("check units, signs of joints, and {suspects}")
        },
    )
}

/// Returns the finding that a fit predicts rows other than positions no better than the nominal
/// arm; `before` and `after` are the rms errors of the nominal and the fitted arm. `None` for
/// positions, or if the fit is better than the nominal arm or its error is small. Such rows need
/// this test, because their spread may not show the size of the workspace.
fn no_better_finding(kind: &RowKind, before: f64, after: f64) -> Option<Finding> {
    let RowKind { observation, declared_sigma, .. } = *kind;
    let is_far = declared_sigma.is_some_and(|sigma| after > MIN_REPORTED_ERROR * sigma);
    if observation.is_position() || !is_far || after <= MIN_UNIMPROVED_RATIO * before {
        return None;
    }
    let kind = observation.kind();
    let text = format!(
        "the fitted arm misses the {} by {}, the nominal one by {}, both far beyond the declared σ",
        quantity_noun(kind),
        format_error(kind, after, 1),
        format_error(kind, before, 1)
    );
    let numbers = [kind.into(), before.into(), after.into()];
    let remedy = format!("check units, signs of joints, and {}", suspects(kind));
    Some(Finding::new(FindingCode::NoBetterThanNominal, numbers, text).with_remedy(remedy))
}

/// Returns the finding that the measured points belong to an arm of another size. Their spread
/// `measured` \[m\] then differs much from the spread `expected` \[m\] of the points that the
/// nominal arm predicts. `None` if the two are alike. `declared` is the unit of the columns \[m\].
fn other_size_finding((measured, expected): (f64, f64), declared: Option<f64>) -> Option<Finding> {
    let is_same = (expected / MAX_SIZE_RATIO..=expected * MAX_SIZE_RATIO).contains(&measured);
    if expected <= MIN_SPREAD || is_same {
        return None;
    }
    let text = format!(
        "the measured points lie {:.1} mm (rms) from their centre, those of the nominal arm {:.1} \
         mm",
        measured * 1e3,
        expected * 1e3
    );
    let numbers = [measured.into(), expected.into()];
    let finding = Finding::new(FindingCode::OtherSize, numbers, text);
    let ratio = (expected / measured).ln();
    let others = POSITION_UNITS.into_iter().map(|(factor, name)| (factor, false, name));
    let unit = SIZES_OF_UNITS.into_iter().chain(others).find(|(factor, in_metres, _)| {
        declared.is_none_or(|unit| (unit >= 1.0) == *in_metres)
            && (ratio - factor.ln()).abs() < MAX_OFF_UNIT
    });
    Some(match unit {
        Some((_, in_metres, name)) => finding.with_remedy(format!(
            "the positions are probably in {name}, declared as {}; otherwise check the lengths of \
             the joint table and what the columns hold",
            if in_metres { "metres" } else { "millimetres" }
        )),
        None => finding,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::Observation;

    #[test]
    fn the_size_of_the_arm_tells_the_unit() {
        for (measured, words) in [
            (5.4e2, "micrometres"),
            (5.4e-1 / 304.8, "feet"),
            (5.4e-4, "metres"),
            (54.0, "hundredths"),
        ] {
            let finding = other_size_finding((measured, 0.56), Some(1e-3)).unwrap();
            assert!(finding.remedy.contains(&format!("probably in {words}")), "{}", finding.remedy);
        }
        assert!(other_size_finding((0.5, 0.56), Some(1e-3)).is_none());
    }

    #[test]
    fn a_fit_that_changes_nothing_far_beyond_the_noise_fits_nothing() {
        let sigma = Some(5e-5);
        for (observation, sigma, after, is_reported) in [
            (Observation::Point(0), sigma, 0.058, true),
            (Observation::Point(0), sigma, 0.051, false),
            (Observation::Point(0), Some(1e-3), 0.058, false),
            (Observation::Point(0), None, 0.058, false),
            (Observation::Position, sigma, 0.058, false),
        ] {
            let kind = RowKind {
                observation,
                rows: Vec::new(),
                spread: 0.0,
                declared_sigma: sigma,
                taken_sigma: 1e-3,
            };
            assert_eq!(
                no_better_finding(&kind, 0.06, after).is_some(),
                is_reported,
                "{observation:?} {sigma:?} {after}"
            );
        }
    }
}
