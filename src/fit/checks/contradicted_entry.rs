//! Declared number of the joint table or of the tool that the measurements contradict, with a
//! remedy that names it.

use nalgebra::Vector3;

use super::checked_fit::CheckedFit;
use super::row_kind::{AXES, format_error};
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::{Joint, JointKind, Problem, Target};
use crate::quantity::Unit;

/// Largest rms residual of the fit, as a fraction of the displacement that the deviation of one
/// parameter causes, at which this deviation explains the measurements.
const MAX_REMAINING_FRACTION: f64 = 0.1;
/// Largest distance of the declared number with one changed or two exchanged digits from the fitted
/// number, as a fraction of the difference of declared and fitted number.
const MAX_DIGIT_MISMATCH: f64 = 0.03;
/// Largest distance of the fitted target from the declared one rotated by 180° about z, as a
/// fraction of the target's distance from the z axis.
const MAX_TURN_MISMATCH: f64 = 0.1;
/// Largest distance of the fitted target from the declared one with exchanged coordinates or in
/// another unit, relative to its distance from the declared one or to its length. An error in d of
/// the last joint moves it as well.
const MAX_TARGET_MISMATCH: f64 = 0.15;
/// Smallest distance of a declared target from the z axis for which a rotation by 180° about z is
/// considered \[m\].
const MIN_TURNED_RADIUS: f64 = 1e-3;

/// Texts about a declared number from which the fitted one deviates far.
pub(super) struct ContradictedEntry {
    /// Statement of the declared and the fitted number, with the rms residual of the fit.
    pub words: String,
    /// Suggested remedy.
    pub remedy: String,
}

/// Returns the declared entry of the joint table, or the declared target, that the measurements
/// contradict; `None` unless this entry alone deviates far beyond its prior and the fit explains
/// the measurements.
///
/// `parameter` is the one with the largest deviation `x` from nominal, in σ of its prior. `is_far`
/// returns true for a parameter and its deviation if the deviation is far beyond the prior.
pub(super) fn contradicted_entry(
    fit: &CheckedFit,
    deviation: (&Parameter, f64),
    is_far: impl Fn(&Parameter, f64) -> bool,
) -> Option<ContradictedEntry> {
    single_entry(fit, deviation, is_far).or_else(|| freed_target(fit))
}

/// Returns the names of two targets of one joint of which each is fitted where the other one is
/// declared; `None` if there are none.
pub(super) fn exchanged_targets<'a>(fit: &CheckedFit<'a>) -> Option<[&'a str; 2]> {
    let names = &fit.fitting.placement.targets;
    let fitted = |target: usize| {
        // The targets of the rows have another order than those of the problem.
        let mut declared = fit.problem.targets.iter();
        let declared = declared.find(|declared| declared.name == names[target])?;
        let mut place = declared.at;
        for (parameter, x) in fit.model().parameters.iter().zip(&fit.end.x) {
            match parameter.site {
                ParameterSite::Target { target: of, axis } if of == target && axis < 3 => {
                    place[axis] += x;
                }
                _ => (),
            }
        }
        Some((declared, place))
    };
    let fitted: Vec<(&Target, Vector3<f64>)> = (0..names.len()).filter_map(fitted).collect();
    let pairs = (0..fitted.len()).flat_map(|first| (0..first).map(move |other| [other, first]));
    pairs.map(|pair| pair.map(|place| fitted[place])).find_map(
        |[(one, place), (other, of_other)]| {
            let limit = MAX_TARGET_MISMATCH * (one.at - other.at).norm();
            let is_exchanged = one.joint == other.joint
                && (place - other.at).norm() < limit
                && (of_other - one.at).norm() < limit;
            // A tool that is turned moves other targets of the joint, too.
            let is_of_pair = |name: &str| name == one.name || name == other.name;
            let others =
                fitted.iter().filter(|(of, _)| of.joint == one.joint && !is_of_pair(&of.name));
            let are_others_kept = others.clone().all(|(of, place)| (place - of.at).norm() < limit);
            (is_exchanged && are_others_kept).then_some([one.name.as_str(), other.name.as_str()])
        },
    )
}

/// Returns the declared target if a fit without its prior explains the measurements and leaves all
/// other parameters within their priors.
fn freed_target(fit: &CheckedFit) -> Option<ContradictedEntry> {
    let kind = fit.table().leading();
    if !kind.is_position() {
        return None;
    }
    let declared = fit.problem.tool.target;
    let (moved, rms) = fit.freed_target()?;
    let is_explained = rms <= MAX_REMAINING_FRACTION * (moved - declared).norm();
    is_explained
        .then(|| tool_entry(fit.problem, declared, moved, &format_error(kind.kind(), rms, 2)))
}

/// Returns the entry of `parameter`, with the deviation `x`, if no other one deviates far.
fn single_entry(
    fit: &CheckedFit,
    (parameter, x): (&Parameter, f64),
    is_far: impl Fn(&Parameter, f64) -> bool,
) -> Option<ContradictedEntry> {
    let kind = fit.leading();
    let rms = fit.rms_at(&kind.rows, &fit.end.x);
    let displacement = match parameter.unit() {
        Unit::Length => x.abs(),
        Unit::Angle => x.abs() * fit.model().reach(),
        _ => return None,
    };
    if !kind.observation.is_position() || rms > MAX_REMAINING_FRACTION * displacement {
        return None;
    }
    // Position and orientation of a target are declared apart.
    let is_same = |site: ParameterSite| match (parameter.site, site) {
        (
            ParameterSite::Target { target, axis },
            ParameterSite::Target { target: other, axis: of_other },
        ) => target == other && (axis < 3) == (of_other < 3),
        (site, other) => site == other,
    };
    let fitted = || fit.model().parameters.iter().zip(&fit.end.x);
    if fitted().any(|(other, x)| !is_same(other.site) && is_far(other, *x)) {
        return None;
    }
    let left = format_error(kind.observation.kind(), rms, 2);
    match parameter.site {
        ParameterSite::Joint { joint, .. } => {
            Some(joint_entry(fit.problem.joints.get(joint)?, parameter, x, &left))
        }
        ParameterSite::Target { axis, .. } if fit.problem.targets.is_empty() => {
            let tool = &fit.problem.tool;
            let declared = if axis < 3 { tool.target } else { tool.rotation };
            let mut moved = declared;
            for (other, x) in fitted().filter(|(other, _)| is_same(other.site)) {
                if let ParameterSite::Target { axis, .. } = other.site {
                    moved[axis % 3] += x;
                }
            }
            Some(if axis < 3 {
                tool_entry(fit.problem, declared, moved, &left)
            } else {
                rotation_entry(declared, moved, &left)
            })
        }
        _ => None,
    }
}

/// Describes the entry of the joint table that declares `parameter`, whose fitted deviation is `x`.
/// `left` is the formatted rms residual of the fit.
fn joint_entry(joint: &Joint, parameter: &Parameter, x: f64, left: &str) -> ContradictedEntry {
    let display = parameter.unit().display(parameter.nominal);
    let shown = |value: f64| value * display.factor;
    let (declared, fitted) = (shown(parameter.nominal), shown(parameter.value(x)));
    let symbol = &display.symbol;
    let gap = if symbol == "°" { "" } else { " " };
    let place = joint.location.of_line();
    let words = format!(
        "{}{gap}{symbol} is declared ({place}), the measurements say {fitted:.2}{gap}{symbol}, with \
         which the error is {left}",
        rounded(declared)
    );
    let digits = typing_error(declared, fitted).map_or_else(String::new, |(meant, how)| {
        format!(" (was {}{gap}{symbol} meant, {how}?)", rounded(meant))
    });
    let remedy = format!(
        "if the entry is mistyped{digits}, correct it; if it is right, check the columns and axes, \
         or declare a larger σ"
    );
    ContradictedEntry { words, remedy }
}

/// Describes the target of `[tool]` as declared and as fitted, both in the frame that carries it
/// \[m\]. `left` is the formatted rms residual of the fit.
fn tool_entry(
    problem: &Problem,
    declared: Vector3<f64>,
    fitted: Vector3<f64>,
    left: &str,
) -> ContradictedEntry {
    let vector = |v: Vector3<f64>, decimals: usize| {
        let number = |value: &f64| {
            if decimals == 0 { rounded(value * 1e3) } else { format!("{:.decimals$}", value * 1e3) }
        };
        v.iter().map(number).collect::<Vec<_>>().join(", ")
    };
    let words = format!(
        "the target is declared at [{}] mm, the measurements say [{}] mm, with which the error \
         is {left}",
        vector(declared, 0),
        vector(fitted, 1)
    );
    // A fixed joint without a turn carries the tool in the axes of the flange.
    let carrier = problem.joints.get(problem.tool.joint).filter(|joint| {
        joint.kind == JointKind::Fixed && joint.placement.is_some_and(|at| at.rpy.norm() == 0.0)
    });
    let offset = carrier
        .and_then(|joint| joint.placement)
        .map_or_else(Vector3::zeros, |placement| placement.xyz);
    let (from, to) = (declared + offset, fitted + offset);
    let turned = Vector3::new(-from.x, -from.y, from.z);
    let radius = from.xy().norm();
    let is_turned = radius > MIN_TURNED_RADIUS && (to - turned).norm() < MAX_TURN_MISMATCH * radius;
    let remedy = if is_turned {
        "the tool is turned by 180° about z: correct x and y of the tool or of its fixed joint"
            .to_owned()
    } else {
        mistaken_target(declared, fitted).map_or_else(
            || {
                "enter the target in [tool] if the tool was declared wrongly or not at all; an \
                 error in d of the last joint looks the same"
                    .to_owned()
            },
            |mistake| format!("{mistake}: correct target_m"),
        )
    };
    ContradictedEntry { words, remedy }
}

/// Returns the words for exchanged coordinates or another unit of the declared target, with which
/// it is near the fitted one \[m\].
pub(super) fn mistaken_target(declared: Vector3<f64>, fitted: Vector3<f64>) -> Option<String> {
    let limit = MAX_TARGET_MISMATCH * (fitted - declared).norm();
    let exchanged = [(0, 1), (0, 2), (1, 2)].into_iter().find(|&(first, second)| {
        let mut meant = declared;
        meant.swap_rows(first, second);
        (meant - fitted).norm() < limit
    });
    if let Some((first, second)) = exchanged {
        let name = |axis: usize| AXES[axis];
        return Some(format!("{} and {} seem to be exchanged", name(first), name(second)));
    }
    let units = [(1e-3, "millimetres"), (1e-2, "centimetres"), (0.0254, "inches")];
    let is_unit = |(factor, _): &(f64, &str)| {
        (declared * *factor - fitted).norm() < MAX_TARGET_MISMATCH * fitted.norm()
    };
    let (_, unit) = units.into_iter().find(is_unit)?;
    Some(format!("the numbers seem to be {unit} under a key in metres"))
}

/// Describes the orientation of the target of `[tool]` as declared and as fitted \[rad\]. `left` is
/// the formatted rms residual of the fit.
fn rotation_entry(declared: Vector3<f64>, fitted: Vector3<f64>, left: &str) -> ContradictedEntry {
    let degrees = |v: Vector3<f64>| {
        let number = |value: &f64| rounded((value.to_degrees() * 10.0).round() / 10.0);
        v.iter().map(number).collect::<Vec<_>>().join(", ")
    };
    let words = format!(
        "the target is declared with rotation_deg = [{}], the measurements say [{}], with which the \
         error of the position is {left}",
        degrees(declared),
        degrees(fitted)
    );
    let remedy = "if the probe is mounted so, enter that in [tool]; otherwise check the frame and the \
                  convention of the orientation columns";
    ContradictedEntry { words, remedy: remedy.to_owned() }
}

/// Formats a number with at most six decimals, without those that the conversion of units added.
pub(super) fn rounded(value: f64) -> String {
    ((value * 1e6).round() / 1e6 + 0.0).to_string()
}

/// Returns the number that was probably meant: the declared number with two neighbouring digits
/// exchanged or one digit changed, and the words for that. `None` unless such a number is near the
/// fitted one.
fn typing_error(declared: f64, fitted: f64) -> Option<(f64, &'static str)> {
    if declared == 0.0 {
        return None;
    }
    let digits = rounded(declared).into_bytes();
    let is_digit = |place: usize| digits.get(place).is_some_and(u8::is_ascii_digit);
    let exchanged = (1..digits.len()).filter_map(|place| {
        let first = if is_digit(place - 1) { place - 1 } else { place.checked_sub(2)? };
        let mut changed = digits.clone();
        (is_digit(first) && is_digit(place)).then(|| changed.swap(first, place))?;
        Some((changed, "and two digits exchanged"))
    });
    // A change of the last digit comes near almost any fitted number, so it is not tried.
    let last = (0..digits.len()).rev().find(|&place| is_digit(place)).unwrap_or(0);
    let replaced = (0..last).filter(|&place| is_digit(place)).flat_map(|place| {
        let digits = &digits;
        (b'0'..=b'9').map(move |digit| {
            let mut changed = digits.clone();
            changed[place] = digit;
            (changed, "and one digit mistyped")
        })
    });
    let near = |(changed, how): (Vec<u8>, &'static str)| {
        let meant: f64 = String::from_utf8(changed).ok()?.parse().ok()?;
        let is_near = (meant - fitted).abs() < MAX_DIGIT_MISMATCH * (fitted - declared).abs();
        is_near.then_some((meant, how))
    };
    let distance = |(meant, _): &(f64, &str)| (meant - fitted).abs();
    let closest = |found: &mut dyn Iterator<Item = (f64, &'static str)>| {
        found.min_by(|a, b| distance(a).total_cmp(&distance(b)))
    };
    closest(&mut exchanged.filter_map(near)).or_else(|| closest(&mut replaced.filter_map(near)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistyped_digits_are_recognised() {
        assert_eq!(typing_error(-325.0, -425.3), Some((-425.0, "and one digit mistyped")));
        assert_eq!(typing_error(194.65, 94.7), Some((94.65, "and one digit mistyped")));
        assert_eq!(typing_error(240.0, 420.2), Some((420.0, "and two digits exchanged")));
        assert_eq!(typing_error(82.3, 113.0), None);
        assert_eq!(typing_error(800.0, 805.05), None);
        assert_eq!(typing_error(0.0, 5.0), None);
        assert_eq!(rounded(0.0892 * 1e3), "89.2");
    }
}
