//! Laws whose site is a number of a camera: lenses that drift with temperature or sag.

use std::fmt::Write as _;

use flexcal::fit::{Identification, Options, Placement, identify};
use flexcal::least_squares::check_jacobian;
use flexcal::measurement::Measurements;
use flexcal::model::PoseResiduals;
use flexcal::quantity::Unit;
use flexcal::select::{Status, close};
use nalgebra::DVector;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::cameras::{measured_with, split};
use crate::common::arms::parse;
use crate::common::made::{draw, model_of};
use crate::common::reading::{assert_says, problem_error, read_table};
use crate::shutter::{ARM, rigid};

/// Drift of a focal length of 900 px by 0.02 % per kelvin [px/K].
const DRIFT: f64 = 0.18;

/// Returns the text of the problem with laws of its cameras.
fn with_laws(laws: &[(&str, &str)]) -> String {
    let mut text = ARM.replace("[data]\n", "[data]\nreference_temperature_C = 20\n");
    for (number, (at, terms)) in laws.iter().enumerate() {
        write!(text, "[[effect]]\nlaw = {{ name = \"w{number}\", at = \"{at}\", {terms} }}\n")
            .unwrap();
    }
    text
}

/// Returns rows of images of both cameras without pixels, at temperatures of 10 to 30 °C.
fn table(configurations: usize) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut text =
        "q1_rad,q2_deg,q3_mm,q4_rad,temperature_C,camera,marker,point,u_px,v_px\n".to_owned();
    for _ in 0..configurations {
        let mut cell = |at: f64, range: f64| at + range * random.random_range(-1.0..1.0);
        let cells = [cell(0.0, 0.4), cell(0.0, 20.0), cell(450.0, 300.0), cell(0.0, 1.2)];
        let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:.5}")).collect();
        let temperature = cell(20.0, 10.0);
        for (camera, marker, points) in [("hand", "board", 6), ("wall", "tag", 4)] {
            for point in 0..points {
                let joints = cells.join(",");
                writeln!(text, "{joints},{temperature:.3},{camera},{marker},{point},1,1").unwrap();
            }
        }
    }
    text
}

/// Returns the index of a parameter of a model.
fn place(model: &flexcal::model::Model, name: &str) -> usize {
    model.parameters.iter().position(|parameter| parameter.name == name).unwrap()
}

#[test]
fn a_law_changes_the_number_of_the_camera_in_each_row() {
    let free = "\"camera*.*\" = { free = true }\n[data]\n";
    let plain = parse(&with_laws(&[]).replace("[data]\n", free));
    let laws = [
        ("camera[hand].fx", "terms = [\"T\"], sigma_px = 0.5"),
        ("camera[hand].cy", "terms = [\"sin(q2)\"], sigma_px = 2"),
        ("camera[hand].k1", "terms = [\"T\"]"),
        ("camera[wall].p2", "terms = [\"q4\"]"),
    ];
    let problem = parse(&with_laws(&laws));
    let rows = read_table(&plain, &table(6));
    let [of_plain, of_laws] = [&plain, &problem].map(|problem| model_of(problem, &rows));
    let sizes = [DRIFT, 1.5, 2e-3, 1e-3];
    let mut x = DVector::zeros(of_laws.parameters.len());
    for (number, size) in sizes.iter().enumerate() {
        x[place(&of_laws, &format!("law[w{number}].1"))] = *size;
    }
    let all: Vec<usize> = (0..rows.len()).collect();
    let predicted = of_laws.predict(Placement::of(&rows).poses(&rows, &all, 1.0), &x);
    for row in all {
        let q = &rows.configurations[row * rows.joints..];
        let warming = rows.temperature.as_ref().unwrap()[row] - 20.0;
        let mut x = DVector::zeros(of_plain.parameters.len());
        for ((at, _), by) in laws.iter().zip([
            sizes[0] * warming,
            sizes[1] * q[1].sin(),
            sizes[2] * warming,
            sizes[3] * q[3],
        ]) {
            x[place(&of_plain, at)] = by;
        }
        let expected = of_plain.predict(Placement::of(&rows).poses(&rows, &[row], 1.0), &x)[0];
        assert!((predicted[row] - expected).norm() < 1e-9, "{} {expected}", predicted[row]);
    }
}

#[test]
fn derivatives_of_laws_of_cameras() {
    let laws = [
        ("camera[hand].fx", "terms = [\"T\", \"T*exp(-k*abs(q2))\"], k = { start = 0.5 }"),
        ("camera[hand].fy", "terms = [\"M2\"]"),
        ("camera[hand].cx", "terms = [\"sin(q4)\", \"cos(q4)\"]"),
        ("camera[hand].k1", "terms = [\"T\"]"),
        ("camera[hand].p1", "terms = [\"q2*T\"]"),
        ("camera[hand].k3", "terms = [\"q1\"]"),
        ("camera[hand].rx", "terms = [\"sin(q2)\"]"),
        ("camera[wall].z", "terms = [\"T\"]"),
    ];
    for elastic in [true, false] {
        let text = with_laws(&laws);
        let problem = parse(&if elastic { text } else { rigid(&text) });
        let rows = read_table(&problem, &table(12));
        let model = model_of(&problem, &rows);
        let small = |unit: Unit| match unit.symbol().as_ref() {
            "px/K" | "px/(N·m)" | "px" => 0.1,
            "1" | "1/K" | "1/rad" | "1/(rad·K)" => 1e-3,
            _ => 2e-3,
        };
        let x = draw(&model, small, &mut ChaCha8Rng::seed_from_u64(5));
        let all: Vec<usize> = (0..rows.len()).step_by(5).collect();
        let poses = Placement::of(&rows).poses(&rows, &all, 1.0);
        let residuals =
            PoseResiduals::new(&model, poses, (0..model.parameters.len()).collect(), x.clone());
        let step = |name: &str| if name.ends_with("].k") { 0.3 } else { 0.02 };
        let steps = model.parameters.iter().map(|parameter| step(&parameter.name));
        let steps = DVector::from_iterator(x.len(), steps);
        let check = check_jacobian(&residuals, &x, &steps);
        let (worst, column) = check.worst().unwrap();
        println!("{}: {:.1e}", model.parameters[worst].name, column.relative_error);
        assert!(column.relative_error < 1e-9, "{} {column:?}", model.parameters[worst].name);
    }
}

/// Returns rows of images of the camera on the hand with noise, whose focal length drifts.
fn images(drift: f64) -> Measurements {
    let problem = parse(&rigid(&with_laws(&[("camera[hand].f", "terms = [\"T\"]")])));
    let rows = read_table(&problem, &table(40));
    let of_hand = |row: &usize| rows.observation(*row).fixtures()[0] == Some(0);
    let rows = rows.select(&(0..rows.len()).filter(of_hand).collect::<Vec<_>>());
    let model = model_of(&problem, &rows);
    let mut x = DVector::zeros(model.parameters.len());
    x[place(&model, "law[w0].1")] = drift;
    for (name, size) in [("joint2.alpha", 2e-3), ("joint2.theta", -3e-3), ("joint3.alpha", 1e-3)] {
        x[place(&model, name)] = size;
    }
    measured_with(&model, &rows, &x, (1.0, 8))
}

/// Asserts that a fit meets the arm of [`images`].
fn assert_arm(found: &Identification) {
    for (name, truth) in [("joint2.alpha", 2e-3), ("joint2.theta", -3e-3), ("joint3.alpha", 1e-3)] {
        let of = found.estimate(name).unwrap();
        let z = (of.estimate - of.nominal - truth) / of.std_error.unwrap();
        println!("{name}: z = {z:.2}");
        assert!(z.abs() < 4.0, "{name}: {z}");
    }
}

#[test]
fn a_drift_of_the_focal_length_is_fitted_beside_the_arm() {
    let laws = [
        ("camera[hand].fx", "terms = [\"T\"], sigma_px = 1"),
        ("camera[hand].fy", "terms = [\"T\"], sigma_px = 1"),
    ];
    let declared = parse(&rigid(&with_laws(&laws)));
    let rows = images(DRIFT);
    let found = identify(&declared, &split(&declared, rows), &Options::default()).unwrap();
    for name in ["law[w0].1", "law[w1].1"] {
        let of = found.estimate(name).unwrap();
        let z = (of.estimate - DRIFT) / of.std_error.unwrap();
        println!("{name} = {} ± {:?}, z = {z:.2}", of.estimate, of.std_error);
        assert!(z.abs() < 4.0 && of.std_error.unwrap() < 0.02);
        assert_eq!(of.unit.symbol(), "px/K");
    }
    assert_arm(&found);
    assert!(found.is_trusted(), "{:?}", found.findings);
}

#[test]
fn a_drift_of_the_focal_length_is_named_and_no_cause_of_the_arm() {
    let plain = parse(&rigid(&with_laws(&[])));
    let named = |drift: f64| -> Vec<(String, Status)> {
        let closed = close(&plain, &split(&plain, images(drift)), &Options::default()).unwrap();
        let named = closed.effects.iter().map(|of| (of.effect.declaration(), of.status)).collect();
        println!("{named:?}");
        if drift != 0.0 {
            assert_arm(&closed.after);
        }
        named
    };
    let lens = "lens-thermal-drift = { camera = \"hand\" }".to_owned();
    assert_eq!(named(DRIFT), [(lens, Status::Found)]);
    assert_eq!(named(0.0), []);
}

#[test]
fn sites_of_cameras_are_checked() {
    let problem = |at: &str| problem_error(&with_laws(&[(at, "terms = [\"T\"]")]));
    assert_says(&problem("camera[hnad].fx"), &["no camera is called \"hnad\"", "hand, wall"]);
    assert_says(&problem("camera[hand].k4"), &["is no site", "fx, fy, cx, cy, k1, k2, p1, p2, k3"]);
    let wrong = with_laws(&[("camera[hand].fx", "terms = [\"T\"], sigma_mm = 1")]);
    assert_says(&problem_error(&wrong), &["sigma_px"]);
}
