//! Images that were misread, and images that would spoil the start of a fit.

use std::fmt::Write as _;
use std::path::Path;

use flexcal::fit::{FindingCode, Options, identify};

use crate::cameras::split;
use crate::common::arms::parse;
use crate::common::program::{Folder, number};
use crate::common::reading::read_table;

/// Returns what `identify` says first about the images of every third view with their cells
/// changed: the error, or the finding of a misreading.
fn said_of(change: impl Fn(&mut [String])) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = std::fs::read_to_string(folder.join("problem.toml")).unwrap();
    let problem = problem.replace("[640, 360]", "[640, 360]\nimage_px = [1280, 720]");
    let problem = parse(&problem.replace("held_out = { column = \"split\" }", ""));
    let text = std::fs::read_to_string(folder.join("data.csv")).unwrap();
    let mut lines = text.lines();
    let mut table = format!("{}\n", lines.next().unwrap());
    let mut views: Vec<String> = Vec::new();
    for line in lines {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if views.last() != Some(&cells[1]) {
            views.push(cells[1].clone());
        }
        if views.len().is_multiple_of(3) {
            change(&mut cells);
            writeln!(table, "{}", cells.join(",")).unwrap();
        }
    }
    let data = split(&problem, read_table(&problem, &table));
    match identify(&problem, &data, &Options::default()) {
        Ok(found) => found.finding(FindingCode::Misread).map_or_else(
            || format!("{} {:?}", found.termination, found.findings),
            |finding| format!("{finding} ({} steps)", found.iterations),
        ),
        Err(error) => error.to_string(),
    }
}

/// Multiplies a number of the table.
fn scale(cell: &mut String, factor: f64) {
    *cell = (cell.parse::<f64>().unwrap() * factor).to_string();
}

#[test]
fn misread_images_are_named() {
    type Change = fn(&mut [String]);
    let changes: [(&str, Change); 4] = [
        ("joint 3 that counts the other way", |cells| scale(&mut cells[3], -1.0)),
        ("columns of joints 4 and 5 that are exchanged", |cells| cells.swap(4, 5)),
        ("joint angles that are radians", |cells| {
            cells[1..7].iter_mut().for_each(|cell| scale(cell, 1f64.to_radians()));
        }),
        ("counts from the bottom of the image", |cells| {
            scale(&mut cells[11], -1.0);
            cells[11] = (cells[11].parse::<f64>().unwrap() + 720.0).to_string();
        }),
    ];
    for (words, change) in changes {
        let said = said_of(change);
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// Truth of the bench arm with a distorted camera on its tip and a board in front of it.
const TRUTH: &str = r#"
[random]
"joint*.alpha" = { sigma_deg = 0.1 }
"joint*.theta" = { sigma_deg = 0.1 }
"joint*.a" = { sigma_mm = 0.5 }
[parameters]
"camera[camera].x" = { mm = 20 }
"camera[camera].y" = { mm = -35 }
"camera[camera].z" = { mm = 40 }
"camera[camera].rx" = { deg = 4 }
"camera[camera].ry" = { deg = -3 }
"camera[camera].rz" = { deg = 80 }
"camera[camera].fx" = { px = 12 }
"camera[camera].fy" = { px = 10 }
"camera[camera].k1" = { relative = -0.08 }
"marker[board].x" = { mm = 700 }
"marker[board].y" = { mm = 60 }
"marker[board].z" = { mm = 50 }
"marker[board].rx" = { deg = 0 }
"marker[board].ry" = { deg = 0 }
"marker[board].rz" = { deg = 15 }
[poses]
turn_deg = [-40, 40]
"#;

/// The pixels of an image from near, or of few corners in a strip, move far with every error of
/// the nominal arm.
#[test]
fn images_from_near_and_of_few_corners_do_not_spoil_the_start() {
    let folder = Folder::with([("TRUTH.toml", TRUTH)]);
    folder.copy("problems/bench-arm/arm.urdf", "arm.urdf");
    folder.flexcal("init arm.urdf --board 7x5x25 --out arm").success();
    folder.flexcal("simulate arm --truth TRUTH.toml --poses 200 --seed 3 --out arm").success();
    let table = folder.table("arm/measurements.csv");
    let pose = table.place("pose");
    let corners = |of: &str| table.rows.iter().filter(|cells| cells[pose] == of).count();
    let is_kept = |cells: &&Vec<String>| {
        (110..=160).contains(&cells[pose].parse().unwrap()) && corners(&cells[pose]) >= 6
    };
    let rows: String =
        table.rows.iter().filter(is_kept).map(|cells| cells.join(",") + "\n").collect();
    folder.write("some.csv", table.columns.join(",") + "\n" + &rows);
    let result = folder.flexcal("identify arm --data some.csv --out fit").success();
    println!("{}{}", result.stdout, result.stderr);
    let estimate = folder.json("fit/estimate.json");
    let codes = estimate["findings"].as_array().unwrap();
    let is_accused = codes.iter().any(|finding| finding["code"] == "nominal-far-off");
    assert!(!is_accused, "{codes:?}");
    assert!(number(&estimate["iterations"]) < 30.0, "{}", estimate["iterations"]);
}
