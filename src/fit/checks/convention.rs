//! Search for the convention of orientations with which the measured orientations would fit.

use std::f64::consts::PI;

use nalgebra::{DVector, Matrix4, Quaternion, UnitQuaternion, Vector3};

use super::checked_fit::CheckedFit;
use super::row_kind::AXES;
use crate::fit::stages::fitting::Fitting;
use crate::problem::RotationKind;

/// Largest ratio of the rms orientation error with another convention to that with the declared
/// one, at which the other convention explains the error.
pub(super) const MAX_EXPLAINED_RATIO: f64 = 0.2;
/// Largest ratio of the error with a convention to that with the best one, at which the convention
/// is also named.
const MAX_RATIO_TO_BEST: f64 = 1.5;
/// Inverse of the relative difference of two errors that counts as rounding.
const EQUAL_ERRORS: f64 = 1e4;
/// Minimum number of measured orientations from which a convention is found.
const MIN_PAIRS: usize = 3;
/// Number of times that the meaning of each row is chosen again.
const MAX_CHOICES: usize = 5;
/// Axes (0 to 2 for x, y, z) of the twelve Euler conventions, R = R₁(r₁) R₂(r₂) R₃(r₃). If all
/// three axes differ, each angle is in the column of its axis, else the angles are in the order of
/// the rotations.
const ROTATION_AXES: [[usize; 3]; 12] = [
    [0, 1, 2],
    [0, 2, 1],
    [1, 0, 2],
    [1, 2, 0],
    [2, 0, 1],
    [2, 1, 0],
    [0, 1, 0],
    [0, 2, 0],
    [1, 0, 1],
    [1, 2, 1],
    [2, 0, 2],
    [2, 1, 2],
];

/// Name of the convention in which the angles of the table are in another unit.
pub(super) const IN_RADIANS: &str = "angles in radians, declared in degrees";

/// Function from a rotation as it was read to the rotations that the table means in another
/// convention. It returns several if the read rotation may come from different numbers.
type Reading = Box<dyn Fn(&UnitQuaternion<f64>) -> Vec<UnitQuaternion<f64>>>;

/// Returns the names of the conventions with which the measured orientations agree with the
/// predicted ones, best first. `rms` is the error with the declared convention \[rad\]. A constant
/// rotation of the tool is fitted for each convention.
pub(super) fn fitting_conventions(fit: &CheckedFit, rms: f64) -> Vec<String> {
    let fitting = fit.fitting;
    let rows: Vec<usize> = fitting
        .split
        .identification
        .iter()
        .copied()
        .filter(|&row| fitting.measurements.orientation(row).is_some())
        .collect();
    let pairs = |x: &DVector<f64>| -> Vec<(UnitQuaternion<f64>, UnitQuaternion<f64>)> {
        let predicted = fitting.model.orientations(&fitting.poses(&rows), x.as_slice());
        let pair = |(&row, turn): (&usize, Vector3<f64>)| {
            let is_known = turn.iter().all(|component| component.is_finite());
            let measured = *fitting.measurements.orientation(row)?;
            is_known.then(|| (UnitQuaternion::from_scaled_axis(turn), measured))
        };
        rows.iter().zip(predicted).filter_map(pair).collect()
    };
    // Orientations of a wrong convention bend the fit, so the nominal arm is tried too, with its
    // base and target fitted to the positions alone.
    let by_positions = Fitting { turn_sigma: None, ..fitting.with_declared_noise() };
    let arms: Vec<_> = std::iter::once(pairs(&fit.end.x))
        .chain(by_positions.registered().ok().map(|x| pairs(&x)))
        .collect();
    let readings = readings(fit.problem.data.dialect.rotation);
    let mut errors: Vec<(String, f64)> = readings
        .into_iter()
        .map(|(name, reading)| {
            let errors = arms.iter().map(|pairs| misfit(pairs, &reading));
            (name, errors.fold(f64::INFINITY, f64::min))
        })
        .filter(|(_, error)| *error < MAX_EXPLAINED_RATIO * rms)
        .collect();
    // Of readings with the same error, the simpler one, which is listed first, comes first.
    errors.sort_by(|a, b| {
        let [one, other] = [a.1, b.1].map(|error| (error.ln() * EQUAL_ERRORS).round());
        one.total_cmp(&other)
    });
    let best = errors.first().map_or(0.0, |(_, error)| *error);
    errors
        .into_iter()
        .filter(|(_, error)| *error <= MAX_RATIO_TO_BEST * best)
        .map(|(name, _)| name)
        .collect()
}

/// Returns the name and the [`Reading`] of every alternative convention, for orientations that were
/// read with the convention `kind`.
fn readings(kind: RotationKind) -> Vec<(String, Reading)> {
    let inverse: Reading = Box::new(|q| vec![q.inverse()]);
    let mut readings = vec![("the inverse rotation".to_owned(), inverse)];
    for axes in 1..7_usize {
        let is_turned = |axis: &usize| axes >> axis & 1 == 1;
        let turned: Vec<usize> = (0..3).filter(is_turned).collect();
        let names: Vec<String> =
            turned.iter().map(|&axis| format!("{0} (r{0} or q{0})", AXES[axis])).collect();
        let of_signs: Reading = Box::new(move |q| {
            let numbers = table_numbers(kind, q).map(|mut angles| {
                for &axis in &turned {
                    angles[axis] = -angles[axis];
                }
                angles
            });
            numbers.map(|angles| rotation_of(kind, &angles)).to_vec()
        });
        let verb = if names.len() == 1 { "has" } else { "have" };
        let name = format!("rotations whose {} {verb} the other sign", names.join(" and "));
        readings.push((name, of_signs));
    }
    for order in quaternion_orders() {
        let reordered = move |q: &UnitQuaternion<f64>| {
            let columns = [q.i, q.j, q.k, q.w];
            let mut component = [0.0; 4];
            order.iter().zip(columns).for_each(|(&place, value)| component[place] = value);
            let [x, y, z, w] = component;
            UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
        };
        let letters: Vec<&str> = order.iter().map(|&place| ["x", "y", "z", "w"][place]).collect();
        let name = match (kind, order) {
            (RotationKind::Vector, [_, _, _, 3]) => {
                format!("rotation vectors or quaternions in the order {}", letters[..3].join(", "))
            }
            _ => format!("quaternions in the order {}", letters.join(", ")),
        };
        readings.push((
            format!("the inverse of {name}"),
            Box::new(move |q| vec![reordered(q).inverse()]),
        ));
        readings.push((name, Box::new(move |q| vec![reordered(q)])));
    }
    if kind != RotationKind::Vector {
        let of_vector: Reading = Box::new(move |q| {
            table_numbers(kind, q).map(UnitQuaternion::from_scaled_axis).to_vec()
        });
        readings.push(("rotation vectors".to_owned(), of_vector));
    }
    let in_radians: Reading = Box::new(move |q| {
        let scaled = table_numbers(kind, q).map(|angles| angles * (180.0 / PI));
        scaled.map(|angles| rotation_of(kind, &angles)).to_vec()
    });
    readings.push((IN_RADIANS.to_owned(), in_radians));
    for order in ROTATION_AXES {
        let letters: Vec<&str> = order.iter().map(|&axis| AXES[axis]).collect();
        let [a, b, c] = [letters[0], letters[1], letters[2]];
        let of_order: Reading =
            Box::new(move |q| table_numbers(kind, q).map(|angles| euler(order, &angles)).to_vec());
        readings.push((format!("Euler angles with R = R{a} R{b} R{c}"), of_order));
    }
    // The columns may hold the angles in another order than x, y, z.
    let three_axes = || ROTATION_AXES.into_iter().filter(|order| order[0] != order[2]);
    for (order, columns) in three_axes().flat_map(|order| three_axes().map(move |of| (order, of))) {
        let moved = move |angles: &Vector3<f64>| {
            let mut of_axes = Vector3::zeros();
            (0..3).for_each(|column| of_axes[columns[column]] = angles[column]);
            euler(order, &of_axes)
        };
        let of_order: Reading =
            Box::new(move |q| table_numbers(kind, q).map(|of| moved(&of)).to_vec());
        let letters = |axes: [usize; 3]| axes.map(|axis| AXES[axis]);
        let ([a, b, c], [x, y, z]) = (letters(order), letters(columns));
        let name = format!("Euler angles with R = R{a} R{b} R{c} whose columns hold {x}, {y}, {z}");
        if columns != [0, 1, 2] {
            readings.push((name, of_order));
        }
    }
    readings
}

/// Returns every order of four quaternion columns except x, y, z, w. Entry k is the component
/// (0 to 3 for x, y, z, w) in column k.
fn quaternion_orders() -> impl Iterator<Item = [usize; 4]> {
    let places = (0..256_usize).map(|k| [k % 4, k / 4 % 4, k / 16 % 4, k / 64]);
    let is_order = |order: &[usize; 4]| (0..4).all(|place| order.contains(&place));
    places.filter(move |order| is_order(order) && *order != [0, 1, 2, 3])
}

/// Returns the three numbers of the table \[rad\] from which the orientation `q` may have been read
/// with the convention `kind`: a rotation vector that is shorter or longer than half a turn, or the
/// two triples of angles up to half a turn.
fn table_numbers(kind: RotationKind, q: &UnitQuaternion<f64>) -> [Vector3<f64>; 2] {
    let both = |x: f64, y: f64, z: f64| {
        let behind = |angle: f64| if angle > 0.0 { angle - PI } else { angle + PI };
        [Vector3::new(x, y, z), Vector3::new(behind(x), PI.copysign(y) - y, behind(z))]
    };
    match kind {
        RotationKind::Vector => {
            let vector = q.scaled_axis();
            let length = vector.norm();
            let longer = if length > 0.0 { vector * (1.0 - 2.0 * PI / length) } else { vector };
            [vector, longer]
        }
        RotationKind::EulerXyz => {
            // R = Rx Ry Rz is the inverse of Rz(−z) Ry(−y) Rx(−x).
            let (x, y, z) = q.inverse().euler_angles();
            both(-x, -y, -z)
        }
        RotationKind::RollPitchYaw => {
            let (x, y, z) = q.euler_angles();
            both(x, y, z)
        }
    }
}

/// Returns the rotation that three numbers \[rad\] mean in the convention `kind`.
fn rotation_of(kind: RotationKind, angles: &Vector3<f64>) -> UnitQuaternion<f64> {
    match kind {
        RotationKind::Vector => UnitQuaternion::from_scaled_axis(*angles),
        RotationKind::EulerXyz => euler([0, 1, 2], angles),
        RotationKind::RollPitchYaw => {
            UnitQuaternion::from_euler_angles(angles.x, angles.y, angles.z)
        }
    }
}

/// Returns the rotation R₁(r₁) R₂(r₂) R₃(r₃) about the axes `order` of an Euler convention, with
/// the numbers `angles` of a row \[rad\].
fn euler(order: [usize; 3], angles: &Vector3<f64>) -> UnitQuaternion<f64> {
    let has_three_axes = order[0] != order[2];
    let turn = |place: usize| {
        let angle = angles[if has_three_axes { order[place] } else { place }];
        UnitQuaternion::from_scaled_axis(Vector3::ith(order[place], angle))
    };
    turn(0) * turn(1) * turn(2)
}

/// Returns the root mean squared angle \[rad\] between predicted and measured orientations if the
/// numbers of the table follow another convention.
///
/// `pairs` holds the predicted orientation of each row, and the measured one as it was read.
/// `reading` returns the orientations that the numbers may mean in the other convention. A constant
/// rotation of the tool is fitted: the eigenvector of Σ q qᵀ for the largest eigenvalue, with the
/// rotations q from the prediction to a meaning [Markley et al. 2007]. If rows have several
/// meanings, the nearest one of each row and the rotation are found in turn, from the first and from
/// the last meaning of all rows.
fn misfit(pairs: &[(UnitQuaternion<f64>, UnitQuaternion<f64>)], reading: &Reading) -> f64 {
    // Fewer orientations fit nearly every convention.
    if pairs.len() < MIN_PAIRS {
        return f64::INFINITY;
    }
    let differences: Vec<Vec<UnitQuaternion<f64>>> = pairs
        .iter()
        .map(|(predicted, measured)| {
            reading(measured).into_iter().map(|meant| predicted.inverse() * meant).collect()
        })
        .collect();
    let from = |start: fn(&[UnitQuaternion<f64>]) -> Option<&UnitQuaternion<f64>>| {
        let mut chosen: Vec<UnitQuaternion<f64>> =
            differences.iter().filter_map(|meanings| start(meanings)).copied().collect();
        for _ in 0..MAX_CHOICES {
            let mean = mean_rotation(&chosen);
            let nearest = |meanings: &Vec<UnitQuaternion<f64>>| {
                let angle = |meaning: &UnitQuaternion<f64>| meaning.angle_to(&mean);
                meanings.iter().copied().min_by(|a, b| angle(a).total_cmp(&angle(b)))
            };
            chosen = differences.iter().filter_map(nearest).collect();
        }
        let mean = mean_rotation(&chosen);
        chosen.iter().map(|meaning| meaning.angle_to(&mean).powi(2)).sum::<f64>()
    };
    let squares = from(<[_]>::first).min(from(<[_]>::last));
    (squares / pairs.len().max(1) as f64).sqrt()
}

/// Returns the mean of some rotations, whose squared chords to them are smallest.
pub(super) fn mean_rotation(rotations: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    let mut sum = Matrix4::zeros();
    for rotation in rotations {
        sum += rotation.coords * rotation.coords.transpose();
    }
    let eigen = sum.symmetric_eigen();
    let mean = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    UnitQuaternion::from_quaternion(Quaternion::from(mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{normal, stream};

    #[test]
    fn the_convention_of_euler_angles_is_found_among_all() {
        let mut random = stream(4, 0);
        let tool = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -1.0, 0.4));
        for meant in ROTATION_AXES {
            let pairs: Vec<_> = (0..40)
                .map(|_| {
                    let mut angle = || 0.6 * normal(&mut random);
                    let angles = Vector3::new(angle(), angle(), angle());
                    let read = UnitQuaternion::from_scaled_axis(angles);
                    (euler(meant, &angles) * tool.inverse(), read)
                })
                .collect();
            for (name, reading) in readings(RotationKind::Vector) {
                let error = misfit(&pairs, &reading);
                let letters = meant.map(|axis| AXES[axis]);
                let is_meant = name
                    == format!(
                        "Euler angles with R = R{} R{} R{}",
                        letters[0], letters[1], letters[2]
                    );
                assert_eq!(error < 1e-6, is_meant, "{name} {meant:?} {error}");
            }
        }
    }

    #[test]
    fn conventions_are_found_where_the_tool_points_down() {
        // Angles beyond a quarter turn have two triples, rotation vectors near half a turn two lengths.
        let mut random = stream(5, 0);
        let tool = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, -0.2, 0.4));
        let mut numbers = || {
            let mut small = || 0.3 * normal(&mut random);
            Vector3::new(small(), std::f64::consts::PI - small().abs(), small())
        };
        let rows: Vec<Vector3<f64>> = (0..40).map(|_| numbers()).collect();
        let found = |meant: RotationKind, read: RotationKind, name: &str| {
            let pairs: Vec<_> = rows
                .iter()
                .map(|angles| {
                    (rotation_of(meant, angles) * tool.inverse(), rotation_of(read, angles))
                })
                .collect();
            let mut readings = readings(read).into_iter();
            let (_, reading) = readings.find(|(found, _)| found == name).unwrap();
            misfit(&pairs, &reading)
        };
        let (vector, rpy) = (RotationKind::Vector, RotationKind::RollPitchYaw);
        let misfits = [
            found(vector, rpy, "rotation vectors"),
            found(RotationKind::EulerXyz, vector, "Euler angles with R = Rx Ry Rz"),
            found(rpy, vector, "Euler angles with R = Rz Ry Rx"),
        ];
        assert!(misfits.iter().all(|misfit| *misfit < 1e-6), "{misfits:?}");
    }
}
