//! Checks of the declared σ, those of priors and those of measurements, against the data.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misread::read_as_meant;
use super::row_kind::format_error;
use crate::fit::uncertainty::noise::Noise;
use crate::fit::uncertainty::refuted_priors::RefutedPrior;
use crate::problem::HeldOut;
use crate::quantity::Unit;
use crate::quantity::format::decimals;

/// Checks that the poses measure at least as many independent coordinates as there are fitted
/// parameters.
pub(super) fn data_decide(fit: &CheckedFit) -> Option<Finding> {
    let (poses, coordinates) = (fit.poses.poses, fit.poses.coordinates);
    let parameters = fit.whole.unknowns.len();
    if coordinates >= parameters || fit.fitting.earlier.is_some() {
        return None;
    }
    let noun = if poses == 1 { "pose measures" } else { "different poses measure" };
    let text = format!(
        "{poses} {noun} {coordinates} coordinates, fewer than the {parameters} parameters that are fitted: priors decide \
         most of it"
    );
    let numbers = [poses.into(), coordinates.into(), parameters.into()];
    let split = fit.fitting.split;
    let (fitted, held_out) = (split.identification.len(), split.held_out.len());
    let by_column = matches!(fit.problem.data.held_out, Some(HeldOut::Column(_)));
    let remedy = if by_column && held_out > fitted {
        format!(
            "{held_out} rows are held out and {fitted} are fitted: check whether the words that \
             mark them are exchanged"
        )
    } else {
        String::new()
    };
    Some(Finding::new(FindingCode::PriorsDecide, numbers, text).with_remedy(remedy))
}

/// Checks that the fitted deviations contradict no prior width, the σ that `[parameters]` declares
/// for a kind of geometric parameter of all joints.
pub(super) fn prior_widths(fit: &CheckedFit) -> Vec<Finding> {
    let finding = |size: &crate::fit::PriorSize| {
        let text = format!(
            "the fitted {} of {} joints deviate as if the σ of their prior were {:.2} times \
             the declared one",
            size.pattern,
            size.count,
            size.found / size.declared
        );
        let numbers = [json!(size.pattern), size.declared.into(), size.found.into()];
        Finding::new(FindingCode::PriorWidth, numbers, text)
    };
    fit.prior_sizes.iter().map(finding).collect()
}

/// Checks that the data refute the prior σ of no rule of `[parameters]`.
pub(super) fn priors_hold(fit: &CheckedFit) -> Vec<Finding> {
    let finding = |refuted: &RefutedPrior| {
        let RefutedPrior { rule, factor, sigma_ratio } = refuted;
        let text = format!(
            "the data refute the σ of \"{rule}\" in [parameters]: a σ about {factor:.0} \
             times as large would lower the \
             residual to {:.1} % of what it is",
            100.0 * sigma_ratio
        );
        let numbers = [json!(rule), (*factor).into(), (*sigma_ratio).into()];
        Finding::new(FindingCode::PriorContradicted, numbers, text)
    };
    fit.refuted_priors.iter().map(finding).collect()
}

/// Largest ratio of the noise variance that the fit assumed to the declared one, at which they are
/// equal but for rounding.
const MAX_EQUAL_NOISE_FACTOR: f64 = 1.0 + 1e-9;
/// Largest ratio of the noise variance that the fit assumed to the declared one, at which the fit
/// is still trusted. Above it, the declared σ would be more than 30 times too small.
pub(super) const MAX_NOISE_FACTOR: f64 = 1000.0;
/// Ratios of the σ that the fit assumed to the declared one which suggest a unit wrong by a factor
/// of 1000, for example metres entered under a key in millimetres.
pub(in crate::fit) const UNIT_RATIOS: std::ops::Range<f64> = 600.0..1600.0;

/// Checks that the noise σ that the fit assumed is not above the declared one.
pub(super) fn noise_is_declared(fit: &CheckedFit) -> Option<Finding> {
    if fit.noise != Noise::Declared || fit.noise_factor <= MAX_EQUAL_NOISE_FACTOR {
        return None;
    }
    let ratio = fit.noise_factor.sqrt();
    let numbers = [fit.noise_factor.into(), fit.sigma_taken.into()];
    if fit.noise_factor <= MAX_NOISE_FACTOR {
        let text = format!(
            "the residual is {ratio:.2} times as large as the declared σ, so that σ is too \
             small or the model lacks something"
        );
        return Some(Finding::new(FindingCode::ResidualBeyondDeclared, numbers, text));
    }
    let text = format!("the residual is {ratio:.0} times as large as the declared σ");
    let finding = Finding::new(FindingCode::NoiseBeyondDeclared, numbers, text);
    Some(if UNIT_RATIOS.contains(&ratio) {
        finding.with_remedy("the declared σ may be in another unit: check it")
    } else if fit.table().lacks_payload(fit.problem) {
        let remedy = "the table has no column payload_kg, although [tool] says where a payload \
                      hangs: add the column, or remove payload_at";
        finding.with_remedy(remedy)
    } else {
        let kind = fit.table().leading().kind();
        finding.with_remedy(format!(
            "look for what the model lacks with flexcal loop, or check the unit and the size of the \
             declared σ (the residual is like that of an instrument with σ = {})",
            format_error(kind, fit.sigma_taken, 3)
        ))
    })
}

/// Largest ratio of the declared σ to the rms residual of a coordinate that is not reported. In the
/// other direction, [`MAX_NOISE_FACTOR`] allows a ratio of √1000 ≈ 32.
const MAX_OVERSTATED_RATIO: f64 = 30.0;
/// Smallest ratio of the declared σ to the rms residual of a coordinate at which the positions were
/// not measured but computed. Micrometres taken for metres, the largest mistake of the unit of σ,
/// only give 1e6.
const MIN_COMPUTED_RATIO: f64 = 1e7;
/// Rms residual of a coordinate below which the data are exact to the rounding of doubles \[m\] or
/// \[rad\]: a simulation without noise, for which the declared σ is not checked.
const MIN_MEASURED_RMS: f64 = 1e-12;
/// Smallest ratio of the number of measured numbers to that of fitted parameters at which the
/// residual shows the noise.
const MIN_NUMBERS_PER_PARAMETER: usize = 2;

/// Checks that the declared σ of the leading kind of rows (positions, if there are any) is not far
/// above the rms residual of the fit.
pub(super) fn sigma_is_not_overstated(fit: &CheckedFit) -> Option<Finding> {
    let measurements = fit.table();
    let kind = fit.kind(measurements.leading());
    let sigma = kind.declared_sigma?;
    let rms = fit.rms_at(&kind.rows, &fit.end.x) / kind.observation.expected_norm();
    if !rms.is_finite()
        || rms < MIN_MEASURED_RMS
        || sigma <= MAX_OVERSTATED_RATIO * rms
        || kind.observation.coordinates() * kind.rows.len()
            < MIN_NUMBERS_PER_PARAMETER * fit.whole.unknowns.len()
    {
        return None;
    }
    let name = kind.observation.kind();
    // Beside a mistake of table or problem, the residual does not tell the noise.
    if read_as_meant(fit).is_some() {
        return None;
    }
    let is_position = kind.observation.is_position();
    let camera = kind.rows.first().and_then(|&row| {
        let fixture = measurements.observation(row).fixtures()[0]?;
        fit.problem.fixtures.get(fixture).filter(|fixture| fixture.sigma.is_some())
    });
    let place = match (measurements.files.first(), camera) {
        (_, Some(camera)) => {
            let line = camera.location.of_line();
            format!("pixel_sigma of camera {}, {line}", camera.name)
        }
        (Some(file), _) if is_position && measurements.sigma.is_some() => {
            format!("column sigma_mm of {}", file.display())
        }
        _ if is_position => fit.problem.data.position_sigma_location.to_string(),
        _ => format!("{}_sigma, {}", kind.observation.kind(), fit.problem.data.location),
    };
    let shown = |error: f64| format_error(name, error, decimals(1e3 * error, 9).max(4));
    let text = format!(
        "the declared σ of {} ({place}) is {:.0} times the {} that the fit leaves",
        shown(sigma),
        sigma / rms,
        shown(rms)
    );
    let finding = Finding::new(FindingCode::SigmaOverstated, [sigma.into(), rms.into()], text);
    Some(if sigma > MIN_COMPUTED_RATIO * rms {
        finding.with_remedy(
            "measured positions scatter more than that: check whether these are targets or \
             computed positions",
        )
    } else if kind.observation.description().unit == Unit::Length && sigma / rms < UNIT_RATIOS.end {
        finding
    } else {
        finding.with_remedy("check its size and unit")
    })
}
