//! Misreadings of entries of the joint table: its convention, units, signs and exchanged entries.

use std::f64::consts::PI;

use super::commands::choices;
use super::{Kind, Misreading, power_of_ten};
use crate::model::parameter::JointField;
use crate::problem::{Joint, JointKind, Problem};

/// Declared length \[m\] above which a number may be in millimetres instead.
pub(super) const MIN_MILLIMETRE_LENGTH: f64 = 1.0;
/// Smallest absolute angle of the joint table, as a number of degrees, that may be meant in
/// radians.
const MIN_RADIANS: f64 = 0.3;
/// Range of plausible lengths of a joint \[m\]. A length is tried in another unit if it is then in
/// this range.
const PLAUSIBLE_LENGTHS: std::ops::Range<f64> = 0.01..3.0;
/// Trial errors of an angle α of the joint table \[°\]. For α = ±90°, an error of 180° is the same
/// as the other sign, which is tried anyway.
const TWISTS: [i16; 3] = [-90, 90, 180];

/// Returns the misreadings of the joint table.
pub(super) fn of_joint_table(problem: &Problem) -> Vec<Misreading> {
    use JointField::{A, Alpha, Beta, D, Theta};
    let standard = Misreading::of_problem(
        "a joint table in standard DH form (declare dh = \"standard\")",
        |problem| replace(problem, Problem::read_as_standard),
    );
    let modified = Misreading::of_problem(
        "a joint table in modified DH form, declared as standard (declare dh = \"modified\")",
        |problem| replace(problem, Problem::read_as_modified),
    );
    let mut forms = vec![standard.of_kind(Kind::Usual), modified.of_kind(Kind::Usual)];
    let rows = problem.standard_rows().map_or(problem.joints.len(), <[Joint]>::len);
    forms.extend((1..rows).map(|row| of_exchanged_rows(problem, row)));
    forms.extend(of_exchanged_lengths(problem));
    // Entries of one joint, or of all joints together, that must be multiplied.
    let scaled = |what: &str, (joint, field), factor: f64, applies: fn(f64) -> bool| {
        let words = format!("{} that {what}", entry_name(joint, field));
        let scaled = Misreading::of_problem(words, move |problem| {
            scale(problem, (joint, field), factor, applies)
        });
        scaled.at(place(problem, joint, field))
    };
    let sign = |joint, field| {
        let kind = if joint > 0 && field == Alpha { Kind::AlphaSign(joint) } else { Kind::Other };
        scaled("has the other sign", (joint, field), -1.0, |_| true).of_kind(kind)
    };
    let radians = |joint, field| {
        let is_small = |angle: f64| angle.to_degrees().abs() <= 2.0 * PI;
        let words = "is in radians, declared in degrees";
        scaled(words, (joint, field), 180.0 / PI, is_small)
    };
    let degrees = |joint, field| {
        let is_large = |angle: f64| angle.abs() > 2.0 * PI;
        let words = "is in degrees, declared in radians";
        scaled(words, (joint, field), PI / 180.0, is_large)
    };
    for field in [Alpha, Theta, Beta] {
        let mut counts = [0; 3];
        for (joint, declared) in (1..).zip(&problem.joints) {
            let Some(angle) = value_of(declared, field) else { continue };
            if (MIN_RADIANS..=2.0 * PI).contains(&angle.to_degrees().abs()) {
                forms.push(radians(joint, field));
                counts[0] += 1;
            }
            if angle.abs() > 2.0 * PI {
                forms.push(degrees(joint, field));
                counts[1] += 1;
            }
            if angle != 0.0 {
                forms.push(sign(joint, field));
                counts[2] += 1;
            }
        }
        forms.extend((counts[2] > 1).then(|| sign(0, field)));
        forms.extend((counts[0] > 1).then(|| radians(0, field)));
        forms.extend((counts[1] > 1).then(|| degrees(0, field)));
    }
    for (joint, declared) in (2..).zip(problem.joints.iter().skip(1)) {
        let is_right = |&degrees: &i16| {
            let other_sign = degrees == 180 && (declared.alpha.abs() - PI / 2.0).abs() < 1e-9;
            !other_sign && declared.placement.is_none() && declared.kind != JointKind::Fixed
        };
        forms.extend(TWISTS.into_iter().filter(is_right).map(|degrees| {
            let error = if degrees == 180 { 180 } else { -degrees };
            let words = format!("{} that is {error}° off", entry_name(joint, Alpha));
            let twist = Misreading::of_problem(words, move |problem| {
                problem.joints.get_mut(joint - 1)?.alpha += f64::from(degrees).to_radians();
                Some(())
            });
            twist
                .of_kind(Kind::Twist)
                .in_group(format!("twist {joint}"))
                .at(place(problem, joint, Alpha))
        }));
    }
    for field in [A, D] {
        let is_set = |joint: &&Joint| value_of(joint, field).is_some_and(|length| length != 0.0);
        let is_of_several = problem.joints.iter().filter(is_set).count() > 1;
        forms.extend(is_of_several.then(|| sign(0, field)));
    }
    let is_long = |length: f64| length.abs() > MIN_MILLIMETRE_LENGTH;
    let count_long = |joint: &Joint| {
        lengths_of(&mut joint.clone()).iter().filter(|length| is_long(***length)).count()
    };
    let long: usize = problem.joints.iter().map(count_long).sum();
    for (joint, declared) in (1..).zip(&problem.joints) {
        for field in [A, D, JointField::X, JointField::Y, JointField::Z] {
            let length = value_of(declared, field).unwrap_or(0.0);
            if length == 0.0 {
                continue;
            }
            forms.push(sign(joint, field));
            // If only one length is long, the misreading of the whole arm covers the case.
            let is_tried = |power: &i8| {
                PLAUSIBLE_LENGTHS.contains(&(length.abs() * power_of_ten(*power)))
                    && (*power != -3 || !is_long(length) || long > 1)
            };
            forms.extend([-3, 3, -2, 2, -1, 1].into_iter().filter(is_tried).map(|power| {
                let what = match power {
                    -3 => "is in millimetres, declared in metres".to_owned(),
                    3 => "is in metres, declared in millimetres".to_owned(),
                    _ => format!("should be multiplied by {}", power_of_ten(power)),
                };
                let scaled = scaled(&what, (joint, field), power_of_ten(power), |_| true);
                scaled.in_group(format!("length of {}", entry_name(joint, field)))
            }));
        }
    }
    forms
}

/// Replaces a problem by another reading of it.
fn replace(problem: &mut Problem, read: fn(&Problem) -> Option<Problem>) -> Option<()> {
    *problem = read(problem)?;
    Some(())
}

/// Returns the misreading that two neighbouring rows of the joint table are exchanged, the first of
/// which has this number.
fn of_exchanged_rows(problem: &Problem, row: usize) -> Misreading {
    let words = format!("rows {row} and {} of the joint table that are exchanged", row + 1);
    let exchanged = Misreading::of_problem(words, move |problem| {
        *problem = problem.with_changed_joint_rows(|rows| {
            let [first, second] = rows.get_mut(row - 1..=row)? else { return None };
            exchange_joint_rows(first, second)
        })?;
        Some(())
    });
    exchanged.at(place_of_row(problem, row))
}

/// Exchanges the entries of two joints in the joint table. Returns `None`, and changes nothing, if
/// the entries are equal or a joint has a placement or a beam.
fn exchange_joint_rows(first: &mut Joint, second: &mut Joint) -> Option<()> {
    use JointField::{A, Alpha, Beta, D, Theta};
    let fields = [Alpha, A, Theta, D, Beta];
    let row = |joint: &Joint| fields.map(|field| value_of(joint, field).map(f64::to_bits));
    let has_row = |joint: &Joint| joint.placement.is_none() && joint.beam.is_none();
    if row(first) == row(second) || !has_row(first) || !has_row(second) {
        return None;
    }
    for field in fields {
        std::mem::swap(number_of(first, field)?, number_of(second, field)?);
    }
    Some(())
}

/// Returns the misreadings that two different lengths of one joint, or of two neighbouring ones,
/// are exchanged.
fn of_exchanged_lengths(problem: &Problem) -> Vec<Misreading> {
    use JointField::{A, D};
    let is_standard = problem.standard_rows().is_some();
    let rows = problem.standard_rows().map_or(problem.joints.len(), <[Joint]>::len);
    // A standard sheet declares neither a of the first joint nor d of the flange after its last row.
    let is_declared =
        |joint: usize, field| !is_standard || if field == A { joint > 1 } else { joint <= rows };
    let value = |joint: usize, field| {
        let found = problem.joints.get(joint - 1)?;
        let has_row = found.placement.is_none() && found.beam.is_none();
        value_of(found, field).filter(|_| has_row && is_declared(joint, field))
    };
    let mut exchanged = Vec::new();
    for joint in 1..=problem.joints.len() {
        let next = joint + 1;
        for (field, with, other) in
            [(A, joint, D), (A, next, A), (A, next, D), (D, next, A), (D, next, D)]
        {
            let Some((one, length)) = value(joint, field).zip(value(with, other)) else {
                continue;
            };
            if one.total_cmp(&length).is_eq() {
                continue;
            }
            let words = format!(
                "{} and {} that are exchanged",
                entry_name(joint, field),
                entry_name(with, other)
            );
            let misreading = Misreading::of_problem(words, move |problem| {
                *number_of(problem.joints.get_mut(joint - 1)?, field)? = length;
                *number_of(problem.joints.get_mut(with - 1)?, other)? = one;
                Some(())
            });
            // In a table in standard DH form, a of a joint is in the row before.
            let row = |joint: usize, of| joint - usize::from(is_standard && of == A);
            let (first, second) = (row(joint, field), row(with, other));
            let [field, other] = [field, other].map(JointField::name);
            let of_rows = if first == second {
                format!("a and d of row {first} of the joint table that are exchanged")
            } else {
                format!(
                    "{field} of row {first} and {other} of row {second} of the joint table that are \
                     exchanged"
                )
            };
            let located = place_of_row(problem, first).map(|place| format!("{of_rows} ({place})"));
            exchanged.push(misreading.located(located));
        }
    }
    exchanged
}

/// Returns the misreadings of two entries of the joint table of which each alone is `tested`: two
/// angles α of the other sign and, unless another misreading is near, two zero positions that are off
/// by quarter turns.
pub(super) fn of_two_entries(
    problem: &Problem,
    tested: &[Misreading],
    is_near: bool,
) -> Vec<Misreading> {
    let pairs = |joint: fn(Kind) -> Option<usize>| {
        let joints = tested.iter().filter_map(|misreading| joint(misreading.kind));
        choices(&joints.collect::<Vec<_>>(), 2)
    };
    let signs = pairs(|kind| match kind {
        Kind::AlphaSign(joint) => Some(joint),
        _ => None,
    });
    let zeros = pairs(|kind| match kind {
        Kind::Zero(joint, 90) => Some(joint),
        _ => None,
    });
    let zeros = zeros.iter().filter(|_| !is_near).flat_map(|pair| Misreading::of_two_zeros(pair));
    signs.iter().map(|pair| of_two_signs(problem, pair)).chain(zeros).collect()
}

/// Returns the misreading that the angles α of two joints have the other sign.
fn of_two_signs(problem: &Problem, joints: &[usize]) -> Misreading {
    let (one, other) = (joints[0], joints[1]);
    let words = format!("alpha of joints {one} and {other} that have the other sign");
    let correct = move |problem: &mut Problem| {
        scale(problem, (one, JointField::Alpha), -1.0, |_| true)?;
        scale(problem, (other, JointField::Alpha), -1.0, |_| true)
    };
    let rows = problem.standard_rows();
    let rows = rows.map(|_| format!("rows {} and {} of the table", one - 1, other - 1));
    Misreading::of_problem(words, correct).at(rows)
}

/// Multiplies an entry of the joint with a number from 1, or of all joints if it is 0, by `factor`.
/// Entries stay if they are 0 or `applies` returns false for them; `None` if all stay.
fn scale(
    problem: &mut Problem,
    (joint, field): (usize, JointField),
    factor: f64,
    applies: fn(f64) -> bool,
) -> Option<()> {
    let joints = (1..).zip(&mut problem.joints);
    let chosen = joints.filter(|(number, _)| joint == 0 || *number == joint);
    let mut count = 0;
    for value in chosen.filter_map(|(_, joint)| number_of(joint, field)) {
        if *value != 0.0 && applies(*value) {
            *value *= factor;
            count += 1;
        }
    }
    (count > 0).then_some(())
}

/// Returns the declared lengths of a joint \[m\]: a, d, and the translation of its placement.
pub(super) fn lengths_of(joint: &mut Joint) -> Vec<&mut f64> {
    let placement = joint.placement.as_mut().map(|placement| placement.xyz.iter_mut());
    [&mut joint.a, &mut joint.d].into_iter().chain(placement.into_iter().flatten()).collect()
}

/// Returns the entry of a joint for a field of the joint table \[rad\] or \[m\]; `None` if the
/// joint has no such entry.
pub(super) fn number_of(joint: &mut Joint, field: JointField) -> Option<&mut f64> {
    let placement = joint.placement.as_mut();
    match field {
        JointField::Alpha => Some(&mut joint.alpha),
        JointField::Theta => Some(&mut joint.theta),
        JointField::Beta => Some(&mut joint.beta),
        JointField::A => Some(&mut joint.a),
        JointField::D => Some(&mut joint.d),
        JointField::X => placement.map(|placement| &mut placement.xyz.x),
        JointField::Y => placement.map(|placement| &mut placement.xyz.y),
        JointField::Z => placement.map(|placement| &mut placement.xyz.z),
        _ => None,
    }
}

/// Returns the value of an entry of a joint; `None` if it has no such entry.
pub(super) fn value_of(joint: &Joint, field: JointField) -> Option<f64> {
    number_of(&mut joint.clone(), field).copied()
}

/// Returns the name of an entry of the joint table, such as `alpha of joint 3`; `joint` is 0 for
/// all joints.
pub(super) fn entry_name(joint: usize, field: JointField) -> String {
    let name = match field {
        JointField::A => "the length a",
        JointField::D => "the offset d",
        _ => field.name(),
    };
    match joint {
        0 => format!("{name} of all joints"),
        _ => format!("{name} of joint {joint}"),
    }
}

/// Returns the place in the file of an entry of the joint table. In a table in standard DH form, a
/// and α of a joint are in the row before.
pub(super) fn place(problem: &Problem, joint: usize, field: JointField) -> Option<String> {
    let is_before = matches!(field, JointField::A | JointField::Alpha);
    let is_standard = problem.standard_rows().is_some();
    place_of_row(problem, joint.checked_sub(usize::from(is_standard && is_before))?)
}

/// Returns the place in the file of a row of the joint table.
fn place_of_row(problem: &Problem, row: usize) -> Option<String> {
    let place = problem.joints.get(row.checked_sub(1)?)?.location.of_line();
    Some(match problem.standard_rows() {
        Some(_) => format!("row {row} of the table, {place}"),
        None => place.to_string(),
    })
}

impl Misreading {
    /// Returns the misreading with the place in the file of what is misread.
    fn at(self, place: Option<String>) -> Self {
        let located = place.map(|place| format!("{} ({place})", self.words));
        self.located(located)
    }
}
