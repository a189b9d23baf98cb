//! Keys, columns and words as other programs and people call them: the message says what they are
//! called here, with the unit, and holds the whole remedy.

use super::reading::{ARM, check, check_problems};
use crate::common::arms::parse;
use crate::common::program::Folder;
use crate::common::reading::table_error;
use flexcal::problem::Problem;

#[test]
fn other_names_of_keys_lead_to_ours() {
    for (text, meant) in [
        ("[tool]\noffset_m = [0, 0, 0]", "target_m"),
        ("[tool]\nxyz_mm = [0, 0, 0]", "target_mm"),
        ("[tool]\nmass_kg = 3", "payload_kg"),
        ("[base]\nposition_m = [0, 0, 0]", "translation_m or xyz_m"),
        ("[base]\norientation_deg = [0, 0, 0]", "rotation_deg or rpy_deg"),
        ("[data.format]\nseparator = ';'", "delimiter"),
        ("[data]\nnoise_mm = 0.1", "position_sigma_mm"),
        ("[data]\nheldout = 'none'", "held_out"),
        ("[data]\nheld_out = { size = 0.3 }", "fraction"),
        ("[data]\nfile = 'a.csv'", "files = [\"a.csv\"]"),
        ("[parameters]\n'joint1.a' = { bounds_mm = [-2, 2] }", "min_mm = -2, max_mm = 2"),
        ("[parameters]\n'joint1.a' = { std_mm = 2 }", "sigma_mm"),
        ("[parameters]\n'joint1.a' = { hold = true }", "fixed"),
        ("limits_deg = [-10, 10]", "min_deg = -10, max_deg = 10"),
        ("lower_deg = -20", "min_deg"),
        ("offset_deg = 90", "theta_deg"),
        ("offset_mm = 90", "d_mm"),
        ("twist_deg = 90", "alpha_deg"),
        ("type = 'revolute'", "kind"),
        ("k_N_m_per_rad = 3", "stiffness_N_m_per_rad"),
        ("[[joint.body]]\nmass_kg = 1\ncog_mm = [0, 0, 0]", "com_mm"),
    ] {
        check_problems(&[(text, &["unknown key", &format!("(did you mean {meant}?)")])]);
    }
    check_problems(&[
        (
            "[base]\nquaternion = [0, 0, 0, 1]",
            &["(did you mean rotation_deg or rpy_deg? quaternions are not read here)"],
        ),
        ("[[joint.body]]\nweight_kg = 1", &["write mass_kg (is it weight_kg?)"]),
        ("kind = 'continuous'", &["is none of revolute, prismatic, fixed; write \"revolute\""]),
        ("[data.format]\ndecimal = 'comma'", &["is none of \".\", \",\"; write \",\""]),
        ("[parameters]\n'joint1.a' = { free = true, low_mm = 2 }", &["did you mean min_mm?"]),
        ("stiffness_N_m_per_rad = inf", &["for a rigid part leave the key out"]),
        ("[data]\nheld_out = { fraction = 0 }", &["held_out = \"none\" fits all rows"]),
        ("[data]\nheld_out = 'split'", &["{ column = \"split\" } if a column of this name"]),
    ]);
}

#[test]
fn brackets_lists_and_bare_words_are_named() {
    check_problems(&[
        ("a_m = 1\n[[joint.beam]]\nname = 'A'", &["in single brackets, [joint.beam]"]),
        ("[[tool]]\n[[tool]]", &["write its header in single brackets, [tool], and keep one"]),
        ("[[body]]\nmass_kg = 1", &[":3: body: ", "write its header as [[joint.body]]"]),
        ("kind = fixed", &["text without quotes, near `fixed`; text stands in quotes"]),
        ("name = nan_x", &["text without quotes"]),
        ("[data]\nfiles = [rows.csv]", &["text without quotes"]),
        ("[parameters]\n'base.*' = free", &["write { free = true } to free parameters"]),
        ("[parameters]\n'base.*' = { free }", &["write { free = true } to free parameters"]),
        ("[data]\nheld_out = { fraction: 0.3 }", &["a colon in place of =; write key = value"]),
        ("a_m: 0.3", &["a colon in place of =; write key = value"]),
        ("[data]\nfiles = 'a.csv', 'b.csv'", &["write a list in brackets"]),
        ("a_m = 0.1, 0.2", &["several values or keys on one line"]),
        ("[data.columns]\nX [mm] = 'x_mm'", &["a key with a space"]),
        ("name = \"elbow", &["a quote is opened and not closed"]),
        ("[[effect]]\nbacklash = { joint 1 }", &["a key without =; write key = value"]),
        ("a_m = [0.3]", &["found a list; write a_m = 0.3"]),
        ("name = ['elbow']", &["found a list; write name = \"elbow\""]),
        ("[[effect]]\nbacklash = 'joint1'", &["write backlash = { joint = 1 }"]),
        ("[[effect]]\nbacklash = { joints = [1, 2] }", &["write an [[effect]] for each of them"]),
        ("[[effect]]\nbacklash = { joint = [1, 2] }", &["with joint = 1 and joint = 2"]),
        (
            "a_m = 1\n[joint.beam]\nname = 'A'\n[[effect]]\nlink-bending = { link = 'A' }",
            &["link: does not belong here: write joint = 1, the joint of beam \"A\""],
        ),
    ]);
}

#[test]
fn other_names_of_columns_lead_to_the_same_joint() {
    let two = format!("{ARM}[[joint]]\n");
    for theirs in ["joint1_deg", "j1_deg", "axis1_deg", "A1", "theta1"] {
        let map = format!("{two}[data.columns]\n'J' = '{theirs}'\n");
        let error = table_error(&parse(&map), "J,q2_deg,x_mm,y_mm,z_mm\n1,1,1,2,3\n");
        check(&error, theirs, &["problem.toml:5: ", "(did you mean q1_deg?)"]);
    }
}

#[test]
fn files_and_folders_that_are_not_quite_right_are_named() {
    let error = crate::common::reading::problem_error("{\\rtf1\\ansi\nname = 'arm'}");
    check(&error, "rtf", &[":1: rich text (RTF), not TOML", "save the file as plain text"]);
    let folder = Folder::with([("arm/problem.toml", ARM)]);
    let error = Problem::read(&folder.path("")).unwrap_err();
    check(&error, "folder", &["no such file; there is ", "arm/problem.toml: give "]);
    folder.write("arm.zip", b"PK\x03\x04");
    let error = Problem::read(&folder.path("arm.zip")).unwrap_err();
    check(&error, "zip", &["unpack an archive and give its folder"]);
}
