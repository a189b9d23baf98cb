//! Tables of other programs, read with a column map.

use std::fs;
use std::path::Path;

use flexcal::error::{InputError, Warning};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;
use nalgebra::Vector3;

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
    Problem::parse(&format!("{ARM}[data.columns]\n{map}"), Path::new("problem.toml")).unwrap()
}

fn read(
    problem: &Problem,
    files: &[(&str, &str)],
) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = tempfile::tempdir().unwrap();
    let write = |(name, text): &(&str, &str)| {
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        file
    };
    Measurements::read(&files.iter().map(write).collect::<Vec<_>>(), problem)
}

#[test]
fn exports_of_trackers_and_motion_capture_are_read() {
    for ((map, table), x) in [(TRACKER, 1.500_25), (CAPTURE, 1.5)] {
        assert!(map.lines().filter(|line| !line.starts_with('[')).count() < 11);
        let (rows, warnings) = read(&problem(map), &[("export.csv", table)]).unwrap();
        assert_eq!(rows.positions[0], Vector3::new(x, -0.0025, 0.003));
        assert_eq!(rows.len(), 2);
        assert!(
            (rows.configuration(1)[0] - 0.21).abs() < 1e-3
                && (rows.configuration(1)[1] + 0.382).abs() < 3e-3
        );
        let words: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        assert!(words.iter().any(|word| word.contains("1 row without a measurement")), "{words:?}");
        assert!(words.iter().any(|word| word.contains("does not name are ignored")), "{words:?}");
        assert!(rows.time_measured && rows.time[1] > rows.time[0]);
    }
    let rows = read(&problem(TRACKER.0), &[("export.csv", TRACKER.1)]).unwrap().0;
    assert_eq!((rows.time[1] - rows.time[0], rows.origin[1].1), (10.5, 6));
}

#[test]
fn what_sets_columns_apart_is_found_or_said() {
    let plain = Problem::parse(ARM, Path::new("problem.toml")).unwrap();
    for text in [
        "q1_deg;q2_deg;x_m;y_m;z_m\n1;2;3;4;5\n",
        "q1_deg\tq2_deg\tx_m\ty_m\tz_m\n1\t2\t3\t4\t5\n",
        "  q1_deg   q2_deg x_m  y_m z_m\n\n 1 2   3\t4 5 \n",
        "\u{feff}q1_deg; q2_deg; x_m; y_m; z_m\r\n1; 2; 3; 4; 5\r\n",
    ] {
        let rows = read(&plain, &[("rows.csv", text)]).unwrap().0;
        assert_eq!((rows.len(), rows.positions[0]), (1, Vector3::new(3.0, 4.0, 5.0)), "{text:?}");
    }
    let said = Problem::parse(
        &format!("{ARM}[data.format]\ndelimiter = '|'\n"),
        Path::new("problem.toml"),
    )
    .unwrap();
    let rows = read(&said, &[("rows.csv", "q1_deg|q2_deg|x_m|y_m|z_m\n1|2|3|4|5\n")]).unwrap().0;
    assert_eq!(rows.positions[0], Vector3::new(3.0, 4.0, 5.0));
}

#[test]
fn sizes_that_no_arm_has_are_said() {
    let arm = |target: &str| {
        Problem::parse(&format!("{ARM}[tool]\n{target}\n"), Path::new("problem.toml")).unwrap()
    };
    let said = |arm: &Problem, table: &str| {
        let (_, warnings) = read(arm, &[("rows.csv", table)]).unwrap();
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
    };
    let table =
        |unit: &str| format!("q1_{unit},q2_{unit},x_m,y_m,z_m\n0.5,-1,0,0,0\n90,1.5,0,0,0\n");
    let words = said(&arm(""), &table("rad"));
    assert!(
        words.contains("rows.csv:3: joint 1: q1_rad = 90 is 14 turns; if these are degrees"),
        "{words}"
    );
    assert_eq!(said(&arm(""), &table("deg")), "");
    let words = said(&arm("target_m = [220, 0, -90]"), &table("deg"));
    assert!(
        words.contains("problem.toml: tool.target: 237.697 m from the last frame")
            && words.contains("0.500 m long"),
        "{words}"
    );
    assert_eq!(said(&arm("target_mm = [220, 0, -90]"), &table("deg")), "");
    // An unmapped column of the user.
    let words = said(&arm(""), "q1_deg,q2_deg,x_m,y_m,z_m,humidity\n1,2,3,4,5,40\n");
    assert!(words.contains("column humidity") && words.contains("[data.covariates]"), "{words}");
    let warm = |of: f64| {
        said(
            &arm(""),
            &format!(
                "q1_deg,q2_deg,x_m,y_m,z_m,temperature_C\n1,2,3,4,5,{}\n1,3,3,4,5,{of}\n",
                of + 3.0
            ),
        )
    };
    assert!(warm(293.0).contains(
        "rows.csv:3: temperature_C: all temperatures are 293 °C or more; if these are kelvins"
    ));
    assert_eq!(warm(20.0), "");
}

#[test]
fn the_name_of_a_file_may_be_a_session() {
    let table = "q1_deg,q2_deg,x_m,y_m,z_m\n1,2,3,4,5\n";
    let rows = read(&problem("'#file' = 'session'\n"), &[("May.csv", table), ("June.csv", table)])
        .unwrap()
        .0;
    assert_eq!(
        (rows.session.names, rows.session.of_row),
        (vec!["May".to_owned(), "June".to_owned()], vec![0, 1])
    );
}

#[test]
fn wrong_maps_are_named() {
    let table = "A1,A2,X,Y,Z,Z\n1,2,3,4,5,6\n";
    let good = "'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_m'\n'Y' = 'y_m'\n'#5' = 'z_m'\n";
    assert!(read(&problem(good), &[("rows.csv", table)]).is_ok());
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
        let error =
            read(&problem(&map), &[("rows.csv", table)]).map(|_| ()).expect_err(&map).to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{map}{error}");
    }
    for (format, words) in [
        ("delimiter = '/'", "problem.toml:6: data.format.delimiter: \"/\" is none of ,, ;, |"),
        (
            "delimiter = ','\ndecimal = ','",
            "problem.toml:7: data.format.decimal: a decimal comma needs another delimiter",
        ),
        (
            "decimals = ','",
            "problem.toml:6: data.format.decimals: unknown key (did you mean decimal?)",
        ),
    ] {
        let text = format!("{ARM}[data.format]\n{format}\n");
        let error = Problem::parse(&text, Path::new("problem.toml")).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let plain = Problem::parse(ARM, Path::new("problem.toml")).unwrap();
    for (table, words) in [
        (
            "q1_deg;q2_deg;x_m;y_m;z_m\n1,5;2;3;4;5\n",
            "rows.csv:2: column q1_deg: \"1,5\" is not a number; if numbers have a decimal comma",
        ),
        ("PK\u{3}\u{4}...", "rows.csv: an Excel workbook; save its sheet as CSV"),
        (
            "q1_deg,q2_deg,x_m,y_m,z_m,time_s\n1,2,3,4,5,2024-05-31T25:00:00\n",
            "is neither a number nor a time such as",
        ),
    ] {
        let error = read(&plain, &[("rows.csv", table)]).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

/// Returns the arm with two covariates, and the given lines after `[data.covariates]`.
fn with_covariates(rest: &str) -> Result<Problem, InputError> {
    let text = format!(
        "{ARM}[data.covariates]\n'tilt_deg' = 'tilt of the carriage'\n'oil' = 'pressure of the oil'\n{rest}"
    );
    Problem::parse(&text, Path::new("problem.toml"))
}

#[test]
fn covariates_of_ones_own_are_read_in_their_units() {
    let problem = with_covariates("").unwrap();
    let table = "q1_deg,oil,q2_deg,x_m,y_m,z_m,tilt_deg\n1,100,2,3,4,5,-0.5\n2,101,2,3,4,5,0.25\n";
    let (rows, warnings) = read(&problem, &[("rows.csv", table)]).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
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
        let error = read(&problem, &[("rows.csv", table)]).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let poses = tempfile::tempdir().unwrap();
    fs::write(poses.path().join("poses.csv"), "q1_deg,q2_deg\n1,2\n").unwrap();
    let files = [poses.path().join("poses.csv")];
    assert!(
        Measurements::read_poses(&files, &problem).is_ok(),
        "poses need a covariate only where an effect follows it"
    );
    let used = with_covariates("[[effect]]\ncovariate = { joint = 2, of = 'oil' }\n").unwrap();
    let error = Measurements::read_poses(&files, &used).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("poses.csv:1: column oil: missing"), "{error}");
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
        let error = with_covariates(rest).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let taken = Problem::parse(
        &format!("{ARM}[data.covariates]\n'time_s' = 'x'\n"),
        Path::new("problem.toml"),
    )
    .unwrap();
    let error = read(&taken, &[("rows.csv", "q1_deg,q2_deg,x_m,y_m,z_m,time_s\n1,2,3,4,5,6\n")])
        .map(|_| ())
        .unwrap_err();
    assert!(
        error
            .to_string()
            .contains("problem.toml:6: data.covariates.time_s: \"time_s\" cannot name"),
        "{error}"
    );
}

#[test]
fn fixed_points_are_read_like_shots_of_the_arm() {
    let header = "q1_deg,q2_deg,x_m,y_m,z_m,nest,sigma_mm,session\n";
    let body = "1,2,3,4,5,,0.1,A\n,,1,2,3,N1,0.2,A\n,,0,0,0,N1,0.2,A\n";
    let map = format!("{ARM}[data.format]\nmissing = '0,0,0'\n");
    let (rows, warnings) = read(
        &Problem::parse(&map, Path::new("problem.toml")).unwrap(),
        &[("A.csv", &(header.to_owned() + body))],
    )
    .unwrap();
    let [nest] = rows.nests.as_slice() else { panic!("{:?}", rows.nests) };
    assert_eq!((nest.session.as_str(), nest.sigma), ("A", Some(0.2e-3)));
    assert!(
        warnings.iter().any(|warning| warning.to_string().contains("1 row without a measurement")),
        "{warnings:?}"
    );

    // The file name is the session of fixed points, too.
    let named = format!("{ARM}[data.columns]\n'#file' = 'session'\n");
    let table = "q1_deg,q2_deg,x_m,y_m,z_m,nest\n1,2,3,4,5,\n,,1,2,3,N1\n";
    let files = [("A.csv", table), ("B.csv", table)];
    let (rows, _) =
        read(&Problem::parse(&named, Path::new("problem.toml")).unwrap(), &files).unwrap();
    assert_eq!(rows.nests.iter().map(|nest| nest.session.as_str()).collect::<Vec<_>>(), ["A", "B"]);

    let plain = Problem::parse(ARM, Path::new("problem.toml")).unwrap();
    let alone = read(&plain, &[("nests.csv", "q1_deg,q2_deg,x_m,y_m,z_m,nest\n,,1,2,3,N1\n")])
        .map(|_| ())
        .unwrap_err();
    assert!(alone.to_string().contains("nests.csv: every row measures a fixed point"), "{alone}");
}

#[test]
fn names_of_poses_are_kept_as_they_are() {
    let plain = Problem::parse(ARM, Path::new("problem.toml")).unwrap();
    let table = |names: [&str; 3]| {
        let rows = names.map(|name| format!("1,2,3,4,5,{name}\n")).concat();
        read(&plain, &[("rows.csv", &("q1_deg,q2_deg,x_m,y_m,z_m,pose\n".to_owned() + &rows))])
            .unwrap()
            .0
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
    let arm = Problem::parse(
        &format!("{arm}[data.format]\nmissing = '0,0,0'\n"),
        Path::new("problem.toml"),
    )
    .unwrap();
    let table = "q1_deg,q2_deg,x_m,y_m,z_m,point\n1,2,3,4,5,\n1,3,0,0,0,\n1,4,0,0,0,socket\n1,5,,,,socket\n1,6,,,,socket\n";
    let (rows, warnings) = read(&arm, &[("rows.csv", table)]).unwrap();
    let kinds: Vec<&str> = (0..rows.len()).map(|row| rows.observation(row).kind()).collect();
    assert_eq!(kinds, ["position", "point", "point", "point"]);
    assert!(
        warnings.iter().any(|warning| warning.to_string().contains("1 row without a measurement")),
        "{warnings:?}"
    );
}

/// Table below two lines of text, with unusual column names.
const UNDER_WORDS: &str =
    "Tracker 7 of hall 2\nA,B\njoint_1,joint_2,Target X,y_mm,z_mm\n1,2,3,4,5\n";

#[test]
fn the_entry_of_a_map_that_is_misspelt_is_to_blame_and_no_other() {
    let joints = "\"joint_1\" = \"q1_deg\"\n\"joint_2\" = \"q2_deg\"\n";
    let right = format!("{joints}\"Target X\" = \"x_mm\"");
    let error =
        |map: &str| read(&problem(map), &[("rows.csv", UNDER_WORDS)]).unwrap_err().to_string();
    read(&problem(&right), &[("rows.csv", UNDER_WORDS)]).unwrap();
    // The header is found by the correct names.
    let said = error(&right.replace("Target X", "Traget X"));
    assert!(
        said.contains("data.columns.\"Traget X\"") && said.contains("did you mean Target X?"),
        "{said}"
    );
    // A name that the table already contains.
    let said = error(&right.replace("\"x_mm\"", "\"y_mm\""));
    assert!(
        said.contains("data.columns.\"Target X\": the table has another column y_mm"),
        "{said}"
    );
    assert!(said.contains("lacks x_m or x_mm"), "{said}");
    // A name that another entry already has.
    let said = error(&right.replace("\"q2_deg\"", "\"q1_deg\""));
    assert!(
        said.contains("data.columns.joint_2: given already as column q1_deg (joint_1)"),
        "{said}"
    );
}

#[test]
fn a_misspelt_joint_of_a_map_does_not_put_the_blame_on_another() {
    let arm = "name = 'arm'\n[[joint]]\nkind = 'fixed'\n[[joint]]\na_m = 1\n[[joint]]\na_m = 1\n[data.columns]\n\
               \"first\" = \"q1_deg\"\n\"second\" = \"p2_deg\"\n";
    let problem = Problem::parse(arm, Path::new("problem.toml")).unwrap();
    let said = read(&problem, &[("rows.csv", "first,second,x_mm,y_mm,z_mm\n1,2,3,4,5\n")])
        .unwrap_err()
        .to_string();
    assert!(said.contains("data.columns.second: not a column of flexcal"), "{said}");
}

#[test]
fn times_that_are_no_dates_are_named_with_what_is_expected() {
    let table = "q1_deg,q2_deg,x_mm,y_mm,z_mm,when\n1,2,3,4,5,31/05/2024 14:00\n";
    let warnings = read(&problem(""), &[("rows.csv", &table.replace("when", "time"))]).unwrap().1;
    let said = warnings.iter().map(ToString::to_string).collect::<String>();
    for words in [
        "column time: \"31/05/2024 14:00\" is not a date and time such as 2024-05-31T14:03",
        "write time_s",
    ] {
        assert!(said.contains(words), "{said}");
    }
    // A column named in the map is used.
    let map = "\"when\" = \"time\"\n\"q1_deg\" = \"q1_deg\"";
    let said = read(&problem(map), &[("rows.csv", table)]).unwrap_err().to_string();
    assert!(
        said.contains(
            "rows.csv:2: column when: \"31/05/2024 14:00\" is neither a number nor a time"
        ),
        "{said}"
    );
}
