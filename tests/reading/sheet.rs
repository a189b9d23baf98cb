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
    assert_contains(&wrong.stderr, &["belong to a URDF, not to a table of joints"]);
}

#[test]
fn a_data_sheet_may_be_a_table_with_units_in_its_header() {
    let table = "Joint;theta [deg];d (mm);a_mm;Alpha [°]\n1;q1;450;75;-90\n2;q2 - 90;0;640;0\n\
                 3;θ3;;195;-90\n4;0;700,5;0;π/2\n5;q5;0;0;-90\n6;180;75;0;0\n";
    let slide = "theta_deg,d_mm,alpha_deg\n0,q1,0\n";
    let folder = Folder::with([("xr10.csv", table), ("slide.csv", slide)]);
    let said = folder.flexcal("init xr10.csv --out arm").success().stdout;
    assert_contains(&said, &["xr10: 6 moving joints", "min_deg, max_deg"]);
    let rows = "{ alpha_deg = -90, d_mm = 450, a_mm = 75 },\n  { theta_deg = -90, a_mm = 640 },\n  \
                { alpha_deg = -90, a_mm = 195 },\n  { alpha_deg = 90, d_mm = 700.5 },\n  \
                { alpha_deg = -90 },\n  { theta_deg = 180, d_mm = 75 },\n]";
    assert_contains(&folder.read("arm/problem.toml"), &["dh = \"standard\"", rows, "[data]"]);
    folder.flexcal("init slide.csv --out slide").success();
    assert_contains(&folder.read("slide/problem.toml"), &["kind = \"prismatic\"", "q1_mm"]);
    let modified = "alpha_i-1 [deg],a_i-1 [mm],d_i [mm],theta_i [deg]\n0,0,400,q1\n-90,25,0,q2\n";
    std::fs::write(folder.path("other.csv"), modified).unwrap();
    folder.flexcal("init other.csv --out other").success();
    let text = folder.read("other/problem.toml");
    assert_contains(
        &text,
        &["# Modified form", "{ d_mm = 400 },\n  { alpha_deg = -90, a_mm = 25 }"],
    );
    assert!(!text.contains("dh = "), "{text}");
    for (header, why) in [
        ("theta,d,a,alpha", "column theta: the column has no unit; write theta_deg or theta_rad"),
        (
            "theta_deg,d_deg,alpha_deg",
            "column d_deg: deg is no unit of this column; write d_mm or d_m",
        ),
        (
            "theta_deg,d (in),alpha_deg",
            "d (in): in is no unit of this column; write d_mm or d_m in the header, and convert \
             the numbers: 1 in is 25.4 mm",
        ),
        ("theta_deg,d_mm,a_mm\n0,0.4,0", "column of the twist angle α; add alpha_deg"),
        (
            "θ [°],offset [deg],d_mm,alpha_deg\n9,0,0,0\n9,9,0,0",
            "another column states theta in this row",
        ),
        ("x_mm,y_mm,z_mm,q1_deg", "no table of Denavit-Hartenberg parameters"),
        ("theta_deg,d_mm,a_mm,alpha_deg\n1,x*2,3,4", ":2: column d_mm: \"x*2\" is not a number"),
    ] {
        std::fs::write(folder.path("bad.csv"), format!("{header}\n0,0,0,0\n")).unwrap();
        assert_contains(&folder.flexcal("init bad.csv --out bad").code(2).stderr, &[why]);
    }
}

#[test]
fn a_joint_left_out_of_a_data_sheet_is_named() {
    let rows = |names: &[&str]| {
        let row = |name: &&str| format!("{name},0,400,0,90\n");
        "joint,theta_deg,d_mm,a_mm,alpha_deg\n".to_owned()
            + &names.iter().map(row).collect::<String>()
    };
    let folder = Folder::with([("sheet.csv", "")]);
    let said = |names: &[&str]| {
        folder.write("sheet.csv", rows(names));
        folder.flexcal("init sheet.csv --out arm").success().stderr
    };
    for names in [&["1", "2", "4"][..], &["joint1", "joint2", "joint4", "joint5"]] {
        let words =
            ["sheet.csv:4: the row of ", "3 seems to be missing before ", " joints; add it"];
        assert_contains(&said(names), &words);
    }
    for names in [&["1", "2", "3"][..], &["J2", "J3", "J4"], &["10", "12", "14"], &["a1", "b3"]] {
        assert!(!said(names).contains("missing"), "{names:?}");
    }
    let joints = "name = 'arm'\n[[joint]]\nname = 'A1'\nd_m = 1\n[[joint]]\nname = 'A2'\na_m = 1\n\
                  [[joint]]\nname = 'A4'\na_m = 1\n";
    folder.write("sheet.toml", joints);
    let run = folder.flexcal("init sheet.toml --out other").success();
    assert_contains(&(run.stdout + &run.stderr), &["the row of A3 seems to be missing before A4"]);
}

#[test]
fn sheets_of_one_name_in_two_folders_do_not_replace_each_other_silently() {
    let sheet = "theta_deg,d_mm,alpha_deg\n0,400,0\n";
    let folder = Folder::with([("datasheet.csv", sheet)]);
    folder.write("b/datasheet.csv", sheet.replace("400", "500"));
    let said = |command: &str| folder.flexcal(command).success().stderr;
    assert!(!said("init datasheet.csv").contains("replaced"));
    assert!(!said("init ./datasheet.csv").contains("replaced"));
    let words = "problem.toml made of another file is replaced; --out keeps both";
    assert_contains(&said("init b/datasheet.csv"), &[words]);
    assert_contains(&said("init datasheet.csv"), &[words]);
}

#[test]
fn a_data_sheet_may_have_accents_and_names_what_is_not_read() {
    let rows = "1,90,0,9,8,-20,30,v,-90\n2,0,450,9,8,-20,30,v,-90\n";
    let folder = Folder::with([("sheet.csv", "")]);
    let init = |header: &str| {
        // Windows-1252 has the accented letters and ° at their place of Unicode; θ is UTF-8.
        let bytes: Vec<u8> = if header.contains('θ') {
            format!("{header}\n{rows}").into_bytes()
        } else {
            format!("{header}\n{rows}").chars().map(|c| u8::try_from(c).unwrap()).collect()
        };
        std::fs::write(folder.path("sheet.csv"), bytes).unwrap();
        folder.flexcal("init sheet.csv --out arm").success().stderr
    };
    let row = "{ theta_deg = 90, alpha_deg = -90, a_mm = 9, min_deg = -20, max_deg = 30 }";
    for (header, warning) in [
        (
            "Achse,ângulo (°),d (mm),a [mm],Vmax [°/s],mín (°),máx (°),Bemerkung,alpha_deg",
            "sheet.csv:1: columns not taken: Vmax [°/s], Bemerkung; taken: theta_deg, alpha_deg",
        ),
        (
            "i,θ offset [°],d offset [mm],a [mm],x,lower limit [°],upper limit [°],y,α [°]",
            "sheet.csv:1: columns not taken: x, y; taken: theta_deg",
        ),
        (
            "i,theta offset [deg],link offset [mm],a mm,x,theta min °,theta max °,y,twist angle °",
            "sheet.csv:1: not UTF-8 text; read as Windows-1252",
        ),
    ] {
        assert_contains(&init(header), &[warning]);
        assert_contains(&folder.read("arm/problem.toml"), &[row]);
    }
    // The middle of the second link is half the way back to the frame of the first.
    assert_contains(
        &folder.read("arm/problem.toml"),
        &["#   row 2: body = [{ mass_kg = ?, com_m = [-0.0045, 0.225, 0] }]"],
    );
    let metres = "i,theta_deg,d_mm,a_mm,최소 (deg),최대 (deg),alpha_deg\n1,0,0.45,0.64,-9,9,-90\n";
    std::fs::write(folder.path("metres.csv"), metres).unwrap();
    let said = folder.flexcal("init metres.csv --out metres").success().stderr;
    assert_contains(&said, &["metres.csv:1: no length is above 0.64 mm; if they are in metres"]);
    assert_contains(&folder.read("metres/problem.toml"), &["min_deg = -9, max_deg = 9"]);
    let said = init("i,theta_rad,d_m,a_mm,x,min_deg,max_deg,y,alpha_rad");
    let asked = ["an angle of 14 turns; if it is in degrees, write theta_deg", "write alpha_deg"];
    assert_contains(&said, &asked.map(|words| words));
    assert_contains(&said, &["sheet.csv:3: joint[2].d_m: 450 m is long for a part of an arm"]);
}
