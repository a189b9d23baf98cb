//! Plans and next images with cameras.

use std::fmt::Write as _;
use std::path::Path;

use flexcal::design::{self, Candidates, Criterion, NextOptions, PlanOptions, Purpose};
use flexcal::fit::{Options, Placement, identify};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{Observation, PoseRanges, Problem};

use crate::cameras::split;
use crate::common::made::model_of;
use crate::common::program::{Folder, assert_contains};

#[test]
fn plans_with_a_camera_hold_configurations_that_see_the_board() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = Problem::read(&folder).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let rows = data.measurements;
    // The first images show where camera and board are.
    let first: Vec<usize> = (0..90).collect();
    let given = rows.select(&first);
    let ranges = PoseRanges::declared_or_measured(&problem, &rows);
    let options = PlanOptions {
        poses: 8,
        criterion: &Criterion::S,
        seed: 1,
        workspace: None,
        progress: None,
    };
    let candidates = Candidates::Within(ranges);
    let plan = design::plan(&problem, &candidates, Some(&given), &options).unwrap();
    assert!(plan.is_of_cameras && plan.poses.len() == 8 && plan.coordinates > 180 + 16);
    let model = model_of(&problem, &rows);
    let found = identify(&problem, &split(&problem, rows.clone()), &Options::default()).unwrap();
    for pose in 0..8 {
        let mut seen = 0;
        for point in 0..35 {
            let mut planned = Placement::of(&plan.poses).poses(&plan.poses, &[pose], 0.2);
            planned[0].observation = Observation::Pixel(0, 1, point);
            let pixel = model.predict(planned, &found.x)[0];
            let is_in_image =
                pixel.x > -30.0 && pixel.x < 1310.0 && pixel.y > -30.0 && pixel.y < 750.0;
            seen += usize::from(is_in_image);
        }
        // The measured views show nine of the 35 points.
        assert!(seen >= 9, "pose {pose} sees {seen} points");
    }
    let median = |k: usize| {
        let errors = plan.random.iter().map(|set| set.expected[k].std_error);
        let mut errors: Vec<f64> = errors.map(|error| error.unwrap_or(f64::INFINITY)).collect();
        errors.sort_by(f64::total_cmp);
        errors[errors.len() / 2]
    };
    let smaller: Vec<usize> = (0..plan.planned.expected.len())
        .filter_map(|k| Some(usize::from(plan.planned.expected[k].std_error? < median(k))))
        .collect();
    println!("{} of {} smaller than random", smaller.iter().sum::<usize>(), smaller.len());
    assert!(2 * smaller.iter().sum::<usize>() > smaller.len());
    // Where the camera is, nobody can plan without.
    let error = design::plan(&problem, &candidates, None, &options).map(|_| ()).unwrap_err();
    assert_contains(&error.to_string(), &["the place of the camera \"hand\" is not declared"]);
}

/// Views that a detector cannot use are no candidates: behind the board, in part, or too close.
#[test]
fn next_images_show_the_board_as_the_measured_ones_do() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = Problem::read(&folder).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let rows = data.measurements.clone();
    let ranges = PoseRanges::declared_or_measured(&problem, &rows);
    let options = NextOptions {
        poses: 4,
        purpose: Purpose::Accuracy,
        tolerance: None,
        level: 0.95,
        seed: 1,
        workspace: None,
        explanations: None,
        remainder: false,
        fit: Options::default(),
        update: None,
    };
    let next = design::next(&problem, &data, &Candidates::Within(ranges), &options).unwrap();
    assert_eq!(next.poses.len(), 4);
    // Poses are drawn until enough of them show the board.
    assert!(next.candidates >= 200 && next.drawn.is_some_and(|drawn| drawn >= 20_000));
    let model = model_of(&problem, &rows);
    // Twice the area of the board in the image; its sign is that of the side that is seen.
    let view = |table: &Measurements, row: usize| {
        let corner = |point: u32| {
            let mut pose = Placement::of(table).poses(table, &[row], 0.2);
            pose[0].observation = Observation::Pixel(0, 1, point);
            let pixel = model.predict(pose, &next.found.x)[0];
            nalgebra::Vector2::new(pixel.x, pixel.y)
        };
        let [origin, along, across] = [0, 6, 28].map(corner);
        (along - origin).perp(&(across - origin))
    };
    let side = view(&rows, 0).signum();
    for row in (0..rows.len()).step_by(9) {
        assert!(view(&rows, row) * side > 0.0, "row {row}");
    }
    let areas: Vec<f64> = (0..rows.len()).step_by(9).map(|row| side * view(&rows, row)).collect();
    let largest = areas.iter().copied().fold(0.0, f64::max);
    for pose in 0..4 {
        let area = side * view(&next.poses, pose);
        assert!(area > 0.0 && area < 4.0 * largest, "pose {pose}: {area} of {largest}");
    }
}

/// The ranges of poses need no true place of the camera, which first images show.
#[test]
fn the_command_plan_takes_ranges_by_themselves() {
    let folder = Folder::new();
    for name in ["problem.toml", "data.csv"] {
        folder.copy(&format!("tests/observations/camera/{name}"), name);
    }
    let first: String = folder.read("data.csv").split_inclusive('\n').take(91).collect();
    folder.write("first.csv", first);
    let table = folder.table("data.csv");
    let mut ranges = "[poses]\n".to_owned();
    for joint in 1..=6 {
        let angles = table.numbers(&format!("q{joint}_deg"));
        let low = angles.iter().copied().fold(f64::INFINITY, f64::min);
        let high = angles.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let _ = writeln!(ranges, "q{joint}_deg = [{low}, {high}]");
    }
    folder.write("ranges.toml", &ranges);
    let plan = "plan . --truth ranges.toml --poses 8";
    let run = folder.flexcal(&format!("{plan} --data first.csv"));
    assert!(run.status < 2, "{run:?}");
    assert_eq!(folder.table("out/camera-six/plan.csv").rows.len(), 8);
    let refused = folder.flexcal(plan).code(2);
    assert_contains(&refused.message(), &["the place of the camera \"hand\" is not declared"]);
    // A file with other sections is a truth, whose values must be there.
    folder.write("ranges.toml", format!("{ranges}[noise]\nposition_sigma_mm = 0.1\n"));
    let refused = folder.flexcal(&format!("{plan} --data first.csv")).code(2);
    assert_contains(&refused.message(), &["write its true value"]);
}
