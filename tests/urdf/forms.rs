//! Forms of joints: xyz and rpy, standard DH, followers, the base by rpy, columns by joint names.

use flexcal::problem::{PoseConditions, Problem};
use flexcal::rig::Rig;
use nalgebra::{DVector, Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

use super::common::arms::parse;
use super::tips;
use crate::common::program::assert_contains;
use crate::common::reading::{assert_says, problem_error, try_table};

fn turn(axis: Vector3<f64>, degrees: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Translation3::identity(),
        UnitQuaternion::from_scaled_axis(axis * degrees.to_radians()),
    )
}

fn shift(x: f64, y: f64, z: f64) -> Isometry3<f64> {
    Isometry3::translation(x, y, z)
}

fn position(problem: &Problem, q: &[f64]) -> Vector3<f64> {
    tips(problem, &[q.to_vec()], &DVector::zeros(0))[0][0]
}

#[test]
fn standard_tables_are_read_in_their_order() {
    let text = "name = 'standard'\ndh = 'standard'\n[[joint]]\nalpha_deg = 90\na_m = 0.1\nd_m = 0.4\ntheta_deg = 10\n[[joint.body]]\n\
                mass_kg = 2\ncom_m = [0.1, 0.2, 0.3]\n[[joint]]\na_m = 0.5\n[[joint]]\nkind = 'prismatic'\nalpha_deg = -30\na_m = 0.2\n";
    let problem = parse(text);
    let q: [f64; 3] = [0.3, -0.8, 0.15];
    let row = |theta: f64, d, a, alpha| {
        turn(Vector3::z(), theta)
            * shift(0.0, 0.0, d)
            * shift(a, 0.0, 0.0)
            * turn(Vector3::x(), alpha)
    };
    let first = row(10.0 + q[0].to_degrees(), 0.4, 0.1, 90.0);
    let expected = first * row(q[1].to_degrees(), 0.0, 0.5, 0.0) * row(0.0, q[2], 0.2, -30.0);
    let [origin, x, z] = tips(&problem, &[[&q[..], &[0.0]].concat()], &DVector::zeros(0))[0];
    assert!((origin - expected.translation.vector).norm() < 1e-12);
    assert!((x - expected * Vector3::x()).norm() + (z - expected * Vector3::z()).norm() < 1e-12);
    // The body moves with the first row; its frame here is the one before a and α.
    let body = &problem.joints[0].bodies[0];
    let before = turn(Vector3::z(), 10.0) * shift(0.0, 0.0, 0.4) * Point3::from(body.position);
    assert!((before - row(10.0, 0.4, 0.1, 90.0) * Point3::new(0.1, 0.2, 0.3)).norm() < 1e-12);
    assert_eq!(
        (problem.joints.len(), problem.joints[3].name.as_str(), problem.joints[3].a),
        (4, "flange", 0.2)
    );
    let placed = parse(
        "name = 's'\ndh = 'standard'\n[[joint]]\na_m = 0.3\nalpha_deg = 40\n[[joint]]\nkind = 'fixed'\nxyz_m = [0.1, 0.2, 0]\nrpy_deg = [5, 0, 9]\n",
    );
    let expected = shift(0.3, 0.0, 0.0) * turn(Vector3::x(), 40.0) * Point3::new(0.1, 0.2, 0.0);
    assert!((position(&placed, &[0.0; 3]) - expected.coords).norm() < 1e-12);
}

#[test]
fn placements_and_followers_are_the_same_in_model_and_rig() {
    let text = "name = 'placed'\n[[joint]]\nd_m = 0.3\n[[joint]]\nkind = 'fixed'\nxyz_m = [0.1, -0.2, 0.3]\nrpy_deg = [10, 20, 30]\n[[joint]]\n\
                a_m = 0.4\ntheta_deg = 5\nmimic = { joint = 1, ratio = -2 }\n[[joint]]\na_m = 0.2\n[tool]\ntarget_m = [0.05, 0.1, 0.2]\n\
                [base]\nxyz_m = [1, 2, 3]\nrpy_deg = [180, 0, 45]\n";
    let problem = parse(text);
    let (q1, q4) = (0.7, -0.4);
    let rpy = |[roll, pitch, yaw]: [f64; 3]| {
        turn(Vector3::z(), yaw) * turn(Vector3::y(), pitch) * turn(Vector3::x(), roll)
    };
    let about = |q: f64| turn(Vector3::z(), q.to_degrees());
    let base = shift(1.0, 2.0, 3.0) * rpy([180.0, 0.0, 45.0]);
    let placed = about(q1) * shift(0.0, 0.0, 0.3) * shift(0.1, -0.2, 0.3) * rpy([10.0, 20.0, 30.0]);
    let expected = base
        * placed
        * shift(0.4, 0.0, 0.0)
        * about(-2.0 * q1)
        * turn(Vector3::z(), 5.0)
        * shift(0.2, 0.0, 0.0)
        * about(q4);
    assert!((position(&problem, &[q1, 0.0, 0.0, q4]) - expected.translation.vector).norm() < 1e-12);
    let at_rest = Rig::new(problem.clone(), Vec::new())
        .position(&PoseConditions {
            configuration: vec![q1, 0.0, 0.0, q4],
            ..PoseConditions::default()
        })
        .unwrap();
    assert!((at_rest - (expected * Point3::new(0.05, 0.1, 0.2)).coords).norm() < 1e-12);

    for (wrong, says) in [
        ("kind = 'fixed'\nxyz_m = [0, 0, 1]\nalpha_deg = 3", "joint 2 is placed by xyz_m"),
        ("xyz_m = [0, 0, 1]", "does not belong here"),
        ("mimic = { joint = 2 }", "joint 2 cannot follow itself"),
        ("mimic = { joint = 7 }", "no joint 7"),
        (
            "mimic = { joint = 1 }\nmin_deg = 3",
            "joint 2 follows another joint, so it has no limits",
        ),
        ("kind = 'fixed'\nmimic = { joint = 1 }", "a fixed joint cannot follow another one"),
    ] {
        let text = format!("name = 'w'\n[[joint]]\nd_m = 1\n[[joint]]\n{wrong}\n");
        assert_says(&problem_error(&text), &[says]);
    }
    let beam = "name = 'w'\ndh = 'standard'\n[[joint]]\na_m = 1\n[joint.beam]\nname = 'A'\n";
    assert_says(&problem_error(beam), &["write the table in the modified form"]);
}

#[test]
fn columns_may_be_called_by_the_names_of_joints() {
    let problem = parse(
        "name = 'named'\n[[joint]]\nname = 'shoulder_pan_joint'\n[[joint]]\nname = 'x'\nkind = 'prismatic'\n[[joint]]\nname = 'b c'\n\
         [[joint]]\nkind = 'fixed'\nname = 'mount'\n[data]\nheld_out = { fraction = 0.5 }\n",
    );
    let read = |header: &str| {
        try_table(&problem, &format!("{header}\n180,2,3,4,5,6\n"))
            .map(|(rows, warnings)| (rows.configurations, warnings.len()))
            .map_err(|error| error.to_string())
    };
    let pi = std::f64::consts::PI;
    // x_mm is the measured position, whatever the names of joints.
    assert_eq!(
        read("shoulder_pan_joint_deg,q2_m,b c_rad,x_mm,y_mm,z_mm"),
        Ok((vec![pi, 2.0, 3.0, 0.0], 0))
    );
    assert_eq!(read("q1_deg,q2_m,q3_rad,x_mm,y_mm,z_mm"), Ok((vec![pi, 2.0, 3.0, 0.0], 0)));
    for (header, says) in [
        (
            "shoulder_pan_joint,q2_m,q3_rad,x_mm,y_mm,z_mm",
            "an angle needs a unit; write shoulder_pan_joint_deg or shoulder_pan_joint_rad",
        ),
        ("shoulder_pan_joint_mm,q2_m,q3_rad,x_mm,y_mm,z_mm", "is not given in mm"),
        (
            "shoulder_pan_joint_deg,q1_rad,q2_m,x_mm,y_mm,z_mm",
            "given already as column shoulder_pan_joint_deg",
        ),
        (
            "shoulder_pan_joint_dg,q2_m,q3_rad,x_mm,y_mm,z_mm",
            "add q1_deg or q1_rad or shoulder_pan_joint_deg or shoulder_pan_joint_rad (is it column shoulder_pan_joint_dg?)",
        ),
    ] {
        assert_contains(&read(header).unwrap_err(), &[says]);
    }
}
