//! Two tables of one measurement that programs write in their own ways.

use flexcal::error::{InputError, Warning};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

use crate::common::arms::parse;
use crate::common::program::{Folder, assert_contains};
use crate::common::reading::{assert_says, try_table, words};

const ARM: &str = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n";
const TRACKER: &str = "// job\nPoint, X, Y, Z\nP1, 1000.5, 2.25, 3\nP2, 1100.5, 4.25, 6\n";
const LOG: &str =
    "Stamp;Name;A1;A2\n2026-03-11 09:15:30;P1;10,500;1\n2026-03-11 09:16:36;P2;20,250;2\n";

/// Problem with a tracker table and a log that are joined by name, with decimal commas; `map` is
/// what `[data.columns]` says of times.
fn problem(map: &str) -> String {
    format!(
        "{ARM}[data]\nfiles = ['tracker.txt']\njoints = {{ files = ['log.csv'], by = 'name' }}\n\
         [data.columns]\n{map}'Point' = 'pose'\n'Name' = 'pose'\n'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n\
         'X' = 'x_mm'\n'Y' = 'y_mm'\n'Z' = 'z_mm'\n[data.format]\ndecimal = ','\n"
    )
}

fn read(map: &str, tracker: &str, log: &str) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = Folder::with([
        ("problem.toml", &*problem(map)),
        ("tracker.txt", tracker),
        ("log.csv", log),
    ]);
    let problem = Problem::read(&folder.path("problem.toml"))?;
    Measurements::read(&problem.data.files, &problem)
}

#[test]
fn dates_of_the_joint_table_are_times_under_either_name() {
    let named = LOG.replace("Stamp", "time");
    let slashed = LOG.replace("2026-03-11", "3/14/2026");
    let days = [("'Stamp' = 'time'\n", LOG), ("'Stamp' = 'time_s'\n", LOG), ("", &named)];
    for (map, log) in days.into_iter().chain([("'Stamp' = 'time'\n", &*slashed)]) {
        let (rows, warnings) = read(map, TRACKER, log).unwrap();
        assert!(rows.time_measured && rows.has_dates(), "{log}");
        assert!((rows.time[1] - rows.time[0] - 66.0).abs() < 1e-6, "{log}");
        assert!(warnings.is_empty() || !map.is_empty(), "{}", words(&warnings));
    }
    // Dates without a name are proposed as times.
    let (_, warnings) = read("", TRACKER, LOG).unwrap();
    assert_contains(&words(&warnings), &["log.csv:1: column Stamp", "\"Stamp\" = \"time\""]);
    let wrong = read("'Stamp' = 'time'\n", TRACKER, &LOG.replace("2026-03-11 09:15:30", "soon"));
    assert_says(&wrong.unwrap_err(), &["log.csv:2: column Stamp: \"soon\" is neither"]);
}

#[test]
fn a_map_the_wrong_way_round_and_times_without_a_name_are_named_in_joint_tables() {
    let problem = |map: &str| {
        format!(
            "{ARM}[data]\nfiles = ['tracker.txt']\njoints = {{ files = ['log.csv'], by = 'time' }}\n\
             [data.columns]\n{map}[data.format]\ndecimal = ','\n"
        )
    };
    let error = |map: &str| {
        let (problem, log) = (problem(map), LOG.replace("Stamp;Name", "Name;Stamp"));
        let log = log.replace("2026-03-11 09:15:30;P1", "P1;2026-03-11 09:15:30");
        let folder = Folder::with([
            ("problem.toml", &*problem),
            ("tracker.txt", TRACKER),
            ("log.csv", &log),
        ]);
        let problem = Problem::read(&folder.path("problem.toml")).unwrap();
        Measurements::read(&problem.data.files, &problem).unwrap_err()
    };
    let turned = "'time' = 'Stamp'\n'q1_deg' = 'A1'\n'q2_deg' = 'A2'\n'x_mm' = 'X'\n";
    assert_says(&error(turned), &["theirs = ours, and \"q1_deg\" is a name of flexcal"]);
    let named = "'A1' = 'q1_deg'\n'A2' = 'q2_deg'\n";
    assert_says(&error(named), &["column time_s or time: missing", "\"Stamp\" = \"time"]);
}

#[test]
fn dates_are_paired_with_milliseconds_since_the_start_of_a_controller() {
    let second = |k: u32| 20 * k + k * k % 13;
    let date = |k: u32| format!("2026-03-11T09:{:02}:{:02}Z", second(k) / 60, second(k) % 60);
    let measured: String =
        (0..12).map(|k| format!("{k},2,3,{}\n", date(k))).collect::<Vec<_>>().concat();
    let logged: String = (0..12)
        .map(|k| format!("{},{k},7\n", 1000 * second(k) + 5_000_000))
        .collect::<Vec<_>>()
        .concat();
    let read = |more: &str| {
        let text = format!(
            "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['log.csv'], by = 'time'{more} }}\n\
             [data.columns]\n'When' = 'time'\n't_ms' = 'time_ms'\n"
        );
        let folder = Folder::with([
            ("problem.toml", &*text),
            ("tracker.csv", &*format!("x_mm,y_mm,z_mm,When\n{measured}")),
            ("log.csv", &*format!("t_ms,q1_deg,q2_deg\n{logged}")),
        ]);
        let problem = Problem::read(&folder.path("problem.toml"))?;
        Measurements::read(&problem.data.files, &problem)
    };
    // 2026-03-11T09:00Z, without the 5000 s since the start.
    let offset = "offset_s = 1773214600.0";
    assert_says(&read("").unwrap_err(), &[&format!("write {offset} in joints")]);
    let (rows, _) = read(&format!(", {offset}")).unwrap();
    assert!(rows.has_dates() && rows.len() == 12);
    assert!((rows.configuration(11)[0].to_degrees() - 11.0).abs() < 1e-9);
}

#[test]
fn numbers_in_a_column_of_times_without_a_unit_are_named() {
    for (time, words) in [
        ("1742289126700", "a number of milliseconds since 1970, 2025-03-18 09:12:06; call"),
        (
            "1742289126",
            "a number of seconds since 1970, 2025-03-18 09:12:06; call the column time_s",
        ),
        (
            "45734.383414",
            "a day number of a spreadsheet it is 2025-03-18 09:12:07: then format the",
        ),
        ("739694.383414", "as a day number of MATLAB it is 2025-03-18 09:12:07"),
        ("12.5", "a number without a unit; call the column time_s"),
    ] {
        let text = format!(
            "{ARM}[data]\nfiles = ['tracker.csv']\n\
             joints = {{ files = ['log.csv'], by = 'time' }}\n"
        );
        let folder = Folder::with([
            ("problem.toml", &*text),
            ("tracker.csv", &*format!("x_mm,y_mm,z_mm,time\n1,2,3,{time}\n2,2,3,{time}\n")),
            ("log.csv", "time,q1_deg,q2_deg\n2026-03-11T09:00:00,1,2\n2026-03-11T09:01:00,1,3\n"),
        ]);
        let problem = Problem::read(&folder.path("problem.toml")).unwrap();
        let error = Measurements::read(&problem.data.files, &problem).unwrap_err();
        assert_says(&error, &["tracker.csv:2: column time: ", words]);
    }
}

#[test]
fn errors_show_the_line_of_the_file_they_name() {
    let shown = |error: InputError| {
        let excerpt = error.location.excerpt.clone().unwrap();
        let marked = excerpt.text.get(excerpt.span.clone()).unwrap().to_owned();
        (excerpt.text.to_string(), excerpt.first_line, marked)
    };
    let broken = LOG.replace("20,250", "20,2x0");
    let error = shown(read("", TRACKER, &broken).unwrap_err());
    let line = "2026-03-11 09:16:36;P2;20,2x0;2".to_owned();
    assert_eq!(error, (line, 3, "20,2x0".to_owned()));
    let broken = TRACKER.replace("4.25", "4.2x");
    let error = shown(read("", &broken, LOG).unwrap_err());
    assert_eq!(error, ("P2, 1100.5, 4.2x, 6".to_owned(), 4, " 4.2x".to_owned()));
}

#[test]
fn the_two_tables_may_have_different_decimal_marks() {
    let positions = |tracker: &str, log: &str| {
        let (rows, _) = read("", tracker, log)?;
        assert!((rows.positions[0].x - 1.0005).abs() < 1e-12);
        assert!((rows.configuration(1)[0].to_degrees() - 20.25).abs() < 1e-9);
        Ok::<(), InputError>(())
    };
    let blanks = TRACKER.replace("// job\n", "").replace(',', "");
    let tabs = blanks.replace(' ', "\t");
    let (tracker_commas, log_points) =
        (tabs.replace('.', ","), LOG.replace("10,500", "10,5").replace(',', "."));
    for (tracker, log) in [
        (TRACKER, LOG),
        (&*blanks, LOG),
        (&*tabs, LOG),
        (&*tracker_commas, LOG),
        (&*tracker_commas, &*log_points),
    ] {
        positions(tracker, log).unwrap();
    }
    // Points that may separate thousands are refused, with a way out.
    let doubtful = "Point\tX\tY\tZ\nP1\t100.500\t2.250\t3\nP2\t110.500\t4.250\t6\n";
    let error = read("", doubtful, LOG).unwrap_err();
    let words =
        "write the number with a comma and without thousands separators, or correct decimal";
    assert_says(&error, &["tracker.txt:2: column X: \"100.500\"", words]);
    let mixed = tabs.replace("4.25", "4,25");
    assert_says(&read("", &mixed, LOG).unwrap_err(), &["\"1000.5\" has a decimal point"]);
}

#[test]
fn a_column_of_the_joint_table_is_missed_in_its_name() {
    let folder = Folder::with([
        ("problem.toml", &*problem("'Stamp' = 'time'\n")),
        ("tracker.txt", TRACKER),
        ("log.csv", LOG),
        ("plan.csv", "pose,q1_deg,q2_deg,x_mm,y_mm,z_mm\n1,5.5,6,1010,7,8\n"),
    ]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let files = ["tracker.txt", "plan.csv"].map(|name| folder.path(name));
    let error = Measurements::read(&files, &problem).unwrap_err();
    assert_says(
        &error,
        &["plan.csv:1: column time", "log.csv has this column, this file does not"],
    );
    assert!(!error.to_string().contains("tracker.txt"));
    folder.edit("plan.csv", "z_mm\n1", "z_mm,time\n1");
    folder.edit("plan.csv", "8\n", "8,2026-03-12 08:00:00\n");
    assert_eq!(Measurements::read(&files, &problem).unwrap().0.len(), 3);
}

#[test]
fn a_plan_is_read_by_its_names_whatever_the_names_of_two_tables() {
    let folder = Folder::with([
        ("problem.toml", &*problem("'Dag' = 'date'\n'time' = 'time'\n")),
        (
            "plan.csv",
            "pose,q1_deg,q2_deg,x_mm,y_mm,z_mm,time\n1,5.5,6,1010,7,8,2026-03-12 08:00:00\n",
        ),
    ]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let (rows, _) = Measurements::read(&[folder.path("plan.csv")], &problem).unwrap();
    assert!(rows.len() == 1 && rows.has_dates());
}

#[test]
fn few_names_in_another_spelling_are_hinted_at() {
    let log: Vec<String> = (1..=8).map(|k| format!("P0{k};{k},5;1\n")).collect();
    let log = log.concat();
    let tracker = |name: fn(usize) -> String| {
        let rows = (1..=8).map(|k| format!("{}, {k}.5, 2.25, 3\n", name(k)));
        format!("Point, X, Y, Z\n{}", rows.collect::<String>())
    };
    let log = format!("Name;A1;A2\n{log}");
    let some = tracker(|k| if k < 3 { format!("P{k}") } else { format!("P0{k}") });
    let (_, warnings) = read("", &some, &log).unwrap();
    let said = words(&warnings);
    assert_contains(
        &said,
        &["2 of them differ from a partner only in spelling, as \"P1\" and \"P01\": write"],
    );
    assert_eq!(said.matches("spelling").count(), 1, "{said}");
    let (_, warnings) =
        read("", &tracker(|k| if k < 3 { format!("Q{k}") } else { format!("P0{k}") }), &log)
            .unwrap();
    assert!(!words(&warnings).contains("spelling"));
}

#[test]
fn columns_of_a_table_without_a_header_are_selected_by_place() {
    let error = read("", "P1, 1000.5, 2.25, 3\nP2, 1100.5, 4.25, 6\n", LOG).unwrap_err();
    assert_says(&error, &["tracker.txt:1", "the first line holds numbers", "\"#1\" = \"pose\""]);
    assert!(!error.to_string().contains("\"P1\" ="), "{error}");
}

/// Times \[s\] of 40 stops of a log, with a row on the way to each, and of the readings of a tracker,
/// which follow the stops by 2 to 3.5 s on another clock.
fn stops() -> (Vec<f64>, Vec<f64>) {
    let mut random = 1_u32;
    let mut draw = |from: f64, to: f64| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        from + (to - from) * f64::from(random >> 8) / f64::from(1_u32 << 24)
    };
    let (mut time, mut log, mut read) = (1000.0, Vec::new(), Vec::new());
    for _ in 0..40 {
        time += draw(6.0, 13.0);
        log.push(time);
        time += draw(6.0, 13.0);
        log.push(time);
        read.push(time + draw(2.0, 3.5) - 127.6);
    }
    (log, read)
}

/// Reads tables of the given times, joined by time with `more` in the braces.
fn read_times(
    more: &str,
    log: &[f64],
    measured: &[f64],
) -> Result<(Measurements, Vec<Warning>), InputError> {
    read_given(more, log, measured, false)
}

/// Reads tables like [`read_times`]. If `is_given` is true, the joint table is given with the
/// measurements, instead of one that the problem names.
fn read_given(
    more: &str,
    log: &[f64],
    measured: &[f64],
    is_given: bool,
) -> Result<(Measurements, Vec<Warning>), InputError> {
    let text = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['log.csv'], by = 'time'{more} }}\n"
    );
    let rows = |times: &[f64], more: &str| {
        let row = |(k, time): (usize, &f64)| format!("{time:.1},{k},1{more}\n");
        times.iter().enumerate().map(row).collect::<String>()
    };
    let tracker = format!("time_s,x_mm,y_mm,z_mm\n{}", rows(measured, ",2"));
    let log = format!("time_s,q1_deg,q2_deg\n{}", rows(log, ""));
    let folder =
        Folder::with([("problem.toml", &*text), ("tracker.csv", &tracker), ("log.csv", &log)]);
    let mut problem = Problem::read(&folder.path("problem.toml"))?;
    problem.data.joint_log.as_mut().unwrap().is_given = is_given;
    Measurements::read(&problem.data.files, &problem)
}

#[test]
fn the_offset_of_the_clocks_is_named_whatever_the_tolerance() {
    let (log, measured) = stops();
    for tolerance in [0.05, 0.2, 0.5, 1.2, 1.5, 2.0, 4.0, 5.0, 10.0, 60.0, 999.0] {
        let more = format!(", tolerance_s = {tolerance}");
        let found = read_times(&more, &log, &measured);
        // A declared tolerance is not replaced.
        assert_eq!(found.is_ok(), tolerance > 0.9, "{tolerance}");
        let said = match found {
            Ok((rows, warnings)) => {
                assert!(rows.len() >= 38, "{}", rows.len());
                words(&warnings)
            }
            Err(error) => error.to_string(),
        };
        assert!(said.contains("offset_s = -124.") || said.contains("offset_s = -125."), "{said}");
        assert_eq!(said.contains(" and tolerance_s = "), tolerance < 0.9, "{said}");
        // One that is declared is not replaced.
        let error = read_times(&format!("{more}, offset_s = 3.5"), &log, &measured).unwrap_err();
        assert_contains(&error.to_string(), &["write offset_s = -12"]);
    }
    let (rows, warnings) = read_times("", &log, &measured).unwrap();
    assert!(rows.len() >= 38 && words(&warnings).contains(" and tolerance_s = "));
    // Nor is an offset of 0 that is written.
    assert!(read_times(", offset_s = 0", &log, &measured).is_err());
    let (rows, warnings) =
        read_times(", offset_s = -124.8, tolerance_s = 1.1", &log, &measured).unwrap();
    assert_eq!((rows.len(), words(&warnings)), (40, String::new()));
    let (rows, warnings) =
        read_times(", offset_s = -124.8, tolerance_s = 0.6", &log, &measured).unwrap();
    assert!((30..40).contains(&rows.len()), "{}", rows.len());
    assert_contains(&words(&warnings), &["; tolerance_s = 0.", " would pair them too"]);
    // A joint table that is given with new measurements has a clock of its own.
    let (rows, warnings) = read_given(", offset_s = 3.5", &log, &measured, true).unwrap();
    assert!(rows.len() >= 38, "{}", rows.len());
    assert_contains(&words(&warnings), &["log.csv: its clock differs", "offset_s = -12"]);
    // Readings that follow their stops by seconds on one clock are paired rightly.
    let late: Vec<f64> = measured.iter().map(|time| time + 127.6).collect();
    assert_eq!(read_times(", tolerance_s = 4", &log, &late).unwrap().0.len(), 40);
}

#[test]
fn whole_seconds_and_a_row_logged_twice_leave_the_offset_certain() {
    let (log, mut measured) = stops();
    measured.clear();
    measured.extend(log.iter().step_by(2).map(|time| (time + 3604.2).floor()));
    let mut twice = log.clone();
    twice.insert(21, log[20] + 0.004);
    let text = |times: &[f64]| {
        let rows = times.iter().map(|time| {
            let nearest = log.iter().position(|stop| (stop - time).abs() < 0.01).unwrap();
            format!("{time:.3},{nearest},1\n")
        });
        "time_s,q1_deg,q2_deg\n".to_owned() + &rows.collect::<String>()
    };
    let tracker = measured.iter().enumerate().map(|(k, time)| format!("{time:.0},{k},1,2\n"));
    let tracker = "time_s,x_mm,y_mm,z_mm\n".to_owned() + &tracker.collect::<String>();
    let problem = format!(
        "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['log.csv'], by = 'time' }}\n"
    );
    let folder = Folder::with([
        ("problem.toml", &*problem),
        ("tracker.csv", &tracker),
        ("log.csv", &text(&twice)),
    ]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    let (rows, warnings) = Measurements::read(&problem.data.files, &problem).unwrap();
    assert_eq!(rows.len(), 40);
    assert_contains(&words(&warnings), &["its clock differs", "offset_s = 360"]);
}

#[test]
fn a_join_that_loses_most_rows_is_refused_and_one_at_equal_steps_knows_its_shifts() {
    let every = |start: f64| (0..50).map(|k| f64::from(k) * 30.0 + start).collect::<Vec<f64>>();
    let mut measured = every(35.2);
    measured.iter_mut().skip(40).for_each(|time| *time -= 35.2);
    let lost = read_times(", tolerance_s = 2", &every(0.0), &measured).unwrap_err();
    assert_says(
        &lost,
        &["40 of 50 measured rows have no partner", "typically 5.2 s away", "no other offset"],
    );
    // An instrument that also measures between the poses of the joint table.
    let often: Vec<f64> = (0..1500).map(|k| f64::from(k) + 0.2).collect();
    let (rows, warnings) = read_times(", tolerance_s = 0.3", &every(0.0), &often).unwrap();
    assert_eq!(rows.len(), 50);
    assert_contains(&words(&warnings), &["1450 "]);
    let rows = read_times(", tolerance_s = 40", &every(0.0), &every(35.2)).unwrap().0;
    let before = rows.clock_offsets.iter().find(|(by, _)| *by == 1).unwrap().1;
    assert!((before - 35.2).abs() < 1e-6, "{before}");
}

#[test]
fn a_date_and_a_time_of_day_in_two_columns_are_one_instant() {
    let tracker = |header: &str, day: &str| {
        format!("{header}\n{day},23:59:50.5,1,2,3\n{day},23:59:58,4,5,6\n")
    };
    let read = |map: &str, tracker: &str, log: &str| {
        let text = format!(
            "{ARM}[data]\nfiles = ['tracker.csv']\njoints = {{ files = ['log.csv'], by = 'time' }}\n{map}"
        );
        let folder =
            Folder::with([("problem.toml", &*text), ("tracker.csv", tracker), ("log.csv", log)]);
        let problem = Problem::read(&folder.path("problem.toml"))?;
        Measurements::read(&problem.data.files, &problem)
    };
    let log = "Datum;Uhrzeit;q1_deg;q2_deg\n05.11.2026;23:59:50.5;1;2\n05.11.2026;23:59:58;3;4\n";
    let other = log.replace("Datum;Uhrzeit", "Tag;Stunde");
    let map = "[data.columns]\n'Tag' = 'date'\n'Stunde' = 'time'\n";
    let times = "[data.columns]\n'Time' = 'time'\n'Uhrzeit' = 'time'\n";
    for (map, header, day, log) in [
        ("", "Date,Time,x_mm,y_mm,z_mm", "05.11.2026", log),
        ("", "Date,Time,x_mm,y_mm,z_mm", "05-NOV-26", log),
        ("", "Date,Time,x_mm,y_mm,z_mm", "2026. 11. 5.", log),
        ("", "DATE,time,x_mm,y_mm,z_mm", "2026-11-05", log),
        ("", "Datum,Zeit,x_mm,y_mm,z_mm", "2026-11-05 00:00:00", log),
        (times, "Date,Time,x_mm,y_mm,z_mm", "05.11.2026", log),
        (map, "Date,Time,x_mm,y_mm,z_mm", "05.11.2026", &*other),
        (map, "Tag,Stunde,x_mm,y_mm,z_mm", "05.11.2026", &*other),
    ] {
        let (rows, warnings) = read(map, &tracker(header, day), log).unwrap();
        assert_eq!((rows.len(), words(&warnings)), (2, String::new()), "{header}");
        assert!(rows.has_dates() && (rows.time[1] - rows.time[0] - 7.5).abs() < 1e-6);
    }
    let ambiguous = read("", &tracker("Date,Time,x_mm,y_mm,z_mm", "05/11/2026"), log).unwrap_err();
    assert_says(&ambiguous, &["05/11/2026 23:59:50.5", "either order"]);
    let dateless = log.replace("Datum", "Day").replace("05.11.2026", "5");
    let dateless = read("", &tracker("Date,Time,x_mm,y_mm,z_mm", "05.11.2026"), &dateless);
    assert_says(&dateless.unwrap_err(), &["column time_s or time: missing"]);
    let mapped = "[data.columns]\n'Stunde' = 'time'\n";
    let alone = other.replace("Tag", "D");
    let alone = read(mapped, &tracker("Date,Time,x_mm,y_mm,z_mm", "05.11.2026"), &alone);
    assert_says(&alone.unwrap_err(), &["its date is missing", "\"…\" = \"date\""]);
}

#[test]
fn names_and_numbers_of_rows_that_do_not_agree_are_refused_with_a_remedy() {
    let tracker: Vec<String> = (1..=8).map(|k| format!("pose_00{k}, {k}.5, 2.25, 3\n")).collect();
    let tracker = tracker.concat();
    let tracker = format!("Point, X, Y, Z\n{tracker}");
    let log: Vec<String> = (1..=9).map(|k| format!("VIA{k};{k},5;1\nMP{k};{k},5;1\n")).collect();
    let log = log.concat();
    let log = format!("Name;A1;A2\n{log}");
    assert_says(
        &read("", &tracker, &log).unwrap_err(),
        &[
            "8 of 8 measured rows have no partner of the same name",
            "only in the letters about their number, as \"pose_001\" and \"MP1\"",
        ],
    );
    let folder = Folder::with([
        ("problem.toml", &*problem("").replace("by = 'name'", "by = 'order'")),
        ("tracker.txt", &tracker),
        ("log.csv", &log.replace("VIA", "Z").lines().take(11).collect::<Vec<_>>().join("\n")),
    ]);
    let problem = Problem::read(&folder.path("problem.toml")).unwrap();
    assert_says(
        &Measurements::read(&problem.data.files, &problem).unwrap_err(),
        &["the joint table has 10 rows for 8 measured rows", "by = \"time\" or by = \"name\""],
    );
}

#[test]
fn many_unknown_columns_are_listed_in_one_warning() {
    let names: Vec<String> = (1..=25).map(|k| format!("extra {k}")).collect();
    let table =
        format!("q1_deg,q2_deg,x_mm,y_mm,z_mm,{}\n1,2,3,4,5{}\n", names.join(","), ",7".repeat(25));
    let (_, warnings) = try_table(&parse(ARM), &table).unwrap();
    assert_eq!(warnings.len(), 1, "{warnings:?}");
    assert_contains(
        &words(&warnings),
        &["rows.csv:1: unknown columns; ignored", &names.join(", ")],
    );
}
