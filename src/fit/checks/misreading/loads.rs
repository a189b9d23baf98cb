//! Misreadings of loads: masses and their places, payloads, suspension forces, stiffnesses, gravity.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::{Misreading, power_of_ten};
use crate::fit::checks::row_kind::AXES;
use crate::measurement::Measurements;
use crate::problem::{Joint, Problem};

/// Maximum number of masses that are tried one by one.
const MAX_MASSES: usize = 12;
/// Weight of a kilogram \[N\].
const STANDARD_GRAVITY: f64 = 9.80665;
/// Mass of a pound \[kg\].
const POUND: f64 = 0.453_592_37;
/// Smallest coordinate of a centre of mass whose sign is doubted \[m\].
const MIN_CENTRE: f64 = 0.02;

/// Unit or decimal point of a number that was declared as a mass in kilograms: the factor by which it
/// must be multiplied, and the words.
pub(super) type MassScale = (f64, &'static str);

pub(super) const TENTH: MassScale =
    (0.1, "to be multiplied by 0.1, or divided by 9.81 if weights in newtons were written");
pub(super) const TENFOLD: MassScale = (10.0, "to be multiplied by 10");
pub(super) const THOUSANDTH: MassScale = (0.001, "to be multiplied by 0.001");
pub(super) const THOUSANDFOLD: MassScale = (1000.0, "to be multiplied by 1000");
pub(super) const POUNDS: MassScale = (POUND, "in pounds, declared as kilograms");
pub(super) const NEWTONS: MassScale =
    (1.0 / STANDARD_GRAVITY, "a weight in newtons, declared as kilograms");

/// Scales of masses that leave an error far beyond the noise.
const GROSS_MASS_SCALES: [MassScale; 4] = [THOUSANDTH, TENTH, TENFOLD, THOUSANDFOLD];

/// Returns misreadings of masses and payloads by each of `scales`.
pub(super) fn of_masses(
    problem: &Problem,
    table: &Measurements,
    scales: &[MassScale],
) -> Vec<Misreading> {
    let masses = masses_of(&mut problem.clone()).len();
    let single = if masses > MAX_MASSES { 0 } else { masses };
    // Masses count from 1 along the arm; 0 stands for all.
    let of_mass = |mass: usize, (factor, scale): MassScale| {
        let words = match mass {
            0 => format!("masses that are {scale}"),
            _ => format!("mass {mass}, counted along the arm, that is {scale}"),
        };
        let located = name_of_mass(problem, mass)
            .map(|(name, joint)| format!("the mass of {name} at joint {joint} that is {scale}"));
        let scaled = Misreading::of_problem(words, move |problem| {
            let masses = (1..).zip(masses_of(problem));
            let chosen = masses.filter(|(number, _)| mass == 0 || *number == mass);
            chosen.for_each(|(_, value)| *value *= factor);
            Some(())
        });
        scaled.in_group(format!("mass {mass}")).located(located)
    };
    let of_payload = |&(factor, scale): &MassScale| {
        let scaled = Misreading::of_rows(format!("payloads that are {scale}"), move |rows| {
            rows.payload.iter_mut().flatten().for_each(|payload| *payload *= factor);
        });
        let scaled = scaled.with_problem(move |problem| {
            problem.tool.payload_mass *= factor;
            Some(())
        });
        scaled.in_group("payload")
    };
    let masses =
        (0..=single).flat_map(|mass| scales.iter().map(move |&scale| of_mass(mass, scale)));
    let payloads = scales.iter().map(of_payload).filter(|_| has_payload(problem, table));
    masses.chain(payloads).collect()
}

/// Returns true if the arm carries a payload.
fn has_payload(problem: &Problem, table: &Measurements) -> bool {
    table.payload.is_some() || problem.tool.payload_mass > 0.0
}

/// Returns the misreadings of the places of masses: a payload at the target, and coordinates of
/// centres with the other sign.
pub(super) fn of_places(problem: &Problem, table: &Measurements) -> Vec<Misreading> {
    let at_target =
        "the payload at the measured target (declare payload_at = \"target\" in [tool])";
    let at_target = Misreading::of_problem(at_target, |problem| {
        problem.tool.payload_follows = true;
        problem.tool.payload_at = problem.tool.target;
        Some(())
    });
    let is_elsewhere =
        has_payload(problem, table) && problem.targets.is_empty() && !problem.tool.payload_follows;
    let mut misreadings: Vec<Misreading> = is_elsewhere.then_some(at_target).into_iter().collect();
    let bodies = problem.joints.iter().flat_map(|joint| &joint.bodies);
    for (mass, body) in bodies.enumerate().take(MAX_MASSES) {
        for axis in (0..3).filter(|&axis| body.position[axis].abs() > MIN_CENTRE) {
            let [centre, sign] =
                [format!("{} of the centre of", AXES[axis]), "has the other sign".to_owned()];
            let words = format!("{centre} mass {}, counted along the arm, that {sign}", mass + 1);
            let other = Misreading::of_problem(words, move |problem| {
                let mut bodies = problem.joints.iter_mut().flat_map(|joint| &mut joint.bodies);
                let coordinate = &mut bodies.nth(mass)?.position[axis];
                *coordinate = -*coordinate;
                Some(())
            });
            let located = format!("{centre} mass of {} that {sign}", body.name);
            misreadings
                .push(other.located(Some(located)).in_group(format!("centre {mass} {axis}")));
        }
    }
    misreadings
}

/// Returns the misreadings of suspension forces: in kilograms instead of newtons, and in the
/// opposite direction.
pub(super) fn of_hoists(problem: &Problem) -> Vec<Misreading> {
    let has_hoist = problem
        .joints
        .iter()
        .any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()));
    let hoists = [
        ("hoist forces that are in kilograms, declared in newtons", STANDARD_GRAVITY),
        ("a hoist that pulls the other way (its direction, or the signs of hoist_N)", -1.0),
    ];
    let of_hoist = |(words, factor)| {
        let scaled = Misreading::of_rows(words, move |rows| {
            rows.hoist.iter_mut().flatten().for_each(|force| *force *= factor);
        });
        scaled.with_problem(move |problem| {
            let beams = problem.joints.iter_mut().filter_map(|joint| joint.beam.as_mut());
            let hoists = beams.filter_map(|beam| beam.hoist.as_mut());
            hoists.for_each(|hoist| hoist.force *= factor);
            Some(())
        })
    };
    hoists.into_iter().filter(|_| has_hoist).map(of_hoist).collect()
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
        let (what, verb) = match joint {
            0 => ("stiffnesses of joints".to_owned(), "are"),
            _ => (format!("the stiffness of joint {joint}"), "is"),
        };
        let powers = [-3, -1, 1, 3].map(|power| {
            let factor = power_of_ten(power);
            (factor, format!("to be multiplied by {factor}"))
        });
        let per_degree = (180.0 / PI, "per degree, declared per radian".to_owned());
        misreadings.extend(powers.into_iter().chain([per_degree]).map(|(factor, how)| {
            Misreading::of_problem(format!("{what} that {verb} {how}"), move |problem| {
                let joints = (1..).zip(&mut problem.joints);
                let chosen = joints.filter(|(number, _)| joint == 0 || *number == joint);
                let stiffnesses = chosen.filter_map(|(_, joint)| joint.stiffness.as_mut());
                stiffnesses.for_each(|stiffness| *stiffness *= factor);
                Some(())
            })
        }));
    }
    misreadings.extend(of_gravity());
    misreadings
}

/// Returns gravity along each axis of the base, in both directions.
pub(super) fn of_gravity() -> impl Iterator<Item = Misreading> {
    let along = |axis: usize| {
        [("+", 1.0), ("−", -1.0)].map(|(sign, factor)| {
            let words = format!("gravity that points along {sign}{} (gravity_m_s2)", AXES[axis]);
            let turned = Misreading::of_problem(words, move |problem| {
                problem.gravity = Vector3::ith(axis, factor * problem.gravity.norm());
                Some(())
            });
            turned.in_group("gravity")
        })
    };
    (0..3).flat_map(along)
}

/// Returns the name of a mass and the number of its joint; `mass` counts the numbers of
/// [`masses_of`] from 1. `None` if there is no such mass, such as for 0.
fn name_of_mass(problem: &Problem, mass: usize) -> Option<(&str, usize)> {
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
fn masses_of(problem: &mut Problem) -> Vec<&mut f64> {
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
