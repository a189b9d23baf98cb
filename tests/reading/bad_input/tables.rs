//! Errors in tables of measurements.

use super::reading::{ARM, check, table};

#[test]
fn headers() {
    let headers: [(&str, &[&str]); 33] = [
        ("", &["rows.csv:1: the file is empty"]),
        ("\n\n", &["rows.csv:1: the file is empty"]),
        ("10,1.5,2,3\n20,1,2,3\n", &["rows.csv:1: the first line holds numbers"]),
        (
            "q0_deg,x_m,y_m,z_m\n1,2,3,4\n",
            &["rows.csv:1: column q0_deg: the numbers of joints in column names begin with 1"],
        ),
        ("q1_deg,x_m,y_m,z_m\n", &["rows.csv:1: no rows below the header"]),
        ("x_m,y_m,z_m\n1,2,3\n", &["rows.csv:1: column q1: missing; add q1_deg or q1_rad"]),
        (
            "J1,X,Y,Z\n1,2,3,4\n",
            &[
                "columns are missing: q1, x, y, z; ",
                "columns = { \"J1\" = \"q1_deg\", \"X\" = \"x_mm\"",
            ],
        ),
        ("q1 [deg],x_m,y_m,z_m\n1,2,3,4\n", &["(is it column q1 [deg]? [data.columns] maps it"]),
        (
            "x_m,y_m,z_m\n1,2,3\n",
            &[
                "add q1_deg or q1_rad, or, if another table holds the joints, write joints = { files",
            ],
        ),
        (
            "q1_deg,pose\n1,2\n",
            &["rows.csv:1: the table has poses and no measurement; measure these poses, then add"],
        ),
        (
            "[{\"q1\":1,\"x\":2}]\n",
            &["rows.csv:1: a JSON file, not a table; save or export it as CSV"],
        ),
        ("{\n\"q1\": 1}\n", &["rows.csv:1: a JSON file, not a table"]),
        ("<!DOCTYPE html>\n<html><head>\n", &["rows.csv:1: an HTML page, not a table"]),
        ("---\nq1: 1\n", &["rows.csv:1: a YAML file, not a table"]),
        ("name: arm\nq1: 1\n", &["rows.csv:1: a YAML file, not a table"]),
        ("# From arm.urdf\nname = \"arm\"\n", &["rows.csv:2: a TOML file, not a table"]),
        (
            "q1_deg,x_cm,y_in,z_in\n",
            &[
                "rows.csv:1: column x_cm: a length is not given in cm; write x_m or x_mm, and convert \
                 the numbers: 1 cm is 10 mm",
            ],
        ),
        ("q1_deg,x_cm,y_cm,z_cm\n", &["column x_cm: ", "1 cm is 10 mm"]),
        ("q1_deg,x_um,y_um,z_um\n", &["column x_um: ", "1 um is 0.001 mm"]),
        ("q1_grad,x_m,y_m,z_m\n", &["column q1_grad: an angle is not given in grad", "is 0.9 deg"]),
        ("q1_deg,x_m,z_m\n1,2,3\n", &["rows.csv:1: column y: missing; add y_m or y_mm"]),
        (
            "q1_deg,X_mm,y_m,z_m\n",
            &["rows.csv:1: column x: missing; add x_m or x_mm (is it column X_mm?)"],
        ),
        (
            "q1deg,x_m,y_m,z_m\n",
            &["rows.csv:1: column q1: missing; add q1_deg or q1_rad (is it column q1deg?)"],
        ),
        (
            "q1,x_m,y_m,z_m\n",
            &["rows.csv:1: column q1: an angle needs a unit; write q1_deg or q1_rad"],
        ),
        ("q1_mm,x_m,y_m,z_m\n", &["rows.csv:1: column q1_mm: an angle is not given in mm"]),
        ("\nq1_deg,x,y_m,z_m\n", &["rows.csv:2: column x: a length needs a unit"]),
        ("q1_deg,x_m,x_mm,y_m,z_m\n", &["rows.csv:1: column x_mm: given already as column x_m"]),
        ("q1_deg,x_m,y_m,z_m,y_m\n", &["rows.csv:1: column y_m: given already"]),
        ("q1_deg,x_m,y_m,z_m,note,note\n", &["rows.csv:1: column note: given already"]),
        (
            "q1_deg|x_m|y_m|z_m\n",
            &[
                "rows.csv:1: the columns are separated by '|'; write delimiter = \"|\" in [data.format]",
            ],
        ),
        ("q1_deg,x_m,y_m,z_m,sigma\n", &["rows.csv:1: column sigma: a length needs a unit"]),
        (
            "q1_deg,x_m,y_m,z_m,sigma_deg\n",
            &["rows.csv:1: column sigma_deg: a length is not given in deg"],
        ),
        ("q1_deg,x_m,y_m,z_m,rx_mm\n", &["rows.csv:1: column rx_mm: an angle is not given in mm"]),
    ];
    for (text, words) in headers {
        check(&table(ARM, text.as_bytes()).expect_err(text), text, words);
    }
    for (header, words) in [
        (&b"q1_deg,\xff\xfe\n"[..], "rows.csv:1: the header is not UTF-8 text"),
        (b"\xff\xfeq\x001\x00\n\x00", "rows.csv:1: UTF-16 text"),
        (b"\xfe\xff\x00q\x001\x00\n", "rows.csv:1: UTF-16 text"),
        (b"q\x001\x00\n\x00", "rows.csv:1: the header is not UTF-8 text"),
    ] {
        let error = table(ARM, header).unwrap_err();
        check(&error, "binary header", &[words]);
        assert!(error.location.excerpt.is_none(), "what is not text is not shown");
    }
}

#[test]
fn a_name_that_joints_share_is_no_column() {
    let arm = "name = 'arm'\n[[joint]]\nname = 'wrist'\n[[joint]]\nname = 'wrist'\n[[joint]]\nname = 'hand'\n";
    let both = "several joints are called \"wrist\" (problem.toml:2, problem.toml:4); give each a \
                different name, or write q1_deg or q1_rad and q2_deg or q2_rad";
    for (header, words) in [
        ("wrist_deg,q2_deg,q3_deg,x_m,y_m,z_m\n", format!("rows.csv:1: column wrist_deg: {both}")),
        (
            "q1_deg,wrist_rad,hand_rad,x_m,y_m,z_m\n",
            format!("rows.csv:1: column wrist_rad: {both}"),
        ),
        ("q2_deg,q3_deg,x_m,y_m,z_m\n", "column q1: missing; add q1_deg or q1_rad".to_owned()),
        (
            "q1_deg,q2_deg,x_m,y_m,z_m\n",
            "column q3: missing; add q3_deg or q3_rad or hand_deg or hand_rad".to_owned(),
        ),
    ] {
        check(&table(arm, header.as_bytes()).expect_err(header), header, &[&words]);
    }
}

#[test]
fn rows() {
    let rows: [(&str, &[&str]); 31] = [
        ("abc,1,2,3,", &["rows.csv:3: column q1_deg: \"abc\" is not a number"]),
        ("1,\"1,5\",2,3,", &["rows.csv:3: column x_mm: \"1,5\" is not a number"]),
        ("1,\"1,874.5\",2,3,", &["column x_mm: \"1,874.5\" has separators of thousands"]),
        ("1.5°,1,2,3,", &["rows.csv:3: column q1_deg: \"1.5°\" is a number with a unit; remove °"]),
        (
            "1,−1.5,2,3,",
            &["x_mm: \"−1.5\" contains a typographic minus sign or dash (U+2212); write"],
        ),
        ("1,1\u{a0}5,2,3,", &["x_mm: ", "an invisible or no-break space (U+00A0); write a plain"]),
        ("q1_deg,x_mm,y_mm,z_mm,note", &["rows.csv:3: the header is repeated here"]),
        ("// second block", &["rows.csv:3: the row begins with //; if it is a comment, write"]),
        ("1,1,2,3,Test|split", &["two words of this column (is it validation?)"]),
        ("1,NaN,2,3,", &["rows.csv:3: column x_mm: \"NaN\" is not a number"]),
        ("1,1,inf,3,", &["rows.csv:3: column y_mm: inf is not a finite number"]),
        ("1,1,2,-1e999,", &["rows.csv:3: column z_mm: -1e999 is not a finite number"]),
        ("1,,2,3,", &["rows.csv:3: column x_mm: the cell is empty"]),
        ("1,2,3", &["rows.csv:3: the row has 3 fields, the header 5"]),
        // A title has more words than numbers, a row that was cut off has not.
        ("Page 2 of 3", &["rows.csv:3: the line begins with a word and has 1 cell, the header 5"]),
        ("P12,30.1", &["rows.csv:3: the row has 2 fields, the header 5"]),
        ("1,2,3,4,5,6", &["rows.csv:3: the row has 6 fields, the header 5; if its numbers have a"]),
        (",,,,", &["rows.csv:3: the row is empty; delete it"]),
        ("  ", &["rows.csv:3: the row is empty; delete it"]),
        ("1,2,3,\"4,5", &["rows.csv:3: a quote is opened and not closed"]),
        ("\0\0\0", &["rows.csv:3: the row has 1 fields"]),
        ("\0,1,2,3,", &["rows.csv:3: column q1_deg: \"\\u{0}\" is not a number"]),
        (
            "1,1,2,3,train|split",
            &["rows.csv:3: column split: \"train\" is neither identification nor validation"],
        ),
        ("1,1,2,3,|split", &["rows.csv:3: column split: the cell is empty"]),
        ("1,1,2,3,|session", &["rows.csv:3: column session: the cell is empty"]),
        ("1,1,2,3,|target", &["rows.csv:3: column target: the cell is empty"]),
        ("1,1,2,3,-1|payload_kg", &["rows.csv:3: column payload_kg: -1 is below zero"]),
        ("1,1,2,3,0|sigma_mm", &["rows.csv:3: column sigma_mm: 0 is not above zero"]),
        ("1,1,2,3,0.5|approach1", &["rows.csv:3: column approach1: 0.5 is not a direction"]),
        ("1,1,2,3,x|rx_deg", &["rows.csv:3: column rx_deg: \"x\" is not a number"]),
        ("1,1,2,3,noon|time_s", &["rows.csv:3: column time_s: \"noon\" is not a number"]),
    ];
    let valid = |column: &str| match column {
        "split" => "validation",
        _ => "1",
    };
    for (row, words) in rows {
        let (row, column) = row.split_once('|').unwrap_or((row, "note"));
        let text = format!("q1_deg,x_mm,y_mm,z_mm,{column}\n1,1,2,3,{}\n{row}\n", valid(column));
        check(&table(ARM, text.as_bytes()).expect_err(row), row, words);
    }
    let binary = b"q1_deg,x_mm,y_mm,z_mm,note\r\n1,1,2,3,\r\n1,1,2,\xc3\x28,\r\n";
    check(&table(ARM, binary).unwrap_err(), "binary row", &["rows.csv:3: column z_mm: not UTF-8"]);
    let binary = b"q1_deg,x_mm,y_mm,z_mm,note\r\n1,1,2,3,\xff\r\n";
    check(&table(ARM, binary).unwrap_err(), "binary note", &["rows.csv:2: column note: not UTF-8"]);
}

#[test]
fn splits() {
    let held_out = |text: &str| format!("{ARM}[data]\nheld_out = {{ {text} }}\n");
    let rows = |column: &str, words: [&str; 2]| {
        format!("q1_deg,x_m,y_m,z_m,{column}\n1,2,3,4,{}\n1,2,3,4,{}\n", words[0], words[1])
    };
    let column = held_out("column = 'split'");
    let session = held_out("session = 'D'");
    let place = "problem.toml:4: data.held_out: ";
    let cases: [(&str, String, &[&str]); 9] = [
        (
            &column,
            rows("note", ["", ""]),
            &["rows.csv:1: column split: missing", "problem.toml:4: data.held_out"],
        ),
        (
            &column,
            rows("split", ["validation"; 2]),
            &[place, "no rows are left to fit", "column split", "validation"],
        ),
        (
            &column,
            rows("split", ["identification"; 2]),
            &[place, "no rows are held out", "column split"],
        ),
        (
            &session,
            rows("session", ["A", "B"]),
            &[place, "no session is called \"D\"; there is A, B"],
        ),
        (&session, rows("note", ["A", "B"]), &[place, "no column session"]),
        (
            &session,
            rows("session", ["D", "D"]),
            &[place, "no rows are left to fit", "session \"D\""],
        ),
        (
            &held_out("fraction = 0.5"),
            rows("note", ["", ""]),
            &[place, "2 rows are of 1 joint configuration, too few"],
        ),
        (ARM, rows("note", ["", ""]), &["problem.toml: data: no held-out rows are declared"]),
        (ARM, rows("split", ["validation"; 2]), &["problem.toml: data: no rows are left to fit"]),
    ];
    for (problem, rows, words) in cases {
        check(&table(problem, rows.as_bytes()).expect_err(&rows), &rows, words);
    }
}
