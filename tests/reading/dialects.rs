//! Tables of other programs, read with a column map.

use flexcal::error::{InputError, WarningKind};
use flexcal::problem::Problem;
use nalgebra::Vector3;

use crate::common::arms::parse;
use crate::common::program::assert_contains;
use crate::common::reading::{
    assert_says, assert_warned, problem_error, read_table, read_tables, table_error, try_poses,
    try_table, words,
};

const ARM: &str = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n";

/// Report of a laser tracker: comments, decimal commas, missed shots, dates.
const TRACKER: (&str, &str) = (
    "'Collection::Group::Target' = 'pose'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'Timestamp' = 'time'\n\
     [data.format]\ncomment = '//'\ndecimal = ','\nmissing = '0,0,0'\n",
    "// Exported; units: mm, \"degrees\nCollection::Group::Target;X;Y;Z;A1;A2;Timestamp;RMS\nM::P::1;1500,25;-2,5;3;10,5;-20;2024-05-31T14:03:20Z;0,01\n\
     // lost the beam\nM::P::2;0,0;0;0;11;-21;2024-05-31T14:03:25Z;\nM::P::3;1,5e3;2;3;12;-22;2024-05-31 14:03:30.5;0,02\n",
);

/// Export of a motion capture system: lines above the header, repeated names, empty cells for a
/// lost body.
const CAPTURE: (&str, &str) = (
    "'Time (Seconds)' = 'time_s'\n'#7' = 'x_m'\n'#8' = 'y_m'\n'#9' = 'z_m'\n'joint_1' = 'q1_rad'\n'joint_2' = 'q2_rad'\n[data.format]\nmissing = ''\n",
    "Format Version,1.23,Take Name,arm,Capture Frame Rate,120.0\n\n,Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,,\n\
     ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,,\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z,joint_1,joint_2\n\
     0,0.0,0,0,0,1,1.5,-0.0025,0.003,0.18,-0.35\n1,0.008,,,,,,,,0.19,-0.36\n2,0.016,0,0,0,1,1.5,0.002,0.003,0.21,-0.38\n",
);

fn problem(map: &str) -> Problem {
    parse(&format!("{ARM}[data.columns]\n{map}"))
}

#[test]
fn exports_of_trackers_and_motion_capture_are_read() {
    for ((map, table), x) in [(TRACKER, 1.500_25), (CAPTURE, 1.5)] {
        assert!(map.lines().filter(|line| !line.starts_with('[')).count() < 11);
        let (rows, warnings) = try_table(&problem(map), table).unwrap();
        assert_eq!(rows.positions[0], Vector3::new(x, -0.0025, 0.003));
        assert_eq!(rows.len(), 2);
        assert!(
            (rows.configuration(1)[0] - 0.21).abs() < 1e-3
                && (rows.configuration(1)[1] + 0.382).abs() < 3e-3
        );
        assert_warned(&warnings, &WarningKind::RowsMissing { rows: 1 });
        let is_unmapped = |kind: &WarningKind| matches!(kind, WarningKind::Unmapped { .. });
        assert!(warnings.iter().any(|warning| is_unmapped(&warning.kind)), "{warnings:?}");
        assert!(rows.time_measured && rows.time[1] > rows.time[0]);
    }
    let rows = read_table(&problem(TRACKER.0), TRACKER.1);
    assert_eq!((rows.time[1] - rows.time[0], rows.origin[1].1), (10.5, 6));
}

#[test]
fn what_sets_columns_apart_is_found_or_said() {
    let plain = parse(ARM);
    for text in [
        "q1_deg;q2_deg;x_m;y_m;z_m\n1;2;3;4;5\n",
        "q1_deg\tq2_deg\tx_m\ty_m\tz_m\n1\t2\t3\t4\t5\n",
        "  q1_deg   q2_deg x_m  y_m z_m\n\n 1 2   3\t4 5 \n",
        "\u{feff}q1_deg; q2_deg; x_m; y_m; z_m\r\n1; 2; 3; 4; 5\r\n",
    ] {
        let rows = read_table(&plain, text);
        assert_eq!((rows.len(), rows.positions[0]), (1, Vector3::new(3.0, 4.0, 5.0)), "{text:?}");
    }
    let said = parse(&format!("{ARM}[data.format]\ndelimiter = '|'\n"));
    let rows = read_table(&said, "q1_deg|q2_deg|x_m|y_m|z_m\n1|2|3|4|5\n");
    assert_eq!(rows.positions[0], Vector3::new(3.0, 4.0, 5.0));
}

#[test]
fn sizes_that_no_arm_has_are_said() {
    let arm = |target: &str| parse(&format!("{ARM}[tool]\n{target}\n"));
    let said = |arm: &Problem, table: &str| words(&try_table(arm, table).unwrap().1);
    let table =
        |unit: &str| format!("q1_{unit},q2_{unit},x_m,y_m,z_m\n0.5,-1,0,0,0\n90,1.5,0,0,0\n");
    assert_contains(
        &said(&arm(""), &table("rad")),
        &["rows.csv:3: joint 1: q1_rad = 90 is 14 turns; if these are degrees"],
    );
    assert_eq!(said(&arm(""), &table("deg")), "");
    assert_contains(
        &said(&arm("target_m = [220, 0, -90]"), &table("deg")),
        &["problem.toml: tool.target: 237.697 m from the last frame", "0.500 m long"],
    );
    assert_eq!(said(&arm("target_mm = [220, 0, -90]"), &table("deg")), "");
    let body = |mass: f64, centre: f64| {
        parse(&format!("{ARM}[[joint.body]]\nmass_kg = {mass}\ncom_m = [{centre}, 0, 0]\n"))
    };
    assert_contains(
        &said(&body(6000.0, 180.0), &table("deg")),
        &["6000 kg is heavy", "180.000 m from the frame of its joint; if these are millimetres"],
    );
    assert_eq!(said(&body(6.0, 0.18), &table("deg")), "");
    // An unmapped column of the user.
    assert_contains(
        &said(&arm(""), "q1_deg,q2_deg,x_m,y_m,z_m,humidity\n1,2,3,4,5,40\n"),
        &["column humidity", "[data.covariates]"],
    );
    let warm = |of: f64| {
        said(
            &arm(""),
            &format!(
                "q1_deg,q2_deg,x_m,y_m,z_m,temperature_C\n1,2,3,4,5,{}\n1,3,3,4,5,{of}\n",
                of + 3.0
            ),
        )
    };
    assert_contains(
        &warm(293.0),
        &["rows.csv:3: temperature_C: all temperatures are 293 °C or more; if these are kelvins"],
    );
    assert_eq!(warm(20.0), "");
    // Positions in whole millimetres.
    let rounded = |step: &str, sigma: f64| {
        let problem = parse(&format!("{ARM}[data]\nposition_sigma_mm = {sigma}\n"));
        let row = |k: u32| {
            format!("{},{},{}{step},{},{}\n", 10 * (k % 7), 9 * k, 1000 + k, 3 * k, 500 - k)
        };
        let rows: Vec<String> = (0..12).map(row).collect();
        let table = format!("q1_deg,q2_deg,x_mm,y_mm,z_mm\n{}", rows.concat());
        words(&try_table(&problem, &table).unwrap().1)
    };
    assert_contains(&rounded("", 0.05), &["all positions are multiples of 1.0 mm", "by 0.29 mm"]);
    assert_eq!((rounded(".35", 0.05), rounded("", 0.2)), (String::new(), String::new()));
    // Times under the name of the temperature.
    assert_contains(
        &said(&arm(""), "q1_deg,q2_deg,x_m,y_m,z_m,temperature_C\n1,2,3,4,5,21\n1,3,3,4,5,6675\n"),
        &["rows.csv:3: temperature_C: 6675.0 °C is unusual for an arm"],
    );
}

#[test]
fn conditions_and_angles_in_another_unit_are_asked_about() {
    let said = |problem: &str, column: &str, value: f64| {
        let row = |k: u32| format!("{},{},1,2,3,{}\n", k % 7, k % 5, value + f64::from(k) / 8.0);
        let rows: String = (0..12).map(row).collect();
        let table = format!("q1_rad,q2_rad,x_m,y_m,z_m,{column}\n{rows}");
        words(&try_table(&parse(&format!("{ARM}{problem}")), &table).unwrap().1)
    };
    let cold = "[data]\nreference_temperature_C = 20\n";
    let hot = "[data]\nreference_temperature_C = 45\n";
    let hoist = |force: f64, direction: &str| {
        format!(
            "beam.name = 'A'\nbeam.EA_N = 1e7\nbeam.EIy_N_m2 = 1e4\nbeam.EIz_N_m2 = 1e4\n\
             beam.GJ_N_m2 = 1e4\n[joint.beam.hoist]\nat_m = [0.2, 0, 0]\nforce_N = {force}\n{direction}"
        )
    };
    let fahrenheit = "rows.csv:2: temperature_C: all temperatures are 65 °C or more";
    let kilograms = "rows.csv:2: hoist_N: the hoist forces are usually 6.75 N, and";
    let down = "problem.toml:3: beam A.hoist.direction: the hoist pulls downwards";
    for (problem, column, value, expected) in [
        (cold.to_owned(), "temperature_C", 65.0, fahrenheit),
        (cold.to_owned(), "temperature_C", 19.0, ""),
        (cold.to_owned(), "temperature_C", 49.5, ""),
        (hot.to_owned(), "temperature_C", 65.0, ""),
        (hoist(62.0, ""), "hoist_N", 6.0, kilograms),
        (hoist(62.0, ""), "hoist_N", 60.0, ""),
        (hoist(0.0, ""), "hoist_N", 6.0, ""),
        (hoist(62.0, "direction = [0, 0.1, -1]"), "hoist_N", 60.0, down),
    ] {
        let said = said(&problem, column, value);
        assert!(said.contains(expected), "{said}");
        assert_eq!(said.is_empty(), expected.is_empty(), "{column} {value}: {said}");
    }
    let angles = |widest: f64, rows: u32| {
        let row = |k: u32| format!("{},{},1,2,{k}\n", f64::from(k % 7) * widest / 6.0, k % 3);
        let table =
            format!("q1_deg,q2_deg,x_m,y_m,z_m\n{}", (0..rows).map(row).collect::<String>());
        words(&try_table(&parse(ARM), &table).unwrap().1)
    };
    assert_contains(
        &angles(3.0, 12),
        &[
            "rows.csv:8: joint 1: no joint turns by more than 3.0° from zero, and this row turns it most; if the columns are in radians or turns",
        ],
    );
    assert_eq!((angles(3.0, 8), angles(30.0, 12)), (String::new(), String::new()));
}

#[test]
fn the_name_of_a_file_may_be_a_session() {
    let table = "q1_deg,q2_deg,x_m,y_m,z_m\n1,2,3,4,5\n";
    let problem = problem("'#file' = 'session'\n");
    let rows = read_tables(&problem, &[("May.csv", table), ("June.csv", table)]).unwrap().0;
    assert_eq!(
        (rows.session.names, rows.session.of_row),
        (vec!["May".to_owned(), "June".to_owned()], vec![0, 1])
    );
}

#[test]
fn wrong_maps_are_named() {
    let table = "A1,A2,X,Y,Z,Z\n1,2,3,4,5,6\n";
    let good = "'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_m'\n'Y' = 'y_m'\n'#5' = 'z_m'\n";
    read_table(&problem(good), table);
    for (from, to, words) in [
        (
            "'A1'",
            "'A11'",
            &[
                "problem.toml:6: data.columns.A11",
                "has no such column (did you mean A1?)",
                "\"A1\", \"A2\"",
            ][..],
        ),
        (
            "'x_m'",
            "'x_meter'",
            &[
                "problem.toml:8: data.columns.X",
                "not a column of flexcal (did you mean x_m or x_mm?)",
            ],
        ),
        ("'x_m'", "'xx_mm'", &["problem.toml:8: data.columns.X: not a column of flexcal"]),
        (
            "'q2_deg'",
            "'q2'",
            &["problem.toml:7: data.columns.A2: an angle needs a unit; write q2_deg or q2_rad"],
        ),
        ("'q2_deg'", "'q3_deg'", &["problem.toml:7: data.columns.A2: not a column of flexcal"]),
        (
            "'#5'",
            "'Z'",
            &["problem.toml:10: data.columns.Z", "several columns with this name", "\"#6\""],
        ),
        ("'#5'", "'#9'", &["problem.toml:10", "has no such column"]),
        ("'#5' = 'z_m'", "'#4' = 'z_m'", &["problem.toml:10", "given already as column y_m"]),
        ("'z_m'", "'y_m'", &["problem.toml:10", "given already as column y_m"]),
    ] {
        let map = good.replacen(from, to, 1);
        assert_says(&table_error(&problem(&map), table), words);
    }
    let by_name = good.replace("#5", "Height");
    for (table, words) in [
        (
            "X,Y,Height\n1,2,3\n",
            ["columns.A1: ", "leave it out of files and write joints = { files"],
        ),
        (
            "A1,A2\n1,2\n",
            ["columns.X: ", "if these poses are still to be measured, measure them and"],
        ),
        (
            "q1_deg,q2_deg\n1,2\n",
            ["rows.csv:1: ", "measure these poses, then add the columns x_mm"],
        ),
    ] {
        assert_says(&table_error(&problem(&by_name), table), &words);
    }
    for (format, words) in [
        (
            "delimiter = '/'",
            "problem.toml:6: data.format.delimiter: \"/\" is none of \",\", \";\", \"|\"",
        ),
        (
            "delimiter = ','\ndecimal = ','",
            "problem.toml:7: data.format.decimal: a decimal comma needs another delimiter",
        ),
        (
            "comment = '1'",
            "problem.toml:6: data.format.comment: numbers can begin with \"1\" too, and their rows",
        ),
        ("comment = '-'", "problem.toml:6: data.format.comment: numbers can begin with \"-\" too"),
        (
            "decimals = ','",
            "problem.toml:6: data.format.decimals: unknown key (did you mean decimal?)",
        ),
    ] {
        let text = format!("{ARM}[data.format]\n{format}\n");
        assert_says(&problem_error(&text), &[words]);
    }
    let plain = parse(ARM);
    for (table, words) in [
        (
            "q1_deg;q2_deg;x_m;y_m;z_m\n1,5;2;3;4;5\n",
            "rows.csv:2: column q1_deg: \"1,5\" is not a number; if numbers have a decimal comma",
        ),
        (
            "PK\u{3}\u{4}...",
            "rows.csv: a ZIP archive or a workbook (XLSX, ODS), not a table; save or export it as CSV",
        ),
        (
            "q1_deg,q2_deg,x_m,y_m,z_m,time_s\n1,2,3,4,5,2024-05-31T25:00:00\n",
            "is neither a number nor a time such as",
        ),
    ] {
        assert_says(&table_error(&plain, table), &[words]);
    }
}

/// Returns the arm with two covariates, and the given lines after `[data.covariates]`.
fn with_covariates(rest: &str) -> Result<Problem, InputError> {
    let text = format!(
        "{ARM}[data.covariates]\n'tilt_deg' = 'tilt of the carriage'\n'oil' = 'pressure of the oil'\n{rest}"
    );
    Problem::parse(&text, std::path::Path::new("problem.toml"))
}

#[test]
fn covariates_of_ones_own_are_read_in_their_units() {
    let problem = with_covariates("").unwrap();
    let table = "q1_deg,oil,q2_deg,x_m,y_m,z_m,tilt_deg\n1,100,2,3,4,5,-0.5\n2,101,2,3,4,5,0.25\n";
    let (rows, warnings) = try_table(&problem, table).unwrap();
    assert_eq!(warnings, []);
    assert_eq!(
        (rows.covariates_of(0), rows.covariates_of(1)),
        (&[-0.5, 100.0][..], &[0.25, 101.0][..])
    );
    assert_eq!(rows.select(&[1]).covariates, [0.25, 101.0]);
    assert_eq!(rows.conditions(1).covariates, [0.25, 101.0]);
}

#[test]
fn wrong_covariates_are_named() {
    let problem = with_covariates("").unwrap();
    for (table, words) in [
        (
            "q1_deg,q2_deg,x_m,y_m,z_m,tilt_deg,oill\n1,2,3,4,5,0,0\n",
            "rows.csv:1: column oil: missing",
        ),
        (
            "q1_deg,q2_deg,x_m,y_m,z_m,tilt_deg,oil\n1,2,3,4,5,0,hot\n",
            "rows.csv:2: column oil: \"hot\" is not a number",
        ),
    ] {
        assert_says(&table_error(&problem, table), &[words]);
    }
    // Poses need a covariate only where an effect follows it.
    let poses = "q1_deg,q2_deg\n1,2\n";
    assert!(try_poses(&problem, poses).is_ok());
    let used = with_covariates("[[effect]]\ncovariate = { joint = 2, of = 'oil' }\n").unwrap();
    let error = try_poses(&used, poses).unwrap_err();
    assert_says(&error, &["rows.csv:1: column oil: missing"]);
    for (rest, words) in [
        (
            "'a,b' = 'x'\n",
            "problem.toml:8: data.covariates.\"a,b\": \"a,b\" cannot name a covariate",
        ),
        (
            "[[effect]]\ncovariate = { joint = 2, of = 'oile' }\n",
            "problem.toml:9: effect[1].covariate: no covariate is called \"oile\"",
        ),
        (
            "[[effect]]\ncovariate = { joint = 2, base = true, of = 'oil' }\n",
            "write either joint = … or base = true",
        ),
        (
            "[[effect]]\ncovariate = { base = false, of = 'oil' }\n",
            "write either joint = … or base = true",
        ),
        ("[[effect]]\ncovariate = { of = 'oil' }\n", "effect[1].covariate.joint: missing"),
        ("[[effect]]\ncovariate = { joint = 2 }\n", "effect[1].covariate.of: missing"),
    ] {
        assert_says(&with_covariates(rest).unwrap_err(), &[words]);
    }
    let taken = parse(&format!("{ARM}[data.covariates]\n'time_s' = 'x'\n"));
    let error = table_error(&taken, "q1_deg,q2_deg,x_m,y_m,z_m,time_s\n1,2,3,4,5,6\n");
    assert_says(&error, &["problem.toml:6: data.covariates.time_s: \"time_s\" cannot name"]);
}

#[test]
fn fixed_points_are_read_like_shots_of_the_arm() {
    let header = "q1_deg,q2_deg,x_m,y_m,z_m,nest,sigma_mm,session\n";
    let body = "1,2,3,4,5,,0.1,A\n,,1,2,3,N1,0.2,A\n,,0,0,0,N1,0.2,A\n";
    let map = format!("{ARM}[data.format]\nmissing = '0,0,0'\n");
    let (rows, warnings) = try_table(&parse(&map), &(header.to_owned() + body)).unwrap();
    let [nest] = rows.nests.as_slice() else { panic!("{:?}", rows.nests) };
    assert_eq!((nest.session.as_str(), nest.sigma), ("A", Some(0.2e-3)));
    assert_warned(&warnings, &WarningKind::RowsMissing { rows: 1 });

    // The file name is the session of fixed points, too.
    let named = format!("{ARM}[data.columns]\n'#file' = 'session'\n");
    let table = "q1_deg,q2_deg,x_m,y_m,z_m,nest\n1,2,3,4,5,\n,,1,2,3,N1\n";
    let files = [("A.csv", table), ("B.csv", table)];
    let (rows, _) = read_tables(&parse(&named), &files).unwrap();
    assert_eq!(rows.nests.iter().map(|nest| nest.session.as_str()).collect::<Vec<_>>(), ["A", "B"]);

    let plain = parse(ARM);
    let alone = table_error(&plain, "q1_deg,q2_deg,x_m,y_m,z_m,nest\n,,1,2,3,N1\n");
    assert_says(&alone, &["rows.csv: every row measures a fixed point"]);
}

#[test]
fn names_of_poses_are_kept_as_they_are() {
    let plain = parse(ARM);
    let table = |names: [&str; 3]| {
        let rows = names.map(|name| format!("1,2,3,4,5,{name}\n")).concat();
        read_table(&plain, &("q1_deg,q2_deg,x_m,y_m,z_m,pose\n".to_owned() + &rows))
    };
    assert_eq!(table(["1", "2", "2"]).pose, Some(vec![1.0, 2.0, 2.0]));
    let named = table(["1", "P2", "P2"]);
    let names = named.pose_names.unwrap();
    assert_eq!(
        (named.pose, names.names, names.of_row),
        (None, vec!["1".to_owned(), "P2".to_owned()], vec![0, 1, 1])
    );
}

#[test]
fn a_lost_position_takes_no_contact_with_it() {
    let arm = format!(
        "{ARM}[[point]]\nname = 'socket'\n[data]\nposition_sigma_mm = 0.1\npoint_sigma_mm = 0.1\n"
    );
    let arm = parse(&format!("{arm}[data.format]\nmissing = '0,0,0'\n"));
    let table = "q1_deg,q2_deg,x_m,y_m,z_m,point\n1,2,3,4,5,\n1,3,0,0,0,\n1,4,0,0,0,socket\n1,5,,,,socket\n1,6,,,,socket\n";
    let (rows, warnings) = try_table(&arm, table).unwrap();
    let kinds: Vec<&str> = (0..rows.len()).map(|row| rows.observation(row).kind()).collect();
    assert_eq!(kinds, ["position", "point", "point", "point"]);
    assert_warned(&warnings, &WarningKind::RowsMissing { rows: 1 });
}

/// Table below two lines of text, with unusual column names.
const UNDER_WORDS: &str =
    "Tracker 7 of hall 2\nA,B\njoint_1,joint_2,Target X,y_mm,z_mm\n1,2,3,4,5\n";

#[test]
fn the_entry_of_a_map_that_is_misspelt_is_to_blame_and_no_other() {
    let joints = "\"joint_1\" = \"q1_deg\"\n\"joint_2\" = \"q2_deg\"\n";
    let right = format!("{joints}\"Target X\" = \"x_mm\"");
    let assert_blamed = |map: &str, words: &[&str]| {
        assert_says(&table_error(&problem(map), UNDER_WORDS), words);
    };
    read_table(&problem(&right), UNDER_WORDS);
    // The header is found by the correct names.
    assert_blamed(
        &right.replace("Target X", "Traget X"),
        &["data.columns.\"Traget X\"", "did you mean Target X?"],
    );
    // A name that the table already contains.
    assert_blamed(
        &right.replace("\"x_mm\"", "\"y_mm\""),
        &["data.columns.\"Target X\": the table has another column y_mm", "lacks x_m or x_mm"],
    );
    // A name that another entry already has.
    assert_blamed(
        &right.replace("\"q2_deg\"", "\"q1_deg\""),
        &["data.columns.joint_2: given already as column q1_deg (joint_1)"],
    );
}

#[test]
fn a_misspelt_joint_of_a_map_does_not_put_the_blame_on_another() {
    let arm = "name = 'arm'\n[[joint]]\nkind = 'fixed'\n[[joint]]\na_m = 1\n[[joint]]\na_m = 1\n[data.columns]\n\
               \"first\" = \"q1_deg\"\n\"second\" = \"p2_deg\"\n";
    let problem = parse(arm);
    let error = table_error(&problem, "first,second,x_mm,y_mm,z_mm\n1,2,3,4,5\n");
    assert_says(&error, &["data.columns.second: not a column of flexcal"]);
}

#[test]
fn times_that_are_no_dates_are_named_with_what_is_expected() {
    let table = "q1_deg,q2_deg,x_mm,y_mm,z_mm,when\n1,2,3,4,5,31/31/2024 14:00\n";
    let warnings = try_table(&problem(""), &table.replace("when", "time")).unwrap().1;
    let kind =
        WarningKind::NotADate { value: "31/31/2024 14:00".to_owned(), write: "time_s".to_owned() };
    assert_warned(&warnings, &kind);
    assert_contains(
        &words(&warnings),
        &["column time: \"31/31/2024 14:00\" is not a date and time such as 2024-05-31T14:03"],
    );
    // A column named in the map is used.
    let map = "\"when\" = \"time\"\n\"q1_deg\" = \"q1_deg\"";
    assert_says(
        &table_error(&problem(map), table),
        &["rows.csv:2: column when: \"31/31/2024 14:00\" is neither a number nor a time"],
    );
}
