//! Identified cameras as YAML.

use crate::common::program::{Folder, assert_contains};

/// Returns a folder with the identified camera of `tests/observations/camera`, whose problem is
/// changed by `edit`.
fn identified(edit: impl Fn(&str) -> String) -> Folder {
    let folder = Folder::new();
    folder.copy("tests/observations/camera/data.csv", "data.csv");
    folder.copy("tests/observations/camera/problem.toml", "problem.toml");
    let text = std::fs::read_to_string(folder.path("problem.toml")).unwrap();
    std::fs::write(folder.path("problem.toml"), edit(&text)).unwrap();
    folder.flexcal("identify . --out fit --quiet").success();
    folder
}

/// Returns the numbers after `key` in a text.
fn numbers(text: &str, key: &str) -> Vec<f64> {
    let (_, rest) = text.split_once(key).unwrap();
    let (_, list) = rest.split_once('[').unwrap();
    list.split_once(']').unwrap().0.split(',').map(|word| word.trim().parse().unwrap()).collect()
}

#[test]
fn a_camera_is_written_for_ros_opencv_and_kalibr() {
    let size = |text: &str| {
        text.replace("pixel_sigma = 0.2", "pixel_sigma = 0.2\nimage_px = [1280, 720]").replace(
            "\"camera*\" = { free = true }",
            "\"camera*\" = { free = true }\n\"camera*.k3\" = { fixed = true }",
        )
    };
    let folder = identified(size);
    let estimate = folder.json("fit/estimate.json");
    let value = |field: &str| {
        let name = format!("camera[hand].{field}");
        let parameters = estimate["parameters"].as_array().unwrap();
        let found = parameters.iter().find(|parameter| parameter["name"] == name.as_str());
        found.unwrap()["estimate"].as_f64().unwrap()
    };
    let [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map(value);
    let lens = ["k1", "k2", "p1", "p2"].map(value);
    for (format, file) in
        [("ros-camera", "ros.yaml"), ("opencv", "cv.yaml"), ("kalibr", "chain.yaml")]
    {
        folder
            .flexcal(&format!(
                "export . --estimate fit/estimate.json --format {format} --out {file}"
            ))
            .success();
        let text = std::fs::read_to_string(folder.path(file)).unwrap();
        let close = |key: &str, expected: &[f64]| {
            let found = numbers(&text, key);
            assert!(found.len() >= expected.len(), "{file} {key}");
            for (found, expected) in found.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-9, "{file} {key}: {found} {expected}");
            }
        };
        if format == "kalibr" {
            close("intrinsics:", &[fx, fy, cx, cy]);
            close("distortion_coeffs:", &lens);
            assert_contains(&text, &["distortion_model: radtan", "resolution: [1280, 720]"]);
        } else {
            close("camera_matrix:", &[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
            close("distortion_coefficients:", &[&lens[..], &[0.0]].concat());
            assert_contains(&text, &["image_width: 1280\n", "image_height: 720\n", "plumb_bob"]);
        }
        if format == "opencv" {
            let pose = numbers(&text, "carrier_from_camera:");
            for (entry, field) in [(3, "x"), (7, "y"), (11, "z")] {
                assert!((pose[entry] - value(field)).abs() < 1e-9);
            }
        }
    }
}

#[test]
fn a_camera_that_a_form_cannot_hold_is_an_error_with_its_remedy() {
    let folder = identified(str::to_owned);
    let error = |arguments: &str| {
        let command = format!("export . --estimate fit/estimate.json {arguments} --out out.yaml");
        folder.flexcal(&command).code(2).stderr
    };
    assert_contains(
        &error("--format ros-camera"),
        &["problem.toml:", "camera[1].image_px", "write image_px = [width, height]"],
    );
    assert_contains(&error("--format opencv --camera head"), &["no such camera; there are hand"]);
    for (arguments, option) in [
        ("--format ros-yaml --camera hand", "--camera has no effect"),
        ("--format opencv --best-rigid", "--best-rigid has no effect"),
        ("--format c --best-rigid", "--best-rigid has no effect"),
    ] {
        assert_contains(&error(arguments), &[option]);
    }
    let text = std::fs::read_to_string(folder.path("problem.toml")).unwrap();
    let text = text.replace("pixel_sigma = 0.2", "pixel_sigma = 0.2\nimage_px = [1280, 720]");
    std::fs::write(folder.path("problem.toml"), text).unwrap();
    assert_contains(&error("--format kalibr"), &["has no k3", "camera[hand].k3"]);
}

#[test]
fn the_carrier_of_a_camera_is_the_tip_link_of_the_urdf() {
    let on_tip = |text: &str| {
        text.replace("pixel_sigma = 0.2", "pixel_sigma = 0.2\nimage_px = [1280, 720]")
            .replace("[[camera]]", "[urdf]\nbase = \"base_link\"\ntip = \"tool0\"\n\n[[camera]]")
    };
    let folder = identified(on_tip);
    folder.flexcal("export . --estimate fit/estimate.json --format opencv --out cv.yaml").success();
    let text = std::fs::read_to_string(folder.path("cv.yaml")).unwrap();
    assert_contains(&text, &["in tool0: position", "carrier: \"tool0\""]);
    // After a fit to pixels the arm is exported; commands need a measured target.
    let run = folder.flexcal("identify . --out again").success();
    assert_contains(&run.stdout, &["Next: flexcal export . --estimate again/estimate.json --urdf"]);
}

#[test]
fn pixels_outside_the_declared_image_are_warned_of() {
    let small =
        |text: &str| text.replace("pixel_sigma = 0.2", "pixel_sigma = 0.2\nimage_px = [1280, 480]");
    let folder = identified(small);
    let run = folder.flexcal("identify . --out again").success();
    assert_contains(
        &run.stderr,
        &["column v_px", "is outside the image of the camera \"hand\", image_px = [1280, 480]"],
    );
}

/// Arm of three joints with a camera on its hand.
const ARM: &str = r#"<robot name="hand">
<link name="base"/><link name="a"/><link name="b"/><link name="c"/><link name="camera_optical_frame"/>
<joint name="j1" type="revolute"><parent link="base"/><child link="a"/><axis xyz="0 0 1"/>
<origin xyz="0 0 0.3" rpy="0 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="j2" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 1 0"/>
<origin xyz="0 0 0.1" rpy="0 0 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
<joint name="j3" type="revolute"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
<origin xyz="0.3 0 0" rpy="0 0 0"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
<joint name="mount" type="fixed"><parent link="c"/><child link="camera_optical_frame"/>
<origin xyz="0 0 0" rpy="0 0 0"/></joint>
</robot>"#;

#[test]
fn the_link_of_a_camera_takes_the_pose_that_other_poses_give() {
    let truth = |second: &str| {
        format!(
            "[parameters]\n\"tool.x\" = {{ mm = 50 }}\n\"tool.y\" = {{ mm = -20 }}\n\
             \"tool.z\" = {{ mm = 30 }}\n\"tool.rx\" = {{ deg = 0 }}\n\
             \"tool.ry\" = {{ deg = 0 }}\n\"tool.rz\" = {{ deg = 30 }}\n[noise]\n\
             position_sigma_mm = 0.1\n[poses]\nj1_deg = [-60, 60]\n{second}"
        )
    };
    let folder = Folder::with([
        ("arm.urdf", ARM),
        ("all.toml", &truth("")),
        ("one.toml", &truth("j2_deg = [10, 10.01]\nj3_deg = [5, 5.01]\n")),
    ]);
    folder.flexcal("init arm.urdf --tip c --out p").success();
    folder.map("p/problem.toml", |text| {
        text.replace("position_sigma_mm =", "orientation_sigma_deg = 0.02\nposition_sigma_mm =")
            .replace("\"tool.*\" = { sigma_mm = 100.0 }", "\"tool.*\" = { free = true }")
            .replace(
                "\"joint*.*\" = { sigma_deg = 0.5, sigma_mm = 2.0 }",
                "\"joint*.*\" = { fixed = true }",
            )
    });
    folder.simulate("p", "all.toml", 40, 1, "p/measurements.csv");
    folder.flexcal("identify p --out fit --quiet").success();
    let export = "export p --estimate fit/estimate.json --urdf arm.urdf --out new.urdf";
    assert_contains(&folder.flexcal(export).success().words(), &["--tool-link LINK writes it"]);
    folder.flexcal(&format!("{export} --force --tool-link camera_optical_frame")).success();
    let text = folder.read("new.urdf");
    let (_, mount) = text.split_once("<joint name=\"mount\"").unwrap();
    let numbers = |key: &str| -> Vec<f64> {
        let words = mount.split_once(key).unwrap().1.split('"').next().unwrap();
        words.split_whitespace().map(|word| word.parse().unwrap()).collect()
    };
    let found = [numbers("xyz=\""), numbers("rpy=\"")].concat();
    let turn = 30_f64.to_radians();
    for (found, expected) in found.iter().zip([0.05, -0.02, 0.03, 0.0, 0.0, turn]) {
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
    // Turns about one axis alone do not tell where along it the camera sits.
    folder.simulate("p", "one.toml", 40, 1, "p/measurements.csv");
    let run = folder.flexcal("identify p --out fit --force").success();
    assert_contains(&run.words(), &["Converged, but the measured poses leave", "one axis only"]);
    let run = folder.flexcal(&format!("{export} --force --tool-link camera_optical_frame")).code(2);
    assert_contains(&run.message(), &["do not determine", "of the tool"]);
    let table = folder.flexcal("export p --estimate fit/estimate.json --format mdh").success();
    assert_contains(&table.words(), &["= open: the rows do not determine it"]);
    assert_contains(&table.message(), &["not to be relied upon alone"]);
    // Positions alone do not tell how a tool is turned.
    folder.simulate("p", "all.toml", 40, 1, "p/measurements.csv");
    folder.edit("p/problem.toml", "orientation_sigma_deg = 0.02\n", "");
    folder.flexcal("identify p --out fit --force --quiet").success();
    let run = folder.flexcal(&format!("{export} --force --tool-link camera_optical_frame")).code(2);
    assert_contains(&run.message(), &["neither fitted", "nor declared"]);
}

#[test]
fn the_mount_of_a_camera_needs_no_option() {
    let folder = identified(str::to_owned);
    folder.write("arm.urdf", ARM);
    let export = "export . --estimate fit/estimate.json --urdf arm.urdf --out new.urdf";
    let run = folder.flexcal(&format!("{export} --tool-link camera_optical_frame")).code(2);
    assert_contains(&run.message(), &["leave --tool-link out"]);
}

#[test]
fn a_fit_of_few_images_is_exported_with_a_warning() {
    let folder = identified(str::to_owned);
    let table = folder.read("data.csv");
    let held_out = |line: &&str| line.starts_with("validation");
    let (few, more): (Vec<&str>, Vec<&str>) = table.lines().partition(|line| !held_out(line));
    for (images, verdict, warned) in [
        (3, "Not judged, because priors decide most of it", "priors decide most of it"),
        (4, "Converged, but held-out rows miss by", "held-out rows miss by"),
    ] {
        let rows = few.iter().take(1 + images * 9).chain(more.iter().take(9)).copied();
        folder.write("data.csv", rows.collect::<Vec<_>>().join("\n") + "\n");
        let run = folder.flexcal("identify . --out few --force").success();
        assert_contains(&run.words(), &[verdict, "Next: flexcal plan"]);
        let run = folder.flexcal("export . --estimate few/estimate.json --format mdh --force");
        assert_contains(&run.success().message(), &["not to be relied upon alone", warned]);
    }
}

/// True places of a camera on the hand and a tag, for `simulate`.
const TAG_TRUTH: &str = "[parameters]\n\"camera[camera].x\" = { mm = 30 }\n\"camera[camera].y\" = { mm = 0 }\n\
    \"camera[camera].z\" = { mm = 50 }\n\"camera[camera].rx\" = { deg = 2 }\n\
    \"camera[camera].ry\" = { deg = 0 }\n\"camera[camera].rz\" = { deg = 0 }\n\
    \"marker[tag].x\" = { mm = 400 }\n\"marker[tag].y\" = { mm = 0 }\n\
    \"marker[tag].z\" = { mm = 900 }\n\"marker[tag].rx\" = { deg = 170 }\n\
    \"marker[tag].ry\" = { deg = 10 }\n\"marker[tag].rz\" = { deg = 0 }\n[noise]\n\
    pixel_sigma_px = 0.2\n";

#[test]
fn a_tag_is_declared_and_its_crossed_corners_are_named() {
    let folder = Folder::with([("arm.urdf", ARM), ("truth.toml", TAG_TRUTH)]);
    folder.flexcal("init arm.urdf --board 9x6x25 --tag 60").code(2);
    folder.flexcal("init arm.urdf --tip camera_optical_frame --tag 60 --out p").success();
    let corners = "points_mm = [[-30, 30, 0], [30, 30, 0], [30, -30, 0], [-30, -30, 0]]";
    assert_contains(&folder.read("p/problem.toml"), &["name = \"tag\"", corners]);
    folder.simulate("p", "truth.toml", 40, 1, "p/measurements.csv");
    let table = folder.table("p/measurements.csv");
    let point = table.place("point");
    // Another corner first and the other way round is a turn of the tag, a crossing is none.
    for (order, expected) in [(["3", "2", "1", "0"], 0), (["0", "1", "3", "2"], 2)] {
        folder.map_rows("p/measurements.csv", |row, line| {
            let mut cells: Vec<&str> = line.split(',').collect();
            if row > 0 {
                cells[point] = order[cells[point].parse::<usize>().unwrap()];
            }
            Some(cells.join(","))
        });
        let run = folder.flexcal("identify p --out fit --force").code(expected);
        if expected == 2 {
            assert_contains(&run.message(), &["fit no pose of marker \"tag\"", "corners 2 and 3"]);
        }
    }
}
