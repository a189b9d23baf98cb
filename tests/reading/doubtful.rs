//! Tables that are read, but whose rows or columns are doubtful: repeated rows, held values, names
//! of sessions, other units.

use std::fmt::Write as _;

use flexcal::error::{Warning, WarningKind};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;

use crate::common::arms::parse;
use crate::common::program::Folder;
use crate::common::reading::{assert_says, table_error, try_table};

const ARM: &str = "name = 'arm'\n[[joint]]\n[[joint]]\na_m = 0.5\n[[joint]]\na_m = 0.4\n";

/// Returns the problem [`ARM`] with everything held out or fitted by none.
fn arm() -> Problem {
    parse(&format!("{ARM}[data]\nposition_sigma_mm = 0.05\nheld_out = \"none\"\n"))
}

/// Returns `count` rows of a table with the session `session` and positions of `decimals`.
fn rows(count: usize, session: &str, decimals: usize) -> String {
    let mut text = String::new();
    for k in 0..count {
        let at = |factor: f64| 400.0 * (factor * (k as f64 + 1.0)).sin();
        let (q1, q2, q3) = (at(0.7) / 4.0, at(1.3) / 4.0, at(2.1) / 4.0);
        let (x, y, z) = (at(0.31), at(0.53), at(0.77));
        let row = format!("{q1:.3},{q2:.3},{q3:.3},{x:.decimals$},{y:.decimals$},{z:.decimals$}");
        writeln!(text, "{row},{session}").unwrap();
    }
    text
}

const HEADER: &str = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,session\n";

/// Returns the warnings of a table in a file.
fn warnings(text: &str) -> Vec<Warning> {
    let folder = Folder::new();
    folder.write("rows.csv", text);
    Dataset::read_files(&[folder.path("rows.csv")], &arm()).unwrap().1
}

#[test]
fn a_measurement_that_is_given_twice_is_named() {
    let a = rows(20, "A", 4);
    assert_eq!(warnings(&format!("{HEADER}{a}")), []);
    let [of_session] = &warnings(&format!("{HEADER}{a}{}", rows(20, "B", 4)))[..] else { panic!() };
    let is_expected = |kind: &WarningKind| matches!(kind, WarningKind::RowsOfAnotherSession { rows: 20, sessions, .. } if *sessions == ["B", "A"]);
    assert!(is_expected(&of_session.kind), "{of_session:?}");
    assert_eq!(of_session.location.line, Some(22));
    let [rounded] = &warnings(&format!("{HEADER}{a}{}", rows(20, "A", 2)))[..] else { panic!() };
    let WarningKind::RowsRounded { rows: 20, step, .. } = &rounded.kind else {
        panic!("{rounded:?}")
    };
    assert_eq!(step, "0.01");
    // A pose that is measured again differs by more than its digits.
    let moved = rows(20, "A", 2).replace(",A", "1,A");
    assert_eq!(warnings(&format!("{HEADER}{}{moved}", rows(20, "A", 3))), []);
}

#[test]
fn a_position_that_stays_while_the_arm_moves_was_held() {
    let text = rows(20, "A", 4);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
    let held = cells(&lines[7])[3..6].to_vec();
    for line in &mut lines[8..11] {
        let mut row = cells(line);
        row.splice(3..6, held.clone());
        *line = row.join(",");
    }
    let [found] = &warnings(&format!("{HEADER}{}\n", lines.join("\n")))[..] else { panic!() };
    let WarningKind::PositionHeld { rows: 3, .. } = &found.kind else { panic!("{found:?}") };
    assert_eq!(found.location.line, Some(10));
    // A target on the axis of the last joint stays where it is.
    let mut turned = cells(&lines[7]);
    turned[2] = "12.5".to_owned();
    let axis = format!("{HEADER}{}\n{}\n", lines[..8].join("\n"), turned.join(","));
    assert_eq!(warnings(&axis), []);
}

#[test]
fn sessions_that_differ_in_case_alone_are_named() {
    let text = rows(20, "Tag 1", 4).replacen("Tag 1", "tag1", 2);
    let [found] = &warnings(&format!("{HEADER}{text}"))[..] else { panic!() };
    let expected =
        WarningKind::SessionsAlike { name: "tag1".to_owned(), other: "Tag 1".to_owned(), rows: 2 };
    assert_eq!((&found.kind, found.location.line), (&expected, Some(2)));
}

#[test]
fn decimal_points_that_a_spreadsheet_lost_are_named() {
    let text = format!("{HEADER}{}", rows(20, "A", 3));
    assert!(try_table(&arm(), &text).is_ok());
    let error = table_error(&arm(), &text.replace('.', ""));
    assert_says(&error, &["rows.csv:2: all numbers of joints and positions are whole, up to "]);
    assert_says(&error, &["the decimal points were lost"]);
    // Counts of encoders are whole, the positions beside them are not.
    let counts = text.lines().enumerate().map(|(k, line)| {
        let cells = line.split(',').enumerate().map(|(place, cell)| {
            if k > 0 && place < 3 { cell.replace('.', "") } else { cell.to_owned() }
        });
        cells.collect::<Vec<_>>().join(",") + "\n"
    });
    assert!(try_table(&arm(), &counts.collect::<String>()).is_ok());
}

#[test]
fn exchanged_columns_of_loads_are_asked_about() {
    let hoist = "[joint.beam]\nname = 'A'\nEA_N = 1e7\nEIy_N_m2 = 1e4\nEIz_N_m2 = 1e4\n\
                 GJ_N_m2 = 1e4\n[joint.beam.hoist]\nat_m = [0.2, 0, 0]\nforce_N = 62\n";
    let problem = parse(&format!("{ARM}{hoist}[data]\nposition_sigma_mm = 0.05\n"));
    for (payload, force, is_exchanged) in [(60.0, 1.0, true), (1.0, 60.0, false)] {
        let text = rows(12, "A", 4);
        let line = |(k, line): (usize, &str)| {
            let part = k as f64 / 8.0;
            format!("{line},{},{}\n", payload + part, force + part)
        };
        let lines: String = text.lines().enumerate().map(line).collect();
        let header = HEADER.replace('\n', ",payload_kg,hoist_N\n");
        let found = try_table(&problem, &(header + &lines)).unwrap().1;
        let is_named = |of: &Warning| matches!(of.kind, WarningKind::ColumnsExchanged { .. });
        assert_eq!(found.iter().any(is_named), is_exchanged, "{found:?}");
    }
}

#[test]
fn columns_in_other_units_are_named() {
    let with = |column: &str, values: &[&str], problem: &Problem| {
        let text = rows(values.len(), "A", 4);
        let lines = text.lines().zip(values).map(|(line, value)| format!("{line},{value}\n"));
        let header = HEADER.replace('\n', &format!(",{column}\n"));
        try_table(problem, &(header + &lines.collect::<String>())).unwrap().1
    };
    let newtons = with("payload_kg", &["0", "39.2266", "78.4532"], &arm());
    assert!(matches!(newtons[..], [Warning { kind: WarningKind::PayloadInNewtons { .. }, .. }]));
    assert_eq!(with("payload_kg", &["0", "4", "8.5"], &arm()), []);
    assert_eq!(with("payload_kg", &["0", "9.81", "9.81"], &arm()), []);
    let dates = with("Shot", &["2024-05-31 14:03:20", "2024-05-31 14:04:20"], &arm());
    let [Warning { kind: WarningKind::DatesIgnored { name }, .. }] = &dates[..] else {
        panic!("{dates:?}")
    };
    assert_eq!(name, "Shot");
    let far = "[[point]]\nname = 'a'\nat_m = [750, 300, 350]\n[[point]]\nname = 'b'\n\
               [[distance]]\nbetween = ['a', 'b']\nm = 320\n";
    let warnings = parse(&format!("{ARM}{far}")).plausibility_warnings();
    let is_far = |warning: &Warning| matches!(warning.kind, WarningKind::FarFixture { .. });
    assert_eq!(warnings.iter().filter(|warning| is_far(warning)).count(), 2, "{warnings:?}");
    let near = far.replace("750, 300, 350", "7.5, 3, 3.5").replace("m = 320", "mm = 320");
    assert_eq!(parse(&format!("{ARM}{near}")).plausibility_warnings(), []);
    let anchor = parse(&format!("{ARM}[[anchor]]\nname = 'a'\nat_m = [1, 0, 0]\n"));
    let short = "q1_deg,q2_deg,q3_deg,anchor,distance_mm\n1,2,3,a,1.3\n4,5,6,a,1.1\n";
    let said = try_table(&anchor, short).unwrap().1;
    assert!(matches!(said[..], [Warning { kind: WarningKind::ShortDistances { .. }, .. }]));
    assert_eq!(try_table(&anchor, &short.replace("distance_mm", "distance_m")).unwrap().1, []);
}

#[test]
fn columns_under_other_names_are_proposed_all_at_once() {
    let error = table_error(
        &arm(),
        "Name,J1 [deg],J2 [deg],J3 [deg],X (mm),Y (mm),Z (mm)\n1,1,2,3,4,5,6\n",
    );
    let map = "columns = { \"J1 [deg]\" = \"q1_deg\", \"J2 [deg]\" = \"q2_deg\", \"J3 [deg]\" = \
               \"q3_deg\", \"X (mm)\" = \"x_mm\", \"Y (mm)\" = \"y_mm\", \"Z (mm)\" = \"z_mm\" }";
    assert_says(&error, &["rows.csv:1: columns are missing: q1, q2, q3, x, y, z; ", map]);
    let from_two = table_error(&arm(), "q2_deg,q3_deg,q4_deg,x_mm,y_mm,z_mm\n1,2,3,4,5,6\n");
    assert_says(&from_two, &["rows.csv:1: the joints of the table are counted from 2 (q2 to q4)"]);
    let transposed = table_error(&arm(), "q1_deg,1.5,2.5\nq2_deg,3,4\nx_mm,5,6\n");
    assert_says(&transposed, &["rows.csv:1: the table is transposed"]);
    let bars = "| q1_deg | q2_deg | x_mm |\n| --- | --- | --- |\n| 1 | 2 | 3 |\n";
    assert_says(&table_error(&arm(), bars), &["rows.csv:1: a table with bars, as in Markdown"]);
}

#[test]
fn numbers_in_other_notations_are_named() {
    for (cell, words) in [
        ("2 310.123", "has separators of thousands"),
        ("1.4871D+03", "has the exponent of Fortran; write 1.4871E+03"),
        ("-111:25:00", "write degrees with decimals: -111.416667"),
        ("12°30'", "write degrees with decimals: 12.500000"),
    ] {
        let table = format!("{HEADER}{cell},2,3,4,5,6,A\n");
        assert_says(&table_error(&arm(), &table), &["rows.csv:2: column q1_deg: ", words]);
    }
    let side = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,approach2\n1,2,3,4,5,6,R\n";
    assert_says(
        &table_error(&arm(), side),
        &["column approach2: \"R\" is not a direction; write 1"],
    );
}

/// Returns true for the expected kind of warning.
type Expected = fn(&WarningKind) -> bool;

#[test]
fn quantities_that_contradict_the_problem_are_named() {
    let soft = |more: &str| {
        format!(
            "name = 'arm'\n{more}[[joint]]\n[[joint]]\na_m = 0.5\nstiffness_N_m_per_rad = 1e4\n\
             [[joint.body]]\nname = 'a'\nmass_kg = 5\ncom_m = [0.2, 0, 0]\n[[joint]]\na_m = 0.4\n"
        )
    };
    let data = |more: &str| format!("[data]\nposition_sigma_mm = 0.05\nheld_out = 'none'\n{more}");
    let law = |term: &str| {
        let law = format!("law = {{ name = 'a', at = 'joint2', terms = ['{term}'] }}");
        format!("{ARM}{}[[effect]]\n{law}\n", data(""))
    };
    let column = |name: &str, value: &dyn Fn(usize) -> f64| {
        let rows = rows(20, "A", 4);
        let lines = rows.lines().enumerate().map(|(k, line)| format!("{line},{}\n", value(k)));
        format!("{},{name}\n{}", HEADER.trim_end(), lines.collect::<String>())
    };
    let plain = || format!("{HEADER}{}", rows(20, "A", 4));
    let warm = |from: f64| column("temperature_C", &|k| from + 0.1 * k as f64);
    let sides = |least: f64| column("approach2", &|k| if k % 2 == 0 { 1.0 } else { least });
    let reference =
        |value: f64| format!("{ARM}{}", data(&format!("reference_temperature_C = {value}\n")));
    let cases: [(String, String, bool, Expected); 11] = [
        (soft("gravity_m_s2 = [0, 0, 0]\n") + &data(""), plain(), true, |k| {
            matches!(k, WarningKind::NoGravity)
        }),
        (soft("") + &data(""), plain(), false, |k| matches!(k, WarningKind::NoGravity)),
        (reference(68.0), warm(15.0), true, |k| matches!(k, WarningKind::FarReference { .. })),
        (reference(68.0), column("temperature_C", &|k| 15.0 + k as f64), true, |k| {
            matches!(k, WarningKind::FarReference { celsius: Some(_), .. })
        }),
        (reference(20.0), warm(25.0), false, |k| matches!(k, WarningKind::FarReference { .. })),
        (reference(20.0), sides(0.0), true, |k| matches!(k, WarningKind::ApproachWithoutSign)),
        (reference(20.0), sides(-1.0), false, |k| matches!(k, WarningKind::ApproachWithoutSign)),
        (law("sin(360*q2)"), plain(), true, |k| matches!(k, WarningKind::AngleConverted { .. })),
        (law("cos(pi*q2/180 + 1)"), plain(), true, |k| {
            matches!(k, WarningKind::AngleConverted { .. })
        }),
        (law("sin(200*q2)"), plain(), false, |k| matches!(k, WarningKind::AngleConverted { .. })),
        (law("q2/360"), plain(), false, |k| matches!(k, WarningKind::AngleConverted { .. })),
    ];
    for (problem, table, is_warned, expected) in cases {
        let found = try_table(&parse(&problem), &table).unwrap().1;
        assert_eq!(found.iter().any(|w| expected(&w.kind)), is_warned, "{problem}\n{found:#?}");
    }
}

#[test]
fn numbers_that_are_no_readings_are_named_with_their_rows() {
    let header = HEADER.replace("session", "session,temperature_C");
    let with = |temperature: &dyn Fn(usize) -> String| {
        let rows = rows(20, "A", 4);
        let lines = rows.lines().enumerate();
        let lines = lines.map(|(row, line)| format!("{line},{}\n", temperature(row)));
        warnings(&format!("{header}{}", lines.collect::<String>()))
    };
    let usual = |row: usize| format!("{:.1}", 18.0 + 0.37 * row as f64);
    assert_eq!(with(&usual), []);
    for (value, lost) in [("-99.9", 2), ("999", 1), ("0", 3)] {
        let found =
            with(&|row| if row % 7 == 3 && row / 7 < lost { value.into() } else { usual(row) });
        let [found] = &found[..] else { panic!("{value}: {found:?}") };
        let WarningKind::NoReading { rows, others, .. } = &found.kind else { panic!("{found:?}") };
        assert_eq!((*rows, others.len(), found.location.line), (lost, lost - 1, Some(5)));
    }
    // Set temperatures of a chamber repeat, and a single cold morning is a reading.
    assert_eq!(
        with(&|row| ["20", "21", "60"][usize::from(row > 7) + usize::from(row > 15)].into()),
        []
    );
    assert_eq!(with(&|row| if row == 3 { "4.0".into() } else { usual(row) }), []);
}

#[test]
fn a_target_for_each_row_is_asked_about() {
    let rows: String = rows(20, "", 4)
        .lines()
        .enumerate()
        .map(|(row, line)| format!("{line}P{row}\n"))
        .collect::<Vec<_>>()
        .concat();
    let found = warnings(&format!("{}{rows}", HEADER.replace("session", "target")));
    let is_expected =
        |warning: &Warning| matches!(warning.kind, WarningKind::TargetPerRow { rows: 20 });
    assert!(found.iter().any(is_expected), "{found:?}");
}

#[test]
fn a_quaternion_beside_joint_angles_is_recognised_by_its_names() {
    let header = "q1_deg,q2_deg,q3_deg,x_mm,y_mm,z_mm,q1,q2,q3,q4\n1,2,3,1,2,3,0,0,0,1\n";
    let folder = Folder::new();
    folder.write("rows.csv", header);
    let error = Dataset::read_files(&[folder.path("rows.csv")], &arm()).unwrap_err().to_string();
    assert!(error.contains("qx, qy, qz and qw in their order"), "{error}");
}
