//! Problems that `init` completes from a table of joints, typed from a data sheet.

use crate::common::program::{Folder, assert_contains};

const SHEET: &str = "name = 'xr10'\ndh = 'standard'\njoint = [\n\
     { d_mm = 450, a_mm = 75, alpha_deg = -90, min_deg = -110, max_deg = 110 },\n\
     { theta_deg = -90, a_mm = 640, min_deg = -40, max_deg = 80 },\n\
     { a_mm = 195, alpha_deg = -90, min_deg = -60, max_deg = 70 },\n\
     { d_mm = 700, alpha_deg = 90, min_deg = -150, max_deg = 150 },\n\
     { alpha_deg = -90, min_deg = -100, max_deg = 100 },\n\
     { theta_deg = 180, d_mm = 75, min_deg = -170, max_deg = 170 },\n]\n";

#[test]
fn a_data_sheet_becomes_a_problem_that_holds_what_positions_cannot_tell() {
    let folder = Folder::with([("sheet.toml", SHEET)]);
    let said = folder.flexcal("init sheet.toml --out arm").success().stdout;
    assert_contains(&said, &["xr10: 6 moving joints", "target_m", "flexcal check arm --poses 40"]);
    let text = folder.read("arm/problem.toml");
    assert!(text.starts_with(SHEET));
    // Those of the same axes in problems/bench-arm/two-tables, which `init` made of a URDF.
    let held = "\"joint*.beta\" = { fixed = true }\n\"joint1.*\" = { fixed = true }\n\
         \"joint2.beta\" = { sigma_deg = 0.5 }\n\"joint3.d\" = { fixed = true }\n\
         \"joint6.theta\" = { fixed = true }\n\"joint6.d\" = { fixed = true }\n\
         \"joint7.*\" = { fixed = true }\n";
    let data = "#   q1_deg, q2_deg, q3_deg, q4_deg, q5_deg, q6_deg, x_mm, y_mm, z_mm\n[data]\n";
    assert_contains(&text, &["[tool]\ntarget_m = [0, 0, 0]", held, data]);
    // Sections that are there are kept; a whole problem is returned as it was.
    folder.flexcal("init arm/problem.toml --out again").success();
    assert_eq!(folder.read("again/problem.toml"), text);
    let wrong = folder.flexcal("init sheet.toml --tip flange --out arm").code(2);
    assert_contains(&wrong.stderr, &["--tip and --board belong to a URDF"]);
}
