//! Files that flexcal wrote, files of spreadsheets, and values in the wrong unit.

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::error::{InputError, Warning};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;

const ARM: &str = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n";
const MAP: &str = "[data.columns]\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n\
     'Z' = 'z_mm'\n'temp' = 'temperature_C'\n[data.format]\ndelimiter = ';'\ndecimal = ','\n";

fn problem(text: &str) -> Problem {
    Problem::parse(text, Path::new("problem.toml")).unwrap()
}

fn read(map: &str, text: &str, measured: bool) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = tempfile::tempdir().unwrap();
    let files: Vec<PathBuf> = vec![folder.path().join("rows.csv")];
    fs::write(&files[0], text).unwrap();
    let problem = problem(&format!("{ARM}{map}"));
    if measured {
        Measurements::read(&files, &problem)
    } else {
        Measurements::read_poses(&files, &problem)
    }
}

fn words(warnings: &[Warning]) -> String {
    warnings.iter().flat_map(|warning| [warning.to_string(), "\n".to_owned()]).collect()
}

#[test]
fn tables_with_names_of_flexcal_are_read_whatever_the_map_says() {
    let plan = "pose,q1_deg,q2_deg\n1,10.5,-20.25\n";
    let (rows, warnings) = read(MAP, plan, false).unwrap();
    assert!((rows.configuration(0)[1].to_degrees() + 20.25).abs() < 1e-12);
    assert_eq!(words(&warnings), "");
    let measured = "q1_deg,q2_deg,x_mm,y_mm,z_mm\n10.5,-20.25,1.5,2,3\n";
    let (rows, warnings) = read(MAP, measured, true).unwrap();
    assert!((rows.positions[0].x - 1.5e-3).abs() < 1e-15);
    assert!(words(&warnings).contains("no column of"), "{}", words(&warnings));
    // Names of both kinds: the map wins, and names of flexcal fill the rest.
    let mixed = "X;x_mm;Y;Z;q1_deg;q2_deg;temp\n1,5;9;2;3;10,5;-20,25;20\n";
    let rows = read(MAP, mixed, true).unwrap().0;
    assert!((rows.positions[0].x - 1.5e-3).abs() < 1e-15 && rows.temperature.is_some());
    // A name that is missing is named where the table has others of the map.
    let lacking = "A1;A2;X;Y;Z\n1;2;3;4;5\n";
    let error = read(MAP, lacking, true).unwrap_err().to_string();
    assert!(error.contains("data.columns.temp") && error.contains("no such column"), "{error}");
}

#[test]
fn numbers_have_the_declared_decimal_sign() {
    let table = "A1;A2;X;Y;Z;temp\n1,5;2;3;4;5;1.500\n";
    let error = read(MAP, table, true).unwrap_err().to_string();
    assert!(error.contains(":2: column temp: \"1.500\" has a decimal point"), "{error}");
    assert!(read(MAP, &table.replace("1.500", "1,500"), true).is_ok());
}

#[test]
fn dates_may_begin_with_the_day() {
    let table = |time: &str| format!("q1_deg,q2_deg,x_mm,y_mm,z_mm,time\n1,2,3,4,5,{time}\n");
    let time = |text| read("", &table(text), true).unwrap().0.time[0].to_bits();
    assert_eq!(time("31.05.2024 14:03:20"), time("2024-05-31T14:03:20"));
}

#[test]
fn words_that_spreadsheets_would_run_are_read_without_their_apostrophe() {
    let table = "q1_deg,q2_deg,x_mm,y_mm,z_mm,session\n1,2,-3,4,5,'=1+1\n1,2,3,4,5,-b\n";
    let rows = read("", table, true).unwrap().0;
    assert_eq!(rows.session.names, ["=1+1", "-b"]);
}

#[cfg(unix)]
#[test]
fn pipes_with_a_name_are_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let pipe = folder.path().join("rows.csv");
    let status = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(status.success());
    let error =
        Measurements::read(std::slice::from_ref(&pipe), &problem(ARM)).unwrap_err().to_string();
    assert!(error.contains("a FIFO, socket or device; give a regular file"), "{error}");
    assert!(Problem::read(&pipe).unwrap_err().to_string().contains("FIFO"));
    fs::rename(&pipe, folder.path().join(".flexcal")).unwrap();
    assert!(flexcal::files::FolderRecord::read(folder.path()).is_err());
}

#[test]
fn values_in_another_unit_and_tables_in_another_form_are_asked_about() {
    let said = |text: &str| words(&problem(text).plausibility_warnings());
    let rows =
        "[[joint]]\nalpha_deg = -90\nd_m = 0.1\n[[joint]]\na_m = 0.4\n[[joint]]\nd_m = 0.1\n";
    let standard = said(&format!("name = 'arm'\n{rows}"));
    assert!(standard.contains("problem.toml:2: ") && standard.contains("dh = \"standard\""));
    for form in ["modified", "standard"] {
        assert_eq!(said(&format!("name = 'arm'\ndh = '{form}'\n{rows}")), "");
    }
    let radians = said(&format!("{ARM}alpha_deg = 1.5708\n"));
    assert!(radians.contains(":5: joint[2].alpha_deg: 1.5708 looks like radians of 90°"));
    let millimetres = said(&format!("{ARM}d_m = 399.1\n"));
    assert!(millimetres.contains("write d_mm = 399.1"), "{millimetres}");
    assert_eq!(said(&format!("{ARM}alpha_deg = 45.55\n")), "");
    assert_eq!(said(&format!("{ARM}alpha_deg = 90.5\nd_m = 0.3991\n")), "");
    let wrong = "name = 'arm'\n[[joints]]\na_m = 1\n";
    let error = Problem::parse(wrong, Path::new("problem.toml")).unwrap_err().to_string();
    assert!(error.contains("did you mean joint?"), "{error}");
    let long = format!("{ARM}[parameters]\n'joint1.{}a' = {{ free = true }}\n", "*".repeat(600));
    let error = Problem::parse(&long, Path::new("problem.toml")).unwrap_err().to_string();
    assert!(error.contains("characters in a pattern; at most 500"), "{error}");
}

/// Reads a tracker table that is joined to a log of joint coordinates.
fn joined(by: &str, tracker: &str, log: &str) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tracker.csv");
    fs::write(&file, tracker).unwrap();
    fs::write(folder.path().join("controller.csv"), log).unwrap();
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['controller.csv'], {by} }}\n\
         [data.columns]\n'Point' = 'pose'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n'X' = 'x_mm'\n"
    );
    let problem = Problem::parse(&text, &folder.path().join("problem.toml")).unwrap();
    Measurements::read(&[file], &problem)
}

#[test]
fn a_joint_log_is_joined_by_name_order_or_time() {
    let tracker = "Point;X;y_mm;z_mm;time_s\nP3;3;0;0;30.2\nP1;1;0;0;10.1\nP9;9;0;0;90\n";
    let log = "time_s,Point,A1,A2,note\n10,P1,11,-1,a\n20,P2,12,-2,b\n30,P3,13,-3,c\n";
    for (by, angles, unused) in [
        ("by = 'name'", vec![13.0, 11.0], 1),
        ("by = 'order'", vec![11.0, 12.0, 13.0], 0),
        ("by = 'time', tolerance_s = 0.25", vec![13.0, 11.0], 0),
    ] {
        let (rows, warnings) = joined(by, tracker, log).unwrap();
        let found: Vec<f64> =
            (0..rows.len()).map(|row| rows.configuration(row)[0].to_degrees().round()).collect();
        assert_eq!(found, angles, "{by}");
        let said = words(&warnings);
        let expected = usize::from(angles.len() < 3) + unused;
        assert_eq!(said.matches("without a partner").count(), expected, "{by}: {said}");
        assert_eq!(said.contains("tracker.csv:4: 1 row without"), angles.len() < 3, "{said}");
        assert_eq!(said.contains("controller.csv:3: 1 row without"), unused > 0, "{said}");
    }
    // A mistake in the log is named where it stands.
    let wrong = joined("by = 'name'", tracker, &log.replace("11,", "x,")).unwrap_err().to_string();
    assert!(wrong.contains("controller.csv:2: column A1: \"x\" is not a number"), "{wrong}");
    let none = joined("by = 'name'", &tracker.replace("\nP", "\nQ"), log).unwrap_err().to_string();
    assert!(none.contains("no row of the measurements has a partner"), "{none}");
    let late = log.replace("\n10,", "\n50,").replace("\n30,", "\n70,");
    let late = joined("by = 'time', tolerance_s = 0.25", tracker, &late).unwrap_err().to_string();
    assert!(late.contains("typically 10.2 s away; check whether both clocks agree"), "{late}");
    let twice = joined("by = 'name'", tracker, &log.replace("P2", "P1")).unwrap_err().to_string();
    assert!(twice.contains("controller.csv:3: column Point: the pose P1 is already on line 2"));
}

/// Reads a tracker table with a joint log whose columns have other names and another format.
#[test]
fn the_two_tables_of_a_join_may_name_their_columns_differently() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tracker.csv");
    fs::write(&file, "Zeit;X;Y;Z\n31.05.2024 14:03:20,1;1000,5;2;3\n31.05.2024 14:03:30;4;5;6\n")
        .unwrap();
    let log = "Timestamp,A1,A2\n2024-05-31T14:03:20,10.5,1\n2024-05-31T14:03:30,20.25,2\n";
    fs::write(folder.path().join("controller.csv"), log).unwrap();
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['controller.csv'], by = 'time' }}\n\
         [data.columns]\n'Zeit' = 'time'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n\
         'Timestamp' = 'time'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n[data.format]\ndecimal = ','\n"
    );
    let problem = Problem::parse(&text, &folder.path().join("problem.toml")).unwrap();
    let (rows, warnings) = Measurements::read(&[file], &problem).unwrap();
    assert_eq!((rows.len(), words(&warnings).as_str()), (2, ""));
    assert!((rows.positions[0].x - 1.0005).abs() < 1e-12);
    assert!((rows.configuration(1)[0].to_degrees() - 20.25).abs() < 1e-9);
    assert!((rows.time[1] - rows.time[0] - 9.9).abs() < 1e-6);
}

#[test]
fn tables_in_latin_1_are_read_and_said() {
    let map = "'Winkel 1 (°)' = 'q1_deg'\n'Winkel 2 (°)' = 'q2_deg'\n'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n\
               'Prüfer' = 'session'\n[data.format]\ndecimal = ','\n";
    let problem = problem(&format!("{ARM}[data.columns]\n{map}"));
    let text = "Winkel 1 (°);Winkel 2 (°);X;Y;Z;Prüfer\n1,5;2;3;4;5;Müller\n";
    let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.csv");
    fs::write(&file, latin).unwrap();
    let (rows, warnings) = Measurements::read(std::slice::from_ref(&file), &problem).unwrap();
    assert_eq!((rows.len(), rows.session.names.as_slice()), (1, &["Müller".to_owned()][..]));
    let said = words(&warnings);
    assert!(said.contains("rows.csv:1: not UTF-8 text; read as Windows-1252"), "{said}");
    fs::write(&file, text).unwrap();
    assert_eq!(words(&Measurements::read(&[file], &problem).unwrap().1), "");
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
        let problem = problem(&format!("{ARM}{format}"));
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rows.csv");
        fs::write(&file, &text).unwrap();
        let (rows, warnings) = Measurements::read(&[file], &problem).expect(&text);
        assert_eq!((rows.len(), words(&warnings).as_str()), (1, ""), "{text}");
        assert!((rows.configuration(0)[0].to_degrees() - 1.5).abs() < 1e-9, "{text}");
    }
    // A commented-out header does not hide the one below.
    let (rows, _) =
        read("", "# x_mm,y_mm,z_mm,q1_deg,q2_deg\nq1_deg,q2_deg,x_mm,y_mm,z_mm\n1,2,3,4,5\n", true)
            .unwrap();
    assert!((rows.positions[0].x - 3e-3).abs() < 1e-12);
    let units = read("", "q1_deg,q2_deg,x_mm,y_mm,z_mm\ndeg,deg,mm,mm,mm\n1,2,3,4,5\n", true);
    let error = units.unwrap_err().to_string();
    assert!(error.contains("rows.csv:2: column q1_deg: \"deg\" is a unit"), "{error}");
}

#[test]
fn columns_of_results_are_passed_over_in_silence() {
    let result = "file,line,q1_deg,q2_deg,x_mm,y_mm,z_mm,predicted_x_mm,sigma_x_mm,bound95_mm,extrapolated,reached\n\
                  a.csv,2,1,2,3,4,5,3,0.1,0.2,false,true\n";
    assert_eq!(words(&read("", result, true).unwrap().1), "");
    let other = "q1_deg,q2_deg,x_mm,y_mm,z_mm,line,reached\n1,2,3,4,5,6,true\n";
    let said = words(&read("", other, true).unwrap().1);
    assert!(said.contains("column line: unknown") && said.contains("column reached"), "{said}");
}

#[test]
fn more_sessions_than_can_be_fitted_are_refused_at_once() {
    let rows = |count: usize| -> String {
        let row = |k: usize| format!("{},{},1,2,3,s{k}\n", k % 90, k % 70);
        "q1_deg,q2_deg,x_mm,y_mm,z_mm,session\n".to_owned()
            + &(0..count).map(row).collect::<String>()
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.csv");
    fs::write(&file, rows(1000)).unwrap();
    let arm = |rule: &str| {
        problem(&format!(
            "{ARM}[parameters]\n'base.*' = {rule}\n[data]\nheld_out = {{ fraction = 0.3, seed = 1 }}\n"
        ))
    };
    let read = |rule: &str| Dataset::read_files(std::slice::from_ref(&file), &arm(rule));
    let error = read("{ free = true }").unwrap_err().to_string();
    assert!(
        error.contains("rows.csv: 1000 sessions, each with a base of its own; at most 150"),
        "{error}"
    );
    assert!(read("{ fixed = true }").is_ok());
}
