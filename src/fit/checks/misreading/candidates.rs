//! Candidates: the misreadings that a problem and the columns of its table allow.

use std::f64::consts::PI;

use super::commands::{TURN_UNITS, of_commands, of_mixed_units, turns_in};
use super::{MassScale, Misreading, POSITION_UNITS};
use crate::measurement::Measurements;
use crate::model::parameter::JointField;
use crate::problem::{Joint, JointKind, Problem};

/// Trial ratios of one coordinate of the positions to the two others, in millionths.
const TRIAL_RATIOS: [u32; 8] =
    [800_000, 900_000, 950_000, 980_000, 1_020_000, 1_050_000, 1_100_000, 1_250_000];
/// Smallest absolute angle of the joint table, as a number of degrees, that may be meant in
/// radians.
const MIN_RADIANS: f64 = 0.3;
/// Range of plausible lengths of a joint \[m\]. A length is tried in another unit if it is then in
/// this range.
const PLAUSIBLE_LENGTHS: std::ops::Range<f64> = 0.01..3.0;
/// Maximum number of masses that are tried one by one.
const MAX_MASSES: usize = 12;
/// Scales of masses that leave an error far beyond the noise.
const GROSS_MASS_SCALES: [MassScale; 4] =
    [MassScale::Power(-3), MassScale::Power(-1), MassScale::Power(1), MassScale::Power(3)];
/// Scales of masses that an arm with compliances nearly makes up for.
pub(super) const MASS_SCALES: [MassScale; 4] =
    [MassScale::Power(-1), MassScale::Power(1), MassScale::Pounds, MassScale::Newtons];
/// Smallest coordinate of a centre of mass whose sign is doubted \[m\].
const MIN_CENTRE: f64 = 0.02;
/// Number of joints before and after the declared carrier of a target, camera or marker that are
/// tried as its carrier.
pub(super) const MAX_OTHER_CARRIERS: usize = 2;
/// Trial ratios of the measured lengths to those of the arm, in hundredths. A full fit finds values
/// between them.
const TRIAL_SCALES: [i16; 8] = [80, 90, 95, 98, 102, 105, 110, 125];
/// Trial errors of an angle α of the joint table \[°\]. For α = ±90°, an error of 180° is the same
/// as the other sign, which is tried anyway.
const TWISTS: [i16; 3] = [-90, 90, 180];
/// Maximum number of rows by which positions are tried as shifted, in either direction.
const MAX_SHIFT: i8 = 3;
/// Number of rows, evenly spaced, at which a trial shift of positions begins.
const SHIFT_PLACES: usize = 12;

/// Declared length \[m\] above which a number may be in millimetres instead.
pub(super) const MIN_MILLIMETRE_LENGTH: f64 = 1.0;

/// Returns every misreading that the problem and its table allow.
pub(super) fn candidates(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let turns =
        |radians| (0..problem.joints.len()).any(|joint| turns_in(problem, table, joint, radians));
    let lengths = |metres| table.position_unit.is_none_or(|unit| (unit >= 1.0) == metres);
    let long = problem.joints.iter().any(|joint| {
        lengths_of(&mut joint.clone()).iter().any(|length| length.abs() > MIN_MILLIMETRE_LENGTH)
    });
    let mut units = Vec::new();
    units.extend(turns(true).then_some(Misreading::Degrees));
    units.extend(turns(false).then_some(Misreading::Radians));
    if turns(false) {
        units.extend(TURN_UNITS.map(|per_turn| Misreading::TurnUnit { per_turn }));
    }
    units.extend(of_mixed_units(problem, table));
    units.extend(of_slides(problem, table));
    units.extend(lengths(false).then_some(Misreading::Metres));
    units.extend(lengths(true).then_some(Misreading::Millimetres));
    // Where the declared unit is not known, micrometres are millimetres taken for metres.
    let is_other = |unit: &usize| !lengths(true) || POSITION_UNITS[*unit].1 != "micrometres";
    let others = (0..POSITION_UNITS.len()).filter(|_| lengths(false)).filter(is_other);
    units.extend(others.map(|unit| Misreading::PositionUnit { unit }));
    let of_table =
        |unit| [true, false].map(|has_targets| Misreading::TableUnit { unit, has_targets });
    // No sheet states lengths of an arm in micrometres.
    let of_sheet = |unit: &usize| POSITION_UNITS[*unit].1 != "micrometres";
    units.extend((0..POSITION_UNITS.len()).filter(of_sheet).flat_map(of_table));
    let powers = if lengths(false) { [3, 1] } else { [-3, -2] };
    let of_axis = |axis: usize| powers.map(|power| Misreading::AxisUnit { axis, power });
    units.extend((0..3).flat_map(of_axis));
    if lengths(false) {
        units.extend((0..3).map(|axis| Misreading::AxisInches { axis }));
    }
    let scaled = |axis: usize| TRIAL_RATIOS.map(|ratio| (axis, ratio));
    let scaled = (0..3).flat_map(scaled);
    units.extend(scaled.map(|(axis, millionths)| Misreading::AxisScale { axis, millionths }));
    units.push(Misreading::Mirrored { axes: None });
    units.extend(TRIAL_SCALES.map(|percent| Misreading::Scale { percent }));
    units.extend(table.orientations.is_some().then_some(Misreading::InversePose));
    units.extend(is_far(problem).then_some(Misreading::TargetInMillimetres));
    units.extend(long.then_some(Misreading::ArmInMillimetres));
    units.extend(of_commands(problem, table));
    units.extend(of_order(table));
    units.extend(of_text_order(table));
    units.extend(of_joint_table(problem));
    units.extend(of_loads(problem, table));
    units.extend(of_targets(problem));
    units
}

/// Returns the misreadings of the unit of sliding joints.
fn of_slides(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let slides = |joint: usize| {
        problem.joints.get(joint).is_some_and(|joint| joint.command_kind() == JointKind::Prismatic)
    };
    let columns = table.command_columns.iter().filter(|column| slides(column.joint));
    let units: Vec<bool> = columns.map(|column| column.unit >= 1.0).collect();
    let power = |&is_metres: &bool| if is_metres { -3 } else { 3 };
    units.first().map(power).map(|power| Misreading::Slides { power }).into_iter().collect()
}

/// Returns the misreadings of targets: a target on the frame of another joint near the declared
/// one, and two exchanged targets.
fn of_targets(problem: &Problem) -> Vec<Misreading> {
    let carriers: Vec<usize> = if problem.targets.is_empty() {
        vec![problem.tool.joint]
    } else {
        problem.targets.iter().map(|target| target.joint).collect()
    };
    let mut misreadings = Vec::new();
    for (target, &carrier) in carriers.iter().enumerate() {
        let others = carrier.saturating_sub(MAX_OTHER_CARRIERS)..=carrier + MAX_OTHER_CARRIERS;
        let others = others.filter(|&joint| joint != carrier && joint < problem.joints.len());
        misreadings.extend(others.map(|joint| Misreading::Carrier { target, joint: joint + 1 }));
        let later = target + 1..problem.targets.len();
        misreadings.extend(later.map(|with| Misreading::ExchangedTargets { target, with }));
    }
    misreadings
}

/// Returns true if the target of `[tool]` is declared so far from its frame that it may be in
/// millimetres; false for a problem with several targets.
pub(super) fn is_far(problem: &Problem) -> bool {
    problem.targets.is_empty() && problem.tool.target.norm() > MIN_MILLIMETRE_LENGTH
}

/// Returns the misreadings in which positions are shifted by rows against the configurations.
pub(super) fn of_order(table: &Measurements) -> Vec<Misreading> {
    let shifts = (-MAX_SHIFT..=MAX_SHIFT).filter(|&by| by != 0);
    let step = shift_step(table.len());
    let places = (0..table.len()).step_by(step).take(SHIFT_PLACES);
    let of_place = |from: usize| shifts.clone().map(move |by| Misreading::Shifted { by, from });
    places.flat_map(of_place).collect()
}

/// Returns the misreadings of the order of all rows: one of two joined tables is sorted by the text
/// of its row numbers, which differs from the order of the numbers from ten rows on, or it is
/// reversed.
fn of_text_order(table: &Measurements) -> Vec<Misreading> {
    let order = |first| {
        let of = move |is_of_joints| Misreading::TextOrder { first, is_of_joints };
        [false, true].map(of)
    };
    let reversed = [Misreading::ReversedRows];
    if table.len() < 10 {
        Vec::new()
    } else {
        [0, 1].into_iter().flat_map(order).chain(reversed).collect()
    }
}

/// Returns the numbers of `rows` rows, from `first` on, in the order of their texts.
pub(super) fn text_order(rows: usize, first: u8) -> Vec<usize> {
    let first = usize::from(first);
    let mut numbers: Vec<usize> = (first..first + rows).collect();
    numbers.sort_by_key(usize::to_string);
    numbers
}

/// Returns the number of rows between two rows at which a trial shift begins, for a table of `rows`
/// rows.
pub(super) fn shift_step(rows: usize) -> usize {
    (rows / SHIFT_PLACES).max(1)
}

/// Returns the misreadings of the joint table: its convention, units, signs and exchanged entries.
fn of_joint_table(problem: &Problem) -> Vec<Misreading> {
    use JointField::{A, Alpha, Beta, D, Theta};
    let mut forms = vec![Misreading::StandardForm, Misreading::ModifiedForm];
    let rows = problem.standard_rows().map_or(problem.joints.len(), <[Joint]>::len);
    forms.extend((1..rows).map(|row| Misreading::ExchangedRows { row }));
    forms.extend(of_exchanged_lengths(problem));
    let fields = [Alpha, Theta, Beta];
    for field in fields {
        let mut counts = [0; 3];
        for (joint, declared) in (1..).zip(&problem.joints) {
            let mut declared = declared.clone();
            let Some(&mut angle) = number_of(&mut declared, field) else { continue };
            if (MIN_RADIANS..=2.0 * PI).contains(&angle.to_degrees().abs()) {
                forms.push(Misreading::TableRadians { joint, field });
                counts[0] += 1;
            }
            if angle.abs() > 2.0 * PI {
                forms.push(Misreading::TableDegrees { joint, field });
                counts[1] += 1;
            }
            if angle != 0.0 {
                forms.push(Misreading::Sign { joint, field });
                counts[2] += 1;
            }
        }
        forms.extend((counts[2] > 1).then_some(Misreading::Sign { joint: 0, field }));
        forms.extend((counts[0] > 1).then_some(Misreading::TableRadians { joint: 0, field }));
        forms.extend((counts[1] > 1).then_some(Misreading::TableDegrees { joint: 0, field }));
    }
    for (joint, declared) in (2..).zip(problem.joints.iter().skip(1)) {
        let is_right = |&degrees: &i16| {
            let other_sign = degrees == 180 && (declared.alpha.abs() - PI / 2.0).abs() < 1e-9;
            !other_sign && declared.placement.is_none() && declared.kind != JointKind::Fixed
        };
        let twist = |degrees| Misreading::Twist { joint, degrees };
        forms.extend(TWISTS.into_iter().filter(is_right).map(twist));
    }
    let count_long = |joint: &Joint| {
        lengths_of(&mut joint.clone())
            .iter()
            .filter(|length| length.abs() > MIN_MILLIMETRE_LENGTH)
            .count()
    };
    let long: usize = problem.joints.iter().map(count_long).sum();
    for field in [A, D] {
        let is_set = |joint: &&Joint| {
            number_of(&mut (*joint).clone(), field).is_some_and(|length| *length != 0.0)
        };
        let is_of_several = problem.joints.iter().filter(is_set).count() > 1;
        forms.extend(is_of_several.then_some(Misreading::Sign { joint: 0, field }));
    }
    for (joint, declared) in (1..).zip(&problem.joints) {
        for field in [A, D, JointField::X, JointField::Y, JointField::Z] {
            let mut declared = declared.clone();
            let Some(&mut length) = number_of(&mut declared, field) else { continue };
            if length == 0.0 {
                continue;
            }
            forms.push(Misreading::Sign { joint, field });
            let is_plausible = |power: &i8| {
                PLAUSIBLE_LENGTHS.contains(&(length.abs() * 10.0_f64.powi((*power).into())))
            };
            // If only one length is long, [`Misreading::ArmInMillimetres`] covers the case.
            let is_new =
                |power: &i8| *power != -3 || length.abs() <= MIN_MILLIMETRE_LENGTH || long > 1;
            let powers = [-3, 3, -2, 2, -1, 1].into_iter().filter(is_plausible).filter(is_new);
            forms.extend(powers.map(|power| Misreading::Length { joint, field, power }));
        }
    }
    forms
}

/// Returns the misreadings that two different lengths of one joint, or of two neighbouring ones,
/// are exchanged.
fn of_exchanged_lengths(problem: &Problem) -> Vec<Misreading> {
    let entries = |joint: usize| [JointField::A, JointField::D].map(|field| (joint, field));
    let joints = 1..=problem.joints.len();
    let pairs = joints.flat_map(|joint| {
        let near = entries(joint).into_iter().chain(entries(joint + 1));
        let first = entries(joint).into_iter();
        first.flat_map(move |(joint, field)| {
            let later = move |(with, other): &(usize, JointField)| {
                *with > joint || field == JointField::A && *other == JointField::D
            };
            near.clone().filter(later).map(move |(with, other)| Misreading::ExchangedLengths {
                joint,
                field,
                with,
                other,
            })
        })
    });
    // A standard sheet declares neither a of the first joint nor d of the flange after its last row.
    let is_declared = |(joint, field): (usize, JointField)| match problem.standard_rows() {
        None => true,
        Some(rows) => match field {
            JointField::A => joint > 1,
            _ => joint <= rows.len(),
        },
    };
    let are_declared = |pair: &Misreading| match *pair {
        Misreading::ExchangedLengths { joint, field, with, other } => {
            is_declared((joint, field)) && is_declared((with, other))
        }
        _ => true,
    };
    pairs.filter(|pair| are_declared(pair) && pair.rewritten(problem).is_some()).collect()
}

/// Returns misreadings of masses and payloads by each of `scales`.
pub(super) fn of_masses(
    problem: &Problem,
    table: &Measurements,
    scales: &[MassScale],
) -> Vec<Misreading> {
    let masses = masses_of(&mut problem.clone()).len();
    let single = if masses > MAX_MASSES { 0 } else { masses };
    let numbers = 0..=single;
    let has_payload = table.payload.is_some() || problem.tool.payload_mass > 0.0;
    let payloads = scales.iter().map(|&scale| Misreading::Payload { scale });
    numbers
        .flat_map(|mass| scales.iter().map(move |&scale| Misreading::Mass { mass, scale }))
        .chain(payloads.filter(|_| has_payload))
        .collect()
}

/// Returns the misreadings of the places of masses: a payload at the target, and coordinates of
/// centres with the other sign.
pub(super) fn of_places(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let has_payload = table.payload.is_some() || problem.tool.payload_mass > 0.0;
    let is_elsewhere = has_payload && problem.targets.is_empty() && !problem.tool.payload_follows;
    let bodies = problem.joints.iter().flat_map(|joint| &joint.bodies);
    let centres = (1..).zip(bodies).take(MAX_MASSES).flat_map(|(mass, body)| {
        let axes = (0..3).filter(|&axis| body.position[axis].abs() > MIN_CENTRE);
        axes.map(move |axis| Misreading::CentreSign { mass, axis })
    });
    is_elsewhere.then_some(Misreading::PayloadAtTarget).into_iter().chain(centres).collect()
}

/// Returns the misreadings of suspension forces: in kilograms instead of newtons, and in the
/// opposite direction.
pub(super) fn of_hoists(problem: &Problem) -> Vec<Misreading> {
    let has_hoist = problem
        .joints
        .iter()
        .any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()));
    let hoists = [false, true].map(|is_reversed| Misreading::Hoist { is_reversed });
    hoists.into_iter().filter(|_| has_hoist).collect()
}

/// Returns the misreadings of masses, payloads, stiffnesses and gravity; none for a rigid arm.
pub(super) fn of_loads(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    if !problem.is_elastic() {
        return Vec::new();
    }
    let mut misreadings = of_masses(problem, table, &GROSS_MASS_SCALES);
    misreadings.extend(of_hoists(problem));
    let elastic = (1..).zip(&problem.joints).filter(|(_, joint)| joint.stiffness.is_some());
    let elastic: Vec<usize> = elastic.map(|(joint, _)| joint).collect();
    let single = if elastic.len() > 1 { elastic.as_slice() } else { &[] };
    for &joint in [0].iter().chain(single) {
        let of_joint = |power| Misreading::Stiffness { joint, power };
        misreadings.extend([-3, -1, 1, 3, 0].map(of_joint));
    }
    misreadings.extend(of_gravity());
    misreadings
}

/// Returns gravity along each axis of the base, in both directions.
pub(super) fn of_gravity() -> impl Iterator<Item = Misreading> {
    let along = |axis| [false, true].map(|is_negative| Misreading::Gravity { axis, is_negative });
    (0..3).flat_map(along)
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

/// Returns the name of a mass and the number of its joint; `mass` counts the numbers of
/// [`masses_of`] from 1. `None` if there is no such mass, such as for 0.
pub(super) fn name_of_mass(problem: &Problem, mass: usize) -> Option<(&str, usize)> {
    let joints = problem.joints.iter().zip(1..);
    let names = joints.flat_map(|(joint, number)| {
        names_of_masses(joint).into_iter().map(move |name| (name, number))
    });
    names.into_iter().nth(mass.checked_sub(1)?)
}

/// Returns the names of the masses of a joint, in the order of [`masses_of`].
fn names_of_masses(joint: &Joint) -> Vec<&str> {
    let beam = joint.beam.iter().flat_map(|beam| {
        let bodies = beam.masses.iter().map(|body| body.name.as_str());
        std::iter::once(beam.name.as_str()).chain(bodies)
    });
    beam.chain(joint.bodies.iter().map(|body| body.name.as_str())).collect()
}

/// Returns the declared masses along the arm \[kg\], joint by joint: its beam, the load on the
/// beam, and its bodies.
pub(super) fn masses_of(problem: &mut Problem) -> Vec<&mut f64> {
    let mut masses = Vec::new();
    for joint in &mut problem.joints {
        if let Some(beam) = &mut joint.beam {
            masses.push(&mut beam.mass);
            masses.extend(beam.masses.iter_mut().map(|body| &mut body.mass));
        }
        masses.extend(joint.bodies.iter_mut().map(|body| &mut body.mass));
    }
    masses
}
