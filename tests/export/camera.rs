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
