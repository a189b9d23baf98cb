//! Files that flexcal wrote, files of spreadsheets, and values in the wrong unit.

use flexcal::error::{InputError, Warning, WarningKind};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

use crate::common::arms::parse;
use crate::common::program::{Folder, assert_contains};
use crate::common::reading::{
    assert_says, assert_warned, problem_error, read_dataset, read_tables, table_error, try_dataset,
    try_poses, try_table, words,
};

const ARM: &str = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n";
const MAP: &str = "[data.columns]\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n\
     'Z' = 'z_mm'\n'temp' = 'temperature_C'\n[data.format]\ndelimiter = ';'\ndecimal = ','\n";

/// Reads a table of measurements of the arm with a column map.
fn read(map: &str, text: &str) -> Result<(Measurements, Vec<Warning>), InputError> {
    try_table(&parse(&format!("{ARM}{map}")), text)
}

#[test]
fn tables_with_names_of_flexcal_are_read_whatever_the_map_says() {
    let plan = "pose,q1_deg,q2_deg\n1,10.5,-20.25\n";
    let (rows, warnings) = try_poses(&parse(&format!("{ARM}{MAP}")), plan).unwrap();
    assert!((rows.configuration(0)[1].to_degrees() + 20.25).abs() < 1e-12);
    assert_eq!(warnings, []);
    let measured = "q1_deg,q2_deg,x_mm,y_mm,z_mm\n10.5,-20.25,1.5,2,3\n";
    let (rows, warnings) = read(MAP, measured).unwrap();
    assert!((rows.positions[0].x - 1.5e-3).abs() < 1e-15);
    assert!(matches!(warnings[0].kind, WarningKind::MapUnused { .. }), "{warnings:?}");
    // Names of both kinds: the map wins, and names of flexcal fill the rest.
    let mixed = "X;x_mm;Y;Z;q1_deg;q2_deg;temp\n1,5;9;2;3;10,5;-20,25;20\n";
    let rows = read(MAP, mixed).unwrap().0;
    assert!((rows.positions[0].x - 1.5e-3).abs() < 1e-15 && rows.temperature.is_some());
    // A name that is missing is named where the table has others of the map.
    let error = read(MAP, "A1;A2;X;Y;Z\n1;2;3;4;5\n").unwrap_err();
    assert_eq!(error.location.key.as_deref(), Some("data.columns.temp"));
    assert_says(&error, &["no such column"]);
}

#[test]
fn tables_of_flexcal_are_read_where_others_have_spaces() {
    let map = "[data.format]\ndelimiter = 'spaces'\ndecimal = ','\n";
    let (rows, _) = try_poses(&parse(&format!("{ARM}{map}")), "q1_deg,q2_deg\n1.5,2\n").unwrap();
    assert!((rows.configuration(0)[0].to_degrees() - 1.5).abs() < 1e-12);
    let (rows, _) = read(map, "q1_deg q2_deg  x_mm y_mm z_mm\n1,5 2  3 4 5\n").unwrap();
    assert!((rows.configuration(0)[0].to_degrees() - 1.5).abs() < 1e-12);
}

#[test]
fn targets_need_not_have_the_measured_columns_of_the_map() {
    let targets = "A1;A2;X;Y;Z\n1;2;3;4;5\n";
    let (rows, _) = try_poses(&parse(&format!("{ARM}{MAP}")), targets).unwrap();
    assert!((rows.positions[0].z - 5e-3).abs() < 1e-15 && rows.temperature.is_none());
}

#[test]
fn numbers_have_the_declared_decimal_sign() {
    let table = "A1;A2;X;Y;Z;temp\n1,5;2;3;4;5;1.500\n";
    let error = read(MAP, table).unwrap_err();
    assert_says(&error, &[":2: column temp: \"1.500\" has a decimal point"]);
    assert!(read(MAP, &table.replace("1.500", "1,500")).is_ok());
}

#[test]
fn dates_may_begin_with_the_day() {
    let table = |time: &str| format!("q1_deg,q2_deg,x_mm,y_mm,z_mm,time\n1,2,3,4,5,{time}\n");
    let time = |text| read("", &table(text)).unwrap().0.time[0].to_bits();
    assert_eq!(time("31.05.2024 14:03:20"), time("2024-05-31T14:03:20"));
    assert_eq!(time("05/31/2024 02:03:20 PM"), time("2024-05-31T14:03:20"));
    let error = read("", &table("05/06/2024 14:03:20")).unwrap_err();
    assert_says(&error, &["day and month may stand in either order"]);
    let warnings = |text| words(&read("", &table(text)).unwrap().1);
    assert_contains(
        &warnings("05/06/2024 02:03:20 PM"),
        &["05/06/2024 02:03:20 PM is read month first, as 2024-05-06"],
    );
    assert_eq!(warnings("05/31/2024 02:03:20 PM"), "");
    // Dates of another column say nothing of the order in the times.
    let lot = table("05/06/2024 14:03:20")
        .replace("time\n1", "time,lot\n1")
        .replace(":20\n", ":20,13/02/24\n");
    let error = read("", &lot).unwrap_err();
    assert_says(&error, &["day and month may stand in either order"]);
    // Where decimals have commas, the day stands first.
    let table = |date: &str| format!("A1;A2;X;Y;Z;temp;time\n1,5;2;3;4;5;20;{date} 14:03:20\n");
    let (rows, warnings) = read(MAP, &table("09/11/2026")).unwrap();
    let (same, _) = read(MAP, &table("2026-11-09")).unwrap();
    assert_eq!(rows.time[0].to_bits(), same.time[0].to_bits());
    assert_contains(&words(&warnings), &["read day first, because numbers have decimal commas"]);
}

#[test]
fn words_that_spreadsheets_would_run_are_read_without_their_apostrophe() {
    let table = "q1_deg,q2_deg,x_mm,y_mm,z_mm,session\n1,2,-3,4,5,'=1+1\n1,2,3,4,5,-b\n";
    let rows = read("", table).unwrap().0;
    assert_eq!(rows.session.names, ["=1+1", "-b"]);
}

#[cfg(unix)]
#[test]
fn pipes_with_a_name_are_refused_at_once() {
    let folder = Folder::new();
    let pipe = folder.path("rows.csv");
    let status = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(status.success());
    let error = Measurements::read(std::slice::from_ref(&pipe), &parse(ARM)).unwrap_err();
    assert_says(&error, &["a FIFO, socket or device; give a regular file"]);
    assert_says(&Problem::read(&pipe).unwrap_err(), &["FIFO"]);
    std::fs::rename(&pipe, folder.path(".flexcal")).unwrap();
    assert!(flexcal::files::FolderRecord::read(&folder.path("")).is_err());
}

#[test]
fn values_in_another_unit_and_tables_in_another_form_are_asked_about() {
    let warned = |text: &str| parse(text).plausibility_warnings();
    let rows =
        "[[joint]]\nalpha_deg = -90\nd_m = 0.1\n[[joint]]\na_m = 0.4\n[[joint]]\nd_m = 0.1\n";
    let standard = warned(&format!("name = 'arm'\n{rows}"));
    assert_eq!(assert_warned(&standard, &WarningKind::LooksLikeStandardForm), Some(2));
    for form in ["modified", "standard"] {
        assert_eq!(warned(&format!("name = 'arm'\ndh = '{form}'\n{rows}")), []);
    }
    let radians = words(&warned(&format!("{ARM}alpha_deg = 1.5708\n")));
    assert!(radians.contains(":5: joint[2].alpha_deg: 1.5708 looks like radians of 90°"));
    let millimetres = WarningKind::LooksLikeMillimetres {
        value: "399.1".to_owned(),
        millimetres: "d_mm".to_owned(),
    };
    assert_eq!(assert_warned(&warned(&format!("{ARM}d_m = 399.1\n")), &millimetres), Some(5));
    assert_eq!(warned(&format!("{ARM}alpha_deg = 45.55\n")), []);
    assert_eq!(warned(&format!("{ARM}alpha_deg = 90.5\nd_m = 0.3991\n")), []);
    let wrong = problem_error("name = 'arm'\n[[joints]]\na_m = 1\n");
    assert_says(&wrong, &["did you mean joint?"]);
    let long = format!("{ARM}[parameters]\n'joint1.{}a' = {{ free = true }}\n", "*".repeat(600));
    assert_says(&problem_error(&long), &["characters in a pattern; at most 500"]);
}

/// Reads a tracker table that is joined to a log of joint coordinates.
fn joined(by: &str, tracker: &str, log: &str) -> Result<(Measurements, Vec<Warning>), InputError> {
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['controller.csv'], {by} }}\n\
         [data.columns]\n'Point' = 'pose'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_mm'\n"
    );
    let folder =
        Folder::with([("problem.toml", &text), ("tracker.csv", tracker), ("controller.csv", log)]);
    let problem = Problem::read(&folder.path("problem.toml"))?;
    Measurements::read(&problem.data.files, &problem)
}

#[test]
fn a_joint_log_is_joined_by_name_order_or_time() {
    let tracker = "Point;X;y_mm;z_mm;time_s\nP3;3;0;0;30.2\nP1;1;0;0;10.1\nP9;9;0;0;90\n";
    let log = "time_s,Point,A1,A2,note\n10,P1,11,-1,a\n20,P2,12,-2,b\n30,P3,13,-3,c\n";
    for (by, angles, is_log_left) in [
        ("by = 'name'", vec![13.0, 11.0], true),
        ("by = 'order'", vec![11.0, 12.0, 13.0], false),
        ("by = 'time', tolerance_s = 0.25", vec![13.0, 11.0], false),
    ] {
        let (rows, warnings) = joined(by, tracker, log).unwrap();
        let found: Vec<f64> =
            (0..rows.len()).map(|row| rows.configuration(row)[0].to_degrees().round()).collect();
        assert_eq!(found, angles, "{by}");
        let left: Vec<(String, Option<usize>)> = warnings
            .iter()
            .filter(|warning| {
                matches!(&warning.kind, WarningKind::WithoutPartner { rows: 1, others, .. }
                    if others.is_empty())
            })
            .map(|Warning { location, .. }| {
                let name = location.file.file_name().unwrap().to_string_lossy();
                (name.into_owned(), location.line)
            })
            .collect();
        let measured = (angles.len() < 3).then(|| ("tracker.csv".to_owned(), Some(4)));
        let logged = is_log_left.then(|| ("controller.csv".to_owned(), Some(3)));
        let mut expected: Vec<_> = measured.into_iter().chain(logged).collect();
        let mut left = left;
        left.sort();
        expected.sort();
        assert_eq!(left, expected, "{by}: {warnings:?}");
    }
    // A mistake in the log is named where it stands.
    let error = |tracker: &str, log: &str| joined("by = 'name'", tracker, log).unwrap_err();
    let wrong = error(tracker, &log.replace("11,", "x,"));
    assert_says(&wrong, &["controller.csv:2: column A1: \"x\" is not a number"]);
    let none = error(&tracker.replace("\nP", "\nQ"), log);
    assert_says(&none, &["no row of the measurements has a partner"]);
    let late = log.replace("\n10,", "\n50,").replace("\n30,", "\n70,");
    let late = joined("by = 'time', tolerance_s = 0.25", tracker, &late).unwrap_err();
    assert_says(&late, &["typically 10.2 s away", "whether both clocks agree"]);
    let rows = |shift: f64| (0..8).map(move |k| (f64::from(61 * k) + shift, k));
    let times = |shift| rows(shift).map(|(time, k)| format!("P{k};1;2;3;{time}\n"));
    let near = format!("Point;X;y_mm;z_mm;time_s\n{}", times(0.3).collect::<String>());
    let logged: Vec<String> = rows(0.0).map(|(time, k)| format!("{time},{k},0")).collect();
    let logged = format!("time_s,A1,A2\n{}\n", logged.join("\n"));
    let narrow = joined("by = 'time', tolerance_s = 0.001", &near, &logged).unwrap_err();
    assert_says(&narrow, &["tolerance_s is too small", "write tolerance_s = 0.60 in joints"]);
    let twice = error(tracker, &log.replace("P2", "P1"));
    assert_says(
        &twice,
        &["controller.csv:3: column Point: the pose P1 is already on line 2", "by = \"time\""],
    );
    let untimed = log.replace("time_s", "note2").replace("P2", "P1");
    assert!(!error(tracker, &untimed).to_string().contains("by = "));
    // Names that no measured row asks for may repeat.
    let stops = format!("{log}40,HOME,0,0,d\n50,HOME,0,0,e\n");
    let (rows, warnings) = joined("by = 'name'", tracker, &stops).unwrap();
    let unused = warnings.iter().filter_map(|warning| match &warning.kind {
        WarningKind::WithoutPartner { rows, .. } => Some(*rows),
        _ => None,
    });
    assert_eq!((rows.len(), unused.collect::<Vec<_>>()), (2, vec![1, 3]));
}

#[test]
fn clocks_that_differ_are_told_with_the_offset() {
    let times: Vec<f64> = (0..20).map(|k| f64::from(8 * k) + f64::from(k * k % 31) / 4.0).collect();
    let log = |times: &[f64]| {
        let row = |time: &f64| format!("{time},{},0\n", time / 9.0);
        format!("time_s,A1,A2\n{}", times.iter().map(row).collect::<String>())
    };
    let tracker = |shift: f64| {
        let row = |time: &f64| format!("P{time};1;2;3;{:.3}\n", time + shift);
        format!("Point;X;y_mm;z_mm;time_s\n{}", times.iter().map(row).collect::<String>())
    };
    let read = |by: &str, shift: f64| joined(by, &tracker(shift), &log(&times));
    let offset = "write offset_s = 47.0 in joints";
    let most = read("by = 'time', offset_s = 1", 47.0).unwrap_err();
    assert_says(&most, &["of 20 measured rows have no partner", offset]);
    let wide = read("by = 'time', tolerance_s = 60, offset_s = 1", 47.0).unwrap_err();
    assert_says(&wide, &["problem.toml", offset]);
    let far = read("by = 'time', tolerance_s = 9999, offset_s = 1", 3600.0).unwrap_err();
    assert_says(&far, &["20 of 20 measured rows have the same partner", "offset_s = 3600.0"]);
    for (by, shift, found) in [("", 47.0, "47.0"), (", tolerance_s = 9999", 3600.0, "3600.0")] {
        let (rows, warnings) = read(&format!("by = 'time'{by}"), shift).unwrap();
        assert_eq!(rows.len(), 20);
        assert_eq!(warnings.len(), 1);
        let found = format!("rows are paired with offset_s = {found}");
        assert!(warnings[0].to_string().contains(&found), "{}", warnings[0]);
    }
    let (rows, warnings) = read("by = 'time', offset_s = 47", 47.0).unwrap();
    assert_eq!((rows.len(), warnings), (20, Vec::new()));
    let thrice: Vec<f64> = times.iter().flat_map(|time| [time - 0.1, *time, time + 0.1]).collect();
    let many = joined("by = 'order'", &tracker(0.0), &log(&thrice)).unwrap_err();
    assert_says(&many, &["the joint table has 60 rows for 20 measured rows", "by = \"time\""]);
}

#[test]
fn times_that_contradict_the_order_or_have_no_seconds_are_named() {
    let logged = |k: usize| format!("{},{k},0\n", 60 * k + k % 3);
    let log = format!("time_s,A1,A2\n{}", (0..20).map(logged).collect::<String>());
    let tracker = |time: &dyn Fn(usize) -> usize| {
        let row = |k: usize| format!("P{k};1;2;{k};{}\n", time(k));
        format!("Point;X;y_mm;z_mm;time_s\n{}", (0..20).map(row).collect::<String>())
    };
    let warned = |time: &dyn Fn(usize) -> usize| {
        let (rows, warnings) = joined("by = 'order'", &tracker(time), &log).unwrap();
        assert_eq!(rows.len(), 20);
        words(&warnings)
    };
    assert_eq!(warned(&|k| 7200 + 60 * k + k % 4), "");
    assert_contains(
        &warned(&|k| 7200 + 60 * (k + k / 15) + 5),
        &[
            "tracker.csv:17: 4 rows are paired by order with rows of other times",
            "controller.csv:17",
        ],
    );
    let lost = joined("by = 'time', tolerance_s = 0.5", &tracker(&|k| 60 * k + 600), &log);
    assert_says(&lost.unwrap_err(), &["problem.toml", "the times of the measurements are whole"]);
}

#[test]
fn tables_that_are_paired_wrongly_are_refused_with_the_names() {
    let row = |k: usize, name: &str| format!("{name};{k};2;3\n");
    let tracker: String = (1..=9).map(|k| row(k, &format!("CAL_{k}"))).collect();
    let tracker = format!("Point;X;y_mm;z_mm\n{tracker}");
    let log = |name: fn(usize) -> String| {
        let rows: Vec<String> = (1..=9).map(|k| format!("{},{k},0\n", name(k))).collect();
        format!("Point,A1,A2\n{}", rows.concat())
    };
    let padded = joined("by = 'name'", &tracker, &log(|k| format!("Cal 0{k}"))).unwrap_err();
    assert_says(&padded, &["9 of 9 measured rows", "\"CAL_1\" and \"Cal 01\""]);
    let shifted = log(|k| format!("CAL_{}", k % 9 + 1));
    let order = joined("by = 'order'", &tracker, &shifted).unwrap_err();
    assert_says(&order, &["pairs \"CAL_1\" with \"CAL_2\"", "write by = \"name\""]);
    assert!(joined("by = 'name'", &tracker, &shifted).unwrap().1.is_empty());
    assert!(joined("by = 'order'", &tracker, &log(|k| format!("move {k}"))).is_ok());
}

#[test]
fn tables_without_a_header_keep_their_first_row() {
    let rules = "[data.columns]\n'#1' = 'q1_deg'\n'#2' = 'q2_deg'\n'#3' = 'x_mm'\n'#4' = 'y_mm'\n'#5' = 'z_mm'\n";
    let read = |table: &str| try_table(&parse(&format!("{ARM}{rules}")), table).unwrap().0.len();
    assert_eq!(read("1.5,2,3,4,5\n2,3,4,5,6\n"), 2);
    assert_eq!(read("a,b,c,d,e\n2,3,4,5,6\n"), 1);
    assert_eq!(read("0,1,2,3,4\n2,3,4,5,6\n"), 1);
    // A tracker table without a header, joined to a log with one.
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['log.csv'], by = 'name' }}\n\
         [data.columns]\n'#1' = 'pose'\n'#2' = 'x_mm'\n'#3' = 'y_mm'\n'#4' = 'z_mm'\n'Point' = 'pose'\n\
         'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n"
    );
    let log = "Point,A1,A2\nP1,11,-1\nP2,12,-2\n";
    let tracker = "P1,1.5,2,3\nP2,2.5,3,4\n";
    let folder =
        Folder::with([("problem.toml", &*text), ("tracker.csv", tracker), ("log.csv", log)]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let (rows, _) = Measurements::read(&problem.data.files, &problem).unwrap();
    assert_eq!(rows.positions.len(), 2);
}

#[test]
fn a_column_that_the_joint_log_lacks_is_missed_there() {
    let tracker = "Point;X;y_mm;z_mm\nP1;1;0;0\n";
    let lacks = joined("by = 'name'", tracker, "Point,A1\nP1,11\n").unwrap_err();
    assert_says(&lacks, &["columns.A2", "controller.csv has no such column", "\"A1\""]);
    let keyless = joined("by = 'time'", "time_s;X;y_mm;z_mm\n1;1;0;0\n", "Note,A1,A2\nP1,11,1\n");
    let said = keyless.unwrap_err();
    assert_says(
        &said,
        &["column time_s or time: missing", "flexcal does not know: Note; if it is"],
    );
}

#[test]
fn times_in_milliseconds_are_said() {
    let table = "q1_deg,q2_deg,x_mm,y_mm,z_mm,time_s\n1,2,3,4,5,1763042707000\n";
    let (_, warnings) = try_table(&parse(ARM), table).unwrap();
    let value = "1763042707000".to_owned();
    assert_eq!(assert_warned(&warnings, &WarningKind::LooksLikeMilliseconds { value }), Some(2));
}

#[test]
fn zeros_of_a_lost_target_are_refused_and_one_is_said() {
    let arm = parse(ARM);
    let table = |second: &str| {
        format!("q1_deg,q2_deg,x_mm,y_mm,z_mm\n1,2,300,1,2\n5,6,{second}\n7,8,0,0,0\n9,1,310,4,5\n")
    };
    let lost = table_error(&arm, &table("0,0.0,-0"));
    let expected = ["rows.csv:3: 2 rows of different poses measure exactly 0, 0, 0", "rows.csv:4"];
    assert_says(&lost, &expected);
    assert_says(&lost, &["write missing = \"0,0,0\" in [data.format]"]);
    let single = WarningKind::PositionZero { write: "0,0,0".to_owned() };
    let (_, warnings) = try_table(&arm, &table("305,0,0")).unwrap();
    assert_eq!(assert_warned(&warnings, &single), Some(4));
    let told = parse(&format!("{ARM}[data.format]\nmissing = '0,0,0'\n"));
    let (rows, _) = try_table(&told, &table("0,0.0,-0")).unwrap();
    assert_eq!(rows.len(), 2);
}

/// Reads a tracker table with a joint log whose columns have other names and another format.
#[test]
fn the_two_tables_of_a_join_may_name_their_columns_differently() {
    let tracker = "Zeit;X;Y;Z\n31.05.2024 14:03:20,1;1000,5;2;3\n31.05.2024 14:03:30;4;5;6\n";
    let log = "Timestamp,A1,A2\n2024-05-31T14:03:20,10.5,1\n2024-05-31T14:03:30,20.25,2\n";
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['controller.csv'], by = 'time' }}\n\
         [data.columns]\n'Zeit' = 'time'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n\
         'Timestamp' = 'time'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n[data.format]\ndecimal = ','\n"
    );
    let folder =
        Folder::with([("problem.toml", &text), ("tracker.csv", tracker), ("controller.csv", log)]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let (rows, warnings) = Measurements::read(&problem.data.files, &problem).unwrap();
    assert_eq!((rows.len(), warnings), (2, Vec::new()));
    assert!((rows.positions[0].x - 1.0005).abs() < 1e-12);
    assert!((rows.configuration(1)[0].to_degrees() - 20.25).abs() < 1e-9);
    assert!((rows.time[1] - rows.time[0] - 9.9).abs() < 1e-6);
}

#[test]
fn tables_in_latin_1_are_read_and_said() {
    let map = "'Winkel 1 (°)' = 'q1_deg'\n'Winkel 2 (°)' = 'q2_deg'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n\
               'Prüfer' = 'session'\n[data.format]\ndecimal = ','\n";
    let problem = parse(&format!("{ARM}[data.columns]\n{map}"));
    let text = "Winkel 1 (°);Winkel 2 (°);X;Y;Z;Prüfer\n1,5;2;3;4;5;Müller\n";
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let (rows, warnings) = read_tables(&problem, &[("rows.csv", latin)]).unwrap();
    assert_eq!((rows.len(), rows.session.names.as_slice()), (1, &["Müller".to_owned()][..]));
    let expected = "rows.csv:1: not UTF-8 text; read as Windows-1252";
    assert_contains(&words(&warnings), &[expected]);
    assert_eq!(try_table(&problem, text).unwrap().1, []);
}

#[test]
fn a_header_may_stand_behind_a_comment_mark_or_a_line_of_excel() {
    let rows = "q1_deg,q2_deg,x_mm,y_mm,z_mm";
    let values = "1.5,2,3,4,5\n";
    let commented = "[data.format]\ncomment = '//'\n";
    for (format, text) in [
        ("", format!("# made today\n# {rows}\n{values}")),
        ("", format!("//{rows}\n{values}")),
        ("", format!("% {}\n{}", rows.replace(',', " "), values.replace(',', " "))),
        (commented, format!("// SpatialAnalyzer\n// Units: mm\n// {rows}\n// A\n{values}// B\n")),
        ("", format!("\u{feff}# {rows}\n{values}")),
        (
            "[data.format]\ndecimal = ','\n",
            format!("sep=;\n{rows}\n{values}")
                .replace(',', ";")
                .replace('.', ",")
                .replace("sep=;\r", "sep=;"),
        ),
    ] {
        let (rows, warnings) = read(format, &text).expect(&text);
        assert_eq!((rows.len(), words(&warnings).as_str()), (1, ""), "{text}");
        assert!((rows.configuration(0)[0].to_degrees() - 1.5).abs() < 1e-9, "{text}");
    }
    // A commented-out header does not hide the one below.
    let (rows, _) =
        read("", "# x_mm,y_mm,z_mm,q1_deg,q2_deg\nq1_deg,q2_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n")
            .unwrap();
    assert!((rows.positions[0].x - 3e-3).abs() < 1e-12);
    let units = read("", "q1_deg,q2_deg,x_mm,y_mm,z_mm\ndeg,deg,mm,mm,mm\n1,2,3,4,5\n");
    assert_says(&units.unwrap_err(), &["rows.csv:2: column q1_deg: \"deg\" is a unit"]);
}

#[test]
fn columns_of_results_are_passed_over_in_silence() {
    let result = "file,line,q1_deg,q2_deg,x_mm,y_mm,z_mm,predicted_x_mm,sigma_x_mm,bound95_mm,extrapolated,reached\n\
                  a.csv,2,1,2,3,4,5,3,0.1,0.2,false,true\n";
    assert_eq!(read("", result).unwrap().1, []);
    let other = "q1_deg,q2_deg,x_mm,y_mm,z_mm,line,reached\n1,2,3,4,5,6,true\n";
    let said = words(&read("", other).unwrap().1);
    assert_contains(&said, &["column line: unknown", "column reached"]);
}

#[test]
fn more_sessions_than_can_be_fitted_are_refused_at_once() {
    let rows = |count: usize| -> String {
        let row = |k: usize| format!("{},{},1,2,3,s{k}\n", k % 90, k % 70);
        "q1_deg,q2_deg,x_mm,y_mm,z_mm,session\n".to_owned()
            + &(0..count).map(row).collect::<String>()
    };
    let table = rows(1000);
    let arm = |rule: &str| {
        parse(&format!(
            "{ARM}[parameters]\n'base.*' = {rule}\n[data]\nheld_out = {{ fraction = 0.3, seed = 1 }}\n"
        ))
    };
    let error = try_dataset(&arm("{ free = true }"), &table).unwrap_err();
    assert_says(&error, &["rows.csv: 1000 sessions, each with a base of its own; at most 150"]);
    let fixed = "{ fixed = true }\n'tool.*' = { fixed = true }";
    read_dataset(&arm(fixed), &table);
    let error =
        try_dataset(&arm("{ fixed = true }\n'tool.*' = { sigma_mm = 5 }"), &table).unwrap_err();
    assert_says(&error, &["rows.csv: 1000 sessions, each with a tool of its own; at most 500"]);
    // Rules of other parameters, and rules that a later one overrides, free no base.
    read_dataset(&arm("{ fixed = true }\n'*.theta' = { free = true }"), &table);
    read_dataset(&arm("{ free = true }\n'*' = { fixed = true }"), &table);
}
