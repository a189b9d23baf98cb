//! Checks of the fitted deviations from nominal against priors, the size of an arm, and the sign of
//! compliances.

use nalgebra::Vector3;

use super::checked_fit::CheckedFit;
use super::contradicted_entry::contradicted_entry;
use super::finding::{Finding, FindingCode};
use super::nominal_error::is_nominal_far_off;
use crate::fit::stages::parameter_size::largest_deviation;
use crate::fit::uncertainty::prior_sizes::PriorSize;
use crate::model::parameter::{JointField, Parameter, ParameterSite};
use crate::problem::pattern::matches;
use crate::problem::{FixtureKind, Observation};
use crate::quantity::Unit;
use crate::quantity::format::{decimals, number, two_digits};
use crate::spatial::{Frame, rotation_between};

/// Largest deviation of an arm parameter from nominal, in σ of its prior, that is not reported. A
/// normal deviation exceeds 5 σ once in two million.
pub(super) const MAX_PRIOR_SIGMAS: f64 = 5.0;

/// Smallest number of further lengths far beyond their priors at which the table is probably one of
/// another arm.
const MIN_FURTHER_LENGTHS: usize = 2;
/// Largest deviation from nominal of an angle \[rad\], or of a length relative to the reach, that
/// remains after the arm was built and set up: 0.11°, or 2 mm for each metre.
const MAX_BUILT_DEVIATION: f64 = 1e-3;
/// Usual σ of priors of angles \[°\]. A σ that is in this range if it is read in radians may be meant
/// so.
const USUAL_ANGLE_SIGMAS: std::ops::RangeInclusive<f64> = 0.05..=5.0;

/// Returns true if the parameter is a declared quantity of the arm, of a base or of a target; false
/// if it belongs to an effect or a fixture.
pub(super) fn is_of_arm(parameter: &Parameter) -> bool {
    let is_declared = match parameter.site {
        ParameterSite::Joint { field, .. } => field.is_geometry() || field == JointField::Stiffness,
        ParameterSite::Beam { .. } => parameter.site.unit().is_relative(),
        ParameterSite::Base { .. } | ParameterSite::Target { .. } => true,
        _ => false,
    };
    is_declared && parameter.regressor.is_constant()
}

/// Returns the absolute deviation `x` of a parameter in σ of its prior; `None` if it has no prior
/// or is no quantity of the arm, of a base or of a target ([`is_of_arm`]).
pub(super) fn prior_sigmas(parameter: &Parameter, x: f64) -> Option<f64> {
    Some(x.abs() / parameter.sigma.filter(|_| is_of_arm(parameter))?)
}

/// Checks that no parameter of the arm or of its fixtures deviates by more than
/// [`MAX_PRIOR_SIGMAS`] σ of its prior.
pub(super) fn within_priors(fit: &CheckedFit) -> Option<Finding> {
    let of_fixture = |parameter: &Parameter, x: f64| {
        let is_fixture = matches!(parameter.site, ParameterSite::Fixture { .. });
        let is_declared = is_fixture && parameter.regressor.is_constant();
        Some(x.abs() / parameter.sigma.filter(|_| is_declared)?)
    };
    let is_far = |parameter: &Parameter, x: f64| {
        prior_sigmas(parameter, x).is_some_and(|sigmas| sigmas > MAX_PRIOR_SIGMAS)
    };
    let finding = |(parameter, sigmas): (&Parameter, f64)| {
        let name = &parameter.name;
        let x = fitted_deviation(fit, parameter);
        let text = format!("{name} deviates from nominal by {sigmas:.0} times the σ of its prior");
        let numbers = [name.as_str().into(), sigmas.into()];
        if let (ParameterSite::Fixture { fixture, kind, axis }, Some(x)) = (parameter.site, x) {
            let text = format!("{text}{}", values_in_words(parameter, x));
            return Finding::new(FindingCode::BeyondPrior, numbers, text)
                .with_remedy(fixture_remedy(fit, fixture, (kind, axis)));
        }
        let entry = x.and_then(|x| contradicted_entry(fit, (parameter, x), is_far));
        if let Some(entry) = entry {
            let text = format!("{text}: {}", entry.words);
            return Finding::new(FindingCode::BeyondPrior, numbers, text).with_remedy(entry.remedy);
        }
        let values = x.map_or_else(String::new, |x| values_in_words(parameter, x));
        let finding = Finding::new(FindingCode::BeyondPrior, numbers, format!("{text}{values}"));
        let further = lengths_beyond(fit, is_far).saturating_sub(1);
        if further >= MIN_FURTHER_LENGTHS && is_nominal_far_off(fit) {
            return finding.with_remedy(format!(
                "so do {further} further lengths of the arm: check whether the table is one of this \
                 arm, then axes of the measuring frame, signs of joints, units, and the priors"
            ));
        }
        let finding = finding.with_remedy_of(remedy(fit, parameter, sigmas));
        match wider_priors(fit, parameter) {
            Some(rules) => {
                let remedy = format!(
                    "{}; if the arm may be so far from nominal, write in [parameters] {rules}",
                    finding.remedy
                );
                finding.with_remedy(remedy)
            }
            None => finding,
        }
    };
    let ratio =
        |parameter: &Parameter, x| prior_sigmas(parameter, x).or_else(|| of_fixture(parameter, x));
    let largest = largest_ratio(fit, ratio).filter(|(_, sigmas)| *sigmas > MAX_PRIOR_SIGMAS);
    largest.map(finding)
}

/// Returns the remedy for number `axis` of a fixture that deviates far from its declared value; it
/// states the fitted numbers of the key that declares it.
fn fixture_remedy(fit: &CheckedFit, fixture: usize, (kind, axis): (FixtureKind, usize)) -> String {
    let (key, axes, factor, digits) = match axis {
        6.. if kind.has_pose() => match axis {
            6..8 => ("focal_px", 6..8, 1.0, 1),
            8..10 => ("centre_px", 8..10, 1.0, 1),
            _ => ("distortion", 10..kind.fields().len(), 1.0, 4),
        },
        3.. if kind.has_pose() => ("rotation_deg", 3..6, 1f64.to_degrees(), 2),
        3 => ("radius_m", 3..4, 1.0, 4),
        _ => ("at_m", 0..3, 1.0, 4),
    };
    let Some(declared) = fit.problem.fixtures.get(fixture) else { return String::new() };
    let mut numbers: Vec<f64> =
        declared.known.iter().map(|number| number.unwrap_or_default()).collect();
    for (parameter, x) in fit.model().parameters.iter().zip(&fit.end.x) {
        if let ParameterSite::Fixture { fixture: of, axis, .. } = parameter.site
            && of == fixture
            && parameter.regressor.is_constant()
            && let Some(number) = numbers.get_mut(axis)
        {
            *number = parameter.value(*x);
        }
    }
    let word = kind.word();
    let shown = numbers.get(axes).filter(|_| kind != FixtureKind::Plane).map(|numbers| {
        let numbers: Vec<String> =
            numbers.iter().map(|value| number(value * factor, digits)).collect();
        match numbers.as_slice() {
            [radius] => format!(": {key} = {radius} as fitted"),
            numbers => format!(": {key} = [{}] as fitted", numbers.join(", ")),
        }
    });
    format!(
        "if it is mistyped, a guess or in another unit, correct it in [[{word}]] \"{}\"{}; \
         otherwise check axes, signs of joints, names in the column {word}, and the σ",
        declared.name,
        shown.unwrap_or_default()
    )
}

/// Returns the rules of `[parameters]` with the prior widths that the data indicate, if that of
/// `parameter` is among those that are too narrow; `None` otherwise.
fn wider_priors(fit: &CheckedFit, parameter: &Parameter) -> Option<String> {
    let wider = || fit.prior_sizes.iter().filter(|size| size.found > size.declared);
    wider().find(|size| matches(&size.pattern, &parameter.name))?;
    let rule = |size: &PriorSize| {
        let (key, factor) = match size.unit {
            Unit::Angle => ("sigma_deg", 1f64.to_degrees()),
            _ => ("sigma_mm", 1e3),
        };
        let found = two_digits(size.found * factor, 4);
        format!("\"{}\" = {{ {key} = {found} }}", size.pattern)
    };
    Some(wider().map(rule).collect::<Vec<_>>().join(" and "))
}

/// Returns the number of lengths of joints for which `is_far` is true.
fn lengths_beyond(fit: &CheckedFit, is_far: impl Fn(&Parameter, f64) -> bool) -> usize {
    let fitted = fit.model().parameters.iter().zip(&fit.end.x);
    let is_length = |parameter: &Parameter| {
        matches!(parameter.site, ParameterSite::Joint { .. }) && parameter.unit() == Unit::Length
    };
    fitted.filter(|(parameter, x)| is_length(parameter) && is_far(parameter, **x)).count()
}

/// Units of a torsional stiffness, each with its size in N·m/rad.
const STIFFNESS_UNITS: [(f64, &str); 3] =
    [(180.0 / std::f64::consts::PI, "N·m/°"), (1e3, "kN·m/rad"), (3437.75, "N·m/arcmin")];

/// Returns the fitted deviation of a parameter from nominal.
fn fitted_deviation(fit: &CheckedFit, parameter: &Parameter) -> Option<f64> {
    let mut fitted = fit.model().parameters.iter().zip(&fit.end.x);
    fitted.find(|(other, _)| std::ptr::eq(*other, parameter)).map(|(_, x)| *x)
}

/// States the nominal and the fitted value of a parameter and σ of its prior: " (nominal 200.0 mm,
/// fitted 310.2 mm, σ 10.0 mm)".
fn values_in_words(parameter: &Parameter, x: f64) -> String {
    let unit = parameter.unit().display(parameter.nominal);
    let digits = decimals((x * unit.factor).abs(), 4);
    let show = |value: f64| format!("{} {}", number(value * unit.factor, digits), unit.symbol);
    if parameter.unit().is_relative() {
        return format!(" (fitted: {} times the declared value)", two_digits(x.exp(), 4));
    }
    let sigma = parameter.sigma.map_or_else(String::new, |sigma| {
        format!(", σ {} {}", two_digits(sigma * unit.factor, 4), unit.symbol)
    });
    format!(" (nominal {}, fitted {}{sigma})", show(parameter.nominal), show(parameter.value(x)))
}

/// Returns the ratio of the fitted value of a parameter to its nominal one.
fn fitted_ratio(fit: &CheckedFit, parameter: &Parameter) -> Option<f64> {
    let x = fitted_deviation(fit, parameter)?;
    (parameter.nominal != 0.0).then(|| parameter.value(x) / parameter.nominal)
}

/// Returns the remedy for a parameter that deviates by `sigmas` σ of its prior, where its kind or
/// the size of σ suggests one.
fn remedy(fit: &CheckedFit, parameter: &Parameter, sigmas: f64) -> Option<String> {
    let ratio = fitted_ratio(fit, parameter);
    let is_stiffness =
        matches!(parameter.site, ParameterSite::Joint { field: JointField::Stiffness, .. });
    let ratio = ratio.filter(|ratio| is_stiffness && *ratio > 1.0);
    if let Some(ratio) = ratio {
        let unit = STIFFNESS_UNITS.iter().find(|(factor, _)| (ratio / factor).ln().abs() < 0.2);
        let unit = unit.map_or(String::new(), |(_, unit)| format!(", as one in {unit} would be"));
        return Some(format!(
            "the fitted stiffness is {ratio:.3} times the declared one{unit}; check its unit, \
             those of masses and payload_at, then the prior"
        ));
    }
    if let ParameterSite::Base { base, .. } = parameter.site {
        if let Some(remedy) = euler_remedy(fit, base) {
            return Some(remedy);
        }
        return Some(
            "declare the pose of the arm's base in the measuring frame, not that of the instrument in the \
             frame of the base, or a larger σ; then check signs of joints and units"
                .to_owned(),
        );
    }
    let kind = fit.table().leading().kind();
    if parameter.unit() == Unit::Length && !fit.table().leading().is_position() {
        let scale = if kind == Observation::Pixel(0, 0, 0).kind() {
            "check the points of the marker, such as the size of its squares"
        } else if !fit.problem.distances.is_empty() {
            "check the lengths of [[distance]]"
        } else {
            return None;
        };
        return Some(format!(
            "{scale}, from which all lengths follow; then axes, signs of joints, and the prior"
        ));
    }
    let sigma = parameter.sigma.filter(|_| parameter.unit() == Unit::Angle).map(f64::to_degrees);
    let in_radians = sigma.unwrap_or_default().to_degrees();
    let is_usual = USUAL_ANGLE_SIGMAS.contains(&in_radians);
    let sigma = sigma.filter(|_| is_usual && sigmas.to_radians() < MAX_PRIOR_SIGMAS);
    let in_words = sigma.map(|sigma| {
        format!(
            "if the σ of {sigma:.4}° is meant in radians ({in_radians:.2}°), write sigma_rad; otherwise \
             check axes of the measuring frame, signs of joints, and units"
        )
    });
    in_words.or_else(|| {
        let x = fitted_deviation(fit, parameter)?.abs();
        let is_small = match parameter.unit() {
            Unit::Length => x < MAX_BUILT_DEVIATION * fit.model().reach(),
            Unit::Angle => x < MAX_BUILT_DEVIATION,
            _ => false,
        };
        is_small.then(|| {
            "arms are built with such deviations, so the σ of this prior is probably too small: \
             declare a larger one in [parameters]; otherwise check axes of the measuring frame, signs \
             of joints, and units"
                .to_owned()
        })
    })
}

/// Largest angle between the fitted base and the declared rotation read as Euler angles, at which
/// they are the same: 3° \[rad\].
const MAX_EULER_MISMATCH: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Returns the remedy for Euler angles that are declared as the rotation vector of the base; `None`
/// unless the fitted base of index `base` has the rotation that these angles mean.
fn euler_remedy(fit: &CheckedFit, base: usize) -> Option<String> {
    let declared = fit.problem.base.rotation;
    let frame = |rotation: &Vector3<f64>| Frame::from_rotation_vector(Vector3::zeros(), rotation);
    let read = Frame::from_xyz_rpy(&Vector3::zeros(), &declared);
    let angle =
        |one: &Frame<f64>, other: &Frame<f64>| rotation_between(&one.axes, &other.axes).norm();
    let bases = fit.model().base_frames(fit.end.x.as_slice());
    let fitted = bases.get(base)?;
    let is_read = angle(&read, fitted) < MAX_EULER_MISMATCH;
    let is_other = angle(&read, &frame(&declared)) > 2.0 * MAX_EULER_MISMATCH;
    let shown = |vector: Vector3<f64>| {
        vector
            .map(f64::to_degrees)
            .iter()
            .map(|angle| number(*angle, 3))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let vector = rotation_between(&frame(&Vector3::zeros()).axes, &read.axes);
    (is_read && is_other).then(|| {
        format!(
            "rotation_deg of [base] is a rotation vector; [{}] fits as Euler angles (roll, \
             pitch, yaw), which are rotation_deg = [{}]",
            shown(declared),
            shown(vector)
        )
    })
}

/// Checks that no parameter deviates from nominal by more than is possible on this arm. Limits are
/// its reach for a length, half a turn for an angle, and a factor of 100 for a stiffness.
pub(super) fn within_arm_size(fit: &CheckedFit) -> Option<Finding> {
    let model = fit.model();
    let ratio =
        |parameter: &Parameter, x: f64| Some(x.abs() / largest_deviation(model, parameter)?);
    let finding = |(parameter, sizes): (&Parameter, f64)| {
        let unit = match parameter.unit() {
            Unit::Length => "the arm's own size",
            Unit::Angle => "half a turn",
            _ => "a factor of 100",
        };
        let name = &parameter.name;
        let text = format!(
            "{name} deviates from nominal by {sizes:.1} times {unit}: more than is possible \
             on an arm"
        );
        let numbers = [name.as_str().into(), sizes.into()];
        Finding::new(FindingCode::BeyondArmSize, numbers, text)
    };
    let largest = largest_ratio(fit, ratio).filter(|(_, sizes)| *sizes > 1.0);
    largest.map(finding)
}

/// Largest number of standard errors by which a compliance may be below 0 without a report.
const MAX_NEGATIVE_SIGMAS: f64 = 5.0;

/// Checks that no joint gives way against its load: no compliance, declared part included, is
/// negative by more than [`MAX_NEGATIVE_SIGMAS`] standard errors.
pub(super) fn gives_way_to_loads(fit: &CheckedFit) -> Option<Finding> {
    let of_unknown = |(place, &k): (usize, &usize)| {
        let parameter = &fit.model().parameters[k];
        let ParameterSite::Joint { joint, field: JointField::Compliance } = parameter.site else {
            return None;
        };
        let stiffness = fit.problem.joints.get(joint)?.stiffness;
        let declared = stiffness.map_or(0.0, f64::recip);
        let compliance = declared + fit.end.x[k];
        let sigmas = -compliance / fit.covariance[(place, place)].sqrt();
        (parameter.regressor.is_constant() && sigmas.is_finite())
            .then_some((parameter, compliance, sigmas))
    };
    let unknowns = fit.whole.unknowns.iter().enumerate();
    let tested: Vec<(&Parameter, f64, f64)> = unknowns.filter_map(of_unknown).collect();
    let worst = tested.iter().copied().max_by(|a, b| a.2.total_cmp(&b.2));
    // Gravity the other way turns the sign of every compliance.
    let is_opposite = tested.iter().all(|(_, _, sigmas)| *sigmas > -MAX_NEGATIVE_SIGMAS);
    let finding = |(parameter, compliance, sigmas): (&Parameter, f64, f64)| {
        let name = &parameter.name;
        let text = format!(
            "{name} is {:.3} µrad/(N·m), {sigmas:.0} standard errors below 0: the arm bends \
             against its load",
            compliance * 1e6
        );
        let numbers = [name.as_str().into(), compliance.into(), sigmas.into()];
        let finding = Finding::new(FindingCode::GivesWayUpwards, numbers, text);
        let gravity = fit.problem.gravity;
        if !is_opposite || gravity.norm() == 0.0 {
            return finding;
        }
        let axes: Vec<String> = gravity.iter().map(|axis| (0.0 - axis).to_string()).collect();
        let remedy = format!(
            "if the arm hangs from a ceiling, or the sign of gravity is wrong, write \
             gravity_m_s2 = [{}], with which it bends under its load; otherwise check the \
             places of masses and payload, and whether a spring, counterweight or hoist is missing",
            axes.join(", ")
        );
        finding.with_remedy(remedy)
    };
    worst.filter(|(_, _, sigmas)| *sigmas > MAX_NEGATIVE_SIGMAS).map(finding)
}

/// Returns the parameter for which `ratio` is largest, with that ratio. `ratio` returns the
/// absolute deviation of a parameter over its limit, or `None` if it has no limit.
fn largest_ratio<'a>(
    fit: &CheckedFit<'a>,
    ratio: impl Fn(&Parameter, f64) -> Option<f64>,
) -> Option<(&'a Parameter, f64)> {
    // Parameters that only held-out rows use are not fitted.
    let later = &fit.fitting.held_out_only.parameters;
    let parameters = fit.model().parameters.iter().zip(&fit.end.x).zip(later);
    let fitted = parameters.filter(|(_, later)| !**later).map(|(fitted, _)| fitted);
    let ratios = fitted.filter_map(|(parameter, &x)| Some((parameter, ratio(parameter, x)?)));
    ratios.max_by(|a, b| a.1.total_cmp(&b.1))
}
