//! Values whose meaning is clear though they are not read: the message says what to write.

use super::reading::{check, check_problems, problem, table};
use crate::common::reading::problem_error;

#[test]
fn values_of_another_type_are_shown_as_they_are_written() {
    check_problems(&[
        ("d_m = '0.36'", &["joint[1].d_m: ", "stands without quotes: write d_m = 0.36"]),
        ("d_m = '0,36'", &["without quotes: write d_m = 0.36"]),
        ("d_m = '360 mm'", &["the value is the number alone: write d_mm = 360"]),
        ("alpha_deg = '90°'", &["the number alone: write alpha_deg = 90"]),
        ("d_m = 0.36 m", &[":3: not valid TOML: a unit behind a number", "write the number alone"]),
        ("alpha_deg = 90deg", &["a unit behind a number"]),
        ("alpha_deg = 90°", &["a degree sign (U+00B0)", "write the number alone"]),
        ("[tool]\ntarget_m = [0.1 m, 0, 0]", &[":4: not valid TOML: a unit behind a number"]),
        ("a_m =", &[":3: not valid TOML: the key has no value"]),
        ("[tool]\ntarget_m = [0.1 0 0]", &[":4: not valid TOML: numbers of a list without commas"]),
        (
            "[data]\nfiles = ['a.csv'\nposition_sigma_mm = 1",
            &[":4: not valid TOML: the list that begins here is not closed"],
        ),
        ("[tool]\ntarget_m = ['0.1', 0, 0]", &["tool.target_m[1]", "without quotes: write 0.1"]),
        ("[tool]\ntarget_m = '0, 0, 0.1'", &["write target_m = [0, 0, 0.1]"]),
        ("name = 'spin'\n[tool]\njoint = 'spin'", &["write joint = 1, the number of this joint"]),
        ("[tool]\njoint = 'nest'", &["write the number of the joint, counted from 1"]),
        ("min_deg = [-10, 20]", &["write min_deg = -10 and max_deg = 20"]),
        ("[parameters]\n'base.*' = { free = 1 }", &["found a number; write free = true"]),
        ("mimic = 2", &["write mimic = { joint = 2, ratio = 1 }"]),
        ("[[effect]]\ngear-ratio = 1", &["write gear-ratio = { joint = 1 }"]),
        ("[data]\nheld_out = { fraction = 30 %, seed = 1 }", &["a percentage", "write a fraction"]),
        ("[data]\nheld_out = { fraction = 30, seed = 1 }", &["write 0.3 for 30 %"]),
        (
            "[[effect]]\nlaw = { name = 'w', at = 'joint1', terms = 'sin(q1)', sigma_deg = 1 }",
            &["expected a list of formulas in quotes, found text; write terms = [\"sin(q1)\"]"],
        ),
        ("[data]\n'joint1.a' = { sigma_mm = 1 }", &["a rule for parameters; write it below"]),
        ("name = 3", &["expected text in quotes, found a number; write name = \"3\""]),
        ("[parameters]\n'joint1.a' = { free = 'yes' }", &["without quotes: write free = true"]),
        ("[data]\nfiles = 'a.csv'", &["write files = [\"a.csv\"]"]),
        (
            "a_m = 1\n[joint.beam]\nname = 'A'\n[[effect]]\nlink-thermal-bending = { link = 1 }",
            &["link: expected text in quotes", "the name of a beam, \"A\": write link = \"A\""],
        ),
        ("[data]\njoints = 'log.csv'", &["joints = { files = [\"log.csv\"], by = \"name\" }"]),
        ("[data]\njoints = ['log.csv']", &["another table of joints is joints = { files = "]),
        (
            "[tool]\n[parameters]\n'tool.*' = { sigma_mm = 1 }\n'tool.*' = { sigma_mm = 2 }",
            &[
                ":6: not valid TOML: duplicate key, given already on line 5",
                "delete one of the two",
            ],
        ),
    ]);
}

#[test]
fn usual_mistakes_of_syntax_are_named() {
    let quote = "the text that begins here is not closed";
    check_problems(&[
        ("d_m = 0.36;", &["a semicolon, near `;`; separate", "end a line without a sign"]),
        ("name = 'lift';", &["a semicolon; "]),
        ("[tool]\ntarget_m = [0.1; 0; 0]", &["a semicolon, near `0.1; 0; 0`"]),
        ("d_m = 0.36,", &[":3: not valid TOML: a comma at the end of the line; remove the comma"]),
        ("[tool]\ntarget_m = [0, 0, 0], # a", &["a comma at the end of the line"]),
        ("d_m = 0.36 // lift", &["TOML has no // comments: begin them with #"]),
        ("d_m = 0.36, // lift", &["TOML has no // comments"]),
        ("// lift", &["TOML has no // comments"]),
        ("[tool] // lift", &["TOML has no // comments"]),
        ("name = 'lift' /* a */", &["a comment of another language; TOML has no"]),
        ("beam = { mass_kg = 0,45, EA_N = 1 }", &["a decimal comma; write numbers with a decimal"]),
        ("d_m = .42", &["a number as TOML does not have it", "as in 0.42, 1.0 and 7"]),
        ("d_m = 1.", &["a number as TOML does not have it"]),
        ("d_m = 0O9", &["the letter O in a number, near `0O`; write the digit 0"]),
        ("d_m = 1 000", &["spaces within a number"]),
        ("d_m = 1,000.5", &["a comma between thousands; write 1000.5"]),
        ("d_m = 0,5", &["a decimal comma"]),
        ("d_m = 0.09 + 0.1", &["a calculation"]),
        ("d m = 0.1", &["a key with a space; join the words of a key by _, as in d_m"]),
        ("[tool]]", &["one ] too many"]),
        ("[tool]\ntarget_m = (0.1, 0, 0)", &[":4: not valid TOML: a list in round brackets"]),
        ("[data]\nheld_out = { fraction = , seed = 1 }", &["the key has no value"]),
        ("[data]\nfiles = ['a.csv'", &["a list, or a text in it, that is not closed"]),
        ("<<<<<<< HEAD\nd_m = 1", &[":3: not valid TOML: a mark of a conflict"]),
        ("d_m = 1\n=======\nd_m = 2\n>>>>>>> b", &[":4: not valid TOML: a mark of a conflict"]),
        (
            "[parameters]\n'base.*' = { sigma_mm = 1, # {\n\n'tool.*' = { free = true }",
            &[":4: not valid TOML: the { that stands here is not closed; write } at its end"],
        ),
        (
            "[tool]\ntarget_m = [0.1, 0, 0 # ]\n[data]\nfiles = ['a.csv']",
            &[":4: not valid TOML: the list that begins here is not closed"],
        ),
        ("[data]\nfiles = [\"a.csv]\nheld_out = 'none'", &[":4: not valid TOML: ", quote]),
    ]);
}

#[test]
fn keys_below_the_wrong_line_name_the_right_one() {
    check_problems(&[
        (
            "[data]\n[data.columns]\nheld_out = { fraction = 0.3 }",
            &[
                ":5: data.columns.held_out: does not belong here: ",
                "a key of [data], which the line [data.columns] ends; write it above that line",
            ],
        ),
        ("[data]\n[data.columns]\nposition_sigma_mm = 0.1", &["write it above that line"]),
        ("[data]\n[data.format]\nfiles = ['a.csv']", &["the line [data.format] ends"]),
        ("[data]\n[data.covariates]\njoints = { files = ['a.csv'] }", &["[data.covariates] ends"]),
        ("a_m = 1\n[joint.beam]\nname = 'A'\nmin_deg = 1", &["the line [joint.beam] ends"]),
        ("xyz_m = [0, 0, 1]", &["place a joint with kind = \"fixed\"", "flexcal init"]),
        ("[data]\nsigma_mm = 0.1", &["unknown key (did you mean position_sigma_mm or "]),
        ("[data]\nsigma = 0.1", &["did you mean position_sigma_mm or "]),
        (
            "[parameters]\n'joint1.a' = { sigma_percent = 30 }",
            &["not given in percent; write sigma_relative, here sigma_relative = 0.3"],
        ),
        (
            "[[effect]]\ntype = 'backlash'\njoint = 1",
            &["the name of the effect is its key: write backlash = { joint = 1 }"],
        ),
        ("[[effect]]\nbacklash = true\njoint = 1", &["joint is no effect: arguments of an effect"]),
        (
            "[[effect]]\nlaw = { name = 'a', at = 'joint1', terms = ['sin(A1)'] }",
            &["unknown word A1 (did you mean q1, the command of joint 1?)"],
        ),
    ]);
}

#[test]
fn cells_that_programs_write_otherwise_are_named() {
    const ARM: &str = "name = 'arm'\n[[joint]]\n";
    let cell = |cell: &str, words: &[&str]| {
        let rows = format!(
            "q1_deg,x_mm,y_mm,z_mm,split\n1,2,3,4,validation\n{cell},2,3,4,identification\n"
        );
        let error = table(ARM, rows.as_bytes()).unwrap_err();
        check(&error, cell, &["rows.csv:3: column q1_deg: "]);
        check(&error, cell, words);
    };
    for word in ["#DIV/0!", "#WERT!", "#REF!", "####", "Err:502", "#N/A"] {
        cell(word, &["is an error of a spreadsheet; correct its formula"]);
    }
    cell("(28.7328)", &["a negative number in parentheses; write -28.7328, or change the number"]);
    cell("28.73-", &["has its sign behind it; write -28.73"]);
    cell("'28.73", &["begins with an apostrophe", "write 28.73"]);
    cell("~28.73", &["has a sign of comparison before it; write 28.73"]);
    cell("50%", &["is a number with a unit; remove % from the cells"]);
    cell("28.73±0.1", &["has an uncertainty; write 28.73"]);
    cell("2.8*10^3", &["write 2.8e3"]);
    let empty = table(ARM, b"q1_deg,x_mm,y_mm,z_mm,split\n1,2,3,4,\n").unwrap_err();
    check(&empty, "split", &["rows.csv:2: column split: the cell is empty; write identification"]);
    let missing = table(ARM, "q1_deg,x_mm,y_mm,z_mm\n1,#N/A,3,4\n".as_bytes()).unwrap_err();
    check(&missing, "#N/A", &["write missing = \"#N/A\" in [data.format]"]);
    let other = table(ARM, b"q1_deg,x_mm,y_mm,z_mm\n1;2;3;4\n").unwrap_err();
    check(&other, "separator", &["this row are separated by ';', those of the header by ','"]);
    let sheet = table(ARM, b"date,operator,remark\n18.03.2025,Meier,good\n").unwrap_err();
    check(&sheet, "sheet", &["none of the columns needed is here (the table has date, operator, "]);
    check(&sheet, "sheet", &["Needed are q1_deg and what was measured, such as x_mm"]);
}

#[test]
fn remedies_of_types_can_be_followed() {
    for (text, followed) in [
        ("d_m = '360 mm'", "d_mm = 360"),
        ("[tool]\njoint = 'joint 1'", "[tool]\njoint = 1"),
        ("[[effect]]\ntype = 'backlash'\njoint = 1", "[[effect]]\nbacklash = { joint = 1 }"),
    ] {
        problem_error(&format!("name = 'arm'\n[[joint]]\n{text}\n"));
        problem(&format!("name = 'arm'\n[[joint]]\n{followed}\n")).unwrap();
    }
}
