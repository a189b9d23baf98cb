//! Images that are exposed while the arm moves: delays and rolling shutters of cameras.

use std::fmt::Write as _;

use flexcal::fit::{FindingCode, Options, Placement, identify};
use flexcal::least_squares::check_jacobian;
use flexcal::measurement::Measurements;
use flexcal::model::PoseResiduals;
use flexcal::problem::Problem;
use flexcal::quantity::Unit;
use flexcal::select::{Status, close};
use nalgebra::DVector;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::cameras::{measured_with, split};
use crate::common::arms::parse;
use crate::common::made::{draw, model_of};
use crate::common::program::assert_contains;
use crate::common::reading::{
    assert_says, problem_error, read_table, table_error, try_table, words,
};

/// Arm of four joints, one of which slides, with a camera on its hand that sees a board in the
/// world, and a second camera in the world.
pub const ARM: &str = r#"
name = "shutter"
joint = [
    { d_m = 0.4 },
    { alpha_deg = -90, stiffness_N_m_per_rad = 4e4, body = [{ mass_kg = 6, com_m = [0.1, 0, 0.1] }] },
    { kind = "prismatic", alpha_deg = 90 },
    { d_m = 0.1, alpha_deg = 15 },
]
[[camera]]
name = "hand"
on = "joint4"
at_m = [0.02, 0, 0.05]
rotation_deg = [0, 0, 20]
focal_px = [900, 900]
centre_px = [640, 480]
pixel_sigma = 0.2
[[camera]]
name = "wall"
on = "world"
at_m = [0.05, 0.02, 1.9]
rotation_deg = [180, 0, 0]
focal_px = [900, 900]
centre_px = [640, 480]
pixel_sigma = 0.2
[[marker]]
name = "board"
at_m = [0.02, -0.05, 1.6]
rotation_deg = [180, 0, 0]
points_mm = [[0, 0, 0], [80, 0, 0], [0, 80, 0], [80, 80, 0], [-60, 40, 0], [30, 120, 0]]
[[marker]]
name = "tag"
on = "joint4"
at_m = [0.1, 0.05, 0.05]
rotation_deg = [0, 0, 20]
points_mm = [[0, 0, 0], [80, 0, 0], [0, 80, 0], [80, 80, 0]]
[parameters]
"joint*.alpha" = { sigma_deg = 0.2 }
"joint*.theta" = { sigma_deg = 0.2 }
"joint*.a" = { sigma_mm = 1 }
"joint*.d" = { sigma_mm = 1 }
"joint*.stiffness" = { sigma_relative = 0.3 }
"joint1.*" = { fixed = true }
"joint4.theta" = { fixed = true }
"joint4.d" = { fixed = true }
"camera[hand].x" = { free = true }
"camera[hand].y" = { free = true }
"camera[hand].z" = { free = true }
"camera[hand].r*" = { free = true }
"marker[board].*" = { free = true }
[data]
held_out = { fraction = 0.2, seed = 1 }
"#;

const SHUTTER: &str = "[[effect]]\nrolling-shutter = { camera = \"hand\" }\n";
/// Time from the reading of the joints to the exposure of the first row, and from row to row \[s\].
const DELAY: f64 = 4e-3;
const ROW_TIME: f64 = 2e-5;

/// Returns the text of a problem without its elasticity.
pub fn rigid(text: &str) -> String {
    text.replace("stiffness_N_m_per_rad = 4e4, ", "")
        .replace("\"joint*.stiffness\" = { sigma_relative = 0.3 }\n", "")
}

/// Returns rows of `configurations` images of each camera, without pixels, of an arm that moves.
fn table(configurations: usize) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut text =
        "q1_rad,q2_deg,q3_mm,q4_rad,qd1_rad_per_s,qd2_deg_per_s,qd3_mm_per_s,qd4_rad_per_s,\
                    camera,marker,point,u_px,v_px\n"
            .to_owned();
    for _ in 0..configurations {
        let mut cell = |at: f64, range: f64| at + range * random.random_range(-1.0..1.0);
        let q = [cell(0.0, 0.4), cell(0.0, 14.0), cell(400.0, 80.0), cell(0.0, 1.2)];
        let speeds = [cell(0.0, 0.4), cell(0.0, 20.0), cell(0.0, 150.0), cell(0.0, 0.8)];
        let joints: Vec<String> =
            q.iter().chain(&speeds).map(|cell| format!("{cell:.5}")).collect();
        for (camera, marker, points) in [("hand", "board", 6), ("wall", "tag", 4)] {
            for point in 0..points {
                writeln!(text, "{},{camera},{marker},{point},1,1", joints.join(",")).unwrap();
            }
        }
    }
    text
}

/// Returns the rows of `table` as the arm of `problem` shows them without an effect, with noise of
/// `noise` σ. Those of the camera on the hand show the arm at q + q̇ (delay + v row), by iteration over
/// the row v of the image.
fn seen(problem: &Problem, [delay, row_time]: [f64; 2], noise: f64) -> Measurements {
    let rows = read_table(problem, &table(40));
    let model = model_of(problem, &rows);
    let x = DVector::zeros(model.parameters.len());
    let all: Vec<usize> = (0..rows.len()).collect();
    let velocities = rows.velocities.clone().unwrap();
    let mut moved = rows.clone();
    let mut predicted = Vec::new();
    for _ in 0..12 {
        predicted = model.predict(Placement::of(&moved).poses(&moved, &all, 1.0), &x);
        for (row, pixel) in predicted.iter().enumerate() {
            let is_of_hand = rows.observation(row).fixtures()[0] == Some(0);
            let time = if is_of_hand { delay + row_time * pixel.y } else { 0.0 };
            let of_row = (0..rows.joints).map(|joint| row * rows.joints + joint);
            for (joint, velocity) in of_row.map(|place| (place, velocities[place])) {
                moved.configurations[joint] = rows.configurations[joint] + time * velocity;
            }
        }
    }
    let in_view = |row: &usize| predicted[*row].iter().all(|pixel| (0.0..1280.0).contains(pixel));
    let kept: Vec<usize> = all.into_iter().filter(in_view).collect();
    assert!(kept.len() > 280, "{} rows in view", kept.len());
    let of_moved = measured_with(&model, &moved.select(&kept), &x, (noise, 8));
    Measurements { positions: of_moved.positions, ..rows.select(&kept) }
}

#[test]
fn pixels_show_the_arm_where_it_is_when_their_row_is_exposed() {
    let plain = parse(ARM);
    let problem = parse(&format!("{ARM}{SHUTTER}"));
    let rows = seen(&plain, [DELAY, ROW_TIME], 0.0);
    let model = model_of(&problem, &rows);
    let all: Vec<usize> = (0..rows.len()).collect();
    let place =
        |name: &str| model.parameters.iter().position(|parameter| parameter.name == name).unwrap();
    let mut x = DVector::zeros(model.parameters.len());
    x[place("rolling-shutter[hand].delay")] = DELAY;
    x[place("rolling-shutter[hand].row")] = ROW_TIME;
    let predicted = model.predict(Placement::of(&rows).poses(&rows, &all, 1.0), &x);
    let off = predicted.iter().zip(&rows.positions).map(|(a, b)| (a - b).norm());
    let off = off.fold(0.0, f64::max);
    println!("largest difference {off:.1e} px");
    assert!(off < 1e-8, "{off:e}");
}

#[test]
fn derivatives_of_times_of_exposure() {
    for elastic in [true, false] {
        let text = format!("{ARM}{SHUTTER}");
        let text = if elastic { text } else { rigid(&text) };
        let problem = parse(&text);
        let rows = seen(&parse(ARM), [DELAY, ROW_TIME], 0.0);
        let model = model_of(&problem, &rows);
        let small = |unit| match unit {
            Unit::Length => 3e-3,
            Unit::Time => 1e-3,
            _ => 5e-3,
        };
        let x = draw(&model, small, &mut ChaCha8Rng::seed_from_u64(5));
        let all: Vec<usize> = (0..rows.len()).step_by(7).collect();
        let poses = Placement::of(&rows).poses(&rows, &all, 1.0);
        let residuals =
            PoseResiduals::new(&model, poses, (0..model.parameters.len()).collect(), x.clone());
        let steps = model.parameters.iter().map(|parameter| match parameter.name.as_str() {
            "rolling-shutter[hand].row" => 1e-5,
            _ => 0.02,
        });
        let check = check_jacobian(&residuals, &x, &DVector::from_iterator(x.len(), steps));
        let (worst, column) = check.worst().unwrap();
        println!("{}: {:.1e}", model.parameters[worst].name, column.relative_error);
        assert!(column.relative_error < 1e-8, "{} {column:?}", model.parameters[worst].name);
    }
}

/// Returns the rows of the camera on the hand among the first `count`.
fn of_hand(rows: &Measurements, count: usize) -> Measurements {
    let is_of_hand = |row: &usize| rows.observation(*row).fixtures()[0] == Some(0);
    rows.select(&(0..count).filter(is_of_hand).collect::<Vec<_>>())
}

#[test]
fn a_rolling_shutter_is_named_and_no_cause_of_the_arm() {
    let plain = parse(&rigid(ARM));
    let moving = seen(&plain, [DELAY, ROW_TIME], 1.0);
    let declared = parse(&rigid(&format!("{ARM}{SHUTTER}")));
    let found =
        identify(&declared, &split(&declared, moving.clone()), &Options::default()).unwrap();
    for (name, truth) in [("delay", DELAY), ("row", ROW_TIME)] {
        let estimate = found.estimate(&format!("rolling-shutter[hand].{name}")).unwrap();
        let z = (estimate.estimate - truth) / estimate.std_error.unwrap();
        println!("{name}: {} ± {:?}, z = {z:.2}", estimate.estimate, estimate.std_error);
        assert!(z.abs() < 4.0);
    }
    assert!(found.is_trusted(), "{:?}", found.findings);
    let effects = |rows: &Measurements| {
        let rows = of_hand(rows, 200);
        let closed = close(&plain, &split(&plain, rows), &Options::default()).unwrap();
        assert!(!closed.before.fit.has(FindingCode::LensContradicted));
        let named = closed.effects.iter().map(|of| (of.effect.declaration(), of.status));
        let named: Vec<(String, Status)> = named.collect();
        println!("{named:?}");
        named
    };
    let shutter = "rolling-shutter = { camera = \"hand\" }".to_owned();
    assert_eq!(effects(&moving), [(shutter, Status::Found)]);
    // An arm whose images show it where its joints were read, without and with an error of a joint.
    let mut still = seen(&plain, [0.0, 0.0], 1.0);
    assert_eq!(effects(&still), []);
    for configuration in still.configurations.chunks_mut(still.joints) {
        configuration[3] += 0.006 * (2.0 * configuration[3]).sin();
    }
    let named = effects(&still);
    assert!(!named.is_empty() && named.iter().all(|(name, _)| !name.contains("shutter")));
}

#[test]
fn velocities_have_units_and_effects_cameras() {
    let problem = parse(&format!("{ARM}{SHUTTER}"));
    let table = table(10);
    let error = table_error(&problem, &table.replace("qd2_deg_per_s", "qd2_mm_per_s"));
    assert_says(&error, &["qd2_mm_per_s", "a velocity", "qd2_rad_per_s", "qd2_deg_per_s"]);
    // Desired angles have such names, too.
    let desired = try_table(&problem, &table.replace("qd2_deg_per_s", "qd2_deg"));
    assert_contains(&words(&desired.unwrap().1), &["qd2_deg"]);
    let unknown = format!("{ARM}{}", SHUTTER.replace("hand", "hnad"));
    assert_says(
        &problem_error(&unknown),
        &["no camera is called \"hnad\"", "there are hand, wall"],
    );
    let columns: Vec<String> = table
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            [&cells[..4], &cells[8..]].concat().join(",")
        })
        .collect();
    let rows = read_table(&problem, &(columns.join("\n") + "\n"));
    let error = identify(&problem, &split(&problem, rows), &Options::default()).map(|_| ());
    assert!(error.unwrap_err().to_string().contains("columns qd1_deg_per_s"));
}
