//! Mistakes of the first hour with a problem of one's own: what is said of them.

use std::fmt::Write as _;

use crate::common::program::{Folder, assert_contains};

const ARM: &str =
    "name = 'arm'\n[[joint]]\nd_m = 0.7\n[[joint]]\na_m = 0.5\n[tool]\ntarget_m = [0.4, 0, 0]\n";
const DATA: &str = "[data]\nfiles = ['rows.csv']\nposition_sigma_mm = 0.05\n\
                    held_out = { fraction = 0.3, seed = 1 }\n";

/// Returns measurements of [`ARM`] with `q2` from -30° to 120°.
fn rows() -> String {
    let mut text = "q1_deg,q2_deg,x_mm,y_mm,z_mm\n".to_owned();
    for k in 0..40 {
        let (q1, q2) = (-120.0 + f64::from(k * 37 % 240), -30.0 + f64::from(k * 53 % 150));
        let (first, second) = (q1.to_radians(), (q1 + q2).to_radians());
        let (x, y) = (
            500.0 * first.cos() + 400.0 * second.cos(),
            500.0 * first.sin() + 400.0 * second.sin(),
        );
        // Residuals of known size, without random numbers.
        let noise = |of: f64| 0.05 * (f64::from(k) * of).sin();
        let (x, y, z) = (x + noise(1.3), y + noise(2.9), 700.0 + noise(4.1));
        writeln!(text, "{q1},{q2},{x:.4},{y:.4},{z:.4}").unwrap();
    }
    text
}

#[test]
fn rules_and_limits_that_are_meant_otherwise_are_named() {
    let folder = Folder::with([("rows.csv", &rows())]);
    let constraint = "[[constraint]]\nterms = { 'joint*.a' = 1 }\nat_least_m = 0.1\n";
    for (more, words) in [
        (
            "[parameters]\n'joint0.*' = { fixed = true }\n",
            "joints are counted from 1: \"joint1.*\" is the first",
        ),
        (
            "[parameters]\n'base[A].*' = { free = true }\n",
            "nothing here has a name in brackets: \"base.*\"",
        ),
        ("[parameters]\n'jiont2.*' = { fixed = true }\n", "did you mean \"joint2.*\"?"),
        (constraint, "no patterns here: write each name in full"),
    ] {
        folder.write("problem.toml", format!("{ARM}{more}{DATA}"));
        assert_contains(&folder.flexcal("identify . --out out").code(2).stderr, &[words]);
    }
    let free = "[parameters]\n'joint2.a' = { sigma_mm = 1 }\n'base.*' = { free = true }\n";
    let limits = ARM.replace("a_m = 0.5", "a_m = 0.5\nmin_deg = -0.6\nmax_deg = 2.2");
    folder.write("problem.toml", format!("{limits}{free}{DATA}"));
    let said = folder.flexcal("identify . --out out").stderr;
    assert_contains(&said, &["in radians, write min_rad = -0.6 and max_rad = 2.2"]);
    folder.write("problem.toml", format!("{ARM}{free}{DATA}"));
    let said = folder.flexcal("identify . --out out").success().stderr;
    assert!(!said.contains("radians") && !said.contains("reach"), "{said}");
}

#[test]
fn a_number_beyond_the_reach_of_the_arm_comes_first() {
    let folder = Folder::with([("rows.csv", "")]);
    let free = "[parameters]\n'joint2.a' = { sigma_mm = 1 }\n'base.*' = { free = true }\n";
    folder.write("problem.toml", format!("{ARM}{free}{DATA}"));
    let row = rows().lines().nth(7).unwrap().to_owned();
    let z = row.rsplit(',').next().unwrap();
    let far = row.replace(z, &z.replace('.', ""));
    folder.write("rows.csv", rows().replace(&row, &far));
    let run = folder.flexcal("identify . --out out");
    let words = [
        "rows.csv:8: column z_mm: 6999746 mm lies 6999 m from the middle of the rows",
        "beyond the reach of the arm; correct the number: is a decimal point lost?",
    ];
    assert_contains(&run.stderr, &words);
    assert_contains(&run.stdout, &["Next: correct the table as the warning says"]);
}

#[test]
fn a_distance_in_centimetres_names_the_factor() {
    let anchors = "[[anchor]]\nname = 'A'\nat_m = [1, 1, 0]\n";
    let data = "[data]\nfiles = ['rows.csv']\ndistance_sigma_mm = 0.05\n";
    let folder = Folder::with([("rows.csv", "q1_deg,q2_deg,anchor,distance_cm\n1,2,A,80\n")]);
    folder.write("problem.toml", format!("{ARM}{anchors}{data}"));
    let said = folder.flexcal("identify . --out out").code(2).stderr;
    assert_contains(&said, &["column distance_cm: ", "convert the numbers: 1 cm is 10 mm"]);
}

#[test]
fn exchanged_tables_of_positions_and_joints_are_named() {
    let tables = "[data]\nfiles = ['log.csv']\njoints = { files = ['tracker.csv'], by = 'name' }\n\
         position_sigma_mm = 0.05\n[data.columns]\n'Punkt' = 'pose'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n\
         'Z' = 'z_mm'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n";
    let folder = Folder::with([
        ("problem.toml", &*format!("{ARM}{tables}")),
        ("log.csv", "pose,A1,A2\n1,2,3\n2,3,4\n"),
        ("tracker.csv", "Punkt,X,Y,Z\n1,2,3,4\n2,3,4,5\n"),
    ]);
    let said = folder.flexcal("identify . --out out").code(2).stderr;
    let words = ["files and joints in [data] are exchanged: ", "tracker.csv this column"];
    assert_contains(&said, &words);
}

#[test]
fn a_check_of_an_arm_whose_tables_are_there_goes_on_with_them() {
    let limits = "min_deg = -120\nmax_deg = 120\n";
    let arm = ARM.replace("d_m = 0.7\n", &format!("d_m = 0.7\n{limits}"));
    let arm = arm.replace("a_m = 0.5\n", &format!("a_m = 0.5\n{limits}"));
    let free = "[parameters]\n'joint2.a' = { sigma_mm = 1 }\n'base.*' = { free = true }\n";
    let folder = Folder::with([("problem.toml", &*format!("{arm}{free}{DATA}"))]);
    let next = || folder.flexcal("check . --poses 30 --out out").success().stdout;
    assert_contains(
        &next(),
        &["Next: measure such poses, then flexcal loop . --data MEASURED.csv"],
    );
    folder.write("rows.csv", rows());
    assert_contains(&next(), &["Next: flexcal loop . fits the tables that [data] names"]);
}
