//! Pixels of markers in the images of cameras.

use std::fmt::Write as _;
use std::path::Path;

use flexcal::fit::{FindingCode, Identification, Options, Placement, SavedEstimate, identify};
use flexcal::least_squares::{check_jacobian, jacobian};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::Problem;
use flexcal::quantity::Unit;
use flexcal::results::{Document as _, IdentificationResult};
use nalgebra::{DVector, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::bench::{ARM, problem};
use crate::common::arms::parse;
use crate::common::made::{draw, model_of, normal};
use crate::common::program::assert_contains;
use crate::common::reading::{assert_says, problem_error, read_dataset, read_table, table_error};

/// Cameras on the hand, on the base and in the world, and markers on the hand, on a link and in the
/// world.
const CAMERAS: &str = r#"
"camera*" = { free = true }
"marker*" = { free = true }
"base.*" = { free = true }
[[camera]]
name = "hand"
on = "flange"
at_m = [0.03, -0.05, 0.04]
rotation_deg = [2, -3, 40]
focal_px = [900, 910]
centre_px = [640, 360]
distortion = [-0.05, 0.02, 0.001, -0.002, 0.004]
pixel_sigma = 0.2
[[camera]]
name = "head"
model = "fisheye"
on = "base"
at_m = [-0.8, 0.1, 1.6]
rotation_deg = [0, 120, 0]
focal_px = [400, 405]
centre_px = [640, 480]
distortion = [0.02, -0.01, 0.003, 0.001]
pixel_sigma = 0.3
[[camera]]
name = "wall"
on = "world"
at_m = [3, 0, 0.7]
rotation_deg = [0, -90, 0]
focal_px = [700, 700]
centre_px = [640, 480]
pixel_sigma = 0.5
[[marker]]
name = "tag"
on = "flange"
at_m = [0, 0.03, 0.05]
rotation_deg = [10, 0, 5]
points_mm = [[-20, -20, 0], [20, -20, 0], [20, 20, 5], [-20, 20, 0]]
[[marker]]
name = "ring"
on = "joint3"
at_m = [0.1, 0.1, 0]
rotation_deg = [0, 20, 5]
points_mm = [[0, 0, 0], [30, 0, 0], [0, 30, 10]]
[[marker]]
name = "board"
at_m = [0.25, 0, -0.2]
rotation_deg = [3, 4, 5]
points_mm = [[0, 0, 0], [60, 0, 0], [0, 60, 0], [60, 60, 20]]
[data]
position_sigma_mm = 0.05
held_out = { fraction = 0.2, seed = 1 }
"#;

/// Returns rows in random configurations: every pair of camera and marker that is in front of it,
/// with the pixels that `x` predicts; `position` adds positions of the target.
fn table(problem: &Problem, configurations: usize, position: bool) -> String {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut text =
        "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,camera,marker,point,u_px,v_px,x_mm,y_mm,z_mm\n"
            .to_owned();
    for _ in 0..configurations {
        let turns = [0.6, 0.5, 0.5, 0.5, 0.5, 2.0];
        let at = [0.0, 1.0, -1.6, 0.0, 0.9, 0.0];
        let q: Vec<String> = turns
            .iter()
            .zip(at)
            .map(|(turn, at)| format!("{:.6}", at + turn * random.random_range(-1.0..1.0)))
            .collect();
        for camera in ["hand", "head", "wall"] {
            for fixture in problem.fixtures.iter().filter(|known| !known.points.is_empty()) {
                for point in 0..fixture.points.len() {
                    writeln!(text, "{},{camera},{},{point},1,1,,,", q.join(","), fixture.name)
                        .unwrap();
                }
            }
        }
        if position {
            writeln!(text, "{},,,,,,1,1,1", q.join(",")).unwrap();
        }
    }
    text
}

/// Returns the rows that are predicted with the parameters `x`, with these numbers and `noise` in
/// units of σ.
fn measured(model: &Model, rows: &Measurements, x: &DVector<f64>, noise: f64) -> Measurements {
    measured_with(model, rows, x, (noise, 3))
}

/// Returns the rows of [`measured`] with noise of a seed.
pub fn measured_with(
    model: &Model,
    rows: &Measurements,
    x: &DVector<f64>,
    (noise, seed): (f64, u64),
) -> Measurements {
    let all: Vec<usize> = (0..rows.len()).collect();
    let predicted = model.predict(Placement::of(rows).poses(rows, &all, 5e-5), x);
    let in_view = |row: &usize| {
        let pixel = predicted[*row];
        let of_camera = !rows.observation(*row).is_position();
        pixel.iter().all(|x| x.is_finite()) && !(of_camera && pixel.norm() > 3e3)
    };
    let kept: Vec<usize> = all.into_iter().filter(in_view).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = rows.select(&kept);
    for (place, row) in kept.iter().enumerate() {
        let sigma = noise * rows.sigma.as_ref().unwrap()[place];
        let numbers = rows.observation(place).coordinates();
        let error = |k: usize| if k < numbers { sigma } else { 0.0 };
        rows.positions[place] =
            predicted[*row] + Vector3::from_fn(|k, _| error(k) * normal(&mut random));
    }
    rows
}

#[test]
fn derivatives_of_pixels() {
    for elastic in [true, false] {
        let mut problem = problem(CAMERAS);
        if !elastic {
            problem.joints.iter_mut().for_each(|joint| joint.stiffness = None);
            problem.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
        }
        let rows = read_table(&problem, &table(&problem, 12, false));
        let model = model_of(&problem, &rows);
        let small = |unit| match unit {
            Unit::Length => 3e-3,
            Unit::Pixel => 1.0,
            Unit::Number => 1e-3,
            _ => 5e-3,
        };
        let x = draw(&model, small, &mut ChaCha8Rng::seed_from_u64(5));
        let rows = measured(&model, &rows, &x, 0.0);
        let poses = Placement::of(&rows).poses(&rows, &(0..rows.len()).collect::<Vec<_>>(), 1.0);
        let pairs: std::collections::BTreeSet<_> =
            poses.iter().map(|pose| pose.observation.fixtures()).collect();
        assert!(pairs.len() >= 6, "{pairs:?}");
        let residuals =
            PoseResiduals::new(&model, poses, (0..model.parameters.len()).collect(), x.clone());
        let step = |unit| match unit {
            Unit::Angle | Unit::Length => 0.02,
            Unit::Pixel => 10.0,
            _ => 0.1,
        };
        let steps = model.parameters.iter().map(|parameter| step(parameter.unit()));
        let check = check_jacobian(&residuals, &x, &DVector::from_iterator(x.len(), steps));
        let (worst, column) = check.worst().unwrap();
        let name = &model.parameters[worst].name;
        println!(
            "{} rows, {} parameters, worst {:.1e} at {name}",
            rows.len(),
            x.len(),
            column.relative_error
        );
        assert!(column.relative_error < 1e-8, "{name} {column:?}");
        let exact = jacobian(&residuals, &x);
        for (k, parameter) in model.parameters.iter().enumerate() {
            let is_of_arm = !parameter.name.starts_with("tool");
            assert_eq!(exact.column(k).norm() > 0.0, is_of_arm, "{}", parameter.name);
        }
    }
}

#[test]
fn an_arm_is_found_from_pixels_alone_without_a_guess() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = Problem::read(&folder).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let truth: Value =
        serde_json::from_str(&std::fs::read_to_string(folder.join("truth.json")).unwrap()).unwrap();
    let mut worst = 0.0_f64;
    for (name, truth) in truth.as_object().unwrap() {
        let estimate = found.estimate(name).unwrap();
        let z = (estimate.estimate - truth.as_f64().unwrap()) / estimate.std_error.unwrap();
        println!("{name}: z = {z:.2}");
        worst = worst.max(z.abs());
    }
    let held_out = found.fitted.held_out;
    println!("held out {:.3} px, {:?} m", held_out.rms.norm, held_out.at_point.unwrap()[2].norm);
    assert!(worst < 4.0 && found.termination.converged(), "{worst}");
    assert_eq!(held_out.kind, "pixel");
    assert!((0.2..0.4).contains(&held_out.rms.norm));
    assert!(found.is_trusted(), "{:?}", found.findings);
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/cameras.md");
    let docs = std::fs::read_to_string(docs).unwrap();
    let table = |errors: flexcal::fit::ErrorSummary| {
        format!("{:.4}    {:.4}", errors.mean.norm, errors.rms.norm)
    };
    for errors in [found.fitted.held_out, found.fitted.identification] {
        assert!(docs.contains(&table(errors)), "docs/cameras.md lacks {}", table(errors));
    }
}

#[test]
fn cameras_of_all_kinds_and_positions_are_fitted_together() {
    let problem = problem(CAMERAS);
    let rows = read_table(&problem, &table(&problem, 40, true));
    let model = model_of(&problem, &rows);
    let small = |unit| match unit {
        Unit::Length => 2e-3,
        Unit::Pixel => 3.0,
        Unit::Number => 1e-3,
        _ => 3e-3,
    };
    let truth = draw(&model, small, &mut ChaCha8Rng::seed_from_u64(11));
    let rows = measured(&model, &rows, &truth, 1.0);
    let split = flexcal::measurement::Split::new(&problem, &rows).unwrap();
    let data = Dataset { measurements: rows, split };
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let mut squares = 0.0;
    let mut count = 0.0;
    for (k, estimate) in found.estimates.iter().enumerate() {
        let Some(error) = estimate.std_error else { continue };
        let z = (found.x[k] - truth[k]) / error;
        if !model.parameters[k].unit().is_relative() {
            assert!(z.abs() < 5.0, "{}: z = {z}", estimate.name);
            squares += z * z;
            count += 1.0;
        }
    }
    println!("{count} parameters, mean z² {:.2}", squares / count);
    assert!(count > 60.0 && (0.5..1.6).contains(&(squares / count)));
    let kinds: Vec<&str> = found.kinds.iter().map(|(_, fitted)| fitted.held_out.kind).collect();
    assert_eq!(kinds, ["position", "pixel"]);
    assert!(found.reduced_chi2.is_some_and(|chi2| (0.9..1.1).contains(&chi2)));
}

#[test]
fn wrong_rows_are_named() {
    let q = "0,1,-1.6,0,0.9,0";
    let head = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad";
    let problem = problem(CAMERAS);
    for (columns, cells, words) in [
        (
            "camera,marker,point,u_px,v_px",
            "hand,board,4,1,1",
            ":2: column point: 4 is no point of the marker, whose points are numbered from 0 to 3",
        ),
        (
            "camera,marker,point,u_px,v_px",
            "hand,board,1.5,1,1",
            ":2: column point: 1.5 is no point of the marker, whose points are numbered from 0 to 3",
        ),
        (
            "camera,marker,point,u_px,v_px",
            "eye,board,0,1,1",
            ":2: column camera: no camera is called \"eye\"; there are hand, head, wall",
        ),
        (
            "camera,marker,point,u_px,v_px",
            "hand,board,0,1,",
            ":2: column u_px: a pixel without that of the other axis",
        ),
        (
            "camera,marker,point,u_px,v_px",
            "hand,board,0,,",
            ":2: column point: a point without its pixel",
        ),
        (
            "camera,marker,point,u_px,v_px",
            "hand,,0,1,1",
            ":2: column v_px: a pixel without a marker",
        ),
        ("camera,marker,point,u_px", "hand,board,0,1", ":1: column v_px: missing"),
        ("camera,point,u_px,v_px", "hand,0,1,1", ":1: column marker: missing"),
        (
            "camera,marker,point,u,v_px",
            "hand,board,0,1,1",
            ":1: column u: a number of pixels needs a unit; write u_px",
        ),
    ] {
        assert_says(&table_error(&problem, &format!("{head},{columns}\n{q},{cells}\n")), &[words]);
    }
    for (more, words) in [
        ("[[camera]]\nname = \"a\"\n", "on"),
        (
            "[[camera]]\nname = \"a\"\non = \"elbow\"\nfocal_px = [0, 1]\ncentre_px = [1, 1]\npixel_sigma = 1\n",
            "not above zero",
        ),
        ("[[camera]]\nname = \"a\"\non = \"knee\"\n", "no frame is called \"knee\""),
        (
            "[[camera]]\nname = \"a\"\non = \"elbow\"\nfocal_px = [1, 1]\ncentre_px = [1, 1]\ndistortion = [0.1, 0.2, 0]\n",
            "distortion: expected 5 numbers (k1, k2, p1, p2, k3), found 3; write 0 for a coefficient",
        ),
        (
            "[[camera]]\nname = \"a\"\nmodel = \"fisheye\"\non = \"elbow\"\nfocal_px = [1, 1]\ncentre_px = [1, 1]\ndistortion = [0.1, 0.2, 0, 0, 0]\n",
            "distortion: expected 4 numbers (k1, k2, k3, k4), found 5",
        ),
        ("[[marker]]\nname = \"a\"\n", "points_mm"),
        ("[[marker]]\nname = \"a\"\npoints_mm = []\n", "empty"),
    ] {
        let text = format!("{ARM}{more}");
        assert_says(&problem_error(&text), &[words, "problem.toml:"]);
    }
}

/// The images by themselves tell a mistake in the marker from one in the arm.
#[test]
fn a_grid_declared_along_its_other_side_is_named_before_the_fit() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let mut problem = Problem::read(&folder).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    problem.fixtures[1].points = (0..35)
        .map(|k| Vector3::new(0.03 * f64::from(k % 5), 0.03 * f64::from(k / 5), 0.0))
        .collect();
    let error = identify(&problem, &data, &Options::default()).map(|_| ()).unwrap_err().to_string();
    let expected = ["data.csv:", "fit no pose of marker \"board\"", "along and across exchanged"];
    assert_contains(&error, &expected);
}

/// Of two boards, the one is named that is declared along its other side, although most images show
/// the other one.
#[test]
fn the_board_declared_along_its_other_side_is_named() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let (camera, after) = read("problem.toml").split_once("[[marker]]").map_or_else(
        || panic!("no marker"),
        |(camera, after)| (camera.to_owned(), after.to_owned()),
    );
    let marker = after.split_once("[parameters]").unwrap().0.replace("board", "plate");
    let mut problem = parse(&format!("{camera}[[marker]]{marker}[[marker]]{after}"));
    let mut views = Vec::new();
    let text: String = read("data.csv")
        .lines()
        .map(|line| {
            let view = line.split(',').nth(1).unwrap().to_owned();
            if views.last() != Some(&view) {
                views.push(view);
            }
            let is_of_plate = views.len() % 3 == 0;
            let line = if is_of_plate { line.replace("board", "plate") } else { line.to_owned() };
            line + "\n"
        })
        .collect();
    let data = read_dataset(&problem, &text);
    problem.fixtures[1].points = (0..35)
        .map(|k| Vector3::new(0.03 * f64::from(k % 5), 0.03 * f64::from(k / 5), 0.0))
        .collect();
    let error = identify(&problem, &data, &Options::default()).map(|_| ()).unwrap_err().to_string();
    assert_contains(&error, &["fit no pose of marker \"plate\"", "along and across exchanged"]);
}

#[test]
fn a_point_behind_the_camera_is_an_error_with_its_row() {
    let problem = problem(&CAMERAS.replace("at_m = [3, 0, 0.7]", "at_m = [-3, 0, 0.7]"));
    let rows = read_table(&problem, &table(&problem, 12, false));
    let first =
        (0..rows.len()).find(|&row| rows.observation(row).fixtures()[0] == Some(2)).unwrap();
    let split = flexcal::measurement::Split::new(&problem, &rows).unwrap();
    let line = rows.location(first).line.unwrap();
    let data = Dataset { measurements: rows, split };
    let error = identify(&problem, &data, &Options::default()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("the point is behind the camera"), "{error}");
    assert!(error.contains(':') && line > 1, "{error}");
}

#[test]
fn a_camera_and_a_marker_that_both_stand_still_are_an_error() {
    let problem = problem(CAMERAS);
    let head = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,camera,marker,point,u_px,v_px\n";
    let still = "0,1,-1.6,0,0.9,0,wall,board,0,1,1\n";
    let said = table_error(&problem, &format!("{head}{still}{still}"));
    assert_says(
        &said,
        &["no row depends on the arm", "\"wall\" and marker \"board\"", "on = \"tool\""],
    );
    // One view of the arm is enough.
    read_table(&problem, &format!("{head}{still}0,1,-1.6,0,0.9,0,wall,tag,0,1,1\n"));
}

/// Splits rows as the problem says.
pub fn split(problem: &Problem, rows: Measurements) -> Dataset {
    let split = flexcal::measurement::Split::new(problem, &rows).unwrap();
    Dataset { measurements: rows, split }
}

/// Returns what the fit says to be left open.
fn open(found: &Identification) -> Vec<&str> {
    let is_open = |code| code == FindingCode::NotToldApart;
    let open = found.findings.iter().filter(|finding| is_open(finding.code));
    open.map(|finding| finding.word("what").unwrap()).collect()
}

#[test]
fn a_scale_that_no_length_gives_is_named() {
    let lights = |bar: &str| -> String {
        let light = |(k, [x, y, z]): (usize, [f64; 3])| {
            format!(
                "[[marker]]\nname = \"light{k}\"\nat_m = [{x}, {y}, {z}]\nrotation_deg = [0, 0, 0]\n\
                 points_mm = [[0, 0, 0]{}]\n",
                if k == 0 { bar } else { "" }
            )
        };
        let places = [[0.25, 0.0, -0.2], [0.45, 0.2, -0.1], [0.1, -0.2, -0.2], [0.5, -0.1, 0.0]];
        places.into_iter().enumerate().map(light).collect()
    };
    let (head, after) = CAMERAS.split_once("[[camera]]").unwrap();
    let hand = after.split_once("[[camera]]").unwrap().0;
    let head = head.replace("\"base.*\" = { free = true }\n", "").replace(
        "\"marker*\" = { free = true }",
        "\"marker*.x\" = { free = true }\n\"marker*.y\" = { free = true }\n\"marker*.z\" = { free = true }",
    );
    let data = "[data]\nheld_out = { fraction = 0.2, seed = 1 }\n";
    let found = |bar: &str| {
        let mut problem = problem(&format!("{head}[[camera]]{hand}{}{data}", lights(bar)));
        // Moments of known weights would depend on the lengths.
        problem.joints.iter_mut().for_each(|joint| joint.stiffness = None);
        problem.parameters.retain(|rule| !rule.pattern.contains("stiffness"));
        let rows = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,camera,marker,point,u_px,v_px\n";
        let mut text = rows.to_owned();
        for line in table(&problem, 60, false).lines().filter(|line| line.contains(",hand,")) {
            writeln!(text, "{}", line.trim_end_matches(',')).unwrap();
        }
        let rows = read_table(&problem, &text);
        let model = model_of(&problem, &rows);
        let rows = measured(&model, &rows, &DVector::zeros(model.parameters.len()), 1.0);
        identify(&problem, &split(&problem, rows), &Options::default()).unwrap()
    };
    let without = found("");
    assert!(open(&without).contains(&"scale"), "{:?}", without.findings);
    let said = without.findings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n");
    assert_contains(&said, &["the scale: no length is known (", "view a marker of several points"]);
    let with = found(", [60, 0, 0]");
    assert!(!open(&with).contains(&"scale"), "{:?}", with.findings);
}

#[test]
fn poses_that_views_leave_open_are_refused_with_the_reason() {
    let flat = CAMERAS.replace("[60, 60, 20]", "[60, 60, 0]");
    let known = problem(&flat);
    let mut text =
        "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,camera,marker,point,u_px,v_px\n".to_owned();
    for turn in 0..6 {
        for point in 0..4 {
            writeln!(text, "0,1,-1.6,0,0.9,{},hand,board,{point},1,1", 0.3 * f64::from(turn))
                .unwrap();
        }
    }
    let rows = read_table(&known, &text);
    let model = model_of(&known, &rows);
    let rows = measured(&model, &rows, &DVector::zeros(model.parameters.len()), 0.0);
    assert!(rows.len() >= 16, "{}", rows.len());
    // From a declared pose the fit begins, but the estimate says that it is open.
    let found = identify(&known, &split(&known, rows.clone()), &Options::default()).unwrap();
    let json = IdentificationResult::new(&known, &found).to_json();
    let saved = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let names = ["x", "y", "z"].map(|axis| format!("camera[hand].{axis}"));
    assert!(
        !saved.undetermined(&names).is_empty() && found.has(FindingCode::ViewsUndecided),
        "{json}"
    );
    let unknown = flat
        .replace("at_m = [0.03, -0.05, 0.04]\nrotation_deg = [2, -3, 40]\n", "")
        .replace("at_m = [0.25, 0, -0.2]\nrotation_deg = [3, 4, 5]\n", "");
    let unknown = problem(&unknown);
    let error = |rows: Measurements| {
        let found = identify(&unknown, &split(&unknown, rows), &Options::default());
        found.map(|_| ()).unwrap_err().to_string()
    };
    let first: Vec<usize> = (0..8).collect();
    for (rows, why) in [
        (rows.clone(), "the camera does not turn about two axes that are not parallel"),
        (rows.select(&first), "fewer than three configurations show them together"),
    ] {
        let said = error(rows);
        assert_contains(
            &said,
            &["camera \"hand\" and marker \"board\"", why, "declare at_m and rotation_deg"],
        );
    }
}
