//! Where a base or a target is that the problem holds elsewhere, and how its declaration may have been
//! meant.

use std::f64::consts::PI;

use nalgebra::{DVector, Vector3};

use super::{Kind, Misreading};
use crate::fit::checks::contradicted_entry::mistaken_target;
use crate::model::Model;
use crate::problem::{BasePose, Problem};
use crate::spatial::{Frame, rotation_between};

/// Largest angle between the fitted base and another reading of its declaration: 3° \[rad\].
const MAX_ANGLE: f64 = 3.0 * PI / 180.0;
/// Largest distance between them, as a fraction of the distance of the fitted base from the origin,
/// and in addition \[m\].
const MAX_DISTANCE: (f64, f64) = (0.05, 0.02);

impl Misreading {
    /// Returns words that state where the fit with the parameters `x` found the base or the target
    /// that the problem holds elsewhere, and with which reading the declaration would agree. Empty
    /// for other misreadings.
    pub(super) fn found_place(&self, problem: &Problem, model: &Model, x: &DVector<f64>) -> String {
        match self.kind {
            Kind::HeldBase => {
                let bases = model.base_frames(x.as_slice());
                let [found] = bases.as_slice() else { return String::new() };
                base_in_words(&problem.base, found)
            }
            Kind::HeldTarget => {
                let targets = model.target_positions(x.as_slice());
                let [found] = targets.as_slice() else { return String::new() };
                let mistake = mistaken_target(problem.tool.target, *found);
                let mistake = mistake.map_or_else(String::new, |said| format!("; {said}"));
                format!(", at target_m = [{}]{mistake}", numbers(found, 1.0))
            }
            _ => String::new(),
        }
    }
}

/// States the pose of a base that was declared elsewhere.
fn base_in_words(declared: &BasePose, found: &Frame<f64>) -> String {
    let BasePose { translation, rotation } = *declared;
    let vector = |rotation: Vector3<f64>| Frame::from_rotation_vector(translation, &rotation);
    let angles = |rpy: Vector3<f64>| Frame::from_xyz_rpy(&translation, &rpy);
    let readings = [
        (vector(rotation).inverse(), "that of the measuring frame in the base is declared"),
        (vector(rotation * (180.0 / PI)), "rotation_deg is in radians"),
        (angles(rotation), "rotation_deg holds roll, pitch and yaw, not a rotation vector"),
        (
            angles(Vector3::new(rotation.z, rotation.y, rotation.x)),
            "rotation_deg holds yaw, pitch and roll, not a rotation vector",
        ),
        (
            Frame::from_rotation_vector(translation * 1e-3, &rotation),
            "translation_m is in millimetres",
        ),
    ];
    let is_near = |frame: &Frame<f64>| {
        let limit = MAX_DISTANCE.0 * found.origin.norm() + MAX_DISTANCE.1;
        (frame.origin - found.origin).norm() < limit
            && rotation_between(&frame.axes, &found.axes).norm() < MAX_ANGLE
    };
    let meant = readings.iter().find(|(frame, _)| is_near(frame) && !is_near(&vector(rotation)));
    let meant = meant.map_or_else(String::new, |(_, why)| format!(", as if {why}"));
    let turn = rotation_between(&Frame::identity().axes, &found.axes);
    format!(
        "; it stands at translation_m = [{}], rotation_deg = [{}]{meant}",
        numbers(&found.origin, 1.0),
        numbers(&turn, 180.0 / PI)
    )
}

fn numbers(values: &Vector3<f64>, factor: f64) -> String {
    let rounded = |value: &f64| ((value * factor * 1e4).round() / 1e4 + 0.0).to_string();
    values.iter().map(rounded).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_base_is_stated_with_the_reading_of_its_declaration() {
        let declared = BasePose {
            translation: Vector3::new(1.2, -0.4, 0.3),
            rotation: Vector3::new(0.3, -0.2, 1.1),
        };
        let pose = Frame::from_rotation_vector(declared.translation, &declared.rotation);
        let said = base_in_words(&declared, &pose.inverse());
        assert!(
            said.ends_with("as if that of the measuring frame in the base is declared"),
            "{said}"
        );
        let meant = declared.rotation * (PI / 180.0);
        let in_radians = BasePose { rotation: meant, ..declared };
        let said = base_in_words(&in_radians, &pose);
        assert!(said.ends_with("as if rotation_deg is in radians"), "{said}");
        let read = Frame::from_xyz_rpy(&declared.translation, &Vector3::new(1.1, -0.2, 0.3));
        let said = base_in_words(&declared, &read);
        assert!(said.contains("yaw, pitch and roll"), "{said}");
        let other = Frame::from_rotation_vector(Vector3::zeros(), &Vector3::new(0.0, 1.0, 0.0));
        let said = base_in_words(&declared, &other);
        assert_eq!(
            said,
            "; it stands at translation_m = [0, 0, 0], rotation_deg = [0, 57.2958, 0]"
        );
    }
}
